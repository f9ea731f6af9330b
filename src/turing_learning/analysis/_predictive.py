"""A look at an estimate from outside: do samples simulated at it resemble the genuine ones, by statistics that no run uses?"""

from dataclasses import dataclass
from itertools import compress, product

import numpy as np

from ._estimate import normal_scores

CORRELATION_LAGS = (1, 2, 4, 8, 16)
"""Steps between the values whose correlation is a statistic."""

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles of the values of a sample that are statistics."""

SHORT = 4
"""Steps up to which the values themselves are statistics; below twice as many, quantiles of a sample say nothing more."""

MOST_CORRELATED = 6
"""Signals up to which the correlation of each two is a statistic: beyond, principal directions stand for them."""

CHANCES = 2000
"""Sets of samples of the model that the p-value rests on: 0.0005 is the least."""

PERMUTATIONS = 999
"""Exchanges of two sets of samples that a p-value rests on."""

NARROWER = (0.9, 0.7)
"""Shares of the samples that the regression rests on, in two rounds."""

FLOOR = 0.05
"""Variance that is added to each direction of the statistics, in units of that of one."""

STILL_SPREAD = 0.3
"""Spread of the genuine samples, in that of simulated ones, below which they hardly vary."""

SURROUNDED = 6.0
"""Distance, in standard deviations of simulated samples, within which genuine ones that hardly vary are among them."""

WHITENING_FOLDS = 10
"""Parts of the samples, each of which is whitened by what the others say."""

RIDGE = 1e-3
"""Penalty of the regression, for each sample."""

NEIGHBORS = 600
"""Samples of the run by which it is known how the statistics change with the parameters."""


@dataclass(frozen=True)
class PredictiveCheck:
    """What samples of an estimate say of it, see `predictive_check`.

    Parameters
    ----------
    p_value
        How often so large a difference comes up by chance, if the estimate is right.
    statistic
        Name of the statistic that differs most, such as "mean of x".
    difference
        Of its means: genuine minus simulated, in standard deviations of a single sample.
    """

    p_value: float
    statistic: str
    difference: float


def predictive_check(
    genuine: np.ndarray,
    simulated: np.ndarray,
    parameters: np.ndarray,
    draws: np.ndarray,
    *,
    names: tuple[str, ...],
    rng: np.random.Generator,
    others: tuple[np.ndarray, np.ndarray] | None = None,
) -> PredictiveCheck:
    """Compare genuine samples with samples simulated at draws of the right model.

    Parameters
    ----------
    genuine : (K, T, D)
        Genuine samples.
    simulated : (N, T, D)
        Samples of models at the draws.
    parameters : (N, P)
        Of these models.
    draws : (W, P)
        Draws of the right model. An estimate may be off by what these leave open.
    names : (D,)
        Of the signals.
    rng
        For the sets of samples that the p-value rests on.
    others : (S, T, D), (S, P)
        Samples and parameters of further models, by which it is known how the statistics change with the parameters.

    Notes
    -----
    Each sample is summarized by `window_statistics`. Their ranks become normal scores, so that a single odd sample counts
    for little. A quadratic regression says which mean scores each of the draws expects. Of all draws that one counts which
    comes nearest to the genuine mean: an estimate that leaves much open is not wrong for that. What remains is held against
    means of as many samples of the model: by the statistic that differs most, and by the Mahalanobis distance of all. The
    p-value is that of the larger surprise of the two.

    Source
    ------
    Rubin, Bayesianly justifiable and relevant frequency calculations (1984); Gelman, Meng and Stern, Posterior predictive
    assessment of model fitness (1996). docs/decisions/0037.
    """
    center = np.median(draws, axis=0)
    scale = draws.std(axis=0) + 1e-12
    samples = simulated
    models = parameters
    if others is not None and len(others[0]):
        remoteness = (((others[1] - center) / scale) ** 2).sum(axis=1)
        nearest = np.argsort(remoteness, kind="stable")[:NEIGHBORS]
        samples = np.concatenate((simulated, others[0][nearest]))
        models = np.concatenate((parameters, others[1][nearest]))
    # Samples of a run are stored in single precision. Ranks would tell equal values from these by
    # their last digits, such as counts of 0.
    stored = np.concatenate((genuine, samples)).astype(np.float32).astype(np.float64)
    labels, table = window_statistics(stored, names)
    count = len(genuine)
    genuine_rows = table[:count]
    fresh_rows = table[count : count + len(simulated)]
    # of a simulator without noise all genuine samples are alike, and draws differ by more: they need to surround them
    varies = genuine_rows.std(axis=0) > STILL_SPREAD * fresh_rows.std(axis=0) + 1e-9
    distance = np.abs(genuine_rows.mean(axis=0) - fresh_rows.mean(axis=0))
    apart = distance / (fresh_rows.std(axis=0) + 1e-9)
    apart[varies] = 0
    if apart.max() > SURROUNDED:
        return PredictiveCheck(0.0, labels[int(np.argmax(apart))], float(apart.max()))
    if not varies.any():
        return PredictiveCheck(1.0, "", 0.0)
    labels = list(compress(labels, varies))
    every_score = normal_scores(table)[:, varies]
    observed = every_score[:count]
    scores = every_score[count:]

    # how the statistics change with the parameters: ever nearer to the draw that explains them best
    offsets = (models - center) / scale
    drawn = (draws - center) / scale
    best = np.zeros(offsets.shape[1])
    for share in NARROWER:
        fit = _regression(offsets, scores, best, share)
        differences, variances = fit.miss(drawn, observed.mean(axis=0))
        variances += 1 / count
        distances = ((differences @ fit.whitening) ** 2).sum(axis=1)
        chosen = int(np.argmin(distances / variances + len(labels) * np.log(variances)))
        best = drawn[chosen]

    # how far means of so many samples of the model are from what is expected
    rows = rng.choice(len(fit.rest), size=(CHANCES, count), p=fit.weights)
    spread = np.sqrt(count * variances[chosen])
    difference = differences[chosen]
    single = np.concatenate((difference[None], _row_means(fit.rest, rows) * spread))
    single = single / fit.deviation
    whitened = np.concatenate(
        ((difference @ fit.whitening)[None], _row_means(fit.whitened_rest, rows) * spread)
    )
    worst = int(np.argmax(np.abs(single[0])))
    return PredictiveCheck(_surprise(single, whitened), labels[worst], float(single[0, worst]))


def resemblance(
    first: np.ndarray, second: np.ndarray, names: tuple[str, ...], rng: np.random.Generator
) -> float:
    """Return how often samples (N, T, D) and (M, T, D) of one system would differ as much by chance: a p-value by permutation."""
    _, table = window_statistics(np.concatenate((first, second)), names)
    scores = normal_scores(table)
    # statistics that do not vary, such as shares of an event that never happens, say nothing
    scores = scores[:, scores.std(axis=0) > 1e-6]
    count = len(first)
    # of both together, so that exchanges are held to the same measure
    centered = scores - scores.mean(axis=0)
    deviation, whitening = _whitened(centered.T @ centered / len(centered))
    total = scores.sum(axis=0)
    # the samples as they are come first: what surprises as much as they do counts
    exchanged = [np.arange(count)]
    for _ in range(PERMUTATIONS):
        exchanged.append(rng.permutation(len(scores))[:count])
    of_first = _row_means(scores, np.stack(exchanged))
    of_second = (total - count * of_first) / len(second)
    differences = of_first - of_second
    return _surprise(differences / deviation, differences @ whitening)


@dataclass(frozen=True)
class _Regression:
    """Scores as quadratic functions of the parameters, about a point."""

    center: np.ndarray  # (P,)
    coefficients: np.ndarray  # (terms, F)
    # (terms, terms), from which the uncertainty of a prediction follows
    inverse: np.ndarray
    weights: np.ndarray  # (S,), of the samples; their sum is 1
    rest: np.ndarray  # (S, F), what the regression leaves of the scores
    # (S, F), the same uncorrelated, by what the samples of other folds say
    whitened_rest: np.ndarray
    deviation: np.ndarray  # (F,), standard deviations of these
    # (F, F), turns scores into uncorrelated ones of variance 1
    whitening: np.ndarray

    def miss(self, models: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what a mean (F,) misses of the scores expected at places (W, P), and variances (W,), in those of a sample."""
        terms = _terms(models - self.center)
        return mean - terms @ self.coefficients, ((terms @ self.inverse) * terms).sum(axis=1)


