"""Observers: random classifiers of short windows, which see what evolved networks have not learned
to see."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import Classifier
from turing_learning.errors import integer, require
from turing_learning.kernels.parallel import run_range
from turing_learning.kernels.pooled import LANES, judge_range

TAPS = (1, 2, 4, 8, 16)
"""Time steps that a neuron can see at once."""

GAPS = (1, 3)
"""Time steps from one of them to the next."""

GAINS = (2.0, 20.0)
"""Least and most steepness of a neuron, drawn uniformly in its logarithm: from nearly linear to
nearly a step."""

FLAT_GAINS = (0.3, 6.0)
"""The same where a sample has few windows: the mean of few steep neurons tells only how many of
them fire."""

FEW_WINDOWS = 16
"""Windows of a sample up to which these are few."""

WANDERING = 0.35
"""Standard deviation of the changes of a signal, in that of its values, below which it wanders.

Of a random walk of 100 steps it is 0.25 in most samples, of speeds that remember 1.5 s, observed
for 10 s, 0.43. Of a signal that wanders neurons see little but where it is.
"""

LARGEST_INPUT = 1e4
"""Size of an input, in units of the scale, up to which it counts."""


class Observers(Classifier, Protocol):
    """Classifiers that need not evolve: random ones, each looking for something else."""

    def draw(self, count: int, samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return genomes (count, Q) for samples like these (S, T, D)."""


@dataclass(frozen=True)
class PooledClassifier:
    """Judge every short stretch of a sample by one logistic neuron.

    The output is the mean over the sample.

    A neuron sees `taps` time steps, `gap` steps apart. With the inputs x (T, D), weights w (taps,
    D) and threshold b the output is the mean over t of sig(b + sum_k w_k . x_(t + k gap)): the
    share of the moments that look genuine. A recurrent network mostly tells what it saw last; this
    one weighs all moments alike.

    A genome holds the number of taps, the gap, b, and 16 D weights, step by step; those beyond the
    taps are without effect.

    Source: Rahimi and Recht, Random features for large-scale kernel machines (2007); Dempster,
    Schmidt and Webb, MiniRocket (2021).

    Parameters
    ----------
    inputs
        Signals per time step, D >= 1.
    scale : (D,)
        What the signals are divided by, in their units; None divides by nothing.
    threads
        Number of threads, >= 1; None takes every processor. The outputs do not depend on it, nor on
        which samples are judged together.
    """

    inputs: int = 2
    scale: Sequence[float] | None = None
    threads: int | None = None

    def __post_init__(self) -> None:
        integer("inputs", self.inputs, 1)
        if self.threads is not None:
            integer("threads", self.threads, 1)
        if self.scale is not None:
            scale = array("scale", self.scale, "D", D=self.inputs)
            require((scale > 0).all(), "scale", "hold positive numbers", f"{self.scale}")
            object.__setattr__(self, "scale", tuple(scale.tolist()))

    @property
    def parameters(self) -> int:
        """Length of a genome, Q."""
        return 3 + TAPS[-1] * self.inputs

    def draw(self, count: int, samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return random genomes (count, Q) for samples like these (S, T, D).

        Windows of 1 to 16 taps are equally frequent, as far as they fit into half of a sample. Of a
        signal that wanders, every second neuron sees changes alone.
        """
        inputs = self._inputs(samples)
        steps, signals = inputs.shape[1:]
        changes = _changes_of_wandering(inputs)
        wandering = np.isfinite(changes)
        shapes = [(1, 1)]
        for taps in TAPS[1:]:
            shapes += [(taps, gap) for gap in GAPS if 2 * (taps - 1) * gap < steps]
        genomes = np.zeros((count, self.parameters))
        for k, genome in enumerate(genomes):
            taps, gap = shapes[k % len(shapes)]
            reach = (taps - 1) * gap
            windows = steps - reach
            gains = GAINS if windows > FEW_WINDOWS else FLAT_GAINS
            gain = math.exp(rng.uniform(*np.log(gains)))
            weights = rng.standard_normal((taps, signals)) * (gain / math.sqrt(taps * signals))
            if taps > 1 and k // len(shapes) % 2 and wandering.any():
                weights[:, wandering] -= weights[:, wandering].mean(axis=0)
                weights[:, wandering] /= changes[wandering]
            # the threshold is at a moment that has been seen, so that no neuron is blind
            start = rng.integers(windows)
            window = inputs[rng.integers(len(inputs)), start : start + reach + 1 : gap]
            genome[0] = taps
            genome[1] = gap
            genome[2] = -float((weights * window).sum())
            genome[3 : 3 + weights.size] = weights.ravel()
        return genomes

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return the output (N, S) float32, 0 to 1, of every classifier for every sample.

        Empty if there is none of either.

        Parameters
        ----------
        genomes : (N, Q)
            As `draw` returns them.
        samples : (S, T, D)
            In the units of `scale`; T at least as long as the windows.
        """
        genomes = array("genomes", genomes, "N Q", empty=True, Q=self.parameters)
        inputs = self._inputs(samples)
        windows = np.ascontiguousarray(genomes[:, :2], dtype=np.int64)
        longest = int((1 + (windows[:, 0] - 1) * windows[:, 1]).max(initial=1))
        require(
            inputs.shape[1] >= longest,
            "samples",
            f"have at least {longest} time steps",
            f"{inputs.shape[1]}",
        )
        outputs = np.empty((len(inputs), len(genomes)), np.float32)
        weights = np.ascontiguousarray(genomes[:, 2:], dtype=np.float32)
        run_range(
            judge_range, -(-len(inputs) // LANES), self.threads, inputs, windows, weights, outputs
        )
        return outputs.T

    def _inputs(self, samples: np.ndarray) -> np.ndarray:
        samples = array("samples", samples, "S T D", empty=True, D=self.inputs)
        scaled = samples
        if self.scale is not None:
            scaled = samples / np.asarray(self.scale)
        return np.ascontiguousarray(
            np.clip(scaled, -LARGEST_INPUT, LARGEST_INPUT), dtype=np.float32
        )


def _changes_of_wandering(inputs: np.ndarray) -> np.ndarray:
    """Return the standard deviation (D,) of the changes of signals (S, T, D) that wander, else NaN.

    Those of most samples.
    """
    if inputs.shape[1] < 2:
        return np.full(inputs.shape[2], np.nan)
    changes = np.diff(inputs, axis=1).std(axis=1, dtype=np.float64)
    values = inputs.std(axis=1, dtype=np.float64)
    wanders = np.median(changes - WANDERING * values, axis=0) < 0
    typical = np.median(changes, axis=0)
    return np.where(wanders & (typical > 0), typical, np.nan)
