"""Measure how often the classifier two-sample test rejects a true and a wrong model; the tables of docs/identifiability.md.

Run with ``python docs/identifiability_rates.py``; numbers after it choose cases, counted from 0.
"""

import sys
from dataclasses import dataclass

import numpy as np

from turing_learning.identifiability import Effort, Evidence, two_sample_test
from turing_learning.models import Parameter

EFFORT = Effort(samples=100)
TRUTH = (0.0, 1.0)
LEARNING, TESTING = 100, 80


@dataclass(frozen=True)
class Case:
    """Genuine samples and a model.

    Attributes
    ----------
    name
        In the table.
    repetitions
        Their number.
    model
        Mean of the steps, and standard deviation of the turns.
    learning, testing
        Whose samples they are, by numbers of individuals; nobody's if there are none.
    spread
        Standard deviation of the mean speeds of individuals.
    known
        Whether the simulated samples differ in the same way, each as if of an individual of its own.
    """

    name: str
    repetitions: int
    model: tuple[float, float] = TRUTH
    learning: tuple[int, ...] = ()
    testing: tuple[int, ...] = ()
    spread: float = 0.0
    known: bool = False


def fish(count: int, spread: float, *, apart: bool, known: bool) -> Case:
    """Individuals that differ lastingly: all of them in learning and testing, or the first ones for learning alone."""
    everyone, half = tuple(range(count)), (count + 1) // 2
    return Case(
        name=f"{count}, {spread} | {'others' if apart else 'the same'} | {'with' if known else 'without'} differences",
        repetitions=100,
        learning=everyone[:half] if apart else everyone,
        testing=everyone[half:] if apart else everyone,
        spread=spread,
        known=known,
    )


CASES = (
    Case("the truth", 100),
    Case(
        "the truth, 8 individuals that differ lastingly, met in testing alone",
        100,
        testing=(*range(8),),
        spread=0.3,
    ),
    Case("mean shifted by 0.2", 25, (0.2, 1.0)),
    Case("mean shifted by 0.4", 25, (0.4, 1.0)),
    Case("noise of the turns 1.3 instead of 1", 25, (0.0, 1.3)),
    Case("noise of the turns 1.6 instead of 1", 25, (0.0, 1.6)),
    *(
        fish(count, spread, apart=apart, known=known)
        for known in (False, True)
        for apart in (False, True)
        for spread in (0.3, 0.6)
        for count in (8, 5)
    ),
)


def walk(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return samples (M, 1, 50, 2): steps with the first value as mean, and turns with the second as standard deviation."""
    noise = rng.standard_normal((2, len(values), 50))
    return np.stack([values[:, :1] + noise[0], values[:, 1:] * noise[1]], axis=-1)[:, None]


def p_value(seed: int, case: Case) -> tuple[float, float]:
    """Test a model against 100 samples of the truth with 80 others kept out; return p-value and accuracy."""
    rng = np.random.default_rng((seed, 5))
    genuine = walk(np.tile(TRUTH, (LEARNING + TESTING, 1)), rng)[:, 0]
    groups = np.resize(case.testing or np.arange(TESTING), TESTING)
    if case.testing:
        means = case.spread * rng.normal(size=max(case.testing) + 1)
        genuine[LEARNING:, :, 0] += means[groups, None]
        if case.learning:
            genuine[:LEARNING, :, 0] += means[np.resize(case.learning, LEARNING), None]

    def simulate(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        samples = walk(values, rng)
        if case.known:
            samples[..., 0] += case.spread * rng.normal(size=(len(values), 1, 1))
        return samples

    evidence = Evidence(
        learning=genuine[:LEARNING],
        testing=genuine[LEARNING:],
        groups=groups,
        grouping="individuals" if case.testing else "samples",
        simulate=simulate,
        parameters={"mean": Parameter(-3, 3), "noise": Parameter(0, 3)},
    )
    found = two_sample_test(evidence, np.array(case.model), EFFORT, seed=seed)
    return found.p_value, found.accuracy


def main() -> None:
    """Print a row of the tables for each case."""
    for case in [CASES[int(number)] for number in sys.argv[1:]] or CASES:
        p_values, accuracies = np.transpose(
            [p_value(seed, case) for seed in range(case.repetitions)]
        )
        shares = [float(np.mean(p_values <= level)) for level in (0.01, 0.05, 0.1)]
        cells = " | ".join(f"{share:.2f}" for share in shares)
        row = f"| {case.name} | {case.repetitions} | {cells} | {accuracies.mean():.3f} |"
        print(row, flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
