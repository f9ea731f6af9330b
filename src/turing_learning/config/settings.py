"""Configurations with single settings changed, and those of a study: one, a grid, or a list of
them.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from turing_learning.errors import Setting, Text, brief, check, nearest, reject
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomSystem

from ._configuration import Configuration
from ._load import (
    STUDY_TABLES,
    Origins,
    load_configuration,
    merged,
    nested,
    opened,
    preset_named,
    resolve,
)
from ._sections import dotted

THIN: dict[str, Any] = {"run": {"history": "thin"}}
"""What a study changes where nothing else says so."""

ONE_THREAD: dict[str, Any] = {"run.threads": 1}
MOST_VARIANTS = 100_000
_RESERVED: dict[str, Text] = {
    "run.seed": ("Give the seeds with ", Setting("runs"), " and ", Setting("first_seed"), "."),
    "run.threads": (
        "A run of a study has one thread; give the number of ",
        Setting("workers"),
        ".",
    ),
}


def flat_settings(configuration: Configuration) -> dict[str, Any]:
    """Return every setting of a configuration: dotted key -> value, lists for tuples."""
    return dotted(configuration.model_dump(mode="json"))


def with_settings(configuration: Configuration, settings: Mapping[str, Any]) -> Configuration:
    """Return a resolved configuration with some settings replaced: dotted key -> value, as
    `flat_settings` gives them.
    """
    data = merged(configuration.model_dump(mode="json"), nested(settings))
    return type(configuration).model_validate_json(json.dumps(data), strict=True)


def stated_once(statements: Iterable[tuple[str, Any, str]]) -> dict[str, Any]:
    """Return dotted key -> value of settings, of which each may be stated once, by an option or by
    its key.

    A statement is a dotted key, a value or a table of values, and the words for how it was given.
    """
    settings: dict[str, Any] = {}
    statement_of: dict[str, str] = {}
    for name, stated, words in statements:
        # An empty table has no keys, and is rejected as a value later.
        flat = dotted({name: stated}) or {name: stated}
        for key, value in flat.items():
            earlier = settings.setdefault(key, value)
            words_before = statement_of.setdefault(key, words)
            if earlier is not value and earlier != value:
                rule = "be given once"
                reject(key, rule, f"{words_before} and {words}", "Leave one of them out.")
    return settings


def single_settings(settings: Mapping[str, Any] | None, **arguments: Any) -> dict[str, Any]:
    """Return dotted key -> value of settings and of arguments.

    An argument sets the field of the same name in the section of the run, unless it is None.
    """
    trials = arguments.get("trials")
    generations = arguments.get("generations")
    got = f"{brief(trials)} beside {brief(generations)}"
    check(trials is None or generations is None, "trials", "be given without `generations`", got)
    statements = []
    for name, value in arguments.items():
        if value is not None:
            statements.append((f"run.{name}", value, f"{name}={brief(value)}"))
    for key, value in (settings or {}).items():
        statements.append((key, value, f"settings={{{key!r}: {brief(value)}}}"))
    return stated_once(statements)


def load_variants(
    path: str | Path | None = None,
    preset: str = "default",
    overrides: Mapping[str, Any] | None = None,
    *,
    scenario: str | Scenario | CustomSystem | None = None,
    labels: Mapping[str, str] | None = None,
    grid: Mapping[str, Sequence[Any]] | None = None,
) -> list[Configuration]:
    """Resolve the configurations of a study; arguments are as in `load_configuration`.

    The file may also hold one of two tables. ``[grid]``, in which a setting has a list of values,
    stands for all combinations; the last setting changes fastest. ``[[list]]``, once for each
    configuration, holds the settings in which it differs. `grid`, dotted key -> values, takes the
    place of a table in the file.
    """
    document, origins = opened(path, overrides, labels)
    settings = _all_settings(document, grid, origins)
    shared = {key: value for key, value in document.items() if key not in STUDY_TABLES}
    base = merged(merged(preset_named(preset), THIN), shared)
    fixed = dict(overrides or {}) | ONE_THREAD
    variants = []
    for number, differences in enumerate(settings, start=1):
        for key in differences:
            if key in fixed:
                got = f"it in the study's grid or list and as {origins.labels.get(key, key)}"
                reject(key, "be given once", got, "Leave one out.")
        words = ", ".join(f"{key} = {brief(value)}" for key, value in differences.items())
        labels_of_variants = dict.fromkeys(
            differences, f"configuration {number} of the study: {words}"
        )
        labelled = replace(origins, labels={**origins.labels, **labels_of_variants})
        configuration = resolve(base, fixed | differences, scenario, labelled)
        _require_executable(configuration, scenario)
        variants.append(configuration)
    return variants


def _require_executable(
    configuration: Configuration, scenario: str | Scenario | CustomSystem | None
) -> None:
    """Reject what a worker of a study could not execute, as no file can hold it."""
    if configuration.system.resuming and (scenario is None or isinstance(scenario, str)):
        rule = "be one of simulated robots where nothing else is given"
        got = f"{configuration.scenario.name!r}, a custom system, whose simulator no file can hold"
        remedy = "From Python, give `genuine`, `parameters`, and `simulate` as a name that can be imported."
        reject("scenario", rule, got, remedy)
    if configuration.given:
        rule = "be a name that a worker can import"
        got = "an object of this process"
        reject(configuration.given[0].name, rule, got, "Give module:function.")


def _all_settings(
    document: Mapping[str, Any], grid: Mapping[str, Sequence[Any]] | None, origins: Origins
) -> list[dict[str, Any]]:
    """Return the settings of each configuration."""
    sources = [name for name in STUDY_TABLES if name in document]
    if grid is not None:
        sources.append("argument grid")
    if len(sources) > 1:
        reject("grid", "be given once, and without a list", " and ".join(sources))
    if not sources:
        return [{}]
    name = "grid"
    rule = "be a table of lists"
    tables = [document.get("grid", grid)]
    if "list" in document:
        name = "list"
        rule = "be one table [[list]] for each configuration"
        tables = document["list"]
    if (
        not isinstance(tables, list)
        or not tables
        or not all(isinstance(table, Mapping) for table in tables)
    ):
        origins.refuse(name, rule, brief(document.get(name, grid)))
    # Seeds and the like are the study's own to set
    settings = list(map(dotted, tables))
    for key, advice in _RESERVED.items():
        for table in settings:
            if key in table:
                rule = f"be left out of a study's {name}"
                origins.refuse(key, rule, brief(table[key]), advice, at=f"{name}.{key}")
    if name == "list":
        return settings
    return _combinations(settings[0], origins)


def _combinations(choices: Mapping[str, Any], origins: Origins) -> list[dict[str, Any]]:
    """Return the settings of each configuration of a grid."""
    if not choices:
        remedy = "Write models.parents = [25, 50], for example, or leave the grid out."
        origins.refuse("grid", "name one setting or more", "an empty one", remedy)
    for key, values in choices.items():
        remedy = ""
        if not isinstance(values, list | tuple):
            remedy = f"Write {key} = [{brief(values)}], for example."
        elif not values:
            remedy = "Give one, or leave it out."
        if remedy:
            origins.refuse(f"grid.{key}", "be a list of one value or more", brief(values), remedy)
    count = math.prod(map(len, choices.values()))
    check(count <= MOST_VARIANTS, "grid", f"have at most {MOST_VARIANTS} combinations", count)
    return [dict(zip(choices, values, strict=True)) for values in product(*choices.values())]


def resolved(
    scenario: str | Scenario | CustomSystem | None,
    preset: str,
    config: str | Path | Configuration | None,
    overrides: Mapping[str, Any],
) -> Configuration:
    """Return a configuration from a file, or from another one, with what comes before it."""
    labels = {}
    for key in overrides:
        if key.startswith("run."):
            labels[key] = f"argument {key.rpartition('.')[2]}"
    if not isinstance(config, Configuration):
        return load_configuration(config, preset, overrides, scenario=scenario, labels=labels)
    settings = dotted(config.model_dump(exclude={"scenario"}))
    # Other data has scales of its own
    if scenario is not None and config.system.resuming:
        del settings["classifiers.input_scale"]
    settings |= overrides
    return load_configuration(
        None, preset, settings, scenario=scenario or config.scenario, labels=labels
    )


def refuse_unknown(options: Mapping[str, Any], arguments: Iterable[str]) -> None:
    """Reject an option that is no argument of a call."""
    for name, value in options.items():
        got = type(value).__name__
        if isinstance(value, str | int | float):
            got = brief(value)
        check(name in arguments, name, "be a known option", got, nearest(name, arguments))
