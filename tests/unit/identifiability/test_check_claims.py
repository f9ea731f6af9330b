"""What a check may claim, on scores with known differences."""

import numpy as np

from turing_learning.identifiability import sides_rejected

ABOVE = np.array([False] * 4 + [True] * 4)


def differences(
    rng: np.random.Generator, below: float, above: float, groups: int = 40
) -> np.ndarray:
    """Return differences of scores at four values on either side; values share groups, and so are correlated."""
    common = rng.normal(size=groups)
    return (
        np.where(ABOVE, above, below)[:, None] + 0.7 * common + 0.7 * rng.normal(size=(8, groups))
    )


def share(below: float, above: float, repetitions: int = 200) -> float:
    rng = np.random.default_rng(1)
    return float(
        np.mean(
            [
                all(sides_rejected(differences(rng, below, above), ABOVE, rng))
                for _ in range(repetitions)
            ]
        )
    )


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
