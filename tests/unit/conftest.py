"""What the tests of commands share."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from turing_learning.cli import main

BLANK = ("cli", "robots")
"""Rooms whose tests end many runs and look at no picture, where drawing would be two thirds of the time."""

LOOKED_AT = ("test_detect_recording_command.py",)
"""Files in them whose tests look at a picture after all."""


@pytest.fixture(autouse=True)
def _blank_pictures(request, monkeypatch):
    file = Path(request.fspath)
    if file.parent.name in BLANK and file.name not in LOOKED_AT:
        save = Figure.savefig
        monkeypatch.setattr(Figure, "savefig", lambda _, *given, **options: save(Figure((1, 1)), *given, **options))


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


@pytest.fixture
def wide(monkeypatch):
    """Let tables have room."""
    monkeypatch.setenv("COLUMNS", "200")
