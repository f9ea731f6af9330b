"""Processes that call a function: what they return, and what happens when they hang, die or print."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import CancelledError, wait
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from turing_learning import workers as module
from turing_learning.workers import NotImportable, WorkerDied, Workers, packed

sys.path.insert(0, str(Path(__file__).parent))
import worker_functions as functions

posix = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")


@contextmanager
def workers(function, count=1, **options):
    made = Workers(function, count, **options)
    try:
        yield made
    finally:
        made.close()


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def until(holds, seconds=20):
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.mark.parametrize("count", [1, 3])
def test_answers_come_in_the_order_of_the_calls_whatever_workers_print(count, capfd):
    with workers(functions.double, count) as made:
        assert [future.result() for future in made.in_order([(k,) for k in range(7)])] == [
            2 * k for k in range(7)
        ]
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("noise") == 3 * 7


def test_a_program_that_ends_waits_for_no_call():
    program = "from turing_learning.workers import Workers; import time; Workers(time.sleep, 1, script=False).submit(600)"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


def test_processes_are_kept_and_not_this_one():
    with workers(functions.process, 2) as made:
        pids = {made.submit(0.05).result() for _ in range(6)}
    assert os.getpid() not in pids
    assert len(pids) <= 2
    until(lambda: not any(map(alive, pids)))


def test_a_call_that_takes_too_long_is_given_up_and_the_next_is_executed():
    with workers(functions.sleep_if, timeout_s=0.5) as made:
        futures = [made.submit(value) for value in (False, True, False)]
        with pytest.raises(TimeoutError, match=r"^it took longer than 0\.5 s$"):
            futures[1].result()
        assert [futures[k].result() for k in (0, 2)] == [False, False]


def test_a_call_that_kills_its_worker_is_given_up_and_the_next_is_executed():
    with workers(functions.die_if) as made:
        bad, good = made.submit(True), made.submit(False)
        with pytest.raises(
            WorkerDied, match=r"^the worker died while executing it \(exit status 9\)$"
        ):
            bad.result()
        assert good.result() is False


def test_a_call_whose_worker_dies_is_given_to_another(tmp_path):
    with workers(functions.die_once, attempts=2) as made:
        assert made.submit(str(tmp_path / "flag")).result() == str(tmp_path / "flag")


def test_a_call_that_kills_every_worker_is_given_up():
    with (
        workers(functions.die_if, attempts=3) as made,
        pytest.raises(WorkerDied, match=r"^3 workers died while executing it \(exit status 9\)$"),
    ):
        made.submit(True).result()


@posix
def test_a_worker_that_is_killed_between_two_calls_is_replaced():
    with workers(functions.process) as made:
        first = made.submit().result()
        os.kill(first, signal.SIGKILL)
        time.sleep(0.5)  # until it is gone
        assert made.submit().result() != first


@pytest.mark.parametrize(
    ("kind", "error", "message"),
    [
        ("good", ValueError, "^no good$"),
        ("special", RuntimeError, "^Special: 1 2$"),
        ("result", RuntimeError, "pickle"),
    ],
)
def test_what_a_call_raises_comes_back(kind, error, message):
    with workers(functions.fail) as made, pytest.raises(error, match=message):
        made.submit(kind).result()


def test_a_function_that_cannot_be_sent_is_refused_at_once():
    with pytest.raises(Exception, match="pickle"):
        Workers(lambda: None, 1)


def test_a_function_that_cannot_be_loaded_is_said_by_every_call():
    with workers(packed(functions.NotLoaded())) as made:
        for future in [made.submit(), made.submit()]:
            with pytest.raises(NotImportable, match=r"^ImportError: no such model$"):
                future.result()


def test_a_process_that_cannot_be_started_is_said_by_every_call(monkeypatch):
    def fail(*arguments, **options):
        raise OSError("no more processes")

    monkeypatch.setattr(module.subprocess, "Popen", fail)
    with (
        workers(functions.double, warm_up=(1,)) as made,
        pytest.raises(OSError, match="no more processes"),
    ):
        made.submit(1).result()


def test_a_program_that_ends_before_its_first_call_is_said(monkeypatch):
    monkeypatch.setattr(module, "_PROGRAM", "print('Welcome'); raise SystemExit(3)")
    with (
        workers(functions.double) as made,
        pytest.raises(NotImportable, match="before the first call, with exit status 3"),
    ):
        made.submit(1).result()


def test_what_is_printed_when_python_starts_does_no_harm(monkeypatch, capsys):
    monkeypatch.setattr(
        module, "_PROGRAM", "print('Welcome to node 7', end='', flush=True);" + module._PROGRAM
    )
    with workers(functions.double) as made:
        assert made.submit(4).result() == 8


def test_others_wait_until_one_has_warmed_up(tmp_path):
    log = tmp_path / "log"
    with workers(partial(functions.log, str(log)), 2, warm_up=("warm", 0.3)) as made:
        wait([made.submit(k) for k in range(3)])
    assert sorted(log.read_text().split()[1:]) == ["0", "1", "2"]
    assert log.read_text().startswith("warm\n")


def test_libraries_get_one_thread_unless_the_environment_says_otherwise(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    monkeypatch.delenv("MKL_NUM_THREADS", raising=False)
    with workers(functions.settings, one_thread=True) as one, workers(functions.settings) as other:
        assert one.submit().result() == {"OMP_NUM_THREADS": "3", "MKL_NUM_THREADS": "1"}
        assert other.submit().result() == {"OMP_NUM_THREADS": "3", "MKL_NUM_THREADS": None}


def test_workers_that_are_asked_to_stop_end_their_calls(tmp_path):
    with workers(functions.until_asked) as made:
        futures = [made.submit(str(tmp_path / "begun")), made.submit()]
        until((tmp_path / "begun").exists)
        made.stop()
        assert [future.result(timeout=20) for future in futures] == ["asked", "asked"]
    with workers(functions.until_asked) as made:
        made.stop()  # before there is a process
        assert made.submit().result(timeout=20) == "asked"


def test_workers_that_are_killed_end_at_once():
    with workers(functions.sleep_if, attempts=3) as made:
        futures = [made.submit(True), made.submit(True)]
        until(lambda: any(future.running() for future in futures))
        made.kill()
        for future in futures:
            with pytest.raises(WorkerDied):
                future.result(timeout=20)


def test_leaving_the_loop_cancels_what_has_not_begun():
    with workers(functions.process) as made:
        answers = made.in_order([(0.2,)] * 5)
        later = [next(answers)]
        answers.close()
        future = made.submit()
        assert isinstance(future.result(), int)
    assert later[0].result()


def test_workers_that_are_forgotten_end():
    made = Workers(functions.process, 1)
    pid = made.submit().result()
    del made
    until(lambda: not alive(pid))


SCRIPT = """
import sys
from turing_learning.workers import Workers
def twice(value):
    return 2 * value
{guard}
    workers = Workers(twice, 1)
    try:
        print(workers.submit(21).result())
    finally:
        workers.close()
