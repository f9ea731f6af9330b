"""The few numbers of every generation that a result is made of; they travel with every checkpoint."""

from collections.abc import Mapping

import numpy as np

from turing_learning.coevolution import Generation

SELECTION_CODES = {"active": 0, "all accepted": 1, "all rejected": 2}
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
    """Best and typical model, state of selection, and seconds of every completed generation.

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
            "selection": np.full(capacity, NOT_RUN, dtype=np.int8),
            "seconds": np.zeros(capacity),
        }

    def record(self, values: Mapping[str, np.ndarray], seconds: float) -> None:
        """Append the `generation_values` of a generation and the time it took (s)."""
        for name, array in self._arrays.items():
            array[self.completed] = seconds if name == "seconds" else values[name]
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
