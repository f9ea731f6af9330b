"""What the classifiers say about the samples, and rewards for it: equations 1 to 4 of the paper."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import array
from ..errors import refuse, require

THRESHOLD = 0.5
"""From this output on, a sample is judged genuine (paper, section 3.2.3)."""


@dataclass(frozen=True, eq=False)
class Judgments:
    """The outputs of N classifiers for all samples of a generation."""

    #: (N, K), outputs for the K genuine samples, from 0 (counterfeit) to 1 (genuine)
    genuine_outputs: np.ndarray
    #: (N, M, C), outputs for C samples of each of the M models
    counterfeit_outputs: np.ndarray
    #: (B, M, C), outputs of B archived classifiers for samples of the models; None: no referees
    referee_outputs: np.ndarray | None = None
    #: (B,), share of genuine samples that each judged genuine in its own generation; None without referees
    referee_specificity: np.ndarray | None = None
    #: (N, M) bool, which models each has met; its other outputs are 0 and do not count; None: all
    met: np.ndarray | None = None
    #: (B, M) bool, the same of the archived ones
    referees_met: np.ndarray | None = None

    def __post_init__(self) -> None:
        sizes: dict[str, Any] = {}
        for name, shape in (
            ("genuine_outputs", "N K"), ("counterfeit_outputs", "N M C"), ("referee_outputs", "B M C"),
            ("met", "N M"), ("referees_met", "B M"),
        ):  # fmt: skip
            values = getattr(self, name)
            if values is None:
                continue
            truth = name in ("met", "referees_met")
            array(name, values, shape, dtype=bool if truth else values.dtype, finite=False, **sizes)
            sizes |= dict(zip(shape.split(), values.shape, strict=True))
            # So that NaN, too, is rejected
            if not truth and not (values.min() >= 0 and values.max() <= 1):
                index = tuple(map(int, np.argwhere(~((values >= 0) & (values <= 1)))[0]))
                rule = "be from 0 to 1"
                refuse(name, rule, f"{values[index]} at {index} of ({', '.join(shape.split())})")
        met_by_some = self.met is None or bool(self.met.any(axis=0).all())
        require(met_by_some, "met", "hold a classifier for each model", "a model that none has met")

    @cached_property
    def genuine(self) -> np.ndarray:
        """Whether each classifier judges each genuine sample genuine, as it should; (N, K) bool."""
        return self.genuine_outputs >= THRESHOLD

    @cached_property
    def counterfeit(self) -> np.ndarray:
        """Whether each classifier is misled: judges a model's sample genuine; (N, M, C) bool, m_ij in the paper."""
        return self.counterfeit_outputs >= THRESHOLD

    @cached_property
    def refereed(self) -> np.ndarray | None:
        """Whether each archived classifier judges a model's sample genuine; (B, M, C) bool, None without referees."""
        if self.referee_outputs is None:
            return None
        return self.referee_outputs >= THRESHOLD

    @property
    def selection(self) -> str:
        """Whether the models are under selection.

        "all accepted" if every classifier accepts every model, "all rejected" if every classifier rejects every
        model, "active" otherwise. In the first two, all models are equally fit.
        """
        if (self.counterfeit if self.met is None else self.counterfeit[self.met]).all():
            return "all accepted"
        if self.counterfeit.any():
            return "active"
        return "all rejected"


Reward = Callable[[Judgments], np.ndarray]
"""A function of the judgments that returns one finite number for each model (M,), or for each classifier (N,)."""


def model_reward(judgments: Judgments) -> np.ndarray:
    """Compute the quality (M,) of each model, 0 to 1: how often it misleads the classifiers.

    It is the share of the judgments, over all N classifiers (that have met it) and C samples of a model, that
    are "genuine". Source: paper, equation 1; with several samples of each model, each has equal weight.
    """
    misled = judgments.counterfeit
    if judgments.met is None:
        asked = misled.shape[0]
    else:
        asked = np.count_nonzero(judgments.met, axis=0)
    return np.count_nonzero(misled, axis=(0, 2)) / (asked * misled.shape[2])


def jury_reward(judgments: Judgments) -> np.ndarray:
    """Compute the quality (M,) of each model, 0 to 1, before a jury of present and archived classifiers, weighted by competence.

    A juror's weight is Youden's J = specificity + sensitivity - 1 where positive: how well it tells the system
    from the present models. One that guesses has no vote. The sensitivity of archived classifiers is that
    against the present models, their specificity that of their own generation. Where nobody can tell anything,
    the reward is that of `model_reward`. Source: docs/decisions/0011; Youden, Index for rating diagnostic tests
    (1950).
    """
    accepted, met = _shares(judgments.counterfeit), judgments.met
    competence = specificity(judgments) - _means(accepted, met)
    if judgments.refereed is not None and judgments.referee_specificity is not None:
        referees = _shares(judgments.refereed)
        accepted = np.concatenate((accepted, referees))
        competence = np.append(
            competence, judgments.referee_specificity - _means(referees, judgments.referees_met)
        )
        if met is not None and judgments.referees_met is not None:
            met = np.concatenate((met, judgments.referees_met))
    weights = np.maximum(competence, 0)
    if met is None:
        if weights.any():
            return weights @ accepted / weights.sum()
        return model_reward(judgments)
    votes = weights @ met
    return np.where(
        votes > 0, weights @ accepted / np.where(votes > 0, votes, 1), model_reward(judgments)
    )


def _means(accepted: np.ndarray, met: np.ndarray | None) -> np.ndarray:
    """Return the mean (N,) of shares (N, M) over the models that were met."""
    if met is None:
        return accepted.mean(axis=1)
    return accepted.sum(axis=1) / met.sum(axis=1)


def _shares(misled: np.ndarray) -> np.ndarray:
    """Return the share (N, M) of each model's C samples, of (N, M, C), that mislead a classifier."""
    if misled.shape[2] > 1:
        return np.count_nonzero(misled, axis=2) / misled.shape[2]
    return misled[:, :, 0].astype(float)


def classifier_reward(judgments: Judgments) -> np.ndarray:
    """Compute the quality (N,) of each classifier: the mean of its specificity and its sensitivity, 0 to 1.

    It is 0.5 for a classifier that gives all samples the same answer. Source: paper, equation 2.
    """
    return 0.5 * (specificity(judgments) + sensitivity(judgments))


def specificity(judgments: Judgments) -> np.ndarray:
    """Compute the share (N,) of the genuine samples that each classifier judges genuine, its true-negative rate, 0 to 1.

    Source: paper, equation 3.
    """
    return np.count_nonzero(judgments.genuine, axis=1) / judgments.genuine.shape[1]


def sensitivity(judgments: Judgments) -> np.ndarray:
    """Compute the share (N,) of the counterfeit samples that each classifier judges counterfeit, its true-positive rate, 0 to 1.

    Source: paper, equation 4; with several samples of each model, each has equal weight.
    """
    misled = judgments.counterfeit
    if judgments.met is None:
        models = misled.shape[1]
    else:
        models = np.count_nonzero(judgments.met, axis=1)
    total = models * misled.shape[2]
    return (total - np.count_nonzero(misled, axis=(1, 2))) / total
