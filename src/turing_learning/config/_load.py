"""Resolve a configuration from a preset, a file and single settings; every refusal is one message."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
from pydantic import BaseModel, ValidationError

from turing_learning.sources import OwnSystem
from turing_learning.swarm import SCENARIOS, Scenario

from ._errors import ConfigurationError, nearest
from ._sections import Configuration, OwnConfiguration, PopulationSection
from ._toml import UNBOUNDED, line_of, read_toml

PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "paper": {
        "models": {
            "minimum_step_size": 0.0,
            "recombination": 1.0,
            "redraw": 0.0,
            "exchange": 0.0,
            "intermediate": False,
            "memory": 0.0,
        },
        "classifiers": {"minimum_step_size": 0.0, "renewal": 0},
        "coevolution": {"archive": 0},
    },
}
"""What each preset changes: "paper" keeps to the text of the paper, which has no floor under the step sizes, no archive of
past classifiers and no renewal of the present ones, children that recombine in one way only, no jumps and no memory of fitness."""

DEFAULT_SCENARIO = "aggregation"
"""What runs where neither a scenario nor a file is given."""

STUDY_TABLES = ("grid", "list")
"""What a file says of a study; see `load_variants`."""

_OF_OWN_SYSTEMS = {"parameters", "signals", "digest"}  # what only their tables have

_RULES = {
    "run.threads": '"all" or an integer of at least 1',
    "classifiers.input_scale": '"robot" or a list of positive numbers',
}  # settings of several types: what to say instead of the first type's complaint


@dataclass(frozen=True)
class Origins:
    """Where each setting comes from, for messages."""

    path: Path | None = None
    text: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)

    def where(self, key: str) -> str:
        """Return where a setting comes from, in brackets, or nothing."""
        for label_key in _ancestors(key):
            if label_key in self.labels:
                return f" [{self.labels[label_key]}]"
        for label_key, label in self.labels.items():
            if label_key.startswith(f"{key}."):
                return f" [{label}]"
        line = line_of(self.text, key)
        return f" [{self.path}:{line}]" if line else ""


def load_configuration(
    path: str | Path | None = None,
    preset: str = "default",
    overrides: Mapping[str, Any] | None = None,
    *,
    scenario: str | Scenario | OwnSystem | None = None,
    labels: Mapping[str, str] | None = None,
) -> Configuration:
    """Resolve a configuration: the preset, over it the file, over that single settings.

    Parameters
    ----------
    path
        A TOML file; see `to_toml` for all it may say. ``scenario = "NAME"`` takes a known scenario; below ``[scenario]``,
        ``name`` (or ``preset``, where the name is to be another) takes the fields of a known scenario that the table does not
        give. See docs/scenarios.md.
    preset
        One of `PRESETS`.
    overrides
        Dotted key -> value, for example ``{"run.generations": 100}``.
    scenario
        A scenario or the name of one; where the file names one as well, both must agree. A file that names none needs it;
        without a file it is "aggregation". With a system of one's own the file has none.
    labels
        Dotted key -> where an override comes from, for messages, for example ``{"run.seed": "--seed"}``.

    Returns
    -------
    Configuration
        Every field explicit and valid; an `OwnConfiguration` for a system of one's own.

    Raises
    ------
    ConfigurationError
        If anything is refused; one message that says what, where, the value and what to do.
    """
    text, document = ("", {}) if path is None else read_toml(Path(path))
    origins = Origins(None if path is None else Path(path), text, _labels(overrides, labels))
    refuse_study(document, origins)
    return resolve(merged(preset_named(preset), document), overrides or {}, scenario, origins)


def preset_named(name: str) -> dict[str, Any]:
    """Return what a preset changes.

    Raises
    ------
    ConfigurationError
        If there is none of that name.
    """
    if not isinstance(name, str) or name not in PRESETS:
        raise ConfigurationError(f"`preset` must be a known preset; got {name!r}. {nearest(str(name), PRESETS)}")
    return PRESETS[name]


def refuse_study(document: Mapping[str, Any], origins: Origins) -> None:
    """Raise ConfigurationError if a file describes a study."""
    for key in STUDY_TABLES:
        if key in document:
            raise ConfigurationError(
                f"`{key}` must be left out of the configuration of a single run; got one{origins.where(key)}. "
                "Run the file as a study: `turing-learning study --config FILE`."
            )


def resolve(
    document: Mapping[str, Any],
    overrides: Mapping[str, Any],
    scenario: str | Scenario | OwnSystem | None,
    origins: Origins,
) -> Configuration:
    """Return the configuration of a document with single settings over it; see `load_configuration`."""
    _refuse_values_of_tables(document, origins)
    data = merged(document, _nested(overrides))
    given = data.get("scenario")
    data["scenario"] = _scenario_data(given, scenario, origins)
    kind = OwnConfiguration if set(data["scenario"]) >= _OF_OWN_SYSTEMS else Configuration
    if kind is OwnConfiguration:
        data["classifiers"] = _with_scale_of_data(data)
    _refuse_unknown_keys(data, origins, kind)
    _refuse_unnamed(given, scenario, origins)
    for section in ("models", "classifiers"):
        if isinstance(data.get(section), Mapping) and "population" in data[section]:
            data[section] = _split_population(data[section], section, origins)
    return _validated(data, origins, kind)


def _with_scale_of_data(data: Mapping[str, Any]) -> dict[str, Any]:
    section = data.get("classifiers", {})
    scale = section.get("input_scale", "robot")
    return {**section, "input_scale": data["scenario"].get("input_scale") if scale == "robot" else scale}


def _labels(overrides: Mapping[str, Any] | None, labels: Mapping[str, str] | None) -> dict[str, str]:
    return {key: f"override {key}" for key in overrides or {}} | dict(labels or {})


def _ancestors(key: str) -> Iterator[str]:
    while key:
        yield key
        key = key.rpartition(".")[0]


def _nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in flat.items():
        *tables, name = key.split(".")
        table = result
        for part in tables:
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                raise ConfigurationError(
                    f"`{key}` must be a setting of its own; got {part!r} both as a table and as a value. Leave one out."
                )
        table[name] = value
    return result


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with another over it, table by table."""
    result = dict(base)
    for key, value in over.items():
        below = result.get(key)
        if key == "scenario" and isinstance(below, str) and isinstance(value, Mapping):
            below = {"preset": below}
        both = isinstance(below, Mapping) and isinstance(value, Mapping)
        result[key] = merged(below, value) if both else value  # type: ignore[arg-type]
    return result


