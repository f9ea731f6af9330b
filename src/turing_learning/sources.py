"""The former name of `turing_learning.systems`, and of what is in it."""

from typing import Any

from . import systems
from .systems import _custom, _genuine, _system

_FORMER = {"OwnSource": "CustomSource", "OwnSystem": "CustomSystem", "OwnSystemError": "CustomSystemError"}


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    places = (systems, _custom, _genuine, _system)  # what is private by now stays as well
    return getattr(next((place for place in places if hasattr(place, name)), systems), _FORMER.get(name, name))


def __dir__() -> list[str]:
    return sorted({*_FORMER, *dir(systems)})
