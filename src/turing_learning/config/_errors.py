"""The error of the room, and checks that raise it."""

from typing import Any

from turing_learning.errors import RefusedError, integer


class ConfigurationError(RefusedError):
    """A setting is rejected; the message names what, where, the value, and what to do."""


def require_at_least(least: int, **values: Any) -> None:
    """Reject what is not an integer of at least `least`, by its name."""
    for name, value in values.items():
        integer(name, value, least, error=ConfigurationError)
