"""Resolve a configuration from a preset, a file and single settings, and write one; every refusal is one message."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, NoReturn, get_type_hints

import numpy as np
from pydantic import BaseModel, ValidationError

from turing_learning.errors import (
    ConfigurationError,
    Refusal,
    RefusedError,
    Text,
    brief,
    choice,
    nearest,
    reject,
)
from turing_learning.interaction import STIMULATED, StimulatedSystem
from turing_learning.swarm import SCENARIOS as SWARMS
from turing_learning.swarm import WORLDS, Scenario
from turing_learning.systems import CustomSystem

from ._configuration import TAGS, Configuration, scenario_type
from ._sections import PopulationSection

UNBOUNDED = "unbounded"  # TOML has no null; this stands for the missing side of an arena

_HEADER = re.compile(r"^\s*\[\[?([^\]]+)\]")
_ASSIGNMENT = re.compile(r"^\s*([A-Za-z0-9_\-.\"' ]+?)\s*=")

_ONE_SEARCH = {
    "recombination": 1.0,
    "redraw": 0.0,
    "exchange": 0.0,
    "intermediate": False,
    "memory": 0.0,
}
_PAPER: dict[str, dict[str, Any]] = {
    "models": {"minimum_step_size": 0.0, **_ONE_SEARCH},
    "classifiers": {"minimum_step_size": 0.0, "renewal": 0},
    "coevolution": {"archive": 0},
}
_PUBLISHED = {"minimum_step_size": 0.01, "start": "middle"}
PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "paper": _PAPER,
    "authors": _PAPER
    | {section: _PAPER[section] | _PUBLISHED for section in ("models", "classifiers")},
}
"""What each preset changes: "paper" keeps to the text of the paper, which has no floor under the step sizes, no archive of
past classifiers and no renewal of the present ones, children that recombine in one way only, no jumps and no memory of fitness;
"authors" adds the settings of the group's public code (repository wawachen/Turing_learning, TL_source): a floor under the step
sizes, and a start from 0."""

SCENARIOS: dict[str, Scenario | StimulatedSystem] = {**SWARMS, **STIMULATED}
"""Every system that has a name: swarms, and systems with stimuli."""

DEFAULT_SCENARIO = "aggregation"
"""What runs where neither a scenario nor a file is given."""

DEFAULT_TRIALS = 3000
"""Budget of a run of which nothing says how long it is, nor how its populations evolve (decision 0035)."""

NO_DEFAULT_BUDGET = frozenset(
    {
        "trials",
        "generations",
        "checkpoint_every",
        "estimate_window",
        "models",
        "classifiers",
        "coevolution",
    }
)
"""Settings of [run], and sections: a run for which one of them is given does not get `DEFAULT_TRIALS`."""

STUDY_TABLES = ("grid", "list")
"""Tables of a file that describes a study; see `load_variants`."""

_RULES = {
    "run.threads": 'be "all" or an integer of at least 1',
    "classifiers.input_scale": 'be "robot" or a list of positive numbers',
}  # settings of several types: what to say instead of the first type's complaint

STIMULATING: dict[str, dict[str, Any]] = {
    "classifiers": {"initial_low": -3.0, "initial_high": 3.0, "renewal": 0},
    "coevolution": {"archive": 20},
}
"""Settings for a system with stimuli, unless they are given: smaller weights hardly change a stimulus, what chooses well is not
found again soon, and archived classifiers need trials of their own (decision 0032)."""


@dataclass(frozen=True)
class Origins:
    """Where each setting comes from, for messages."""

    path: Path | None = None
    text: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)

    def where(self, key: str) -> str:
        """Return where a setting comes from; nothing where that is not known."""
        above = next((self.labels[name] for name in ancestors(key) if name in self.labels), None)
        below = next(
            (label for name, label in self.labels.items() if name.startswith(f"{key}.")), None
        )
        line = line_of(self.text, key)
        return above or below or (f"{self.path}:{line}" if line else "")

    def refuse(self, key: str, rule: str, got: str, remedy: Text = "", at: str = "") -> NoReturn:
        """Reject a setting; `at` is the key whose place is named, if another."""
        reject(key, rule, got, remedy, place=self.where(at or key))


def load_configuration(
    path: str | Path | None = None,
    preset: str = "default",
    overrides: Mapping[str, Any] | None = None,
    *,
    scenario: str | Scenario | CustomSystem | None = None,
    labels: Mapping[str, str] | None = None,
) -> Configuration:
    """Resolve a configuration: the preset, over it the file, over that single settings.

    Parameters
    ----------
    path
        A TOML file; see `to_toml` for all it may hold. ``scenario = "NAME"`` takes a known scenario; below
        ``[scenario]``, ``name`` (or ``preset``, where the name is to be another) takes the fields of a known
        scenario that the table does not give. See docs/scenarios.md.
    preset
        One of `PRESETS`.
    overrides
        Dotted key -> value, for example ``{"run.generations": 100}``.
    scenario
        A scenario or the name of one; where the file names one as well, both must agree. A file that names
        none needs it; without a file it is "aggregation". With a custom system the file has none.
    labels
        Dotted key -> where an override comes from, for messages, for example ``{"run.seed": "--seed"}``.

    Returns
    -------
    Configuration
        Every field explicit and valid.
    """
    document, origins = opened(path, overrides, labels)
    for key in STUDY_TABLES:
        if key in document:
            remedy = "Run the file as a study: `turing-learning study --config FILE`."
            origins.refuse(key, "be left out of the configuration of a single run", "one", remedy)
    return resolve(merged(preset_named(preset), document), overrides or {}, scenario, origins)


def opened(
    path: str | Path | None, overrides: Mapping[str, Any] | None, labels: Mapping[str, str] | None
) -> tuple[dict[str, Any], Origins]:
    """Return what a file says, nothing without one, and where each setting comes from."""
    text, document = ("", {}) if path is None else read_toml(Path(path))
    named = {key: f"override {key}" for key in overrides or {}} | dict(labels or {})
    return document, Origins(None if path is None else Path(path), text, named)


def preset_named(name: str) -> dict[str, Any]:
    """Return what a preset changes."""
    return PRESETS[choice("preset", name, PRESETS, noun="preset", error=ConfigurationError)]


def resolve(
    document: Mapping[str, Any],
    overrides: Mapping[str, Any],
    scenario: str | Scenario | CustomSystem | None,
    origins: Origins,
) -> Configuration:
    """Return the configuration of a document with single settings over it; see `load_configuration`."""
    lists = {
        key: value.tolist() if isinstance(value, np.ndarray) else value
        for key, value in overrides.items()
    }
    data = merged(document, nested(lists))
    given = data.get("scenario")
    data["scenario"] = _scenario_data(given, scenario, origins)
    _require_known(data, origins)
    run = data.get("run", {})
    sections = [key for key, value in data.items() if value]
    if scenario_type(data["scenario"]) is StimulatedSystem:
        data = merged(STIMULATING, data)
    elif NO_DEFAULT_BUDGET.isdisjoint([*run, *sections]):
        data = merged(data, {"run": {"trials": DEFAULT_TRIALS}})
    if (
        "run.generations" in overrides
        and "run.trials" not in overrides
        and data["run"].get("trials")
    ):
        data = merged(data, {"run": {"trials": 0}})  # the budget of a file gives way
    if scenario_type(data["scenario"]) is CustomSystem:
        section = data.get("classifiers", {})
        scale = section.get("input_scale", "robot")  # of a custom system it is found in the data
        found = data["scenario"].get("input_scale") if scale == "robot" else scale
        data["classifiers"] = {**section, "input_scale": found}
    named = given if isinstance(given, str) else {"name", "preset"} & set(given or {})
    if not named and scenario is None and origins.path is not None:
        named = f'Write scenario = "{DEFAULT_SCENARIO}", or [scenario] and name = "{DEFAULT_SCENARIO}" below it.'
        rule, remedy = (
            "be named, in the file or as an argument",
            f"{named} {nearest('', SCENARIOS)}",
        )
        reject("scenario", rule, "neither", remedy, place=str(origins.path))
    for section in ("models", "classifiers"):
        if "population" in data.get(section, ()):
            data[section] = _split_population(data[section], section, origins)
    try:
        return Configuration.model_validate_json(json.dumps(data, default=_plain), strict=True)
    except (ValueError, RecursionError) as error:
        # json: an integer of thousands of digits, thousands of brackets, half of a character
        keys = [key for key in _all_keys(Configuration) if _unwritable(_looked_up(data, key))]
        if not keys and isinstance(error, ValidationError):
            raise ConfigurationError(_refusal(error, data, origins)) from error
        key, rule = (keys or ["run"])[-1], "be a value of usual size, or a text"
        refusal = Refusal(key, rule, "one too large, or half of a character", origins.where(key))
        raise ConfigurationError(refusal) from error


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with another over it, table by table; a value in the place of a table stays, to be rejected."""
    result = dict(base)
    for key, value in over.items():
        below = result.get(key)
        if key == "scenario" and isinstance(below, str) and isinstance(value, Mapping):
            below = {"preset": below}
        if below is None or not isinstance(value, Mapping):
            result[key] = value
        elif isinstance(below, Mapping):
            result[key] = merged(below, value)
    return result


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Return tables of values by dotted keys; the reverse of `dotted`."""
    result: dict[str, Any] = {}
    for key, value in flat.items():
        *tables, name = key.split(".")
        table = result
        for part in tables:
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                reject(
                    key,
                    "be a setting of its own",
                    f"{part!r} both as a table and as a value",
                    "Leave one out.",
                )
        table[name] = value
    return result


def _scenario_data(
    given: Any, asked: str | Scenario | CustomSystem | None, origins: Origins
) -> dict[str, Any]:
    """Return all fields of the scenario: those of the known one that is meant, and over them those of the table."""
    if scenario_type(asked) is CustomSystem and given is not None:
        rule, remedy = "be left out for a custom system", "Remove it; all other sections count."
        origins.refuse("scenario", rule, _shown(given), remedy)
    if not isinstance(given, str | Mapping | None):
        remedy = f'Write scenario = "{DEFAULT_SCENARIO}", for example.'
        origins.refuse("scenario", "be a name or a table", brief(given), remedy)
    table = {"preset": given} if isinstance(given, str) else dict(given or {})
    named, name = table.pop("preset", None), table.get("name")
    if named is not None:
        _require_known_scenario(named, "scenario.preset", origins)
        if isinstance(name, str) and name in SCENARIOS and name != named:
            rule = f"be that of the preset, {named!r}, or one of your own"
            origins.refuse("scenario.name", rule, repr(name), "Leave one of them out.")
    if isinstance(asked, Scenario | CustomSystem):
        base = asdict(asked)
    else:
        if asked is not None:
            _require_known_scenario(asked, "scenario", origins)
            if (other := named or (name if isinstance(name, str) else None)) not in (None, asked):
                at = "scenario.name" if named is None else "scenario.preset"
                other_place = f" [{place}]" if (place := origins.where(at)) else ""
                got = f"{asked!r} as an argument and {brief(other)}{other_place}"
                reject("scenario", "be the same everywhere", got, "Leave one of them out.")
        meant = next((each for each in (named, asked, name) if each is not None), DEFAULT_SCENARIO)
        base = asdict(SCENARIOS[meant]) if isinstance(meant, str) and meant in SCENARIOS else {}
    if "world" in table and scenario_type(base) is Scenario:
        place, world = origins.where("scenario.world"), table.pop("world")
        choice("scenario.world", world, WORLDS, noun="world", place=place, error=ConfigurationError)
        base = merged(base, WORLDS[world])
    scenario = merged(base, table)
    return scenario | {
        key: _sides(scenario[key]) for key in ("arena", "parameters") if key in scenario
    }


def _require_known_scenario(name: Any, key: str, origins: Origins) -> None:
    choice(
        "scenario",
        name,
        SCENARIOS,
        noun="scenario",
        place=origins.where(key),
        error=ConfigurationError,
    )


def _sides(value: Any) -> Any:
    """Return tables in which None stands for the missing sides of an arena, and of the ranges of parameters."""
    if not isinstance(value, Mapping):
        return value
    return {key: None if side == UNBOUNDED else _sides(side) for key, side in value.items()}


def _split_population(values: Mapping[str, Any], section: str, origins: Origins) -> dict[str, Any]:
    key, population = f"{section}.population", values["population"]
    rest = {name: value for name, value in values.items() if name != "population"}
    if {"parents", "offspring"} & set(rest):
        got = f"{brief(population)} beside them"
        origins.refuse(
            key, "be given without parents and offspring", got, "Remove one or the other."
        )
    if type(population) is not int or population < 2 or population % 2:
        rule = "be an even number of at least 2, as it is split into as many parents as offspring"
        origins.refuse(
            key, rule, brief(population), "For an uneven split give parents and offspring."
        )
    return {**rest, "parents": population // 2, "offspring": population // 2}


def _children(kind: Any) -> dict[str, Any]:
    """Return the keys that a section may have, each with its type."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        known = {name: info.annotation for name, info in kind.model_fields.items()}
        known |= (
            {"scenario": Scenario} if issubclass(kind, Configuration) else {}
        )  # the kind that files describe
        return known | ({"population": int} if issubclass(kind, PopulationSection) else {})
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return {item.name: hints[item.name] for item in fields(kind)}
    return {}


