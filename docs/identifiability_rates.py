"""Measure how often the classifier two-sample test rejects a true and a wrong model; the table of docs/identifiability.md.

Run with ``python docs/identifiability_rates.py``.
"""

import numpy as np

from turing_learning.classifiers import ElmanClassifier
from turing_learning.identifiability import Effort, Evidence, two_sample_test
from turing_learning.models import Parameter

EFFORT = Effort(samples=100, generations=100, population=40)
TRUTH = (0.0, 1.0)
CASES = (
    ("the truth", TRUTH, None, 100),
    ("the truth, 8 individuals that differ lastingly", TRUTH, 8, 100),
    ("mean shifted by 0.2", (0.2, 1.0), None, 25),
    ("mean shifted by 0.4", (0.4, 1.0), None, 25),
    ("noise of the turns 1.3 instead of 1", (0.0, 1.3), None, 25),
    ("noise of the turns 1.6 instead of 1", (0.0, 1.6), None, 25),
)


def walk(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return samples (M, 1, 50, 2): steps with the first value as mean, and turns with the second as standard deviation."""
    noise = rng.standard_normal((2, len(values), 50))
    return np.stack([values[:, :1] + noise[0], values[:, 1:] * noise[1]], axis=-1)[:, None]


def p_value(seed: int, model: tuple[float, float], individuals: int | None) -> tuple[float, float]:
    """Test a model against 100 samples of the truth with 80 others kept out; return p-value and accuracy."""
    rng = np.random.default_rng((seed, 5))
    genuine = walk(np.tile(TRUTH, (180, 1)), rng)[:, 0]
    groups = np.arange(80)
    if individuals is not None:
        groups %= individuals
        genuine[100:, :, 0] += 0.3 * rng.normal(size=individuals)[groups, None]
    evidence = Evidence(
        learning=genuine[:100],
        testing=genuine[100:],
        groups=groups,
        grouping="samples" if individuals is None else "individuals",
        simulate=walk,
        classifier=ElmanClassifier(threads=1),
        parameters={"mean": Parameter(-3, 3), "noise": Parameter(0, 3)},
    )
    found = two_sample_test(evidence, np.array(model), EFFORT, seed=seed)
    return found.p_value, found.accuracy


def main() -> None:
    """Print a row of the table for each case."""
    for name, model, individuals, repetitions in CASES:
        p_values, accuracies = np.transpose([p_value(seed, model, individuals) for seed in range(repetitions)])
        shares = [float(np.mean(p_values <= level)) for level in (0.01, 0.05, 0.1)]
        cells = " | ".join(f"{share:.2f}" for share in shares)
        print(f"| {name} | {repetitions} | {cells} | {accuracies.mean():.3f} |", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
