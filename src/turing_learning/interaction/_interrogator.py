"""Elman networks with further outputs: they choose the next stimulus while they watch."""

from dataclasses import dataclass, field

import numpy as np

from ..classifiers import ElmanClassifier
from ._stimulus import Stimulus

_LARGEST = 1e4  # of an input
_STEEPEST = 40.0  # sum at which a neuron is saturated


@dataclass(frozen=True)
class Interrogator:
    """What an Elman network judges, and with further outputs of the same neurons which stimulus comes next.

    A genome is that of the network, see `classifiers.ElmanClassifier`, then the weights (O, H) and biases (O) of O more logistic
    outputs. They are 0 to 1 of a stimulus' range, or, of one of n levels, the largest of n outputs counts. The first stimulus
    is chosen with all hidden activations 0.

    Parameters
    ----------
    network
        The Elman network that judges; its inputs are the signals of the response, then the stimuli.
    stimulus
        What it chooses.

    Source
    ------
    Paper, section 3.1, footnote 1; Li, Gauci and Gross, A coevolutionary approach to learn animal behavior through controlled
    interaction (2013).
    """

    network: ElmanClassifier
    stimulus: Stimulus
    parameters: int = field(init=False)

    def __post_init__(self) -> None:
        more = self.stimulus.outputs * (self.network.hidden + 1)
        object.__setattr__(self, "parameters", self.network.parameters + more)

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S) for genomes (N, Q) and samples (S, T, D): what was seen, whoever chose the stimuli."""
        return self.network.judge(np.ascontiguousarray(genomes[:, : self.network.parameters]), samples)


class Dialogue:
    """N interrogators (N, Q), each in k dialogues at once: hidden activations and outputs in single precision.

    Attributes
    ----------
    stimuli : (N, k, S)
        What each has chosen last.
    """

    def __init__(self, interrogator: Interrogator, genomes: np.ndarray, dialogues: int) -> None:
        network, o = interrogator.network, interrogator.stimulus.outputs
        count, d, h = len(genomes), network.inputs, network.hidden
        scale = np.ones(d) if network.scale is None else np.array(network.scale)
        parts = np.split(genomes.astype(np.float32), np.cumsum([h * d, h * h, h, h, 1, o * h]), axis=1)
        inward, recurrent, bias, judging, threshold, choosing, thresholds = parts
        weights = np.concatenate((inward.reshape(count, h, d), recurrent.reshape(count, h, h)), axis=2)
        self._inward = np.ascontiguousarray(weights.transpose(0, 2, 1))  # (N, D + H, H)
        self._outward = np.ascontiguousarray(choosing.reshape(count, o, h).transpose(0, 2, 1))
        self._bias, self._thresholds = bias[:, None], thresholds[:, None]
        self._judging, self._threshold = judging[:, :, None], threshold
        self._stimulus, self._scale, self._inputs = interrogator.stimulus, scale.astype(np.float32), d
        self._seen = np.zeros((count, dialogues, d + h), np.float32)  # the inputs, then the activations
        self.stimuli = self._chosen()

    def observe(self, responses: np.ndarray) -> None:
        """Take in the centered responses (N, k, D) to the last stimuli, and choose the next ones."""
        own = responses.shape[2]
        np.clip(responses / self._scale[:own], -_LARGEST, _LARGEST, out=self._seen[..., :own])
        self._seen[..., own : self._inputs] = (self.stimuli - self._stimulus.center) / self._scale[own:]
        self._seen[..., self._inputs :] = _logistic(self._seen @ self._inward + self._bias)
        self.stimuli = self._chosen()

    @property
    def outputs(self) -> np.ndarray:
        """Judgments (N, k), from 0 (counterfeit) to 1 (genuine)."""
        return _logistic((self._seen[..., self._inputs :] @ self._judging)[..., 0] + self._threshold)

    def _chosen(self) -> np.ndarray:
        return self._stimulus.of(_logistic(self._seen[..., self._inputs :] @ self._outward + self._thresholds))


def _logistic(sums: np.ndarray) -> np.ndarray:
    np.clip(sums, -_STEEPEST, _STEEPEST, out=sums)
    np.negative(sums, out=sums)
    np.exp(sums, out=sums)
    sums += 1
    return np.reciprocal(sums, out=sums)