def _regression(
    models: np.ndarray, scores: np.ndarray, center: np.ndarray, share: float
) -> _Regression:
    """Fit scores (S, F) of samples at places (S, P), by that share of them that is nearest to a center (P,)."""
    terms = _terms(models - center)
    remoteness = ((models - center) ** 2).sum(axis=1)
    # as many effective samples, and at least four for each coefficient
    wanted = min(max(share * len(models), 4.0 * terms.shape[1]), 0.9 * len(models))
    # so wide that all count nearly alike; narrowed until few enough do
    width = 10 * float(remoteness.mean()) + 1e-12
    weights = np.exp(-0.5 * remoteness / width)
    while weights.sum() ** 2 > wanted * (weights**2).sum() and width > 1e-9:
        width /= 1.2
        weights = np.exp(-0.5 * (remoteness - remoteness.min()) / width)
    weighted = terms * weights[:, None]
    penalty = np.full(terms.shape[1], RIDGE * weights.sum())
    # the mean is not drawn towards 0
    penalty[0] = 0
    inverse = np.linalg.inv(terms.T @ weighted + np.diag(penalty))
    coefficients = inverse @ (weighted.T @ scores)
    weights = weights / weights.sum()
    residuals = scores - terms @ coefficients
    residuals -= weights @ residuals
    # few samples are fitted too well
    effective = 1 / (weights**2).sum()
    residuals *= np.sqrt(effective / max(effective - terms.shape[1], effective / 4))
    deviation, whitening = _whitened(_covariance(residuals, weights))
    whitened = _whitened_by_others(residuals, weights)
    return _Regression(
        center, coefficients, inverse, weights, residuals, whitened, deviation, whitening
    )


