"""An agent in one dimension that responds to light through internal states."""

from dataclasses import dataclass

import numpy as np

from ..models import Parameter

DARK, BRIGHT = 0.4, 0.6
"""Light below the one is darkness, from the other on it is bright, of 0 to 1; ours."""
LAST = 3  # of the states, from 0 on; ours
NOISE_CM_S = 0.3  # of the speed that is seen; ours


@dataclass(frozen=True)
class LightResponse:
    """Speed of an agent with states 0 to 3, which it climbs where darkness and bright light follow each other at the right time.

    In the states 0 and 2 it waits for darkness, in 1 and 3 for bright light. In other light it falls back to state 0. In the right
    light a stochastic agent climbs with the probability `readiness` in each step; a deterministic one gets nearer to the next
    state by the share `readiness`. In state 3 it stays while it is bright. `speed0` to `speed3` are its speeds in the states,
    measured with noise.

    Source
    ------
    That the interrogator controls the light, that the agent moves in one dimension and answers through internal states,
    deterministic or stochastic: Li, Gauci and Gross (2013), Gross, Gu, Li and Gauci (2017). States and numbers are ours.
    """

    stochastic: bool = False

    def initial(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return states (2, n): the number of the state, and how near the next one is."""
        return np.zeros((2, count))

    def __call__(
        self, state: np.ndarray, parameters: np.ndarray, stimulus: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the next states and the speeds (n, 1) of agents with parameters (n, 5) in light (n, 1)."""
        (number, near), light, count = state, stimulus[:, 0], len(stimulus)
        right = np.where(number % 2 == 0, light < DARK, light >= BRIGHT)
        if self.stochastic:
            climbs = right & (rng.random(count) < parameters[:, LAST + 1])
        else:
            near = near + parameters[:, LAST + 1]
            climbs = right & (near >= 1 - 1e-9)
        number = np.where(right, np.minimum(number + climbs, LAST), 0)
        near = np.where(right & ~climbs, near, 0)
        speeds = parameters[np.arange(count), number.astype(np.int64)] + NOISE_CM_S * rng.standard_normal(count)
        return np.stack((number, near)), speeds[:, None]


PARAMETERS = {f"speed{k}": Parameter(0, 10, unit="cm/s") for k in range(LAST + 1)} | {"readiness": Parameter(0.05, 1)}
TRUTH = (2.0, 6.0, 1.0, 8.0, 0.3)
"""Ours."""
