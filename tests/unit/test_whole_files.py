"""Files that are there whole or not at all."""

import os
from pathlib import Path

import pytest

from turing_learning._files import in_home, whole


def contents(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_the_old_file_is_there_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with whole(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert contents(tmp_path) == {"a": "new"}


def test_a_file_is_flushed_to_the_disk_before_it_has_its_name(tmp_path, monkeypatch):
    flushed = []
    monkeypatch.setattr(os, "fsync", lambda descriptor: flushed.append((tmp_path / "a").exists()))
    with whole(tmp_path / "a") as temporary:
        temporary.write_text("new")
    assert flushed == (
        [False, True] if os.name == "posix" else [False]
    )  # the folder, too, after it


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, error):
    (tmp_path / "a").write_text("old")

    def fail():
        with whole(tmp_path / "a") as temporary:
            temporary.write_text("half")
            raise error

    with pytest.raises(type(error)):
        fail()
    assert contents(tmp_path) == {"a": "old"}


def test_processes_that_write_the_same_file_do_not_meet(tmp_path, monkeypatch):
    processes = iter([1, 2])
    monkeypatch.setattr(os, "getpid", lambda: next(processes))
    with whole(tmp_path / "a") as first, whole(tmp_path / "a") as second:
        first.write_text("first")
        second.write_text("second")
    assert contents(tmp_path) == {"a": "first"}


@pytest.mark.parametrize(
    ("given", "meant"),
    [("~/a", "/home/her/a"), ("a/~", "a/~"), ("~nobody-known/a", "~nobody-known/a")],
)
def test_a_leading_tilde_is_the_home_folder_of_somebody_known(monkeypatch, given, meant):
    monkeypatch.setenv("HOME", "/home/her")
    assert in_home(given) == in_home(Path(given)) == Path(meant)
