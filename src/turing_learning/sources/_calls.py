"""Calls of a simulator: what is asked, what comes back, and doing it in this process."""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ._masked import with_gaps

Simulator = Callable[[np.ndarray, np.random.Generator], Any]
"""(parameters (M, P), rng) -> samples (M, T, D) or (M, C, T, D); of one model: (P,) -> (T, D) or (C, T, D)."""


@dataclass(frozen=True, eq=False)
class Call:
    """One call of a simulator: parameters (m, P) of its models and a generator of its own."""

    parameters: np.ndarray
    rng: np.random.Generator


@dataclass(frozen=True)
class Failed:
    """A call that brought no samples, and why."""

    reason: str
    misshapen: bool = False


Answer = np.ndarray | Failed


class Runner(Protocol):
    """Executes calls."""

    def run(self, calls: Sequence[Call]) -> Iterator[Answer]:
        """Yield the answers in the order of the calls."""

    def close(self) -> None:
        """Give back what was taken."""


def answer(simulate: Simulator, call: Call, vectorized: bool) -> Answer:
    """Call a simulator; return what it returns as an array, with the models first, or why there is none."""
    given = call.parameters.copy()
    try:
        returned = with_gaps(simulate(given if vectorized else given[0], call.rng))
        if np.iscomplexobj(returned):
            return Failed("it returned complex numbers")
        samples = np.asarray(returned, dtype=np.float64)
    except Exception as error:
        return Failed(f"it raised {type(error).__name__}: {error}{_place(error)}")
    if returned is None:
        return Failed("it returned None")
    return samples if vectorized else samples[None]


def _place(error: Exception) -> str:
    """Return file and line where a simulator's own code failed last, nothing if it was not in there."""
    traceback, place = error.__traceback__, ""
    while traceback is not None:
        path = traceback.tb_frame.f_code.co_filename
        if path != __file__ and not path.startswith(sys.prefix):
            place = f" [{path}:{traceback.tb_lineno}]"
        traceback = traceback.tb_next
    return place


class InProcess:
    """Call a simulator here, one call after the other.

    Parameters
    ----------
    simulate
        The simulator.
    vectorized
        Whether it takes several models at once.
    """

    def __init__(self, simulate: Simulator, *, vectorized: bool) -> None:
        self._simulate = simulate
        self._vectorized = vectorized

    def run(self, calls: Sequence[Call]) -> Iterator[Answer]:
        """Yield the answers in the order of the calls."""
        return (answer(self._simulate, call, self._vectorized) for call in calls)

    def close(self) -> None:
        """Do nothing."""
