"""Optimizers and classifiers that are not built in: "module:function", or objects that only the calling process has."""

import pickle
from collections.abc import Callable
from inspect import signature
from typing import Any

from turing_learning.errors import brief, refuse, require
from turing_learning.systems import importable_name, imported

from ._sections import GIVEN, ConfigurationError

_objects: dict[str, Any] = {}  # by their names in configurations


def part_named(given: Any) -> str:
    """Return how a configuration names an optimizer or a classifier.

    A name stays as it is. A function or class of a module is "module:function", so that another process can
    import it. Any other object is "given:NAME": it is there in this process alone.
    """
    if isinstance(given, str):
        return given
    if name := importable_name(given):
        return name
    label = getattr(given, "__name__", type(given).__name__)
    name, number = f"{GIVEN}{label}", 2
    while not _same(_objects.setdefault(name, given), given):
        name, number = f"{GIVEN}{label}-{number}", number + 1
    return name


def _same(one: Any, other: Any) -> bool:
    try:
        return one is other or pickle.dumps(one) == pickle.dumps(other)
    except Exception:  # whatever an object raises that cannot be pickled
        return False


def give_again(argument: str, stored: str, given: Any) -> None:
    """Take an object for the part that a stored run had; reject it for a run that did not begin with an object."""
    if given is None:
        return
    if not stored.startswith(GIVEN):
        remedy, same = "Leave it out.", part_named(given) == stored
        require(same, argument, f"be that of the run, {stored!r}", part_named(given), remedy, error=ConfigurationError)
        return
    _objects[stored] = given


def part_of(argument: str, name: str) -> Any:
    """Return the object of a name that is not built in; reject one that has to be given again."""
    if not name.startswith(GIVEN):
        return imported(name, argument, ConfigurationError)
    rule, got = "be given again, as no folder holds an object of Python", f"nothing for {name.removeprefix(GIVEN)!r}"
    remedy = f"Give `{argument}` to `turing_learning.resume` or `turing_learning.load_run`, as the run began with it."
    require(name in _objects, argument, rule, got, remedy, error=ConfigurationError)
    return _objects[name]


def built(argument: str, maker: Callable[..., Any], *given: Any, **options: Any) -> Any:
    """Return what a function makes of a part; reject one that does not take what it is given."""
    try:
        signature(maker).bind(*given, **options)
    except (TypeError, ValueError):  # ValueError: a function in C that does not say what it takes
        rule = f"be a function that takes {', '.join((*['a dimension'] * len(given), *options))}"
        refuse(argument, rule, brief(maker), "See docs/your-own-parts.md.", error=ConfigurationError)
    return maker(*given, **options)
