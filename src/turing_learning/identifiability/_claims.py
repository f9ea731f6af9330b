"""What the samples pin down, parameter by parameter, and what may be claimed of it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtr

from turing_learning.arrays import array
from turing_learning.errors import require

from ._evidence import PROFILING, Effort, Evidence, stream
from ._two_sample import paired_test

LEVEL = 0.05
"""How often a claim may be wrong."""

FLIPS = 2000
"""Random signs that a claim is held against."""

FEWEST = 6
"""Groups below which no choice of signs is as rare as `LEVEL` on either side."""

FINE = "fine"
"""Nothing speaks against the model or its estimate."""

FAILED_SEARCH = "failed search"
"""The model could do better than its estimate does."""

WRONG_MODEL = "wrong model"
"""The best models that were found are told from the system."""


def sides_rejected(
    differences: np.ndarray, above: np.ndarray, rng: np.random.Generator, *, level: float = LEVEL
) -> tuple[bool, bool]:
    """Say whether classifiers tell a parameter's values below the estimate, and those above it, better than the estimate.

    Per side the largest t statistic over its values is held against the same for random signs of the groups, the same signs
    for all values: so many values are no more likely to be rejected by chance than one. A parameter is pinned down only if both
    sides are rejected: beside an end of its range, where there is no value on one side, it never is.

    Parameters
    ----------
    differences : (V, G)
        For each of V values and each of G groups of samples: how much better classifiers of that value decide
        about the group than those of the estimate do about the same group.
    above : (V,) bool
        Which values are above the estimate; the others are below.
    rng
        For the signs.
    level
        How often a side may be rejected where no value of it is told apart.

    Returns
    -------
    (bool, bool)
        Below, above.

    Source
    ------
    Westfall and Young, Resampling-based multiple testing (1993); Berger, Multiparameter hypothesis testing and acceptance
    sampling (1982), for two sides that both must be rejected.
    """
    differences = array("differences", differences, "V G")
    above = array("above", above, "V", dtype=bool, V=len(differences))
    if differences.shape[1] < FEWEST:
        return False, False
    signs = rng.choice([-1.0, 1.0], (FLIPS, differences.shape[1]))
    found, chance = _t(differences, np.ones((1, signs.shape[1])))[0], _t(differences, signs)
    sides = []
    for side in (~above, above):
        if not side.any():
            sides.append(False)
            continue
        exceeded = (chance[:, side].max(axis=1) >= found[side].max() - 1e-9).sum()
        sides.append(bool((1 + exceeded) / (1 + FLIPS) <= level))
    return sides[0], sides[1]


def _t(differences: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Return t statistics (F, V) of the mean over groups with signs (F, G)."""
    count = differences.shape[1]
    means = signs @ differences.T / count
    variances = np.maximum((differences**2).mean(axis=1) - means**2, 1e-12) / (count - 1)
    t: np.ndarray = means / np.sqrt(variances)
    return t


def fault(
    accuracy: float,
    recovered: np.typing.ArrayLike,
    attainable: np.typing.ArrayLike,
    others: np.typing.ArrayLike = (),
    *,
    level: float = LEVEL,
) -> str:
    """Say whether an estimate is fine, its model is wrong, or its search has failed: a parametric bootstrap.

    Recoveries are runs whose truth is the estimate. They show how well fresh classifiers tell the samples from
    a model that a search has found where the model is right. Where they tell the run's own estimate better than
    that, it is the model if searches find their truth and no other search on the same samples has found a
    better estimate; else it is the search.

    Parameters
    ----------
    accuracy
        Of fresh classifiers that tell the genuine samples from the estimate.
    recovered : (B,)
        The same for each of at least 2 recoveries and what it has found.
    attainable : (B,)
        The same for each recovery and its truth, so about 0.5.
    others : (R,)
        The same as `accuracy` for estimates of other searches on the genuine samples.
    level
        How often a right model with searches that succeed may be called something else.

    Returns
    -------
    str
        `FINE`, `FAILED_SEARCH` or `WRONG_MODEL`.
    """
    found = array("recovered", recovered, "B")
    best = array("attainable", attainable, "B", B=len(found))
    again = array("others", others, "R", empty=True)
    require(len(found) >= 2, "recovered", "be of at least 2 recoveries", str(len(found)))
    if _exceeds(float(found.mean()), best, level / 2, len(found)):
        return FAILED_SEARCH
    if not _exceeds(accuracy, found, level / 2):
        return FINE
    return FAILED_SEARCH if len(again) and not _exceeds(float(again.min()), found, level / 2) else WRONG_MODEL


