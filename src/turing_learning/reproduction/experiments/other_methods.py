"""Section 4.5: the metric-based baseline; and likelihood-free inference beside Turing Learning."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import absolute_error, is_known
from turing_learning.analysis._estimate import WHY_UNKNOWN
from turing_learning.errors import require
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._many_runs import budget_figure, prediction_figure
from turing_learning.purposes import COMPARISON_OBSERVATION
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import (
    Captions,
    Experiment,
    Findings,
    ShareSizes,
    Table,
    Work,
    seeded,
    sensor_shares,
    spreads_frame,
    stacked,
)
from .._methods import (
    Check,
    Groups,
    Inferred,
    LeastSquares,
    baseline,
    check_statements,
    fit_mixture,
    infer_by_abc_smc,
    infer_by_npe,
    least_squares_optimum,
    summaries,
)
from .._verdicts import PRINTED, REASONS, ClaimVerdict, listed, printed_spreads, spreads_of, within_spread

THEOREM, BASELINE_CAPTIONS = "4.5-theorem", Captions("4.5")
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
class _Baseline:
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


def conduct_baseline(work: Work) -> Findings:
    """Run least squares in both case studies, compute what the theorem predicts, and check its statements."""
    aggregation = _baseline(work, AGGREGATION, "4.5-least-squares-aggregation")
    clustering = _baseline(work, OBJECT_CLUSTERING, "4.5-least-squares-clustering")
    both, cases = (aggregation, clustering), work.sizes.cases
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
        _baseline_tables(both, checks),
        [picture for outcome in both for picture in _baseline_pictures(outcome)],
    )


def _baseline(work: Work, scenario: Scenario, claim: str) -> _Baseline:
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
    return _Baseline(scenario, claim, seeds, models, typical, weighted, corrected)


def _errors_verdict(outcome: _Baseline) -> ClaimVerdict:
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


def _picture_verdict(outcome: _Baseline, models: np.ndarray, variant: str = "") -> ClaimVerdict:
    low, middle, high = np.quantile(models, (0.25, 0.5, 0.75), axis=0)
    agrees = all((abs(end - outcome.weighted) < abs(end - outcome.truth)).all() for end in (low, high))
    numbers = zip(outcome.names, middle, low, high, outcome.weighted, outcome.truth, strict=True)
    texts = (
        f"{name} {median:.2f} ({first:.2f} to {third:.2f}; weighted mean {mean:.2f}, truth {true:g})"
        for name, median, first, third, mean, true in numbers
    )
    observed, reason = f"medians and quartiles: {', '.join(texts)}", "" if agrees else REASONS[outcome.claim]
    return ClaimVerdict(outcome.claim, agrees, PRINTED[outcome.claim], observed, "baseline's picture", variant, reason)


def _baseline_tables(both: Sequence[_Baseline], checks: Sequence[Check]) -> list[Table]:
    tables, predictions = [], {}
    for one in both:
        kinds = {"best_model": one.models, "typical": one.typical}
        models = stacked({kind: seeded(one.seeds, each, one.names) for kind, each in kinds.items()}, "model")
        tables.append(BASELINE_CAPTIONS.table("{scenario.name}-models", models, scenario=one.scenario, typical=TYPICAL))
        columns = {"truth": one.truth, "theorem_1": one.weighted, "corollary_3": one.corrected}
        frame = pd.DataFrame({"parameter": one.names, **columns}).join(spreads_frame(spreads_of(one.models)))
        for name, found in (("", one.models), ("typical_", one.typical)):
            quartiles = [f"{name}{quartile}" for quartile in ("lower_quartile", "median", "upper_quartile")]
            frame[quartiles] = np.quantile(found, (0.25, 0.5, 0.75), axis=0).T
        predictions[one.scenario.name] = frame
    tables.append(BASELINE_CAPTIONS.table("predictions", stacked(predictions, "scenario")))
    names = ["statement", "cases", "largest_difference", "smallest_distance"]
    frame = pd.DataFrame([list(asdict(one).values()) for one in checks], columns=names)
    return [*tables, BASELINE_CAPTIONS.table("theorem", frame.assign(holds=[one.holds for one in checks]))]


def _baseline_pictures(outcome: _Baseline) -> list[Picture]:
    words: dict[str, Any] = {"scenario": outcome.scenario, "runs": len(outcome.seeds)}
    look: dict[str, Any] = {"names": outcome.names, "truth": outcome.truth}
    boxes = box_figure(outcome.models, **look)
    pictures = [BASELINE_CAPTIONS.picture("{scenario.name}-boxes", outcome.claim, boxes, **words)]
    for kind, what, models in (
        ("predictions", "best model of the last generation", outcome.models),
        ("typical", TYPICAL, outcome.typical),
    ):
        figure = prediction_figure(models, predicted=outcome.weighted, **look)
        pictures.append(
            BASELINE_CAPTIONS.picture("{scenario.name}-{kind}", outcome.claim, figure, kind=kind, what=what, **words)
        )
    return pictures


BASELINE = Experiment.of(
    "4.5", conduct_baseline, full=BaselineSizes(),
    fast=BaselineSizes(runs=3, generations=40, parents=15, offspring=15, shares=ShareSizes(trials=20), cases=3),
)  # fmt: skip


CAPTIONS = Captions("4.5+")
PACKAGES = ("pyabc", "sbi", "sklearn")
TURING_LEARNING, ABC_SMC, NPE, NPE_IN_ROUNDS, MIXTURE = "turing-learning", "abc-smc", "npe", "npe-rounds", "mixture"
NAMES = ("Turing Learning", "ABC-SMC", "NPE", "NPE in rounds", "mixture")
METHODS = dict(zip((TURING_LEARNING, ABC_SMC, NPE, NPE_IN_ROUNDS, MIXTURE), NAMES, strict=True))
"""Key of a method -> its name."""


@dataclass(frozen=True)
class ComparisonSizes:
    """How many seeds, trials and rounds."""

    seeds: int = 5
    first_seed: int = 2001
    trials: tuple[int, ...] = (1_000, 10_000, 100_000)  # simulated, of every method that simulates
    observed: tuple[int, ...] = (10, 100, 1_000)  # for the mixture; others have the summaries of the largest number
    group: int = 10  # trials with the same model
    rounds: int = 2  # of sequential neural posterior estimation
    population: int = 100  # models, and classifiers, of Turing Learning
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        fits = all(trials % self.group == 0 == trials % self.population for trials in self.trials)
        require(fits, "trials", f"be multiples of {self.group} and {self.population}", str(self.trials))


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one method has inferred in one scenario, seed by seed."""

    scenario: Scenario
    method: str
    trials: int  # simulated; of the mixture, observed
    seeds: tuple[int, ...]
    estimates: np.ndarray  # (R, P)
    intervals: np.ndarray | None  # (R, 2, P), ends of the central 90 %, NaN where unknown; None if there are none
    processor_seconds: np.ndarray  # (R,), of one core (s), without imports

    @classmethod
    def of(
        cls, scenario: Scenario, method: str, trials: int, seeds: tuple[int, ...], found: Sequence[Mapping[str, Any]]
    ) -> "Outcome":
        """Return the outcome of what the pieces of work hold, seed by seed."""
        estimates = np.array([one["estimate"] for one in found])
        none = any(one["low"] is None for one in found)
        intervals = None if none else np.array([(one["low"], one["high"]) for one in found], dtype=float)
        seconds = np.array([one["processor_seconds"] for one in found])
        return cls(scenario, method, trials, seeds, estimates, intervals, seconds)

    @property
    def errors(self) -> np.ndarray:
        """Absolute errors (R, P)."""
        return absolute_error(self.estimates, self.scenario.controller)

    @property
    def maes(self) -> np.ndarray:
        """Mean absolute errors (R,)."""
        return self.errors.mean(axis=1)

    @property
    def mae(self) -> float:
        """Median of the mean absolute errors."""
        return float(np.median(self.maes))

    @property
    def seconds(self) -> float:
        """Median processor time (s)."""
        return float(np.median(self.processor_seconds))

    @property
    def coverage(self) -> float | None:
        """Share of the true parameters that are inside their intervals; an unknown one holds nothing."""
        if self.intervals is None:
            return None
        truth = np.array(self.scenario.controller)
        return float(((self.intervals[:, 0] <= truth) & (truth <= self.intervals[:, 1])).mean())

    @property
    def width(self) -> float | None:
        """Mean width of the intervals that are known; None where there is none."""
        widths = np.array([]) if self.intervals is None else np.diff(self.intervals, axis=1)
        known = widths[np.isfinite(widths)]
        return float(known.mean()) if known.size else None

    @property
    def unknown(self) -> int:
        """Number of intervals, of all seeds and parameters, that are not known."""
        return 0 if self.intervals is None else int(np.isnan(self.intervals).any(axis=1).sum())


