"""How much the vote of each classifier counts."""

import numpy as np

from turing_learning.config import ConfigurationError

from ._post_evaluation import decide
from ._verdict import DIGITS

SHRINKAGE = 0.5  # of covariances towards none between classifiers: many votes are nearly the same
FLOOR = 1e-3  # of variances: a classifier that never erred may err yet
_ONE_CLASSIFIER = ("unanimous", "single")
_EQUAL = ("fittest", "majority")


def weigh(rule: str, genuine: np.ndarray, abnormal: np.ndarray) -> np.ndarray:
    """Return the weights (N,) of classifiers, none below 0, with the sum 1.

    Parameters
    ----------
    rule
        One of `RULES`; which classifiers there are is not decided here.
    genuine, abnormal : (N, individuals, samples) bool
        Whether each classifier judges each sample genuine.

    Raises
    ------
    ConfigurationError
        If no classifier can tell the two kinds of motion apart, and the rule asks for one that can.
    """
    if rule in _EQUAL and len(genuine):
        return np.full(len(genuine), 1 / len(genuine))
    competence = _competence(rule, genuine, abnormal)
    if not competence.max(initial=0.0) > 0:
        raise ConfigurationError(
            f"`genomes` must hold a classifier that tells genuine from abnormal motion; got {len(genuine)} that "
            "cannot. Run more generations."
        )
    if rule in _ONE_CLASSIFIER:
        return (np.arange(len(competence)) == competence.argmax()).astype(float)
    weights = np.maximum(competence, 0)
    if rule == "discriminant":
        competent = weights > 0
        weights[competent] = _discriminant(genuine[competent], abnormal[competent])
    return weights / weights.sum()


def _competence(rule: str, genuine: np.ndarray, abnormal: np.ndarray) -> np.ndarray:
    """Return Youden's J (N,) of decisions about individuals for the unanimous rule, about samples for all others."""
    if rule == "unanimous":
        return decide(genuine).mean(axis=1) - decide(abnormal).mean(axis=1)
    return genuine.mean(axis=(1, 2)) - abnormal.mean(axis=(1, 2))


def _discriminant(genuine: np.ndarray, abnormal: np.ndarray) -> np.ndarray:
    """Return the weights (N,) of Fisher's linear discriminant, with shrunk covariances and nothing below 0.

    Source
    ------
    Fisher, The use of multiple measurements in taxonomic problems (1936).
    """
    within = _covariance(genuine) + _covariance(abnormal)
    variances = np.diag(np.diag(within) + FLOOR)
    shrunk = (1 - SHRINKAGE) * within + SHRINKAGE * variances + FLOOR * np.eye(len(within))
    weights = np.linalg.solve(shrunk, genuine.mean(axis=(1, 2)) - abnormal.mean(axis=(1, 2)))
    return np.maximum(np.round(weights, DIGITS), 0)


def _covariance(votes: np.ndarray) -> np.ndarray:
    """Return the covariances (N, N) between classifiers; the products are sums of whole numbers, exact in any order."""
    flat = votes.reshape(len(votes), -1).astype(float)
    means = flat.mean(axis=1)
    return flat @ flat.T / flat.shape[1] - np.outer(means, means)
