"""Models of body and behavior: the field of view is inferred with the controller."""

from dataclasses import dataclass

import numpy as np

from ._reactive import ReactiveModel
from ._representation import FULL_VIEW, Behavior, Jumps

VIEW_REACH = 5.0
"""Range of jumps of the number of a field of view, in ranges of first genomes: views of 2 to 358 degrees instead of 97 to 263."""


@dataclass(frozen=True)
class MorphologyModel:
    """A reactive model whose last parameter is the field of view: theta = 2 pi sig(x) of the optimizer's number x.

    Parameters
    ----------
    states
        Number of sensor states n.

    Source
    ------
    Paper, section 4.6.1.
    """

    states: int

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names: vl0, vr0, vl1, vr1, ..., theta."""
        return (*ReactiveModel(self.states).parameter_names, "theta")

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """No units, and rad."""
        return (*ReactiveModel(self.states).parameter_units, "rad")

    @property
    def jumps(self) -> Jumps:
        """Sensor states exchange the speeds of both wheels, and the field of view, which tells them apart, is drawn anew."""
        speeds = 2 * self.states
        groups = ReactiveModel(self.states).jumps.groups
        return Jumps(groups, dependent=(speeds,), reach=(1.0,) * speeds + (VIEW_REACH,))

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the wheel speeds and the field of view (2 n + 1,)."""
        return (*wheel_speeds, field_of_view)

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return genomes (..., 2 n + 1) with the field of view (rad) in the place of its number."""
        parameters = np.array(genomes, dtype=np.float64)
        parameters[..., -1] = FULL_VIEW * np.exp(-np.logaddexp(0.0, -parameters[..., -1]))  # sig(x) for x of any size
        return parameters

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return wheel speeds and field of view."""
        return Behavior(parameters[..., :-1], parameters[..., -1])

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return the parameters (..., 2 n + 1) as they are."""
        return parameters
