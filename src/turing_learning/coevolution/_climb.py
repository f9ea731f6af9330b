"""Searches of a run whose map fits no model: from many places, for models that observers judge as they judge the agents.

Every trial has a vector of outputs, one for each observer. Near the agents its difference from the mean output for genuine
samples is nearly linear in the parameters. So a search is a Gauss-Newton method without derivatives: a linear fit to the
trials nearby says where the difference vanishes. Source: Cartis and Roberts, A derivative-free Gauss-Newton method (2019).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np

from turing_learning.evolution import state_arrays

BEGIN, LATE, END = 0.5, 0.75, 0.8
"""Shares of the trials: between the first and the last a lost run searches; after the second nowhere new."""

LOST, PATIENCE = 3.0, 10
"""A run is lost where the median misfit of so many batches is above that: in runs that find the truth it is 1 to 2."""

FEWEST = 3000
"""Trials below which a run does not search: there were too few for some searches."""

_STEPS = 20  # of a search
_AT_ONCE = 7
_PLACES, _NEAR, _APART = 500, 15, 0.1  # trials that a search may start from; their neighbors; its distance from others
_MERGED, _SETTLED_DOWN = 0.015, 6  # distance at which a search joins another, after so many steps
_FIT = 6  # trials of a linear fit, per parameter
_TESTED = 4  # trials nearest to a place, per parameter, that its excess is the mean of
_BOUND = 4.0  # of an output: rare events count up to that
_REACH = (0.2, 1.0, 4.0)  # of a step, least, first and most: change of the outputs that it may make
_WIDEST = 0.25  # distance that such a change takes at most
_LONGEST = 0.3  # change of a parameter in one step
_JITTER = 0.5  # of the models that are tried, in units of the reach
_WIDER = 2.5, 5.0  # how many times wider than draws of the right model the last trials lie, half of them each


@dataclass
class _Search:
    place: np.ndarray  # (P,)
    start: np.ndarray  # (P,)
    target: np.ndarray  # (P,), where it was looked last; NaN once that is judged
    curvature: np.ndarray  # (P, P), mean square of the outputs' slopes
    reach: float
    steps: int = 0
    excess: float = np.inf  # infinite: it goes on, or has joined another
    ended: bool = False

    def metric(self) -> np.ndarray:
        """Return the matrix (P, P) in whose units a step of length `reach` changes outputs by as much."""
        least = (self.reach / _WIDEST) ** 2 / len(self.place) + 1e-6 * np.trace(self.curvature) + 1e-6
        return self.curvature + least * np.eye(len(self.place))


def _begun(place: np.ndarray) -> _Search:
    return _Search(place, place, np.full(len(place), np.nan), 100 * np.eye(len(place)), _REACH[1])


class Climb:
    """Whether a run is lost, and its searches.

    Parameters
    ----------
    furthest : (P,)
        How far from 0 each parameter may be.

    Attributes
    ----------
    lost
        Whether the map has fitted nothing for long. It is decided in the second half of a run: the maps of many
        runs that find the truth fit badly before.
    settled
        Whether one of the centers was chosen for the rest of the trials.
    centers : (C, P)
        Where searches are, the best first.
    """

    def __init__(self, furthest: np.ndarray) -> None:
        self.lost = self.settled = False
        self.centers = np.empty((0, len(furthest)))
        self._misfits = np.empty(0)
        self._searches: list[_Search] = []
        self._furthest = furthest

    @property
    def most(self) -> int:
        """Number of models that are tried at once: each search then learns from them."""
        return _AT_ONCE * (len(self._furthest) + 2)

    def begin(self, progress: float) -> None:
        """Forget, in a run that has got more trials, that it was lost; `progress` is the share of the trials spent."""
        if progress < BEGIN:
            self.lost, self.settled, self._searches = False, False, []

    def end(self, progress: float, misfit: float) -> None:
        """Note the misfit of the map after a batch, and whether the run is lost."""
        self._misfits = np.append(self._misfits, misfit)[-PATIENCE:]
        if BEGIN <= progress < END and len(self._misfits) == PATIENCE:
            self.lost |= bool(np.median(self._misfits) > LOST)

    def models(
        self, count: int, progress: float, parameters: np.ndarray, outputs: np.ndarray, genuine: np.ndarray,
        rng: np.random.Generator,
    ) -> np.ndarray:  # fmt: skip
        """Return models (count, P) to be tried next.

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
        score, outputs = _relative(outputs, genuine)
        self._advance(parameters, outputs)
        slots = int(np.clip(count // (len(self._furthest) + 2), 1, _AT_ONCE))
        if progress >= LATE and self.centers.size:  # the best go on
            ranked = sorted((each for each in self._searches if np.isfinite(each.excess)), key=lambda one: one.excess)
            live = [each for each in self._searches if not each.ended] + ranked
            live = live[:slots]
        else:
            live = [each for each in self._searches if not each.ended][:slots]
            begun = [_begun(place) for place in self._starts(slots - len(live), parameters, score)]
            self._searches += begun
            live += begun
        ends = np.linspace(0, count, len(live) + 1).astype(int)
        return np.concatenate([
            self._around(search, last - first, parameters, outputs, rng)
            for search, (first, last) in zip(live, pairwise(ends), strict=True)
        ])  # fmt: skip

    def judge(self, parameters: np.ndarray, outputs: np.ndarray, genuine: np.ndarray) -> None:
        """Let the searches take their steps by what was tried, and set `centers`."""
        _, outputs = _relative(outputs, genuine)
        self._advance(parameters, outputs)
        found = [each for each in self._searches if not each.ended or np.isfinite(each.excess)]
        excess = [_excess(each, parameters, outputs) for each in found]
        places: list[np.ndarray] = []
        for k in np.argsort(excess, kind="stable"):
            if all(((found[k].place - other) ** 2).mean() > _MERGED**2 for other in places):
                places.append(found[k].place)
        self.centers = np.array(places).reshape(-1, len(self._furthest))

    def around(self, count: int, draws: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return models (count, P) about draws (W, P) of the right model, wider than these lie."""
        middle, wider = np.median(draws, axis=0), np.resize(_WIDER, count)[:, None]
        models = middle + wider * (draws[rng.integers(len(draws), size=count)] - middle)
        return np.clip(models, -self._furthest, self._furthest)

    def _starts(self, count: int, parameters: np.ndarray, score: np.ndarray) -> list[np.ndarray]:
        """Return places (P,) where all trials nearby look genuine: single trials of any model may by chance."""
        if count <= 0:
            return []
        # few runs are lost: the others start faster without it
        from scipy.spatial import cKDTree

        few = np.argsort(score, kind="stable")[:_PLACES]
        near = cKDTree(parameters).query(parameters[few], min(_NEAR, len(parameters)))[1]
        middles, order = parameters[near].mean(axis=1), np.argsort(score[near].mean(axis=1), kind="stable")
        found: list[np.ndarray] = []
        for apart in (_APART, _APART / 2, _APART / 4, 0.0):
            left = np.ones(len(middles), bool)
            for taken in [*(place for each in self._searches for place in (each.place, each.start)), *found]:
                left &= ((middles - taken) ** 2).mean(axis=1) >= apart**2
            for k in order:
                if left[k] and len(found) < count:
                    found.append(middles[k])
                    left &= ((middles - middles[k]) ** 2).mean(axis=1) >= apart**2
        return found

    def _around(
        self, search: _Search, count: int, parameters: np.ndarray, outputs: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Take aim for a search, and return models (count, P) there."""
        offset, slopes = _fit(search, search.place, parameters, outputs)
        curvature, slope = slopes @ slopes.T / len(offset), slopes @ offset / len(offset)
        search.curvature = curvature if search.steps == 0 else (search.curvature + curvature) / 2
        metric = search.metric()
        for damping in (0, *10 ** np.arange(-4, 4, 0.5)):
            step = -np.linalg.lstsq(curvature + (damping + 1e-6) * metric, slope, rcond=None)[0]
            if step @ metric @ step <= search.reach**2 and np.abs(step).max() < _LONGEST:
                break
        search.target, search.ended = np.clip(search.place + step, -self._furthest, self._furthest), False
        spread = search.reach * _JITTER * rng.standard_normal((count, len(step)))
        spread[: count // 4] = 0
        models = search.target + spread @ np.linalg.inv(np.linalg.cholesky(metric))
        return np.clip(models, -self._furthest, self._furthest)

    def _advance(self, parameters: np.ndarray, outputs: np.ndarray) -> None:
        """Let each search go where it has looked, if that is better; end those that have made their steps, or are at another."""
        live = []
        for search in self._searches:
            if np.isnan(search.target).any():
                continue
            here, there = (_fit(search, place, parameters, outputs)[0] for place in (search.place, search.target))
            before, after = (here**2).mean(), (there**2).mean()
            least, _, most = _REACH
            if after < before:
                search.place = search.target
                search.reach = min(search.reach * (1.5 if after < 0.6 * before else 1), most)
            else:
                search.reach = max(search.reach * 0.6, least)
            search.steps, search.target = search.steps + 1, np.full(len(search.place), np.nan)
            live.append((min(before, after), search))
        others = [each.place for each in self._searches if each.ended and np.isfinite(each.excess)]
        for _, search in sorted(live, key=lambda one: one[0]):
            joins = any(((search.place - other) ** 2).mean() < _MERGED**2 for other in others)
            search.excess = np.inf
            if search.steps >= _SETTLED_DOWN and joins:
                search.ended = True
                continue
            others.append(search.place)
            if search.steps >= _STEPS:
                search.ended, search.excess = True, _excess(search, parameters, outputs)

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume."""
        flags = {"lost": np.array(self.lost), "settled": np.array(self.settled)}
        searches = {
            each.name: np.array([getattr(one, each.name) for one in self._searches]) for each in fields(_Search)
        }
        return flags | {"centers": self.centers.copy(), "misfits": self._misfits.copy()} | searches

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state."""
        held = state_arrays(state, {"centers": "C P", "misfits": "N"}, P=len(self._furthest))
        self.lost, self.settled = bool(state["lost"]), bool(state["settled"])
        self.centers, self._misfits = held["centers"], held["misfits"]
        rows = zip(*(np.array(state[each.name]) for each in fields(_Search)), strict=True)
        self._searches = [
            _Search(place, start, target, curvature, float(reach), int(steps), float(excess), bool(ended))
            for place, start, target, curvature, reach, steps, excess, ended in rows
        ]


def _relative(outputs: np.ndarray, genuine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how unlike genuine ones samples look (S,), and their outputs (S, F) less the genuine mean, in deviations.

    The first is the logarithm of the mean square of outputs without correlation. The second are their inverse
    hyperbolic sines, because rare events are large.
    """
    middle, covariance = genuine.mean(axis=0, dtype=float), np.atleast_2d(np.cov(genuine.T.astype(float)))
    covariance += max(1e-3 * np.trace(covariance) / len(covariance), 1e-12) * np.eye(len(covariance))
    factor = np.linalg.cholesky(np.linalg.inv(covariance))
    white, usual = (outputs - middle) @ factor, np.arcsinh((genuine - middle) @ factor)
    spread = np.maximum(usual.std(axis=0), 1e-9)
    return np.log(np.maximum((white**2).mean(axis=1), 0.3)), (np.arcsinh(white) - usual.mean(axis=0)) / spread


def _nearest(search: _Search, place: np.ndarray, parameters: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the trials nearest to a place by the metric of a search, and their squared distances."""
    square = (((parameters - place) @ np.linalg.cholesky(search.metric())) ** 2).sum(axis=1)
    near = np.argsort(square, kind="stable")[:count]
    return near, square[near]


def _fit(
    search: _Search, place: np.ndarray, parameters: np.ndarray, outputs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Fit the outputs of the trials nearest to a place linearly: those expected there (F,), and slopes (P, F).

    Trials count the less the farther they are, and the less they follow the fit.
    """
    near, square = _nearest(search, place, parameters, _FIT * len(place))
    factor, outputs, distance = np.linalg.cholesky(search.metric()), outputs[near], np.sqrt(square.mean()) + 1e-12
    terms = np.c_[np.ones(len(near)), (parameters[near] - place) @ factor / distance]
    nearness = weights = 1 / (1 + square / (1.5 * distance) ** 2)
    ridge = np.diag(np.r_[1e-9, np.full(len(place), 1e-2)])
    for _ in range(3):
        weighted = terms * weights[:, None]
        found = np.linalg.solve(weighted.T @ terms + ridge, weighted.T @ outputs)
        misses = ((outputs - terms @ found) ** 2).mean(axis=1)
        weights = nearness / (1 + misses / (3 * np.median(misses) + 1e-9)) * (4 / 3)
    return found[0], factor @ found[1:] / distance


def _excess(search: _Search, parameters: np.ndarray, outputs: np.ndarray) -> float:
    """Return the mean square of the expected outputs at the place of a search, by the trials next to it, less chance."""
    near, _ = _nearest(search, search.place, parameters, _TESTED * len(search.place))
    few = np.clip(outputs[near], -_BOUND, _BOUND)
    return float((few.mean(axis=0) ** 2).mean() - few.var(axis=0).mean() / (len(few) - 1))
