"""How much of the workers' time simulators have: calls times duration over workers times wall time.

    python benchmarks/bench_executor.py

A call sleeps for 2 s, as a heavy simulator that runs elsewhere would take them: two workers, and a cluster of 64.
In the last case a call computes for 2 s, in two processes; the machine should have two processors that do nothing else.
"""

import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
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


def compute(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the sample (50, 1) of one model, after 2 s of a processor."""
    began = time.process_time()
    state = rng.standard_normal((50, 50))
    while time.process_time() - began < CALL_S:
        state = np.tanh(state) + 0.1
    mean, sd = parameters
    return mean + sd * rng.standard_normal((50, 1))


class Counting(Executor):
    """An executor that counts its calls."""

    calls = 0

    def submit(self, *call: Any, **more: Any) -> Any:
        """Count a call, and submit it."""
        self.calls += 1
        return super().submit(*call, **more)


class Threads(Counting, ThreadPoolExecutor):
    """Threads that count their calls."""


class Processes(Counting, ProcessPoolExecutor):
    """Processes that count their calls."""


def efficiency(
    simulate: Callable[..., np.ndarray], executor: Counting, workers: int, **length: Any
) -> float:
    """Return the share of the workers' time in which they simulate, in a run of that length."""
    genuine = 5 + np.random.default_rng(1).standard_normal((50, 50, 1))
    started = time.perf_counter()
    system: dict[str, Any] = {
        "genuine": genuine,
        "simulate": simulate,
        "parameters": PARAMETERS,
        "vectorized": False,
    }
    tl.infer(**system, executor=executor, seed=1, progress=False, **length)
    return executor.calls * CALL_S / (workers * (time.perf_counter() - started))


if __name__ == "__main__":
    cases: tuple[tuple[Callable[..., np.ndarray], type[Any], int, dict[str, Any]], ...] = (
        (walk, Threads, 2, {"trials": 150}),
        (walk, Threads, 64, {"generations": 5}),
        (walk, Threads, 64, {"trials": 3000}),
        (walk, Threads, 64, {"trials": 3000, "settings": {"run.batch": 64}}),
        (compute, Processes, 2, {"trials": 40}),
        (compute, Processes, 2, {"trials": 150}),
    )
    for simulate, pool, workers, length in cases:
        with pool(workers) as executor:
            share = efficiency(simulate, executor, workers, **length)
        print(
            f"{workers:3} workers, {simulate.__name__}, {length}: {share:.2f} of their time, "
            f"{executor.calls} calls",
            flush=True,
        )
