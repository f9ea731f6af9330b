"""Figures and page of a study: hand the numbers to the rooms that draw."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from turing_learning import report
from turing_learning.config import to_toml
from turing_learning.figures import Picture, box_figure
from turing_learning.figures.many_runs import (
    convergence_figure,
    error_box_figure,
    error_histogram_figure,
)
from turing_learning.report import Listing, Report, report_page

from ._plan import Plan
from ._table import (
    FAIR_ERROR,
    GOOD_ERROR,
    Convergence,
    StudyResult,
    describe,
    error_rows,
    errors_of,
    members,
)

BOXES_DRAWN = 40
"""Boxes in one picture, at most."""


def draw_study(result: StudyResult, plan: Plan, medians: Sequence[Convergence]) -> list[Picture]:
    """Draw the figures of a study, with the medians of each configuration; none if no run is complete."""
    # The typical model of a run by trials is its estimate.
    model = "best_model"
    traced = "best"
    title = "subjectively best model of the last generation"
    if plan.configuration(1).run.trials > 0:
        model = "estimate"
        traced = "typical"
        title = "estimate"
    rows = [list(run.result[model].values()) for run in result.runs if run.result is not None]
    if not rows:
        return []
    models = np.array(rows)
    boxes = _boxes(models, plan, title)
    if not result.maes:
        return [boxes]
    if len(result.groups) > 1:
        return [_configurations(result, plan)]
    caption = f"Of the estimate, {len(result.maes)} runs; {GOOD_ERROR:g} and {FAIR_ERROR:g} are dashed where errors reach them"
    figure = error_histogram_figure(np.array(result.maes), limits=(GOOD_ERROR, FAIR_ERROR))
    histogram = Picture(
        "histogram", "Mean absolute errors", f"{caption} (paper: figure 14a).", figure
    )
    curves = medians[0][1]
    scenario = plan.base.scenario
    look: dict[str, Any] = {"names": scenario.parameter_labels, "truth": scenario.truth}
    trials = plan.configuration(1).spent(len(curves["best_mae"]))
    if plan.behaviors:
        names = scenario.parameter_names
        caption = f"Of the {title}, parameter by parameter (figure 14b of the paper)."
        figure = error_box_figure({name: errors_of(result.runs, model, name) for name in names})
        errors = Picture("errors", "Absolute errors", caption, figure)
        caption = f"Median over the runs of the absolute errors of the {title}."
        figure = convergence_figure({"": curves[f"{traced}_error"]}, names=names, trials=trials)
        return [histogram, errors, Picture("convergence", "Convergence", caption, figure)]
    caption = f"Median over the runs of the {title}; the truth is thin (figure 5 of the paper)."
    figure = convergence_figure({"": curves[f"{traced}_model"]}, trials=trials, **look)
    return [boxes, histogram, Picture("convergence", "Convergence", caption, figure, wide=True)]


def _boxes(models: np.ndarray, plan: Plan, title: str) -> Picture:
    """Draw models (R, P) of the runs."""
    scenario = plan.base.scenario
    caption = f"{title.capitalize()}, {len(models)} runs: median, quartiles, whiskers up to 1.5 interquartile ranges"
    caption += "." if scenario.truth is None else "; the truth is dashed (figure 4 of the paper)."
    if plan.base.models.hidden:
        caption += " Of networks: their steady outputs."
    figure = box_figure(models, names=scenario.parameter_labels, truth=scenario.truth)
    return Picture("boxes", "Inferred parameters", caption, figure)


def _configurations(result: StudyResult, plan: Plan) -> Picture:
    """Draw the errors of each configuration."""
    errors = {}
    for group, runs in members(plan, result.runs)[:BOXES_DRAWN]:
        name = label(group).replace(", ", "\n")
        errors[name] = np.array([run.estimate_mae for run in runs], dtype=float)
    figure = error_box_figure(errors, quantity="Mean absolute error", where="")
    caption = "Of the estimate, configuration by configuration"
    if len(result.groups) > BOXES_DRAWN:
        caption += f"; the first {BOXES_DRAWN} of {len(result.groups)}"
    return Picture("configurations", "Mean absolute errors", f"{caption}.", figure, wide=True)


def label(group: Mapping[str, Any]) -> str:
    """Return the settings of a configuration in few words: the last part of each key is enough."""
    return ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in group.items())


def study_report(result: StudyResult, plan: Plan, drawings: Sequence[Picture]) -> str:
    missing = []
    if result.failed:
        missing.append(f"{report.counted(len(result.failed), 'run')} failed")
    if unfinished := len(result.unfinished):
        verb = "is" if unfinished == 1 else "are"
        missing.append(f"{report.counted(unfinished, 'run')} {verb} not complete")
    warning = ""
    if missing:
        warning = f"{' and '.join(missing)}: the statistics are of the others."
    listings = _errors(result) or [_estimates(result)]
    return report_page(
        Report(
            title=f"{result.title}: a study of {report.counted(len(result.runs), 'run')}",
            summary=f"{describe(result)}.",
            listings=(*listings, _verdicts(result), _runs(result)),
            figures=drawings,
            warning=warning,
            configuration=to_toml(plan.base),
        )
    )


def _verdicts(result: StudyResult) -> Listing:
    """Return how often runs say what of themselves, and how good they are."""
    rows: list[tuple[str, int]] = []
    for title, counts in (("Verdict", result.verdicts()), ("Against the truth", result.kinds())):
        rows += [(f"{title}: {word}", count) for word, count in counts.items()]
    note = "What the complete runs say of themselves, without the truth; then how good they are. "
    note += f"Good: MAE of the estimate below {GOOD_ERROR:g}. Fair: below {FAIR_ERROR:g}. Poor: {FAIR_ERROR:g} or more, "
    note += "and how the estimate misses the truth."
    return Listing("kinds", "Runs", ("What they say", "Runs"), rows, note)


def _errors(result: StudyResult) -> list[Listing]:
    """Return, for each configuration, a row per parameter: errors of estimate and best model, and the paper's."""
    spread = ("Std. dev.", "Median")
    columns = ("Parameter", "Estimate: mean", *spread, "Best model: mean", *spread, "Paper: mean")
    note = "Mean, standard deviation and median over the complete runs. The paper reports the error of the best model."
    listings = []
    for number, group in enumerate(result.groups):
        name = "errors"
        heading = "Absolute errors"
        if len(result.groups) > 1:
            name += str(number)
        if group:
            heading += f": {label(group)}"
        rows = []
        for parameter, numbers, paper in error_rows(result, group):
            rows.append((parameter, *numbers, paper))
        listings.append(Listing(name, heading, columns, rows, note))
    return listings


