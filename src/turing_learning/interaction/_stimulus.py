"""What can be done to a system while it is watched, and networks that choose it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from turing_learning.models import Settings

from ..arrays import array
from ..classifiers import ElmanClassifier
from ..errors import choice, integer, refuse, require

PASSIVE = ("random", "constant", "own")
"""Who chooses stimuli where the classifiers only watch, if not series that were recorded; see `Stimulus`."""


# Largest size of an input, and of a sum: there, a neuron is saturated.
_LARGEST_INPUT = 1e4


_LARGEST_SUM = 40.0


@dataclass(frozen=True)
class Stimulus(Settings):
    """S stimuli at each time step, and who chooses them."""

    ranges: dict[str, tuple[float, float]]  #: Name -> (low, high) of each
    #: 0 for any value of the range; n for one of n evenly spaced values, both ends included
    levels: int = 0
    #: Empty if the classifiers choose. "random": anew in every step, uniformly; "constant": once
    #: for a trial, uniformly; "own": the system itself, by the method `own` of its step;
    #: "recorded": a row of `recorded`
    passive: Literal["", "random", "constant", "own", "recorded"] = ""
    #: (R, T, S): Series, each as long as a trial
    recorded: tuple[tuple[tuple[float, ...], ...], ...] = ()
    #: Whether the stimuli are inputs of the classifiers, beside the answers
    shown: bool = True

    def __post_init__(self) -> None:
        require(self.ranges, "stimulus", "name one stimulus or more", self.ranges)
        for name, bounds in self.ranges.items():
            low, high = array("stimulus", bounds, "2", place=repr(name))
            rule = "have a low end below the high one"
            require(low < high, "stimulus", rule, bounds, place=repr(name))
        integer("levels", self.levels, 0)
        require(self.levels != 1, "levels", "be 0, or 2 or more", self.levels)
        if self.passive:
            choice("passive", self.passive, (*PASSIVE, "recorded"))
        has_series = bool(self.recorded)
        fits = has_series == (self.passive == "recorded")
        rule = 'be given with passive = "recorded"'
        require(fits, "recorded", rule, has_series, "One goes with the other.")
        if has_series:
            self._check_recorded()

    def _check_recorded(self) -> None:
        """Reject recorded stimuli outside their ranges."""
        series = array("recorded", self.recorded, "R T S", S=len(self.ranges))
        outside = (series < self.low) | (series > self.high)
        for r, t, s in np.argwhere(outside)[:1].tolist():
            rule = f"be from {self.low[s]:g} to {self.high[s]:g}"
            where = f"series {r}, step {t}, {self.names[s]}"
            refuse("recorded", rule, series[r, t, s], place=where)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the S stimuli."""
        return tuple(self.ranges)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the stimuli that are inputs of classifiers."""
        return self.names if self.shown else ()

    @cached_property
    def low(self) -> np.ndarray:
        """Low ends (S,)."""
        return np.array([bounds[0] for bounds in self.ranges.values()])

    @cached_property
    def high(self) -> np.ndarray:
        """High ends (S,)."""
        return np.array([bounds[1] for bounds in self.ranges.values()])

    @cached_property
    def center(self) -> np.ndarray:
        """Middles (S,)."""
        return (self.low + self.high) / 2

    @property
    def outputs(self) -> int:
        """Number of outputs of a network that chooses; none where it only watches."""
        if self.passive:
            return 0
        return len(self.ranges) * (self.levels or 1)

    def of(self, outputs: np.ndarray) -> np.ndarray:
        """Return the stimuli (..., S) that outputs (..., O) from 0 to 1 choose."""
        if self.levels:
            by_level = outputs.reshape(*outputs.shape[:-1], len(self.ranges), self.levels)
            outputs = by_level.argmax(axis=-1) / (self.levels - 1)
        return self.low + (self.high - self.low) * outputs

    def drawn(self, trials: int, steps: int, rng: np.random.Generator) -> np.ndarray:
        """Return the stimuli (R, T, S) of trials that are only watched.

        Where classifiers would choose, they are drawn as for "random".
        """
        if self.passive == "recorded":
            series = np.asarray(self.recorded)
            return series[rng.integers(len(series), size=trials)]
        changes = 1 if self.passive == "constant" else steps
        shape = (trials, changes, len(self.ranges))
        if self.levels:
            shares = rng.integers(self.levels, size=shape) / (self.levels - 1)
        else:
            shares = rng.random(shape)
        stimuli = self.low + (self.high - self.low) * shares
        return np.broadcast_to(stimuli, (trials, steps, len(self.ranges)))


@dataclass(frozen=True)
class Interrogator:
    """What an Elman network judges, and with O further outputs of the same hidden neurons which stimulus comes next.

    A genome is that of the network, whose inputs are the signals of the response, then the stimuli
    if they are shown; then come the weights (O, H) and biases (O) of the further logistic outputs. They are 0 to 1 of
    a stimulus' range, or, of one of n levels, the largest of n outputs counts. The first stimulus
    is chosen with all hidden activations 0. Source: paper, section 3.1, footnote 1; Li, Gauci and
    Gross, A coevolutionary approach to learn animal behavior through controlled interaction (2013).
    """

    network: ElmanClassifier
    stimulus: Stimulus

    @property
    def parameters(self) -> int:
        """Number of weights Q of a genome."""
        return self.network.parameters + self.stimulus.outputs * (self.network.hidden + 1)

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S) for genomes (N, Q) and samples (S, T, D), whoever chose the stimuli in them."""
        weights = np.ascontiguousarray(genomes[:, : self.network.parameters])
        return self.network.judge(weights, samples)


