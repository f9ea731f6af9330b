from pathlib import Path

import numpy as np
import pytest

from turing_learning.runs._folder import (
    CONFIGURATION,
    Checkpoint,
    discard_checkpoints,
    save_checkpoint,
    stored_checkpoints,
)


def checkpoint(generation):
    return Checkpoint(
        generation, {"a/b": np.arange(generation, dtype=float), "n": np.array(generation)}
    )


def latest(folder):
    return next((found for _, found in stored_checkpoints(folder) if found), None)


def test_a_checkpoint_reads_back_as_it_was_written(tmp_path):
    path = save_checkpoint(tmp_path, checkpoint(5))
    [(where, found)] = stored_checkpoints(tmp_path)
    assert (where, found.generation) == (path, 5)
    np.testing.assert_array_equal(found.arrays["a/b"], np.arange(5.0))
    assert found.arrays["n"] == 5


def test_the_last_two_checkpoints_are_kept(tmp_path):
    for generation in (1, 2, 3, 10):
        save_checkpoint(tmp_path, checkpoint(generation))
    assert sorted(path.name[:17] for path in tmp_path.iterdir()) == [
        "generation-000003",
        "generation-000010",
    ]


@pytest.mark.parametrize(
    "damage",
    [lambda b: b[:-1], lambda b: b"", lambda b: bytes([b[0] ^ 1]) + b[1:], lambda b: b + b"x"],
)
def test_a_truncated_or_altered_checkpoint_is_passed_over(damage, tmp_path):
    before = save_checkpoint(tmp_path, checkpoint(1))
    path = save_checkpoint(tmp_path, checkpoint(2))
    path.write_bytes(damage(path.read_bytes()))
    found = [(path, found and found.generation) for path, found in stored_checkpoints(tmp_path)]
    assert found == [(path, None), (before, 1)]


def test_any_single_altered_byte_is_recognized(tmp_path):
    path = save_checkpoint(tmp_path, checkpoint(2))
    content = path.read_bytes()
    for place in range(0, len(content), 17):
        altered = bytearray(content)
        altered[place] ^= 0x40
        path.write_bytes(altered)
        assert latest(tmp_path) is None


def test_without_checkpoints_there_is_none(tmp_path):
    assert latest(tmp_path / "missing") is None


def test_arrays_of_python_objects_are_refused(tmp_path):
    with pytest.raises(ValueError, match="Object arrays cannot be saved when allow_pickle=False"):
        save_checkpoint(tmp_path, Checkpoint(1, {"a": np.array([{}], dtype=object)}))
    assert latest(tmp_path) is None


def test_a_checkpoint_of_another_configuration_is_passed_over(tmp_path):
    save_checkpoint(tmp_path, checkpoint(1))
    path = save_checkpoint(tmp_path, Checkpoint(2, {CONFIGURATION: np.array("another")}))
    assert next(stored_checkpoints(tmp_path, "this one")) == (path, None)
    newest, unnamed = (found for _, found in stored_checkpoints(tmp_path, "another"))
    assert (newest.generation, unnamed) == (2, None)


def test_a_checkpoint_that_is_removed_while_it_is_looked_for_is_passed_over(tmp_path, monkeypatch):
    save_checkpoint(tmp_path, checkpoint(1))
    gone = tmp_path / "generation-000002-0123456789abcdef.npz"
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [gone, *folder.iterdir()])
    assert latest(tmp_path).generation == 1


def test_later_checkpoints_are_discarded(tmp_path):
    for generation in (1, 2):
        save_checkpoint(tmp_path, checkpoint(generation))
    discard_checkpoints(tmp_path, above=1)
    assert [path.name[:17] for path in tmp_path.iterdir()] == ["generation-000001"]
