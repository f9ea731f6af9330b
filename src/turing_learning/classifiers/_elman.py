"""The Elman network as a classifier: checks, prepares and hands over to the compiled judge."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from ..arrays import array
from ..errors import integer, refuse, require
from ..kernels.elman import load_elman
from ..kernels.elman_source import LANES, LARGEST_SUM, LIMIT
from ..kernels.parallel import run_range

_SMALLEST_SCALE, _LARGEST_SCALE = 1e-50, 1e50


@dataclass(frozen=True)
class ElmanClassifier:
    """Judge samples of motion by Elman networks with logistic neurons and one output.

    With inputs x_t, hidden activations h_t = sig(W x_t + U h_(t-1) + b) and h_0 = 0, the output after the
    last step is sig(v . h_T + c). A genome holds, in this order:

    1. input weights W (H, D), row by row (a row belongs to one hidden neuron),
    2. recurrent weights U (H, H), row by row,
    3. hidden biases b (H),
    4. output weights v (H),
    5. output bias c,

    so that Q = (D + 1) H + H^2 + H + 1, 46 for two inputs and five hidden neurons.

    Equal genomes are judged once: an archive holds long-lived classifiers several times.

    Computed in single precision; activations are off by less than 6e-6. Any finite numbers are judged, none
    gives NaN: where the largest input of a step or the largest weight of a neuron (W, U and b together; v and
    c) exceeds 1e8 in magnitude, all of that step's inputs or that neuron's weights are shortened by one factor,
    to 1e8.

    Source: paper, section "Classifiers"; the scale is explained in the method notes on classifier inputs.

    Parameters
    ----------
    inputs
        Signals per time step, D >= 1.
    hidden
        Hidden neurons, H >= 1; D + H at most 255. The judge is compiled for the two sizes on first use,
        within seconds, and kept in the user's cache folder.
    scale : (D,)
        What the signals are divided by, in their units, each between 1e-50 and 1e50; None divides by nothing.
    threads
        Number of threads, >= 1; None takes every processor. The outputs do not depend on it.

    Examples
    --------
    >>> import numpy as np
    >>> ElmanClassifier().judge(np.zeros((1, 46)), np.zeros((3, 100, 2)))
    array([[0.5, 0.5, 0.5]], dtype=float32)
    """

    inputs: int = 2
    hidden: int = 5
    scale: Sequence[float] | None = None
    threads: int | None = None

    def __post_init__(self) -> None:
        neurons = integer("inputs", self.inputs, 1) + integer("hidden", self.hidden, 1)
        rule = f"be at most {LARGEST_SUM - 1}"
        require(neurons < LARGEST_SUM, "inputs + hidden", rule, f"{self.inputs} + {self.hidden}")
        if self.threads is not None:
            integer("threads", self.threads, 1)
        if self.scale is not None:
            scale = array("scale", self.scale, "D", finite=False, D=self.inputs)
            rule = f"be numbers between {_SMALLEST_SCALE:g} and {_LARGEST_SCALE:g}, one per input"
            require(
                ((scale >= _SMALLEST_SCALE) & (scale <= _LARGEST_SCALE)).all(),
                "scale",
                rule,
                f"{self.scale}",
            )
            object.__setattr__(self, "scale", tuple(scale.tolist()))

    @property
    def parameters(self) -> int:
        """Length of a genome, Q."""
        return (self.inputs + 1) * self.hidden + self.hidden**2 + self.hidden + 1

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return the output of every classifier for every sample (N, S) float32; empty if there is no genome or no sample.

        Outputs are between 1e-7 and 1 - 1e-7; 0.5 and above means judged genuine.

        Parameters
        ----------
        genomes : (N, Q)
            Finite, laid out as described for the class.
        samples : (S, T, D)
            Finite, T >= 1, in the units of `scale`.
        """
        genomes = _as_float64("genomes", genomes, "N Q", self.parameters)
        samples = _as_float64("samples", samples, "S T D", self.inputs)
        require(samples.shape[1], "samples", "have at least one time step", samples.shape)
        weights = self._weights(genomes)
        # Of the networks that are equal
        first_of: dict[bytes, int] = {}
        same = [first_of.setdefault(network.tobytes(), n) for n, network in enumerate(weights)]
        chosen = np.array(list(first_of.values()), dtype=np.int64)
        # single precision: twice as many samples in a register
        outputs = np.empty((len(chosen), len(samples)), np.float32)
        if outputs.size:
            kernels = load_elman(int(self.inputs), int(self.hidden))
            blocks = self._pack(kernels, samples)
            run_range(
                kernels.judge,
                len(blocks) * len(chosen),
                self.threads,
                blocks,
                weights[chosen],
                outputs,
            )
        if len(chosen) == len(weights):
            return outputs
        return outputs[np.searchsorted(chosen, same)]

    def _pack(self, kernels: ModuleType, samples: np.ndarray) -> np.ndarray:
        count, steps, signals = samples.shape
        blocks = _aligned((-(-count // LANES), steps, signals, LANES))
        faults = np.empty(len(blocks), np.int64)
        scale = np.ones(signals) if self.scale is None else np.array(self.scale)
        run_range(kernels.pack, len(blocks), self.threads, samples, 1.0 / scale, blocks, faults)
        if faults.max() >= 0:
            s, t, d = map(int, np.unravel_index(int(faults[faults >= 0][0]), samples.shape))
            where = f"sample {s}, step {t}, signal {d}"
            rule = "be finite"
            refuse("samples", rule, f"{samples[s, t, d]}", "Remove or repair it.", place=where)
        return blocks

    def _weights(self, genomes: np.ndarray) -> np.ndarray:
        """Return the genomes in single precision, the weights of neurons with a larger one than 1e8 shortened by one factor."""
        if not genomes.size or np.abs(genomes).max() <= LIMIT:
            return genomes.astype(np.float32)
        if not np.isfinite(genomes).all():
            n, q = map(int, np.argwhere(~np.isfinite(genomes))[0])
            refuse("genomes", "be finite", f"{genomes[n, q]}", place=f"genome {n}, parameter {q}")
        count, (d, h) = len(genomes), (self.inputs, self.hidden)
        weights, recurrent, biases, output = np.split(genomes, np.cumsum([h * d, h * h, h]), axis=1)
        inputs_of_hidden = (
            weights.reshape(count, h, d),
            recurrent.reshape(count, h, h),
            biases.reshape(count, h, 1),
        )
        hidden = _limited(np.concatenate(inputs_of_hidden, axis=2))
        blocks = (hidden[..., :d], hidden[..., d : d + h], hidden[..., -1], _limited(output))
        return np.concatenate([block.reshape(count, -1) for block in blocks], axis=1).astype(
            np.float32
        )


def _limited(vectors: np.ndarray) -> np.ndarray:
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    return vectors * (LIMIT / np.maximum(largest, LIMIT))


def _aligned(shape: tuple[int, ...]) -> np.ndarray:
    # NumPy aligns to 16 bytes; a vector load of 64 bytes that crosses a cache line costs twice.
    size = 4 * math.prod(shape)
    memory = np.empty(size + 64, np.uint8)
    start = -memory.ctypes.data % 64
    return memory[start : start + size].view(np.float32).reshape(shape)


def _as_float64(name: str, values: np.ndarray, shape: str, last_size: int) -> np.ndarray:
    """Return contiguous numbers of a shape whose last axis is of the length `last_size`; whether they are finite is seen later."""
    remedy = ""
    if name == "samples":
        remedy = "Set `inputs` to the number of signals per time step."
    # Extended precision beyond float64 becomes infinite
    with np.errstate(over="ignore"):
        sizes: dict[str, Any] = {shape[-1]: last_size}
        checked = array(name, values, shape, finite=False, empty=True, remedy=remedy, **sizes)
    return np.require(checked, np.float64, ["C_CONTIGUOUS", "ALIGNED"])
