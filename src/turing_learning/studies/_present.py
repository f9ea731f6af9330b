"""Figures and page of a study: hand the numbers to the rooms that draw."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from turing_learning import report
from turing_learning.config import to_toml
from turing_learning.figures import Picture, box_figure
from turing_learning.figures.many_runs import convergence_figure, error_box_figure, error_histogram_figure
from turing_learning.report import Listing, Report, report_page

from ._plan import Plan
from ._table import FAIR, GOOD, Convergence, StudyResult, describe, error_rows, errors_of, members

MOST_GROUPS = 40  # boxes in one picture


def draw_study(result: StudyResult, plan: Plan, medians: Sequence[Convergence]) -> list[Picture]:
    """Draw the figures of a study, with the medians of each configuration; none if no run is complete."""
    of_trials = plan.configuration(1).run.trials > 0
    chosen, kind, what = "best_model", "best", "subjectively best model of the last generation"
    if of_trials:  # whose typical model is the estimate
        chosen, kind, what = "estimate", "typical", "estimate"
    models = np.array([list(run.result[chosen].values()) for run in result.runs if run.result is not None])
    if not len(models):
        return []
    scenario, truth = plan.base.scenario, plan.base.scenario.truth
    names, labels = scenario.parameter_names, scenario.parameter_labels
    caption = f"{what.capitalize()}, {len(models)} runs: median, quartiles, whiskers up to 1.5 interquartile ranges"
    caption += "." if truth is None else "; the truth is dashed (figure 4 of the paper)."
    caption += " Of networks: their steady outputs." if plan.base.models.hidden else ""
    boxes = Picture("boxes", "Inferred parameters", caption, box_figure(models, names=labels, truth=truth))
    if not result.maes:
        return [boxes]
    if len(result.groups) > 1:
        found = members(plan, result.runs)[:MOST_GROUPS]
        maes = {label(group): np.array([run.estimate_mae for run in own], dtype=float) for group, own in found}
        more = f"; the first {MOST_GROUPS} of {len(result.groups)}" if len(result.groups) > MOST_GROUPS else ""
        named = {name.replace(", ", "\n"): errors for name, errors in maes.items()}
        figure = error_box_figure(named, what="Mean absolute error", where="")
        caption = f"Of the estimate, configuration by configuration{more}."
        return [Picture("configurations", "Mean absolute errors", caption, figure, wide=True)]
    caption = f"Of the estimate, {len(result.maes)} runs; {GOOD:g} and {FAIR:g} are dashed where errors reach them"
    figure = error_histogram_figure(np.array(result.maes), limits=(GOOD, FAIR))
    histogram = Picture("histogram", "Mean absolute errors", f"{caption} (paper: figure 14a).", figure)
    over = plan.configuration(1).spent(len(medians[0][1]["best_mae"]))
    if plan.behaviors:
        caption = f"Of the {what}, parameter by parameter (figure 14b of the paper)."
        figure = error_box_figure({name: errors_of(result.runs, chosen, name) for name in names})
        errors = Picture("errors", "Absolute errors", caption, figure)
        caption = f"Median over the runs of the absolute errors of the {what}."
        figure = convergence_figure({"": medians[0][1][f"{kind}_error"]}, names=names, trials=over)
        return [histogram, errors, Picture("convergence", "Convergence", caption, figure)]
    caption = f"Median over the runs of the {what}; the truth is thin (figure 5 of the paper)."
    figure = convergence_figure({"": medians[0][1][f"{kind}_model"]}, names=labels, truth=truth, trials=over)
    return [boxes, histogram, Picture("convergence", "Convergence", caption, figure, wide=True)]


def label(group: Mapping[str, Any]) -> str:
    """Return the settings of a configuration in few words: the last part of each key is enough."""
    return ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in group.items())


def study_report(result: StudyResult, plan: Plan, drawings: Sequence[Picture]) -> str:
    """Return the page of a study."""
    parts = [f"{report.counted(len(result.failed), 'run')} failed"] if result.failed else []
    if open_runs := len(result.unfinished):
        parts.append(f"{report.counted(open_runs, 'run')} {'is' if open_runs == 1 else 'are'} not complete")
    both = (("Verdict", result.verdicts()), ("Against the truth", result.kinds()))
    kinds = Listing(
        "kinds",
        "Runs",
        ("What they say", "Runs"),
        [(f"{what}: {word}", count) for what, counts in both for word, count in counts.items()],
        "What the complete runs say of themselves, without the truth; then how good they are. "
        f"Good: MAE of the estimate below {GOOD:g}. Fair: below {FAIR:g}. Poor: {FAIR:g} or more, and how the estimate "
        "misses the truth.",
    )
    return report_page(
        Report(
            title=f"{result.title}: a study of {report.counted(len(result.runs), 'run')}",
            summary=f"{describe(result)}.",
            listings=(*(_errors(result) or [_estimates(result)]), kinds, _runs(result)),
            figures=drawings,
            warning=f"{' and '.join(parts)}: the statistics are of the others." if parts else "",
            configuration=to_toml(plan.base),
        )
    )


def _errors(result: StudyResult) -> list[Listing]:
    """Return, for each configuration, a row per parameter: errors of the estimate, of the best model, and the paper's."""
    spread = ("Std. dev.", "Median")
    columns = ("Parameter", "Estimate: mean", *spread, "Best model: mean", *spread, "Paper: mean")
    note = "Mean, standard deviation and median over the complete runs. The paper reports the error of the best model."
    return [
        Listing(
            "errors" if len(result.groups) == 1 else f"errors{number}",
            "Absolute errors" + (f": {label(group)}" if group else ""),
            columns,
            [(name, *numbers, paper) for name, numbers, paper in error_rows(result, group)],
            note,
        )
        for number, group in enumerate(result.groups)
    ]


def _estimates(result: StudyResult) -> Listing:
    """Return how much the estimates of runs differ whose truth nobody knows."""
    found, shares = [run.result["estimate"] for run in result.runs if run.result is not None], (0.5, 0.25, 0.75)
    rows = [(name, *np.quantile([one[name] for one in found], shares).tolist()) for name in (found or [{}])[0]]
    columns = ("Parameter", "Estimate: median", "Lower quartile", "Upper quartile")
    return Listing("estimates", "Estimates", columns, rows, "Over the complete runs. The truth is not known.")


def _runs(result: StudyResult) -> Listing:
    keys = list(result.runs[0].settings)
    names = [key.removeprefix("run.") for key in keys]
    columns = ("Run", *names, "Says", "Against the truth", "MAE: estimate", "MAE: best model")
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
