"""The way out of a lost run: searches from many places.

They look for models that observers judge as they judge the agents. Every trial has a vector of
outputs, one for each observer. Near the agents its difference from the mean output for genuine
samples is nearly linear in the parameters. So a search is a Gauss-Newton method without
derivatives: a linear fit to the trials nearby says where the difference vanishes.

Source: Cartis and Roberts, A derivative-free Gauss-Newton method (2019). The numbers: decision
0028, "Lost runs".
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from turing_learning.evolution import state_arrays

# When. Shares of the trials.

SEARCHED_FROM = 0.5
"""From here on a run may be lost, and searches."""

BEGUN_UNTIL = 0.75
"""From here on no search begins anywhere new."""

DECIDED_AT = 0.8
"""Here it is decided where the rest of the trials is spent."""

LOST_MISFIT = 3.0
"""A run is lost if the median misfit of its last maps is above that. In runs that find the truth it
is 1 to 2."""

MISFITS_KEPT = 10
"""Batches whose maps count."""

FEWEST_TO_SEARCH = 3000
"""Trials below which a run does not search: there were too few for some searches."""

# Where. Distances are root mean squares over the parameters, in units of the space.

LIKELIEST_TRIALS = 500
"""Trials that look most genuine, from which a search may start."""

TRIALS_AROUND = 15
"""Trials around such a place that all have to look genuine."""

BEGUN_APART = 0.1
"""Distance of a new search from all others."""

JOINED_WITHIN = 0.015
"""Distance at which a search has joined another."""

STEPS_BEFORE_JOINING = 6
"""Steps that a search makes before it may join another."""

STEPS_OF_SEARCH = 20
"""Steps of a search."""

SEARCHES_AT_ONCE = 7
"""Searches that go on at the same time."""

# How far. A step is measured by the change of the outputs, in standard deviations of genuine ones.

LEAST_REACH = 0.2
"""Least change of the outputs that a step may make."""

FIRST_REACH = 1.0
"""Change that the first step may make."""

MOST_REACH = 4.0
"""Most change that a step may make."""

WIDEST_REACH = 0.25
"""Distance that such a change takes at most."""

LARGEST_STEP = 0.3
"""Change of a parameter in one step."""

JITTER = 0.5
"""Spread of the models that are tried around the end of a step, in units of its reach."""

WIDER_FACTORS = 2.5, 5.0
"""How many times wider than draws of the right model the last trials of a run lie, half of them
each."""

# Fits.

FITTED_TRIALS = 6
"""Trials of a linear fit, for each parameter."""

TESTED_TRIALS = 4
"""Trials nearest to a place, for each parameter, whose outputs say how far it is from the
agents."""

LARGEST_OUTPUT = 4.0
"""Outputs count up to that: rare events are large."""

CLEARLY_BETTER = 0.6
"""Share of the mean square of the outputs, below which a step was so good that the next may be
longer."""

REACH_GROWTH = 1.5
"""By how much the next step may be longer then."""

REACH_SHRINKAGE = 0.6
"""By how much it has to be shorter after a step that led to nothing better."""

DAMPING = (0, *10 ** np.arange(-4, 4, 0.5))
"""Weights of the metric, as in the method of Levenberg and Marquardt: the least that makes a step
short enough is taken."""


@dataclass
class Path:
    """One search: where it is, and where it looks next."""

    place: np.ndarray  #: (P,)
    start: np.ndarray  #: (P,)
    target: np.ndarray  #: (P,), where it was looked last; NaN once that is judged
    curvature: np.ndarray  #: (P, P), mean square of the outputs' slopes
    reach: float  #: Change of the outputs that its next step may make
    steps: int = 0
    #: Mean square of the outputs at its end, less that by chance; infinite before it is there
    excess: float = np.inf
    ended: bool = False  #: Whether it has made its steps, or has joined another

    @classmethod
    def from_place(cls, place: np.ndarray) -> "Path":
        """Return a search that begins at a place (P,)."""
        unknown = np.full(len(place), np.nan)
        return cls(place, place, unknown, 100 * np.eye(len(place)), FIRST_REACH)

    @property
    def arrived(self) -> bool:
        """Whether it has made all its steps, and has joined no other."""
        return bool(np.isfinite(self.excess))

    def metric(self) -> np.ndarray:
        """Return the matrix (P, P) by which a step of length `reach` changes outputs by as much."""
        dimension = len(self.place)
        damping = (self.reach / WIDEST_REACH) ** 2 / dimension
        damping += 1e-6 * np.trace(self.curvature) + 1e-6
        return self.curvature + damping * np.eye(dimension)


class Search:
    """Whether a run is lost, and its searches.

    Parameters
    ----------
    furthest : (P,)
        How far from 0 each parameter may be.

    Attributes
    ----------
    lost
        Whether the run is lost: the map has fitted nothing for long. It is decided in the second
        half of a run: the maps of many runs that find the truth fit badly before.
    decided
        Whether the place where the rest of the trials are spent was chosen, of the centers or what
        the map holds likely.
    centers : (C, P)
        Where searches are, the best first.
    """

    def __init__(self, furthest: np.ndarray) -> None:
        self.lost = False
        self.decided = False
        self.centers = np.empty((0, len(furthest)))
        self._misfits = np.empty(0)
        self._paths: list[Path] = []
        self._furthest = furthest

    @property
    def batch_size(self) -> int:
        """Number of models that are tried at once: each search then learns from them."""
        return SEARCHES_AT_ONCE * self._per_path

    @property
    def _per_path(self) -> int:
        """Models that are tried for a step."""
        return len(self._furthest) + 2

    def reset_if_early(self, progress: float) -> None:
        """Forget, in a run that has got more trials, that it was lost.

        `progress` is the share of the trials spent.
        """
        if progress < SEARCHED_FROM:
            self.lost = False
            self.decided = False
            self._paths = []

    def note_misfit(self, progress: float, misfit: float) -> None:
        """Note the misfit of the map after a batch, and whether the run is lost."""
        self._misfits = np.append(self._misfits, misfit)[-MISFITS_KEPT:]
        enough = len(self._misfits) == MISFITS_KEPT
        if (
            SEARCHED_FROM <= progress < DECIDED_AT
            and enough
            and np.median(self._misfits) > LOST_MISFIT
        ):
            self.lost = True

    def step(
        self,
        count: int,
        progress: float,
        parameters: np.ndarray,
        outputs: np.ndarray,
        genuine: np.ndarray,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Let the searches take their steps, begin others, and return models (count, P) to be tried next.

        Parameters
        ----------
        count
            How many.
        progress
            Share of the trials spent.
        parameters : (S, P)
            Of all trials.
        outputs : (S, F)
            Outputs of the observers for their samples.
        genuine : (K, F)
            Outputs for the genuine samples.
        rng
            For this batch.
        """
        unlikeness, deviations = _relative(outputs, genuine)
        self._advance(parameters, deviations)
        slots = int(np.clip(count // self._per_path, 1, SEARCHES_AT_ONCE))
        going_on = [path for path in self._paths if not path.ended]
        late = progress >= BEGUN_UNTIL and self.centers.size > 0
        if late:
            # nothing new any more: those that have arrived take further steps, the best first
            arrived = [path for path in self._paths if path.arrived]
            going_on += sorted(arrived, key=lambda path: path.excess)
        going_on = going_on[:slots]
        if not late:
            beginnings = self._new_places(slots - len(going_on), parameters, unlikeness)
            begun = [Path.from_place(beginning) for beginning in beginnings]
            self._paths += begun
            going_on += begun
        borders = np.linspace(0, count, len(going_on) + 1).astype(int)
        models = [
            self._models_of_step(path, stop - begin, parameters, deviations, rng)
            for path, (begin, stop) in zip(going_on, pairwise(borders), strict=True)
        ]
        return np.concatenate(models)

    def update_centers(
        self, parameters: np.ndarray, outputs: np.ndarray, genuine: np.ndarray
    ) -> None:
        """Let the searches take their steps by what was tried, and set `centers`."""
        _, deviations = _relative(outputs, genuine)
        self._advance(parameters, deviations)
        paths = [path for path in self._paths if not path.ended or path.arrived]
        excess = [_excess(path, parameters, deviations) for path in paths]
        centers: list[np.ndarray] = []
        for k in np.argsort(excess, kind="stable"):
            center = paths[k].place
            if all(_distance2(center, better) > JOINED_WITHIN**2 for better in centers):
                centers.append(center)
        self.centers = np.array(centers).reshape(-1, len(self._furthest))

    def around(self, count: int, draws: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return models (count, P) about draws (W, P) of the right model, wider than these lie."""
        middle = np.median(draws, axis=0)
        wider = np.resize(WIDER_FACTORS, count)[:, None]
        models = middle + wider * (draws[rng.integers(len(draws), size=count)] - middle)
        return np.clip(models, -self._furthest, self._furthest)

    def _new_places(
        self, count: int, parameters: np.ndarray, unlikeness: np.ndarray
    ) -> list[np.ndarray]:
        """Return places (P,) where all trials nearby look genuine.

        Single trials of any model may by chance.
        """
        if count <= 0:
            return []
        likely = np.argsort(unlikeness, kind="stable")[:LIKELIEST_TRIALS]
        neighbors = min(TRIALS_AROUND, len(parameters))
        nearest = cKDTree(parameters).query(parameters[likely], neighbors)[1]
        middles = parameters[nearest].mean(axis=1)
        order = np.argsort(unlikeness[nearest].mean(axis=1), kind="stable")
        taken = [center for path in self._paths for center in (path.place, path.start)]
        beginnings: list[np.ndarray] = []
        # nearer to others only where there are too few places
        for apart in (BEGUN_APART, BEGUN_APART / 2, BEGUN_APART / 4, 0.0):
            free = np.ones(len(middles), bool)
            for center in [*taken, *beginnings]:
                free &= _distance2(middles, center) >= apart**2
            for k in order:
                if free[k] and len(beginnings) < count:
                    beginnings.append(middles[k])
                    free &= _distance2(middles, middles[k]) >= apart**2
        return beginnings

    def _models_of_step(
        self,
        path: Path,
        count: int,
        parameters: np.ndarray,
        deviations: np.ndarray,
        rng: np.random.Generator,
    ) -> np.ndarray:
        """Choose where a search looks next, and return models (count, P) there.

        The step is damped (Levenberg and Marquardt) until it is no longer than its reach.
        """
        offset, slopes = _fit(path, path.place, parameters, deviations)
        curvature = slopes @ slopes.T / len(offset)
        slope = slopes @ offset / len(offset)
        path.curvature = curvature if path.steps == 0 else (path.curvature + curvature) / 2
        metric = path.metric()
        for damping in DAMPING:
            step = -np.linalg.lstsq(curvature + (damping + 1e-6) * metric, slope, rcond=None)[0]
            if step @ metric @ step <= path.reach**2 and np.abs(step).max() < LARGEST_STEP:
                break
        path.target = np.clip(path.place + step, -self._furthest, self._furthest)
        path.ended = False
        spread = path.reach * JITTER * rng.standard_normal((count, len(step)))
        # a quarter of the models is the end of the step itself
        spread[: count // 4] = 0
        models = path.target + spread @ np.linalg.inv(np.linalg.cholesky(metric))
        return np.clip(models, -self._furthest, self._furthest)

    def _advance(self, parameters: np.ndarray, deviations: np.ndarray) -> None:
        """Let each search go where it has looked, if that is better.

        End those that have made their steps, or are at another.
        """
        looked = []
        for path in self._paths:
            if np.isnan(path.target).any():
                continue
            before = (_fit(path, path.place, parameters, deviations)[0] ** 2).mean()
            after = (_fit(path, path.target, parameters, deviations)[0] ** 2).mean()
            if after < before:
                path.place = path.target
                if after < CLEARLY_BETTER * before:
                    path.reach = min(path.reach * REACH_GROWTH, MOST_REACH)
            else:
                path.reach = max(path.reach * REACH_SHRINKAGE, LEAST_REACH)
            path.steps += 1
            path.target = np.full(len(path.place), np.nan)
            looked.append((min(before, after), path))
        endings = [path.place for path in self._paths if path.ended and path.arrived]
        for _, path in sorted(looked, key=lambda pair: pair[0]):
            joins = any(_distance2(path.place, ending) < JOINED_WITHIN**2 for ending in endings)
            path.excess = np.inf
            if path.steps >= STEPS_BEFORE_JOINING and joins:
                path.ended = True
                continue
            endings.append(path.place)
            if path.steps >= STEPS_OF_SEARCH:
                path.ended = True
                path.excess = _excess(path, parameters, deviations)

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume."""
        names = [field.name for field in fields(Path)]
        paths = {name: np.array([getattr(path, name) for path in self._paths]) for name in names}
        return {
            "lost": np.array(self.lost),
            "settled": np.array(self.decided),
            "centers": self.centers.copy(),
            "misfits": self._misfits.copy(),
            **paths,
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state."""
        shapes = {"centers": "C P", "misfits": "N"}
        arrays = state_arrays(state, shapes, P=len(self._furthest))
        self.lost = bool(state["lost"])
        self.decided = bool(state["settled"])
        self.centers = arrays["centers"]
        self._misfits = arrays["misfits"]
        columns = [np.array(state[field.name]) for field in fields(Path)]
        self._paths = [
            Path(
                place,
                start,
                target,
                curvature,
                float(reach),
                int(steps),
                float(excess),
                bool(ended),
            )
            for place, start, target, curvature, reach, steps, excess, ended in zip(
                *columns, strict=True
            )
        ]


def _distance2(points: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the mean squared distance of places (..., P) from another one."""
    square: np.ndarray = ((points - point) ** 2).mean(axis=-1)
    return square


def _relative(outputs: np.ndarray, genuine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how unlike genuine ones samples look (S,), and how outputs deviate (S, F).

    Outputs are decorrelated first. The unlikeness is the logarithm of their mean square. The
    deviations are their inverse hyperbolic sines, in standard deviations of genuine samples,
    because rare events are large.
    """
    middle = genuine.mean(axis=0, dtype=float)
    covariance = np.atleast_2d(np.cov(genuine.T.astype(float)))
    floor = max(1e-3 * np.trace(covariance) / len(covariance), 1e-12)
    covariance += floor * np.eye(len(covariance))
    factor = np.linalg.cholesky(np.linalg.inv(covariance))
    white = (outputs - middle) @ factor
    usual = np.arcsinh((genuine - middle) @ factor)
    spread = np.maximum(usual.std(axis=0), 1e-9)
    # genuine samples have mean squares of about 1: far below that none looks more genuine
    unlikeness = np.log(np.maximum((white**2).mean(axis=1), 0.3))
    return unlikeness, (np.arcsinh(white) - usual.mean(axis=0)) / spread


def _nearest(
    path: Path, center: np.ndarray, parameters: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the trials nearest to a place by the metric of a search, and squared distances."""
    factor = np.linalg.cholesky(path.metric())
    square = (((parameters - center) @ factor) ** 2).sum(axis=1)
    nearest = np.argsort(square, kind="stable")[:count]
    return nearest, square[nearest]


def _fit(
    path: Path, center: np.ndarray, parameters: np.ndarray, deviations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Fit the deviations of the trials nearest to a place linearly.

    Return the deviations expected at the place (F,), and their slopes (P, F).
    Trials count the less the farther they are, and the less they follow the fit.
    """
    nearest, square = _nearest(path, center, parameters, FITTED_TRIALS * len(center))
    factor = np.linalg.cholesky(path.metric())
    deviations = deviations[nearest]
    distance = np.sqrt(square.mean()) + 1e-12
    terms = np.c_[np.ones(len(nearest)), (parameters[nearest] - center) @ factor / distance]
    nearness = 1 / (1 + square / (1.5 * distance) ** 2)
    # Cauchy weights, three times reweighted: a few trials in which something rare happened would
    # tilt the fit. A trial with the median miss keeps its weight.
    weights = nearness
    ridge = np.diag(np.r_[1e-9, np.full(len(center), 1e-2)])
    for _ in range(3):
        weighted = terms * weights[:, None]
        coefficients = np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ deviations)
        misses = ((deviations - terms @ coefficients) ** 2).mean(axis=1)
        weights = nearness / (1 + misses / (3 * np.median(misses) + 1e-9)) * (4 / 3)
    return coefficients[0], factor @ coefficients[1:] / distance


def _excess(path: Path, parameters: np.ndarray, deviations: np.ndarray) -> float:
    """Return how far the place of a search is from the agents, by the trials next to it.

    That is the mean square of the deviations expected there, less that by chance.
    """
    nearest, _ = _nearest(path, path.place, parameters, TESTED_TRIALS * len(path.place))
    few = np.clip(deviations[nearest], -LARGEST_OUTPUT, LARGEST_OUTPUT)
    by_chance = few.var(axis=0).mean() / (len(few) - 1)
    return float((few.mean(axis=0) ** 2).mean() - by_chance)
