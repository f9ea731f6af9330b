"""Tables and figures of section 4.3."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from turing_learning.analysis import least_dispersion
from turing_learning.reproduction._claims import Claim
from turing_learning.reproduction._experiment import Cell, Picture, Table
from turing_learning.reproduction._verdicts import Spread, printed_spreads
from turing_learning.reproduction.experiments._error_rows import ERROR_COLUMNS, error_rows
from turing_learning.reproduction.experiments._variants import KINDS

from ._outcome import Case, Outcome


def errors_table(outcomes: Sequence[Outcome], claims: Mapping[str, Claim]) -> Table:
    """Return the absolute errors of all outcomes, beside the printed ones."""
    rows: list[tuple[Cell, ...]] = []
    for outcome in outcomes:
        printed = printed_spreads(claims[outcome.case.claim("4.3-{}-ae")].values)
        rows += error_rows(outcome.case.scenario, outcome.preset, outcome.errors, printed)
    return Table(
        "absolute-errors",
        "Absolute errors over the runs, of the subjectively best model of the last generation (the paper's rule) and of the "
        "estimate, beside what the paper prints",
        ERROR_COLUMNS,
        rows,
    )


def models_table(case: Case, outcomes: Sequence[Outcome]) -> Table:
    """Return what every run of a case study has inferred."""
    rows: list[tuple[Cell, ...]] = [
        (
            one.preset,
            kind,
            seed,
            *map(float, model),
            *(_ends(interval) if kind == "estimate" else (None,) * interval.size),
        )
        for one in outcomes
        if one.case == case
        for kind in KINDS
        for seed, model, interval in zip(one.seeds, one.models[kind], one.intervals, strict=True)
    ]
    names = case.scenario.parameter_names
    columns = ("preset", "model", "seed", *names, *(f"{end}_{name}" for end in ("low", "high") for name in names))
    caption = f"{case.scenario.title}: what every run has inferred, and the ends of the 90 % intervals of its estimate"
    return Table(f"{case.scenario.name}-models", caption, columns, rows)


def _ends(interval: np.ndarray) -> tuple[float | None, ...]:
    """Return the lower, then the upper ends of an interval (2, P); None where unknown."""
    return tuple(None if np.isnan(end) else float(end) for end in interval.ravel())


def convergence_table(outcome: Outcome) -> Table:
    """Return the medians over the runs, generation by generation."""
    scenario = outcome.case.scenario
    rows = [(g, *(round(float(value), 4) for value in row)) for g, row in enumerate(outcome.medians)]
    caption = f"{scenario.title}, preset {outcome.preset}: medians over the runs of the best model of each generation"
    return Table(f"{scenario.name}-{outcome.preset}-convergence", caption, ("generation", *outcome.names), rows)


def shares_table(cases: Sequence[Case], shares: Sequence[Sequence[Spread]], claims: Mapping[str, Claim]) -> Table:
    """Return the shares of the sensor readings, beside the printed ones."""
    values = claims["4.3-sensor-shares"].values
    rows = [
        (case.scenario.name, state, one.mean, one.standard_error, values[case.key][state])
        for case, found in zip(cases, shares, strict=True)
        for state, one in enumerate(found)
    ]
    columns = ("scenario", "reading", "share", "standard_error", "paper")
    return Table("sensor-shares", "Share of the agents' sensor readings, mean over the trials", columns, rows)


def dispersion_table(case: Case, outcomes: Sequence[Outcome]) -> Table:
    """Return the dispersion at the end of every trial of a case study."""
    own = [one for one in outcomes if one.case == case]
    trials = [f"trial_{k}" for k in range(1, case.emergence.trials + 1)]
    agents = own[0].emergence["best_model"].agents
    rows: list[tuple[Cell, ...]] = [("", "agents", None, None, None, *map(float, agents))]
    for one, kind in product(own, KINDS):
        emergence = one.emergence[kind]
        tests = zip(
            one.seeds, emergence.comparison.p_values, emergence.comparison.significant, emergence.models, strict=True
        )
        rows += [
            (one.preset, kind, seed, float(p), bool(differs), *map(float, values)) for seed, p, differs, values in tests
        ]
    return Table(
        f"{case.scenario.name}-dispersion",
        f"Dispersion of the {case.gathered} at the end of each trial: agents, then replicas of the models of each run",
        ("preset", "model", "seed", "p_value", "significant", *trials),
        rows,
    )


def outcome_pictures(outcome: Outcome) -> list[Picture]:
    """Return boxes, convergence and dispersion."""
    from turing_learning.figures import box_figure
    from turing_learning.figures._many_runs import convergence_figure, dispersion_figure

    scenario, case, runs = outcome.case.scenario, outcome.case, len(outcome.seeds)
    name, title = f"{scenario.name}-{outcome.preset}", f"{scenario.title}, preset {outcome.preset}"
    look: dict[str, Any] = {"names": outcome.names, "truth": scenario.controller}
    return [
        Picture(
            f"{name}-boxes",
            f"{title}: parameters of the subjectively best model of the last generation, {runs} runs; the truth is dashed.",
            case.claim("4.3-{}-ae"),
            box_figure(outcome.models["best_model"], **look),
        ),
        Picture(
            f"{name}-convergence",
            f"{title}: medians over {runs} runs of the subjectively best model of each generation; the truth is thin.",
            "4.3-convergence",
            convergence_figure(outcome.medians, **look),
        ),
        Picture(
            f"{name}-dispersion",
            f"{title}: dispersion of {case.gathering} {case.gathered} after {case.emergence.duration_s:g} s, "
            f"{case.emergence.trials} trials for the agents (hatched) and for replicas of the best model of each run.",
            case.claim("4.3-emergent-{}"),
            dispersion_figure(
                outcome.emergence["best_model"].agents,
                outcome.emergence["best_model"].models,
                least=least_dispersion(case.gathering),
                gathered=case.gathered,
            ),
        ),
    ]
