"""The space of parameters that is searched, and what may turn one solution in it into another."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import require
from turing_learning.models import Parameter

FEW_EXCHANGES = 12
"""Exchanges of parameters up to which each is also tried together with each mirrored parameter."""

FURTHEST = 1.5
"""How far from the middle models are tried where a parameter has no ends."""

WIDEST = 2.0
"""How far from the middle a solution is sought there."""

Symmetry = tuple[Sequence[int], Sequence[float]]
"""In which order the parameters of a model are taken, and the sign of each: another model."""


@dataclass(frozen=True, eq=False)
class SearchSpace:
    """The space of P parameters, in units in which -1 to 1 is the range of the first models.

    Attributes
    ----------
    middle, half : (P,)
        Middle and half of that range, in the optimizer's numbers.
    limits : (P,) bool
        Which parameters end at -1 and 1.
    saturated : (P,) bool
        Of which parameters anything beyond -1 and 1 is the same as that end, such as the angle of a
        field of view.
    end
        What stands for the end of a saturated parameter in an estimate: 1, or infinity where the
        end is infinitely far.
    groups
        Indices of parameters that may be exchanged, group by group.
    dependent
        Indices of parameters that are drawn anew when groups are exchanged.
    symmetries
        What may turn one solution into another; they take the place of `groups`.
    """

    middle: np.ndarray
    half: np.ndarray
    limits: np.ndarray
    saturated: np.ndarray
    end: float = np.inf
    groups: Sequence[Sequence[int]] = ()
    dependent: Sequence[int] = ()
    symmetries: Sequence[Symmetry] = field(default_factory=list)

    @classmethod
    def between(
        cls,
        low: np.typing.ArrayLike,
        high: np.typing.ArrayLike,
        *,
        limits: np.typing.ArrayLike = False,
        saturated: np.typing.ArrayLike = False,
        **more: Any,
    ) -> "SearchSpace":
        """Return the space whose first models are from low (P,) to high (P,).

        By default no parameter has ends.
        """
        low = array("low", low, "P")
        high = array("high", high, "P", P=len(low))
        above = (low < high).all()
        require(above, "high", "be above `low`, for each parameter", f"{high}")
        middle = (low + high) / 2
        half = (high - low) / 2
        limits = np.broadcast_to(np.asarray(limits, dtype=bool), low.shape)
        saturated = np.broadcast_to(np.asarray(saturated, dtype=bool), low.shape)
        return cls(middle, half, limits, saturated, **more)

    @property
    def dimension(self) -> int:
        """Number of parameters P."""
        return len(self.middle)

    @property
    def furthest(self) -> np.ndarray:
        """How far (P,) from the middle models are tried."""
        return np.where(self.limits | self.saturated, 1.0, FURTHEST)

    @property
    def walls(self) -> np.ndarray:
        """Which parameters (P,) cannot be tried beyond -1 and 1."""
        return self.limits & ~self.saturated

    @property
    def widest(self) -> np.ndarray:
        """How far (P,) from the middle a solution is sought."""
        return np.where(self.limits, 1.0, WIDEST)

    def to_numbers(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the optimizer's numbers."""
        return self.middle + self.half * models


def symmetries_of(parameters: Iterable[Parameter]) -> list[Symmetry]:
    """Return what may turn one solution of a custom system into another.

    Parameters of the same range may be exchanged: two of them, or those of two parts of a model,
    such as the mean and the spread of each of two states. Any parameter may be mirrored at the
    middle of its range.
    """
    alike: dict[tuple[float | None, float | None, str], list[int]] = {}
    count = 0
    for place, parameter in enumerate(parameters):
        low, high = parameter.initial or (parameter.low, parameter.high)
        alike.setdefault((low, high, parameter.scale), []).append(place)
        count = place + 1
    groups = [places for places in alike.values() if len(places) > 1]
    orders = sorted(_exchanges_across(groups, count) | _exchanges_within(groups, count))
    plain = [1.0] * count
    symmetries: list[Symmetry] = [(order, plain) for order in orders]
    for place in range(count):
        mirrored = plain.copy()
        mirrored[place] = -1.0
        symmetries.append((range(count), mirrored))
        if len(orders) > FEW_EXCHANGES:
            continue
        # the share of the first of two parts becomes that of the second where they are exchanged
        for order in orders:
            if order[place] == place:
                symmetries.append((order, mirrored))
    return symmetries


def _exchanges_across(groups: Sequence[Sequence[int]], count: int) -> set[tuple[int, ...]]:
    """Return orders in which two parameters of a group are exchanged.

    That is alone, or in all groups of one size.     Groups of one size are taken for the kinds of
    parameters that each part of a model has.
    """
    orders: set[tuple[int, ...]] = set()
    for size in {len(places) for places in groups}:
        same = [places for places in groups if len(places) == size]
        for first, second in combinations(range(size), 2):
            pairs = [(places[first], places[second]) for places in same]
            orders.add(_exchanged(count, pairs))
            for pair in pairs:
                orders.add(_exchanged(count, [pair]))
    return orders


def _exchanges_within(groups: Sequence[Sequence[int]], count: int) -> set[tuple[int, ...]]:
    """Return orders in which two parts of a model are exchanged, all in one range.

    The parameters of a part are every second one, or one half of them.
    """
    orders: set[tuple[int, ...]] = set()
    for places in groups:
        half = len(places) // 2
        if len(places) % 2 or half < 2:
            continue
        orders.add(_exchanged(count, list(zip(places[::2], places[1::2], strict=True))))
        orders.add(_exchanged(count, list(zip(places[:half], places[half:], strict=True))))
    return orders


def _exchanged(count: int, pairs: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Return the order of so many parameters in which some pairs are exchanged."""
    order = list(range(count))
    for first, second in pairs:
        order[first] = second
        order[second] = first
    return tuple(order)
