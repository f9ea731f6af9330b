"""Section 4.5: least squares instead of classifiers, and what theorem 1 says about it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import absolute_error
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._many_runs import prediction_figure
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import Experiment, Findings, Table, stacked
from .._least_squares import Check, LeastSquares, check_statements, least_squares_optimum
from .._verdicts import Verdict, listed, printed_spreads, spreads_of, within_spread
from .._work import Work
from ._shared import ShareSizes, sensor_shares, spreads_frame

AGGREGATION_CLAIM = "4.5-least-squares-aggregation"
CLUSTERING_CLAIM = "4.5-least-squares-clustering"
THEOREM_CLAIM = "4.5-theorem"
TYPICAL = "typical model of the last generations"
SCATTER = (
    "a model is scored by one trial, in which the rarer readings hardly occur, so that the best of a generation may have any "
    "speeds for them, and the population wanders; the median over the population and the last three tenths of the generations "
    "is nearer to what theorem 1 says than to the truth"
)


@dataclass(frozen=True)
class BaselineSizes:
    """How many runs of how many generations, and how many cases for the theorem."""

    runs: int = 30
    generations: int = 1000
    parents: int = 50
    offspring: int = 50
    first_seed: int = 1001
    shares: ShareSizes = field(default_factory=lambda: ShareSizes(trials=1000))
    cases: int = 100


@dataclass(frozen=True, eq=False)
class _Outcome:
    """What least squares has inferred in one case study (R, P), and what the theorem predicts (P,)."""

    scenario: Scenario
    claim: str
    seeds: tuple[int, ...]
    models: np.ndarray
    typical: np.ndarray
    weighted: np.ndarray
    corrected: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        return self.scenario.parameter_names

    @property
    def truth(self) -> np.ndarray:
        return np.array(self.scenario.controller)


def conduct(work: Work) -> Findings:
    """Run least squares in both case studies, compute what the theorem predicts, and check its statements."""
    aggregation = _outcome(work, AGGREGATION, AGGREGATION_CLAIM)
    clustering = _outcome(work, OBJECT_CLUSTERING, CLUSTERING_CLAIM)
    cases = work.sizes.cases
    found = work.piece("theorem", lambda: {"checks": [asdict(check) for check in check_statements(cases)]})
    checks, outcomes = [Check(**check) for check in found["checks"]], (aggregation, clustering)
    return Findings(
        [
            _errors_verdict(aggregation),
            _picture_verdict(clustering, clustering.models),
            _picture_verdict(clustering, clustering.typical, TYPICAL),
            _theorem_verdict(checks),
        ],
        [*map(_models_table, outcomes), _predictions_table(outcomes), _checks_table(checks)],
        [picture for outcome in outcomes for picture in _pictures(outcome)],
    )


def _outcome(work: Work, scenario: Scenario, claim: str) -> _Outcome:
    sizes: BaselineSizes = work.sizes
    seeds = tuple(range(sizes.first_seed, sizes.first_seed + sizes.runs))
    method = LeastSquares(scenario, sizes.generations, sizes.parents, sizes.offspring)

    def inferred(seed: int) -> dict[str, Any] | None:
        found = method.infer(seed, work.should_stop)
        return None if found is None else {"best": found.best.tolist(), "typical": found.typical.tolist()}

    found = [work.piece(f"{scenario.name}-{seed}", partial(inferred, seed)) for seed in seeds]
    models, typical = (np.array([one[name] for one in found]) for name in ("best", "typical"))

    def measured() -> dict[str, Any]:
        return {"shares": sensor_shares(scenario, sizes.shares).mean(axis=0).tolist()}

    # the weighted means of theorem 1, and those of corollary 3, for shares that change during a trial
    shares = np.array(work.piece(f"shares-{scenario.name}", measured)["shares"])
    wheels = np.array(scenario.controller).reshape(-1, 2).T
    weighted, corrected = (
        np.stack([least_squares_optimum(chances, wheel) for wheel in wheels], axis=1).ravel()
        for chances in (shares.mean(axis=0, keepdims=True), shares)
    )
    return _Outcome(scenario, claim, seeds, models, typical, weighted, corrected)


# Verdicts.


def _errors_verdict(outcome: _Outcome) -> Verdict:
    printed = printed_spreads(outcome.claim)
    observed = spreads_of(absolute_error(outcome.models, outcome.truth))
    means = outcome.models.mean(axis=0)
    return Verdict(
        outcome.claim,
        within_spread(observed, printed),
        f"{listed(outcome.names, printed, 2)}; left wheel near -0.54 in both states, weighted mean -0.5504",
        f"{listed(outcome.names, observed)}; left wheel {means[0]:.2f} and {means[2]:.2f}, weighted mean "
        f"{outcome.weighted[0]:.4f} with the shares measured here",
        "errors of the baseline",
    )


def _picture_verdict(outcome: _Outcome, models: np.ndarray, variant: str = "") -> Verdict:
    low, middle, high = np.quantile(models, (0.25, 0.5, 0.75), axis=0)
    nearer = [np.abs(end - outcome.weighted) < np.abs(end - outcome.truth) for end in (low, high)]
    texts = (
        f"{name} {median:.2f} ({first:.2f} to {third:.2f}; weighted mean {mean:.2f}, truth {true:g})"
        for name, median, first, third, mean, true in zip(
            outcome.names, middle, low, high, outcome.weighted, outcome.truth, strict=True
        )
    )
    agrees = bool(np.all(nearer))
    return Verdict(
        outcome.claim,
        agrees,
        "both parameters of a wheel near their weighted mean over the sensor states, far from the truth",
        f"medians and quartiles: {', '.join(texts)}",
        "baseline's picture",
        variant,
        "" if agrees else SCATTER,
    )


def _theorem_verdict(checks: Sequence[Check]) -> Verdict:
    texts = (f"{one.statement}: {one.cases} cases, largest difference {one.difference:.0e}" for one in checks)
    return Verdict(
        THEOREM_CLAIM,
        all(check.holds for check in checks),
        "the optimum of the squared error is E{Y} in every state, or the weighted mean of corollary 3; never the agent",
        "; ".join(texts),
        "theorem",
    )


# Tables and figures.


def _models_table(outcome: _Outcome) -> Table:
    frames = {}
    for kind, models in (("best_model", outcome.models), ("typical", outcome.typical)):
        frames[kind] = pd.DataFrame({"seed": outcome.seeds}).join(pd.DataFrame(models, columns=outcome.names))
    caption = (
        f"{outcome.scenario.title}: the model with the smallest error in the last generation of every run, and the {TYPICAL}: "
        "the median of their medians"
    )
    return Table(f"{outcome.scenario.name}-models", caption, stacked(frames, "model"))


def _predictions_table(outcomes: Sequence[_Outcome]) -> Table:
    frames = {}
    for one in outcomes:
        predictions = {"truth": one.truth, "theorem_1": one.weighted, "corollary_3": one.corrected}
        frame = pd.DataFrame({"parameter": one.names, **predictions}).join(spreads_frame(spreads_of(one.models)))
        for name, models in (("", one.models), ("typical_", one.typical)):
            columns = [f"{name}{quartile}" for quartile in ("lower_quartile", "median", "upper_quartile")]
            frame[columns] = np.quantile(models, (0.25, 0.5, 0.75), axis=0).T
        frames[one.scenario.name] = frame
    caption = (
        "What least squares has inferred, beside the weighted means of theorem 1 and, for shares that change during the "
        "trial, of corollary 3; shares as measured here"
    )
    return Table("predictions", caption, stacked(frames, "scenario"))


def _checks_table(checks: Sequence[Check]) -> Table:
    columns = ["statement", "cases", "largest_difference", "smallest_distance"]
    frame = pd.DataFrame([list(asdict(one).values()) for one in checks], columns=columns)
    caption = (
        "The minimum of the expected squared error, searched for in random cases: largest difference from the stated one, "
        "smallest distance from the agent"
    )
    return Table("theorem", caption, frame.assign(holds=[one.holds for one in checks]))


def _pictures(outcome: _Outcome) -> list[Picture]:
    name, title, runs = outcome.scenario.name, outcome.scenario.title, len(outcome.seeds)
    boxes = box_figure(outcome.models, names=outcome.names, truth=outcome.truth)
    caption = f"{title}: parameters inferred by least squares, {runs} runs; the truth is dashed."
    pictures = [Picture(f"{name}-boxes", outcome.claim, caption, boxes)]
    for kind, what, models in (
        ("predictions", "best model of the last generation", outcome.models),
        ("typical", TYPICAL, outcome.typical),
    ):
        figure = prediction_figure(models, predicted=outcome.weighted, truth=outcome.truth, names=outcome.names)
        caption = (
            f"{title}: median and quartiles over {runs} runs of the {what}, beside the weighted means that theorem 1 "
            "predicts."
        )
        pictures.append(Picture(f"{name}-{kind}", outcome.claim, caption, figure))
    return pictures


EXPERIMENT = Experiment.of(
    "4.5",
    conduct,
    full=BaselineSizes(),
    fast=BaselineSizes(runs=3, generations=40, parents=15, offspring=15, shares=ShareSizes(trials=20), cases=3),
)
