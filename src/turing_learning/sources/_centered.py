"""Classifiers of a system of one's own, for samples as they were observed."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import Classifier
from ._system import OwnSystem


@dataclass(frozen=True)
class CenteredClassifier:
    """Judge samples of a system of one's own as its run did, which moved them to the center of the genuine ones."""

    classifier: Classifier
    system: OwnSystem

    @property
    def parameters(self) -> int:
        """Length of a genome, Q."""
        return self.classifier.parameters

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S) for genomes (N, Q) and samples (S, T, D)."""
        return self.classifier.judge(genomes, self.system.centered(samples))
