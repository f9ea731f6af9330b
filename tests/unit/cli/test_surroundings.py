"""Commands where something around them is missing: streams, the working folder, a folder for temporary files."""

import os
import subprocess
import sys

import pytest


def shell(line, **environment):
    """Call a line of the shell, in which "$0" is Python."""
    command = ["sh", "-c", line, sys.executable]
    environment = os.environ | environment
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


@pytest.mark.parametrize("closed", [">&-", "<&- >&-", "2>&-", "<&- >&- 2>&-"])
def test_a_command_works_where_its_streams_are_closed(closed):
    done = shell(f'exec "$0" -m turing_learning scenarios {closed}')
    assert (done.returncode, done.stderr) == (0, "")
    assert ("aggregation" in done.stdout) == (">&-" not in closed.split())


def test_a_refusal_is_an_exit_code_where_nothing_can_be_said():
    done = shell('exec "$0" -m turing_learning show nowhere >&- 2>&-')
    assert (done.returncode, done.stdout, done.stderr) == (2, "", "")


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "aggregation", "--duration", "1"),
        ("simulate", "aggregation", "--duration", "1", "--out", "swarm.html"),
        ("sample", "fish"),
        ("sample", "fish", "--out", "fish"),
    ],
)
def test_a_working_folder_that_is_gone_is_said_in_one_line(arguments, call, tmp_path, monkeypatch):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    code, out, err = call(*arguments)
    assert (code, out) == (1, "")
    assert err == (
        "error: the folder in which the command runs is gone. Change to another folder, then give the command again.\n"
    )


def test_a_run_needs_no_folder_for_temporary_files(tmp_path):
    options = "--generations 2 --set models.population=4 --set classifiers.population=4 --set run.history=thin"
    line = f'exec "$0" -m turing_learning infer aggregation {options} --out run'
    done = shell(f"cd {tmp_path} && {line}", TMPDIR=str(tmp_path / "gone"))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "result.json").exists()
