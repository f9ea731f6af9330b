"""Simulators from what runs one model: a function with named parameters that returns a table, or any program."""

import csv
import io
import re
import shlex
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import RefusedError, brief, refuse, require

LARGEST_SEED = 2**31 - 1
"""Seeds are from 0 to it, which all programs take."""
SEED = "seed"
SIMULATED = "what the simulator returns or prints"
"""Where a table is that is refused."""
MOST_CHARACTERS = 200
"""Characters of what a program writes that stand in a message."""


class ColumnsError(RefusedError):
    """A table lacks a column, or has one that its counterpart lacks."""


def column_names(table: Any) -> tuple[str, ...]:
    """Return the names of the columns of a DataFrame or a dict of series; none of an array."""
    names: tuple[Any, ...] = ()
    if isinstance(table, Mapping):
        names = tuple(table)
    elif hasattr(table, "columns"):
        names = tuple(table.columns)
    # pandas numbers columns that have no names.
    if all(isinstance(name, str) for name in names):
        return names
    return ()


def table_values(
    table: Any, columns: Sequence[str] = (), *, only: bool = False, place: str = ""
) -> np.ndarray:
    """Return a table of one run as numbers (T, D).

    Parameters
    ----------
    table
        A pandas.DataFrame, such as that of a DataCollector, a dict of D series (T,), or an array (T, D) or (T,).
    columns
        Which columns of a DataFrame or dict, in this order; all by default. An array has no names, and
        is taken as it is.
    only
        Whether a column besides them is refused.
    place
        Which table it is, for messages.

    Raises
    ------
    ValueError
        If a column is missing, or its values are no numbers.
    """
    present = column_names(table)
    names = tuple(columns) or present
    levels = getattr(getattr(table, "index", None), "nlevels", 1)
    remedy = (
        'Aggregate agents first, as by table.groupby("Step").mean(); or drop a level of the index.'
    )
    rule = "have one row for each step"
    require(levels == 1, "table", rule, f"an index of {levels} levels", remedy, place=place)
    if present:
        _require_columns(present, names, only, place)
    if isinstance(table, Mapping) or hasattr(table, "columns"):
        names = names or tuple(table.keys())
        table = np.column_stack([np.asarray(table[name], dtype=np.float64) for name in names])
    values = np.asarray(table, dtype=np.float64)
    return values[:, None] if values.ndim == 1 else values


def _require_columns(
    present: tuple[str, ...], names: tuple[str, ...], only: bool, place: str
) -> None:
    """Refuse a table with these columns present if it lacks one of the names; with `only` if it has another one."""
    missing = [name for name in names if name not in present]
    spare = [name for name in present if only and name not in names]
    if missing or spare:
        rule = f"have the columns {', '.join(names)}"
        remedy = f"Rename {', '.join(missing + spare)}, or choose columns that both the system's "
        remedy += "tables and the simulator's have, with columns= or --simulate-columns."
        got = ", ".join(present)
        refuse("table", rule, got, remedy, place=place, error=ColumnsError)


