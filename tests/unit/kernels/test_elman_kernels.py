"""The compiled judge: vectorized, accurate, and cached without trusting the cache."""

import os
import re
import subprocess
import sys

import llvmlite.binding
import numpy as np
import pytest
from scipy.optimize import linprog

from turing_learning.kernels import elman, elman_source

ROUND_TRIP = """
import sys
from turing_learning.kernels.elman import load_elman
judge = load_elman(1, 1).judge
print(sum(judge.stats.cache_hits.values()), sum(judge.stats.cache_misses.values()))
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(elman.CACHE_VARIABLE, str(tmp_path))
    elman.load_elman.cache_clear()
    yield tmp_path
    elman.load_elman.cache_clear()


def run_process(folder):
    environment = os.environ | {elman.CACHE_VARIABLE: str(folder)}
    return subprocess.Popen(
        [sys.executable, "-c", ROUND_TRIP],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


def finish(process):
    output, errors = process.communicate(timeout=100)
    assert process.returncode == 0, errors
    return output.split()


def judges_zeros_as_half(kernels):
    lanes = elman_source.LANES
    outputs = np.zeros((1, lanes), np.float32)
    kernels.judge(
        0, 1, np.zeros((1, 1, 1, lanes), np.float32), np.zeros((1, 5), np.float32), outputs
    )
    return (outputs == 0.5).all()


@pytest.mark.parametrize(("inputs", "hidden"), [(2, 5), (3, 14)])
def test_the_judge_is_vectorized(inputs, hidden):
    if not llvmlite.binding.get_host_cpu_features().get("fma"):
        pytest.skip("this processor has no fused multiply-add for AVX registers")
    source = elman_source.elman_source(
        inputs, hidden, cache=False
    )  # Numba cannot show the assembly of cached code
    fresh = elman._run("fresh", source, "<fresh>")
    assembly = "\n".join(fresh.judge.inspect_asm().values())
    packed = len(re.findall(r"\bvfn?m(?:add|sub)\d+ps\b.*%[yz]mm", assembly))
    scalar = len(re.findall(r"\bvfn?m(?:add|sub)\d+ss\b", assembly))
    assert packed > scalar  # some scalar ones remain: the way out if arrays overlapped


def fitted_error(saturation):
    """Return the smallest error of a fit z P(u) / Q(u) of tanh(z / 2) / 2 that passes 1/2 at saturation."""
    z = np.linspace(0, 1, 700)[1:] * saturation
    terms = len(elman_source.NUMERATOR)
    powers, target = (z / saturation)[:, None] ** (2 * np.arange(4)), np.tanh(z / 2) / 2

    def feasible(error):
        upper = np.hstack([z[:, None] * powers[:, :terms], -(target + error)[:, None] * powers])
        lower = np.hstack([-z[:, None] * powers[:, :terms], (target - error)[:, None] * powers])
        end = np.hstack([-saturation * powers[-1, :terms], (0.5 + 8e-7) * powers[-1]])
        rows = np.vstack([upper, lower, end])
        limits = {
            "A_ub": np.delete(rows, terms, axis=1),
            "b_ub": -rows[:, terms],
            "bounds": (None, None),
        }
        return linprog(np.zeros(rows.shape[1] - 1), method="highs-ipm", **limits).status == 0

    low, high = 1e-7, 1e-4
    for _ in range(12):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if feasible(middle) else (middle, high)
    return high


def sigmoid_in_single_precision(z):
    f = np.float32
    u = np.minimum(z * z, f(elman_source.SATURATION**2))
    p = np.polyval(np.float32(elman_source.NUMERATOR[::-1]), u)
    q = np.polyval(np.float32(elman_source.DENOMINATOR[::-1]), u)
    return np.clip(f(0.5) + (z * p) * (f(1) / q), f(0), f(1))


def test_the_committed_fit_keeps_its_error_bound():
    z = np.concatenate(
        [np.linspace(-20, 20, 400_001), *np.multiply.outer([-1, 1], np.logspace(-9, 18, 10_001))]
    )
    z = z.astype(np.float32)
    exact = 0.5 * (1 + np.tanh(z.astype(np.float64) / 2))
    assert np.abs(sigmoid_in_single_precision(z) - exact).max() < elman_source.SIGMOID_ERROR


def test_the_committed_fit_is_nearly_the_best_of_its_degree():
    assert fitted_error(elman_source.SATURATION) > 0.4 * elman_source.SIGMOID_ERROR


def test_saturated_neurons_are_exactly_zero_and_one():
    z = np.float32([15.6, 100, 1e10, 2.5e18])
    np.testing.assert_array_equal(sigmoid_in_single_precision(z), np.float32(1))
    np.testing.assert_array_equal(sigmoid_in_single_precision(-z), np.float32(0))


def test_a_second_process_loads_what_the_first_compiled(tmp_path):
    assert finish(run_process(tmp_path)) == ["0", "1"]
    assert finish(run_process(tmp_path)) == ["1", "0"]


def test_processes_that_start_together_share_a_fresh_cache(tmp_path):
    processes = [run_process(tmp_path) for _ in range(2)]
    assert all(finish(process) in (["0", "1"], ["1", "0"]) for process in processes)
    assert finish(run_process(tmp_path)) == ["1", "0"]


def test_an_altered_module_is_replaced_and_never_run(folder):
    elman.load_elman(1, 1)
    (path,) = (folder / "kernels").glob("elman_1_1_*.py")
    original = path.read_text()
    path.write_text("raise SystemExit('altered')\n")
    elman.load_elman.cache_clear()
    elman.load_elman(1, 1)
    assert path.read_text() == original


def test_a_folder_that_cannot_be_written_means_compiling_in_memory(tmp_path, folder, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(elman.CACHE_VARIABLE, str(tmp_path / "file" / "below"))
    assert judges_zeros_as_half(elman.load_elman(1, 1))


def test_a_damaged_compiled_file_means_compiling_in_memory(folder):
    elman.load_elman(1, 1)
    for path in (folder / "kernels" / "__pycache__").glob("*.nb[ic]"):
        path.write_bytes(b"damaged")
    elman.load_elman.cache_clear()
    assert judges_zeros_as_half(elman.load_elman(1, 1))


def test_the_cache_is_the_users_unless_the_environment_names_another(monkeypatch, tmp_path):
    monkeypatch.delenv(elman.CACHE_VARIABLE, raising=False)
    assert elman.cache_folder().parent.name == "turing-learning"
    monkeypatch.setenv(elman.CACHE_VARIABLE, str(tmp_path))
    assert elman.cache_folder() == tmp_path / "kernels"
