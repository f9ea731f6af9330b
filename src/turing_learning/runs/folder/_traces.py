"""The few numbers of every generation that a result is made of; they travel with every checkpoint."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from turing_learning.coevolution import Generation

SELECTION_CODES = {"active": 0, "all accepted": 1, "all rejected": 2}
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)
NOT_RUN = -1  # the code of generations that have not been run


def generation_values(generation: Generation) -> dict[str, np.ndarray]:
    """Return all that is kept of a generation, by the names of the history."""
    return {
        "model": generation.models,
        "model_step_size": generation.model_step_sizes,
        "model_fitness": generation.model_fitness,
        "classifier": generation.classifiers,
        "classifier_step_size": generation.classifier_step_sizes,
        "classifier_fitness": generation.classifier_fitness,
        "best_model": generation.best_model,
        "typical_model": generation.typical_model,
        "selection": np.array(SELECTION_CODES[generation.selection], dtype=np.int8),
    }


class Traces:
    """What a thin history keeps of every completed generation, and the seconds it took.

    Best and typical model, quartiles of both populations' fitness, and the state of selection.

    Parameters
    ----------
    capacity
        Number of generations G that there may be.
    parameters
        Number of model parameters P.
    """

    def __init__(self, capacity: int, parameters: int) -> None:
        self.completed = 0
        self._arrays: dict[str, np.ndarray] = {
            "best_model": np.zeros((capacity, parameters)),
            "typical_model": np.zeros((capacity, parameters)),
            "model_fitness_quantiles": np.zeros((capacity, len(QUANTILES))),
            "classifier_fitness_quantiles": np.zeros((capacity, len(QUANTILES))),
            "selection": np.full(capacity, NOT_RUN, dtype=np.int8),
            "seconds": np.zeros(capacity),
        }

    def record(self, values: Mapping[str, np.ndarray], seconds: float) -> None:
        """Append the `generation_values` of a generation and the time it took (s)."""
        given: dict[str, Any] = {**values, "seconds": seconds}
        for population in ("model", "classifier"):
            given[f"{population}_fitness_quantiles"] = _quantiles(given[f"{population}_fitness"])
        for name, array in self._arrays.items():
            array[self.completed] = given[name]
        self.completed += 1

    def __getitem__(self, name: str) -> np.ndarray:
        """Return an array over the completed generations, a view."""
        return self._arrays[name][: self.completed]

    def state(self) -> dict[str, np.ndarray]:
        """Return copies of all arrays over the completed generations."""
        return {name: self[name].copy() for name in self._arrays}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a `state`."""
        self.completed = len(state["seconds"])
        for name, array in self._arrays.items():
            array[: self.completed] = state[name]


def _quantiles(values: np.ndarray) -> np.ndarray:
    """Return the `QUANTILES` as `numpy.quantile` does, for less than its overhead."""
    places = np.multiply(QUANTILES, len(values) - 1)
    return np.interp(places, np.arange(len(values)), np.sort(values))