def _scenario_data(given: Any, asked: str | Scenario | OwnSystem | None, origins: Origins) -> dict[str, Any]:
    if isinstance(asked, OwnSystem):
        return _own_system_data(given, asked, origins)
    if not isinstance(given, str | Mapping | None):
        raise ConfigurationError(
            f"`scenario` must be a name or a table; got {given!r}{origins.where('scenario')}. "
            f'Write scenario = "{DEFAULT_SCENARIO}", for example.'
        )
    table = {"preset": given} if isinstance(given, str) else dict(given or {})
    named = table.pop("preset", None)
    base = _base_scenario(named, table.get("name"), asked, origins)
    return _without_unbounded(merged(base, table))


def _own_system_data(given: Any, asked: OwnSystem, origins: Origins) -> dict[str, Any]:
    if given is not None:
        raise ConfigurationError(
            f"`scenario` must be left out for a system of one's own; got {_shown(given)}{origins.where('scenario')}. "
            "Remove it; all other sections count."
        )
    return asdict(asked)


def _base_scenario(named: Any, name: Any, asked: str | Scenario | None, origins: Origins) -> dict[str, Any]:
    """Return the scenario whose fields a table changes: by argument, `preset` or `name`; nothing for one of another name."""
    if named is not None:
        _known_scenario(named, origins.where("scenario.preset"))
        _refuse_name_of_another(named, name, origins)
    if isinstance(asked, Scenario):
        return asdict(asked)
    if asked is not None:
        _known_scenario(asked, origins.where("scenario"))
        other = named or name
        if other not in (None, asked):
            raise ConfigurationError(
                f"`scenario` must be the same everywhere; got {asked!r} as an argument and {other!r}"
                f"{origins.where('scenario.name' if named is None else 'scenario.preset')}. Leave one of them out."
            )
    base = next((each for each in (named, asked, name) if each is not None), DEFAULT_SCENARIO)
    return asdict(SCENARIOS[base]) if isinstance(base, str) and base in SCENARIOS else {}


