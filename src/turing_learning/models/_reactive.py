"""Reactive models: the gray box."""

from dataclasses import dataclass

import numpy as np

from ._representation import Behavior, Jumps


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
