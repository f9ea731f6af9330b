"""What the tests of commands and runs share."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from turing_learning.cli import main
from turing_learning.config import load_configuration

BLANK = (
    "cli",
    "detection",
    "interaction",
    "robots",
    "runs",
    "studies",
    "test_check.py",
    "test_notebooks.py",
    "test_pool.py",
    "test_recorded_replay.py",
)
"""Rooms and files whose tests end many runs and look at no picture, where drawing would be two thirds of the time."""

LOOKED_AT = ("test_detect_recording_command.py",)
"""Files in them whose tests look at a picture after all."""


SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.generations": 7,
    "run.checkpoint_every": 3,
    "run.threads": 1,
}


@pytest.fixture(autouse=True)
def _blank_pictures(request, monkeypatch):
    file = Path(request.fspath)
    if {file.parent.name, file.name} & {*BLANK} and file.name not in LOOKED_AT:
        save = Figure.savefig
        monkeypatch.setattr(
            Figure, "savefig", lambda _, *given, **options: save(Figure((1, 1)), *given, **options)
        )


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Call the command line in an empty folder; return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return ended.value.code, printed.out, printed.err

    return call


@pytest.fixture(scope="session")
def done():
    """Call the command line, which must succeed: for fixtures of what several tests look at."""

    def done(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        assert ended.value.code == 0

    return done


@pytest.fixture
def wide(monkeypatch):
    """Let tables have room."""
    monkeypatch.setenv("COLUMNS", "200")


@pytest.fixture(scope="session")
def small():
    """A configuration whose generations take about a millisecond."""

    def configure(**changes):
        return load_configuration(
            overrides=SMALL | {f"run.{name}": value for name, value in changes.items()}
        )

    return configure


@pytest.fixture
def stop_after():
    """Return a should_stop that stops a run after some generations."""

    def make(generations):
        asked = iter([False] * (generations - 1))
        return lambda: next(asked, True)

    return make
