from pathlib import Path

import numpy as np
import pytest

from turing_learning.results._folder import Checkpoint, discard_checkpoints, latest_checkpoint, save_checkpoint


def checkpoint(generation):
    return Checkpoint(generation, {"a/b": np.arange(generation, dtype=float), "n": np.array(generation)})


def test_a_checkpoint_reads_back_as_it_was_written(tmp_path):
    save_checkpoint(tmp_path, checkpoint(5))
    latest = latest_checkpoint(tmp_path)
    assert latest.damaged == ()
    assert latest.checkpoint.generation == 5
    np.testing.assert_array_equal(latest.checkpoint.arrays["a/b"], np.arange(5.0))
    assert latest.checkpoint.arrays["n"] == 5


def test_the_last_two_checkpoints_are_kept(tmp_path):
    for generation in (1, 2, 3, 10):
        save_checkpoint(tmp_path, checkpoint(generation))
    assert sorted(path.name[:17] for path in tmp_path.iterdir()) == ["generation-000003", "generation-000010"]


@pytest.mark.parametrize(
    "damage", [lambda b: b[:-1], lambda b: b"", lambda b: bytes([b[0] ^ 1]) + b[1:], lambda b: b + b"x"]
)
def test_a_truncated_or_altered_checkpoint_is_passed_over(damage, tmp_path):
    save_checkpoint(tmp_path, checkpoint(1))
    path = save_checkpoint(tmp_path, checkpoint(2))
    path.write_bytes(damage(path.read_bytes()))
    latest = latest_checkpoint(tmp_path)
    assert latest.checkpoint.generation == 1
    assert latest.damaged == (path,)


def test_any_single_altered_byte_is_recognized(tmp_path):
    path = save_checkpoint(tmp_path, checkpoint(2))
    content = path.read_bytes()
    for place in range(0, len(content), 17):
        altered = bytearray(content)
        altered[place] ^= 0x40
        path.write_bytes(altered)
        assert latest_checkpoint(tmp_path).checkpoint is None


def test_without_checkpoints_there_is_none(tmp_path):
    assert latest_checkpoint(tmp_path / "missing").checkpoint is None


def test_arrays_of_python_objects_are_refused(tmp_path):
    with pytest.raises(ValueError, match="Object arrays cannot be saved when allow_pickle=False"):
        save_checkpoint(tmp_path, Checkpoint(1, {"a": np.array([{}], dtype=object)}))
    assert latest_checkpoint(tmp_path).checkpoint is None


def test_a_checkpoint_that_is_not_accepted_is_passed_over(tmp_path):
    save_checkpoint(tmp_path, checkpoint(1))
    newest = save_checkpoint(tmp_path, checkpoint(2))
    latest = latest_checkpoint(tmp_path, lambda found: found.generation < 2)
    assert latest.checkpoint.generation == 1
    assert latest.refused == (newest,)
    assert latest.damaged == ()


def test_a_checkpoint_that_is_removed_while_it_is_looked_for_is_passed_over(tmp_path, monkeypatch):
    save_checkpoint(tmp_path, checkpoint(1))
    gone = tmp_path / "generation-000002-0123456789abcdef.npz"
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [gone, *folder.iterdir()])
    assert latest_checkpoint(tmp_path).checkpoint.generation == 1


def test_later_checkpoints_are_discarded(tmp_path):
    for generation in (1, 2):
        save_checkpoint(tmp_path, checkpoint(generation))
    discard_checkpoints(tmp_path, above=1)
    assert [path.name[:17] for path in tmp_path.iterdir()] == ["generation-000001"]
