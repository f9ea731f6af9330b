"""What a model of a robot is: gray boxes, by which agents may be described, too, and Elman networks, the black box."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..arrays import array
from ..errors import integer

FULL_VIEW = 2 * math.pi
"""Largest field of view (rad)."""

STEADY_STEPS = 20
"""Time steps of constant input after which the outputs count as steady: paper, section 4.6.2."""

VIEW_SATURATION = 10.0
"""Size of the number of a field of view beyond which the view is 0 or 2 pi, but for 0.0003 rad."""
VIEW_REACH = 5.0
"""Range of jumps of the number of a field of view, in ranges of first genomes.

Views reach from 2 to 358 degrees instead of 97 to 263.
"""


@dataclass(frozen=True, eq=False)
class Behavior:
    """What robots with these models execute."""

    #: (..., 2 n): Left and right wheel speed for each sensor state, fractions of the maximum;
    #: largest of a network
    wheel_speeds: np.ndarray
    #: (...): Of the sensor (rad), from 0 to 2 pi; None: the scenario's
    field_of_view: np.ndarray | None = None
    #: (..., Q): Networks that drive the robots; None for reactive ones
    weights: np.ndarray | None = None
    hidden: int = 0  #: Hidden neurons H of the networks; 0 for none

    def __post_init__(self) -> None:
        self._check("wheel_speeds", "... W")
        self._check("field_of_view", "...")
        self._check("weights", "... Q")

    def _check(self, name: str, shape: str) -> None:
        value = getattr(self, name)
        if value is not None:
            numbers = array(name, value, shape, finite=False, empty=True)
            object.__setattr__(self, name, numbers)


@dataclass(frozen=True)
class Jumps:
    """What jumps of the optimizer may do to genomes of P numbers, beside drawing one of them anew."""

    #: Indices of the numbers of each sensor state: models with exchanged groups are models too;
    #: may be empty
    groups: tuple[tuple[int, ...], ...] = ()
    #: Indices of the numbers that depend on which group is whose: they mean nothing when groups
    #: are exchanged
    dependent: tuple[int, ...] = ()
    #: () or (P,): Range from which numbers are drawn anew, in ranges of the first genomes
    reach: float | tuple[float, ...] = 1.0


class Representation(Protocol):
    """From the optimizer's numbers (genomes) to the parameters of models, from these to behavior and to what results state.

    By default genomes are parameters, results state them as they are, and no jumps exchange any
    (paper, section 3.2.2).
    """

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters."""

    @property
    def jumps(self) -> Jumps:
        """What jumps may do to genomes."""
        return Jumps()

    @property
    def saturation(self) -> tuple[tuple[int, float], ...]:
        """Indices of numbers with the size beyond which the parameter has reached its end.

        An infinite one stands for that end.
        """
        return ()

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return the parameters (..., P) of genomes (..., P)."""
        return genomes

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return what a robot with these parameters (..., P) executes."""

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return models with these parameters (..., P) in those that the agents have too, to be compared with theirs."""
        return parameters


@dataclass(frozen=True)
class ReactiveModel(Representation):
    """A model with the agents' control system: left and right wheel speed for each sensor state (paper, section 3.2.2)."""

    states: int  #: Number of sensor states n

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names: vl0, vr0, vl1, vr1, ..."""
        return tuple(f"v{side}{state}" for state in range(self.states) for side in "lr")

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Units of the parameters; empty for none: fractions of the maximum."""
        return ("",) * (2 * self.states)

    @property
    def jumps(self) -> Jumps:
        """Sensor states exchange the speeds of both wheels."""
        return Jumps(groups=tuple((2 * state, 2 * state + 1) for state in range(self.states)))

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the parameters (P,) of agents with these wheel speeds (2 n,) and field of view (rad): the wheel speeds."""
        return wheel_speeds

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return the wheel speeds; the field of view is the scenario's."""
        return Behavior(parameters)


