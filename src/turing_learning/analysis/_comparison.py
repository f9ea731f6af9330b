"""Whether samples differ from a reference."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEVEL = 0.05
"""Significance level of the paper's tests, section 4.3."""


@dataclass(frozen=True)
class Comparison:
    """Two-sided Mann-Whitney tests of several samples against one reference.

    Attributes
    ----------
    p_values : (S,)
        Of each test, not corrected.
    level
        Significance level of all tests together.
    """

    p_values: np.ndarray
    level: float

    @property
    def significant(self) -> np.ndarray:
        """Which samples differ (S,), with Bonferroni's correction: p below the level over the number of tests."""
        return self.p_values < self.level / len(self.p_values)

    @property
    def without_difference(self) -> int:
        """Number of samples that do not differ significantly."""
        return int(np.count_nonzero(~self.significant))


def compare(
    reference: np.typing.ArrayLike, samples: Sequence[np.typing.ArrayLike] | np.ndarray, *, level: float = LEVEL
) -> Comparison:
    """Test samples against a reference, each with a two-sided Mann-Whitney test, and Bonferroni's correction.

    Parameters
    ----------
    reference : (R,)
        For example the dispersion of agents in R trials.
    samples : S arrays (R,)
        For example the dispersion of replicas; they may differ in length.
    level
        Significance level of all tests together, in (0, 1).

    Raises
    ------
    ValueError
        If there is nothing to test, a value is not finite, or the level is not in (0, 1).

    Source
    ------
    Paper, section 4.3.
    """
    from scipy.stats import mannwhitneyu

    if not 0 < level < 1:
        raise ValueError(f"`level` must be in (0, 1); got {level}.")
    if len(samples) == 0:
        raise ValueError("`samples` must hold at least one sample; got none.")
    first = _checked("reference", reference)
    others = [_checked(f"samples[{number}]", sample) for number, sample in enumerate(samples)]
    tests = (mannwhitneyu(first, other, alternative="two-sided") for other in others)
    return Comparison(np.array([test.pvalue for test in tests]), level)


def _checked(name: str, values: np.typing.ArrayLike) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1 or array.size == 0:
        raise ValueError(f"`{name}` must be of shape (R,) and not empty; got {array.shape}.")
    if not np.isfinite(array).all():
        raise ValueError(f"`{name}` must be finite; got {array[~np.isfinite(array)][0]}.")
    return array
