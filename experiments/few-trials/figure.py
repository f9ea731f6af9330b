"""Error over trials beside other methods, and what intervals hold over recordings: ``python figure.py`` draws
docs/images/error-over-trials.png and intervals-over-recordings.png, and prints the medians.

The runs of this project are those of curves.py (seeds from 3001 on); all others are the runs of ``turing-learning reproduce 4.5+``,
whose tables are in experiments/4.5+/tables.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from intervals import KNOWN
from scipy.stats import binomtest

from turing_learning.figures import save_figure
from turing_learning.figures.many_runs import budget_figure
from turing_learning.figures.style import label, new_figure, prepare_axes, series

HERE = Path(__file__).parent
IMAGES = HERE.parents[1] / "docs" / "images"
METHODS = {
    "few": "Turing Learning, trials=N",
    "turing-learning": "by generations",
    "npe-rounds": "NPE, 2 rounds",
    "npe": "NPE",
    "abc-smc": "ABC-SMC",
}


def recordings_figure():
    """Draw the walker's errors, and the share of intervals that hold the truth with its 95 % interval, over recordings."""
    rows = pd.read_csv(HERE / "intervals.csv")
    rows = rows[
        (rows.trials == 3000) & rows.parameter.isin([*KNOWN, "gain x noise"]) & rows.low.notna()
    ]
    rows = rows.assign(K=rows.case.str.extract(r"walker-(\d+)")[0].astype(int))
    figure = new_figure(8.2, 3.4)
    left, right = figure.subplots(1, 2)
    ways = {"3,000 trials": rows.estimate, "maximum likelihood": rows.likelihood}
    for place, (name, found) in enumerate(ways.items()):
        share = ((found - rows.truth) / rows.truth).abs().groupby(rows.K).median()
        left.plot(
            share.index,
            share,
            marker="os"[place],
            markersize=5,
            linewidth=1.3,
            label=name,
            **series(place),
        )
    left.legend(frameon=False, fontsize=9)
    held = (
        ((rows.low <= rows.truth) & (rows.truth <= rows.high)).groupby(rows.K).agg(["sum", "size"])
    )
    tests = [binomtest(int(a), int(b)).proportion_ci(method="wilson") for a, b in held.to_numpy()]
    shares = (held["sum"] / held["size"]).to_numpy()
    ends = np.abs(np.array([[one.low, one.high] for one in tests]).T - shares)
    right.errorbar(
        held.index, shares, yerr=ends, fmt="o", markersize=5, capsize=3, color=series(0)["color"]
    )
    right.axhline(0.9, color="0.5", linewidth=1, linestyle="--")
    right.set_ylim(0.75, 1.01)
    for axes, text in (
        (left, "Median error, share of the truth"),
        (right, "Share of intervals that hold"),
    ):
        prepare_axes(axes)
        axes.set_xscale("log")
        label(axes, text, "Recordings")
        axes.set_xticks(sorted(set(rows.K)), [f"{k:,}" for k in sorted(set(rows.K))])
        axes.minorticks_off()
    return figure


def main() -> None:
    """Draw the figure and print the table."""
    panels, rows = {}, []
    for title, case in (("aggregation", "aggregation"), ("object clustering", "object-clustering")):
        ours = pd.read_csv(HERE / f"{case}.csv").rename(columns={"mae": "MAE"}).assign(method="few")
        others = pd.read_csv(HERE.parent / "4.5+" / "tables" / f"{case}-runs.csv")
        runs = pd.concat([ours, others])
        panels[title] = {}
        for method, name in METHODS.items():
            groups = {
                int(trials): each["MAE"]
                for trials, each in runs[runs["method"] == method].groupby("trials")
            }
            panels[title][name] = {trials: errors.to_numpy() for trials, errors in groups.items()}
            rows += [
                {
                    "case": title,
                    "method": name,
                    "trials": n,
                    "runs": len(errors),
                    "median": errors.median(),
                    "worst": errors.max(),
                }
                for n, errors in groups.items()
            ]
    figure = budget_figure(panels)
    save_figure(figure, IMAGES, "error-over-trials")
    save_figure(recordings_figure(), IMAGES, "intervals-over-recordings")
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.4f}".format))


if __name__ == "__main__":
    main()