def _all_keys(kind: Any, prefix: str = "") -> Iterator[str]:
    for name, child in _children(kind).items():
        yield prefix + name
        yield from _all_keys(child, f"{prefix}{name}.")


def _require_known(
    data: Mapping[str, Any], origins: Origins, kind: Any = Configuration, prefix: str = ""
) -> None:
    """Reject keys that are not known, and values in the place of tables."""
    known = _children(kind)
    for name, value in data.items():
        key = prefix + name
        if name not in known:
            elsewhere = [
                each for each in _all_keys(Configuration) if each.rpartition(".")[2] == name
            ]
            choices = [prefix + each for each in known] + (
                ["scenario.preset"] if prefix == "scenario." else []
            )
            choices += ["scenario.world"] if kind is Scenario else []
            advice = f"Did you mean `{elsewhere[0]}`?" if elsewhere else nearest(key, choices)
            origins.refuse(key, "be a known setting", _shown(value), advice)
        below = scenario_type(value) if key == "scenario" else known[name]
        if _children(below) and not isinstance(value, Mapping):
            own = {
                each: label for each, label in origins.labels.items() if each == key
            }  # not of settings below it
            remedy = f"Write [{key}] and its settings below it."
            replace(origins, labels=own).refuse(key, "be a table", brief(value), remedy)
        if _children(below):
            _require_known(value, origins, below, f"{key}.")