def _covariance(residuals: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the covariance (F, F) of residuals (S, F) whose mean is 0, with weights (S,)."""
    covariance: np.ndarray = (residuals * weights[:, None]).T @ residuals / weights.sum()
    return covariance


def _whitened_by_others(residuals: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return residuals (S, F) of weights (S,), made uncorrelated by what other folds say.

    Where samples are few, their own covariance makes them more alike than further samples, as the
    genuine ones are.
    """
    whitened = np.empty_like(residuals)
    fold = np.arange(len(residuals)) % WHITENING_FOLDS
    for number in range(WHITENING_FOLDS):
        inside = fold == number
        covariance = _covariance(residuals[~inside], weights[~inside])
        whitened[inside] = residuals[inside] @ _whitened(covariance)[1]
    return whitened


def _whitened(covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return standard deviations (F,), and what turns scores of this covariance (F, F) into uncorrelated ones of variance 1."""
    deviation = np.sqrt(np.diag(covariance)) + 1e-9
    values, vectors = np.linalg.eigh(covariance / np.outer(deviation, deviation))
    # directions in which nearly nothing varies are as uncertain as a part of the rest
    scaled = vectors / np.sqrt(np.maximum(values, 0) + FLOOR)
    # back to the statistics, so that folds may be mixed
    return deviation, scaled @ vectors.T / deviation[:, None]


def _surprise(single: np.ndarray, whitened: np.ndarray) -> float:
    """Return the share of differences (C, F) that surprise as much as the first.

    By one statistic, in its standard deviations, or by all together, without their correlations.
    """
    by_one = _exceeding(np.abs(single).max(axis=1))
    by_all = _exceeding((whitened**2).sum(axis=1))
    smaller = np.minimum(by_one, by_all)
    return float((smaller <= smaller[0]).mean())


def window_statistics(samples: np.ndarray, names: tuple[str, ...]) -> tuple[list[str], np.ndarray]:
    """Summarize samples (S, T, D) of signals with names (D,) by statistics (S, F) with names (F,)."""
    middle = np.median(samples, axis=(0, 1))
    # of normal values 1.4826 median deviations are a standard deviation; tails do not move it
    scale = np.median(np.abs(samples - middle), axis=(0, 1)) * 1.4826
    scale = np.where(scale > 1e-12, scale, samples.std(axis=(0, 1)))
    scale = np.where(scale > 1e-12, scale, 1.0)
    # far values count by their logarithm, so that one of heavy tails does not stand for all
    values = np.arcsinh((samples - middle) / scale)
    steps, signals = values.shape[1:]
    labels: list[str] = []
    columns: list[np.ndarray] = []

    def add(label: str, column: np.ndarray) -> None:
        labels.append(label)
        columns.append(column)

    for signal, name in enumerate(names):
        series = values[:, :, signal]
        add(f"mean of {name}", series.mean(axis=1))
        if steps <= SHORT:
            for step in range(steps if steps > 1 else 0):
                add(f"{name} at step {step}", series[:, step])
            add(f"square of {name}", (series**2).mean(axis=1))
            continue
        add(f"spread of {name}", series.std(axis=1))
        add(f"change of {name} per step", np.abs(np.diff(series, axis=1)).mean(axis=1))
        half = steps // 2
        add(f"trend of {name}", series[:, half:].mean(axis=1) - series[:, :half].mean(axis=1))
        drift = series[:, half:].std(axis=1) - series[:, :half].std(axis=1)
        add(f"drift of spread of {name}", drift)
        if steps >= 2 * SHORT:
            quantiles = np.quantile(series, QUANTILES, axis=1)
            for level, quantile in zip(QUANTILES, quantiles, strict=True):
                add(f"{level:g} quantile of {name}", quantile)
            # rests, and values that a tracker repeats
            rounded = np.isclose(series[:, 1:], series[:, :-1], rtol=0, atol=1e-12)
            add(f"share of steps without a change of {name}", rounded.mean(axis=1))
        for lag in CORRELATION_LAGS:
            if 2 * lag < steps:
                correlation = _correlation(series[:, :-lag], series[:, lag:])
                add(f"correlation of {name} over {lag} steps", correlation)
    if signals > 1:
        # what signals do together shows along the directions in which they vary together
        flat = values.reshape(-1, signals)
        around = values - flat.mean(axis=0)
        spreads, directions = np.linalg.eigh(np.atleast_2d(np.cov(flat.T)))
        for direction in range(signals):
            deviation = np.sqrt(max(spreads[direction], 1e-12))
            projected = around @ directions[:, direction] / deviation
            add(f"mean along direction {direction + 1}", projected.mean(axis=1))
            add(f"spread along direction {direction + 1}", (projected**2).mean(axis=1))
    if 1 < signals <= MOST_CORRELATED and steps > SHORT:
        for k, j in product(range(signals), repeat=2):
            if k < j:
                label = f"correlation of {names[k]} and {names[j]}"
                add(label, _correlation(values[:, :, k], values[:, :, j]))
            if k != j:
                label = f"correlation of {names[k]} with the next {names[j]}"
                add(label, _correlation(values[:, :-1, k], values[:, 1:, j]))
    return labels, np.column_stack(columns)


def _correlation(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the correlation (S,) of two series (S, T); 0 where one does not vary."""
    first = first - first.mean(axis=1, keepdims=True)
    second = second - second.mean(axis=1, keepdims=True)
    size = np.sqrt((first**2).sum(axis=1) * (second**2).sum(axis=1))
    product = (first * second).sum(axis=1)
    return np.divide(product, size, out=np.zeros(len(size)), where=size > 1e-12)


def _terms(models: np.ndarray) -> np.ndarray:
    """Return 1, all linear and all quadratic terms (S, 1 + P + P (P + 1) / 2) of points (S, P)."""
    first, second = np.triu_indices(models.shape[1])
    return np.column_stack((np.ones(len(models)), models, models[:, first] * models[:, second]))


def _row_means(table: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the mean (C, F) of the rows (C, K) of a table (S, F)."""
    counts = np.zeros((len(rows), len(table)))
    np.add.at(counts, (np.arange(len(rows))[:, None], rows), 1.0)
    means: np.ndarray = counts @ table / rows.shape[1]
    return means


def _exceeding(values: np.ndarray) -> np.ndarray:
    """Return for each value the share of all values that are at least as large."""
    order = np.sort(values)
    return (len(values) - np.searchsorted(order, values - 1e-12, side="left")) / len(values)
