"""What a study costs beyond its runs: the efficiency of its workers.

Run with ``python benchmarks/bench_study.py``; it needs the package installed and about three minutes. As many single runs as
there are processors, one thread each, go on at the same time, so that both sides share the machine in the same way.
"""

import shutil
import statistics
import subprocess
import sys
import tempfile
import time

from turing_learning.kernels.parallel import default_threads

ROUNDS, RUNS_PER_WORKER, GENERATIONS = 3, 3, 500


def together(commands):
    start = time.perf_counter()
    running = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for command in commands]
    if any(process.wait() for process in running):
        sys.exit("a run has failed")
    return time.perf_counter() - start


def main():
    program = shutil.which("turing-learning") or sys.exit("turing-learning is not installed")
    workers = default_threads()
    single = [program, "infer", "aggregation", "--threads", "1", "--generations", str(GENERATIONS)]
    many = [
        program,
        "study",
        "aggregation",
        "--generations",
        str(GENERATIONS),
        "--workers",
        str(workers),
    ]
    shares = []
    with tempfile.TemporaryDirectory() as folder:
        for k in range(ROUNDS):
            one = together(
                [
                    *single,
                    "--set",
                    'run.history="thin"',
                    "--seed",
                    str(w),
                    "--out",
                    f"{folder}/{k}-{w}",
                ]
                for w in range(workers)
            )
            runs = str(RUNS_PER_WORKER * workers)
            all_runs = together([[*many, "--runs", runs, "--out", f"{folder}/study-{k}"]])
            shares.append(RUNS_PER_WORKER * one / all_runs)
            print(
                f"{workers} single runs at once {one:.1f} s; study of {runs} runs, {workers} workers {all_runs:.1f} s"
            )
    print(f"efficiency of the workers: median {statistics.median(shares):.2f} of {ROUNDS}")


if __name__ == "__main__":
    main()
