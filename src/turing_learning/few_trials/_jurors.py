"""From judgments to moments: numbers whose expectation is 0 for a model that is right.

Goes in: what J classifiers say of each trial, a few hundred numbers, and of the genuine samples.
Comes out: for each trial a moment for each of P parameters, and for each product of two that shows,
at most P (P + 3) / 2. Why it works: a juror, a weighted sum of all outputs, is trained to say how
large a parameter was in a trial. If a model is right, jurors say on average of its trials what they
say of the genuine samples, whatever their weights; so the difference is 0. The numbers: decision
0028, "Train jurors".
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs

TRIAL_FOLDS = 4
"""Parts of the trials; jurors that are trained on three judge the fourth."""

RIDGE_PENALTIES = (1e-2, 1e-1, 1.0)
"""Penalties that are tried, in units of the variance of an output; so large that equations can be
solved in single precision, also where all classifiers say the same."""

LEAST_EXPLAINED = 0.02
"""Share of a target's variance that the juror of a product has to explain out of its fold."""

SHRINKAGE = 0.05
"""Share by which covariances of moments are drawn to 0."""


class Moments(NamedTuple):
    """What trained jurors say of S trials."""

    #: (S, Q), output of each juror for a trial minus that for the genuine samples, decorrelated,
    #: with noise of variance 1
    values: np.ndarray
    #: (P,), share of the variance of each parameter that a juror sees in a single trial, out of its
    #: fold; 0 or less: nothing
    explained: np.ndarray


def train_moments(
    parameters: np.ndarray, outputs: np.ndarray, genuine: np.ndarray, rng: np.random.Generator
) -> Moments:
    """Train jurors on outputs of J classifiers for S trials, and compare these with the system.

    Outputs, from 0 to 1, are (S, J) for models (S, P), and (K, J) for genuine samples.

    One juror for each parameter, and for each product of two: a linear read-out of all outputs,
    trained to tell where it is large from where it is small, with the ridge penalty that does best
    out of its fold. Each trial, and the system beside it, are judged by jurors that were not
    trained on that trial; jurors of products that see nothing are dropped.

    Source: Fearnhead and Prangle, Constructing summary statistics for approximate Bayesian
    computation (2012); Gourieroux, Monfort and Renault, Indirect inference (1993).

    Raises
    ------
    numpy.linalg.LinAlgError
        If the equations have no finite solution, as where an output is not finite.
    """
    count, dimension = parameters.shape
    targets = quadratic_terms(
        (parameters - np.median(parameters, axis=0)) / (parameters.std(axis=0) + 1e-9)
    )
    targets = (targets - targets.mean(axis=0)) / (targets.std(axis=0) + 1e-9)
    # trials of one fold stand together, so that a fold is a slice
    fold = rng.permutation(count) % TRIAL_FOLDS
    order = np.argsort(fold, kind="stable")
    bounds = np.searchsorted(fold[order], np.arange(TRIAL_FOLDS + 1))
    judged = outputs[order]
    middle = judged.mean(axis=0)
    judged -= middle
    variance = np.einsum("sj,sj->j", judged, judged) / count
    scale = np.sqrt(0.5 * (variance + genuine.var(axis=0))) + 1e-3
    judged /= scale
    system = (genuine.mean(axis=0) - middle) / scale
    read, expected = _cross_fit(judged, system, targets[order], bounds)
    errors = ((read - targets[order]) ** 2).mean(axis=1)
    best = errors.argmin(axis=0)
    terms = np.arange(targets.shape[1])
    explained = 1 - errors.min(axis=0)
    values = np.empty_like(targets)
    values[order] = read[best, :, terms].T
    values -= expected[best, :, terms].T[fold]
    worthy = explained > LEAST_EXPLAINED
    worthy[:dimension] = True
    return Moments(_whitened(parameters, values[:, worthy]), explained[:dimension])


def _cross_fit(
    judged: np.ndarray, system: np.ndarray, targets: np.ndarray, bounds: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return what jurors say of trials out of their fold, and of the system.

    Shapes are (ridges, S, terms) and (ridges, folds, terms).

    Fold k is the trials from `bounds[k]` to `bounds[k + 1]`. Outputs of classifiers are single
    precision, and so are equations for weights: a juror with slightly other weights is one, too.
    """
    folds = [slice(begin, stop) for begin, stop in pairwise(bounds)]
    goals = targets.astype(judged.dtype)
    squares = [judged[fold].T @ judged[fold] for fold in folds]
    products = [judged[fold].T @ goals[fold] for fold in folds]
    sums = [judged[fold].sum(axis=0) for fold in folds]
    goal_sums = [goals[fold].sum(axis=0) for fold in folds]
    read = np.empty((len(RIDGE_PENALTIES), *targets.shape))
    expected = np.empty((len(RIDGE_PENALTIES), TRIAL_FOLDS, targets.shape[1]))
    all_squares = sum(squares)
    diagonal = np.diag_indices(len(system))
    (solve,) = get_lapack_funcs(("posv",), (judged,))
    for k, fold in enumerate(folds):
        size = len(judged) - len(judged[fold])
        mean = (sum(sums) - sums[k]) / size
        goal = (sum(goal_sums) - goal_sums[k]) / size
        square = all_squares - squares[k] - size * np.outer(mean, mean)
        product = sum(products) - products[k] - size * np.outer(mean, goal)
        left_out = judged[fold] - mean
        for r, ridge in enumerate(RIDGE_PENALTIES):
            penalized = square.copy()
            penalized[diagonal] += ridge * size
            # It is symmetric, so that LAPACK may work on it where it is.
            _, weights, failed = solve(penalized.T, product, overwrite_a=True)
            if failed or not np.isfinite(weights).all():
                raise np.linalg.LinAlgError(
                    "equations of jurors must have a finite solution; got outputs of classifiers "
                    f"from {judged.min():.3g} to {judged.max():.3g} standard deviations"
                )
            read[r, fold] = left_out @ weights + goal
            expected[r, k] = (system - mean) @ weights + goal
    return read, expected


def quadratic_terms(points: np.ndarray) -> np.ndarray:
    """Return all linear and quadratic terms (S, P + P (P + 1) / 2) of points (S, P)."""
    first, second = np.triu_indices(points.shape[1])
    return np.concatenate((points, points[:, first] * points[:, second]), axis=1)


def _whitened(parameters: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the moments (S, Q) decorrelated, with noise of variance 1.

    Noise is what remains around a smooth function of the parameters.
    """
    count = len(values)
    points = (parameters - np.median(parameters, axis=0)) / (parameters.std(axis=0) + 1e-9)
    terms = quadratic_terms(points)
    smooth = np.column_stack((np.ones(count), terms if count > 3 * terms.shape[1] else points))
    penalty = np.full(smooth.shape[1], 1e-3 * count)
    penalty[0] = 0
    fit = np.linalg.solve(smooth.T @ smooth + np.diag(penalty), smooth.T @ values)
    residuals = values - smooth @ fit
    covariance = residuals.T @ residuals / max(count - smooth.shape[1], count / 4)
    variances = np.diag(np.diag(covariance))
    covariance = (
        (1 - SHRINKAGE) * covariance + SHRINKAGE * variances + 1e-9 * np.eye(len(covariance))
    )
    return np.linalg.solve(np.linalg.cholesky(covariance), values.T).T
