"""Refusals as data: what must hold, what was given, where, and what to do; said in the words of whoever asks.

Every door of the package rejects values with `require`, `refuse` or one of the checks below. The error carries a `Refusal`, whose
fields the command line renders with the names of its options; from Python the message names arguments.
"""

import difflib
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
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
    """An argument or setting that a remedy or a rule names, with a value if there is one to give."""

    name: str
    value: Any = None


@dataclass(frozen=True)
class Call:
    """A call that a remedy names, for example ``Call("resume", "runs/mine")``: a function of the package and a command."""

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
        return f"`{setting.name}`" if setting.value is None else f"{setting.name}={setting.value!r}"

    def call(self, call: Call) -> str:
        """Return a call in a sentence: ``turing_learning.verb('path', ...)`` in backticks."""
        arguments = [repr(call.path)] if call.path else []
        arguments += [f"{each.name}={'...' if each.value is None else repr(each.value)}" for each in call.more]
        return f"`turing_learning.{call.verb}({', '.join(arguments)})`"


PYTHON = Words()


@dataclass(frozen=True)
class Refusal:
    """Why a value is rejected."""

    name: str  # of an argument, setting or file, in Python
    rule: Text  # what it must do: "be 1 or more", "have the shape (K, T, D)"
    got: str  # what was given
    place: str = ""  # for example "robots.csv:3"; empty if the name says it
    remedy: Text = ""  # what to do, in one or more sentences; empty if the rule says it

    def text(self, words: Words = PYTHON) -> str:
        """Return the message in the words of a door."""
        place, remedy = f" [{self.place}]" if self.place else "", said(self.remedy, words)
        return f"`{words.name(self.name)}` must {said(self.rule, words)}; got {self.got}{place}.{' ' + remedy if remedy else ''}"

    def __str__(self) -> str:
        return self.text()


def said(text: Text, words: Words = PYTHON) -> str:
    """Return a text whose pieces are in the words of a door."""
    pieces = text if isinstance(text, tuple) else (text,)
    return "".join(
        words.setting(piece) if isinstance(piece, Setting) else words.call(piece) if isinstance(piece, Call) else piece
        for piece in pieces
    )


class RefusedError(ValueError):
    """A value is rejected at a door; nothing has been changed. `refusal` says why, None where the message is all there is."""

    def __init__(self, why: Refusal | str) -> None:
        super().__init__(str(why))
        self.refusal = why if isinstance(why, Refusal) else None

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.refusal or str(self),)

    def text(self, words: Words = PYTHON) -> str:
        """Return the message in the words of a door."""
        return self.refusal.text(words) if self.refusal else str(self)


def refuse(
    name: str, rule: Text, got: object, remedy: Text = "", *, place: str = "", error: type[RefusedError] = RefusedError
) -> NoReturn:
    """Reject a value: raise `error` with a `Refusal`. A `got` that is not a string is shown as Python writes it."""
    raise error(Refusal(name, rule, got if isinstance(got, str) else brief(got), place, remedy))


def require(
    holds: object, name: str, rule: Text, got: object, remedy: Text = "", *, place: str = "",
    error: type[RefusedError] = RefusedError,
) -> None:  # fmt: skip
    """Reject a value unless `holds`; a string given as `got` stands as it is, so quote one with ``repr``."""
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
    """Raise what the block rejects as another kind of error, with a place or a name that the block did not know."""
    try:
        yield
    except RefusedError as refused:
        why = refused.refusal
        if isinstance(refused, error) and not (why and (place or name)):
            raise
        if why:
            why = replace(why, name=name or why.name, place=", ".join(filter(None, (why.place, place))))
        raise error(why or str(refused)) from refused
    except ValueError as refused:
        raise error(str(refused)) from refused


class MissingExtraError(ImportError):
    """A library that comes with an extra of the package is not installed."""


def optional(module: str, name: str, extra: str) -> ModuleType:
    """Import a library that comes with an extra; raise `MissingExtraError` with the command that installs it."""
    try:
        return import_module(module)
    except ImportError as error:
        command = f"pip install 'turing-learning[{extra}]'"
        raise MissingExtraError(f"{name} must be installed; got no such module. Run: {command}") from error


def brief(value: object, most: int = 200) -> str:
    """Return a value as Python writes it, cut where it is long; numbers of NumPy as plain ones, arrays by their shape."""
    if hasattr(value, "shape") and getattr(value, "shape", ()) != ():
        return f"an array of shape {tuple(value.shape)}"
    if isinstance(value, int) and abs(value) >= 10**most:
        return "an integer of more than {} digits".format(most)  # noqa: UP032 - the number itself may not be written
    try:
        text = " ".join(repr(value.item() if hasattr(value, "item") else value).split("\n"))
    except Exception:  # a value of the caller's may fail to write itself
        text = f"a {type(value).__name__}"
    return text if len(text) <= most else f"{text[: most - 3]}..."


def nearest(word: str, choices: Iterable[str]) -> str:
    """Return a sentence that names the choice nearest to a misspelt word, or all choices."""
    known = sorted(choices)
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.6) if isinstance(word, str) else []
    return f"Did you mean `{close[0]}`?" if close else f"Choose from: {', '.join(known)}."


def is_integer(value: object) -> bool:
    """Return whether a value is an integer, of Python or NumPy, and no truth value."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def integer(
    name: str, value: Any, least: int = 0, most: int | None = None, *, remedy: Text = "", place: str = "",
    error: type[RefusedError] = RefusedError,
) -> int:  # fmt: skip
    """Return an integer of at least `least`, and at most `most` if given; reject anything else."""
    rule = f"be an integer of at least {least}" if most is None else f"be an integer from {least} to {most}"
    fits = is_integer(value) and value >= least and (most is None or value <= most)
    require(fits, name, rule, brief(value), remedy, place=place, error=error)
    return int(value)


def number(
    name: str, value: Any, *, least: float | None = None, above: float | None = None, most: float | None = None,
    below: float | None = None, remedy: Text = "", place: str = "", error: type[RefusedError] = RefusedError,
) -> float:  # fmt: skip
    """Return a finite number within bounds: `least` and `most` belong to the range, `above` and `below` do not."""
    known = (("of at least", ge, least), ("above", gt, above), ("of at most", le, most), ("below", lt, below))
    bounds = [(word, holds, bound) for word, holds, bound in known if bound is not None]
    rule = f"be a finite number {' and '.join(f'{word} {bound:g}' for word, _, bound in bounds)}"
    try:
        got = float(value) if isinstance(value, Real) and not isinstance(value, bool) else math.nan
    except OverflowError:  # an integer beyond the floats
        got = math.nan
    fits = math.isfinite(got) and all(holds(got, bound) for _, holds, bound in bounds)
    require(fits, name, rule.rstrip(), brief(value), remedy, place=place, error=error)
    return got


def choice(
    name: str, value: Any, choices: Iterable[str], *, noun: str = "", place: str = "",
    error: type[RefusedError] = RefusedError,
) -> str:  # fmt: skip
    """Return one of several names; the message names the nearest. With a `noun` the rule is "be a known <noun>"."""
    known = tuple(choices)
    rule = f"be a known {noun}" if noun else f"be one of {', '.join(known)}"
    remedy = nearest(value, known) if noun else ""
    require(isinstance(value, str) and value in known, name, rule, brief(value), remedy, place=place, error=error)
    return str(value)
