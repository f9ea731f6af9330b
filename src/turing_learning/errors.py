"""Refusals as data: what must hold, what was given, where, and what to do.

The doors of the package are where values enter: Python functions, the command line, files. Every
door rejects values with
`require`, `refuse` or one of the checks below. The error carries a `Refusal`. Its message names
arguments of Python; the command line writes it again with the names of its options (`Words`).
"""

import difflib
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from numbers import Integral, Real
from operator import ge, gt, le, lt
from types import ModuleType
from typing import Any, NoReturn

LARGEST_COUNT = 10**12
"""Of things that memory holds: more than any has room for, fewer than NumPy can count."""


@dataclass(frozen=True)
class Setting:
    """An argument or setting that a rule or a remedy names, with the value to set, if any."""

    name: str
    value: Any = None


@dataclass(frozen=True)
class Call:
    """A call that a remedy names, for example ``Call("resume", "runs/mine")``: a function and a command."""

    verb: str
    path: str
    more: tuple[Setting, ...] = ()


Text = str | Setting | Call | tuple[str | Setting | Call, ...]
"""A sentence; or pieces of one, some of which each door says in its own words."""


class Words:
    """How a door names arguments, settings and calls; these are the words of Python."""

    def name(self, name: str) -> str:
        """Return what stands in backticks at the beginning of a message."""
        return name

    def setting(self, setting: Setting) -> str:
        """Return a setting in a sentence: its name in backticks, or ``name=value``."""
        if setting.value is None:
            return f"`{setting.name}`"
        return f"{setting.name}={setting.value!r}"

    def call(self, call: Call) -> str:
        """Return a call in a sentence: ``turing_learning.verb('path', ...)`` in backticks."""
        arguments = []
        if call.path:
            arguments.append(repr(call.path))
        for setting in call.more:
            value = "..." if setting.value is None else repr(setting.value)
            arguments.append(f"{setting.name}={value}")
        return f"`turing_learning.{call.verb}({', '.join(arguments)})`"


PYTHON = Words()


@dataclass(frozen=True)
class Refusal:
    """Why a value is rejected."""

    name: str  # of an argument, setting or file, in Python
    rule: Text  # what it must do: "be 1 or more", "have the shape (K, T, D)"
    got: str  # what was given
    place: str = ""  # for example "robots.csv:3"; empty if the name says it
    # What to do, in one or more sentences; empty if the rule says it
    remedy: Text = ""

    def text(self, words: Words = PYTHON) -> str:
        """Return the message in the words of a door."""
        message = f"`{words.name(self.name)}` must {in_words(self.rule, words)}; got {self.got}"
        if self.place:
            message += f" [{self.place}]"
        message += "."
        if self.remedy:
            message += f" {in_words(self.remedy, words)}"
        return message

    def __str__(self) -> str:
        return self.text()


def in_words(text: Text, words: Words = PYTHON) -> str:
    """Return a text whose settings and calls are in the words of a door."""
    if not isinstance(text, tuple):
        text = (text,)
    sentence = ""
    for piece in text:
        if isinstance(piece, Setting):
            sentence += words.setting(piece)
        elif isinstance(piece, Call):
            sentence += words.call(piece)
        else:
            sentence += piece
    return sentence


class RefusedError(ValueError):
    """A value is rejected at a door; nothing has been changed.

    `refusal` says why; it is None where the message is all there is.
    """

    def __init__(self, why: Refusal | str) -> None:
        super().__init__(str(why))
        self.refusal = why if isinstance(why, Refusal) else None

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.refusal or str(self),)

    def text(self, words: Words = PYTHON) -> str:
        """Return the message in the words of a door."""
        if self.refusal:
            return self.refusal.text(words)
        return str(self)


def refuse(
    name: str,
    rule: Text,
    got: object,
    remedy: Text = "",
    *,
    place: str = "",
    error: type[RefusedError] = RefusedError,
) -> NoReturn:
    """Reject a value: raise `error` with a `Refusal`.

    A `got` that is not a string is shown as Python writes it.
    """
    if not isinstance(got, str):
        got = brief(got)
    raise error(Refusal(name, rule, got, place, remedy))


def require(
    holds: object,
    name: str,
    rule: Text,
    got: object,
    remedy: Text = "",
    *,
    place: str = "",
    error: type[RefusedError] = RefusedError,
) -> None:
    """Reject a value unless `holds`.

    A string given as `got` stands as it is, so quote one with ``repr``.
    """
    if not holds:
        refuse(name, rule, got, remedy, place=place, error=error)


class ConfigurationError(RefusedError):
    """A setting is rejected; the message names what, where, the value, and what to do."""


check = partial(require, error=ConfigurationError)
"""Reject a setting unless it `holds`, as `require` does."""

reject = partial(refuse, error=ConfigurationError)
"""Reject a setting, as `refuse` does."""


