"""Rates of the classifier two-sample test over synthetic repetitions, in a fast form; docs/identifiability.md has more."""

import numpy as np

from turing_learning.identifiability import Effort, Evidence, two_sample_test
from turing_learning.models import Parameter

EFFORT = Effort(samples=30)


def walk(values, rng):
    shape = (len(values), 20)
    return np.stack(
        [values[:, :1] + rng.normal(size=shape), values[:, 1:] * rng.normal(size=shape)], axis=-1
    )[:, None]


def p_value(seed, values, individuals=None):
    """Test values against samples at (0, 1); of individuals that differ lastingly if their number is given."""
    rng = np.random.default_rng((seed, 5))
    genuine = walk(np.tile([0.0, 1.0], (90, 1)), rng)[:, 0]
    groups = np.arange(60)
    if individuals is not None:
        groups = np.arange(60) % individuals
        genuine[30:, :, 0] += rng.normal(size=individuals)[groups, None]
    evidence = Evidence(
        learning=genuine[:30],
        testing=genuine[30:],
        groups=groups,
        grouping="samples",
        simulate=walk,
        parameters={"speed": Parameter(-3, 3), "noise": Parameter(0, 3)},
    )
    return two_sample_test(evidence, np.array(values), EFFORT, seed=seed).p_value


def test_the_truth_is_rejected_about_as_often_as_stated():
    found = np.array([p_value(seed, [0.0, 1.0]) for seed in range(60)])
    # Binomial(60, 0.1) exceeds 14 twice in a thousand times, Binomial(60, 0.5) leaves 17 to 43 three times
    assert np.count_nonzero(found <= 0.1) <= 14
    assert 17 <= np.count_nonzero(found <= 0.5) <= 43


def test_individuals_that_differ_lastingly_raise_no_false_alarms():
    found = np.array([p_value(seed, [0.0, 1.0], individuals=6) for seed in range(60)])
    assert np.count_nonzero(found <= 0.1) <= 14


def test_a_wrong_model_is_rejected_nearly_always():
    found = np.array([p_value(seed, [1.0, 1.0]) for seed in range(15)])
    assert np.count_nonzero(found <= 0.05) >= 12
