"""The one error of the room: a setting that is refused, said in one message."""

import difflib
from collections.abc import Iterable


class ConfigurationError(ValueError):
    """A setting is refused; the message names what, where, the value, and what to do."""


def nearest(word: str, choices: Iterable[str]) -> str:
    """Return advice that names the choice nearest to a misspelt word, or all choices.

    Parameters
    ----------
    word
        What was given.
    choices
        What would have been accepted.

    Returns
    -------
    str
        A sentence.
    """
    known = sorted(choices)
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f"Did you mean `{close[0]}`?" if close else f"Choose from: {', '.join(known)}."
