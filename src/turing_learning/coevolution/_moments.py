"""From judgments to moments: numbers whose expectation is 0 for a model that is right, with noise of variance 1."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

FOLDS = 4
_RIDGES = (1e-3, 1e-2, 1e-1, 1.0)
_WORTH = 0.02  # share of a target's variance that a juror must explain out of its fold
_SHRINKAGE = 0.05


class Moments(NamedTuple):
    """What trained jurors say of S trials."""

    #: (S, Q), output of each juror for a trial minus that for the genuine samples, decorrelated, with noise of variance 1
    values: np.ndarray
    #: (P,), share of the variance of each parameter that a juror sees in a single trial, out of its fold; 0 or less: nothing
    explained: np.ndarray


def train_moments(
    parameters: np.ndarray, outputs: np.ndarray, genuine: np.ndarray, rng: np.random.Generator
) -> Moments:
    """Train jurors on outputs of J classifiers for S trials (S, J) of models (S, P), and compare these with the system (K, J).

    One juror for each parameter, and for each product of two: a linear read-out of all outputs, trained to tell
    where it is large from where it is small, with the ridge penalty that does best out of its fold. Each trial,
    and the system beside it, are judged by jurors that were not trained on that trial; jurors of products that
    see nothing are dropped.

    Source: Fearnhead and Prangle, Constructing summary statistics for approximate Bayesian computation (2012);
    Gourieroux, Monfort and Renault, Indirect inference (1993).
    """
    count, dimension = parameters.shape
    targets = _terms((parameters - np.median(parameters, axis=0)) / (parameters.std(axis=0) + 1e-9))
    targets = (targets - targets.mean(axis=0)) / (targets.std(axis=0) + 1e-9)
    scale = np.sqrt(0.5 * (outputs.var(axis=0) + genuine.var(axis=0))) + 1e-3
    middle = outputs.mean(axis=0)
    judged, system = (outputs - middle) / scale, ((genuine - middle) / scale).mean(axis=0)
    fold = rng.permutation(count) % FOLDS
    read, expected = _cross_fit(judged, system, targets, fold)
    errors = ((read - targets) ** 2).mean(axis=1)
    best, terms = errors.argmin(axis=0), np.arange(targets.shape[1])
    explained = 1 - errors.min(axis=0)
    values = read[best, :, terms].T - expected[best][terms, :, terms].T[fold]
    kept = explained > _WORTH
    kept[:dimension] = True
    return Moments(_whitened(parameters, values[:, kept]), explained[:dimension])


def _cross_fit(
    judged: np.ndarray, system: np.ndarray, targets: np.ndarray, fold: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the outputs (ridges, S, terms) for trials out of their fold, and those (ridges, folds, terms) for the system."""
    parts = [(judged[fold == k], targets[fold == k]) for k in range(FOLDS)]
    squares, products = [a.T @ a for a, _ in parts], [a.T @ t for a, t in parts]
    read = np.empty((len(_RIDGES), *targets.shape))
    expected = np.empty((len(_RIDGES), FOLDS, targets.shape[1]))
    for k, (left_out, _) in enumerate(parts):
        others = [j for j in range(FOLDS) if j != k]
        size = sum(len(parts[j][0]) for j in others)
        mean = sum(parts[j][0].sum(axis=0) for j in others) / size
        goal = sum(parts[j][1].sum(axis=0) for j in others) / size
        square = sum(squares[j] for j in others) - size * np.outer(mean, mean)
        product = sum(products[j] for j in others) - size * np.outer(mean, goal)
        for r, ridge in enumerate(_RIDGES):
            penalized = square + ridge * size * np.eye(len(square))
            weights = cho_solve(cho_factor(penalized), product)
            read[r, fold == k] = (left_out - mean) @ weights + goal
            expected[r, k] = (system - mean) @ weights + goal
    return read, expected


def _terms(places: np.ndarray) -> np.ndarray:
    """Return all linear and quadratic terms (S, P + P (P + 1) / 2) of points (S, P)."""
    first, second = np.triu_indices(places.shape[1])
    return np.concatenate((places, places[:, first] * places[:, second]), axis=1)


def _whitened(parameters: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the moments (S, Q) decorrelated, with residuals of variance 1 around a smooth function of the parameters."""
    count = len(values)
    places = (parameters - np.median(parameters, axis=0)) / (parameters.std(axis=0) + 1e-9)
    terms = _terms(places)
    smooth = np.column_stack((np.ones(count), terms if count > 3 * terms.shape[1] else places))
    penalty = np.full(smooth.shape[1], 1e-3 * count)
    penalty[0] = 0
    fit = np.linalg.solve(smooth.T @ smooth + np.diag(penalty), smooth.T @ values)
    rest = values - smooth @ fit
    covariance = rest.T @ rest / max(count - smooth.shape[1], count / 4)
    variances = np.diag(np.diag(covariance))
    covariance = (1 - _SHRINKAGE) * covariance + _SHRINKAGE * variances + 1e-9 * np.eye(len(covariance))
    return np.linalg.solve(np.linalg.cholesky(covariance), values.T).T