@contextmanager
def refusing_as(error: type[RefusedError], *, name: str = "", place: str = "") -> Iterator[None]:
    """Raise what the block rejects as another `error`, with a `place` or `name` that the block did not know."""
    try:
        yield
    except RefusedError as refused:
        refusal = refused.refusal
        if refusal is None:
            if isinstance(refused, error):
                raise
            raise error(str(refused)) from refused
        if isinstance(refused, error) and not (place or name):
            raise
        labels = filter(None, (refusal.place, place))
        raise error(
            replace(refusal, name=name or refusal.name, place=", ".join(labels))
        ) from refused
    except ValueError as refused:
        raise error(str(refused)) from refused


class MissingExtraError(ImportError):
    """A library that comes with an extra of the package is not installed."""


def optional(module: str, name: str, extra: str) -> ModuleType:
    """Import a library that comes with an extra.

    Raise `MissingExtraError` with the command that installs it.
    """
    require_extras((module, name, extra))
    return import_module(module)


def require_extras(*libraries: tuple[str, str, str]) -> None:
    """Raise `MissingExtraError` unless all libraries (module, name, extra) are installed.

    One command installs them all.
    """
    names = []
    extras = []
    for module, name, extra in libraries:
        try:
            import_module(module)
        except ImportError:
            names.append(name)
            extras.append(extra)
    if names:
        modules = "module" if len(names) == 1 else "modules"
        command = f"pip install 'turing-learning[{','.join(extras)}]'"
        raise MissingExtraError(
            f"{' and '.join(names)} must be installed; got no such {modules}. Run: {command}"
        )


def brief(value: object, most: int = 200) -> str:
    """Return a value as Python writes it, cut to `most` characters.

    Numbers of NumPy are written as plain ones, arrays by their shape.
    """
    if hasattr(value, "shape") and getattr(value, "shape", ()) != ():
        return f"an array of shape {tuple(value.shape)}"
    if isinstance(value, int) and abs(value) >= 10**most:
        # Python refuses to write such a number.
        return "an integer of more than {} digits".format(most)  # noqa: UP032
    try:
        if hasattr(value, "item"):
            value = value.item()
        text = " ".join(repr(value).split("\n"))
    except Exception:
        # A value of the caller's may fail to write itself
        text = f"a {type(value).__name__}"
    if len(text) > most:
        text = f"{text[: most - 3]}..."
    return text


def nearest(word: str, choices: Iterable[str]) -> str:
    """Return a sentence that names the choice nearest to a misspelt word, or all choices."""
    names = sorted(choices)
    similar = []
    if isinstance(word, str):
        similar = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    if similar:
        return f"Did you mean `{similar[0]}`?"
    return f"Choose from: {', '.join(names)}."


def is_integer(value: object) -> bool:
    """Return whether a value is an integer, of Python or NumPy, and no truth value."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def integer(
    name: str,
    value: Any,
    least: int = 0,
    most: int | None = None,
    *,
    remedy: Text = "",
    place: str = "",
    error: type[RefusedError] = RefusedError,
) -> int:
    """Return an integer of at least `least`, and at most `most` if given; reject anything else."""
    if is_integer(value) and value >= least and (most is None or value <= most):
        return int(value)
    rule = f"be an integer of at least {least}"
    if most is not None:
        rule = f"be an integer from {least} to {most}"
    refuse(name, rule, brief(value), remedy, place=place, error=error)


def number(
    name: str,
    value: Any,
    *,
    least: float | None = None,
    above: float | None = None,
    most: float | None = None,
    below: float | None = None,
    place: str = "",
    error: type[RefusedError] = RefusedError,
) -> float:
    """Return a finite number within bounds.

    `least` and `most` belong to the range, `above` and `below` do not.
    """
    converted = math.nan
    if isinstance(value, Real) and not isinstance(value, bool):
        # an integer beyond the floats
        with suppress(OverflowError):
            converted = float(value)
    bounds = (
        ("of at least", ge, least),
        ("above", gt, above),
        ("of at most", le, most),
        ("below", lt, below),
    )
    fits = math.isfinite(converted)
    for _, holds, bound in bounds:
        fits = fits and (bound is None or holds(converted, bound))
    if fits:
        return converted
    rules = [f"{words} {bound:g}" for words, _, bound in bounds if bound is not None]
    rule = f"be a finite number {' and '.join(rules)}".rstrip()
    refuse(name, rule, brief(value), place=place, error=error)


def choice(
    name: str,
    value: Any,
    choices: Iterable[str],
    *,
    noun: str = "",
    place: str = "",
    error: type[RefusedError] = RefusedError,
) -> str:
    """Return one of several names.

    With a `noun` the rule is "be a known <noun>", and the remedy names the nearest choice.
    """
    names = tuple(choices)
    rule = f"be one of {', '.join(names)}"
    remedy = ""
    if noun:
        rule = f"be a known {noun}"
        remedy = nearest(value, names)
    fits = isinstance(value, str) and value in names
    require(fits, name, rule, brief(value), remedy, place=place, error=error)
    return str(value)
