"""Resolve a configuration from a preset, a file and single settings, and write one.

Every refusal is one message.
"""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, NoReturn, get_args, get_origin, get_type_hints

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
from ._sections import PopulationSection, dotted

# TOML has no null; this stands for the missing side of an arena.
UNBOUNDED = "unbounded"

# Lines of TOML that open a table, or set a key; for the numbers of lines in messages.
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
"""What each preset changes: "paper" keeps to the text of the paper, which has no floor under the
step sizes, no archive of past classifiers and no renewal of the present ones, children that
recombine in one way only, no jumps and no memory of fitness; "authors" adds the settings of the
group's public code (repository wawachen/Turing_learning, TL_source): a floor under the step sizes,
and a start from 0."""

SCENARIOS: dict[str, Scenario | StimulatedSystem] = {**SWARMS, **STIMULATED}
"""Every system that has a name: swarms, and systems with stimuli."""

DEFAULT_SCENARIO = "aggregation"
"""What runs where neither a scenario nor a file is given."""

DEFAULT_TRIALS = 3000
"""Budget of a run of which nothing says how long it is, nor how its populations evolve (decision
0035).
"""

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
"""Settings of [run], and sections: a run for which one of them is given does not get
`DEFAULT_TRIALS`.
"""

STUDY_TABLES = ("grid", "list")
"""Tables of a file that describes a study; see `load_variants`."""

# Settings of several types: what to say instead of the first type's complaint.
_RULES = {
    "run.threads": 'be "all" or an integer of at least 1',
    "classifiers.input_scale": 'be "robot" or a list of positive numbers',
    "centers_cm": "be a list of pairs of numbers, x and y",
}

STIMULATING: dict[str, dict[str, Any]] = {
    "classifiers": {"initial_low": -3.0, "initial_high": 3.0, "renewal": 0},
    "coevolution": {"archive": 20},
}
"""Settings for a system with stimuli, unless they are given: smaller weights hardly change a
stimulus, what chooses well is not found again soon, and archived classifiers need trials of their
own (decision 0032)."""


@dataclass(frozen=True)
class Origins:
    """Where each setting comes from, for messages."""

    path: Path | None = None
    text: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)

    def where(self, key: str) -> str:
        """Return where a setting, its table or a setting of its table comes from.

        Nothing if that is not known.
        """
        for name in ancestors(key):
            if name in self.labels:
                return self.labels[name]
        for name, label in self.labels.items():
            if name.startswith(f"{key}."):
                return label
        line = line_of(self.text, key)
        return f"{self.path}:{line}" if line else ""

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
        A TOML file; see `to_toml` for all it may hold. ``scenario = "NAME"`` takes a known
        scenario; below
        ``[scenario]``, ``name`` (or ``preset``, where the name is to be another) takes the fields
        of a known scenario that the table does not give. See docs/scenarios.md.
    preset
        One of `PRESETS`.
    overrides
        Dotted key -> value, for example ``{"run.generations": 100}``.
    scenario
        A scenario or the name of one; where the file names one as well, both must agree. A file
        that names none needs it; without a file it is "aggregation". With a custom system the file
        has none.
    labels
        Dotted key -> where an override comes from, for messages, for example ``{"run.seed":
        "--seed"}``.

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
    named = {key: f"override {key}" for key in overrides or {}} | dict(labels or {})
    if path is None:
        return {}, Origins(labels=named)
    text, document = read_toml(Path(path))
    return document, Origins(Path(path), text, named)


def preset_named(name: str) -> dict[str, Any]:
    """Return what a preset changes."""
    return PRESETS[choice("preset", name, PRESETS, noun="preset", error=ConfigurationError)]


def resolve(
    document: Mapping[str, Any],
    overrides: Mapping[str, Any],
    scenario: str | Scenario | CustomSystem | None,
    origins: Origins,
) -> Configuration:
    """Return the configuration of a document with single settings over it.

    See `load_configuration`.
    """
    # Arrays of NumPy would be refused, as they are no lists.
    plain = {}
    for key, value in overrides.items():
        plain[key] = value.tolist() if isinstance(value, np.ndarray) else value
    data = merged(document, nested(plain))
    stated = data.get("scenario")
    data["scenario"] = _scenario_data(stated, scenario, origins)
    _require_known(data, origins)
    data = _with_defaults(data, overrides)
    if scenario is None and origins.path is not None:
        _require_named(stated, origins.path)
    for section in ("models", "classifiers"):
        if "population" in data.get(section, ()):
            data[section] = _split_population(data[section], section, origins)
    try:
        return Configuration.model_validate_json(json.dumps(data, default=_plain), strict=True)
    except (ValueError, RecursionError) as error:
        # JSON cannot carry an integer of thousands of digits, thousands of brackets, or half of a
        # character.
        unwritable = [key for key in _all_keys(Configuration) if _unwritable(_looked_up(data, key))]
        if not unwritable and isinstance(error, ValidationError):
            raise ConfigurationError(_refusal(error, data, origins)) from error
        key = unwritable[-1] if unwritable else "run"
        rule = "be a value of usual size, or a text"
        got = "one too large, or half of a character"
        raise ConfigurationError(Refusal(key, rule, got, origins.where(key))) from error


