"""What a model of a robot is: which numbers it has, how the optimizer's numbers become them, and what a robot executes."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

FULL_VIEW = 2 * math.pi
"""Largest field of view (rad)."""


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
        ...

    @property
    def jumps(self) -> Jumps:
        """What jumps may do to genomes."""
        ...

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the parameters (..., P) of genomes (..., P)."""
        ...

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return what a robot with these parameters (..., P) executes."""
        ...

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return models with these parameters (..., P) in those that the agents have too, to be compared with theirs."""
        ...


class AgentsRepresentation(Representation, Protocol):
    """A representation that holds the agents as well (gray box): models are described by their parameters."""

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Units of the P parameters; empty for none."""
        ...

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the parameters (P,) of agents with these wheel speeds (2 n,) and field of view (rad)."""
        ...
