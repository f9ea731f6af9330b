"""Whole studies through the command line: killed workers, Ctrl-C, another process, Slurm."""

import json
import os
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor

import pytest
from study_tools import (
    SETTINGS,
    SMALL,
    begin,
    call,
    executed_by,
    going,
    kill_in_mid_run,
    tables,
    wait_until,
)

import turing_learning as tl

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")


RUNS = ["study", "aggregation", *SMALL, "--runs", 2, "--generations"]
"""A study of two runs, but for their number of generations."""

STUDY = [*RUNS, 400]
"""So long that a process can be met in the middle of a run."""


def resume_here(folder):
    """Go on with a study in this process: no other has to import anything."""
    with ThreadPoolExecutor(1) as executor:
        return tl.studies.resume_study(folder, executor=executor)


def busy(folder):
    """Return the process ids of workers that have saved a run and not finished it."""
    return set(going(folder).values())


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """A study of two runs that nobody disturbed, executed in this process."""
    folder = tmp_path_factory.mktemp("studies") / "undisturbed"
    with ThreadPoolExecutor(1) as executor:
        tl.study(
            "aggregation", runs=2, generations=400, settings=SETTINGS, executor=executor, out=folder
        )
    return folder


def test_a_killed_worker_loses_nothing_but_its_present_run(undisturbed, tmp_path):
    folder = tmp_path / "study"
    with ThreadPoolExecutor(1) as executor:
        killed = executor.submit(
            wait_until,
            lambda: kill_in_mid_run(folder, lambda pid: pid != os.getpid()),
            "a worker in mid-run",
        )
        done = call(*STUDY, "--workers", 2, "--out", folder)
        run, victim = killed.result()
    assert done.returncode == 0, done.stderr
    assert executed_by(folder, run) != victim
    assert tables(folder) == tables(undisturbed)


def test_a_signal_stops_all_runs_and_resume_goes_on_to_the_same_table(undisturbed, tmp_path):
    folder = tmp_path / "study"
    process = begin(*STUDY, "--workers", 2, "--out", folder)
    pids = wait_until(lambda: busy(folder), "a busy worker", process)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130, out + err
    assert err.endswith(f" of 2 runs; resume with: turing-learning resume {folder}\n")
    assert err.startswith("stopped after ")
    assert not any(map(alive, pids))
    assert not list(folder.glob("stop-*"))
    states = [json.loads(path.read_text())["state"] for path in folder.glob("runs/*/manifest.json")]
    assert "stopped" in states
    assert "running" not in states
    assert resume_here(folder).complete
    assert tables(folder) == tables(undisturbed)


def test_workers_end_with_the_study_that_was_killed_and_it_can_be_resumed(undisturbed, tmp_path):
    folder = tmp_path / "study"
    process = begin(*STUDY, "--workers", 2, "--out", folder)
    pids = wait_until(lambda: busy(folder), "a busy worker", process)
    process.kill()
    process.communicate()
    wait_until(lambda: not any(map(alive, pids)), "the workers' end", seconds=20)
    assert resume_here(folder).complete
    assert tables(folder) == tables(undisturbed)


def test_a_second_process_is_refused(undisturbed, tmp_path):
    folder = tmp_path / "study"
    process = begin(*RUNS, 100_000, "--workers", 1, "--out", folder)
    wait_until(lambda: busy(folder), "a busy worker", process)
    done = call("resume", folder)
    process.kill()
    process.communicate()
    assert done.returncode == 2
    assert done.stderr == (
        f"error: `study` must not be in use; got {folder}, to which another process is writing. "
        "Wait until it ends, or stop it.\n"
    )


def test_the_same_study_again_changes_nothing(undisturbed):
    before = tables(undisturbed)
    stamps = {path: path.stat().st_mtime_ns for path in undisturbed.glob("runs/*/result.json")}
    done = call(*STUDY, "--out", undisturbed)
    assert done.returncode == 0, done.stderr
    assert tables(undisturbed) == before
    assert {
        path: path.stat().st_mtime_ns for path in undisturbed.glob("runs/*/result.json")
    } == stamps


def test_the_job_script_for_slurm_executes_every_run_and_collects(undisturbed, tmp_path):
    folder, script, fake = tmp_path / "study", tmp_path / "job.sh", tmp_path / "bin"
    done = call(*STUDY, "--out", folder, "--write-slurm", script)
    assert done.returncode == 0, done.stderr
    assert not (folder / "runs").exists()
    submit = done.stdout.splitlines()[-1].strip()
    # A stand-in for sbatch: executes the array one by one, or the script itself, and prints a job's number.
    fake.mkdir()
    (fake / "sbatch").write_text(
        "#!/bin/bash\n"
        f'echo "$@" >> {tmp_path}/submitted\n'
        'for a in "$@"; do script=$a; done\n'
        "if [[ $* == *--array=1-2* ]]; then\n"
        '  for i in 1 2; do SLURM_ARRAY_TASK_ID=$i "$script" >&2 || exit 1; done; echo "17;cluster"\n'
        'else "$script"; fi\n'
    )
    (fake / "sbatch").chmod(0o755)
    environment = os.environ | {"PATH": f"{fake}:{os.environ['PATH']}"}
    ran = subprocess.run(
        ["bash", "-c", submit], env=environment, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "submitted").read_text().splitlines() == [
        f"--parsable --array=1-2 {script}",
        f"--dependency=afterany:17 {script}",
    ]
    assert "2 of 2 runs complete" in ran.stdout
    assert tables(folder) == tables(undisturbed)


def test_a_job_of_the_array_that_is_told_to_end_saves_and_goes_on_when_it_comes_again(
    undisturbed, tmp_path
):
    folder = tmp_path / "study"
    call(*RUNS, 100_000, "--out", folder, "--write-slurm", tmp_path / "job.sh")
    process = begin("study-run", folder, 1)
    wait_until(lambda: busy(folder), "a checkpoint", process)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err == f"stopped; resume with: turing-learning study-run {folder} 1\n"
    assert json.loads((folder / "runs/0001/manifest.json").read_text())["state"] == "stopped"


def test_a_run_that_fails_is_named_and_the_study_goes_on(undisturbed, tmp_path):
    folder = tmp_path / "study"
    call(*STUDY, "--out", folder, "--write-slurm", tmp_path / "job.sh")
    (folder / "runs" / "0002").mkdir(parents=True)
    (folder / "runs" / "0002" / "precious.txt").write_text("not a run")
    done = call("resume", folder, "--workers", 1)
    assert done.returncode == 1
    assert done.stderr == f"1 run failed; try again with: turing-learning resume {folder}\n"
    assert (
        "run 2  seed 2  failed: RunFolderError: `out` must be a new or empty folder" in done.stdout
    )
    assert "1 of 2 runs complete, 1 failed" in done.stdout
    (folder / "runs" / "0002" / "precious.txt").unlink()
    assert resume_here(folder).complete
    assert tables(folder) == tables(undisturbed)
