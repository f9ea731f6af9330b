"""Gray boxes: models that agents may be described by, too, and their names."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ._representation import FULL_VIEW, AgentsRepresentation, Behavior, Jumps

VIEW_REACH = 5.0
"""Range of jumps of the number of a field of view, in ranges of first genomes: views of 2 to 358 degrees instead of 97 to 263."""


@dataclass(frozen=True)
class ReactiveModel:
    """A model with the agents' control system: left and right wheel speed for each sensor state; genomes are parameters.

    Parameters
    ----------
    states
        Number of sensor states n.

    Source
    ------
    Paper, section 3.2.2.
    """

    states: int

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names: vl0, vr0, vl1, vr1, ..."""
        return tuple(f"v{side}{state}" for state in range(self.states) for side in "lr")

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """No units: fractions of the maximum."""
        return ("",) * (2 * self.states)

    @property
    def jumps(self) -> Jumps:
        """Sensor states exchange the speeds of both wheels."""
        return Jumps(groups=tuple((2 * state, 2 * state + 1) for state in range(self.states)))

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the wheel speeds (2 n,)."""
        return wheel_speeds

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the genomes (..., 2 n) themselves."""
        return genomes

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return the wheel speeds; the field of view is the scenario's."""
        return Behavior(parameters)

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return the parameters (..., 2 n) as they are."""
        return parameters


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


REPRESENTATIONS: dict[str, Callable[[int], AgentsRepresentation]] = {
    "reactive": ReactiveModel,
    "morphology": MorphologyModel,
}
"""What a scenario may say of its models: name -> the representation of so many sensor states."""
