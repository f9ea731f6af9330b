"""Absolute errors of models, parameter by parameter, in a table."""

from collections.abc import Mapping, Sequence

import numpy as np

from turing_learning.reproduction._experiment import Cell
from turing_learning.reproduction._verdicts import Spread
from turing_learning.swarm import Scenario

from ._variants import KINDS

ERROR_COLUMNS = (
    "scenario", "preset", "model", "parameter", "runs", "mean", "standard_deviation", "median", "paper_mean",
    "paper_standard_deviation",
)  # fmt: skip
"""Of a table of `error_rows`."""


def error_rows(
    scenario: Scenario, preset: str, errors: Mapping[str, np.ndarray], printed: Sequence[Spread]
) -> list[tuple[Cell, ...]]:
    """Return the absolute errors of each kind of model (R, P), parameter by parameter, beside the printed ones of the best."""
    rows: list[tuple[Cell, ...]] = []
    for kind in KINDS:
        for k, name in enumerate(scenario.parameter_names):
            own, median = Spread.of(errors[kind][:, k]), float(np.median(errors[kind][:, k]))
            theirs = (printed[k].mean, printed[k].standard_deviation) if kind == "best_model" else (None, None)
            head = (scenario.name, preset, kind, name)
            rows.append((*head, own.runs, own.mean, own.standard_deviation, median, *theirs))
    return rows
