"""The read-out: from what observers say of all trials to the parameters that match the agents.

`match` solves it once. Here is from which trials, how often, and what is stated of the solution.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ._matching import (
    INTERVAL_TAIL,
    LEAST_P,
    UNTOLD_WIDTH,
    Matched,
    combined,
    ends_of_modes,
    identified_by,
    match,
)
from ._ridge import WIDE
from ._space import SearchSpace

FEWEST_MATCHED = 50
"""Trials within reach below which nothing is matched."""

CENTERS = 12
"""Ends of the searches of a lost run that are matched, the best ones."""

CENTER_SPREAD = 0.03
"""Standard deviation around such an end that its draws begin with, in units of the space."""

LEAST_SPREAD = 1e-3
"""Least standard deviation that draws begin with."""

FEWEST_IN_SHARE = 500
"""Fewest trials that a share of them comes to."""

NEAR_PER_FAR = 10
"""For so many trials that are near, one from elsewhere is matched."""

WALKERS_AT_END = 0.05
"""Share of the walkers at an end from which on the 90 % interval reaches that end."""

RANGE_WIDTH = 2.0
"""Width of the range of the first models: an interval as wide as that tells nothing."""

END_MARGIN = 0.1
"""Distance from an end, in widths of the interval, up to which it includes the end.

Draws do not become fewer towards an end that is infinitely far.
"""


BIRGE_FACTOR = 2.0
"""Factor of the mean squared distance of draws from walkers, in variances of the walkers.

Where intervals hold this distance is 0.3 in the median. Tuned: decision 0060."""

NARROWED = 1.5
"""How many times wider walkers of a wide parameter are, from which on draws of it are too narrow."""

LEAST_VARIANCE = 1e-12
"""Variance of walkers that have all but met."""


@dataclass(frozen=True)
class Share:
    """Part of the trials by which a solution of a lost run is matched."""

    #: Share of all trials, those nearest to where the solution is sought
    near: float
    parts: float  #: Of these, one in so many are nearest in judgment to the agents


AROUND_CENTER = Share(0.2, 3.0)
"""By which the ends of searches are compared."""

SHARES_AT_END = (Share(0.3, 2.5), Share(0.2, 2.0), Share(0.1, 3.0), Share(0.1, 3.0))
"""By which the solutions that are mixed at the end of a lost run are matched. The last part is
matched twice, by other random numbers. Decision 0028, "Lost runs"."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What F observers say of S trials and of K genuine samples."""

    space: SearchSpace
    parameters: np.ndarray  #: (S, P), of the models that were tried
    counterfeit: np.ndarray  #: (S, F), outputs for the trials
    genuine: np.ndarray  #: (K, F), outputs for the genuine samples
    samples_per_trial: int  #: Samples of a trial that its output is the mean of
    observed_anew: bool  #: Whether genuine samples come with each batch

    @property
    def enough(self) -> bool:
        """Whether there are enough trials to match."""
        return len(self.parameters) >= FEWEST_MATCHED

    def of_trials(self, trials: np.ndarray) -> "Evidence":
        """Return what there is of some of the trials."""
        return replace(
            self, parameters=self.parameters[trials], counterfeit=self.counterfeit[trials]
        )


@dataclass(frozen=True, eq=False)
class Cloud:
    """Where a solution is sought."""

    middle: np.ndarray  #: (P,)
    spread: np.ndarray  #: (P,), standard deviations

    @classmethod
    def of(cls, models: np.ndarray) -> "Cloud":
        """Return where models (N, P) lie."""
        return cls(np.median(models, axis=0), models.std(axis=0))


def evidence_in_reach(evidence: Evidence) -> Evidence:
    """Return the trials within reach of a solution.

    Those beyond the end of a parameter are that end.
    """
    space = evidence.space
    parameters = evidence.parameters
    if space.limits.any():
        parameters = np.where(space.limits, np.clip(parameters, -1, 1), parameters)
    inside = (np.abs(parameters) <= space.widest).all(axis=1)
    return replace(evidence, parameters=parameters).of_trials(inside)


def solution(evidence: Evidence, cloud: Cloud, rng: np.random.Generator, *, lost: bool) -> Matched:
    """Match the agents.

    A canary is drawn by chance. So a solution that fails its checks, though no classifier tells it
    from the agents, is sought twice more. Of the three, those count that agree whether checks are
    passed, and of these the one whose canary has the middle share of its range; of two the one
    whose canary has the larger share. Solutions of a `lost` run depend on the trials they rest on.
    So several are mixed.
    """
    if lost:
        solutions = [_solution_near(evidence, cloud, rng, share) for share in SHARES_AT_END]
        return combined(solutions, evidence.space.widest)
    first_solution = _solution_near(evidence, cloud, rng)
    if first_solution.passed_checks or first_solution.p_value < LEAST_P:
        return first_solution
    solutions = [first_solution, *(_solution_near(evidence, cloud, rng) for _ in range(2))]
    most_pass = sum(matched.passed_checks for matched in solutions) > 1
    agreeing = [matched for matched in solutions if matched.passed_checks == most_pass]
    return sorted(agreeing, key=lambda matched: matched.canary_range)[1]


def best_solution(
    evidence: Evidence,
    walkers: Cloud,
    centers: np.ndarray,
    new_rng: Callable[[], np.random.Generator],
) -> Matched:
    """Return the solution of a lost run that classifiers tell least.

    Around its walkers, or around one of the centers (C, P).
    """
    spread = np.full(evidence.space.dimension, CENTER_SPREAD)
    clouds = [walkers, *(Cloud(center, spread) for center in centers[:CENTERS])]
    solutions = [_solution_near(evidence, cloud, new_rng(), AROUND_CENTER) for cloud in clouds]
    return min(solutions, key=lambda matched: matched.sort_key)