def conduct_comparison(work: Work) -> Findings:
    """Run every method with every number of trials."""
    for package in PACKAGES:
        baseline(package)
    sizes: ComparisonSizes = work.sizes
    seeds = tuple(range(sizes.first_seed, sizes.first_seed + sizes.seeds))
    outcomes: dict[str, list[Outcome]] = {}
    panels: dict[str, dict[str, dict[int, np.ndarray]]] = {}
    for scenario in (AGGREGATION, OBJECT_CLUSTERING):
        own, panel = outcomes.setdefault(scenario.title, []), panels.setdefault(scenario.title, {})
        for method, name in METHODS.items():
            for trials in sizes.observed if method == MIXTURE else sizes.trials:
                found = [_found(work, scenario, method, trials, seed) for seed in seeds]
                own.append(Outcome.of(scenario, method, trials, seeds, found))
                panel.setdefault(name, {})[trials] = own[-1].maes
    tables = [make(found) for make in (_summary_table, _runs_table) for found in outcomes.values()]
    pictures = [CAPTIONS.picture("accuracy", "", budget_figure(panels), seeds=len(seeds))]
    return Findings([], tables, pictures, [text for found in outcomes.values() for text in remarks(found)])


def _found(work: Work, scenario: Scenario, method: str, trials: int, seed: int) -> dict[str, Any]:
    sizes: ComparisonSizes = work.sizes

    def compute() -> dict[str, Any] | None:
        groups = Groups(scenario, sizes.group)
        observed = trials if method == MIXTURE else max(sizes.observed)
        genuine = groups.observe(observed, np.random.default_rng((COMPARISON_OBSERVATION, seed)))
        begun = time.process_time()
        inferred = _infer(work, method, groups, genuine, trials, seed)
        return None if inferred is None else as_json(inferred, time.process_time() - begun)

    return work.piece(f"{scenario.name}-{method}-{trials}-seed{seed}", compute)


