"""How often the last test of a run by trials rejects a true model: ``python level.py SERIES SIMULATED TRIALS REPEATS``.

Systems are white noise of 40 steps around an inferred mean, with an inferred spread; the first signals have that mean, the others
the spread. Draws lie around the truth as those of a run would. One line for each number of signals. With ``counts`` at the end
values are whole numbers about a center that has no exact form, many of them equal. Samples of further models are of single
precision, as a run stores them.
"""

import sys

import numpy as np

from turing_learning.analysis import predictive_check

LOW = np.array([0.0, 0.1])
HIGH = np.array([10.0, 5.0])
STEPS = 40
CENTER = 1 / 7
"""What is subtracted from counts; no number of a computer is a seventh."""


def simulate(
    models: np.ndarray, signals: int, rng: np.random.Generator, *, counts: bool
) -> np.ndarray:
    """Return samples (M, 40, signals) of models (M, 2): a mean, and a spread; whole numbers, or not."""
    size = (len(models), STEPS, signals)
    first = np.arange(signals) < (signals + 1) // 2
    mean = np.where(first, models[:, None, :1], 0)
    spread = np.where(first, 1.0, models[:, None, 1:])
    values = mean + spread * rng.standard_normal(size)
    if counts:
        return np.round(values) - CENTER
    return values


def p_value(
    series: int, simulated: int, trials: int, signals: int, seed: int, *, counts: bool
) -> float:
    """Return the p-value of one true model."""
    rng = np.random.default_rng([seed, series, signals])
    truth = LOW + (HIGH - LOW) * rng.uniform(0.2, 0.8, 2)
    error = np.array([1.0, truth[1] / np.sqrt(2)]) / np.sqrt(series * STEPS)
    middle = truth + error * rng.standard_normal(2)
    draws = np.clip(middle + 2 * error * rng.standard_normal((600, 2)), LOW, HIGH)
    near = np.clip(middle + 6 * error * rng.standard_normal((trials // 2, 2)), LOW, HIGH)
    tried = np.concatenate((rng.uniform(LOW, HIGH, (trials - trials // 2, 2)), near))
    models = draws[:simulated]
    genuine = simulate(np.tile(truth, (series, 1)), signals, rng, counts=counts)
    fresh = simulate(models, signals, rng, counts=counts)
    stored = simulate(tried, signals, rng, counts=counts).astype(np.float32)
    return predictive_check(
        genuine,
        fresh,
        models,
        draws,
        names=tuple(f"s{number}" for number in range(signals)),
        rng=rng,
        others=(stored, tried),
    ).p_value


def main(series: int, simulated: int, trials: int, repeats: int, *, counts: bool) -> None:
    """Print the shares of p-values below 0.01, at which samples differ, and below 0.05."""
    for signals in (1, 2, 4):
        values = np.array(
            [
                p_value(series, simulated, trials, signals, seed, counts=counts)
                for seed in range(repeats)
            ]
        )
        below = [int((values < level).sum()) for level in (0.01, 0.05)]
        sys.stdout.write(f"{signals} signals: {below[0]} and {below[1]} of {repeats}\n")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:5]), counts="counts" in sys.argv[5:])
