"""One parameter of a model: where it may lie, and how the optimizer's numbers become its values."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar, Literal

import numpy as np

from ..errors import brief, require

OPEN_WIDTH = 2.0
"""Width of the initial range where a side is open, in the units of a linear parameter or in decades of a logarithmic one."""

LARGEST = 1e9
"""Largest magnitude of a bound; also of the reciprocal of a bound on a logarithmic scale."""

INITIAL_LARGEST = 1e12
"""Largest magnitude of the initial range where a side is open."""

AT = 0.01
"""Share of the initial range within which a value is at a bound."""

LARGEST_DECADE = 300.0
"""A logarithmic parameter with an open side stays within 1e-300 and 1e300."""


class Settings:
    """Base of the dataclasses that files of configuration fill, and whose unknown names pydantic rejects."""

    __pydantic_config__: ClassVar = {"extra": "forbid"}


@dataclass(frozen=True)
class Parameter(Settings):
    """A parameter in its user's units.

    Optimizers work on numbers x whose initial range is [-1, 1]. It is mapped linearly (on a
    logarithmic scale, in decades) to the initial range of the parameter; beyond a bound the axis is
    folded back, as in a mirror (docs/decisions/0012-own-systems.md).

    Parameters
    ----------
    low, high
        Bounds of the search, inclusive, up to 1e9 in magnitude; None leaves a side open.
    scale
        "linear" or "log"; bounds on a logarithmic scale are at least 1e-9.
    unit
        Unit, for tables and figures.
    initial
        Range of the first models, within the bounds; by default from bound to bound. Where a side
        is open, the default is 2 units wide, or 2 decades on a logarithmic scale, around 0, or 1,
        if both are open.

    Examples
    --------
    >>> import numpy as np
    >>> Parameter(0, 20, unit="cm/s").to_units(np.array([-1.0, 0.0, 0.9, 1.1]))
    array([ 0., 10., 19., 19.])
    """

    low: float | None
    high: float | None
    scale: Literal["linear", "log"] = "linear"
    unit: str = ""
    initial: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        require(self.scale in ("linear", "log"), "scale", 'be "linear" or "log"', brief(self.scale))
        decades = self.scale == "log"
        smallest, kind = (1 / LARGEST, " on a logarithmic scale") if decades else (-LARGEST, "")
        rule = f"be a number from {smallest:g} to {LARGEST:g}{kind}, or None for an open side"
        for name, value in (("low", self.low), ("high", self.high)):
            fits = value is None or (_is_number(value) and smallest <= value <= LARGEST)
            require(fits, name, rule, brief(value))
            object.__setattr__(self, name, None if value is None else float(value))
        low, high, initial, half = self.low, self.high, self.initial, OPEN_WIDTH / 2
        require(
            low is None or high is None or low < high, "low", "be below `high`", f"{low} and {high}"
        )
        if initial is None:
            first = (
                self._value(-half if high is None else self._axis(high) - 2 * half)
                if low is None
                else low
            )
            last = (
                self._value(half if low is None else self._axis(low) + 2 * half)
                if high is None
                else high
            )
            initial = (first, last)
        else:
            below = (
                (self._value(-LARGEST_DECADE) if decades else -INITIAL_LARGEST)
                if low is None
                else low
            )
            above = INITIAL_LARGEST if high is None else high
            pair = len(initial) == 2 and all(map(_is_number, initial))
            rule = f"be two numbers from {below:g} to {above:g}, the lower first"
            require(
                pair and below <= initial[0] < initial[1] <= above, "initial", rule, brief(initial)
            )
        object.__setattr__(self, "initial", (float(initial[0]), float(initial[1])))

    def to_units(self, numbers: np.ndarray) -> np.ndarray:
        """Return the values, in the user's units, of an optimizer's numbers of any shape."""
        middle, half = self._middle_and_half()
        values = self._folded(middle + half * numbers)
        if self.scale == "log":
            values = 10.0 ** np.clip(values, -LARGEST_DECADE, LARGEST_DECADE)
        return np.clip(values, self.low, self.high)  # what rounding has pushed over a bound

    def to_numbers(self, values: np.ndarray) -> np.ndarray:
        """Return the optimizer's numbers of values within the bounds, of any shape: the inverse of `to_units`."""
        middle, half = self._middle_and_half()
        places = np.log10(values) if self.scale == "log" else np.asarray(values, dtype=np.float64)
        return (places - middle) / half

    def bound_at(self, value: float) -> str:
        """Return the bound, with its unit, that a value is at: within `AT` of the initial range.

        Empty if it is at none.
        """
        for end in (self.low, self.high):
            if (
                end is not None
                and abs(float(np.diff(self.to_numbers(np.array([end, value])))[0])) <= 2 * AT
            ):
                return f"{end:g} {self.unit}".rstrip()
        return ""

    def _middle_and_half(self) -> tuple[float, float]:
        """Return the middle of the initial range, and half of its width, on the scale of the parameter."""
        assert self.initial is not None
        low, high = map(self._axis, self.initial)
        return (low + high) / 2, (high - low) / 2

    def _axis(self, value: float) -> float:
        return math.log10(value) if self.scale == "log" else value

    def _value(self, place: float) -> float:
        return 10.0**place if self.scale == "log" else place

    def _folded(self, places: np.ndarray) -> np.ndarray:
        if self.low is not None and self.high is not None:
            low, high = self._axis(self.low), self._axis(self.high)
            return low + np.abs((places - low + (high - low)) % (2 * (high - low)) - (high - low))
        if self.low is not None:
            return self._axis(self.low) + np.abs(places - self._axis(self.low))
        if self.high is not None:
            return self._axis(self.high) - np.abs(places - self._axis(self.high))
        return places


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
