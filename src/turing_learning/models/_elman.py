"""Elman networks as models: the black box."""

from dataclasses import dataclass

import numpy as np

from ..arrays import array
from ..errors import integer
from ._representation import Behavior, Jumps

STEADY_STEPS = 20
"""Time steps of constant input after which the outputs count as steady: paper, section 4.6.2."""


@dataclass(frozen=True)
class ElmanModel:
    """A model that assumes nothing of the agents' control system: an Elman network with memory.

    With the sensor reading I_t, hidden activations h_t = sig(W I_t + U h_(t-1) + b) and h_0 = 0 at the start of a trial,
    the wheel speeds, as fractions of the maximum, are 2 sig(V h_t + c) - 1. A model holds, in this order:

    1. input weights W (H, 1),
    2. recurrent weights U (H, H), row by row (a row belongs to one hidden neuron),
    3. hidden biases b (H),
    4. output weights V (2, H), of the left wheel, then of the right,
    5. output biases c (2), left and right,

    so that Q = H^2 + 4 H + 2: 7, 23 and 47 weights for one, three and five hidden neurons.

    Parameters
    ----------
    states
        Number of sensor states n.
    hidden
        Hidden neurons H, >= 1.

    Source
    ------
    Paper, section 4.6.2, which does not print the map of the outputs: docs/decisions/0017-black-box-models.md.

    Examples
    --------
    >>> import numpy as np
    >>> ElmanModel(hidden=1).described(np.array([0, 0, 0, 0, 0, 0, 2 * np.log(3)]))
    array([0. , 0.8, 0. , 0.8])
    """

    states: int = 2
    hidden: int = 5

    def __post_init__(self) -> None:
        integer("states", self.states, 1)
        integer("hidden", self.hidden, 1)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the weights."""
        neurons = range(1, self.hidden + 1)
        return (
            *(f"w{j}" for j in neurons),
            *(f"u{j}_{k}" for j in neurons for k in neurons),
            *(f"b{j}" for j in neurons),
            *(f"{side}{j}" for side in ("left", "right") for j in neurons),
            "left_bias",
            "right_bias",
        )

    @property
    def jumps(self) -> Jumps:
        """No exchange: no weights belong to a sensor state."""
        return Jumps()

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the genomes (..., Q) themselves."""
        return genomes

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return the networks (..., Q), and 1 as the largest of their outputs; the field of view is the scenario's."""
        largest = np.ones((*parameters.shape[:-1], 2 * self.states))
        return Behavior(largest, weights=parameters, hidden=self.hidden)

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return the steady outputs (..., 2 n): those in the last of 20 steps of each constant reading."""
        return self.constant_responses(parameters)[..., -1, :]

    def constant_responses(self, models: np.ndarray, steps: int = STEADY_STEPS) -> np.ndarray:
        """Feed networks (..., Q) with each reading for `steps` time steps, each time from the reset network.

        Returns
        -------
        (..., T, 2 n)
            Left and right wheel speed for each reading, in the order of the agents' parameters.
        """
        series = (np.full(steps, state) for state in range(self.states))
        return np.concatenate([self.respond(models, readings) for readings in series], axis=-1)

    def respond(self, models: np.ndarray, readings: np.ndarray) -> np.ndarray:
        """Feed networks with a series of sensor readings.

        Parameters
        ----------
        models : (..., Q)
            Weights; finite.
        readings : (T,)
            Sensor readings I.

        Returns
        -------
        (..., T, 2)
            Left and right wheel speed, -1 to 1, in each time step; the network is reset before the first.
        """
        h, count = self.hidden, len(self.parameter_names)
        models = array(
            "models", models, "... Q", empty=True, remedy=f"{h} hidden neurons have {count} weights.", Q=count
        )
        lead = models.shape[:-1]
        inputs, recurrent, biases, output, last = np.split(models, np.cumsum([h, h * h, h, 2 * h]), axis=-1)
        recurrent, output = recurrent.reshape(*lead, h, h), output.reshape(*lead, 2, h)
        activations = np.zeros((*lead, h))
        outputs = np.empty((*lead, len(readings), 2))
        for t, reading in enumerate(readings):
            activations = _logistic(inputs * reading + biases + np.einsum("...jk,...k->...j", recurrent, activations))
            outputs[..., t, :] = 2 * _logistic(np.einsum("...sj,...j->...s", output, activations) + last) - 1
        return outputs


def _logistic(z: np.ndarray) -> np.ndarray:
    return 0.5 + 0.5 * np.tanh(0.5 * z)  # the logistic sigmoid, without overflow
