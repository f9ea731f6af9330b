"""One run in pictures: populations, dialogues, what its classifiers can tell, what its estimate leaves open.

Those of a run of trials are over the trials (G,) that it had spent after each of its G batches, if
these are given.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import require

from .style import (
    BLUE,
    DASHED,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    RULE,
    SKY,
    TRUE_VALUE,
    Panels,
    draw_line,
    new_figure,
    note,
    one_panel,
    panel_grid,
    prepare_axes,
    series,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CENTRAL_PERCENTILES = (0.5, 99.5)
"""Values between them are shown by a panel in any case."""
BAND_POINTS = 1000
"""Corners of a band's edge, at most; more could not be seen."""
TIMELINE_ROWS = 60
"""Rows that make a timeline higher; more are drawn closer."""
LEGEND_CHARACTERS = 75
"""Characters that fit side by side above a figure, with 4 for each line that a name explains."""


def parameters_figure(
    best_models: np.ndarray,
    typical_models: np.ndarray,
    *,
    names: Sequence[str],
    truth: Sequence[float] | None = None,
    trials: np.ndarray | None = None,
    panels: Panels | None = None,
) -> "Figure":
    """Draw the parameters of the best and of the typical model (G, P), a panel for each of P; the truth is dashed.

    A panel spans the central 99 % of its values and the truth; where that hides excursions, it
    names the full range. Figure 5 of the paper shows the same quantities for 30 runs.
    """
    panels = panels or panel_grid(names, 2.15, sharex=True)
    panels.over_generations("", len(best_models), trials)
    for k, axes in enumerate(panels.axes):
        best = best_models[:, k]
        typical = typical_models[:, k]
        draw_line(axes, best, trials, color=SKY, linewidth=0.6, alpha=0.9, label="best model")
        draw_line(axes, typical, trials, color=BLUE, linewidth=1.2, label=_typical(trials))
        values = np.concatenate([best, typical])
        limits = np.percentile(values, CENTRAL_PERCENTILES)
        if truth is not None:
            axes.axhline(truth[k], label="true value", **TRUE_VALUE)
            limits = np.append(limits, truth[k])
        low, high = limits.min(), limits.max()
        # a constant has no extent: a margin of its size keeps the axis from being empty
        margin = 0.12 * (high - low) or 0.1 * max(abs(high), 1.0)
        axes.set_ylim(low - margin, high + margin)
        if values.min() < low - margin or values.max() > high + margin:
            text = f"whole range {values.min():.3g} to {values.max():.3g}"
            note(axes, text.replace("-", "\N{MINUS SIGN}"), height=1.03)
        has_panel_below = k + panels.columns < len(panels.axes)
        if has_panel_below:
            axes.set_xlabel("")
        axes.tick_params(labelbottom=bool(axes.get_xlabel()))
    return panels.with_legend(ncols=3)


def _typical(trials: np.ndarray | None) -> str:
    """Return what the typical model is called."""
    if trials is None:
        return "median of the better half"
    return "estimate so far"


def error_figure(
    mae_best: np.ndarray, mae_typical: np.ndarray, *, trials: np.ndarray | None = None
) -> "Figure":
    """Draw the mean absolute errors (G,) of the best and of the typical model on a logarithmic axis."""
    panels, axes = one_panel(5.2, 3.1)
    draw_line(axes, mae_best, trials, color=SKY, linewidth=0.7, label="best model")
    draw_line(axes, mae_typical, trials, color=BLUE, linewidth=1.2, label=_typical(trials))
    panels.logarithmic(mae_best, mae_typical)
    panels.over_generations("Mean absolute error", len(mae_best), trials)
    return panels.with_legend(ncols=2)


