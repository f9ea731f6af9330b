"""The space of parameters that is searched."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import require

from ._ridge import Coordinates
from ._symmetry import Symmetry

FURTHEST_TRIED = 1.5
"""How far from the middle models are tried where a parameter has no ends."""

WIDEST_SOLUTION = 2.0
"""How far from the middle a solution is sought there."""


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
        What walkers jump along, because it may turn one solution into another; they take the place
        of `groups`.
    candidates
        Families of symmetries that the system may have.
    ridges
        Coordinates in which its models may lie along a ridge.
    """

    middle: np.ndarray
    half: np.ndarray
    limits: np.ndarray
    saturated: np.ndarray
    end: float = np.inf
    groups: Sequence[Sequence[int]] = ()
    dependent: Sequence[int] = ()
    symmetries: Sequence[Symmetry] = field(default_factory=list)
    candidates: Sequence[Sequence[Symmetry]] = field(default_factory=list)
    ridges: Sequence[Coordinates] = ()

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
        return np.where(self.limits | self.saturated, 1.0, FURTHEST_TRIED)

    @property
    def walls(self) -> np.ndarray:
        """Which parameters (P,) cannot be tried beyond -1 and 1."""
        return self.limits & ~self.saturated

    @property
    def widest(self) -> np.ndarray:
        """How far (P,) from the middle a solution is sought."""
        return np.where(self.limits, 1.0, WIDEST_SOLUTION)

    def to_numbers(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the optimizer's numbers."""
        return self.middle + self.half * models
