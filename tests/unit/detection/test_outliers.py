import numpy as np
import pytest
from sklearn.utils.estimator_checks import parametrize_with_checks

from turing_learning.detection import MotionOutlierDetector


@parametrize_with_checks([MotionOutlierDetector()])
def test_it_obeys_the_conventions_of_scikit_learn(estimator, check):
    check(estimator)


def walkers(count, seed, turn=0.3):
    rng = np.random.default_rng(seed)
    speed = 5 + rng.normal(0, 0.5, (count, 1)) + rng.normal(0, 0.5, (count, 100))
    return np.stack([speed, rng.normal(0, turn, (count, 100))], axis=-1)


def test_those_who_turn_otherwise_are_told():
    detector = MotionOutlierDetector(false_alarms=0.05).fit(walkers(80, 1))
    assert (detector.predict(walkers(40, 2)) == 1).mean() > 0.8
    assert (detector.predict(walkers(40, 3, turn=0.9)) == -1).all()
    assert (detector.decision_function(walkers(40, 3, turn=0.9)) < 0).all()


def test_one_among_many_is_found():
    motion = np.concatenate([walkers(60, 1), walkers(1, 2, turn=2.0)])
    assert np.argmin(MotionOutlierDetector().fit(motion).score_samples(motion)) == 60


def test_samples_of_another_shape_are_refused():
    detector = MotionOutlierDetector().fit(walkers(20, 1))
    with pytest.raises(
        ValueError, match="X has 50 features, but MotionOutlierDetector is expecting 100"
    ):
        detector.predict(walkers(20, 1)[:, :50])
    with pytest.raises(
        ValueError, match=r"dim 4, while dim 3 or 2 is required: \(n, T, D\) or \(n, T\)"
    ):
        detector.fit(np.zeros((3, 2, 5, 2)))
    with pytest.raises(
        ValueError,
        match=r"`false_alarms` must be a finite number above 0 and of at most 0.5; got 0.7",
    ):
        MotionOutlierDetector(false_alarms=0.7).fit(walkers(20, 1))
