"""What a model of a robot is, and gray boxes: models that agents may be described by, too."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

FULL_VIEW = 2 * math.pi
"""Largest field of view (rad)."""

VIEW_REACH = 5.0
"""Range of jumps of the number of a field of view, in ranges of first genomes: views of 2 to 358 degrees instead of 97 to 263."""


@dataclass(frozen=True, eq=False)
class Behavior:
    """What robots with these models execute.

    Attributes
    ----------
    wheel_speeds : (..., 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum; of a network the largest that it may give.
    field_of_view : (...)
        Of the sensor (rad), from 0 to 2 pi; None where it is that of the scenario.
    weights : (..., Q)
        Networks that drive the robots; None for reactive ones.
    hidden
        Hidden neurons H of the networks; 0 for none.
    """

    wheel_speeds: np.ndarray
    field_of_view: np.ndarray | None = None
    weights: np.ndarray | None = None
    hidden: int = 0


@dataclass(frozen=True)
class Jumps:
    """What jumps of the optimizer may do to genomes of P numbers, beside drawing one of them anew.

    Attributes
    ----------
    groups
        Indices of the numbers of each sensor state: models with exchanged groups are models too. Empty if there are none.
    dependent
        Indices of the numbers that depend on which group is whose: they mean nothing any more when groups are exchanged.
    reach : () or (P,)
        How many times wider than the range of first genomes that is from which numbers are drawn anew.
    """

    groups: tuple[tuple[int, ...], ...] = ()
    dependent: tuple[int, ...] = ()
    reach: float | tuple[float, ...] = 1.0


class Representation(Protocol):
    """From the optimizer's numbers (genomes) to the parameters of models, from these to behavior and to what results state.

    Source: paper, section 3.2.2.
    """

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters."""

    @property
    def jumps(self) -> Jumps:
        """What jumps may do to genomes."""

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the parameters (..., P) of genomes (..., P)."""

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return what a robot with these parameters (..., P) executes."""

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return models with these parameters (..., P) in those that the agents have too, to be compared with theirs."""


class AgentsRepresentation(Representation, Protocol):
    """A representation that holds the agents as well (gray box): models are described by their parameters."""

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Units of the P parameters; empty for none."""

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the parameters (P,) of agents with these wheel speeds (2 n,) and field of view (rad)."""


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
        """Return the parameters (..., P) as they are."""
        return parameters


@dataclass(frozen=True)
class MorphologyModel(ReactiveModel):
    """A reactive model whose last parameter is the field of view: theta = 2 pi sig(x) of the optimizer's number x.

    Parameters
    ----------
    states
        Number of sensor states n.

    Source
    ------
    Paper, section 4.6.1.
    """

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names: vl0, vr0, vl1, vr1, ..., theta."""
        return (*super().parameter_names, "theta")

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """No units, and rad."""
        return (*super().parameter_units, "rad")

    @property
    def jumps(self) -> Jumps:
        """Sensor states exchange the speeds of both wheels, and the field of view, which tells them apart, is drawn anew."""
        speeds = 2 * self.states
        return Jumps(super().jumps.groups, dependent=(speeds,), reach=(1.0,) * speeds + (VIEW_REACH,))

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


REPRESENTATIONS: dict[str, Callable[[int], AgentsRepresentation]] = {
    "reactive": ReactiveModel,
    "morphology": MorphologyModel,
}
"""What a scenario may say of its models: name -> the representation of so many sensor states."""
