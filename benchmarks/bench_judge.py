"""Judging at the paper's size (100 classifiers 2-5-1, 1100 samples, 100 steps) and its share of the machine's peak.

Run with ``pytest benchmarks/bench_judge.py -p benchmark --benchmark-only -s``.
"""

import math
import re
import time
from functools import lru_cache

import numpy as np
import pytest
from numba import float32, int64, njit, void

from turing_learning.classifiers import ElmanClassifier
from turing_learning.kernels.parallel import default_threads, run_range

CLASSIFIERS, SAMPLES, STEPS = 100, 1100, 100
FLOATS = 16  # of a 512-bit vector; a machine with shorter vectors does the same arithmetic in more operations
# 35 multiply-adds and 5 sigmoids of 11 vector operations (the output neuron is needed in the last step only).
OPERATIONS_PER_STEP = 35 + 5 * 11
CHAINS, LENGTH, LANES = (
    16,
    32,
    32,
)  # independent chains hide the latency of a multiply-add; each LANES wide


@lru_cache(maxsize=1)
def multiply_add_loop():
    """Return a compiled loop of CHAINS * LENGTH * LANES multiply-adds per iteration on registers."""
    read = "".join(f"            v{k} = state[{k * LANES} + lane]\n" for k in range(CHAINS))
    work = "".join(f"            v{k} = v{k} * a + b\n" for k in range(CHAINS)) * LENGTH
    write = "".join(f"            state[{k * LANES} + lane] = v{k}\n" for k in range(CHAINS))
    text = (
        "def loop(start, stop, a, b, result):\n"
        f"    state = np.ones({CHAINS * LANES}, np.float32)\n"
        "    for i in range(start, stop):\n"
        f"        for lane in range({LANES}):\n{read}{work}{write}"
        "    result[0] = state.sum()\n"
    )
    names = {"np": np}
    exec(text, names)  # noqa: S102
    signature = void(int64, int64, float32, float32, float32[::1])
    return njit(signature, fastmath={"contract", "nsz"}, error_model="numpy", nogil=True)(
        names["loop"]
    )


def peak(threads):
    """Return this machine's single-precision multiply-adds per second, in vectors of 512 bits."""
    loop, iterations, result = multiply_add_loop(), 2000 * threads, np.empty(1, np.float32)
    assembly = "\n".join(loop.inspect_asm().values())
    if not re.search(r"vfmadd\d+ps.*%[yz]mm|fmla\s+v", assembly):
        pytest.skip("the multiply-add loop was not vectorized on this machine")
    best = math.inf
    for _ in range(100):
        start = time.perf_counter()
        run_range(loop, iterations, threads, np.float32(0.5), np.float32(0.5), result)
        best = min(best, time.perf_counter() - start)
    return iterations * CHAINS * LENGTH * LANES / FLOATS / best


def bound(threads):
    """Return the shortest possible time (s)."""
    steps = CLASSIFIERS * SAMPLES * STEPS
    return steps * OPERATIONS_PER_STEP / FLOATS / peak(threads)


@pytest.mark.parametrize("threads", sorted({1, default_threads()}))
def test_judging_one_generation(benchmark, threads):
    rng = np.random.default_rng(1)
    classifier = ElmanClassifier(threads=threads)
    genomes = rng.uniform(-1, 1, (CLASSIFIERS, classifier.parameters))
    samples = rng.normal(size=(SAMPLES, STEPS, 2))
    classifier.judge(genomes, samples)
    limit = bound(threads)
    benchmark.pedantic(classifier.judge, (genomes, samples), rounds=200, warmup_rounds=10)
    limit = min(limit, bound(threads))
    median, shortest = benchmark.stats.stats.median, benchmark.stats.stats.min
    benchmark.extra_info.update(bound_ms=1e3 * limit, share_of_bound=limit / shortest)
    print(
        f"\njudge, {threads} threads: median {1e3 * median:.2f} ms, shortest {1e3 * shortest:.2f} ms; "
        f"bound {1e3 * limit:.2f} ms ({CLASSIFIERS * SAMPLES * STEPS * OPERATIONS_PER_STEP / FLOATS / limit:.3g} "
        f"512-bit multiply-adds/s); share of the bound {limit / shortest:.2f}"
    )
