"""Configurations with single settings changed, and those of a study: one, a grid, or a list of them."""

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
    """Return a resolved configuration with some settings replaced: dotted key -> value, as `flat_settings` gives them."""
    data = merged(configuration.model_dump(mode="json"), nested(settings))
    return type(configuration).model_validate_json(json.dumps(data), strict=True)


def stated_once(statements: Iterable[tuple[str, Any, str]]) -> dict[str, Any]:
    """Return dotted key -> value of settings, of which each may be stated once, by an option or by its key.

    A statement is a dotted key, a value or a table of values, and the words for how it was given.
    """
    found: dict[str, tuple[Any, str]] = {}
    for name, given, words in statements:
        for key, value in (dotted({name: given}) or {name: given}).items():
            known, before = found.setdefault(key, (value, words))
            if known is not value and known != value:
                reject(key, "be given once", f"{before} and {words}", "Leave one of them out.")
    return {key: value for key, (value, _) in found.items()}


def single_settings(settings: Mapping[str, Any] | None, **arguments: Any) -> dict[str, Any]:
    """Return dotted key -> value of settings, and of arguments that set a run's fields of the same name unless they are None."""
    both = arguments.get("trials"), arguments.get("generations")
    got = f"{brief(both[0])} beside {brief(both[1])}"
    check(any(one is None for one in both), "trials", "be given without `generations`", got)
    said = [
        (f"run.{name}", value, f"{name}={brief(value)}")
        for name, value in arguments.items()
        if value is not None
    ]
    said += [
        (key, value, f"settings={{{key!r}: {brief(value)}}}")
        for key, value in (settings or {}).items()
    ]
    return stated_once(said)


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

    The file may also hold one of two tables: ``[grid]``, in which a setting has a list of values, stands for all combinations, the
    last setting changing fastest; ``[[list]]``, once for each configuration, holds the settings in which it differs.
    `grid`, dotted key -> values, takes the place of a table in the file.
    """
    document, origins = opened(path, overrides, labels)
    settings = _all_settings(document, grid, origins)
    rest = {key: value for key, value in document.items() if key not in STUDY_TABLES}
    base = merged(merged(preset_named(preset), THIN), rest)
    fixed = {
        key: value for key, value in (overrides or {}).items() if key != "run.threads"
    } | ONE_THREAD
    variants = []
    for number, own in enumerate(settings, start=1):
        if twice := next((key for key in own if key in fixed), None):
            got = f"it in the study's grid or list and as {origins.labels.get(twice, twice)}"
            reject(twice, "be given once", got, "Leave one out.")
        difference = ", ".join(f"{key} = {brief(value)}" for key, value in own.items())
        places = dict.fromkeys(own, f"configuration {number} of the study: {difference}")
        configuration = resolve(
            base, fixed | own, scenario, replace(origins, labels={**origins.labels, **places})
        )
        if configuration.system.resuming and (scenario is None or isinstance(scenario, str)):
            rule = "be one of simulated robots where nothing else is given"
            got = f"{configuration.scenario.name!r}, a custom system, whose simulator no file can hold"
            remedy = "From Python, give `genuine`, `parameters`, and `simulate` as a name that can be imported."
            reject("scenario", rule, got, remedy)
        if configuration.given:
            rule, got = "be a name that a worker can import", "an object of this process"
            reject(configuration.given[0].name, rule, got, "Give module:function.")
        variants.append(configuration)
    return variants


def _all_settings(
    document: Mapping[str, Any], grid: Mapping[str, Sequence[Any]] | None, origins: Origins
) -> list[dict[str, Any]]:
    """Return the settings of each configuration."""
    given = [name for name in STUDY_TABLES if name in document] + (
        ["argument grid"] if grid is not None else []
    )
    if len(given) > 1:
        reject("grid", "be given once, and without a list", " and ".join(given))
    if not given:
        return [{}]
    name = "list" if "list" in document else "grid"
    tables = document["list"] if name == "list" else [document.get("grid", grid)]
    rule = (
        "be one table [[list]] for each configuration" if name == "list" else "be a table of lists"
    )
    if (
        not isinstance(tables, list)
        or not tables
        or not all(isinstance(table, Mapping) for table in tables)
    ):
        origins.refuse(name, rule, brief(document.get(name, grid)))
    settings = [dotted(table) for table in tables]
    for key, advice in _RESERVED.items():
        for each in settings:
            if key in each:
                origins.refuse(
                    key,
                    f"be left out of a study's {name}",
                    brief(each[key]),
                    advice,
                    at=f"{name}.{key}",
                )
    if name == "list":
        return settings
    (choices,) = settings
    if not choices:
        remedy = "Write models.parents = [25, 50], for example, or leave the grid out."
        origins.refuse("grid", "name one setting or more", "an empty one", remedy)
    for key, values in choices.items():
        if not (several := isinstance(values, list | tuple)) or not values:
            remedy = (
                "Give one, or leave it out."
                if several
                else f"Write {key} = [{brief(values)}], for example."
            )
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
    labels = {
        key: f"argument {key.rpartition('.')[2]}" for key in overrides if key.startswith("run.")
    }
    if isinstance(config, Configuration):
        flat = dotted(config.model_dump())
        known = {
            key: value for key, value in flat.items() if not key.startswith("scenario.")
        } | dict(overrides)
        if scenario is not None and config.system.resuming:  # other data has scales of its own
            known = {
                key: value
                for key, value in known.items()
                if key != "classifiers.input_scale" or key in overrides
            }
        return load_configuration(
            None, preset, known, scenario=scenario or config.scenario, labels=labels
        )
    return load_configuration(config, preset, overrides, scenario=scenario, labels=labels)


def refuse_unknown(options: Mapping[str, Any], known: Iterable[str]) -> None:
    """Reject an option that is none of the known arguments of a call."""
    for name, value in options.items():
        shown = brief(value) if isinstance(value, str | int | float) else type(value).__name__
        check(name in known, name, "be a known option", shown, nearest(name, known))
