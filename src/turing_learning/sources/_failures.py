"""Which simulations failed, and why."""

from collections.abc import Mapping
from typing import Any

import numpy as np

MOST_LISTED = 100
LONGEST_REASON = 300  # characters


class FailureLog:
    """Failed simulations of a run: all of them counted, the first hundred listed.

    Parameters
    ----------
    names
        Names of the P model parameters.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.count = 0
        self._names = names
        self._listed: list[tuple[int, tuple[float, ...], str]] = []

    def add(self, generation: int | None, parameters: np.ndarray, reason: str) -> None:
        """Count a failure of a model with parameters (P,), and list it if it is of a generation."""
        self.count += 1
        if generation is not None and len(self._listed) < MOST_LISTED:
            self._listed.append((generation, tuple(parameters.tolist()), reason[:LONGEST_REASON]))

    def summary(self) -> dict[str, Any]:
        """Return what a result says: the number of failures, and the first ones by generation, parameters and reason."""
        listed = [
            {"generation": generation, "parameters": dict(zip(self._names, values, strict=True)), "reason": reason}
            for generation, values, reason in self._listed
        ]
        return {"count": self.count, "listed": listed}

    def state(self) -> dict[str, np.ndarray]:
        """Return everything as arrays, without Python objects."""
        generations, parameters, reasons = zip(*self._listed, strict=True) if self._listed else ((), (), ())
        return {
            "count": np.array(self.count, dtype=np.int64),
            "generations": np.array(generations, dtype=np.int64),
            "parameters": np.array(parameters, dtype=np.float64).reshape(len(parameters), len(self._names)),
            "reasons": np.array(reasons, dtype=f"<U{LONGEST_REASON}"),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a `state`."""
        rows = (state[name].tolist() for name in ("generations", "parameters", "reasons"))
        self.count = int(state["count"])
        self._listed = [(generation, tuple(values), reason) for generation, values, reason in zip(*rows, strict=True)]