@dataclass(frozen=True)
class PerModel:
    """A simulator that calls a function once for each model; see `per_model`."""

    function: Callable[..., Any]  #: Called with the parameters by name, and a seed
    names: tuple[str, ...]  #: Of the parameters
    #: Of the table, which are the signals; all by default
    columns: tuple[str, ...] = ()
    seeded: bool = True  #: Whether the function takes `seed`
    only: bool = False  #: Whether a table with further columns is refused

    vectorized = False

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of a model's values."""
        return self.names

    @property
    def signals(self) -> tuple[str, ...] | None:
        """Names of the signals, if they are known."""
        return self.columns or None

    def __call__(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the sample (T, D) of one model with parameters (P,)."""
        named = dict(zip(self.names, parameters.tolist(), strict=True))
        if self.seeded:
            named[SEED] = int(rng.integers(LARGEST_SEED))
        table = self.function(**named)
        return table_values(table, self.columns, only=self.only, place=SIMULATED)


def per_model(
    function: Callable[..., Any],
    parameters: Iterable[str],
    *,
    columns: Sequence[str] = (),
    seeded: bool = True,
) -> PerModel:
    """Turn "run one model with these parameters, give me a table" into a simulator for `turing_learning.infer`.

    Parameters
    ----------
    function
        Called as ``function(speed=3.2, noise=0.1, seed=17)``; returns a pandas.DataFrame with a row for each time
        step (of a Mesa model: ``model.datacollector.get_model_vars_dataframe()``), a dict of series, or an array.
    parameters
        Their names; a mapping name -> range, as `infer` takes it, will do.
    columns
        Columns of the table that are the signals, in this order; all by default.
    seeded
        Whether the function takes `seed`, an integer from 0 to 2**31 - 2. One that takes no seed is not repeated
        to the bit by `resume`.

    Returns
    -------
    PerModel
        Give it as `simulate`; it takes one model at a time. With `workers` or an `executor`, `function` has to be one
        of a module.
    """
    names = tuple(parameters)
    require(callable(function), "function", "be a function of named parameters", brief(function))
    require(names, "parameters", "name one parameter or more", brief(parameters))
    return PerModel(function, names, tuple(columns), seeded)


@dataclass(frozen=True)
class Command:
    """A program as a simulator: one call for each model, whose output is a table in CSV.

    It is run without a shell. `{speed}` stands for the value of the parameter speed, `{seed}` for an integer.
    """

    template: str  #: "prog --speed {speed} --noise {noise} --seed {seed}"
    names: tuple[str, ...]  #: Of the parameters
    #: Of the CSV, which are the signals; all by default
    columns: tuple[str, ...] = ()
    timeout_s: float | None = None  #: Longest duration of a call (s)
    only: bool = False  #: Whether a table with further columns is refused

    vectorized = False

    def __post_init__(self) -> None:
        fields = set(re.findall(r"\{(\w*)\}", self.template))
        for name in self.names:
            example = f"For example: prog {' '.join(f'{{{name}}}' for name in (*self.names, SEED))}"
            rule = f"hold {{{name}}}, where the value of the parameter goes"
            require(name in fields, "simulate_command", rule, repr(self.template), example)
        unknown = fields - {*self.names, SEED}
        rule = f"hold no other names in braces than those of the parameters and {{{SEED}}}"
        require(not unknown, "simulate_command", rule, ", ".join(sorted(unknown)))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of a model's values."""
        return self.names

    @property
    def signals(self) -> tuple[str, ...] | None:
        """Names of the signals, if they are known."""
        return self.columns or None

    def __call__(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Run the program for one model with parameters (P,); return its table (T, D)."""
        values = {}
        for name, value in zip(self.names, parameters.tolist(), strict=True):
            values[name] = value_of_parameter(value)
        values[SEED] = str(int(rng.integers(LARGEST_SEED)))
        words = []
        for word in shlex.split(self.template):
            words.append(re.sub(r"\{(\w+)\}", lambda match: values[match[1]], word))
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=self.timeout_s, check=False
        )
        if done.returncode:
            output = " ".join((done.stderr or done.stdout).split())[-MOST_CHARACTERS:]
            raise RuntimeError(f"the program ended with exit status {done.returncode}: {output}")
        table = read_table(done.stdout)
        return table_values(table, self.columns, only=self.only, place=SIMULATED)


def value_of_parameter(value: float) -> str:
    """Return a parameter's value as a program is given it."""
    return f"{value:.17g}"


def with_columns(simulate: Any, names: tuple[str, ...]) -> Any:
    """Return a simulator whose tables are read by these names, those of the system's tables.

    One that has columns, or that returns arrays, stays as it is.
    """
    if names and isinstance(simulate, PerModel | Command) and not simulate.columns:
        return replace(simulate, columns=names, only=True)
    return simulate


def read_table(text: str) -> dict[str, list[float]]:
    """Return the columns of a table in CSV by their names; refuse cells that are no numbers."""
    rows = list(csv.reader(io.StringIO(text)))
    rows = list(filter(None, rows))
    require(len(rows) > 1, "table", "have a line of names and rows below", f"{len(rows)} lines")
    names, *body = rows
    columns: dict[str, list[float]] = {name.strip(): [] for name in names}
    for number, row in enumerate(body, 2):
        rule = f"have {len(names)} cells in each row"
        require(len(row) == len(names), "table", rule, len(row), place=f"line {number}")
        for name, cell in zip(columns, row, strict=True):
            try:
                columns[name].append(float(cell))
            except ValueError:
                refuse("table", "hold numbers", repr(cell), place=f"line {number}, column {name}")
    return columns