def _estimates(result: StudyResult) -> Listing:
    """Return how much the estimates of runs differ whose truth nobody knows."""
    values_of: dict[str, list[float]] = {}
    for run in result.runs:
        if run.result is not None:
            for name, value in run.result["estimate"].items():
                values_of.setdefault(name, []).append(value)
    rows = []
    for name, values in values_of.items():
        quartiles = np.quantile(values, (0.5, 0.25, 0.75))
        rows.append((name, *quartiles.tolist()))
    columns = ("Parameter", "Estimate: median", "Lower quartile", "Upper quartile")
    return Listing(
        "estimates", "Estimates", columns, rows, "Over the complete runs. The truth is not known."
    )


def _runs(result: StudyResult) -> Listing:
    keys = list(result.runs[0].settings)
    names = [key.removeprefix("run.") for key in keys]
    columns = ("Run", *names, "Says", "Against the truth", "MAE: estimate", "MAE: best model")
    rows = []
    for run in result.runs:
        settings = [_shown(run.settings[key]) for key in keys]
        verdict = f"{run.verdict}: {run.reason}" if run.reason else run.verdict
        mae = None if run.result is None else run.result["mae"]
        rows.append((run.number, *settings, run.says, verdict, run.estimate_mae, mae))
    return Listing("runs", "Every run", columns, rows, folded=True)


def _shown(value: Any) -> str | int | float:
    if isinstance(value, list):
        return ", ".join(f"{item:.3f}" if isinstance(item, float) else str(item) for item in value)
    # True is an integer of Python.
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    return str(value)
