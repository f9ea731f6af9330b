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

from .._experiment import Captions, Experiment, Findings, Table, stacked
from .._least_squares import Check, LeastSquares, check_statements, least_squares_optimum
from .._verdicts import PRINTED, REASONS, ClaimVerdict, listed, printed_spreads, spreads_of, within_spread
from .._work import Work
from ._shared import ShareSizes, seeded, sensor_shares, spreads_frame

ID, THEOREM, CAPTIONS = "4.5", "4.5-theorem", Captions("4.5")
TYPICAL = "typical model of the last generations"


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
    aggregation = _outcome(work, AGGREGATION, "4.5-least-squares-aggregation")
    clustering = _outcome(work, OBJECT_CLUSTERING, "4.5-least-squares-clustering")
    outcomes, cases = (aggregation, clustering), work.sizes.cases
    found = work.piece("theorem", lambda: {"checks": [asdict(check) for check in check_statements(cases)]})
    checks = [Check(**check) for check in found["checks"]]
    texts = (f"{one.statement}: {one.cases} cases, largest difference {one.difference:.0e}" for one in checks)
    return Findings(
        [
            _errors_verdict(aggregation),
            _picture_verdict(clustering, clustering.models),
            _picture_verdict(clustering, clustering.typical, TYPICAL),
            ClaimVerdict(THEOREM, all(check.holds for check in checks), PRINTED[THEOREM], "; ".join(texts), "theorem"),
        ],
        _tables(outcomes, checks),
        [picture for outcome in outcomes for picture in _pictures(outcome)],
    )


def _outcome(work: Work, scenario: Scenario, claim: str) -> _Outcome:
    sizes: BaselineSizes = work.sizes
    seeds = tuple(range(sizes.first_seed, sizes.first_seed + sizes.runs))
    method = LeastSquares(scenario, sizes.generations, sizes.parents, sizes.offspring)

    def inferred(seed: int) -> dict[str, Any] | None:
        found = method.infer(seed, work.should_stop)
        return None if found is None else {"best": found.best.tolist(), "typical": found.typical.tolist()}

    def measured() -> dict[str, Any]:
        return {"shares": sensor_shares(scenario, sizes.shares).mean(axis=0).tolist()}

    found = [work.piece(f"{scenario.name}-{seed}", partial(inferred, seed)) for seed in seeds]
    models, typical = (np.array([one[name] for one in found]) for name in ("best", "typical"))
    # the weighted means of theorem 1, and those of corollary 3, for shares that change during a trial
    shares = np.array(work.piece(f"shares-{scenario.name}", measured)["shares"])
    wheels = np.array(scenario.controller).reshape(-1, 2).T
    weighted, corrected = (
        np.stack([least_squares_optimum(chances, wheel) for wheel in wheels], axis=1).ravel()
        for chances in (shares.mean(axis=0, keepdims=True), shares)
    )
    return _Outcome(scenario, claim, seeds, models, typical, weighted, corrected)


def _errors_verdict(outcome: _Outcome) -> ClaimVerdict:
    printed = printed_spreads(outcome.claim)
    observed = spreads_of(absolute_error(outcome.models, outcome.truth))
    means = outcome.models.mean(axis=0)
    return ClaimVerdict(
        outcome.claim,
        within_spread(observed, printed),
        f"{listed(outcome.names, printed, 2)}; left wheel near -0.54 in both states, weighted mean -0.5504",
        f"{listed(outcome.names, observed)}; left wheel {means[0]:.2f} and {means[2]:.2f}, weighted mean "
        f"{outcome.weighted[0]:.4f} with the shares measured here",
        "errors of the baseline",
    )


def _picture_verdict(outcome: _Outcome, models: np.ndarray, variant: str = "") -> ClaimVerdict:
    low, middle, high = np.quantile(models, (0.25, 0.5, 0.75), axis=0)
    agrees = all((abs(end - outcome.weighted) < abs(end - outcome.truth)).all() for end in (low, high))
    numbers = zip(outcome.names, middle, low, high, outcome.weighted, outcome.truth, strict=True)
    texts = (
        f"{name} {median:.2f} ({first:.2f} to {third:.2f}; weighted mean {mean:.2f}, truth {true:g})"
        for name, median, first, third, mean, true in numbers
    )
    observed, reason = f"medians and quartiles: {', '.join(texts)}", "" if agrees else REASONS[outcome.claim]
    return ClaimVerdict(outcome.claim, agrees, PRINTED[outcome.claim], observed, "baseline's picture", variant, reason)


def _tables(outcomes: Sequence[_Outcome], checks: Sequence[Check]) -> list[Table]:
    tables, predictions = [], {}
    for one in outcomes:
        kinds = {"best_model": one.models, "typical": one.typical}
        models = stacked({kind: seeded(one.seeds, each, one.names) for kind, each in kinds.items()}, "model")
        tables.append(CAPTIONS.table("{scenario.name}-models", models, scenario=one.scenario, typical=TYPICAL))
        columns = {"truth": one.truth, "theorem_1": one.weighted, "corollary_3": one.corrected}
        frame = pd.DataFrame({"parameter": one.names, **columns}).join(spreads_frame(spreads_of(one.models)))
        for name, found in (("", one.models), ("typical_", one.typical)):
            quartiles = [f"{name}{quartile}" for quartile in ("lower_quartile", "median", "upper_quartile")]
            frame[quartiles] = np.quantile(found, (0.25, 0.5, 0.75), axis=0).T
        predictions[one.scenario.name] = frame
    tables.append(CAPTIONS.table("predictions", stacked(predictions, "scenario")))
    names = ["statement", "cases", "largest_difference", "smallest_distance"]
    frame = pd.DataFrame([list(asdict(one).values()) for one in checks], columns=names)
    return [*tables, CAPTIONS.table("theorem", frame.assign(holds=[one.holds for one in checks]))]


def _pictures(outcome: _Outcome) -> list[Picture]:
    words: dict[str, Any] = {"scenario": outcome.scenario, "runs": len(outcome.seeds)}
    look: dict[str, Any] = {"names": outcome.names, "truth": outcome.truth}
    boxes = box_figure(outcome.models, **look)
    pictures = [CAPTIONS.picture("{scenario.name}-boxes", outcome.claim, boxes, **words)]
    for kind, what, models in (
        ("predictions", "best model of the last generation", outcome.models),
        ("typical", TYPICAL, outcome.typical),
    ):
        figure = prediction_figure(models, predicted=outcome.weighted, **look)
        pictures.append(
            CAPTIONS.picture("{scenario.name}-{kind}", outcome.claim, figure, kind=kind, what=what, **words)
        )
    return pictures


EXPERIMENT = Experiment.of(
    ID, conduct, full=BaselineSizes(),
    fast=BaselineSizes(runs=3, generations=40, parents=15, offspring=15, shares=ShareSizes(trials=20), cases=3),
)  # fmt: skip
