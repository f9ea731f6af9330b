"""One parameter of a model: where it may lie, and how the optimizer's numbers become its values."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, ClassVar, Literal

import numpy as np

from ..errors import brief, require

OPEN_WIDTH = 2.0
"""Width of the initial range where a side is open: units of a linear parameter, decades of a
logarithmic one."""

LARGEST_BOUND = 1e9
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
    integer
        Whether models have the nearest integer; bounds are integers then.

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
    integer: bool = False

    def __post_init__(self) -> None:
        require(self.scale in ("linear", "log"), "scale", 'be "linear" or "log"', brief(self.scale))
        self._check_bounds()
        if self.initial is None:
            initial = self._default_initial()
        else:
            initial = self.initial
            self._check_initial(initial)
        object.__setattr__(self, "initial", (float(initial[0]), float(initial[1])))

    def _check_bounds(self) -> None:
        smallest = -LARGEST_BOUND
        scale = ""
        if self.scale == "log":
            smallest = 1 / LARGEST_BOUND
            scale = " on a logarithmic scale"
        rule = (
            f"be a number from {smallest:g} to {LARGEST_BOUND:g}{scale}, or None for an open side"
        )
        for name in ("low", "high"):
            value = getattr(self, name)
            if value is not None:
                fits = _is_number(value) and smallest <= value <= LARGEST_BOUND
                require(fits, name, rule, brief(value))
                object.__setattr__(self, name, float(value))
                integral = not self.integer or value == round(value)
                require(integral, name, "be an integer for an integer parameter", brief(value))
        if self.low is not None and self.high is not None:
            require(self.low < self.high, "low", "be below `high`", f"{self.low} and {self.high}")

    def _default_initial(self) -> tuple[float, float]:
        """Return the range from bound to bound; where a side is open, it is `OPEN_WIDTH` wide."""
        if self.low is not None and self.high is not None:
            return self.low, self.high
        if self.low is not None:
            return self.low, self._value(self._axis(self.low) + OPEN_WIDTH)
        if self.high is not None:
            return self._value(self._axis(self.high) - OPEN_WIDTH), self.high
        return self._value(-OPEN_WIDTH / 2), self._value(OPEN_WIDTH / 2)

    def _check_initial(self, initial: tuple[float, float]) -> None:
        lowest = self.low
        if lowest is None:
            if self.scale == "log":
                lowest = self._value(-LARGEST_DECADE)
            else:
                lowest = -INITIAL_LARGEST
        highest = INITIAL_LARGEST if self.high is None else self.high
        fits = len(initial) == 2 and all(map(_is_number, initial))
        fits = fits and lowest <= initial[0] < initial[1] <= highest
        rule = f"be two numbers from {lowest:g} to {highest:g}, the lower first"
        require(fits, "initial", rule, brief(initial))

    def to_units(self, numbers: np.ndarray) -> np.ndarray:
        """Return the values, in the user's units, of an optimizer's numbers of any shape."""
        middle, half = self._middle_and_half()
        values = self._folded(middle + half * numbers)
        if self.scale == "log":
            values = 10.0 ** np.clip(values, -LARGEST_DECADE, LARGEST_DECADE)
        if self.integer:
            values = np.round(values)
        # What rounding has pushed over a bound
        return np.clip(values, self.low, self.high)

    def to_numbers(self, values: np.ndarray) -> np.ndarray:
        """Return the optimizer's numbers of values within the bounds, of any shape: the inverse of `to_units`."""
        middle, half = self._middle_and_half()
        if self.scale == "log":
            positions = np.log10(values)
        else:
            positions = np.asarray(values, dtype=np.float64)
        return (positions - middle) / half

    def bound_at(self, value: float) -> str:
        """Return the bound, with its unit, that a value is at: within `AT` of the initial range.

        Empty if it is at none.
        """
        for bound in (self.low, self.high):
            if bound is not None:
                numbers = self.to_numbers(np.array([bound, value]))
                # The initial range is [-1, 1] there, 2 wide.
                if abs(numbers[1] - numbers[0]) <= 2 * AT:
                    return f"{bound:g} {self.unit}".rstrip()
        return ""

    def _middle_and_half(self) -> tuple[float, float]:
        """Return the middle of the initial range, and half of its width, on the scale of the parameter."""
        assert self.initial is not None
        low, high = map(self._axis, self.initial)
        return (low + high) / 2, (high - low) / 2

    def _axis(self, value: float) -> float:
        """Return the position of a value on the scale of the parameter: itself, or its decade."""
        if self.scale == "log":
            return math.log10(value)
        return value

    def _value(self, position: float) -> float:
        if self.scale == "log":
            return 10.0**position
        return position

    def _folded(self, positions: np.ndarray) -> np.ndarray:
        """Return positions of which those beyond a bound are mirrored at it, as often as it takes."""
        if self.low is not None and self.high is not None:
            low = self._axis(self.low)
            width = self._axis(self.high) - low
            return low + np.abs((positions - low + width) % (2 * width) - width)
        if self.low is not None:
            return self._axis(self.low) + np.abs(positions - self._axis(self.low))
        if self.high is not None:
            return self._axis(self.high) - np.abs(positions - self._axis(self.high))
        return positions


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
