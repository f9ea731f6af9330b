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
from ._per_model import SIMULATED, ColumnsError, column_names, table_values

_RULE = 'be "module:function", or a function of a module, which another process can import'
_REMEDY = "Define it at the top level of a module, and have the module's folder in PYTHONPATH."

Simulator = Callable[[np.ndarray, np.random.Generator], Any]
"""(parameters (M, P), rng) -> samples (M, T, D) or (M, C, T, D); of one model: (P,) -> (T, D) or
(C, T, D)."""


def importable_name(function: Any) -> str | None:
    """Return the name of a function, class or instance of a module, "module:function".

    None where it has none.
    """
    name = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', '')}"
    if name.startswith("__main__:") or _named_object(name) is not function:
        return None
    return name


def name_of(function: Any, error: type[RefusedError] = RefusedError) -> str:
    """Return the name of a function; reject one that cannot be imported by it."""
    name = function
    if not isinstance(function, str):
        name = importable_name(function)
    require(name, "simulate", _RULE, brief(function), _REMEDY, error=error)
    imported(name, error=error)
    return str(name)


def imported(
    name: Any, argument: str = "simulate", error: type[RefusedError] = RefusedError
) -> Any:
    """Return the function of a name, "module:function"; reject a name of nothing."""
    function = _named_object(name)
    got = f"{name!r}, a {type(function).__name__}"
    if isinstance(function, Exception):
        got = f"{name!r} ({function})"
    require(callable(function), argument, _RULE, got, _REMEDY, error=error)
    return function


def _named_object(name: str) -> Any:
    """Return the object of a name, or the exception that says why there is none."""
    module, _, path = name.partition(":")
    try:
        named: Any = import_module(module)
        for attribute in path.split("."):
            named = getattr(named, attribute)
    except Exception as error:
        # Whatever a module does when it is imported
        return error
    return named


@dataclass(frozen=True)
class Failed:
    """A call that brought no samples, and why."""

    reason: str
    misshapen: bool = False
    complete: bool = False  #: Whether the reason is a whole message


Answer = np.ndarray | Failed


def answer(
    simulate: Simulator,
    vectorized: bool,
    shape: tuple[int, int],
    parameters: np.ndarray,
    rng: np.random.Generator,
    names: tuple[str, ...] = (),
) -> Answer:
    """Call a simulator for models (m, P).

    Return its samples (m, C, T, D), (T, D) being the shape, or why there are none. A table
    with names of columns is read by the names of the signals, if these have any.
    """
    # A copy, which the simulator may change.
    models = parameters.copy()
    try:
        returned = with_gaps(simulate(models if vectorized else models[0], rng))
        if names and column_names(returned):
            returned = table_values(returned, names, only=True, place=SIMULATED)
        if np.iscomplexobj(returned):
            return Failed("it returned complex numbers")
        samples = np.asarray(returned, dtype=np.float64)
    except ColumnsError as error:
        return Failed(str(error), complete=True)
    except Exception as error:
        return Failed(f"it raised {type(error).__name__}: {error}{_place(error)}")
    if returned is None:
        return Failed("it returned None")
    expected = (len(parameters), *shape)
    rule = f"(M, T, D) = {expected} or (M, C, T, D)"
    got = samples.shape
    if not vectorized:
        rule = f"(T, D) = {shape} or (C, T, D)"
        samples = samples[None]
    fits = samples.ndim in (3, 4) and samples.size > 0
    if fits and (len(samples), *samples.shape[-2:]) == expected:
        return samples.reshape(len(samples), -1, *shape)
    return Failed(f"it returned shape {got} instead of {rule}", misshapen=True)


def _place(error: Exception) -> str:
    """Return file and line where a simulator's own code failed last, nothing if it was not in there."""
    where = ""
    for frame, line in walk_tb(error.__traceback__):
        path = frame.f_code.co_filename
        if path != __file__ and not path.startswith(sys.prefix):
            where = f" [{path}:{line}]"
    return where