def _refuse_unnamed(given: Any, asked: str | Scenario | OwnSystem | None, origins: Origins) -> None:
    """Refuse a file with which nothing says what is to run."""
    named = given if isinstance(given, str) else {"name", "preset"} & set(given or {})
    if not named and asked is None and origins.path is not None:
        raise ConfigurationError(
            f"`scenario` must be named, in the file or as an argument; got neither [{origins.path}]. Write "
            f'scenario = "{DEFAULT_SCENARIO}", or [scenario] and name = "{DEFAULT_SCENARIO}" below it. {nearest("", SCENARIOS)}'
        )


def _refuse_name_of_another(named: str, name: Any, origins: Origins) -> None:
    if isinstance(name, str) and name in SCENARIOS and name != named:
        raise ConfigurationError(
            f"`scenario.name` must be that of the preset, {named!r}, or one of your own; got {name!r}"
            f"{origins.where('scenario.name')}. Leave one of them out."
        )


def _known_scenario(name: Any, where: str) -> None:
    if not isinstance(name, str) or name not in SCENARIOS:
        raise ConfigurationError(
            f"`scenario` must be a known scenario; got {name!r}{where}. {nearest(str(name), SCENARIOS)}"
        )


def _without_unbounded(scenario: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario in which None stands for the missing sides of an arena, and of the ranges of own parameters."""
    arena, parameters = scenario.get("arena"), scenario.get("parameters")
    if isinstance(arena, Mapping):
        scenario = {**scenario, "arena": _sides(arena)}
    if isinstance(parameters, Mapping):
        ranges = {name: _sides(one) if isinstance(one, Mapping) else one for name, one in parameters.items()}
        scenario = {**scenario, "parameters": ranges}
    return scenario


def _sides(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: None if side == UNBOUNDED else side for key, side in table.items()}


def _children(kind: Any) -> dict[str, Any]:
    """Return the keys a section may have, each with its type."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        known = {name: info.annotation for name, info in kind.model_fields.items()}
        return known | ({"population": int} if issubclass(kind, PopulationSection) else {})
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return {item.name: hints[item.name] for item in fields(kind)}
    return {}


def _all_keys(kind: Any, prefix: str = "") -> Iterator[str]:
    for name, child in _children(kind).items():
        yield prefix + name
        yield from _all_keys(child, f"{prefix}{name}.")


def _refuse_values_of_tables(
    document: Mapping[str, Any], origins: Origins, kind: Any = Configuration, prefix: str = ""
) -> None:
    """Refuse a value in the place of a table, over which a single setting would be laid and hide it."""
    for name, below in _children(kind).items():
        value = document.get(name)
        if isinstance(value, Mapping):
            _refuse_values_of_tables(value, origins, below, f"{prefix}{name}.")
        elif name in document and _children(below) and prefix + name != "scenario":
            place = replace(origins, labels={}).where(prefix + name)  # in the file, not that of the settings below it
            raise ConfigurationError(
                f"`{prefix}{name}` must be a table; got {value!r}{place}. "
                f"Write [{prefix}{name}] and its settings below it."
            )


def _refuse_unknown_keys(
    data: Mapping[str, Any], origins: Origins, kind: Any = Configuration, prefix: str = ""
) -> None:
    known = _children(kind)
    for name, value in data.items():
        if name not in known:
            raise ConfigurationError(
                f"`{prefix}{name}` must be a known setting; got {_shown(value)}{origins.where(prefix + name)}. "
                f"{_advice(name, prefix, known)}"
            )
        if isinstance(value, Mapping) and _children(known[name]):
            _refuse_unknown_keys(value, origins, known[name], f"{prefix}{name}.")


def _advice(name: str, prefix: str, known: Mapping[str, Any]) -> str:
    elsewhere = [key for key in _all_keys(Configuration) if key.rpartition(".")[2] == name]
    if elsewhere:
        return f"Did you mean `{elsewhere[0]}`?"
    extra = ["scenario.preset"] if prefix == "scenario." else []
    return nearest(prefix + name, [prefix + key for key in known] + extra)


def _shown(value: Any) -> str:
    return "a table" if isinstance(value, Mapping) else repr(value)


def _split_population(values: Mapping[str, Any], section: str, origins: Origins) -> dict[str, Any]:
    key = f"{section}.population"
    rest = {name: value for name, value in values.items() if name != "population"}
    population = values["population"]
    if {"parents", "offspring"} & set(rest):
        raise ConfigurationError(
            f"`{key}` must be given without parents and offspring; got {population!r} beside them{origins.where(key)}. "
            "Remove one or the other."
        )
    if type(population) is not int or population < 2 or population % 2:
        raise ConfigurationError(
            f"`{key}` must be an even number of at least 2, as it is split into as many parents as offspring; "
            f"got {population!r}{origins.where(key)}. For an uneven split give parents and offspring."
        )
    return {**rest, "parents": population // 2, "offspring": population // 2}


def _validated(data: dict[str, Any], origins: Origins, kind: type[Configuration]) -> Configuration:
    try:
        return kind.model_validate_json(json.dumps(data, default=_plain), strict=True)
    except ValidationError as error:
        raise ConfigurationError(_message(error, data, origins)) from error


def _plain(value: Any) -> Any:
    """Return what JSON can carry: numbers for those of NumPy, else a text."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)


def _message(error: ValidationError, data: Mapping[str, Any], origins: Origins) -> str:
    first = error.errors(include_url=False)[0]
    key = _key_of(first["loc"])
    if first["type"] == "value_error":
        return _placed(str(first["ctx"]["error"]), key, origins)
    if first["type"] == "missing":
        return _missing(key, data, origins)
    value = _looked_up(data, key) if key in _RULES else first["input"]
    rule = _RULES.get(key) or _rule(first["msg"])
    return f"`{key}` must be {rule}; got {_shown(value)}{origins.where(key)}."


def _missing(key: str, data: Mapping[str, Any], origins: Origins) -> str:
    if set(data["scenario"]) >= _OF_OWN_SYSTEMS:
        return f"`{key}` must be given; got nothing{origins.where(key)}. Set it."
    name = str(data["scenario"].get("name"))
    return (
        f"`{key}` must be given, as {name!r} is no known scenario; got nothing{origins.where(key)}. Set it, or begin with a known "
        f"scenario by scenario.preset. {nearest(name, SCENARIOS)}"
    )


def _key_of(location: tuple[int | str, ...]) -> str:
    known = set(_all_keys(Configuration))
    key = ".".join(part for part in map(str, location))
    return next((name for name in _ancestors(key) if name in known), key)


def _rule(message: str) -> str:
    rule = message.removeprefix("Input should be ").replace("a valid ", "a ").replace("an object", "a table")
    return re.sub(r"\ba (?=[aeiou])", "an ", rule)


def _looked_up(data: Mapping[str, Any], key: str) -> Any:
    value: Any = data
    for part in key.split("."):
        value = value[part]
    return value


def _placed(message: str, section: str, origins: Origins) -> str:
    """Name the setting in full and say where it comes from, in a finished message."""
    named = re.match(r"`([\w.]+)", message)
    name = named[1] if named else ""
    known = set(_all_keys(Configuration))
    choices = (name, f"scenario.{name}", f"{section}.{name.rpartition('.')[2]}")
    key = next((choice for choice in choices if choice in known), section)
    message = message.replace(f"`{name}", f"`{key}", 1)
    return re.sub(r"(; got .*?)(\.(?: |$))", lambda found: found[1] + origins.where(key) + found[2], message, count=1)
