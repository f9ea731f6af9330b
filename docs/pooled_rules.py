"""Intervals of several runs, compared on synthetic series whose truth is known: the tables of decision 0026.

Run with ``python docs/pooled_rules.py``; a few minutes on one core.
"""

from collections.abc import Callable

import numpy as np
from scipy.special import stdtrit

from turing_learning.analysis import interval, pooled_interval, r_hat
from turing_learning.analysis._estimate import INTERVAL_PERCENTILES, _growth, _independent

GENERATIONS, REPETITIONS = 300, 600
RUNS = (2, 3, 4, 8)

Ends = tuple[float, float]


def alone(runs: np.ndarray) -> Ends:
    """Return the interval of the first of the runs (K, W)."""
    return tuple(interval(runs[0][:, None], GENERATIONS)[0])


def hull(runs: np.ndarray) -> Ends:
    """Return the range of the intervals of all runs."""
    ends = np.array([alone(run[None]) for run in runs])
    return ends[:, 0].min(), ends[:, 1].max()


def series(runs: np.ndarray) -> Ends:
    """Take the runs, one after the other, for one long series."""
    return tuple(interval(runs.reshape(-1, 1), runs.size)[0])


def widened(runs: np.ndarray, count: float) -> Ends:
    """Widen the central range of all values as that of so many independent ones."""
    middle, ends = np.median(runs), np.percentile(runs, INTERVAL_PERCENTILES)
    return tuple(middle + _growth(max(count, 2.0)) * (ends - middle))


def variances(runs: np.ndarray) -> Ends:
    """Count the independent values as K times total variance over variance of the runs' means."""
    between, own = runs.mean(axis=1).var(ddof=1), sum(map(_independent, runs))
    total = runs.var(axis=1, ddof=1).mean() + between
    return widened(runs, np.clip(len(runs) * total / between, len(runs), max(own, len(runs))))


def chains(runs: np.ndarray) -> Ends:
    """Count them as the effective sample size of several Markov chains (Vehtari et al. 2021, equations 10 to 13)."""
    count, length = runs.shape
    spectrum = np.fft.rfft(runs - runs.mean(axis=1, keepdims=True), 2 * length, axis=1)
    covariances = np.fft.irfft(spectrum * spectrum.conj(), 2 * length, axis=1)[:, :length].mean(
        axis=0
    ) / (length - 1)
    within = runs.var(axis=1, ddof=1).mean()
    total = (length - 1) / length * within + runs.mean(axis=1).var(ddof=1)
    correlations = 1 - (within - covariances) / total
    correlations[0] = 1
    pairs = correlations[: length // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = np.minimum.accumulate(
        pairs[: int(np.argmax(pairs <= 0))] if (pairs <= 0).any() else pairs
    )
    return widened(runs, count * length / max(2 * positive.sum() - 1, 1.0))


def estimates(runs: np.ndarray) -> Ends:
    """Take the prediction interval of the runs' estimates alone."""
    middles, count = np.median(runs, axis=1), len(runs)
    half = stdtrit(count - 1, 0.95) * np.sqrt(1 + 1 / count) * middles.std(ddof=1)
    return np.median(middles) - half, np.median(middles) + half


def satterthwaite(runs: np.ndarray) -> Ends:
    """Add the two variances, with the degrees of freedom of their sum (Satterthwaite 1946)."""
    middles, count, own = np.median(runs, axis=1), len(runs), sum(map(_independent, runs))
    within, between = runs.var(axis=1, ddof=1).mean(), middles.var(ddof=1)
    freedom = (within + between) ** 2 / (within**2 / max(own - count, 1) + between**2 / (count - 1))
    half = stdtrit(freedom, 0.95) * np.sqrt(within + between * (1 + 1 / count))
    return np.median(middles) - half, np.median(middles) + half


def chosen(runs: np.ndarray) -> Ends:
    """Return the rule of `analysis.pooled_interval`."""
    return tuple(pooled_interval(runs[..., None])[0])


RULES = (alone, hull, series, variances, chains, estimates, satterthwaite, chosen)

Regions = Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]

CASES: dict[str, tuple[Regions, float]] = {
    "agree": (lambda rng, shape: np.zeros(shape), 0.93),
    "agree, wander slowly": (lambda rng, shape: np.zeros(shape), 0.98),
    "scatter 1": (lambda rng, shape: rng.normal(size=shape), 0.93),
    "scatter 5": (lambda rng, shape: 5 * rng.normal(size=shape), 0.93),
    "scatter 50": (lambda rng, shape: 50 * rng.normal(size=shape), 0.93),
    "5 times t with 2 degrees": (lambda rng, shape: 5 * rng.standard_t(2, size=shape), 0.93),
    "5 times exponential": (lambda rng, shape: 5 * rng.exponential(size=shape), 0.93),
    "beside the truth": (lambda rng, shape: 5 * np.abs(rng.normal(size=shape)), 0.93),
}
"""Where runs, and the truth, settle, in standard deviations of the wandering; and the correlation of successive generations."""


def wandering(rng: np.random.Generator, runs: int, correlation: float) -> np.ndarray:
    """Return autoregressive series (REPETITIONS, K, W) of standard deviation 1."""
    shocks = np.sqrt(1 - correlation**2) * rng.normal(size=(GENERATIONS, REPETITIONS, runs))
    values = [rng.normal(size=(REPETITIONS, runs))]
    for shock in shocks[1:]:
        values.append(correlation * values[-1] + shock)
    return np.moveaxis(values, 0, -1)


def main() -> None:
    """Print, for each case, the share of held truths and the median half width of each rule, and quantiles of R-hat."""
    rng = np.random.default_rng(5)
    names = " | ".join(rule.__name__ for rule in RULES)
    print(f"| runs | settle | {names} | R-hat, 5, 50, 95 % |")  # noqa: T201
    for count in RUNS:
        for name, (regions, correlation) in CASES.items():
            values = (
                wandering(rng, count, correlation) + regions(rng, (REPETITIONS, count))[..., None]
            )
            settled = (
                np.zeros(REPETITIONS)
                if name == "beside the truth"
                else regions(rng, (REPETITIONS,))
            )
            truth = settled + rng.normal(size=REPETITIONS)
            cells = []
            for rule in RULES:
                low, high = np.array([rule(runs) for runs in values]).T
                cells.append(
                    f"{np.mean((low <= truth) & (truth <= high)):.2f}; {np.median(high - low) / 2:.1f}"
                )
            agreement = np.percentile(r_hat(np.moveaxis(values, 0, 2)), (5, 50, 95))
            cells.append(", ".join(f"{value:.2f}" for value in agreement))
            print(f"| {count} | {name} | " + " | ".join(cells) + " |", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
