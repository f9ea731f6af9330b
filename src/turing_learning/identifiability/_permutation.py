"""Whether two kinds of samples differ, where samples of a group are alike."""

from dataclasses import dataclass

import numpy as np

PERMUTATIONS = 999
LEVEL = 0.05


@dataclass(frozen=True)
class Permutation:
    """A permutation test of whole groups.

    Attributes
    ----------
    difference
        Mean score of the genuine groups minus that of the counterfeit ones.
    p_value
        Share of the permutations with a difference as large, in units of its standard error; one-sided.
    critical
        The difference above which the p-value is at most 0.05, at the standard error that was found.
    """

    difference: float
    p_value: float
    critical: float


def permutation_test(
    genuine: np.ndarray, counterfeit: np.ndarray, rng: np.random.Generator, *, permutations: int = PERMUTATIONS
) -> Permutation:
    """Test whether genuine groups score higher than counterfeit ones.

    Samples of one individual are alike, so that they are not permuted: each group enters with the mean score of its samples,
    and the labels of groups are permuted. The statistic is the difference of the means over its standard error (Welch), which
    keeps the rate of false alarms near its nominal value also where groups of the two kinds vary differently.

    Parameters
    ----------
    genuine, counterfeit : (groups,)
        Mean score of each group, at least two of each kind.
    rng
        Draws the permutations.
    permutations
        Their number, >= 19.

    Raises
    ------
    ValueError
        If there are fewer than two groups of a kind, or too few permutations.

    Source
    ------
    Chung and Romano, Exact and asymptotically robust permutation tests, Annals of Statistics 41 (2013).
    """
    for name, scores in (("genuine", genuine), ("counterfeit", counterfeit)):
        if len(scores) < 2:
            raise ValueError(f"`{name}` must hold at least 2 groups; got {len(scores)}.")
    if permutations < 19:
        raise ValueError(f"`permutations` must be at least 19; got {permutations}.")
    pooled = np.concatenate((genuine, counterfeit))
    shuffled = rng.permuted(np.tile(pooled, (permutations, 1)), axis=1)
    drawn, _ = _welch(shuffled, len(genuine))
    found, error = (float(value[0]) for value in _welch(pooled[None], len(genuine)))
    return Permutation(
        difference=float(genuine.mean() - counterfeit.mean()),
        p_value=(1 + int(np.count_nonzero(drawn >= found - 1e-9))) / (permutations + 1),
        critical=float(np.sort(drawn)[-int(LEVEL * (permutations + 1))]) * error,
    )


def _welch(scores: np.ndarray, genuine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return t and the standard error of the difference, (R,) each, of scores (R, groups), the genuine groups first."""
    sides = scores[:, :genuine], scores[:, genuine:]
    difference = sides[0].mean(axis=1) - sides[1].mean(axis=1)
    error = np.sqrt(sum(side.var(axis=1, ddof=1) / side.shape[1] for side in sides))
    return difference / np.maximum(error, 1e-12), error


def group_means(scores: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the mean of the scores (S,) in each group, by the numbers (S,) of the groups, ascending."""
    _, members, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return np.bincount(members, weights=scores) / counts
