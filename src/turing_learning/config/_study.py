"""The configurations of a study: one, a grid, or a list of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from turing_learning.swarm import Scenario

from ._errors import ConfigurationError
from ._flat import dotted
from ._load import Origins, merged, preset_named, resolve
from ._sections import Configuration, OwnConfiguration
from ._toml import read_toml

THIN: dict[str, Any] = {"run": {"history": "thin"}}
"""What a study changes where nothing else says so."""

ONE_THREAD: dict[str, Any] = {"run.threads": 1}
MOST_VARIANTS = 100_000
_RESERVED = {
    "run.seed": "Give the seeds with `runs` and `first_seed`.",
    "run.threads": "A run of a study has one thread; give the number of `workers`.",
}


@dataclass(frozen=True)
class Variant:
    """One configuration of a study.

    Parameters
    ----------
    settings
        What makes it different from the others: dotted key -> value; empty if it is the only one.
    configuration
        Resolved.
    """

    settings: dict[str, Any]
    configuration: Configuration


def load_variants(
    path: str | Path | None = None,
    preset: str = "default",
    overrides: Mapping[str, Any] | None = None,
    *,
    scenario: str | Scenario | None = None,
    labels: Mapping[str, str] | None = None,
    grid: Mapping[str, Sequence[Any]] | None = None,
) -> tuple[Variant, ...]:
    """Resolve the configurations of a study.

    The file may hold all that `load_configuration` reads, and one of two tables: ``[grid]``, in which a setting has a
    list of values, stands for all combinations; ``[[list]]``, once for each configuration, holds the settings in which
    it differs.

    Parameters
    ----------
    path, preset, overrides, scenario, labels
        As in `load_configuration`. The history is thin unless one of them says otherwise.
    grid
        Dotted key -> values, instead of a table in the file.

    Returns
    -------
    tuple of Variant
        At least one; in the order of the list, or of the grid, the last setting changing fastest.

    Raises
    ------
    ConfigurationError
        If anything is refused; the message names which configuration it is.
    """
    text, document = ("", {}) if path is None else read_toml(Path(path))
    named = {key: f"override {key}" for key in overrides or {}} | dict(labels or {})
    origins = Origins(None if path is None else Path(path), text, named)
    settings = _all_settings(document, grid, origins)
    rest = {key: value for key, value in document.items() if key not in ("grid", "list")}
    base = merged(merged(preset_named(preset), THIN), rest)
    fixed = {key: value for key, value in (overrides or {}).items() if key != "run.threads"} | ONE_THREAD
    return tuple(_variant(base, fixed, own, scenario, origins, number) for number, own in enumerate(settings, start=1))


def _variant(
    base: dict[str, Any],
    fixed: dict[str, Any],
    own: dict[str, Any],
    scenario: str | Scenario | None,
    origins: Origins,
    number: int,
) -> Variant:
    for key in own:
        if key in fixed:
            label = origins.labels.get(key, key)
            raise ConfigurationError(
                f"`{key}` must be given once; got it in the study's grid or list and as {label}. Leave one out."
            )
    shown = ", ".join(f"{key} = {value!r}" for key, value in own.items())
    places = dict.fromkeys(own, f"configuration {number} of the study: {shown}")
    here = replace(origins, labels={**origins.labels, **places})
    configuration = resolve(base, fixed | own, scenario, here)
    if isinstance(configuration, OwnConfiguration):
        raise ConfigurationError(
            f"`scenario` must be one of simulated robots in a study; got {configuration.scenario.name!r}, a system of one's own, "
            "whose simulator no file can hold. Infer with several seeds, and `pool` the runs."
        )
    return Variant(own, configuration)


def _all_settings(
    document: Mapping[str, Any], grid: Mapping[str, Sequence[Any]] | None, origins: Origins
) -> list[dict[str, Any]]:
    given = [name for name in ("grid", "list") if name in document] + (["argument grid"] if grid is not None else [])
    if len(given) > 1:
        raise ConfigurationError(f"`grid` must be given once, and without a list; got {' and '.join(given)}.")
    if "list" in document:
        return list(_listed(document["list"], origins))
    return _combined(document.get("grid", grid), origins) if given else [{}]


def _listed(tables: Any, origins: Origins) -> Iterator[dict[str, Any]]:
    if not isinstance(tables, list) or not tables or not all(isinstance(table, Mapping) for table in tables):
        raise ConfigurationError(
            f"`list` must be one table [[list]] for each configuration; got {tables!r}{origins.where('list')}."
        )
    for table in tables:
        settings = dotted(table)
        _refuse_reserved(settings, "list", origins)
        yield settings


def _combined(table: Any, origins: Origins) -> list[dict[str, Any]]:
    if not isinstance(table, Mapping):
        raise ConfigurationError(f"`grid` must be a table of lists; got {table!r}{origins.where('grid')}.")
    choices = dotted(table)
    if not choices:
        raise ConfigurationError(
            f"`grid` must name one setting or more; got an empty one{origins.where('grid')}. Write models.parents = [25, 50], "
            "for example, or leave the grid out."
        )
    _refuse_reserved(choices, "grid", origins)
    count = 1
    for key, values in choices.items():
        if not isinstance(values, list | tuple) or not values:
            empty = isinstance(values, list | tuple)
            remedy = "Give one, or leave it out" if empty else f"Write {key} = [{values!r}], for example"
            raise ConfigurationError(
                f"`grid.{key}` must be a list of one value or more; got {values!r}{origins.where(f'grid.{key}')}. {remedy}."
            )
        count *= len(values)
    if count > MOST_VARIANTS:
        raise ConfigurationError(f"`grid` must have at most {MOST_VARIANTS} combinations; got {count}.")
    return [dict(zip(choices, values, strict=True)) for values in product(*choices.values())]


def _refuse_reserved(settings: Mapping[str, Any], table: str, origins: Origins) -> None:
    for key, advice in _RESERVED.items():
        if key in settings:
            raise ConfigurationError(
                f"`{key}` must be left out of a study's {table}; got {settings[key]!r}{origins.where(f'{table}.{key}')}. "
                f"{advice}"
            )
