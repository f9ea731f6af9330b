"""Custom systems in a study: their samples are in its folder, their simulator is a name that a worker can import."""

from importlib import import_module
from typing import Any

from turing_learning.config import ConfigurationError
from turing_learning.errors import brief, require

_RULE = 'be "module:function", or a function of a module, which another process can import'
_REMEDY = "Define it at the top level of a module, and have the module's folder in PYTHONPATH."


def name_of(simulate: Any) -> str:
    """Return the name of a simulator, "module:function"; reject one that cannot be imported by it."""
    name = simulate
    if not isinstance(simulate, str):
        name = f"{getattr(simulate, '__module__', '')}:{getattr(simulate, '__qualname__', '')}"
        fits = name.startswith("__main__:") is False and _found(name) is simulate
        require(fits, "simulate", _RULE, brief(simulate), _REMEDY, error=ConfigurationError)
    imported(name)
    return name


def imported(name: str) -> Any:
    """Return the simulator of a name, "module:function"; raises ConfigurationError if there is none."""
    found = _found(name)
    got = f"{name!r} ({found})" if isinstance(found, Exception) else f"{name!r}, a {type(found).__name__}"
    require(callable(found), "simulate", _RULE, got, _REMEDY, error=ConfigurationError)
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
