"""The table as CSV files; the same runs give the same bytes, whoever executed them."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from turing_learning.runs import write_atomically

from ._convergence import Convergence
from ._plan import CONTROLLER, SEED
from ._table import ERRORS, MODELS, StudyResult, StudyRun


def write_tables(result: StudyResult, convergences: Sequence[Convergence], names: Sequence[str]) -> None:
    """Write runs.csv, summary.csv and convergence.csv into the study folder.

    Parameters
    ----------
    result
        The table.
    convergences
        Of each configuration.
    names
        Names of the parameters.
    """
    keys = [key for key in result.runs[0].settings if key not in (SEED, CONTROLLER)]
    _write(result.path / "runs.csv", _runs(result.runs, keys, names))
    _write(result.path / "summary.csv", _summary(result, keys))
    _write(result.path / "convergence.csv", _convergence(convergences, keys, names))


def _runs(runs: Iterable[StudyRun], keys: Sequence[str], names: Sequence[str]) -> Iterable[Sequence[Any]]:
    numbers = ("truth", *(column for model in MODELS for column in (model, ERRORS[model])))
    yield [
        "run", "seed", *keys, "state", "verdict", "reason", "generations", "selection_stopped", "mae", "estimate_mae",
        *(f"{column}_{name}" for column in numbers for name in names),
        *(f"interval_{end}_{name}" for end in ("low", "high") for name in names),
    ]  # fmt: skip
    for run in runs:
        content = run.result or {}
        values = ((content.get(column) or {}).get(name) for column in numbers for name in names)
        intervals = content.get("interval") or {}
        ends = ((intervals.get(name) or (None, None))[end] for end in (0, 1) for name in names)
        yield [
            run.number, run.seed, *(run.settings[key] for key in keys), run.state, run.verdict, run.reason,
            *(content.get(name) for name in ("generations", "selection_stopped", "mae", "estimate_mae")),
            *values, *ends,
        ]  # fmt: skip


def _summary(result: StudyResult, keys: Sequence[str]) -> Iterable[Sequence[Any]]:
    yield [*keys, "parameter", "model", "runs", "mean", "standard_deviation", "median", "paper"]
    for row in result.summaries:
        own = (row.group.get(key) for key in keys)
        yield [
            *own, row.parameter, row.model, row.runs, row.mean, row.standard_deviation, row.median,
            row.paper if row.model == "best_model" else None,
        ]  # fmt: skip


def _convergence(
    convergences: Sequence[Convergence], keys: Sequence[str], names: Sequence[str]
) -> Iterable[Sequence[Any]]:
    kinds = ("best_model", "typical_model", "best_error", "typical_error")
    yield [*keys, "generation", *(f"{kind}_{name}" for kind in kinds for name in names), "best_mae", "typical_mae"]
    for one in convergences:
        own = [one.group.get(key) for key in keys]
        for g in range(len(one.best_mae)):
            numbers = (float(value) for kind in kinds for value in getattr(one, kind)[g])
            yield [*own, g, *numbers, float(one.best_mae[g]), float(one.typical_mae[g])]


def _write(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([_cell(value) for value in row] for row in rows)
    write_atomically(path, text.getvalue().encode())


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, list | dict) else value
