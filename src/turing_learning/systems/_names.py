"""Functions by the names that another process imports them by: "module:function"."""

from importlib import import_module
from typing import Any

from ..errors import RefusedError, brief, require

_RULE = 'be "module:function", or a function of a module, which another process can import'
_REMEDY = "Define it at the top level of a module, and have the module's folder in PYTHONPATH."


def importable_name(function: Any) -> str | None:
    """Return the name of a function, class or instance of a module, "module:function"; None where it has none."""
    name = f"{getattr(function, '__module__', '')}:{getattr(function, '__qualname__', '')}"
    return name if not name.startswith("__main__:") and _found(name) is function else None


def name_of(function: Any, argument: str = "simulate", error: type[RefusedError] = RefusedError) -> str:
    """Return the name of a function; reject one that cannot be imported by it."""
    name = function if isinstance(function, str) else importable_name(function)
    require(name, argument, _RULE, brief(function), _REMEDY, error=error)
    imported(name, argument, error)
    return str(name)


def imported(name: Any, argument: str = "simulate", error: type[RefusedError] = RefusedError) -> Any:
    """Return the function of a name, "module:function"; reject a name of nothing."""
    found = _found(name)
    got = f"{name!r} ({found})" if isinstance(found, Exception) else f"{name!r}, a {type(found).__name__}"
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
