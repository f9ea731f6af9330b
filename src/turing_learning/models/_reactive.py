"""Reactive models: the gray box."""

from dataclasses import dataclass

import numpy as np

from ._representation import Execution


@dataclass(frozen=True)
class ReactiveModel:
    """A model with the agents' control system: two wheel speeds for each sensor state.

    Parameters
    ----------
    states
        Number of sensor states n.

    Source
    ------
    Paper, section 3.2.2.
    """

    states: int = 2

    @property
    def names(self) -> tuple[str, ...]:
        """Left and right wheel speed for each sensor state."""
        return tuple(f"v{side}{state}" for state in range(self.states) for side in "lr")

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the wheel speeds of each sensor state: tables with exchanged rows are models too."""
        return tuple((2 * state, 2 * state + 1) for state in range(self.states))

    def executed(self, models: np.ndarray) -> Execution:
        """Return the wheel speeds (M, 2 n) as they are."""
        return Execution(models)

    def described(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (..., 2 n) as they are."""
        return models
