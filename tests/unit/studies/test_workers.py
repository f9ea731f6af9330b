"""Worker processes and what they say, without a study around them."""

import io
import json
from contextlib import ExitStack

import pytest

from turing_learning.runs import RunFolder
from turing_learning.studies import StudyFolder, _execute, _workers, plan_study
from turing_learning.studies._execute import Outcome, Task, execute
from turing_learning.studies._study import create_study
from turing_learning.studies._worker import READY, WARM_UP, serve
from turing_learning.studies._workers import WorkerDied, Workers


@pytest.fixture
def program(monkeypatch, tmp_path):
    """Let workers run a Python program instead of their own."""
    started = []
    popen = _workers.subprocess.Popen

    def use(text):
        file = tmp_path / "program.py"
        file.write_text(text)

        def begin(command, **options):
            started.append(command)
            return popen([command[0], str(file)], **options)

        monkeypatch.setattr(_workers.subprocess, "Popen", begin)
        return started

    return use


ANSWER = 'print(json.dumps({"number": task["number"], "state": "complete", "reason": ""}), flush=True)\n'
LOOP = "import json, os, sys\nfor line in sys.stdin:\n    task = json.loads(line)\n"


def test_every_task_is_answered_whatever_the_number_of_workers(program, tmp_path):
    started = program(f"{LOOP}    {ANSWER}")
    workers = Workers(2, str(tmp_path))
    futures = [workers.submit(Task(str(tmp_path), number)) for number in range(1, 6)]
    assert [future.result(timeout=20) for future in futures] == [Outcome(n, "complete") for n in range(1, 6)]
    workers.close()
    assert len(started) == 2


def test_a_task_whose_worker_dies_is_given_to_a_new_worker(program, tmp_path):
    flag = tmp_path / "died"
    started = program(
        f"{LOOP}    if not os.path.exists({str(flag)!r}):\n        open({str(flag)!r}, 'w').close()\n        os._exit(9)\n"
        f"    {ANSWER}"
    )
    workers = Workers(1, str(tmp_path))
    assert workers.submit(Task(str(tmp_path), 1)).result(timeout=20) == Outcome(1, "complete")
    workers.close()
    assert len(started) == 2


def test_a_task_that_kills_every_worker_is_given_up_and_the_next_is_executed(program, tmp_path):
    program(f"{LOOP}    if task['number'] == 1:\n        os._exit(9)\n    {ANSWER}")
    workers = Workers(1, str(tmp_path))
    bad, good = (workers.submit(Task(str(tmp_path), number)) for number in (1, 2))
    with pytest.raises(WorkerDied, match=r"^3 workers died while they executed it \(exit status 9\)$"):
        bad.result(timeout=20)
    assert good.result(timeout=20) == Outcome(2, "complete")
    workers.close()


def test_workers_that_are_killed_end_at_once(program, tmp_path):
    program(f"{LOOP}    import time\n    time.sleep(600)\n")
    workers = Workers(1, str(tmp_path))
    future = workers.submit(Task(str(tmp_path), 1))
    while not workers.running([future]):
        pass
    workers.kill()
    with pytest.raises(WorkerDied):
        future.result(timeout=20)
    workers.close()


def test_others_wait_until_one_has_warmed_up(program, tmp_path):
    log = tmp_path / "log"
    program(
        f"{LOOP}    with open({str(log)!r}, 'a') as file:\n        file.write(line)\n"
        "    if 'warm up' in task:\n        import time\n        time.sleep(0.3)\n"
        f"        print('{{}}', flush=True)\n        continue\n    {ANSWER}"
    )
    workers = Workers(2, str(tmp_path), warm_up=[1])
    futures = [workers.submit(Task(str(tmp_path), number)) for number in (1, 2, 3)]
    assert all(future.result(timeout=20).state == "complete" for future in futures)
    workers.close()
    assert [WARM_UP in json.loads(line) for line in log.read_text().splitlines()] == [True, False, False, False]


def test_a_worker_that_cannot_be_started_is_said_by_the_task(monkeypatch, tmp_path):
    def fail(*arguments, **options):
        raise OSError("no more processes")

    monkeypatch.setattr(_workers.subprocess, "Popen", fail)
    workers = Workers(1, str(tmp_path), warm_up=[1])
    with pytest.raises(OSError, match="no more processes"):
        workers.submit(Task(str(tmp_path), 1)).result(timeout=20)
    workers.close()


@pytest.mark.parametrize("said", ["Welcome to node 7", "7", "caf\\xe9"])
@pytest.mark.parametrize("warm_up", [[], [1]])
def test_a_worker_that_says_something_else_is_quoted_by_every_task(said, warm_up, program, tmp_path):
    program(f"import sys\nsys.stdout.buffer.write(b'{said}\\n')\nsys.stdout.flush()\n{LOOP}    {ANSWER}")
    workers = Workers(1, str(tmp_path), warm_up)
    for future in [workers.submit(Task(str(tmp_path), number)) for number in (1, 2)]:
        with pytest.raises(
            ValueError, match=r"^a worker must print nothing but its answers, lines of JSON; got '"
        ) as caught:
            future.result(timeout=20)
        assert said.split("\\")[0] in str(caught.value)
    workers.close()


def test_an_answer_with_other_names_is_an_error_of_its_task_alone(program, tmp_path):
    program(f"{LOOP}    if task['number'] == 1:\n        print('{{}}', flush=True)\n        continue\n    {ANSWER}")
    workers = Workers(1, str(tmp_path))
    bad, good = (workers.submit(Task(str(tmp_path), number)) for number in (1, 2))
    with pytest.raises(TypeError, match="missing 2 required positional arguments"):
        bad.result(timeout=20)
    assert good.result(timeout=20) == Outcome(2, "complete")
    workers.close()


def test_a_worker_answers_line_by_line_and_survives_what_goes_wrong(tmp_path):
    requests = [
        {"study": str(tmp_path), WARM_UP: [1]},
        {"study": str(tmp_path), "number": 1, "stop": ""},
    ]
    answers = io.StringIO()
    serve(io.StringIO("".join(json.dumps(request) + "\n" for request in requests)), answers, lambda: False)
    first, second = map(json.loads, answers.getvalue().splitlines())
    assert first == {WARM_UP: READY}
    assert second["state"] == "failed"
    assert second["reason"].startswith("RunFolderError: `study` must be a study folder; got ")
    failure = json.loads((tmp_path / "runs" / "0001" / "failure.json").read_text())
    assert failure == {"kind": "RunFolderError", "reason": second["reason"]}


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
