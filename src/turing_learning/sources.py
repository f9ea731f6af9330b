"""The former name of `turing_learning.systems`, and of what is in it."""

from typing import Any

from . import systems

_FORMER = {"OwnSource": "CustomSource", "OwnSystem": "CustomSystem", "OwnSystemError": "CustomSystemError"}


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return getattr(systems, _FORMER.get(name, name))


def __dir__() -> list[str]:
    return sorted({*_FORMER, *dir(systems)})
