"""A configuration as single settings."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from turing_learning.errors import brief, refuse, require

from ._configuration import Configuration
from ._sections import ConfigurationError


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


def stated_once(statements: Iterable[tuple[str, Any, str]]) -> dict[str, Any]:
    """Return settings that may have been given in several ways, for example by an option and by its key.

    Parameters
    ----------
    statements
        (dotted key, value, how it was given) of each; a value may be a table, whose settings have the keys below it.

    Returns
    -------
    dict
        Dotted key -> value.
    """
    found: dict[str, tuple[Any, str]] = {}
    for name, given, words in statements:
        for key, value in (dotted({name: given}) or {name: given}).items():
            known, before = found.setdefault(key, (value, words))
            if known is not value and known != value:
                got = f"{before} and {words}"
                refuse(key, "be given once", got, "Leave one of them out.", error=ConfigurationError)
    return {key: value for key, (value, _) in found.items()}


def single_settings(settings: Mapping[str, Any] | None, **arguments: Any) -> dict[str, Any]:
    """Return dotted key -> value of settings, and of arguments that set a run's fields of the same name unless they are None."""
    if not isinstance(settings, Mapping | None) or not all(isinstance(key, str) for key in settings or {}):
        example = 'For example {"models.population": 60, "run.checkpoint_every": 10}.'
        refuse("settings", "be a dict dotted key -> value", brief(settings), example, error=ConfigurationError)
    both = arguments.get("trials"), arguments.get("generations")
    got = f"{brief(both[0])} beside {brief(both[1])}"
    require(any(one is None for one in both), "trials", "be given without `generations`", got, error=ConfigurationError)
    said = [(f"run.{name}", value, f"{name}={brief(value)}") for name, value in arguments.items() if value is not None]
    said += [(key, value, f"settings={{{key!r}: {brief(value)}}}") for key, value in (settings or {}).items()]
    return stated_once(said)