def fitness_figure(
    model_fitness: np.ndarray,
    classifier_fitness: np.ndarray,
    *,
    stopped: np.ndarray,
    trials: np.ndarray | None = None,
    panels: Panels | None = None,
) -> "Figure":
    """Draw the subjective fitness of models (G, M) and classifiers (G, N), equations 1 and 2: median and quartiles.

    Generations in which selection stopped, (G,) bool, are shaded.
    """
    panels = panels or one_panel(5.2, 3.1)[0]
    (axes,) = panels.axes
    edges = np.flatnonzero(np.diff(np.asarray(stopped, dtype=bool), prepend=False, append=False))
    for number, (start, stop) in enumerate(edges.reshape(-1, 2)):
        # Named once in the legend.
        name = "selection stopped" if number == 0 else "_"
        axes.axvspan(start - 0.5, stop - 0.5, color=MUTED, alpha=0.3, linewidth=0.5, label=name)
    lines = (
        ("models", model_fitness, ORANGE, (0, (5, 1.2))),
        ("classifiers", classifier_fitness, BLUE, "-"),
    )
    for name, fitness, color, line in lines:
        lower, middle, upper = np.quantile(fitness, (0.25, 0.5, 0.75), axis=1)
        # A band of a long run has few corners, each the extreme of some generations.
        starts = np.arange(0, len(middle), -(-len(middle) // BAND_POINTS))
        low = np.minimum.reduceat(lower, starts)
        high = np.maximum.reduceat(upper, starts)
        over = starts if trials is None else trials[starts]
        axes.fill_between(over, low, high, color=color, alpha=0.22, linewidth=0)
        draw_line(axes, middle, trials, color=color, linewidth=1.2, linestyle=line, label=name)
    panels.over_generations("Fitness (median, quartiles)", len(model_fitness), trials)
    return panels.with_legend(ncols=3)


def step_sizes_figure(
    model_step_sizes: np.ndarray, classifier_step_sizes: np.ndarray, *, names: Sequence[str]
) -> "Figure":
    """Draw the step sizes of each parameter (G, P) and of the classifiers (G,) on a logarithmic axis."""
    panels, axes = one_panel(5.2, 3.1)
    for k, name in enumerate(names):
        # A legend reads dollar signs as formulas and skips names with a leading underscore.
        plain = ("\u200b" if name.startswith("_") else "") + name.replace("$", r"\$")
        draw_line(axes, model_step_sizes[:, k], linewidth=1.1, label=plain, **series(k))
    draw_line(axes, classifier_step_sizes, color=INK, linewidth=1.8, label="classifiers")
    panels.logarithmic(model_step_sizes, classifier_step_sizes)
    panels.over_generations("Step size (median)", len(model_step_sizes))
    # As many names in a row as fit above the figure.
    longest = max(map(len, (*names, "classifiers")))
    return panels.with_legend(ncols=max(1, min(5, LEGEND_CHARACTERS // (longest + 4))))


def dialogues_figure(
    dialogues: Mapping[str, np.ndarray],
    *,
    names: Sequence[str],
    rows: Sequence[str],
    interval_s: float,
) -> "Figure":
    """Draw stimuli (n, 2, T, S) beside answers (n, 2, T, D), in n rows with these titles; names are of answers, then stimuli.

    Stimuli have the `ranges` (S, 2). `outputs` (n, 2) and `accuracy` (n,) are written above the
    rows, where classifiers chose.
    """
    stimuli = dialogues["stimuli"]
    answers = dialogues["answers"]
    outputs = dialogues.get("outputs")
    count, _, steps, stimulus_count = stimuli.shape
    answer_count = answers.shape[3]
    # Stimuli stand in the first columns, though their names are the last.
    signals = [*range(answer_count, answer_count + stimulus_count), *range(answer_count)]
    figure = new_figure(max(7.2, 2.4 * len(signals)), 0.7 + 1.6 * count)
    grid = figure.subplots(count, len(signals), sharex=True, squeeze=False)
    panels = Panels(figure, list(grid.flat), len(signals))
    time = np.arange(1, steps + 1) * (interval_s or 1.0)
    for row, axes_of_row in enumerate(grid):
        for signal, axes in zip(signals, axes_of_row, strict=True):
            prepare_axes(axes)
            if signal < answer_count:
                values = answers[row, ..., signal]
                look: dict[str, Any] = {"linewidth": 1.1, "drawstyle": "default"}
            else:
                values = stimuli[row, ..., signal - answer_count]
                look = {"linewidth": 1.1, "drawstyle": "steps-post"}
                low, high = dialogues["ranges"][signal - answer_count]
                margin = 0.06 * (high - low)
            axes.plot(time, values[0], color=BLUE, linestyle="-", label="system", **look)
            axes.plot(time, values[1], color=ORANGE, linestyle=DASHED, label="estimate", **look)
            if signal >= answer_count:
                axes.set_ylim(low - margin, high + margin)
            axes.set_ylabel(names[signal].replace("_", " "))
            if row == count - 1:
                axes.set_xlabel("Time (s)" if interval_s else "Step")
        if outputs is not None:
            text = f"{rows[row]}: {dialogues['accuracy'][row]:.0%} right; output {outputs[row, 0]:.2f} for the system, "
            axes_of_row[0].set_title(
                f"{text}{outputs[row, 1]:.2f} for the estimate", loc="left", fontsize="small"
            )
    return panels.with_legend(ncols=2)


def accuracy_figure(
    generations: np.ndarray,
    *,
    subjective: np.ndarray,
    objective: np.ndarray,
    jury: np.ndarray | None = None,
) -> "Figure":
    """Draw the decision accuracy (R, G) of the best classifiers of some generations (G,), as in figure 7 of the paper.

    `subjective` is that of the classifier with the highest subjective fitness; `objective` and
    `jury` are the highest of a single classifier of the population, and of the population or its
    archive: mean and deviation over the runs. The horizontal axis is linear up to generation 1 and
    logarithmic from there.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    panels, axes = one_panel(5.2, 3.3)
    for values, name, color, marker, dashes in (
        (jury, "best with archive (objective)", GREEN, "^", ":"),
        (objective, "best classifier (objective)", BLUE, "s", "-"),
        (subjective, "best classifier (subjective)", ORANGE, "o", "--"),
    ):
        if values is not None:
            deviation = values.std(axis=0) if len(values) > 1 else None
            axes.errorbar(
                generations, values.mean(axis=0), yerr=deviation, color=color, marker=marker, markersize=4, linestyle=dashes,
                linewidth=1.3, elinewidth=0.8, capsize=2, label=name,
            )  # fmt: skip
    # generation 0 is shown, and later ones by their logarithm
    axes.set_xscale("symlog", linthresh=1)
    limit = 1.2 * max(generations.max(), 1)
    axes.xaxis.set_major_locator(FixedLocator([0, *(10**k for k in range(7) if 10**k <= limit)]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(-0.2, limit)
    edges: list[np.ndarray] = []
    for values in (objective, subjective):
        edges += [
            values.mean(axis=0) - values.std(axis=0),
            values.mean(axis=0) + values.std(axis=0),
        ]
    # The lower limit is a multiple of 0.05.
    axes.set_ylim(min(0.5, 100 * np.min(edges) // 5 / 20), max(1.0, np.max(edges)) + 0.01)
    panels.label("Decision accuracy", "Generation")
    return panels.with_legend(ncols=2)


def quantities_figure(
    distributions: Mapping[str, tuple[np.ndarray, np.ndarray, np.ndarray]],
    *,
    panels: Panels | None = None,
    labels: tuple[str, str] = ("genuine", "simulated at the estimate"),
) -> "Figure":
    """Draw distributions of genuine and of simulated motion, one panel each, with labels of both.

    `distributions` holds name -> edges of bins (B + 1,), shares of genuine and of simulated values
    in them (B,).
    """
    panels = panels or panel_grid(list(distributions), 2.1)
    for axes, (edges, genuine, simulated) in zip(panels.axes, distributions.values(), strict=True):
        axes.stairs(genuine, edges, fill=True, color=SKY, alpha=0.45, label=labels[0])
        axes.stairs(simulated, edges, color=ORANGE, linewidth=1.3, label=labels[1])
        axes.set_ylim(bottom=0)
    panels.label("Share", "")
    return panels.with_legend(ncols=2)


@dataclass(frozen=True, eq=False)
class ParameterProfile:
    """One panel of `profiles_figure`: accuracy of fresh classifiers over the values of a parameter."""

    name: str  # with the unit
    values: np.ndarray  # ascending (G,)
    accuracies: np.ndarray  # at each value (G,)
    # Accuracies above which the classifiers do not guess (G,)
    criticals: np.ndarray
    estimate: float
    interval: Sequence[float] | None  # None, and not drawn, where it is not known
    # Estimates of runs whose truth was the estimate
    recovered: Sequence[float] = field(default=())
    logarithmic: bool = False


def profiles_figure(profiles: Sequence[ParameterProfile]) -> "Figure":
    """Draw how well fresh classifiers tell genuine samples from models in which one parameter is moved, one panel each."""
    panels = panel_grid([profile.name for profile in profiles], 2.1)
    for axes, profile in zip(panels.axes, profiles, strict=True):
        if profile.interval is not None:
            axes.axvspan(*profile.interval, color=MUTED, alpha=0.22, linewidth=0, label="interval")
        axes.axvline(profile.estimate, color=INK, linewidth=1.0, label="estimate")
        look: dict[str, Any] = {"linewidth": 1.3, "marker": "o", "markersize": 3.5}
        axes.plot(profile.values, profile.accuracies, color=BLUE, label="fresh classifiers", **look)
        look = {"linewidth": 1.0, "linestyle": DASHED}
        axes.plot(profile.values, profile.criticals, color=MUTED, label="guessing, 95 %", **look)
        if len(profile.recovered):
            foot = np.full(len(profile.recovered), 0.42)
            look = {"marker": "^", "markersize": 6, "linestyle": "none"}
            axes.plot(profile.recovered, foot, color=GREEN, label="recovered", **look)
        # from below guessing (0.5) and below the marks at 0.42 to above 1
        axes.set_ylim(min(0.38, float(profile.accuracies.min()) - 0.03), 1.02)
        if profile.logarithmic:
            axes.set_xscale("log")
    panels.label("Accuracy", "")
    return panels.with_legend()


def timeline_figure(
    names: Sequence[str],
    windows: Sequence[np.ndarray],
    scores: Sequence[np.ndarray],
    abnormal: Sequence[np.ndarray],
    *,
    limit: float,
    flagged: str = "abnormal",
    unjudged: Collection[str] = (),
) -> "Figure":
    """Draw a row for each individual: the score of its motion over time, shaded where it is called abnormal.

    Parameters
    ----------
    names
        Of the individuals A, at least one.
    windows : A arrays (W, 2)
        Begin and end (s) of each window.
    scores : A arrays (W,)
        Mean score of the windows around each, 0 to 1.
    abnormal : A arrays (W,) bool
        Whether a window is called abnormal.
    limit
        Longest time shown (s).
    flagged
        What such a window is called in the legend.
    unjudged
        Names of those who are too short to judge: gray.
    """
    fits = len(names) == len(windows) == len(scores) == len(abnormal) > 0
    require(fits, "names", "be one name for each of the individuals, at least one", len(names))
    panels, axes = one_panel(8.4, 0.34 * min(len(names), TIMELINE_ROWS) + 1.1)
    axes.grid(visible=False)
    for row in range(len(names)):
        spans = array("windows", windows[row], "W 2")
        values = array("scores", scores[row], "W", W=len(spans))
        is_abnormal = array("abnormal", abnormal[row], "W", dtype=bool, W=len(spans))
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
        usual = (~is_abnormal, SKY, "normal")
        if names[row] in unjudged:
            usual = (~is_abnormal, MUTED, "too short to judge")
        for chosen, color, name in (usual, (is_abnormal, ORANGE, flagged)):
            if chosen.any():
                axes.bar(
                    spans[chosen, 0], -0.8 * values[chosen] - 0.02, width=np.diff(spans[chosen])[:, 0], bottom=row + 0.4,
                    align="edge", color=color, linewidth=0, label=name,
                )  # fmt: skip
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
    axes.set_xlim(0, limit)
    axes.set_ylim(len(names) - 0.5, -0.6)
    axes.set_yticks(np.arange(len(names)), list(map(str, names)), color=INK, parse_math=False)
    panels.label("", "Time (s)")
    return panels.with_legend(ncols=3)


def paths_figure(
    names: Sequence[str], paths: Sequence[np.ndarray], abnormal: Sequence[bool]
) -> "Figure":
    """Draw where some individuals were, paths (F, 2) in cm with NaN for gaps, a panel each, on the same scale."""
    panels = panel_grid(names, 2.4)
    panels.figure.set_layout_engine("constrained", hspace=0.08)
    positions = np.concatenate(paths)
    low = np.nanmin(positions, axis=0)
    high = np.nanmax(positions, axis=0)
    margin = 0.04 * (high - low)
    low = low - margin
    high = high + margin
    for axes, path, is_abnormal in zip(panels.axes, paths, abnormal, strict=True):
        axes.plot(path[:, 0], path[:, 1], color=ORANGE if is_abnormal else BLUE, linewidth=0.8)
        last_seen = np.flatnonzero(np.isfinite(path[:, 0]))[-1]
        axes.plot(*path[last_seen], color=INK, marker="o", markersize=4)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.grid(visible=False)
    return panels.figure
