"""A configuration as single settings."""

import json
from collections.abc import Mapping
from typing import Any

from ._sections import Configuration


def flat_settings(configuration: Configuration) -> dict[str, Any]:
    """Return every setting of a configuration: dotted key -> value, lists for tuples."""
    return dotted(configuration.model_dump(mode="json"))


def with_settings(configuration: Configuration, settings: Mapping[str, Any]) -> Configuration:
    """Return a configuration with some settings replaced.

    Parameters
    ----------
    configuration
        Resolved.
    settings
        Dotted key -> value, as `flat_settings` gives them.

    Raises
    ------
    ValueError
        If a setting is unknown or breaks a rule.
    """
    data = configuration.model_dump(mode="json")
    for key, value in settings.items():
        *tables, name = key.split(".")
        table = data
        for part in tables:
            table = table.setdefault(part, {})
        table[name] = value
    return type(configuration).model_validate_json(json.dumps(data), strict=True)


def dotted(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of nested tables by dotted keys, in their order."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= dotted(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat
