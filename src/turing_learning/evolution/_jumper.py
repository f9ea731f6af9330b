"""Jumps of children out of a local optimum, which small steps do not leave."""

from collections.abc import Sequence

import numpy as np

from ._checks import check_share, check_vector


class Jumper:
    """Draws a parameter of some children anew, and exchanges two groups of parameters of others; see `EvolutionStrategy`.

    Parameters
    ----------
    low, high : (dimension,)
        Range of the first individuals.
    reach, redraw, exchange, groups, dependent
        As those of `EvolutionStrategy`, `reach` as its `jump_reach`.
    """

    def __init__(
        self,
        low: np.ndarray,
        high: np.ndarray,
        reach: np.typing.ArrayLike,
        redraw: float,
        exchange: float,
        groups: Sequence[Sequence[int]],
        dependent: Sequence[int],
    ) -> None:
        self._dimension = len(low)
        self._low, self._high = _widened(low, high, check_vector("jump_reach", reach, self._dimension))
        self._redraw = check_share("redraw", redraw)
        self._exchange = check_share("exchange", exchange)
        self._groups = _checked_groups(groups, self._dimension)
        self._dependent = _checked_dependent(dependent, self._groups, self._dimension)

    def jump(self, children: np.ndarray, rng: np.random.Generator, rate: float) -> None:
        """Let children (lambda, dimension) jump, in place; `rate` scales how many."""
        low, high, dependent = self._low, self._high, self._dependent
        if self._redraw * rate > 0:
            chosen = np.flatnonzero(rng.random(len(children)) < self._redraw * rate)
            parameter = rng.integers(self._dimension, size=len(chosen))
            children[chosen, parameter] = rng.uniform(low[parameter], high[parameter])
        if self._exchange * rate > 0 and len(self._groups) > 1:
            for k in np.flatnonzero(rng.random(len(children)) < self._exchange * rate):
                first, second = self._groups[rng.permutation(len(self._groups))[:2]]
                children[k, first], children[k, second] = children[k, second], children[k, first]
                children[k, dependent] = rng.uniform(low[dependent], high[dependent])


def _widened(low: np.ndarray, high: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ranges (dimension,) that are `reach` times wider; those of reach 1 to the last bit."""
    if not (reach > 0).all():
        raise ValueError(f"`jump_reach` must be above 0; got {reach.min()}.")
    added = 0.5 * (reach - 1) * (high - low)
    return low - added, high + added


def _checked_groups(groups: Sequence[Sequence[int]], dimension: int) -> np.ndarray:
    """Return the groups as array (groups, length) of indices."""
    indices = [int(index) for group in groups for index in group]
    if len({len(group) for group in groups}) > 1 or len(set(indices)) < len(indices) or len(groups) == 1:
        raise ValueError(f"`groups` must be two or more of one length and have no index in common; got {groups}.")
    if any(not 0 <= index < dimension for index in indices):
        raise ValueError(f"`groups` must hold indices from 0 to {dimension - 1}; got {groups}.")
    return np.array(indices, dtype=np.int64).reshape(len(groups), -1 if indices else 0)


def _checked_dependent(dependent: Sequence[int], groups: np.ndarray, dimension: int) -> np.ndarray:
    """Return the indices (n,) of the dependent parameters."""
    indices = np.array([int(index) for index in dependent], dtype=np.int64)
    if any(not 0 <= index < dimension for index in indices):
        raise ValueError(f"`dependent` must hold indices from 0 to {dimension - 1}; got {dependent}.")
    if np.isin(indices, groups).any():
        raise ValueError(f"`dependent` must hold no index of a group; got {dependent}.")
    return indices