def _infer(work: Work, method: str, groups: Groups, genuine: np.ndarray, trials: int, seed: int) -> Inferred | None:
    sizes: ComparisonSizes = work.sizes
    if method == TURING_LEARNING:
        from turing_learning.runs import infer

        population = {"models.population": sizes.population, "classifiers.population": sizes.population}
        how: dict[str, Any] = {"settings": {**population, **sizes.settings}, "should_stop": work.should_stop}
        result = infer(groups.scenario, generations=trials // sizes.population, seed=seed, threads=1, **how)
        if not result.complete:
            return None
        return Inferred(
            np.array(list(result.estimate.values())), *np.array(list((result.wandering or result.interval).values())).T
        )
    if method == MIXTURE:
        return fit_mixture(genuine, groups.scenario, seed)
    given = groups, summaries(genuine, groups.scenario), trials // groups.size, seed, work.should_stop
    if method == ABC_SMC:
        return infer_by_abc_smc(*given)
    return infer_by_npe(*given, rounds=sizes.rounds if method == NPE_IN_ROUNDS else 1)


def as_json(inferred: Inferred, seconds: float) -> dict[str, Any]:
    """Return what a piece of work holds: None where a number is not known."""
    values = {name: getattr(inferred, name) for name in ("estimate", "low", "high")}
    found: dict[str, Any] = {}
    for name, each in values.items():
        found[name] = None if each is None else [v if is_known(v) else None for v in each.tolist()]
    return found | {"processor_seconds": round(seconds, 2)}


def remarks(outcomes: Sequence[Outcome]) -> list[str]:
    """Return sentences in Markdown about one scenario: who is how accurate, and where Turing Learning is beaten."""
    title = outcomes[0].scenario.title
    own = {one.trials: one for one in outcomes if one.method == TURING_LEARNING}
    fit = max((one for one in outcomes if one.method == MIXTURE), key=lambda one: one.trials)

    def named(one: Outcome) -> str:
        return f"{METHODS[one.method]} {one.mae:.4f} ({one.maes.max():.4f}; {one.seconds:.1f} s)"

    texts, wins = [], []
    for trials in own:
        ranked = [one for one in outcomes if one.trials == trials and one.method != MIXTURE]
        listing = ", ".join(named(one) for one in sorted(ranked, key=lambda one: one.mae))
        texts.append(
            f"{title}, {trials:,} simulated trials, median MAE (of the worst seed; time): {listing}; "
            f"{named(fit)} without any, from {fit.trials:,} observed ones."
        )
    for one in outcomes:
        if one.method != TURING_LEARNING:
            mixture = one.method == MIXTURE
            rival = own[max(own) if mixture else one.trials]
            better = [f"a smaller median error ({one.mae:.4f}, {rival.mae:.4f})"] if one.mae < rival.mae else []
            if one.seconds < rival.seconds:
                better.append(f"less time ({one.seconds:.1f} s, {rival.seconds:.1f} s)")
            effort = f"{one.trials:,} {'observed' if mixture else 'simulated'} trials"
            against = f"Turing Learning{f' with {rival.trials:,}' if mixture else ''}"
            if better:
                wins.append(f"{METHODS[one.method]} with {effort} has {' and '.join(better)} than {against}")
    texts.append(f"**Where the others win, {title.lower()}:** {'; '.join(wins) if wins else 'nowhere'}.")
    some = [f"{METHODS[one.method]} {one.unknown} with {one.trials:,} trials" for one in outcomes if one.unknown]
    if some:
        texts.append(
            f"Intervals that are not known, and count as not holding the truth: {', '.join(some)}: {WHY_UNKNOWN}."
        )
    return texts


def _summary_table(outcomes: Sequence[Outcome]) -> Table:
    scenario = outcomes[0].scenario
    frame = pd.DataFrame(
        {"method": METHODS[one.method], "trials": one.trials, "MAE": one.mae}
        | dict(zip(scenario.parameter_names, np.median(one.errors, axis=0), strict=True))
        | {"coverage": one.coverage, "width": one.width, "processor_s": one.seconds}
        for one in outcomes
    )
    return CAPTIONS.table("{scenario.name}", frame, True, scenario=scenario)


def _runs_table(outcomes: Sequence[Outcome]) -> Table:
    scenario = outcomes[0].scenario
    frame = runs_frame(outcomes, scenario.parameter_names)
    return CAPTIONS.table("{scenario.name}-runs", frame, scenario=scenario)


def runs_frame(outcomes: Sequence[Outcome], names: Sequence[str]) -> pd.DataFrame:
    """Return every run with its interval; empty where it is not known, or the method has none."""
    frames = {}
    for one in outcomes:
        ends = np.full((len(one.seeds), 2, len(names)), np.nan) if one.intervals is None else one.intervals
        columns = [f"{end}_{name}" for name in names for end in ("low", "high")]
        intervals = pd.DataFrame(ends.transpose(0, 2, 1).reshape(len(ends), -1), columns=columns)
        frames[one.method, one.trials] = seeded(one.seeds, one.estimates, names).assign(MAE=one.maes).join(intervals)
    return stacked(frames, "method", "trials")


COMPARISON = Experiment.of(
    "4.5+", conduct_comparison, full=ComparisonSizes(),
    fast=ComparisonSizes(
        seeds=1, trials=(500,), observed=(10,), group=5, population=10, settings={"run.checkpoint_every": 50}
    ),
)  # fmt: skip
