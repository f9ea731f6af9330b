"""Figures and page of a study: hand the numbers to the rooms that draw."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from turing_learning import report
from turing_learning.config import to_toml
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._many_runs import convergence_figure, error_box_figure, error_histogram_figure
from turing_learning.report._page import Listing, Report, report_page

from ._plan import Plan
from ._table import FAIR, GOOD, Convergence, StudyResult, describe, errors_of, members, paired

MOST_GROUPS = 40  # boxes in one picture


def draw_study(result: StudyResult, plan: Plan, medians: Sequence[Convergence]) -> list[Picture]:
    """Draw the figures of a study; none if no run is complete.

    Parameters
    ----------
    result
        The table.
    plan
        What was run.
    medians
        Of each configuration.
    """
    of_trials = plan.configuration(1).run.trials > 0
    chosen, what = "best_model", "subjectively best model of the last generation"
    if of_trials:
        chosen, what = "estimate", "estimate"
    models = np.array([list(run.result[chosen].values()) for run in result.runs if run.result is not None])
    if not len(models):
        return []
    scenario, truth = plan.base.scenario, plan.base.scenario.truth
    names, labels = scenario.parameter_names, scenario.parameter_labels
    boxes = Picture(
        "boxes",
        "Inferred parameters",
        f"{what.capitalize()}, {len(models)} runs: median, quartiles, whiskers up to 1.5 "
        "interquartile ranges"
        + ("." if truth is None else "; the truth is dashed (figure 4 of the paper).")
        + (" Of networks: their steady outputs." if plan.base.models.hidden else ""),
        box_figure(models, names=labels, truth=truth),
    )
    if not result.maes:
        return [boxes]
    if len(result.groups) > 1:
        found = members(plan, result.runs)[:MOST_GROUPS]
        maes = [np.array([run.estimate_mae for run in own], dtype=float) for _, own in found]
        more = f"; the first {MOST_GROUPS} of {len(result.groups)}" if len(result.groups) > MOST_GROUPS else ""
        words = [label(group).replace(", ", "\n") for group, _ in found]
        figure = error_box_figure(maes, names=words, what="Mean absolute error", where="")
        caption = f"Of the estimate, configuration by configuration{more}."
        return [Picture("configurations", "Mean absolute errors", caption, figure, wide=True)]
    histogram = Picture(
        "histogram",
        "Mean absolute errors",
        f"Of the estimate, {len(result.maes)} runs; {GOOD:g} and {FAIR:g} are dashed where errors reach them (paper: figure 14a).",
        error_histogram_figure(np.array(result.maes), limits=(GOOD, FAIR)),
    )
    kind = "typical" if of_trials else "best"  # of a run of trials, the typical model is the estimate
    over = plan.configuration(1).spent(len(medians[0].best_model))
    if plan.behaviors:
        errors = Picture(
            "errors",
            "Absolute errors",
            f"Of the {what}, parameter by parameter (figure 14b of the paper).",
            error_box_figure([errors_of(result.runs, chosen, name) for name in names], names=names),
        )
        convergence = Picture(
            "convergence",
            "Convergence",
            f"Median over the runs of the absolute errors of the {what}.",
            convergence_figure(getattr(medians[0], f"{kind}_error"), names=names, trials=over),
        )
        return [histogram, errors, convergence]
    convergence = Picture(
        "convergence",
        "Convergence",
        f"Median over the runs of the {what}; the truth is thin (figure 5 of the paper).",
        convergence_figure(getattr(medians[0], f"{kind}_model"), names=labels, truth=truth, trials=over),
        wide=True,
    )
    return [boxes, histogram, convergence]


def label(group: Mapping[str, Any]) -> str:
    """Return the settings of a configuration in few words: the last part of each key is enough."""
    return ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in group.items())


def study_report(result: StudyResult, plan: Plan, drawings: Sequence[Picture]) -> str:
    """Return the page of a study."""
    errors = _summaries(result) or [_estimates(result)]
    listings = (*errors, _kinds(result), _runs(result))
    return report_page(
        Report(
            title=f"{result.title}: a study of {report.counted(len(result.runs), 'run')}",
            summary=f"{describe(result)}.",
            listings=listings,
            figures=drawings,
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
    """Return, for each configuration, a row per parameter: errors of the estimate, of the best model, and the paper's."""
    groups, listings = result.groups, []
    for number, group in enumerate(groups):
        rows: list[tuple[str | float | None, ...]] = []
        for name, pair in paired(one for one in result.summaries if one.group == group).items():
            ours, best = pair["estimate"], pair["best_model"]
            numbers = (each for one in (ours, best) for each in (one.mean, one.standard_deviation, one.median))
            rows.append((name, *numbers, best.paper))
        listings.append(
            Listing(
                name="errors" if len(groups) == 1 else f"errors{number}",
                heading="Absolute errors" + (f": {label(group)}" if group else ""),
                columns=("Parameter", "Estimate: mean", "Std. dev.", "Median", "Best model: mean", "Std. dev.", "Median",
                         "Paper: mean"),
                rows=rows,
                note="Mean, standard deviation and median over the complete runs. The paper reports the error of the best "
                "model.",
            )
        )  # fmt: skip
    return listings


def _estimates(result: StudyResult) -> Listing:
    """Return how much the estimates of runs differ whose truth nobody knows."""
    found = [run.result["estimate"] for run in result.runs if run.result is not None]
    rows = [
        (name, *np.quantile([one[name] for one in found], (0.5, 0.25, 0.75)).tolist()) for name in (found or [{}])[0]
    ]
    columns = ("Parameter", "Estimate: median", "Lower quartile", "Upper quartile")
    return Listing("estimates", "Estimates", columns, rows, "Over the complete runs. The truth is not known.")


def _kinds(result: StudyResult) -> Listing:
    note = (
        "What the complete runs say of themselves, without the truth; then how good they are. "
        f"Good: MAE of the estimate below {GOOD:g}. Fair: below {FAIR:g}. Poor: {FAIR:g} or more, and how the estimate "
        "misses the truth."
    )
    both = (("Verdict", result.verdicts()), ("Against the truth", result.kinds()))
    rows = [(f"{what}: {word}", count) for what, counts in both for word, count in counts.items()]
    return Listing("kinds", "Runs", ("What they say", "Runs"), rows, note)


def _runs(result: StudyResult) -> Listing:
    keys = list(result.runs[0].settings)
    columns = (
        "Run",
        *(key.removeprefix("run.") for key in keys),
        "Says",
        "Against the truth",
        "MAE: estimate",
        "MAE: best model",
    )
    rows = [
        (
            run.number,
            *(_shown(run.settings[key]) for key in keys),
            run.says,
            f"{run.verdict}: {run.reason}" if run.reason else run.verdict,
            run.estimate_mae,
            None if run.result is None else run.result["mae"],
        )
        for run in result.runs
    ]
    return Listing("runs", "Every run", columns, rows, folded=True)


def _shown(value: Any) -> str | int | float:
    if isinstance(value, list):
        return ", ".join(f"{item:.3f}" if isinstance(item, float) else str(item) for item in value)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