def birge_ratio(draws: np.ndarray, walkers: np.ndarray) -> float:
    """Return by which factor draws (D, P) have to be wider, as walkers (W, P) lie elsewhere.

    Both know the same trials. Where they are farther apart than walkers spread, one of the two has
    narrowed around a wrong place, and neither says which. The factor, at least 1, is a Birge ratio:
    the root of the mean squared distance over parameters.

    Source: Birge, The calculation of errors by the method of least squares (1932); decision 0060.
    """
    distance = np.median(draws, axis=0) - walkers.mean(axis=0)
    squares = distance**2 / (walkers.var(axis=0) + LEAST_VARIANCE)
    return float(np.sqrt(max(1.0, BIRGE_FACTOR * squares.mean())))


def widened(draws: np.ndarray, mode: np.ndarray, factor: float, widest: np.ndarray) -> np.ndarray:
    """Return draws (D, P) farther from the median of their solution, by its number `mode` (D,).

    At most +-widest (P,).
    """
    result = draws.copy()
    for number in range(int(mode.max()) + 1):
        of_solution = mode == number
        middle = np.median(draws[of_solution], axis=0)
        result[of_solution] = np.clip(
            middle + factor * (draws[of_solution] - middle), -widest, widest
        )
    return result


def beside_walkers(draws: np.ndarray, walkers: np.ndarray, widest: np.ndarray) -> np.ndarray | None:
    """Return draws (D, P) of a solution, half of them walkers (W, P), where these are wider by far.

    None where they are not, for any parameter that is wide, within +-widest (P,). Near a ridge
    draws may have narrowed on a part of it. Decision 0076.
    """
    widths, walkers_widths = (
        np.diff(np.quantile(models, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0), axis=0)[0]
        for models in (draws, walkers)
    )
    wide = widths > WIDE * 2 * widest
    if not (walkers_widths > NARROWED * widths)[wide].any():
        return None
    half = len(draws) // 2
    chosen = walkers[np.arange(half) * len(walkers) // half]
    return np.concatenate((draws[half:], np.clip(chosen, -widest, widest)))


def _solution_near(
    evidence: Evidence, cloud: Cloud, rng: np.random.Generator, share: Share | None = None
) -> Matched:
    """Match the agents; with a share, from the trials nearest to the cloud, and a few others."""
    parameters = evidence.parameters
    counterfeit = evidence.counterfeit
    size = {}
    if share is not None:
        count = max(round(share.near * len(parameters)), FEWEST_IN_SHARE)
        if count < len(parameters):
            distances = ((parameters - cloud.middle) ** 2).sum(axis=1)
            order = np.argsort(distances, kind="stable")
            far_trials = rng.permutation(order[count:])[: count // NEAR_PER_FAR]
            chosen = np.sort(np.concatenate((order[:count], far_trials)))
            parameters = parameters[chosen]
            counterfeit = counterfeit[chosen]
            size = {"size": round(count / share.parts)}
    widest = evidence.space.widest
    return match(
        parameters,
        counterfeit.T,
        evidence.genuine.T,
        low=-widest,
        high=widest,
        start=np.clip(cloud.middle, -widest, widest),
        spread=2 * np.maximum(cloud.spread, LEAST_SPREAD),
        samples_per_trial=evidence.samples_per_trial,
        farther=evidence.observed_anew,
        rng=rng,
        **size,
    )


def estimate_and_interval(
    matched: Matched, walkers: np.ndarray, space: SearchSpace
) -> tuple[np.ndarray, np.ndarray]:
    """Return estimate (P,) and interval (2, P) of a solution, beside walkers (W, P).

    Matching, whose models have a density, gives none of it to an end of a saturated parameter.
    Walkers that have passed the end say what there is.
    """
    estimate = np.median(matched.draws, axis=0)
    low = matched.interval_low
    high = matched.interval_high
    margin = END_MARGIN * (high - low)
    for side, bound in ((-1, low), (1, high)):
        beyond = (side * walkers >= 1).mean(axis=0)
        share = np.where(space.saturated, beyond, 0)
        reached = (share >= WALKERS_AT_END) | (space.saturated & (side * bound >= 1 - margin))
        boundary = side * space.end
        if side < 0:
            low = np.where(reached, boundary, low)
        else:
            high = np.where(reached, boundary, high)
        estimate = np.where(share > 0.5, boundary, estimate)
    return estimate, np.stack((low, high))


def intervals_of_modes(
    draws: np.ndarray, mode: np.ndarray, interval: np.ndarray, space: SearchSpace
) -> tuple[np.ndarray, np.ndarray]:
    """Return the interval of each solution (M, 2, P), and which parameters (P,) are identified.

    Draws (D, P) belong to the solutions that `mode` (D,) numbers. A single one has the interval
    (2, P) of the run. A parameter that is not identified gets all of its range.
    """
    identified = identified_by(draws, mode, np.minimum(UNTOLD_WIDTH * space.widest, RANGE_WIDTH))
    intervals = interval[None]
    if mode.max() > 0:
        intervals = ends_of_modes(draws, mode)
    end = np.where(space.saturated, space.end, space.widest)
    return np.where(identified, intervals, np.stack((-end, end))), identified
