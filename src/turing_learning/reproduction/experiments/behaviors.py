"""Section 4.6.4: random behaviors, most of which do nothing that an observer would give a name."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import compare
from turing_learning.figures._many_runs import error_box_figure, error_histogram_figure
from turing_learning.swarm import AGGREGATION

from .._experiment import Captions, Experiment, Findings, stacked
from .._verdicts import ClaimVerdict, listed, load_claims, not_worse, printed_spreads, shares_not_worse, spreads_of
from .._work import Work
from ._shared import KINDS, PRESETS, Runs, ShareSizes, seeded, sensor_shares, small, values_of, variant_of

ID, CLAIM = "4.6.4", "4.6.4-random-behaviors"
PAPER_RUNS = 1000
GOOD, FAIR = 0.05, 0.1
DRAWS = 200  # draws of few runs from many: how often do a few show what many do?
NAMES = AGGREGATION.parameter_names


@dataclass(frozen=True)
class BehaviorSizes:
    """How many runs of each preset, and how often behaviors see another robot."""

    runs: Mapping[str, int] = field(default_factory=lambda: {"default": 200, "paper": 30})
    generations: int = 1000
    first_seed: int = 2001
    settings: Mapping[str, Any] = field(default_factory=dict)
    shares: ShareSizes = field(default_factory=ShareSizes)


def conduct(work: Work) -> Findings:
    """Conduct runs with each preset, and see how often each behavior of the first one sees another robot."""
    from scipy.stats import binomtest

    sizes: BehaviorSizes = work.sizes
    captions, all_runs, behaviors, summary, tables, pictures = Captions(ID), [], [], {}, [], []
    for preset in PRESETS:
        result = work.runs(f"study-{preset}", "random-behaviors", preset, runs=sizes.runs[preset])
        runs, truth = Runs.of(result, preset, NAMES), values_of(result, "truth")
        all_runs.append(runs)
        behaviors.append(truth)
        for kind in KINDS:
            maes = runs.maes(kind)
            ends = binomtest(int(np.count_nonzero(maes < GOOD)), len(maes)).proportion_ci(0.95)
            shares = {"share_below_0.05": np.mean(maes < GOOD), "low": ends.low, "high": ends.high}
            row = {"runs": len(maes), **shares, "share_above_0.1": np.mean(maes > FAIR)}
            means = dict(zip(NAMES, runs.errors[kind].mean(axis=0), strict=True))
            summary[preset, kind] = pd.DataFrame([row | means])
        frame = seeded(runs.seeds, truth, NAMES)
        frame[[f"estimate_{name}" for name in NAMES]] = runs.models["estimate"]
        frame = frame.assign(best_model_mae=runs.maes("best_model"), estimate_mae=runs.maes("estimate"))
        tables.append(captions.table("{preset}-runs", frame, preset=preset))
        words = {"preset": preset, "runs": len(runs)}
        histogram = error_histogram_figure(runs.maes("best_model"), limits=(GOOD, FAIR))
        boxes = error_box_figure(list(runs.errors["best_model"].T), names=NAMES)
        pictures += [
            captions.picture("{preset}-histogram", CLAIM, histogram, **words),
            captions.picture("{preset}-errors", CLAIM, boxes, **words),
        ]

    def compute() -> dict[str, Any]:
        swarms = (replace(AGGREGATION, controller=tuple(map(float, behavior))) for behavior in behaviors[0])
        return {"shares": [float(sensor_shares(swarm, sizes.shares)[..., 1].mean()) for swarm in swarms]}

    most, sees = all_runs[0], np.array(work.piece("shares", compute)["shares"])
    frame = seeded(most.seeds, behaviors[0], NAMES)
    frame = frame.assign(estimate_mae=most.maes("estimate"), share_of_I_1=sees, rank=np.argsort(np.argsort(sees)) + 1)
    failures = frame[frame["estimate_mae"] >= GOOD]
    return Findings(
        [behaviors_verdict(runs, kind, most.errors[kind]) for runs in all_runs for kind in KINDS],
        [
            captions.table("summary", stacked(summary, "preset", "model")),
            *tables,
            captions.table("failures", failures, runs=len(sees), median=np.median(sees)),
        ],
        pictures,
    )


def behaviors_verdict(runs: Runs, kind: str, of_most: np.ndarray) -> ClaimVerdict:
    """Hold the errors against the claim; `of_most` are those (R, P) of the preset with the most runs."""
    values, maes = load_claims()[CLAIM].values, runs.maes(kind)
    printed, observed = printed_spreads(CLAIM, PAPER_RUNS), spreads_of(runs.errors[kind])
    good, bad = float(np.mean(maes < GOOD)), float(np.mean(maes > FAIR))
    printed_good, printed_bad = values["share_mae_below_0_05"], values["count_mae_above_0_1"] / PAPER_RUNS
    found = (
        not_worse(observed, printed)
        and shares_not_worse(good, len(maes), printed_good, PAPER_RUNS)
        and shares_not_worse(1 - bad, len(maes), 1 - printed_bad, PAPER_RUNS)
    )
    harder = depends_on_the_reading(runs.errors[kind])
    reason = ""
    if found and not harder and len(maes) < len(of_most):  # how often do so few runs show what is harder?
        rng, many = np.random.default_rng(1), len(of_most)
        few = [depends_on_the_reading(of_most[rng.choice(many, len(maes), replace=False)]) for _ in range(DRAWS)]
        reason = (
            f"{len(maes)} runs are few for comparing I = 0 with I = 1: of {DRAWS} draws of {len(maes)} from the {many} runs of "
            f"the default preset, {np.mean(few):.0%} show that difference"
        )
    return ClaimVerdict(
        CLAIM,
        found and harder,
        f"MAE below {GOOD} in {printed_good:.0%} of {PAPER_RUNS} runs, above {FAIR} in {printed_bad:.1%}; "
        f"{listed(NAMES, printed, 2)}; vl0 and vr0 significantly lower",
        f"MAE below {GOOD} in {good:.1%} of {len(maes)} runs, above {FAIR} in {bad:.1%}; {listed(NAMES, observed)}; "
        f"vl0 and vr0 {'' if harder else 'not '}significantly lower",
        "random behaviors",
        variant_of(runs.preset, kind),
        reason,
    )


def depends_on_the_reading(errors: np.ndarray) -> bool:
    """Return whether the errors (R, P) for I = 1 are significantly larger than those for I = 0, each against each."""
    tests = [compare(errors[:, k], [errors[:, 2], errors[:, 3]], level=0.05 / 2) for k in (0, 1)]
    medians = np.median(errors, axis=0)
    return all(test.significant.all() for test in tests) and medians[:2].max() < medians[2:].min()


EXPERIMENT = Experiment.of(
    ID, conduct, full=BehaviorSizes(),
    fast=BehaviorSizes(
        runs={"default": 4, "paper": 3}, generations=12, settings=small(10, 12), shares=ShareSizes(trials=5)
    ),
)  # fmt: skip
