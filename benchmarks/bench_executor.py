"""How much of the workers' time simulators have: calls times duration over workers times wall time.

    python benchmarks/bench_executor.py

A call sleeps for 2 s, as a heavy simulator that runs elsewhere would take them: two workers, and a cluster of 64.
"""

import time
from concurrent.futures import Executor, ThreadPoolExecutor
from typing import Any

import numpy as np

import turing_learning as tl

CALL_S = 2.0
PARAMETERS = {"mean": (0, 10), "sd": (0.1, 3)}


def walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the sample (50, 1) of one model, after 2 s."""
    time.sleep(CALL_S)
    mean, sd = parameters
    return mean + sd * rng.standard_normal((50, 1))


class Counting(ThreadPoolExecutor):
    """Threads that count their calls."""

    calls = 0

    def submit(self, *call: Any, **more: Any) -> Any:
        """Count a call, and submit it."""
        self.calls += 1
        return super().submit(*call, **more)


def efficiency(executor: Executor, workers: int, **length: int) -> float:
    """Return the share of the workers' time in which they simulate, in a run of that length."""
    genuine = 5 + np.random.default_rng(1).standard_normal((50, 50, 1))
    started = time.perf_counter()
    system: dict[str, Any] = {"genuine": genuine, "simulate": walk, "parameters": PARAMETERS}
    tl.infer(**system, vectorized=False, executor=executor, seed=1, progress=False, **length)
    return executor.calls * CALL_S / (workers * (time.perf_counter() - started))  # type: ignore[attr-defined]


if __name__ == "__main__":
    cases = ((2, {"trials": 150}), (64, {"generations": 5}), (64, {"trials": 3000}))
    for workers, length in cases:
        with Counting(workers) as executor:
            share = efficiency(executor, workers, **length)
        print(
            f"{workers:3} workers, {length}: {share:.2f} of their time, {executor.calls} calls",
            flush=True,
        )