class Dialogue:
    """N interrogators (N, Q), each in k dialogues at once, in single precision.

    `stimuli` (N, k, S) are the last ones chosen.
    """

    def __init__(self, interrogator: Interrogator, genomes: np.ndarray, dialogues: int) -> None:
        network = interrogator.network
        self._stimulus = interrogator.stimulus
        # N networks with D inputs, H hidden neurons and O outputs that choose.
        n = len(genomes)
        d = network.inputs
        h = network.hidden
        o = self._stimulus.outputs
        bounds = np.cumsum([h * d, h * h, h, h, 1, o * h])
        inward, recurrent, bias, judging, threshold, choosing, thresholds = np.split(
            genomes.astype(np.float32), bounds, axis=1
        )
        weights = np.concatenate((inward.reshape(n, h, d), recurrent.reshape(n, h, h)), axis=2)
        # (N, D + H, H)
        self._inward = np.ascontiguousarray(weights.transpose(0, 2, 1))
        self._bias = bias[:, None]
        self._judging = judging[:, :, None]
        self._threshold = threshold
        self._choosing = np.ascontiguousarray(choosing.reshape(n, o, h).transpose(0, 2, 1))
        self._thresholds = thresholds[:, None]
        scale = np.ones(d) if network.scale is None else np.array(network.scale)
        self._scale = scale.astype(np.float32)
        # What the hidden neurons take in: the inputs, then their activations before.
        self._inputs = d
        self._taken_in = np.zeros((n, dialogues, d + h), np.float32)
        self.stimuli = self._chosen()

    def observe(self, responses: np.ndarray) -> None:
        """Take in the centered responses (N, k, D) to the last stimuli, and choose the next ones."""
        signals = responses.shape[2]
        scaled = responses / self._scale[:signals]
        np.clip(scaled, -_LARGEST_INPUT, _LARGEST_INPUT, out=self._taken_in[..., :signals])
        if self._stimulus.shown:
            stimuli = (self.stimuli - self._stimulus.center) / self._scale[signals:]
            self._taken_in[..., signals : self._inputs] = stimuli
        activations = _logistic(self._taken_in @ self._inward + self._bias)
        self._taken_in[..., self._inputs :] = activations
        self.stimuli = self._chosen()

    @property
    def outputs(self) -> np.ndarray:
        """Judgments (N, k), from 0 (counterfeit) to 1 (genuine)."""
        sums = (self._activations @ self._judging)[..., 0] + self._threshold
        return _logistic(sums)

    @property
    def _activations(self) -> np.ndarray:
        return self._taken_in[..., self._inputs :]

    def _chosen(self) -> np.ndarray:
        return self._stimulus.of(_logistic(self._activations @ self._choosing + self._thresholds))


def _logistic(sums: np.ndarray) -> np.ndarray:
    """Return the logistic sigmoid, in the memory of the sums."""
    np.clip(sums, -_LARGEST_SUM, _LARGEST_SUM, out=sums)
    np.negative(sums, out=sums)
    np.exp(sums, out=sums)
    sums += 1
    return np.reciprocal(sums, out=sums)
