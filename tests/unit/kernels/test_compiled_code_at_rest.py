"""Machine code that was damaged at rest, as by a power cut, is compiled again."""

import importlib
import sys

import pytest

KERNEL = """
from turing_learning.kernels.compile import compile_cached

def double(x):
    return 2 * x

double = compile_cached(double, notice="a double (1 s)")
"""


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """Import a small kernel anew, with the cache files that are there."""
    (tmp_path / "small_kernel.py").write_text(KERNEL)
    monkeypatch.syspath_prepend(tmp_path)

    def imported():
        sys.modules.pop("small_kernel", None)
        importlib.invalidate_caches()
        return importlib.import_module("small_kernel").double

    yield imported
    sys.modules.pop("small_kernel", None)


def emptied(content):
    return b""


def halved(content):
    return content[: len(content) // 2]


def flipped(content):
    return content[:-100] + bytes([content[-100] ^ 1]) + content[-99:]


@pytest.mark.parametrize("damage", [emptied, halved, flipped])
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_damaged_machine_code_is_compiled_again(kernel, tmp_path, damage, suffix):
    assert kernel()(3.0) == 6.0
    (file,) = (tmp_path / "__pycache__").glob(f"*{suffix}")
    file.write_bytes(damage(file.read_bytes()))
    again = kernel()
    assert again(4.0) == 8.0
    assert not again.stats.cache_hits
    whole = kernel()
    assert whole(5.0) == 10.0
    assert whole.stats.cache_hits


def test_the_log_says_when_something_is_compiled(kernel, caplog):
    caplog.set_level("INFO", "turing_learning.kernels")
    kernel()(1.0)
    assert caplog.messages == ["Compiling a double (1 s), once on this machine."]
    kernel()(2.0)
    assert len(caplog.messages) == 1


def test_the_log_calls_what_is_compiled_anew_for_other_arguments_another(kernel, tmp_path, caplog):
    (tmp_path / "small_kernel.py").write_text(KERNEL.replace("a double", "{} double"))
    caplog.set_level("INFO", "turing_learning.kernels")
    double = kernel()
    double(1.0)
    double(1)
    assert [each.split()[1] for each in caplog.messages] == ["this", "another"]


def test_no_temporary_files_are_left(kernel, tmp_path):
    kernel()(1.0)
    assert not list((tmp_path / "__pycache__").glob(".*.partial"))
