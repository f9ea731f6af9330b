"""Motion that a run in a laboratory keeps to calibrate detectors with."""

import numpy as np
import pytest

from turing_learning.detection import keep_observed

ESTIMATE = np.array([0.5, -0.5])


def samples(count, first=0):
    """Samples (count, 3, 2) that hold nothing but their number."""
    return np.tile(np.arange(first, first + count, dtype=float)[:, None, None], (1, 3, 2))


def keep(path, learned=40, held_out=10, models=None):
    models = np.array([[0.5, -0.4], [0.0, 0.0], [0.9, -0.9]]) if models is None else models
    return keep_observed(
        path,
        learned=samples(learned),
        held_out=samples(held_out, first=100),
        replicas=samples(len(models), first=200),
        models=models,
        estimate=ESTIMATE,
    )


def test_as_many_are_kept_that_were_learned_from_as_were_not(tmp_path):
    with np.load(keep(tmp_path)) as kept:
        genuine = kept["genuine"][:, 0, 0]
    assert len(genuine) == 20
    assert (genuine[:10] < 40).all()
    assert (genuine[0], genuine[9]) == (0, 39)
    np.testing.assert_array_equal(genuine[10:], np.arange(100, 110))


def test_at_most_a_thousand_of_each_are_kept(tmp_path):
    with np.load(keep(tmp_path, learned=3000, held_out=2000)) as kept:
        assert len(kept["genuine"]) == 2000


def test_models_near_the_estimate_are_not_called_abnormal(tmp_path):
    with np.load(keep(tmp_path)) as kept:
        np.testing.assert_array_equal(kept["abnormal"][:, 0, 0], [201, 202])


def test_the_first_of_many_models_are_kept(tmp_path):
    with np.load(keep(tmp_path, models=np.zeros((500, 2)))) as kept:
        np.testing.assert_array_equal(kept["abnormal"][:, 0, 0], np.arange(200, 400))


@pytest.mark.parametrize("few", [{"held_out": 1}, {"learned": 1}, {"models": np.array([[0.5, -0.5]])}])
def test_nothing_is_kept_where_one_kind_is_missing(tmp_path, few):
    assert keep(tmp_path, **few) is None
    assert not list(tmp_path.iterdir())


def test_nothing_is_left_where_the_disk_is_full(tmp_path, monkeypatch):
    def fail(file, **_):
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="No space left"):
        keep(tmp_path)
    assert not list(tmp_path.iterdir())