def _shown(value: Any) -> str:
    return "a table" if isinstance(value, Mapping) else brief(value)


def _plain(value: Any) -> Any:
    """Return what JSON can carry: numbers for those of NumPy, else a text."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)


def _unwritable(value: Any) -> bool:
    try:
        json.dumps(value, default=_plain, ensure_ascii=False).encode()
    except (ValueError, RecursionError):
        return True
    return False


def _refusal(error: ValidationError, data: Mapping[str, Any], origins: Origins) -> Refusal | str:
    """Return the first complaint of the sections, with the full name of the setting and its place."""
    first, known = error.errors(include_url=False)[0], set(_all_keys(Configuration))
    location = ".".join(str(part) for part in first["loc"] if part not in TAGS)
    key = next((name for name in ancestors(location) if name in known), location)
    if first["type"] == "value_error":
        complaint = first["ctx"]["error"]
        if not isinstance(complaint, RefusedError) or complaint.refusal is None:
            return str(complaint)
        name, _, rest = complaint.refusal.name.partition(" ")
        choices = (name, f"scenario.{name}", f"{key}.{name.rpartition('.')[2]}")
        full = next((each for each in choices if each in known), key or name)
        return replace(complaint.refusal, name=f"{full} {rest}".rstrip(), place=origins.where(full))
    if first["type"] == "missing":
        name = str(data["scenario"].get("name"))
        if scenario_type(data["scenario"]) is CustomSystem:
            return Refusal(key, "be given", "nothing", origins.where(key), "Set it.")
        remedy = (
            f"Set it, or begin with a known scenario by scenario.preset. {nearest(name, SCENARIOS)}"
        )
        return Refusal(
            key,
            f"be given, as {name!r} is no known scenario",
            "nothing",
            origins.where(key),
            remedy,
        )
    value = _looked_up(data, key) if key in _RULES else first["input"]
    rule = (
        first["msg"]
        .removeprefix("Input should be ")
        .replace("a valid ", "a ")
        .replace("an object", "a table")
    )
    rule = re.sub(r"\ba (?=[aeiou])", "an ", rule)
    return Refusal(key, _RULES.get(key, f"be {rule}"), _shown(value), origins.where(key))


def _looked_up(data: Mapping[str, Any], key: str) -> Any:
    value: Any = data
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file and what it says."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a path with a null character
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise ConfigurationError(
            Refusal("config", "be a readable TOML file", f"{path} ({reason})")
        ) from error
    try:
        return text, tomllib.loads(text)
    except (
        ValueError,
        RecursionError,
    ) as error:  # ValueError: also an integer of thousands of digits
        found = re.search(r"^(.*) \(at line (\d+), column \d+\)$", str(error), re.DOTALL)
        reason = found[1] if found else str(error).replace(" (at end of document)", "")
        lines = text.splitlines()
        line = int(found[2]) if found else len(lines)
        content = brief(lines[line - 1].strip() if 0 < line <= len(lines) else "")
        remedy = f"The reader says: {reason}."
        raise ConfigurationError(
            Refusal("config", "be valid TOML", content, f"{path}:{line}", remedy)
        ) from error


def line_of(text: str, key: str) -> int | None:
    """Return the line (from 1) of a document that sets a dotted key, or opens its table; None if there is none."""
    lines, table = {}, ""
    for number, line in enumerate(text.splitlines(), start=1):
        header = _HEADER.match(line)
        if found := header or _ASSIGNMENT.match(line):
            name = ".".join(part.strip().strip("\"'") for part in found[1].split("."))
            table, name = (name, name) if header else (table, f"{table}.{name}" if table else name)
            lines[name] = number
    return next((lines[name] for name in ancestors(key) if name in lines), None)


def ancestors(key: str) -> Iterator[str]:
    """Yield a dotted key, the table that it is in, and so on."""
    while key:
        yield key
        key = key.rpartition(".")[0]


def to_toml(configuration: Configuration) -> str:
    """Return a resolved configuration as TOML, with every field explicit; reading it gives the same configuration."""
    data = configuration.model_dump(mode="python")
    return (
        "\n".join(line for name, table in data.items() for line in toml_table(name, table)).rstrip()
        + "\n"
    )


def toml_table(name: str, values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield f"[{name}]"
    yield from (
        f"{key} = {_value(value)}"
        for key, value in values.items()
        if not isinstance(value, Mapping)
    )
    yield ""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from toml_table(f"{name}.{key}", value)


def _value(value: Any) -> str:
    """Return what JSON makes of a value, which TOML reads as well."""
    return (
        f'"{UNBOUNDED}"'
        if value is None
        else json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    )
