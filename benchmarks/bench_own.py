"""What the loop costs beside a simulator of one's own, of ten lines of NumPy: where a generation's time goes.

Run with ``python benchmarks/bench_own.py``; it takes about a minute. Shares of processor time on one thread do not depend on how
busy the machine is; shares of wall-clock time on all threads are what a user sees, on a quiet machine.
"""

import statistics
import time
from unittest.mock import patch

import numpy as np

import turing_learning as tl
from turing_learning.classifiers import ElmanClassifier

STEPS, GENERATIONS, FIRST, ROUNDS = 100, 200, 120, 3  # after `FIRST` the archive is full


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


def timed(function, clock, spent):
    """Return the function; it adds the seconds that its calls take to ``spent[0]``."""

    def call(*arguments):
        begun = clock()
        returned = function(*arguments)
        spent[0] += clock() - begun
        return returned

    return call


def generation(work, clock, threads):
    """Return the median seconds of a call of the simulator, of judging, and of all else in a generation, by a clock."""
    simulating, judging, marks = [0.0], [0.0], []
    with patch.object(ElmanClassifier, "judge", timed(ElmanClassifier.judge, clock, judging)):
        tl.infer(
            genuine=walk(np.tile([6.0, 0.6, 0.5], (200, 1)), np.random.default_rng(1)),
            simulate=timed(lambda parameters, rng: walk(parameters, rng, work), clock, simulating),
            parameters={"speed": (0, 20), "turn_noise": (0, 3), "memory": (0, 0.9)},
            generations=GENERATIONS,
            settings={"run.history": "thin", "run.threads": threads},
            observer=lambda progress: marks.append((clock(), simulating[0], judging[0])),
        )
    whole, call, judged = np.median(np.diff(marks[FIRST:], axis=0), axis=0)
    return call, judged, whole - call - judged


def main():
    generation(1, time.process_time, 1)  # compiles
    for label, clock, threads in (
        ("processor time, one thread", time.process_time, 1),
        ("wall clock, all threads", time.perf_counter, "all"),
    ):
        for work in (5, 10, 20, 50):
            found = [generation(work, clock, threads) for _ in range(ROUNDS)]
            call, judged, rest = (
                1e3 * statistics.median(column) for column in zip(*found, strict=True)
            )
            print(
                f"{label}: call {call:.1f} ms, judging {judged:.1f} ms, all else {rest:.1f} ms; "
                f"the call has {call / (call + judged + rest):.0%} of a generation, {call / (call + rest):.0%} without judging",
                flush=True,
            )


if __name__ == "__main__":
    main()
