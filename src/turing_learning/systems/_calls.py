"""Calls of a simulator: by the name that another process imports it by, what is asked, and what comes back."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from traceback import walk_tb
from typing import Any

import numpy as np

from ..errors import RefusedError, brief, require
from ._genuine import with_gaps

_RULE = 'be "module:function", or a function of a module, which another process can import'
_REMEDY = "Define it at the top level of a module, and have the module's folder in PYTHONPATH."

Simulator = Callable[[np.ndarray, np.random.Generator], Any]
"""(parameters (M, P), rng) -> samples (M, T, D) or (M, C, T, D); of one model: (P,) -> (T, D) or (C, T, D)."""


def importable_name(function: Any) -> str | None:
    """Return the name of a function, class or instance of a module, "module:function".

    None where it has none.
    """
    name = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', '')}"
    return name if not name.startswith("__main__:") and _found(name) is function else None


def name_of(
    function: Any, argument: str = "simulate", error: type[RefusedError] = RefusedError
) -> str:
    """Return the name of a function; reject one that cannot be imported by it."""
    name = function if isinstance(function, str) else importable_name(function)
    require(name, argument, _RULE, brief(function), _REMEDY, error=error)
    imported(name, argument, error)
    return str(name)


def imported(
    name: Any, argument: str = "simulate", error: type[RefusedError] = RefusedError
) -> Any:
    """Return the function of a name, "module:function"; reject a name of nothing."""
    found = _found(name)
    got = (
        f"{name!r} ({found})"
        if isinstance(found, Exception)
        else f"{name!r}, a {type(found).__name__}"
    )
    require(callable(found), argument, _RULE, got, _REMEDY, error=error)
    return found


def _found(name: str) -> Any:
    """Return the object of a name, or why there is none."""
    module, _, path = name.partition(":")
    try:
        found: Any = import_module(module)
        for part in path.split("."):
            found = getattr(found, part)
    except Exception as error:  # whatever a module does when it is imported
        return error
    return found


@dataclass(frozen=True)
class Failed:
    """A call that brought no samples, and why."""

    reason: str
    misshapen: bool = False


Answer = np.ndarray | Failed


def answer(
    simulate: Simulator,
    vectorized: bool,
    shape: tuple[int, int],
    parameters: np.ndarray,
    rng: np.random.Generator,
) -> Answer:
    """Call a simulator for models (m, P).

    Return its samples (m, C, T, D), (T, D) being the shape, or why there are none.
    """
    given = parameters.copy()
    try:
        returned = with_gaps(simulate(given if vectorized else given[0], rng))
        if np.iscomplexobj(returned):
            return Failed("it returned complex numbers")
        samples = np.asarray(returned, dtype=np.float64)
    except Exception as error:
        return Failed(f"it raised {type(error).__name__}: {error}{_place(error)}")
    if returned is None:
        return Failed("it returned None")
    samples = samples if vectorized else samples[None]
    if (
        samples.ndim in (3, 4)
        and samples.size
        and (len(samples), *samples.shape[-2:]) == (len(parameters), *shape)
    ):
        return samples.reshape(len(samples), -1, *shape)
    got, rule = samples.shape, f"(M, T, D) = {(len(parameters), *shape)} or (M, C, T, D)"
    if not vectorized:
        got, rule = samples.shape[1:], f"(T, D) = {shape} or (C, T, D)"
    return Failed(f"it returned shape {got} instead of {rule}", misshapen=True)


def _place(error: Exception) -> str:
    """Return file and line where a simulator's own code failed last, nothing if it was not in there."""
    places = [(frame.f_code.co_filename, line) for frame, line in walk_tb(error.__traceback__)]
    own = [
        f" [{path}:{line}]"
        for path, line in places
        if path != __file__ and not path.startswith(sys.prefix)
    ]
    return own[-1] if own else ""