def _exceeds(value: float, sample: np.ndarray, level: float, size: int = 0) -> bool:
    """Return whether a value, or a mean of `size`, is beyond what a normally distributed sample (B,) makes likely."""
    count = len(sample)
    error = max(float(sample.std(ddof=1)), 1e-9) * np.sqrt(1 / count + (1 / size if size else 1))
    return bool(stdtr(count - 1, (value - sample.mean()) / error) > 1 - level)


@dataclass(frozen=True)
class Profile:
    """Fresh classifiers against models that differ from the estimate in one parameter.

    Attributes
    ----------
    parameter
        Its name.
    values
        Values of the parameter, ascending over its initial range, the estimate among them.
    numbers
        The same as numbers from -1 to 1 over the initial range.
    place
        Which of them is the estimate.
    accuracies, criticals
        Of the test at each value, see `TwoSampleTest`.
    rejected
        Whether values below the estimate, and values above it, are shown to fit worse, see `sides_rejected`; None in older checks.
    """

    parameter: str
    values: tuple[float, ...]
    numbers: tuple[float, ...]
    place: int
    accuracies: tuple[float, ...]
    criticals: tuple[float, ...]
    rejected: tuple[bool, bool] | None = None

    @property
    def told_apart(self) -> tuple[bool, ...]:
        """Whether classifiers tell a value from the genuine samples, and better than they tell the estimate."""
        lead = max(0.0, self.accuracies[self.place] - 0.5)
        return tuple(
            accuracy > critical + lead for accuracy, critical in zip(self.accuracies, self.criticals, strict=True)
        )

    @property
    def open_share(self) -> float:
        """Share of the initial range, around the estimate, in which no value is told apart: at most so much is left open."""
        apart = np.flatnonzero(self.told_apart)
        numbers = np.array(self.numbers)
        below, above = numbers[apart[apart < self.place]], numbers[apart[apart > self.place]]
        low = below[-1] if len(below) else min(-1.0, numbers[0])
        high = above[0] if len(above) else max(1.0, numbers[-1])
        return float(min((high - low) / 2, 1.0))

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in vars(self).items()}


def profile(
    evidence: Evidence, estimate: np.ndarray, place: int, effort: Effort, *, seed: int, beyond: bool = False
) -> Profile:
    """Move one parameter across its initial range, and test at each value as at the estimate.

    The other parameters stay where they are. A parameter that only others can make up for looks pinned down here.

    Parameters
    ----------
    evidence
        The samples and the simulator.
    estimate : (P,)
        In the parameters' units.
    place
        Which parameter.
    effort
        How much is simulated and trained, and at how many values.
    seed
        Of all random numbers.
    beyond
        If True, and the estimate lies at an end of the initial range that the search may leave: the values
        extend beyond that end by a quarter of the range.
    """
    name, parameter = list(evidence.parameters.items())[place]
    own, step = float(parameter.to_numbers(estimate[place])), 2 / max(effort.points - 1, 1)
    low = own - 0.5 if beyond and parameter.low is None and own < step / 2 - 1 else -1
    high = own + 0.5 if beyond and parameter.high is None and own > 1 - step / 2 else 1
    numbers = np.append(np.linspace(low, high, effort.points), own)
    order = np.argsort(numbers, kind="stable")
    values = parameter.to_units(numbers[order])
    tests, accuracies = zip(
        *(
            paired_test(
                evidence,
                _moved(estimate, place, value),
                effort,
                seed=seed,
                use=(PROFILING, place, k),
                generations=effort.profile_generations,
                population=effort.profile_population,
            )
            for k, value in enumerate(values.tolist())
        ),
        strict=True,
    )
    here = int(np.flatnonzero(order == effort.points)[0])
    others = np.delete(np.arange(len(values)), here)
    differences = np.array(accuracies)[others] - accuracies[here]
    return Profile(
        parameter=name,
        values=tuple(values.tolist()),
        numbers=tuple(numbers[order].tolist()),
        place=here,
        accuracies=tuple(test.accuracy for test in tests),
        criticals=tuple(test.critical for test in tests),
        rejected=sides_rejected(differences, others > here, stream(seed, PROFILING, place, effort.points + 1)),
    )


def _moved(estimate: np.ndarray, place: int, value: float) -> np.ndarray:
    moved = estimate.copy()
    moved[place] = value
    return moved
