"""What the tests of commands share."""

import pytest

from turing_learning.cli import main


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
