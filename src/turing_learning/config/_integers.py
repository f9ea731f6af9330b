"""What a number has to be that counts something."""

from numbers import Integral
from typing import Any

from ._errors import ConfigurationError


def is_integer(value: object) -> bool:
    """Return whether a value is an integer, of Python or NumPy."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def require_at_least(least: int, **values: Any) -> None:
    """Raise ConfigurationError for what is not an integer of at least `least`, by its name."""
    for name, value in values.items():
        if not is_integer(value) or value < least:
            raise ConfigurationError(f"`{name}` must be an integer of at least {least}; got {value!r}.")
