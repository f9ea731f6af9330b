import json

import numpy as np
import pytest

from turing_learning.reproduction import Stopped
from turing_learning.reproduction._experiment import Work, index_of_median
from turing_learning.studies import ExecutorError

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
}


def test_a_piece_of_work_is_done_once(tmp_path):
    calls, said = [], []

    def compute():
        calls.append(1)
        return {"value": 7}

    for _ in range(3):
        assert Work(tmp_path / "pieces", None, say=said.append).piece("one", compute) == {
            "value": 7
        }
    assert len(calls) == 1
    assert [text.partition(":")[0] for text in said] == ["one"]


def test_arrays_are_computed_once_and_come_back_as_they_were(tmp_path):
    calls = []

    def compute():
        calls.append(1)
        return {"seconds": np.arange(3, dtype=np.uint32), "empty": np.empty((0, 2), np.float32)}

    for _ in range(2):
        work = Work(tmp_path / "pieces", None)
        found = work.piece("one", compute, "npz")
        assert (found["seconds"].tolist(), found["seconds"].dtype) == ([0, 1, 2], np.uint32)
        assert (found["empty"].shape, found["empty"].dtype) == ((0, 2), np.float32)
        assert work.seconds < 10
    assert len(calls) == 1


@pytest.mark.parametrize("damage", [b"", b"PK", None])
def test_arrays_whose_file_is_not_whole_are_computed_again(damage, tmp_path):
    path = tmp_path / "one.npz"
    if damage is None:
        Work(tmp_path, None).piece("one", lambda: {"value": np.arange(1000)}, "npz")
        damage = path.read_bytes()[:-100]
    path.write_bytes(damage)
    assert Work(tmp_path, None).piece("one", lambda: {"value": np.array(7)}, "npz")["value"] == 7


def test_arrays_that_were_stopped_leave_no_file(tmp_path):
    with pytest.raises(Stopped, match="one"):
        Work(tmp_path, None).piece("one", lambda: None, "npz")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_not_whole_is_made_again(tmp_path):
    (tmp_path / "one.json").write_text('{"found": {"val')
    assert Work(tmp_path, None).piece("one", lambda: {"value": 7}) == {"value": 7}
    assert json.loads((tmp_path / "one.json").read_text())["found"] == {"value": 7}


def test_the_time_of_a_piece_counts_also_when_it_was_done_earlier(tmp_path):
    work = Work(tmp_path, None)
    work.store.write("one.json", {"seconds": 12.5, "found": {}})
    work.piece("one", dict)
    assert work.seconds == 12.5


def test_a_piece_that_is_asked_for_again_counts_once(tmp_path):
    work = Work(tmp_path, None)
    work.store.write("one.json", {"seconds": 12.5, "found": {}})
    for _ in range(2):
        work.piece("one", dict)
    assert work.seconds == 12.5


def test_nothing_is_begun_after_a_stop_was_asked_for(tmp_path):
    work = Work(tmp_path, None, should_stop=lambda: True)
    with pytest.raises(Stopped, match="one"):
        work.piece("one", lambda: {"value": 7})
    assert list(tmp_path.iterdir()) == []


def test_a_piece_that_was_stopped_leaves_no_file(tmp_path):
    with pytest.raises(Stopped, match="one"):
        Work(tmp_path, None).piece("one", lambda: None)
    assert list(tmp_path.iterdir()) == []


def small_study(work):
    return work.study("study", "aggregation", runs=2, generations=3, settings=SMALL)


def test_a_study_is_executed_once(tmp_path):
    said = []
    first = small_study(Work(tmp_path, None, fast=True, say=said.append))
    again = small_study(Work(tmp_path, None, fast=True, say=said.append))
    assert first == again
    assert said[-1] == "study: 2 of 2 runs"
    assert said.count(said[-1]) == 1


def test_a_study_that_is_stopped_can_go_on(tmp_path):
    with pytest.raises(Stopped, match="study"):
        small_study(Work(tmp_path, None, fast=True, should_stop=lambda: True))
    assert small_study(Work(tmp_path, None, fast=True)).complete


def test_a_study_with_failed_runs_is_no_result(tmp_path, monkeypatch):
    def fail(*arguments, **named):
        raise MemoryError("too little")

    with monkeypatch.context() as patched:
        patched.setattr("turing_learning.studies._backends.start", fail)
        with pytest.raises(
            ExecutorError,
            match=r"`study` must have no runs that fail; got 2, the first for: MemoryError",
        ):
            small_study(Work(tmp_path, None, fast=True))
    assert small_study(Work(tmp_path, None, fast=True)).complete


def test_a_damaged_piece_is_set_aside_and_done_again(tmp_path, caplog):
    for suffix in ("json", "npz"):
        Work(tmp_path, None).piece("one", lambda: {"value": np.arange(3).tolist()}, suffix)
        path = tmp_path / f"one.{suffix}"
        path.write_bytes(path.read_bytes().replace(b"seconds", b"secondt"))
        assert list(Work(tmp_path, None).piece("one", lambda: {"value": [7]}, suffix)["value"]) == [
            7
        ]
        assert (tmp_path / f"one.{suffix}.damaged").exists()
        assert (
            f"one.{suffix} is damaged (it has been changed); it is made again"
            in caplog.messages[-1]
        )


@pytest.mark.parametrize(
    ("errors", "place"), [([3.0, 1.0, 2.0], 2), ([4.0, 1.0, 3.0, 2.0], 3), ([5.0], 0)]
)
def test_the_median_is_the_middle_error_or_the_smaller_of_two(errors, place):
    assert index_of_median(errors) == place