def _with_defaults(data: dict[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with the settings that depend on the system and on what else is given."""
    system = scenario_type(data["scenario"])
    stated = {key for key, value in data.items() if value}
    if system is StimulatedSystem:
        # Below all that is given.
        data = merged(STIMULATING, data)
    elif NO_DEFAULT_BUDGET.isdisjoint(stated | set(data.get("run", {}))):
        data = merged(data, {"run": {"trials": DEFAULT_TRIALS}})
    if (
        "run.generations" in overrides
        and "run.trials" not in overrides
        and data["run"].get("trials")
    ):
        # The budget of a file gives way
        data = merged(data, {"run": {"trials": 0}})
    if system is CustomSystem:
        classifiers = data.get("classifiers", {})
        if classifiers.get("input_scale", "robot") == "robot":
            scale = data["scenario"].get("input_scale")  # found in the data
            data["classifiers"] = {**classifiers, "input_scale": scale}
    return data


def _require_named(stated: Any, path: Path) -> None:
    """Reject a file that names no scenario, where no argument names one."""
    if isinstance(stated, str):
        named = bool(stated)
    else:
        named = not {"name", "preset"}.isdisjoint(stated or {})
    if not named:
        lines = f'Write scenario = "{DEFAULT_SCENARIO}", or [scenario] and name = "{DEFAULT_SCENARIO}" below it.'
        rule = "be named, in the file or as an argument"
        reject("scenario", rule, "neither", f"{lines} {nearest('', SCENARIOS)}", place=str(path))


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with another over it, table by table.

    A value in the place of a table stays, to be rejected.
    """
    result = dict(base)
    for key, value in over.items():
        below = result.get(key)
        if key == "scenario" and isinstance(below, str) and isinstance(value, Mapping):
            # A name becomes a table, so that single fields can be put over it.
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
        for step in tables:
            table = table.setdefault(step, {})
            if not isinstance(table, dict):
                got = f"{step!r} both as a table and as a value"
                reject(key, "be a setting of its own", got, "Leave one out.")
        table[name] = value
    return result


def _scenario_data(
    stated: Any, argument: str | Scenario | CustomSystem | None, origins: Origins
) -> dict[str, Any]:
    """Return all fields of the scenario: those of the named or given one, and over them those of
    the table.
    """
    if scenario_type(argument) is CustomSystem and stated is not None:
        rule = "be left out for a custom system"
        origins.refuse("scenario", rule, _shown(stated), "Remove it; all other sections count.")
    if stated is None:
        table = {}
    elif isinstance(stated, str):
        table = {"preset": stated}
    elif isinstance(stated, Mapping):
        table = dict(stated)
    else:
        remedy = f'Write scenario = "{DEFAULT_SCENARIO}", for example.'
        origins.refuse("scenario", "be a name or a table", brief(stated), remedy)
    preset = table.pop("preset", None)
    base = _scenario_fields(preset, table.get("name"), argument, origins)
    if "world" in table and scenario_type(base) is Scenario:
        world = table.pop("world")
        where = origins.where("scenario.world")
        choice("scenario.world", world, WORLDS, noun="world", place=where, error=ConfigurationError)
        base = merged(base, WORLDS[world])
    scenario = merged(base, table)
    for key in ("arena", "parameters"):
        if key in scenario:
            scenario[key] = _sides(scenario[key])
    return scenario


def _scenario_fields(
    preset: Any, name: Any, argument: str | Scenario | CustomSystem | None, origins: Origins
) -> dict[str, Any]:
    """Return the fields of the scenario that preset, name or argument mean.

    None for a name of the caller's own.
    """
    if preset is not None:
        _require_known_scenario(preset, "scenario.preset", origins)
        if isinstance(name, str) and name in SCENARIOS and name != preset:
            rule = f"be that of the preset, {preset!r}, or one of your own"
            origins.refuse("scenario.name", rule, repr(name), "Leave one of them out.")
    if isinstance(argument, Scenario | CustomSystem):
        return asdict(argument)
    in_file = preset
    key = "scenario.preset"
    if preset is None and isinstance(name, str):
        in_file = name
        key = "scenario.name"
    if argument is not None:
        _require_known_scenario(argument, "scenario", origins)
        if in_file is not None and in_file != argument:
            where = origins.where(key)
            got = f"{argument!r} as an argument and {brief(in_file)}"
            if where:
                got += f" [{where}]"
            reject("scenario", "be the same everywhere", got, "Leave one of them out.")
        return asdict(SCENARIOS[argument])
    if preset is None and name is None:
        in_file = DEFAULT_SCENARIO
    if in_file in SCENARIOS:
        return asdict(SCENARIOS[in_file])
    return {}


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
    """Return tables in which None stands for the missing sides of an arena, and of the ranges of
    parameters.
    """
    if not isinstance(value, Mapping):
        return value
    return {key: None if side == UNBOUNDED else _sides(side) for key, side in value.items()}


def _split_population(values: Mapping[str, Any], section: str, origins: Origins) -> dict[str, Any]:
    key = f"{section}.population"
    values = dict(values)
    population = values.pop("population")
    if "parents" in values or "offspring" in values:
        got = f"{brief(population)} beside them"
        rule = "be given without parents and offspring"
        origins.refuse(key, rule, got, "Remove one or the other.")
    if type(population) is not int or population < 2 or population % 2:
        rule = "be an even number of at least 2, as it is split into as many parents as offspring"
        remedy = "For an uneven split give parents and offspring."
        origins.refuse(key, rule, brief(population), remedy)
    return {**values, "parents": population // 2, "offspring": population // 2}


def _children(section: Any, stated: Any = ()) -> dict[str, Any]:
    """Return the keys that a section may have, each with its type.

    None for a type that is no section. A section whose keys are names of one's own has those that
    are stated.
    """
    if get_origin(section) is dict:
        return dict.fromkeys(stated, get_args(section)[1])
    if not isinstance(section, type):
        return {}
    if issubclass(section, BaseModel):
        children: dict[str, Any] = {}
        for name, info in section.model_fields.items():
            children[name] = info.annotation
        if issubclass(section, Configuration):
            # The type that files describe
            children["scenario"] = Scenario
        if issubclass(section, PopulationSection):
            children["population"] = int
        return children
    if is_dataclass(section):
        hints = get_type_hints(section)
        return {field.name: hints[field.name] for field in fields(section)}
    return {}


def _all_keys(section: Any, prefix: str = "") -> Iterator[str]:
    for name, child in _children(section).items():
        yield prefix + name
        yield from _all_keys(child, f"{prefix}{name}.")


def _require_known(
    data: Mapping[str, Any], origins: Origins, section: Any = Configuration, prefix: str = ""
) -> None:
    """Reject keys that are not known, and values in the place of tables."""
    children = _children(section, data)
    for name, value in data.items():
        key = prefix + name
        if name not in children:
            advice = _advice(name, section, prefix)
            origins.refuse(key, "be a known setting", _shown(value), advice)
        child = scenario_type(value) if key == "scenario" else children[name]
        if not (_children(child) or get_origin(child) is dict):
            continue
        if not isinstance(value, Mapping):
            remedy = f"Write [{key}] and its settings below it."
            # The place of the table itself, not of a setting below it.
            labels = {key: origins.labels[key]} if key in origins.labels else {}
            replace(origins, labels=labels).refuse(key, "be a table", brief(value), remedy)
        _require_known(value, origins, child, f"{key}.")


def _advice(name: str, section: Any, prefix: str) -> str:
    """Return what may be meant by an unknown key of a section."""
    for key in _all_keys(Configuration):
        if key.rpartition(".")[2] == name:
            return f"Did you mean `{key}`?"
    choices = [prefix + child for child in _children(section)]
    if prefix == "scenario.":
        choices.append("scenario.preset")
    if section is Scenario:
        choices.append("scenario.world")
    return nearest(prefix + name, choices)


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "a table"
    return brief(value)


def _plain(value: Any) -> Any:
    """Return what JSON can carry: numbers for those of NumPy, else a text."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    return str(value)


def _unwritable(value: Any) -> bool:
    try:
        json.dumps(value, default=_plain, ensure_ascii=False).encode()
    except (ValueError, RecursionError):
        return True
    return False


def _refusal(error: ValidationError, data: Mapping[str, Any], origins: Origins) -> Refusal | str:
    """Return the first complaint of the sections, with the full name of the setting and its
    place.
    """
    # One at a time: the first complaint is often the cause of the others.
    complaint = error.errors(include_url=False)[0]
    keys = set(_all_keys(Configuration))
    # Also of items, whose names are the user's
    for stated in dotted(data):
        keys.update(ancestors(stated))
    location = ".".join(str(step) for step in complaint["loc"] if step not in TAGS)
    key = next((name for name in ancestors(location) if name in keys), location)
    if complaint["type"] == "value_error":
        cause = complaint["ctx"]["error"]
        if not isinstance(cause, RefusedError) or cause.refusal is None:
            return str(cause)
        return _with_full_name(cause.refusal, key, keys, origins)
    if complaint["type"] == "missing":
        if scenario_type(data["scenario"]) is CustomSystem:
            return Refusal(key, "be given", "nothing", origins.where(key), "Set it.")
        name = str(data["scenario"].get("name"))
        rule = f"be given, as {name!r} is no known scenario"
        remedy = (
            f"Set it, or begin with a known scenario by scenario.preset. {nearest(name, SCENARIOS)}"
        )
        return Refusal(key, rule, "nothing", origins.where(key), remedy)
    rule = _RULES.get(key, _RULES.get(key.rpartition(".")[2], ""))
    if rule:
        return Refusal(key, rule, _shown(_looked_up(data, key)), origins.where(key))
    rule = complaint["msg"].removeprefix("Input should be ")
    rule = rule.replace("a valid ", "a ").replace("an object", "a table")
    rule = re.sub(r"\ba (?=[aeiou])", "an ", rule)
    return Refusal(key, f"be {rule}", _shown(complaint["input"]), origins.where(key))


def _with_full_name(refusal: Refusal, key: str, keys: set[str], origins: Origins) -> Refusal:
    """Return a refusal whose setting, named within its section, has its full name and its place."""
    name, _, addition = refusal.name.partition(" ")
    full = key or name
    for candidate in (name, f"scenario.{name}", f"{key}.{name.rpartition('.')[2]}"):
        if candidate in keys:
            full = candidate
            break
    return replace(refusal, name=f"{full} {addition}".rstrip(), place=origins.where(full))


def _looked_up(data: Mapping[str, Any], key: str) -> Any:
    value: Any = data
    for step in key.split("."):
        value = value.get(step) if isinstance(value, Mapping) else None
    return value


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file and what it says."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        # ValueError: not UTF-8, or a path with a null character
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        got = f"{path} ({reason})"
        raise ConfigurationError(Refusal("config", "be a readable TOML file", got)) from error
    try:
        return text, tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # ValueError: also an integer of thousands of digits
        lines = text.splitlines()
        reason = str(error).replace(" (at end of document)", "")
        number = len(lines)
        position = re.search(r"^(.*) \(at line (\d+), column \d+\)$", str(error), re.DOTALL)
        if position:
            reason = position[1]
            number = int(position[2])
        line = lines[number - 1].strip() if 0 < number <= len(lines) else ""
        remedy = f"The reader says: {reason}."
        refusal = Refusal("config", "be valid TOML", brief(line), f"{path}:{number}", remedy)
        raise ConfigurationError(refusal) from error


def line_of(text: str, key: str) -> int | None:
    """Return the line (from 1) of a document that sets a dotted key, or opens its table.

    None if there is none.
    """
    lines: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        header = _HEADER.match(line)
        assignment = _ASSIGNMENT.match(line)
        if header:
            table = _unquoted(header[1])
            lines[table] = number
        elif assignment:
            name = _unquoted(assignment[1])
            if table:
                name = f"{table}.{name}"
            lines[name] = number
    # A setting that the document leaves out is looked for in its table.
    for name in ancestors(key):
        if name in lines:
            return lines[name]
    return None


def _unquoted(key: str) -> str:
    """Return a dotted key of TOML without quotes and spaces."""
    return ".".join(step.strip().strip("\"'") for step in key.split("."))


def ancestors(key: str) -> Iterator[str]:
    """Yield a dotted key, the table that it is in, and so on."""
    while key:
        yield key
        key = key.rpartition(".")[0]


def to_toml(configuration: Configuration) -> str:
    """Return a resolved configuration as TOML, with every field explicit.

    Reading it gives the same configuration.
    """
    lines: list[str] = []
    for name, table in configuration.model_dump(mode="python").items():
        lines += toml_table(name, table)
    return "\n".join(lines).rstrip() + "\n"


def toml_table(name: str, values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield f"[{name}]"
    for key, value in values.items():
        if not isinstance(value, Mapping):
            yield f"{key} = {_value(value)}"
    yield ""
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from toml_table(f"{name}.{key}", value)


def _value(value: Any) -> str:
    """Return what JSON makes of a value, which TOML reads as well."""
    if value is None:
        return f'"{UNBOUNDED}"'
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
