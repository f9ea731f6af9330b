"""What can be done to a system while it is watched, and networks that choose it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from turing_learning.models import Settings

from ..arrays import array
from ..classifiers import ElmanClassifier
from ..errors import choice, integer, refuse, require

PASSIVE = ("random", "constant", "recorded")

_LARGEST = 1e4  # of an input
_STEEPEST = 40.0  # sum at which a neuron is saturated


@dataclass(frozen=True)
class Stimulus(Settings):
    """S stimuli at each time step, and who chooses them."""

    ranges: dict[str, tuple[float, float]]  #: Name -> (low, high) of each
    #: 0 for any value of the range; n for one of n evenly spaced values, both ends included
    levels: int = 0
    #: Empty if the classifiers choose. "random": anew in every step, uniformly; "constant": once
    #: for a trial, uniformly; "recorded": a row of `recorded`
    passive: Literal["", "random", "constant", "recorded"] = ""
    recorded: tuple[
        tuple[tuple[float, ...], ...], ...
    ] = ()  #: (R, T, S): Series, each as long as a trial

    def __post_init__(self) -> None:
        require(self.ranges, "stimulus", "name one stimulus or more", self.ranges)
        for name, ends in self.ranges.items():
            bounds = array("stimulus", ends, "2", place=repr(name))
            require(
                bounds[0] < bounds[1],
                "stimulus",
                "have a low end below the high one",
                ends,
                place=repr(name),
            )
        integer("levels", self.levels, 0)
        require(self.levels != 1, "levels", "be 0, or 2 or more", self.levels)
        if self.passive:
            choice("passive", self.passive, PASSIVE)
        given, remedy = bool(self.recorded), "One goes with the other."
        require(
            given == (self.passive == "recorded"),
            "recorded",
            'be given with passive = "recorded"',
            given,
            remedy,
        )
        if given:
            series = array("recorded", self.recorded, "R T S", S=len(self.ranges))
            for r, t, s in np.argwhere((series < self.low) | (series > self.high))[:1].tolist():
                rule, place = (
                    f"be from {self.low[s]:g} to {self.high[s]:g}",
                    f"series {r}, step {t}, {self.names[s]}",
                )
                refuse("recorded", rule, series[r, t, s], place=place)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the S stimuli."""
        return tuple(self.ranges)

    @cached_property
    def low(self) -> np.ndarray:
        """Low ends (S,)."""
        return np.array([ends[0] for ends in self.ranges.values()])

    @cached_property
    def high(self) -> np.ndarray:
        """High ends (S,)."""
        return np.array([ends[1] for ends in self.ranges.values()])

    @cached_property
    def center(self) -> np.ndarray:
        """Middles (S,)."""
        return (self.low + self.high) / 2

    @property
    def outputs(self) -> int:
        """Number of outputs of a network that chooses; none where it only watches."""
        return 0 if self.passive else len(self.ranges) * (self.levels or 1)

    def of(self, outputs: np.ndarray) -> np.ndarray:
        """Return the stimuli (..., S) that outputs (..., O) from 0 to 1 choose."""
        if self.levels:
            chosen = outputs.reshape(*outputs.shape[:-1], len(self.ranges), self.levels).argmax(
                axis=-1
            )
            outputs = chosen / (self.levels - 1)
        return self.low + (self.high - self.low) * outputs

    def drawn(self, trials: int, steps: int, rng: np.random.Generator) -> np.ndarray:
        """Return the stimuli (R, T, S) of trials that are only watched.

        Random ones where classifiers would choose.
        """
        if self.passive == "recorded":
            series = np.asarray(self.recorded)
            return series[rng.integers(len(series), size=trials)]
        shape = (trials, 1 if self.passive == "constant" else steps, len(self.ranges))
        shares = (
            rng.integers(self.levels, size=shape) / (self.levels - 1)
            if self.levels
            else rng.random(shape)
        )
        return np.broadcast_to(
            self.low + (self.high - self.low) * shares, (trials, steps, len(self.ranges))
        )


@dataclass(frozen=True)
class Interrogator:
    """What an Elman network judges, and with O further outputs of the same hidden neurons which stimulus comes next.

    A genome is that of the network, whose inputs are the signals of the response, then the stimuli;
    then come the weights (O, H) and biases (O) of the further logistic outputs. They are 0 to 1 of
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
        """Return outputs (N, S) for genomes (N, Q) and samples (S, T, D): what was seen, whoever chose the stimuli."""
        return self.network.judge(
            np.ascontiguousarray(genomes[:, : self.network.parameters]), samples
        )


class Dialogue:
    """N interrogators (N, Q), each in k dialogues at once, in single precision.

    `stimuli` (N, k, S) are the last ones chosen.
    """

    def __init__(self, interrogator: Interrogator, genomes: np.ndarray, dialogues: int) -> None:
        network, o = interrogator.network, interrogator.stimulus.outputs
        count, d, h = len(genomes), network.inputs, network.hidden
        scale = np.ones(d) if network.scale is None else np.array(network.scale)
        parts = np.split(
            genomes.astype(np.float32), np.cumsum([h * d, h * h, h, h, 1, o * h]), axis=1
        )
        inward, recurrent, bias, judging, threshold, choosing, thresholds = parts
        weights = np.concatenate(
            (inward.reshape(count, h, d), recurrent.reshape(count, h, h)), axis=2
        )
        self._inward = np.ascontiguousarray(weights.transpose(0, 2, 1))  # (N, D + H, H)
        self._outward = np.ascontiguousarray(choosing.reshape(count, o, h).transpose(0, 2, 1))
        self._bias, self._thresholds = bias[:, None], thresholds[:, None]
        self._judging, self._threshold = judging[:, :, None], threshold
        self._stimulus, self._scale, self._inputs = (
            interrogator.stimulus,
            scale.astype(np.float32),
            d,
        )
        self._seen = np.zeros(
            (count, dialogues, d + h), np.float32
        )  # the inputs, then the activations
        self.stimuli = self._chosen()

    def observe(self, responses: np.ndarray) -> None:
        """Take in the centered responses (N, k, D) to the last stimuli, and choose the next ones."""
        own = responses.shape[2]
        np.clip(responses / self._scale[:own], -_LARGEST, _LARGEST, out=self._seen[..., :own])
        self._seen[..., own : self._inputs] = (self.stimuli - self._stimulus.center) / self._scale[
            own:
        ]
        self._seen[..., self._inputs :] = _logistic(self._seen @ self._inward + self._bias)
        self.stimuli = self._chosen()

    @property
    def outputs(self) -> np.ndarray:
        """Judgments (N, k), from 0 (counterfeit) to 1 (genuine)."""
        return _logistic(
            (self._seen[..., self._inputs :] @ self._judging)[..., 0] + self._threshold
        )

    def _chosen(self) -> np.ndarray:
        return self._stimulus.of(
            _logistic(self._seen[..., self._inputs :] @ self._outward + self._thresholds)
        )


def _logistic(sums: np.ndarray) -> np.ndarray:
    np.clip(sums, -_STEEPEST, _STEEPEST, out=sums)
    np.negative(sums, out=sums)
    np.exp(sums, out=sums)
    sums += 1
    return np.reciprocal(sums, out=sums)
