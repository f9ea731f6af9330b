"""Section 4.6.4: random behaviors, most of which do nothing that an observer would give a name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import compare
from turing_learning.figures import Picture
from turing_learning.figures._many_runs import error_box_figure, error_histogram_figure
from turing_learning.swarm import AGGREGATION

from .._claims import load_claims
from .._experiment import Experiment, Findings, Table, stacked
from .._verdicts import (
    Verdict,
    listed,
    not_worse,
    printed_spreads,
    shares_not_worse,
    spreads_of,
)
from .._work import Work
from ._shared import KINDS, PRESETS, Runs, ShareSizes, sensor_shares, values_of, variant_of

CLAIM = "4.6.4-random-behaviors"
PAPER_RUNS = 1000
GOOD, FAIR = 0.05, 0.1
DRAWS = 200
"""Draws of few runs from many: how often do a few show what many do?"""
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
    sizes: BehaviorSizes = work.sizes
    found: list[tuple[Runs, np.ndarray]] = []  # with the behaviors (R, P)
    for preset in PRESETS:
        result = work.study(
            f"study-{preset}",
            "random-behaviors",
            runs=sizes.runs[preset],
            first_seed=sizes.first_seed,
            generations=sizes.generations,
            preset=preset,
            settings=dict(sizes.settings),
        )
        found.append((Runs.of(result, preset, NAMES), values_of(result, "truth")))
    most, behaviors = found[0]

    def compute() -> dict[str, Any]:
        swarms = (replace(AGGREGATION, controller=tuple(map(float, behavior))) for behavior in behaviors)
        return {"shares": [float(sensor_shares(swarm, sizes.shares)[..., 1].mean()) for swarm in swarms]}

    sees = np.array(work.piece("shares", compute)["shares"])
    return Findings(
        [behaviors_verdict(runs, kind, most.errors[kind]) for runs, _ in found for kind in KINDS],
        [
            _summary_table([runs for runs, _ in found]),
            *(_runs_table(*one) for one in found),
            _failures_table(*found[0], sees),
        ],
        [picture for runs, _ in found for picture in _pictures(runs)],
    )


def behaviors_verdict(runs: Runs, kind: str, of_most: np.ndarray) -> Verdict:
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
    few = found and not harder and len(maes) < len(of_most)
    return Verdict(
        CLAIM,
        found and harder,
        f"MAE below {GOOD} in {printed_good:.0%} of {PAPER_RUNS} runs, above {FAIR} in {printed_bad:.1%}; "
        f"{listed(NAMES, printed, 2)}; vl0 and vr0 significantly lower",
        f"MAE below {GOOD} in {good:.1%} of {len(maes)} runs, above {FAIR} in {bad:.1%}; {listed(NAMES, observed)}; "
        f"vl0 and vr0 {'' if harder else 'not '}significantly lower",
        "random behaviors",
        variant_of(runs.preset, kind),
        _power(len(maes), of_most) if few else "",
    )


def depends_on_the_reading(errors: np.ndarray) -> bool:
    """Return whether the errors (R, P) for I = 1 are significantly larger than those for I = 0, each against each."""
    tests = [compare(errors[:, k], [errors[:, 2], errors[:, 3]], level=0.05 / 2) for k in (0, 1)]
    medians = np.median(errors, axis=0)
    return all(test.significant.all() for test in tests) and medians[:2].max() < medians[2:].min()


def _power(runs: int, errors: np.ndarray) -> str:
    """Say how often that few runs, drawn from more of them with errors (R, P), show which parameters are harder."""
    rng = np.random.default_rng(1)
    draws = [depends_on_the_reading(errors[rng.choice(len(errors), runs, replace=False)]) for _ in range(DRAWS)]
    return (
        f"{runs} runs are few for comparing I = 0 with I = 1: of {DRAWS} draws of {runs} from the {len(errors)} runs of the "
        f"default preset, {np.mean(draws):.0%} show that difference"
    )


def _summary_table(found: Sequence[Runs]) -> Table:
    from scipy.stats import binomtest

    frames = {}
    for runs in found:
        for kind in KINDS:
            maes = runs.maes(kind)
            ends = binomtest(int(np.count_nonzero(maes < GOOD)), len(maes)).proportion_ci(0.95)
            shares = {"share_below_0.05": np.mean(maes < GOOD), "low": ends.low, "high": ends.high}
            row = {"runs": len(maes), **shares, "share_above_0.1": np.mean(maes > FAIR)}
            frames[runs.preset, kind] = pd.DataFrame(
                [row | dict(zip(NAMES, runs.errors[kind].mean(axis=0), strict=True))]
            )
    caption = (
        "Share of the runs with a mean absolute error below 0.05, with its 95 % interval (Clopper and Pearson), and above 0.1; "
        "mean absolute errors"
    )
    return Table("summary", caption, stacked(frames, "preset", "model"))


def _runs_table(runs: Runs, behaviors: np.ndarray) -> Table:
    frame = pd.DataFrame(behaviors, columns=NAMES)
    frame[[f"estimate_{name}" for name in NAMES]] = runs.models["estimate"]
    frame.insert(0, "seed", runs.seeds)
    frame = frame.assign(best_model_mae=runs.maes("best_model"), estimate_mae=runs.maes("estimate"))
    return Table(f"{runs.preset}-runs", f"Every behavior and its estimate, preset {runs.preset}", frame)


def _failures_table(runs: Runs, behaviors: np.ndarray, sees: np.ndarray) -> Table:
    """Return the behaviors that are not inferred well, and how often they see another robot."""
    frame = pd.DataFrame(behaviors, columns=NAMES)
    frame.insert(0, "seed", runs.seeds)
    rank = np.argsort(np.argsort(sees)) + 1
    frame = frame.assign(estimate_mae=runs.maes("estimate"), share_of_I_1=sees, rank=rank)
    caption = (
        f"Behaviors whose estimate has a mean absolute error of {GOOD} or more, the share of cycles in which they see another "
        f"robot, and the rank of that share among all {len(sees)} behaviors (1: the least; median share {np.median(sees):.4f})"
    )
    return Table("failures", caption, frame[frame["estimate_mae"] >= GOOD])


def _pictures(runs: Runs) -> list[Picture]:
    text = f"preset {runs.preset}, subjectively best model of the last generation, {len(runs)} runs"
    histogram = error_histogram_figure(runs.maes("best_model"), limits=(GOOD, FAIR))
    boxes = error_box_figure(list(runs.errors["best_model"].T), names=NAMES)
    caption = f"Mean absolute errors, {text}; {GOOD} and {FAIR} are dashed."
    return [
        Picture(f"{runs.preset}-histogram", CLAIM, caption, histogram),
        Picture(f"{runs.preset}-errors", CLAIM, f"Absolute errors by parameter, {text}.", boxes),
    ]


EXPERIMENT = Experiment.of(
    "4.6.4",
    conduct,
    full=BehaviorSizes(),
    fast=BehaviorSizes(
        runs={"default": 4, "paper": 3},
        generations=12,
        settings={"models.population": 10, "classifiers.population": 10, "run.checkpoint_every": 12},
        shares=ShareSizes(trials=5),
    ),
)
