"""Options and settings that several commands share."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from ._numbers import integer

PresetOption = Annotated[
    str, typer.Option("--preset", metavar="NAME", help='"default", or "paper" to keep to the text of the paper.')
]
GenerationsOption = Annotated[
    str | None,
    typer.Option("--generations", metavar="G", help="Number of generations; 1000 by default."),
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Any setting, for example models.parents=20. Repeatable."),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        "--threads",
        metavar="N",
        help="Number of threads; all by default. The result does not depend on it.",
        parser=integer,
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(
        "--workers",
        metavar="N",
        help="Number of worker processes; one for each processor by default.",
        parser=integer,
    ),
]


def settings_of(settings: list[str] | None, options: Mapping[str, str | None]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return dotted key -> value, and dotted key -> where it was given, of --set texts and of the options for some keys."""
    from turing_learning.config import stated_once

    given = {key: text for key, text in options.items() if text is not None}
    said = [(key, toml_value(text), f"--{key.removeprefix('run.')} {text}") for key, text in given.items()]
    said += [(key, value, f"--set {key}={value}") for key, value in parsed(settings or [])]
    values = stated_once(said)
    return values, {key: f"--{key.removeprefix('run.')}" if key in given else f"--set {key}" for key in values}


def require_scenario(scenario: str | None, config: Path | None, names: Iterable[str]) -> None:
    """Refuse a command line that says nowhere what is to run."""
    from turing_learning.config import ConfigurationError

    if scenario is None and config is None:
        raise ConfigurationError(
            f"`SCENARIO` must be given, or a file with --config; got neither. Choose from: {', '.join(names)}."
        )


def parsed(settings: list[str]) -> list[tuple[str, Any]]:
    """Return dotted keys and values of KEY=VALUE texts; a value that is not TOML is a text."""
    from turing_learning.config import ConfigurationError

    values = []
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip():
            raise ConfigurationError(
                f"`--set` must be KEY=VALUE; got {setting!r}. For example: --set models.parents=20"
            )
        values.append((key.strip(), toml_value(text)))
    return values


def toml_value(text: str) -> Any:
    """Return the value that a text is in TOML, or else the text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