@dataclass(frozen=True)
class MorphologyModel(ReactiveModel):
    """A reactive model whose last parameter is the field of view, theta = 2 pi sig(x) of a number x (paper, section 4.6.1)."""

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
        """Sensor states exchange the speeds of both wheels.

        The field of view, which tells them apart, is drawn anew.
        """
        speeds = 2 * self.states
        reach = (1.0,) * speeds + (VIEW_REACH,)
        return Jumps(super().jumps.groups, dependent=(speeds,), reach=reach)

    @property
    def saturation(self) -> tuple[tuple[int, float], ...]:
        """That of the field of view."""
        return ((2 * self.states, VIEW_SATURATION),)

    def truth(self, wheel_speeds: tuple[float, ...], field_of_view: float) -> tuple[float, ...]:
        """Return the wheel speeds and the field of view (2 n + 1,)."""
        return (*wheel_speeds, field_of_view)

    def to_units(self, genomes: np.ndarray) -> np.ndarray:
        """Return genomes (..., 2 n + 1) with the field of view (rad) in the place of its number."""
        parameters = np.array(genomes, dtype=np.float64)
        # The logistic sigmoid, for numbers of any size.
        sigmoid = np.exp(-np.logaddexp(0.0, -parameters[..., -1]))
        parameters[..., -1] = FULL_VIEW * sigmoid
        return parameters

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return wheel speeds and field of view."""
        return Behavior(parameters[..., :-1], parameters[..., -1])


REPRESENTATIONS: dict[str, type[ReactiveModel]] = {
    "reactive": ReactiveModel,
    "morphology": MorphologyModel,
}
"""What a scenario may say of its models: name -> the representation of so many sensor states."""


@dataclass(frozen=True)
class ElmanModel(Representation):
    """A model that assumes nothing of the agents' control system: an Elman network with memory (paper, section 4.6.2).

    With the sensor reading I_t, hidden activations h_t = sig(W I_t + U h_(t-1) + b) and h_0 = 0 at
    the start of a trial, the wheel speeds, as fractions of the maximum, are 2 sig(V h_t + c) - 1. A
    model holds, in this order:

    1. input weights W (H, 1),
    2. recurrent weights U (H, H), row by row (a row belongs to one hidden neuron),
    3. hidden biases b (H),
    4. output weights V (2, H), of the left wheel, then of the right,
    5. output biases c (2), left and right,

    so that Q = H^2 + 4 H + 2: 7, 23 and 47 weights for one, three and five hidden neurons. The
    paper does not print the map of the outputs: docs/decisions/0017-black-box-models.md.

    Parameters
    ----------
    states
        Number of sensor states n.
    hidden
        Hidden neurons H, >= 1.

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

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Return the networks (..., Q), and 1 as the largest of their outputs.

        The field of view is the scenario's.
        """
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
            Left and right wheel speed, -1 to 1, in each time step; the network is reset before the
            first.
        """
        hidden = self.hidden
        count = len(self.parameter_names)
        remedy = f"{hidden} hidden neurons have {count} weights."
        models = array("models", models, "... Q", empty=True, remedy=remedy, Q=count)
        networks = models.shape[:-1]
        splits = np.cumsum([hidden, hidden * hidden, hidden, 2 * hidden])
        inward, recurrent, biases, outward, output_biases = np.split(models, splits, axis=-1)
        recurrent = recurrent.reshape(*networks, hidden, hidden)
        outward = outward.reshape(*networks, 2, hidden)
        activations = np.zeros((*networks, hidden))
        outputs = np.empty((*networks, len(readings), 2))
        for t, reading in enumerate(readings):
            fed_back = np.einsum("...jk,...k->...j", recurrent, activations)
            activations = _logistic(inward * reading + biases + fed_back)
            sums = np.einsum("...sj,...j->...s", outward, activations) + output_biases
            outputs[..., t, :] = 2 * _logistic(sums) - 1
        return outputs


def _logistic(sums: np.ndarray) -> np.ndarray:
    """Return the logistic sigmoid, without overflow."""
    return 0.5 + 0.5 * np.tanh(0.5 * sums)
