"""Protocols: what systems, simulations and judges have to offer, and the samples they pass."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ..arrays import array
from ._rewards import Judgments


@dataclass(frozen=True, eq=False)
class Samples:
    """What the classifiers get to see in one generation: series of D signals over T time steps.

    Raises
    ------
    TypeError
        If one of the two is no array of floats.
    ValueError
        If a shape is wrong or empty, the two disagree in T or D, or a value is not finite.
    """

    #: (K, T, D), samples of the system under investigation; floats, finite
    genuine: np.ndarray
    #: (M, C, T, D), C samples of each of the M models; floats, finite
    counterfeit: np.ndarray

    def __post_init__(self) -> None:
        sizes: dict[str, Any] = {}
        for name, shape in (("genuine", "K T D"), ("counterfeit", "M C T D")):
            samples = getattr(self, name)
            if not isinstance(samples, np.ndarray) or not np.issubdtype(samples.dtype, np.floating):
                received = getattr(samples, "dtype", type(samples).__name__)
                raise TypeError(f"`{name}` must be an array of floats; got {received}.")
            array(name, samples, shape, dtype=samples.dtype, **sizes)
            sizes = {"T": samples.shape[-2], "D": samples.shape[-1]}


@runtime_checkable
class SampleSource(Protocol):
    """Anything that yields genuine samples of a system and counterfeit samples of models of it."""

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Collect the samples of one generation, in the order of the models.

        Parameters
        ----------
        models : (M, P)
            Parameters of each model.
        rng
            The only source of randomness: the same models and generator state give the same samples.
        """


class InteractiveSource(Protocol):
    """A system and models of it that classifiers influence, for example by choosing stimuli while they observe."""

    def confront(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        met: np.ndarray,
        genuine: int,
        rng: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Let each classifier observe the system and models, each time alone, and judge what it has seen.

        Returns outputs (N, genuine) and (N, k) from 0 (counterfeit) to 1 (genuine), the decision lying at 0.5;
        never NaN.

        Parameters
        ----------
        models : (M, P)
            Parameters of each model.
        classifiers : (N, Q)
            Parameters of each classifier.
        met : (N, k) int
            Which models each classifier meets.
        genuine
            How often each meets the system.
        rng
            The only source of randomness.
        """


@runtime_checkable
class Classifier(Protocol):
    """A judge whose behavior is a vector of parameters."""

    @property
    def parameters(self) -> int:
        """Number of parameters Q."""

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Let each of N classifiers judge each of S samples.

        Returns outputs (N, S) from 0 (counterfeit) to 1 (genuine), the decision lying at 0.5; never NaN.

        Parameters
        ----------
        genomes : (N, Q)
            Parameters of each classifier.
        samples : (S, T, D)
            Genuine or counterfeit; the classifier is not told which.
        """


class Interrogation(Protocol):
    """Let all classifiers judge the system and all models."""

    def __call__(
        self, models: np.ndarray, classifiers: np.ndarray, rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:  # fmt: skip
        """Return the judgments of N classifiers (N, Q), and of B archived ones (B, Q) if given, on M models (M, P)."""
