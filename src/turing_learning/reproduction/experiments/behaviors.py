"""Section 4.6.4: random behaviors, most of which do nothing that an observer would give a name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from turing_learning.analysis import compare
from turing_learning.reproduction._claims import load_claims
from turing_learning.reproduction._experiment import Cell, Experiment, Findings, Picture, Table
from turing_learning.reproduction._verdicts import Spread, Verdict, listed, not_worse, printed_spreads, shares_not_worse
from turing_learning.reproduction._work import Work
from turing_learning.swarm import AGGREGATION

from ._shares import ShareSizes, sensor_shares
from ._variants import KINDS, PRESETS, values_of, variant_of

CLAIM = "4.6.4-random-behaviors"
PAPER_RUNS = 1000
GOOD, FAIR = 0.05, 0.1
DRAWS = 200
"""Of few runs from many, to tell how often a few show what many do."""
NAMES = AGGREGATION.parameter_names


@dataclass(frozen=True)
class BehaviorSizes:
    """How many runs of each preset, and how often behaviors see another robot."""

    runs: Mapping[str, int] = field(default_factory=lambda: {"default": 200, "paper": 30})
    generations: int = 1000
    first_seed: int = 2001
    settings: Mapping[str, Any] = field(default_factory=dict)
    shares: ShareSizes = field(default_factory=ShareSizes)


@dataclass(frozen=True)
class _Outcome:
    """What the runs of one preset have inferred: behaviors (R, P), models and their errors (R, P) by kind."""

    preset: str
    seeds: tuple[int, ...]
    behaviors: np.ndarray
    models: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]

    def maes(self, kind: str) -> np.ndarray:
        return self.errors[kind].mean(axis=1)


def conduct(work: Work) -> Findings:
    """Run each preset, and see how often each behavior of the first one sees another robot."""
    outcomes = [_outcome(work, preset) for preset in PRESETS]
    seen = _seen(work, outcomes[0])
    verdicts = [_verdict(outcome, kind, outcomes[0].errors[kind]) for outcome in outcomes for kind in KINDS]
    tables = [
        _summary_table(outcomes),
        *(_runs_table(outcome) for outcome in outcomes),
        _failures_table(outcomes[0], seen),
    ]
    return Findings(verdicts, tables, [picture for outcome in outcomes for picture in _pictures(outcome)])


def _outcome(work: Work, preset: str) -> _Outcome:
    sizes: BehaviorSizes = work.sizes
    result = work.study(
        f"study-{preset}",
        "random-behaviors",
        runs=sizes.runs[preset],
        first_seed=sizes.first_seed,
        generations=sizes.generations,
        preset=preset,
        settings=dict(sizes.settings),
    )
    return _Outcome(
        preset,
        tuple(run.seed for run in result.runs),
        values_of(result, "truth"),
        {kind: values_of(result, kind) for kind in KINDS},
        {kind: values_of(result, errors) for kind, errors in KINDS.items()},
    )


def _seen(work: Work, outcome: _Outcome) -> np.ndarray:
    """Return the share of cycles in which agents of each behavior see another robot (R,)."""
    sizes: BehaviorSizes = work.sizes

    def compute() -> dict[str, Any]:
        swarms = (replace(AGGREGATION, controller=tuple(map(float, behavior))) for behavior in outcome.behaviors)
        return {"shares": [float(sensor_shares(swarm, sizes.shares)[..., 1].mean()) for swarm in swarms]}

    return np.array(work.piece("shares", compute)["shares"])


# Verdict.


def _verdict(outcome: _Outcome, kind: str, of_most: np.ndarray) -> Verdict:
    """Return the verdict; `of_most` are the errors (R, P) of the preset with the most runs."""
    values = load_claims()[CLAIM].values
    printed = printed_spreads(values, PAPER_RUNS)
    observed = [Spread.of(errors) for errors in outcome.errors[kind].T]
    maes = outcome.maes(kind)
    good, bad = float(np.mean(maes < GOOD)), float(np.mean(maes > FAIR))
    printed_good, printed_bad = values["share_mae_below_0_05"], values["count_mae_above_0_1"] / PAPER_RUNS
    found = (
        not_worse(observed, printed)
        and shares_not_worse(good, len(maes), printed_good, PAPER_RUNS)
        and shares_not_worse(1 - bad, len(maes), 1 - printed_bad, PAPER_RUNS)
    )
    harder = _harder(outcome.errors[kind])
    few = found and not harder and len(maes) < len(of_most)
    return Verdict(
        CLAIM,
        found and harder,
        f"MAE below {GOOD} in {printed_good:.0%} of {PAPER_RUNS} runs, above {FAIR} in {printed_bad:.1%}; "
        f"{listed(NAMES, printed, 2)}; vl0 and vr0 significantly lower",
        f"MAE below {GOOD} in {good:.1%} of {len(maes)} runs, above {FAIR} in {bad:.1%}; {listed(NAMES, observed)}; "
        f"vl0 and vr0 {'' if harder else 'not '}significantly lower",
        "random behaviors",
        variant_of(outcome.preset, kind),
        _power(len(maes), of_most) if few else "",
    )


def _harder(errors: np.ndarray) -> bool:
    """Return whether the errors (R, P) for I = 1 are significantly larger than those for I = 0, each against each."""
    tests = [compare(errors[:, k], [errors[:, 2], errors[:, 3]], level=0.05 / 2) for k in (0, 1)]
    medians = np.median(errors, axis=0)
    return all(test.significant.all() for test in tests) and medians[:2].max() < medians[2:].min()


def _power(runs: int, errors: np.ndarray) -> str:
    """Return how often that few runs, drawn from more of them with errors (R, P), show which parameters are harder."""
    rng = np.random.default_rng(1)
    shown = np.mean([_harder(errors[rng.choice(len(errors), runs, replace=False)]) for _ in range(DRAWS)])
    return (
        f"{runs} runs are few for comparing I = 0 with I = 1: of {DRAWS} draws of {runs} from the {len(errors)} runs of the "
        f"default preset, {shown:.0%} show that difference"
    )


# Tables and figures.


def _summary_table(outcomes: Sequence[_Outcome]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for outcome in outcomes:
        for kind in KINDS:
            maes = outcome.maes(kind)
            low, high = _share_interval(int(np.count_nonzero(maes < GOOD)), len(maes))
            shares = (float(np.mean(maes < GOOD)), low, high, float(np.mean(maes > FAIR)))
            rows.append((outcome.preset, kind, len(maes), *shares, *map(float, outcome.errors[kind].mean(axis=0))))
    columns = ("preset", "model", "runs", "share_below_0.05", "low", "high", "share_above_0.1", *NAMES)
    caption = (
        "Share of the runs with a mean absolute error below 0.05, with its 95 % interval (Clopper and Pearson), and above 0.1; "
        "mean absolute errors"
    )
    return Table("summary", caption, columns, rows)


def _share_interval(count: int, total: int) -> tuple[float, float]:
    from scipy.stats import binomtest

    interval = binomtest(count, total).proportion_ci(0.95)
    return float(interval.low), float(interval.high)


def _runs_table(outcome: _Outcome) -> Table:
    rows = [
        (seed, *map(float, behavior), *map(float, estimate), float(best), float(own))
        for seed, behavior, estimate, best, own in zip(
            outcome.seeds, outcome.behaviors, outcome.models["estimate"], outcome.maes("best_model"),
            outcome.maes("estimate"), strict=True,
        )
    ]  # fmt: skip
    columns = ("seed", *NAMES, *(f"estimate_{name}" for name in NAMES), "best_model_mae", "estimate_mae")
    return Table(f"{outcome.preset}-runs", f"Every behavior and its estimate, preset {outcome.preset}", columns, rows)


def _failures_table(outcome: _Outcome, seen: np.ndarray) -> Table:
    """Return the behaviors that are not inferred well, and how often they see another robot."""
    maes = outcome.maes("estimate")
    rank = np.argsort(np.argsort(seen)) + 1
    rows = [
        (outcome.seeds[k], *map(float, outcome.behaviors[k]), float(maes[k]), float(seen[k]), int(rank[k]))
        for k in np.flatnonzero(maes >= GOOD)
    ]
    caption = (
        f"Behaviors whose estimate has a mean absolute error of {GOOD} or more, the share of cycles in which they see another "
        f"robot, and the rank of that share among all {len(seen)} behaviors (1: the least; median share {np.median(seen):.4f})"
    )
    return Table("failures", caption, ("seed", *NAMES, "estimate_mae", "share_of_I_1", "rank"), rows)


def _pictures(outcome: _Outcome) -> list[Picture]:
    from turing_learning.figures._many_runs import error_box_figure, error_histogram_figure

    kind = next(iter(KINDS))
    text = f"preset {outcome.preset}, subjectively best model of the last generation, {len(outcome.seeds)} runs"
    return [
        Picture(
            f"{outcome.preset}-histogram",
            f"Mean absolute errors, {text}; {GOOD} and {FAIR} are dashed.",
            CLAIM,
            error_histogram_figure(outcome.maes(kind), limits=(GOOD, FAIR)),
        ),
        Picture(
            f"{outcome.preset}-errors",
            f"Absolute errors by parameter, {text}.",
            CLAIM,
            error_box_figure(list(outcome.errors[kind].T), names=NAMES),
        ),
    ]


EXPERIMENT = Experiment(
    id="4.6.4",
    title="Random behaviors",
    cost="about 1 hour",
    claims=(CLAIM,),
    deviations=(
        "200 behaviors for the default preset and 30 for the preset `paper`, where the paper has 1000; shares come with their "
        "interval.",
        "The verdict is about the paper's rule, the subjectively best model of the last generation; the `estimate`, a median "
        "over generations, stands beside it.",
        "Seeds from 2001 on, which nothing has been tuned on.",
    ),
    full=BehaviorSizes(),
    fast=BehaviorSizes(
        runs={"default": 4, "paper": 3},
        generations=12,
        settings={"models.population": 10, "classifiers.population": 10, "run.checkpoint_every": 12},
        shares=ShareSizes(trials=5),
    ),
    conduct=conduct,
)
