"""The whole default command as a user runs it: start, wall-clock and processor time, memory.

Run with ``python benchmarks/bench_command.py``; it needs the package installed and about six minutes.
"""

import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STARTS, RUNS = 7, 3
CASES = (
    ("aggregation", 1000),
    ("aggregation", 3000),
    ("aggregation", 10_000),
    ("object-clustering", 1000),
    ("object-clustering", 3000),
)
"""Scenarios and trials whose processor time is measured."""


def wall(command, **options):
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, **options)
    return time.perf_counter() - start


def processor(command):
    """Return the processor time (s), of user and system, that a command takes."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    program = shutil.which("turing-learning") or sys.exit("turing-learning is not installed")
    for label, command in (
        ("import turing_learning", [sys.executable, "-c", "import turing_learning"]),
        ("turing-learning --help", [program, "--help"]),
    ):
        print(f"{label}: median {statistics.median(wall(command) for _ in range(STARTS)):.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        infer = [program, "infer", "aggregation", "--seed", "1", "--out"]
        fresh = os.environ | {
            "NUMBA_CACHE_DIR": f"{folder}/numba",
            "TURING_LEARNING_CACHE_DIR": f"{folder}/judge",
        }
        print(
            f"infer aggregation, nothing compiled yet: {wall([*infer, f'{folder}/cold'], env=fresh):.1f} s"
        )
        times = [wall([*infer, f"{folder}/{k}"]) for k in range(RUNS)]
        print(f"infer aggregation, warm: median {statistics.median(times):.1f} s of {RUNS}")
        for scenario, trials in CASES:
            times = []
            for seed in range(1, RUNS + 1):
                options = ["--trials", str(trials), "--seed", str(seed), "--out"]
                out = f"{folder}/{scenario}-{trials}-{seed}"
                times.append(processor([program, "infer", scenario, *options, out]))
            seconds = statistics.median(times)
            print(f"infer {scenario} --trials {trials}: median processor time {seconds:.1f} s")
        size = sum(path.stat().st_size for path in Path(folder, "0").rglob("*") if path.is_file())
        print(f"run folder: {size / 1e6:.0f} MB")
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
