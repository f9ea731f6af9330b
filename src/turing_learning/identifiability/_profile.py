"""What happens to the test where a single parameter is moved across its range."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._claims import sides_rejected
from ._evidence import PROFILING, Effort, Evidence, stream
from ._two_sample import paired_test


@dataclass(frozen=True)
class Profile:
    """Fresh classifiers against models that differ from the estimate in one parameter.

    Attributes
    ----------
    parameter
        Its name.
    values
        Values of the parameter, ascending over its initial range, the estimate among them.
    numbers
        The same as numbers from -1 to 1 over the initial range.
    place
        Which of them is the estimate.
    accuracies, criticals
        Of the test at each value, see `TwoSampleTest`.
    rejected
        Whether values below the estimate, and values above it, are told better than it, see `sides_rejected`; None in older checks.
    """

    parameter: str
    values: tuple[float, ...]
    numbers: tuple[float, ...]
    place: int
    accuracies: tuple[float, ...]
    criticals: tuple[float, ...]
    rejected: tuple[bool, bool] | None = None

    @property
    def told_apart(self) -> tuple[bool, ...]:
        """Whether classifiers tell a value from the genuine samples, and better than they tell the estimate."""
        lead = max(0.0, self.accuracies[self.place] - 0.5)
        return tuple(
            accuracy > critical + lead for accuracy, critical in zip(self.accuracies, self.criticals, strict=True)
        )

    @property
    def open_share(self) -> float:
        """Share of the initial range, around the estimate, in which no value is told apart: at most so much is left open."""
        apart = np.flatnonzero(self.told_apart)
        numbers = np.array(self.numbers)
        below, above = numbers[apart[apart < self.place]], numbers[apart[apart > self.place]]
        low = below[-1] if len(below) else min(-1.0, numbers[0])
        high = above[0] if len(above) else max(1.0, numbers[-1])
        return float(min((high - low) / 2, 1.0))

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in vars(self).items()}


def profile(evidence: Evidence, estimate: np.ndarray, place: int, effort: Effort, *, seed: int) -> Profile:
    """Move one parameter across its initial range, and test at each value as at the estimate.

    The other parameters stay where they are. A parameter that only others can make up for looks pinned down here.

    Parameters
    ----------
    evidence
        The samples and the simulator.
    estimate : (P,)
        In the parameters' units.
    place
        Which parameter.
    effort
        How much is simulated and trained, and at how many values.
    seed
        Of all random numbers.
    """
    name, parameter = list(evidence.parameters.items())[place]
    numbers = np.append(np.linspace(-1, 1, effort.points), parameter.to_numbers(estimate[place]))
    order = np.argsort(numbers, kind="stable")
    values = parameter.to_units(numbers[order])
    tests, accuracies = zip(
        *(
            paired_test(
                evidence,
                _moved(estimate, place, value),
                effort,
                seed=seed,
                use=(PROFILING, place, k),
                generations=effort.profile_generations,
                population=effort.profile_population,
            )
            for k, value in enumerate(values.tolist())
        ),
        strict=True,
    )
    here = int(np.flatnonzero(order == effort.points)[0])
    others = np.delete(np.arange(len(values)), here)
    differences = np.array(accuracies)[others] - accuracies[here]
    return Profile(
        parameter=name,
        values=tuple(values.tolist()),
        numbers=tuple(numbers[order].tolist()),
        place=here,
        accuracies=tuple(test.accuracy for test in tests),
        criticals=tuple(test.critical for test in tests),
        rejected=sides_rejected(differences, others > here, stream(seed, PROFILING, place, effort.points + 1)),
    )


def _moved(estimate: np.ndarray, place: int, value: float) -> np.ndarray:
    moved = estimate.copy()
    moved[place] = value
    return moved
