"""A study on a Dask cluster: real processes on the loopback interface, one of them killed."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from study_tools import SETTINGS, SMALL, call, executed_by, kill_in_mid_run, tables, wait_until

from turing_learning.config import ConfigurationError
from turing_learning.studies import study

pytest.importorskip("distributed", reason="needs the extra `cluster`")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")

STUDY = ["study", "aggregation", *SMALL, "--runs", 2, "--generations", 600]


@pytest.fixture(scope="module")
def processes():
    """Start programs of Dask; all are ended after the tests."""
    started = []

    def start(program, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{program}", *map(str, arguments)]
        started.append(
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        )
        return started[-1]

    yield start
    for process in started:
        process.kill()
    for process in started:
        process.wait()


def address_in(file):
    """Return the address in the file of a scheduler, once it is written to its end."""
    wait_until(lambda: file.exists() and file.read_text().rstrip().endswith("}"), "scheduler")
    return json.loads(file.read_text())["address"]


@pytest.fixture(scope="module")
def scheduler(processes, tmp_path_factory):
    """Start a scheduler; return its address."""
    file = tmp_path_factory.mktemp("scheduler") / "scheduler.json"
    processes(
        "scheduler", "--host", "127.0.0.1", "--port", 0, "--no-dashboard", "--scheduler-file", file
    )
    return address_in(file)


# Before the tests that start workers for the same scheduler.
def test_a_cluster_without_workers_is_refused_before_anything_runs(
    scheduler, tmp_path, monkeypatch
):
    monkeypatch.setattr("turing_learning.studies._backends.WORKER_S", 0.5)
    with pytest.raises(
        ConfigurationError,
        match=r"^`cluster` must have at least one worker; got 'tcp://.*' with none",
    ):
        study("aggregation", runs=6, cluster=scheduler, out=tmp_path / "study")
    assert not (tmp_path / "study").exists()


def test_a_killed_worker_changes_nothing_in_the_table(processes, scheduler, tmp_path):
    options = [
        "--nthreads",
        1,
        "--no-nanny",
        "--no-dashboard",
        "--local-directory",
        tmp_path / "scratch",
    ]
    workers = [processes("worker", scheduler, *options) for _ in range(2)]
    folder, local = tmp_path / "cluster", tmp_path / "local"
    theirs = {worker.pid for worker in workers}
    with ThreadPoolExecutor(1) as executor:
        killed = executor.submit(
            wait_until, lambda: kill_in_mid_run(folder, theirs.__contains__), "a worker in mid-run"
        )
        done = call(*STUDY, "--cluster", scheduler, "--out", folder)
        run, victim = killed.result()
    assert done.returncode == 0, done.stderr
    assert "2 of 2 runs complete" in done.stdout
    assert executed_by(folder, run) in theirs - {victim}
    with ThreadPoolExecutor(1) as executor:
        study(
            "aggregation", runs=2, generations=600, settings=SETTINGS, executor=executor, out=local
        )
    assert tables(folder) == tables(local)


@pytest.mark.parametrize(
    "address", ["tcp://127.0.0.1:9", "here", "ucx://127.0.0.1:9", "tls://127.0.0.1:9"]
)
def test_a_cluster_that_is_not_there_is_named_before_anything_runs(address, tmp_path):
    done = call(*STUDY, "--cluster", address, "--out", tmp_path / "study")
    assert done.returncode == 2
    assert done.stderr.startswith(
        f"error: `cluster` must be the address of a Dask scheduler that answers; got '{address}' ("
    )
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "study").exists()


def test_a_scheduler_that_dies_ends_the_study_with_one_line(processes, tmp_path):
    file, folder = tmp_path / "scheduler.json", tmp_path / "study"
    options = ["--no-dashboard", "--scheduler-file", file]
    scheduler = processes("scheduler", "--host", "127.0.0.1", "--port", 0, *options)
    address = address_in(file)
    processes(
        "worker",
        address,
        "--nthreads",
        1,
        "--no-nanny",
        "--no-dashboard",
        "--local-directory",
        tmp_path / "scratch",
    )
    endless = [str(part) for part in STUDY[:-1]] + ["1000000"]

    def kill_once_a_run_has_begun():
        try:
            wait_until(
                lambda: list(folder.glob("runs/*/checkpoints/*.npz")), "a run that has begun"
            )
        finally:
            # The study would never end otherwise
            scheduler.kill()

    with ThreadPoolExecutor(1) as executor:
        killed = executor.submit(kill_once_a_run_has_begun)
        done = call(*endless, "--cluster", address, "--out", folder)
        killed.result()
    assert done.returncode == 1
    assert done.stderr.startswith("error: `executor` must stay alive until the study ends; got ")
    assert done.stderr.endswith(f"Go on with `turing-learning resume {folder}`.\n")
    assert done.stderr.count("\n") == 1