"""


def test_functions_of_a_guarded_script_are_called(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.format(guard='if __name__ == "__main__":'))
    done = subprocess.run([sys.executable, path], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("42\n", "")


def test_a_script_without_a_guard_is_told_so_and_starts_no_further_processes(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.format(guard="if True:"))
    done = subprocess.run(
        [sys.executable, path], capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 1
    assert 'keeps its calls under `if __name__ == "__main__":`' in done.stderr


ORPHAN = """
import sys, time
sys.path.insert(0, {folder!r})
import worker_functions as functions
from turing_learning.workers import Workers
workers = Workers(functions.{function}, 1, patient={patient})
workers.submit({argument})
time.sleep(600)
"""


@posix
@pytest.mark.parametrize("patient", [True, False])
def test_a_worker_ends_with_its_parent(patient, tmp_path):
    begun, path = tmp_path / "begun", tmp_path / "script.py"
    function = "until_asked" if patient else "log_and_sleep"
    program = ORPHAN.format(
        folder=str(Path(__file__).parent),
        function=function,
        patient=patient,
        argument=repr(str(begun)),
    )
    path.write_text(
        'if __name__ == "__main__":\n' + "".join(f"    {line}\n" for line in program.splitlines())
    )
    parent = subprocess.Popen([sys.executable, path])
    until(lambda: begun.exists() and begun.read_text())
    pid = int(begun.read_text())
    parent.kill()
    parent.wait()
    until(lambda: not alive(pid))


def test_a_cancelled_call_is_not_executed():
    with workers(functions.process) as made:
        made.submit(0.2)
        future = made.submit()
        assert future.cancel()
        with pytest.raises(CancelledError):
            future.result()
