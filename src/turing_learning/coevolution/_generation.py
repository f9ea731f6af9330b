"""The record of one generation."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Generation:
    """Both populations of one generation, scored.

    Attributes
    ----------
    number
        0 for the first.
    models : (M, P)
        Parameters of the models.
    model_step_sizes : (M, P)
        Their step sizes.
    model_fitness : (M,)
        Their subjective fitness, equation 1 of the paper, whatever reward the optimizer is told.
    model_scores : (M,)
        What the optimizer ranks them by: what it is told, by default the subjective fitness, or its mean over their lives.
    classifiers : (N, Q)
        Parameters of the classifiers.
    classifier_step_sizes : (N, Q)
        Their step sizes.
    classifier_fitness : (N,)
        Their subjective fitness, equation 2 of the paper, whatever reward the optimizer is told.
    selection
        "active"; "all accepted" or "all rejected" where every classifier accepts, or rejects, every model.
    referees : (B, Q)
        Archived classifiers that judged the models beside them; (0, Q) where there were none.
    """

    number: int
    models: np.ndarray
    model_step_sizes: np.ndarray
    model_fitness: np.ndarray
    model_scores: np.ndarray
    classifiers: np.ndarray
    classifier_step_sizes: np.ndarray
    classifier_fitness: np.ndarray
    selection: str
    referees: np.ndarray

    @property
    def best_model(self) -> np.ndarray:
        """The model (P,) with the highest subjective fitness, the first of equals: the paper's rule."""
        return self.models[np.argmax(self.model_fitness)]

    @property
    def typical_model(self) -> np.ndarray:
        """The median (P,), parameter by parameter, of the half of the models with the higher scores.

        Of equals the first come first, as in `evolution.EvolutionStrategy`, whose next parents these are where mu is half
        the population. Much less noisy than `best_model`, whose fitness rests on a single trial.
        """
        half = np.argsort(-self.model_scores, kind="stable")[: max(1, len(self.models) // 2)]
        return np.median(self.models[half], axis=0)
