"""Ctrl-C in a laboratory: it is heard, says what happens, halts the robots, and names those that may still move."""

import os
import signal
import threading
import time

import pytest
from arena_laboratories import SMALL
from program_laboratory import CALIBRATION, FILE, ScriptedLaboratory

from turing_learning.cli._robots import _Pace
from turing_learning.cli._stopping import StopRequest, handling
from turing_learning.robots import ArenaService
from turing_learning.robots.emulation import obey
from turing_learning.robots.program._equipment import TerminalOperator


def test_the_first_signal_announces_the_second_interrupts_and_later_ones_only_say_so(capsys):
    request = StopRequest(
        lambda: "stopping after this batch (about 3 min); Ctrl-C again halts the robots now"
    )
    request.receive(signal.SIGINT, None)
    assert request()
    assert "about 3 min); Ctrl-C again halts the robots now" in capsys.readouterr().err
    with pytest.raises(KeyboardInterrupt):
        request.receive(signal.SIGINT, None)
    request.receive(signal.SIGINT, None)  # the robots must be halted before
    assert "the robots are being halted" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_press_enter_is_left_by_one_signal(number, monkeypatch):
    def wait(prompt):
        assert "Ctrl-C to leave" in prompt
        os.kill(os.getpid(), number)
        time.sleep(60)

    monkeypatch.setattr("builtins.input", wait)
    request = StopRequest()
    with handling([signal.SIGINT, signal.SIGTERM], request.receive):
        before = signal.getsignal(number)
        with pytest.raises(KeyboardInterrupt):
            TerminalOperator().ask("Change the battery")
        assert signal.getsignal(number) == before
    assert not request()


@pytest.fixture
def laboratory(tmp_path, monkeypatch):
    CALIBRATION.save(tmp_path / "camera.json")
    (tmp_path / "lab.toml").write_text(FILE)
    scripted = ScriptedLaboratory(noise=2.0)
    monkeypatch.setattr(
        "turing_learning.robots.real_equipment", lambda laboratory: scripted.equipment()
    )
    return scripted


def test_a_run_that_ends_says_who_was_halted_and_who_may_still_move(laboratory, call):
    code, out, _ = call(
        "robots",
        "run",
        "--generations",
        "1",
        "--out",
        "run",
        "--set",
        "scenario.trial.duration_s=0.5",
    )
    assert code == 0
    assert "robots halted: r1, r2." in out
    assert "Without an address, and perhaps still moving: a1, a2. Stop them by hand." in out


def test_two_signals_halt_the_robots_of_the_arenas_own_file(call, tmp_path, monkeypatch):
    running = threading.Event()
    note = _Pace.note

    def noted(pace, event):
        note(pace, event)
        if event.state == "P3":
            running.set()

    monkeypatch.setattr(_Pace, "note", noted)

    def twice():
        if not running.wait(60):
            return
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGINT)

    with ArenaService(SMALL, lines="tcp", speed=2.0) as service:
        service.write(tmp_path / "lab")
        obey(service.laboratory, "remote")
        monkeypatch.setattr("turing_learning.cli._robots._inspected", lambda *_: True)

        threading.Thread(target=twice, daemon=True).start()
        code, out, err = call("robots", "run", "--config", "lab/lab.toml", "--out", "run")
        assert code == 130
        assert "Ctrl-C again halts the robots now" in err
        assert "robots halted: replica-1, replica-2." in out
        assert (
            "Without an address, and perhaps still moving: agent-1, agent-2, agent-3. Stop them by hand."
            in out
        )
        assert "resume with: turing-learning resume run" in err
        for name in ("replica-1", "replica-2"):
            assert service.laboratory.robot(name).emulated.state == "R0"
