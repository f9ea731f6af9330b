"""What a model of a robot is: which parameters it has, how the optimizer's numbers become them, and what a robot executes."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

FULL_VIEW = 2 * math.pi
"""Largest field of view (rad)."""


@dataclass(frozen=True, eq=False)
class Behavior:
    """What robots execute.

    Attributes
    ----------
    wheel_speeds : (..., 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum.
    field_of_view : (...)
        Of the sensor (rad), from 0 to 2 pi; None where it is that of the scenario.
    """

    wheel_speeds: np.ndarray
    field_of_view: np.ndarray | None = None


class Representation(Protocol):
    """A representation of models: from the optimizer's numbers (genomes) to parameters, and from these to behavior."""

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters."""
        ...

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Their units; empty for none."""
        ...

    @property
    def parameter_groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the parameters of each sensor state: models with exchanged groups are models too."""
        ...

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...] | None:
        """Return the parameters (P,) of agents with these wheel speeds (2 n,) and field of view (rad); None if there are none."""
        ...

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the parameters (..., P) of genomes (..., P)."""
        ...

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return what a robot with these parameters (..., P) executes."""
        ...


@dataclass(frozen=True)
class ReactiveModel:
    """Gray box: the parameters are left and right wheel speed for each of the sensor states; genomes are parameters.

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
    def parameter_groups(self) -> tuple[tuple[int, ...], ...]:
        """Both wheels of each sensor state."""
        return tuple((2 * state, 2 * state + 1) for state in range(self.states))

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the wheel speeds (2 n,)."""
        return wheel_speeds

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the genomes (..., 2 n) themselves."""
        return genomes

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return the wheel speeds; the field of view is the scenario's."""
        return Behavior(parameters)


@dataclass(frozen=True)
class MorphologyModel:
    """A reactive model whose last parameter is the field of view: theta = 2 pi sig(x) of the optimizer's number x.

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
    def parameter_groups(self) -> tuple[tuple[int, ...], ...]:
        """Both wheels of each sensor state; the field of view belongs to none."""
        return ReactiveModel(self.states).parameter_groups

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


REPRESENTATIONS: dict[str, type[ReactiveModel] | type[MorphologyModel]] = {
    "reactive": ReactiveModel,
    "morphology": MorphologyModel,
}
"""What a scenario may say of its models."""
