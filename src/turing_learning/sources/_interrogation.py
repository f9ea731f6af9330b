"""Judgments that reject models whose simulation failed."""

from dataclasses import replace

import numpy as np

from ..coevolution import Classifier, Judgments, PassiveInterrogation
from ._source import OwnSource


class GuardedInterrogation:
    """A passive interrogation in which no classifier ever judges a model genuine whose simulation failed.

    Its samples stand for nothing; its reward is 0, the worst that there is. All classifiers gain the same by it, so that
    their ranks stay as they are.

    Parameters
    ----------
    source
        Yields the samples, and says which models failed.
    classifier
        Judges them.
    """

    def __init__(self, source: OwnSource, classifier: Classifier) -> None:
        self._source = source
        self._interrogate = PassiveInterrogation(source, classifier)

    def __call__(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:
        """Return the judgments of N classifiers (N, Q), and of B archived ones (B, Q) if given, on M models (M, P)."""
        judgments = self._interrogate(models, classifiers, rng, referees)
        failed = self._source.failed
        if not failed.any():
            return judgments
        referee_outputs = judgments.referee_outputs
        return replace(
            judgments,
            counterfeit_outputs=_rejected(judgments.counterfeit_outputs, failed),
            referee_outputs=None if referee_outputs is None else _rejected(referee_outputs, failed),
        )


def _rejected(outputs: np.ndarray, failed: np.ndarray) -> np.ndarray:
    return np.where(failed[:, None], 0.0, outputs)
