"""What the loop costs beside a simulator of one's own, of ten lines of NumPy: the simulator's share of a generation.

Run with ``python benchmarks/bench_own.py``; it takes about a minute. Shares of processor time on one thread do not depend on how
busy the machine is; shares of wall-clock time on all threads are what a user sees, on a quiet machine.
"""

import statistics
import time

import numpy as np

import turing_learning as tl

STEPS, GENERATIONS, FIRST, ROUNDS = 100, 100, 20, 3


def walk(parameters, rng, work=1):
    """Speed and turn of walkers that keep turning; `work` repeats it, for a slower simulator."""
    speed, turn_noise, memory = parameters.T[:, :, None]
    shape = (len(parameters), STEPS)
    for _ in range(work):
        turns = turn_noise * rng.standard_normal(shape)
        for t in range(1, STEPS):
            turns[:, t] += memory[:, 0] * turns[:, t - 1]
        speeds = speed + rng.standard_normal(shape)
    return np.stack([speeds, turns], axis=-1)


def share(work, clock, threads):
    """Return the seconds of a call, and its share of a generation, by a clock."""
    spent, marks = [0.0], []

    def simulate(parameters, rng):
        begun = clock()
        samples = walk(parameters, rng, work)
        spent[0] += clock() - begun
        return samples

    tl.infer(
        genuine=walk(np.tile([6.0, 0.6, 0.5], (200, 1)), np.random.default_rng(1)),
        simulate=simulate,
        parameters={"speed": (0, 20), "turn_noise": (0, 3), "memory": (0, 0.9)},
        generations=GENERATIONS,
        settings={"run.history": "thin", "run.threads": threads},
        observer=lambda progress: marks.append((clock(), spent[0])),
    )
    whole, own = np.subtract(marks[-1], marks[FIRST])
    return own / (GENERATIONS - 1 - FIRST), own / whole


def main():
    share(1, time.process_time, 1)  # compiles
    for label, clock, threads in (
        ("processor time, one thread", time.process_time, 1),
        ("wall clock, all threads", time.perf_counter, "all"),
    ):
        for work in (5, 10, 20, 50):
            found = [share(work, clock, threads) for _ in range(ROUNDS)]
            call, ratio = (statistics.median(column) for column in zip(*found, strict=True))
            print(f"{label}: a call of {1e3 * call:.1f} ms has {ratio:.0%} of a generation", flush=True)


if __name__ == "__main__":
    main()
