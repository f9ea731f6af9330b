"""What somebody at the terminal says to an emulated laboratory: the names of faults and of what the operator does."""

import inspect
from collections.abc import Callable
from typing import Any

from ._arena import EmulatedLaboratory

_OTHER_NAMES = {"press-remote": "remote", "put-in-order": "repair"}


def spoken_commands(laboratory: EmulatedLaboratory) -> dict[str, Callable[..., None]]:
    """Return command -> what it does: all that the operator can do by hand, and all faults."""
    found = {
        name.replace("_", "-"): method
        for doors in (laboratory.operator, laboratory.faults)
        for name, method in inspect.getmembers(doors, inspect.ismethod)
        if not name.startswith("_") and name != "ask"
    }
    return {_OTHER_NAMES.get(name, name): method for name, method in found.items()}


def usage(laboratory: EmulatedLaboratory) -> list[tuple[str, str]]:
    """Return each command with its arguments, and what it does."""
    return [
        (" ".join([name, *(word.upper() for word in inspect.signature(method).parameters)]), _first_line(method))
        for name, method in spoken_commands(laboratory).items()
    ]


def obey(laboratory: EmulatedLaboratory, text: str) -> None:
    """Do what a line says: a command and its arguments.

    Raises
    ------
    ValueError
        If it makes no sense, with what would.
    """
    name, *arguments = text.split()
    commands = spoken_commands(laboratory)
    if name not in commands:
        raise ValueError(f"`command` must be one of {', '.join(commands)}; got {name!r}.")
    parameters = inspect.signature(commands[name]).parameters.values()
    least = sum(parameter.default is parameter.empty for parameter in parameters)
    if not least <= len(arguments) <= len(parameters):
        expected = " ".join(parameter.name.upper() for parameter in parameters)
        raise ValueError(f"`{name}` must be followed by {expected or 'nothing'}; got {text.strip()!r}.")
    values = [_value(parameter, word) for parameter, word in zip(parameters, arguments, strict=False)]
    with laboratory.lock:
        commands[name](*values)


def _value(parameter: inspect.Parameter, word: str) -> Any:
    if parameter.annotation is not float:
        return word
    try:
        return float(word)
    except ValueError as error:
        raise ValueError(f"`{parameter.name}` must be a number; got {word!r}.") from error


def _first_line(method: Callable[..., None]) -> str:
    return (inspect.getdoc(method) or "").splitlines()[0]
