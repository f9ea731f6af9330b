"""Measure how often genuine individuals are called abnormal, by synthetic scores; the table of decision 0022.

Run with ``python docs/detection_rates.py``.
"""

from collections.abc import Callable

import numpy as np

from turing_learning.detection._chance import CHANCE_DRAWS, p_values

STATED = (0.01, 0.05)
CASES = ((100, 1), (20, 1), (20, 10), (50, 10), (70, 74), (5000, 1), (5000, 10))
INDIVIDUALS = 20
LASTING = 0.3  # standard deviations of single scores
Scores = Callable[[np.random.Generator, tuple[int, ...]], np.ndarray]


def beta(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Draw scores of Beta(16, 4)."""
    return rng.beta(16, 4, shape)


def close(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Draw scores that lie close together, one of a hundred far below."""
    return np.where(rng.random(shape) < 0.01, 0.3, rng.normal(0.8, 0.01, shape))


def placed_threshold(
    genuine: np.ndarray, samples: int, share: float, rng: np.random.Generator
) -> float:
    """Return the threshold of the mean score as it was placed before: a quantile of means of scores drawn from the n."""
    means = (
        genuine
        if samples == 1
        else genuine[rng.integers(0, len(genuine), (CHANCE_DRAWS, samples))].mean(axis=1)
    )
    return float(np.sort(means)[int(share * len(means))])


def called(
    known: int, samples: int, scores: Scores, detectors: int, lasting: float = 0.0
) -> np.ndarray:
    """Return the share (detectors, rules, stated shares) of genuine individuals that are called abnormal."""
    found = np.empty((detectors, 2, len(STATED)))
    for k in range(detectors):
        rng = np.random.default_rng((known, samples, k))
        genuine, drawn = scores(rng, (known,)), scores(rng, (INDIVIDUALS, samples))
        if lasting:
            owner = np.resize(np.arange(10), known)  # the genuine samples are of ten individuals
            genuine = genuine + lasting * genuine.std() * rng.normal(size=10)[owner]
            drawn = drawn + lasting * drawn.std() * rng.normal(size=(INDIVIDUALS, 1))
        by_chance = p_values(genuine, drawn)
        for place, share in enumerate(STATED):
            threshold = placed_threshold(genuine, samples, share, rng)
            found[k, 0, place] = np.mean(drawn.mean(axis=1) < threshold)
            found[k, 1, place] = np.mean(by_chance <= share)
    return found


def cell(found: np.ndarray) -> str:
    """Return the two rates of a rule, by its shares (detectors, stated shares), in %."""
    one, five = 100 * found.mean(axis=0)
    return f"{one:.1f} ({five:.1f})"


def main() -> None:
    """Print a row of the table for each number of genuine samples and of samples of an individual."""
    for known, samples in CASES:
        detectors = {1: 2000}.get(samples, 400) if known < 1000 else 100
        alike, outliers = (called(known, samples, scores, detectors) for scores in (beta, close))
        differ = called(known, samples, beta, detectors, LASTING)
        cells = [cell(found[:, rule]) for found in (alike, outliers) for rule in (0, 1)]
        print(f"| {known}; {samples} | {' | '.join([*cells, cell(differ[:, 1])])} |", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
