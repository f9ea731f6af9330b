"""Figures and page of a study: hand the numbers to the rooms that draw."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from turing_learning import report
from turing_learning.config import to_toml
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._many_runs import convergence_figure, error_box_figure, error_histogram_figure
from turing_learning.report._content import Listing, StudyReport
from turing_learning.report._page import study_page

from ._convergence import Convergence
from ._folder import StudyFolder
from ._plan import Plan
from ._table import FAIR, GOOD, ParameterSummary, StudyResult, describe, errors_of, members, paired

MOST_GROUPS = 40  # boxes in one picture


def draw_study(result: StudyResult, plan: Plan, convergences: Sequence[Convergence]) -> list[Picture]:
    """Draw the figures of a study; none if no run is complete.

    Parameters
    ----------
    result
        The table.
    plan
        What was run.
    convergences
        Of each configuration.
    """
    if not result.maes:
        return []
    if len(result.groups) > 1:
        return [_by_configuration(result, plan)]
    if plan.behaviors:
        return [_histogram(result), _errors(result, plan), _convergence_of_errors(plan, convergences[0])]
    return [_boxes(result, plan), _convergence(plan, convergences[0]), _histogram(result)]


def _boxes(result: StudyResult, plan: Plan) -> Picture:
    models = [list(run.result["best_model"].values()) for run in result.runs if run.result is not None]
    scenario = plan.base.scenario
    return Picture(
        "boxes",
        "Inferred parameters",
        f"Subjectively best model of the last generation, {len(models)} runs: median, quartiles, whiskers up to 1.5 "
        "interquartile ranges; the truth is dashed (figure 4 of the paper)."
        + (" Of networks: their steady outputs." if plan.base.models.hidden else ""),
        box_figure(np.array(models), names=scenario.parameter_labels, truth=scenario.truth),
    )


def _convergence(plan: Plan, one: Convergence) -> Picture:
    scenario = plan.base.scenario
    return Picture(
        "convergence",
        "Convergence",
        "Median over the runs of the parameters of the subjectively best model; the truth is thin (figure 5 of the "
        "paper).",
        convergence_figure(one.best_model, names=scenario.parameter_labels, truth=scenario.truth),
    )


def _convergence_of_errors(plan: Plan, one: Convergence) -> Picture:
    return Picture(
        "convergence",
        "Convergence",
        "Median over the runs of the absolute errors of the subjectively best model.",
        convergence_figure(one.best_error, names=plan.base.scenario.parameter_names),
    )


def _histogram(result: StudyResult) -> Picture:
    return Picture(
        "histogram",
        "Mean absolute errors",
        f"Of the estimate, {len(result.maes)} runs; the limits {GOOD:g} and {FAIR:g} are dashed (figure 14a of the "
        "paper).",
        error_histogram_figure(np.array(result.maes), limits=(GOOD, FAIR)),
    )


def _errors(result: StudyResult, plan: Plan) -> Picture:
    names = plan.base.scenario.parameter_names
    return Picture(
        "errors",
        "Absolute errors",
        "Of the subjectively best model of the last generation, parameter by parameter (figure 14b of the paper).",
        error_box_figure([errors_of(result.runs, "best_model", name) for name in names], names=names),
    )


def _by_configuration(result: StudyResult, plan: Plan) -> Picture:
    found = members(plan, result.runs)[:MOST_GROUPS]
    maes = [np.array([run.estimate_mae for run in own], dtype=float) for _, own in found]
    return Picture(
        "configurations",
        "Mean absolute errors",
        "Of the estimate, configuration by configuration"
        + (f"; the first {MOST_GROUPS} of {len(result.groups)}." if len(result.groups) > MOST_GROUPS else "."),
        error_box_figure(
            maes, names=[label(group).replace(", ", "\n") for group, _ in found], what="Mean absolute error", where=""
        ),
        wide=True,
    )


def label(group: Mapping[str, Any]) -> str:
    """Return the settings of a configuration in few words: the last part of each key is enough."""
    return ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in group.items())


def save_study_figures(drawings: Sequence[Picture], folder: StudyFolder) -> None:
    """Write every figure as PNG and SVG."""
    folder.figures_path.mkdir(exist_ok=True)
    for drawing in drawings:
        drawing.save(folder.figures_path)


def study_report(result: StudyResult, plan: Plan, drawings: Sequence[Picture]) -> str:
    """Return the page of a study."""
    listings = (*_summaries(result), _kinds(result), _runs(result))
    return study_page(
        StudyReport(
            title=f"{result.title}: a study of {report.counted(len(result.runs), 'run')}",
            verdict=f"{describe(result)}.",
            listings=listings,
            figures=tuple(drawings),
            warning=_warning(result),
            configuration=to_toml(plan.base),
        )
    )


def _warning(result: StudyResult) -> str:
    if result.complete:
        return ""
    parts = [f"{report.counted(len(result.failed), 'run')} failed"] if result.failed else []
    if open_runs := len(result.unfinished):
        parts.append(f"{report.counted(open_runs, 'run')} {'is' if open_runs == 1 else 'are'} not complete")
    return f"{' and '.join(parts)}: the statistics are of the others."


def _summaries(result: StudyResult) -> list[Listing]:
    groups = result.groups
    return [
        Listing(
            name="errors" if len(groups) == 1 else f"errors{number}",
            heading="Absolute errors" + (f": {label(group)}" if group else ""),
            columns=(
                "Parameter", "Estimate: mean", "Std. dev.", "Median", "Best model: mean", "Std. dev.", "Median",
                "Paper: mean",
            ),
            rows=_paired_rows([summary for summary in result.summaries if summary.group == group]),
            note="Mean, standard deviation and median over the complete runs. The paper reports the error of the best "
            "model.",
        )
        for number, group in enumerate(groups)
    ]  # fmt: skip


def _paired_rows(summaries: Sequence[ParameterSummary]) -> list[tuple[str | float | None, ...]]:
    """Return a row per parameter: errors of the estimate, of the best model, and the paper's."""
    return [
        (name, *_statistics(pair["estimate"]), *_statistics(pair["best_model"]), pair["best_model"].paper)
        for name, pair in paired(summaries).items()
    ]


def _statistics(one: ParameterSummary) -> tuple[float, float | None, float]:
    return one.mean, one.standard_deviation, one.median


def _kinds(result: StudyResult) -> Listing:
    return Listing(
        name="kinds",
        heading="Runs",
        columns=("Verdict", "Runs"),
        rows=list(result.kinds().items()),
        note=f"Good: MAE of the estimate below {GOOD:g}. Fair: below {FAIR:g}. Poor: {FAIR:g} or more, and how the estimate "
        "misses the truth.",
    )


def _runs(result: StudyResult) -> Listing:
    keys = list(result.runs[0].settings)
    return Listing(
        name="runs",
        heading="Every run",
        columns=("Run", *(key.removeprefix("run.") for key in keys), "Verdict", "MAE: estimate", "MAE: best model"),
        rows=[
            (
                run.number, *(_shown(run.settings[key]) for key in keys), run.verdict + (f": {run.reason}" if run.reason
                else ""), run.estimate_mae, None if run.result is None else run.result["mae"],
            )
            for run in result.runs
        ],
        folded=True,
    )  # fmt: skip


def _shown(value: Any) -> str | int | float:
    if isinstance(value, list):
        return ", ".join(f"{item:.3f}" if isinstance(item, float) else str(item) for item in value)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
