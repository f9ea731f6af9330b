"""What a check may claim, on scores with known differences."""

import numpy as np
import pytest

from turing_learning.identifiability import fault, sides_rejected
from turing_learning.identifiability._check import FAILED_SEARCH, FINE, WRONG_MODEL

ABOVE = np.array([False] * 4 + [True] * 4)


def differences(rng: np.random.Generator, below: float, above: float, groups: int = 40) -> np.ndarray:
    """Return differences of scores at four values on either side; values share groups, and so are correlated."""
    common = rng.normal(size=groups)
    return np.where(ABOVE, above, below)[:, None] + 0.7 * common + 0.7 * rng.normal(size=(8, groups))


def share(below: float, above: float, repetitions: int = 200) -> float:
    rng = np.random.default_rng(1)
    return float(np.mean([all(sides_rejected(differences(rng, below, above), ABOVE, rng)) for _ in range(repetitions)]))


def test_a_parameter_without_effect_is_seldom_called_pinned_down():
    assert share(0.0, 0.0) <= 0.05


def test_one_side_alone_pins_nothing_down():
    assert share(0.0, 1.0) <= 0.05 + 4 * np.sqrt(0.05 * 0.95 / 200)


def test_a_parameter_that_is_told_apart_on_both_sides_is_pinned_down():
    assert share(0.7, 0.7) >= 0.8


def test_nothing_is_pinned_down_beside_an_end_of_its_range():
    rng = np.random.default_rng(2)
    assert sides_rejected(differences(rng, 3.0, 3.0)[4:], ABOVE[4:], rng) == (False, True)


def test_few_groups_claim_nothing():
    rng = np.random.default_rng(3)
    assert sides_rejected(differences(rng, 3.0, 3.0, groups=5), ABOVE, rng) == (False, False)


@pytest.mark.parametrize(
    ("accuracy", "recovered", "others", "verdict"),
    [
        (0.52, [0.50, 0.52, 0.51, 0.53, 0.49], [], FINE),
        (0.64, [0.50, 0.52, 0.51, 0.53, 0.49], [], WRONG_MODEL),
        (0.64, [0.50, 0.52, 0.51, 0.53, 0.49], [0.63, 0.66], WRONG_MODEL),
        (0.64, [0.50, 0.52, 0.51, 0.53, 0.49], [0.63, 0.51], FAILED_SEARCH),
        (0.57, [0.58, 0.66, 0.55, 0.61, 0.57], [], FAILED_SEARCH),
    ],
)
def test_recoveries_tell_whether_the_model_or_the_search_is_at_fault(accuracy, recovered, others, verdict):
    assert fault(accuracy, recovered, [0.50, 0.49, 0.51, 0.50, 0.51], others) == verdict


def test_a_right_model_is_called_fine_nine_times_of_ten():
    rng = np.random.default_rng(4)
    verdicts = [
        fault(rng.normal(0.51, 0.02), rng.normal(0.51, 0.02, 5), rng.normal(0.505, 0.02, 5)) for _ in range(300)
    ]
    assert verdicts.count(FINE) / 300 >= 0.9


def test_one_recovery_is_too_few():
    with pytest.raises(ValueError, match="`recovered` must be of at least 2 recoveries"):
        fault(0.5, [0.5], [0.5])
