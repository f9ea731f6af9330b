"""What a worker of a study does; the processes are tested in tests/unit/test_workers.py."""

import json
from contextlib import ExitStack
from functools import partial

from turing_learning.results import RunFolder
from turing_learning.studies import StudyFolder, _execute, plan_study
from turing_learning.studies._execute import Outcome, Task, execute, execute_in_worker
from turing_learning.studies._study import create_study
from turing_learning.workers import Workers


def test_a_worker_survives_what_goes_wrong_and_writes_it_down(tmp_path):
    workers = Workers(partial(execute_in_worker, str(tmp_path), [1]), 1, warm_up=(None,), script=False)
    outcome = workers.submit(Task(str(tmp_path), 1)).result()
    workers.close()
    assert (outcome.number, outcome.state) == (1, "failed")
    assert outcome.reason.startswith("RunFolderError: `study` must be a study folder; got ")
    failure = json.loads((tmp_path / "runs" / "0001" / "failure.json").read_text())
    assert failure == {"kind": "RunFolderError", "reason": outcome.reason}


def test_a_task_is_left_waiting_once_its_file_asks_for_a_stop(tmp_path):
    (tmp_path / "stop").touch()
    assert execute(Task(str(tmp_path), 1, str(tmp_path / "stop"))) == Outcome(1, "waiting")
    assert execute(Task(str(tmp_path), 1), lambda: True) == Outcome(1, "waiting")
    assert not (tmp_path / "runs").exists()


def test_a_run_that_another_process_holds_fails_after_a_while(tmp_path, monkeypatch):
    monkeypatch.setattr(_execute, "LONGEST_WAIT_S", 0.3)
    with ExitStack() as stack:
        create_study(plan_study("aggregation", runs=1), StudyFolder(tmp_path / "study"), stack)
    run = tmp_path / "study" / "runs" / "0001"
    run.mkdir(parents=True)
    with RunFolder(run).locked():
        outcome = execute(Task(str(tmp_path / "study"), 1))
    assert outcome.state == "failed"
    assert "`run` must not be in use" in outcome.reason
