"""The command that runs an emulated laboratory."""

import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from turing_learning.robots import EPuck, load_laboratory, open_link


@contextmanager
def running(command, folder):
    """A process, which is killed if the test fails before it has ended."""
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with subprocess.Popen(command, cwd=folder, text=True, **pipes) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_laboratory_tells_its_addresses_obeys_and_ends_cleanly(tmp_path, number):
    command = [
        sys.executable,
        "-m",
        "turing_learning",
        "arena",
        "--agents",
        "1",
        "--speed",
        "2",
        "--lines",
        "tcp",
    ]
    with running(command, tmp_path) as process:
        assert process.stdout.readline() == "preparing the laboratory\n"
        told = [process.stdout.readline() for _ in range(6)]
        assert [line.split()[0] for line in told[:5]] == [
            "agent-1",
            "replica-1",
            "replica-2",
            "camera",
            "laboratory",
        ]
        setup = load_laboratory(tmp_path / "lab" / "lab.toml").setup
        with open_link(setup.replicas[0].address) as link:
            robot = EPuck(link, timeout_s=20.0)
            assert robot.status().state == "R0"
            process.stdin.write("remote\n")
            process.stdin.flush()
            assert robot.wait_for("STOP", 60.0).trial == 0
        process.stdin.write("dance\n")
        process.stdin.flush()
        assert process.stdout.readline().startswith("`command` must be one of")
        process.send_signal(number)
        out, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (0, "")
    assert out.strip() == "the laboratory is closed"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--lines", "air"], "`lines` must be one of terminal, tcp; got 'air'"),
        (["--speed", "0"], "`speed` must be a finite number above 0; got 0.0"),
        (["--replicas", "9"], "`scenario.replicas` must be at most 4"),
        (["--agents", "0"], "`scenario.agents` must be an integer of at least 1; got 0"),
        (["--seed", "-1"], "`seed` must be 0 or more; got -1 [--seed]"),
    ],
)
def test_what_cannot_be_is_refused(call, options, message):
    code, _, err = call("arena", *options)
    assert code == 2
    assert message in err


def test_a_folder_that_cannot_be_written_is_refused(call, tmp_path):
    (tmp_path / "lab").write_text("no folder")
    code, _, err = call("arena", "--agents", "1", "--lines", "tcp")
    assert code == 2
    assert err == (
        "error: `out` must be a folder that can be written; got lab (File exists). Choose another, or make room.\n"
    )


def test_a_folder_with_a_laboratory_is_left_alone(call, tmp_path):
    folder = tmp_path / "lab"
    folder.mkdir()
    (folder / "lab.toml").write_text("mine")
    code, _, err = call("arena")
    assert code == 2
    assert "`out` must be a new file" in err
    assert (folder / "lab.toml").read_text() == "mine"
