"""How a model of a robot's behavior is represented."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True, eq=False)
class Execution:
    """What replicas of M models execute.

    Attributes
    ----------
    wheel_speeds : (M, 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum; of a network the largest that it may give.
    weights : (M, Q)
        Networks that drive the replicas; None for reactive ones.
    hidden
        Hidden neurons H of the networks; 0 for none.
    """

    wheel_speeds: np.ndarray
    weights: np.ndarray | None = None
    hidden: int = 0


class Representation(Protocol):
    """What the numbers of a model mean.

    Source: paper, section 3.2.2.
    """

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the P numbers of a model."""

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the numbers that can stand for each other; empty if there are none."""

    def executed(self, models: np.ndarray) -> Execution:
        """Return what replicas of models (M, P) execute."""

    def described(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the agents' parameters (..., 2 n), to be compared with theirs."""
