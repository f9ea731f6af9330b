"""What a laboratory's file, or a run folder, names is executed only by who trusts it."""

import json
import sys

import pytest
from program_laboratory import CALIBRATION, FILE, NAMES, ScriptedLaboratory

from turing_learning.robots import load_laboratory
from turing_learning.runs import load_run, start_laboratory, stored_laboratory

MODULE = """
from pathlib import Path
from program_laboratory import ScriptedLaboratory
Path({marker!r}).touch()
equipment = ScriptedLaboratory(noise=2.0).equipment()
def open_robot(address):
    return equipment.open_replica(address)
"""


@pytest.fixture
def named(tmp_path, monkeypatch):
    """Write a laboratory's file that names a function; return the file that the function's module makes when it is imported."""
    marker = tmp_path / "imported"
    CALIBRATION.save(tmp_path / "camera.json")
    (tmp_path / "foreign_robots.py").write_text(MODULE.format(marker=str(marker)))
    (tmp_path / "lab.toml").write_text(
        'open_replica = "foreign_robots:open_robot"\n' + FILE.replace("= 1.0\n", "= 0.5\n")
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield marker
    sys.modules.pop("foreign_robots", None)


@pytest.fixture
def run(named, tmp_path):
    """A run of that laboratory that was stopped after its first generation, with other devices."""
    doors = ScriptedLaboratory(noise=2.0).equipment()
    start_laboratory(
        load_laboratory(tmp_path / "lab.toml"),
        tmp_path / "run",
        equipment=doors,
        should_stop=lambda: True,
    )
    return tmp_path / "run"


@pytest.mark.parametrize(
    "command", ["robots check", "robots run --out new", "robots check --config lab.toml"]
)
def test_a_command_with_a_file_executes_no_function_that_is_not_trusted(
    command, named, call, tmp_path
):
    code, _, err = call(*command.split())
    assert code == 2
    assert (
        "error: `open_replica` must be trusted before it is executed; got 'foreign_robots:open_robot'"
        in err
    )
    assert "Read foreign_robots; then add --trust" in err
    assert not named.exists()
    assert not (tmp_path / "new").exists()


def test_a_shell_command_for_an_address_is_not_executed(tmp_path, call):
    CALIBRATION.save(tmp_path / "camera.json")
    text = FILE.replace(f'"{NAMES[0]}"', f'"touch {tmp_path}/done"')
    (tmp_path / "lab.toml").write_text('open_replica = "os:system"\n' + text)
    assert call("robots", "check")[0] == 2
    assert not (tmp_path / "done").exists()


def test_check_executes_what_is_trusted_and_refuses_a_robot_that_lacks_methods(
    named, call, tmp_path
):
    assert "good  replica r1: " in call("robots", "check", "--trust")[1]
    assert named.exists()
    (tmp_path / "half_robots.py").write_text(
        "class Half:\n    def __init__(self, address): pass\n    def status(self): pass\n"
    )
    text = (tmp_path / "lab.toml").read_text()
    (tmp_path / "lab.toml").write_text(
        text.replace("foreign_robots:open_robot", "half_robots:Half")
    )
    code, out, _ = call("robots", "check", "--trust")
    assert code == 2
    assert (
        "BAD   replica r1: `open_replica` must give a `Replica`; got Half without close, drop_signals, halt, recon"
        in out
    )


def test_a_rehearsal_executes_none(named, call):
    assert call("robots", "check", "--emulated")[0] == 0
    assert not named.exists()


@pytest.mark.parametrize(
    "command",
    [
        "show run",
        "report run",
        "resume run",
        "robots run --resume run",
        "check run",
        "pool run run",
    ],
)
def test_no_command_executes_what_a_folder_names(command, run, named, call):
    call(*command.split())
    assert not named.exists()


def test_reading_a_folder_from_python_executes_nothing(run, named):
    assert load_run(run).generations == 1
    assert load_run(run).history
    assert stored_laboratory(run).setup.open_replica == "foreign_robots:open_robot"
    assert not named.exists()


def test_resume_refuses_names_that_are_not_trusted_edited_or_not(run, named, call):
    assert "must be trusted before it is executed" in call("resume", "run")[2]
    content = json.loads((run / "laboratory.json").read_text())
    (run / "laboratory.json").write_text(
        json.dumps(content | {"tracker": "foreign_robots:open_robot"})
    )
    assert "it has been changed" in call("resume", "run")[2]
    assert not named.exists()
    (run / "laboratory.json").write_text(json.dumps(content))
    call("resume", "run", "--trust")  # whose camera then is none
    assert named.exists()
