"""Error over trials beside other methods: ``python figure.py`` draws docs/images/error-over-trials.png and prints the medians.

The runs of this project are those of curves.py (seeds 3001 to 3030); all others are the runs of ``turing-learning reproduce 4.5+``,
whose tables are in experiments/4.5+/tables.
"""

from pathlib import Path

import pandas as pd

from turing_learning.figures import save_figure
from turing_learning.figures._many_runs import budget_figure

HERE = Path(__file__).parent
METHODS = {
    "few": "Turing Learning, trials=N",
    "turing-learning": "by generations",
    "npe-rounds": "NPE, 2 rounds",
    "npe": "NPE",
    "abc-smc": "ABC-SMC",
}


def main() -> None:
    """Draw the figure and print the table."""
    panels, rows = {}, []
    for title, case in (("aggregation", "aggregation"), ("object clustering", "object-clustering")):
        ours = pd.read_csv(HERE / f"{case}.csv").rename(columns={"mae": "MAE"}).assign(method="few")
        others = pd.read_csv(HERE.parent / "4.5+" / "tables" / f"{case}-runs.csv")
        runs = pd.concat([ours, others])
        panels[title] = {}
        for method, name in METHODS.items():
            groups = {int(trials): each["MAE"] for trials, each in runs[runs["method"] == method].groupby("trials")}
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
    save_figure(figure, HERE.parents[1] / "docs" / "images", "error-over-trials")
    print(pd.DataFrame(rows).to_string(index=False, float_format="{:.4f}".format))


if __name__ == "__main__":
    main()
