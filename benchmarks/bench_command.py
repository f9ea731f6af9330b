"""The whole default command as a user runs it: start, wall-clock time and memory.

Run with ``python benchmarks/bench_command.py``; it needs the package installed and about two minutes.
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


def wall(command, **options):
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, **options)
    return time.perf_counter() - start


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
        size = sum(path.stat().st_size for path in Path(folder, "0").rglob("*") if path.is_file())
        print(f"run folder: {size / 1e6:.0f} MB")
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
