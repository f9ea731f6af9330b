"""What a worker of a study does; the processes are tested in tests/unit/test_workers.py."""

import json
from contextlib import ExitStack
from functools import partial

from turing_learning.runs import RunFolder
from turing_learning.studies import StudyFolder, _backends, plan_study
from turing_learning.studies._backends import execute, execute_in_worker
from turing_learning.studies._study import create_study
from turing_learning.workers import Workers


def failure(study):
    return json.loads((study / "runs" / "0001" / "failure.json").read_text())


def test_a_worker_survives_what_goes_wrong_and_writes_it_down(tmp_path):
    workers = Workers(
        partial(execute_in_worker, str(tmp_path), [1]), 1, warm_up=(None,), script=False
    )
    assert workers.submit(1).result() == "failed"
    workers.close()
    assert failure(tmp_path)["kind"] == "RunFolderError"
    assert failure(tmp_path)["reason"].startswith(
        "RunFolderError: `study` must be a study folder; got "
    )


def test_a_run_is_left_waiting_once_its_file_asks_for_a_stop(tmp_path):
    (tmp_path / "stop").touch()
    assert execute(str(tmp_path), 1, str(tmp_path / "stop")) == "waiting"
    assert execute(str(tmp_path), 1, should_stop=lambda: True) == "waiting"
    assert not (tmp_path / "runs").exists()


def test_a_run_that_another_process_holds_fails_after_a_while(tmp_path, monkeypatch):
    monkeypatch.setattr(_backends, "LONGEST_WAIT_S", 0.3)
    study = tmp_path / "study"
    with ExitStack() as stack:
        create_study(plan_study("aggregation", runs=1), StudyFolder(study), stack)
    run = study / "runs" / "0001"
    run.mkdir(parents=True)
    with RunFolder(run).locked():
        assert execute(str(study), 1) == "failed"
    assert "`run` must not be in use" in failure(study)["reason"]
