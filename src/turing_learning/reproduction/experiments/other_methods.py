"""Section 4.5: the metric-based baseline; and likelihood-free inference beside Turing Learning."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import WHY_UNKNOWN, absolute_error, is_known
from turing_learning.errors import require
from turing_learning.figures import box_figure
from turing_learning.figures.many_runs import budget_figure, prediction_figure
from turing_learning.purposes import COMPARISON_OBSERVATION
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .. import _methods as methods
from .._experiment import Findings, Work, seeded, seeds_of, sensor_shares, stacked
from .._verdicts import ClaimVerdict, Spreads, held

TYPICAL = "typical model of the last generations"


@dataclass(frozen=True, eq=False)
class Baseline:
    """What least squares has inferred in one case study (R, P), and what the theorem predicts (P,)."""

    scenario: Scenario
    claim: str
    models: np.ndarray
    typical: np.ndarray
    weighted: np.ndarray  # by theorem 1
    corrected: np.ndarray  # by corollary 3, for shares that change during a trial


def conduct_baseline(work: Work, findings: Findings) -> None:
    """Run least squares in both case studies, compute what the theorem predicts, and check its statements."""
    aggregation = _baseline(work, AGGREGATION, "4.5-least-squares-aggregation")
    clustering = _baseline(work, OBJECT_CLUSTERING, "4.5-least-squares-clustering")
    compute = partial(methods.check_statements, work.sizes["cases"])
    found = work.piece("theorem", lambda: {"checks": [asdict(check) for check in compute()]})
    checks = [methods.Check(**check) for check in found["checks"]]
    names, printed = AGGREGATION.parameter_names, Spreads.printed(aggregation.claim)
    observed = Spreads.of(absolute_error(aggregation.models, AGGREGATION.controller))
    left = aggregation.models.mean(axis=0)[[0, 2]]
    came_out = f"{observed.listed(names)}; left wheel {left[0]:.2f} and {left[1]:.2f}, weighted mean "
    came_out += f"{aggregation.weighted[0]:.4f} with the shares measured here"
    text = f"{printed.listed(names, 2)}; left wheel near -0.54 in both states, weighted mean -0.5504"
    said = (f"{one.statement}: {one.cases} cases, largest difference {one.difference:.0e}" for one in checks)
    findings.verdicts += [
        held(aggregation.claim, observed.within(printed), came_out, "errors of the baseline", printed=text),
        _picture_verdict(clustering, clustering.models),
        _picture_verdict(clustering, clustering.typical, TYPICAL),
        held("4.5-theorem", all(check.holds for check in checks), "; ".join(said), "theorem"),
    ]
    frames = {one.scenario.name: _predictions(findings, one, work) for one in (aggregation, clustering)}
    findings.table("predictions", stacked(frames, "scenario"))
    columns = ["statement", "cases", "largest_difference", "smallest_distance"]
    frame = pd.DataFrame([list(asdict(one).values()) for one in checks], columns=columns)
    findings.table("theorem", frame.assign(holds=[one.holds for one in checks]))


def _baseline(work: Work, scenario: Scenario, claim: str) -> Baseline:
    how = {name: work.sizes[name] for name in ("generations", "parents", "offspring")}

    def inferred(seed: int) -> dict[str, Any] | None:
        found = methods.least_squares(scenario, seed, should_stop=work.should_stop, **how)
        return found and {name: model.tolist() for name, model in found.items()}

    def measured() -> dict[str, Any]:
        return {"shares": sensor_shares(scenario, **work.sizes["shares"]).mean(axis=0).tolist()}

    found = [work.piece(f"{scenario.name}-{seed}", partial(inferred, seed)) for seed in seeds_of(work.sizes)]
    models, typical = (np.array([one[name] for one in found]) for name in ("best", "typical"))
    shares = np.array(work.piece(f"shares-{scenario.name}", measured)["shares"])
    wheels = np.array(scenario.controller).reshape(-1, 2).T
    weighted, corrected = (
        np.stack([methods.least_squares_optimum(chances, wheel) for wheel in wheels], axis=1).ravel()
        for chances in (shares.mean(axis=0, keepdims=True), shares)
    )
    return Baseline(scenario, claim, models, typical, weighted, corrected)


def _picture_verdict(outcome: Baseline, models: np.ndarray, variant: str = "") -> ClaimVerdict:
    low, middle, high = np.quantile(models, (0.25, 0.5, 0.75), axis=0)
    names, truth, weighted = outcome.scenario.parameter_names, np.array(outcome.scenario.controller), outcome.weighted
    agrees = all((abs(end - weighted) < abs(end - truth)).all() for end in (low, high))
    texts = (
        f"{name} {median:.2f} ({first:.2f} to {third:.2f}; weighted mean {mean:.2f}, truth {true:g})"
        for name, median, first, third, mean, true in zip(names, middle, low, high, weighted, truth, strict=True)
    )
    return held(outcome.claim, agrees, f"medians and quartiles: {', '.join(texts)}", "baseline's picture", variant)


def _predictions(findings: Findings, one: Baseline, work: Work) -> pd.DataFrame:
    """Add models and pictures of a case study; return quartiles beside what the theorem predicts."""
    scenario, seeds = one.scenario, seeds_of(work.sizes)
    names, truth = scenario.parameter_names, np.array(scenario.controller)
    kinds = {"best_model": one.models, "typical": one.typical}
    models = stacked({kind: seeded(seeds, each, names) for kind, each in kinds.items()}, "model")
    findings.table("{scenario.name}-models", models, scenario=scenario, typical=TYPICAL)
    words: dict[str, Any] = {"scenario": scenario, "runs": len(seeds)}
    findings.picture("{scenario.name}-boxes", one.claim, box_figure(one.models, names=names, truth=truth), **words)
    columns = {"truth": truth, "theorem_1": one.weighted, "corollary_3": one.corrected}
    frame = pd.DataFrame({"parameter": names, **columns}).join(Spreads.of(one.models).frame())
    for kind, prefix, what, found in (
        ("predictions", "", "best model of the last generation", one.models),
        ("typical", "typical_", TYPICAL, one.typical),
    ):
        quartiles = [f"{prefix}{quartile}" for quartile in ("lower_quartile", "median", "upper_quartile")]
        frame[quartiles] = np.quantile(found, (0.25, 0.5, 0.75), axis=0).T
        figure = prediction_figure(found, predicted=one.weighted, names=names, truth=truth)
        findings.picture("{scenario.name}-{kind}", one.claim, figure, kind=kind, what=what, **words)
    return frame


TURING_LEARNING, ABC_SMC, NPE_IN_ROUNDS, MIXTURE = "Turing Learning", "ABC-SMC", "NPE in rounds", "mixture"
METHODS = {"turing-learning": TURING_LEARNING, "abc-smc": ABC_SMC, "npe": "NPE", "npe-rounds": NPE_IN_ROUNDS}
METHODS[MIXTURE] = MIXTURE
"""Key of a method -> its name."""


def conduct_comparison(work: Work, findings: Findings) -> None:
    """Run every method with every number of trials."""
    sizes, first = work.sizes, work.sizes["first_seed"]
    seeds = range(first, first + sizes["seeds"])
    fits = all(trials % sizes["group"] == 0 == trials % sizes["population"] for trials in sizes["trials"])
    require(fits, "trials", f"be multiples of {sizes['group']} and {sizes['population']}", str(sizes["trials"]))
    for package in ("pyabc", "sbi", "sklearn"):  # what the import takes is not the time of a method
        methods.baseline(package)
    panels: dict[str, dict[str, dict[int, np.ndarray]]] = {}
    for scenario in (AGGREGATION, OBJECT_CLUSTERING):
        panel, found = panels.setdefault(scenario.title, {}), {}
        for method, name in METHODS.items():
            for trials in sizes["observed" if method == MIXTURE else "trials"]:
                found[method, trials] = [_found(work, scenario, method, trials, seed) for seed in seeds]
                maes = absolute_error([one["estimate"] for one in found[method, trials]], scenario.controller)
                panel.setdefault(name, {})[trials] = maes.mean(axis=1)
        runs = runs_frame(scenario, found, seeds)
        summary = summary_frame(scenario, runs)
        findings.table("{scenario.name}", summary.drop(columns=["worst", "unknown"]), True, scenario=scenario)
        findings.table("{scenario.name}-runs", runs.drop(columns="processor_s"), scenario=scenario)
        findings.remarks += remarks(scenario.title, summary)
    findings.picture("accuracy", "", budget_figure(panels), seeds=len(seeds))


def _found(work: Work, scenario: Scenario, method: str, trials: int, seed: int) -> dict[str, Any]:
    """Return what a method has inferred with a seed, a piece of work."""
    sizes = work.sizes
    population = {"models.population": sizes["population"], "classifiers.population": sizes["population"]}

    def infer(groups: methods.Groups, genuine: np.ndarray) -> methods.Inferred | None:
        if METHODS[method] == TURING_LEARNING:
            from turing_learning.runs import infer

            how: dict[str, Any] = {"settings": population | sizes["settings"], "should_stop": work.should_stop}
            result = infer(scenario, generations=trials // sizes["population"], seed=seed, threads=1, **how)
            if not result.complete:
                return None
            ends = np.array(list((result.wandering or result.interval).values())).T
            return methods.Inferred(np.array(list(result.estimate.values())), *ends)
        if method == MIXTURE:
            return methods.fit_mixture(genuine, scenario, seed)
        given = groups, methods.summaries(genuine, scenario), trials // groups.size, seed, work.should_stop
        if METHODS[method] == ABC_SMC:
            return methods.infer_by_abc_smc(*given)
        return methods.infer_by_npe(*given, rounds=sizes["rounds"] if METHODS[method] == NPE_IN_ROUNDS else 1)

    def compute() -> dict[str, Any] | None:
        groups = methods.Groups(scenario, sizes["group"])
        observed = trials if method == MIXTURE else max(sizes["observed"])
        genuine = groups.observe(observed, np.random.default_rng((COMPARISON_OBSERVATION, seed)))
        begun = time.process_time()
        inferred = infer(groups, genuine)
        return None if inferred is None else as_json(inferred, time.process_time() - begun)

    return work.piece(f"{scenario.name}-{method}-{trials}-seed{seed}", compute)


def as_json(inferred: methods.Inferred, seconds: float) -> dict[str, Any]:
    """Return what a piece of work holds: None where a number is not known."""
    known = {name: None if values is None else values.tolist() for name, values in vars(inferred).items()}
    found = {name: values and [v if is_known(v) else None for v in values] for name, values in known.items()}
    return found | {"processor_seconds": round(seconds, 2)}


def runs_frame(
    scenario: Scenario, found: Mapping[tuple[str, int], Sequence[Mapping[str, Any]]], seeds: Sequence[int]
) -> pd.DataFrame:
    """Return every run of `found`, pieces of work by method and number of trials, seed by seed; ends not known are empty."""
    names, frames = scenario.parameter_names, {}
    columns = [f"{end}_{name}" for name in names for end in ("low", "high")]
    for key, pieces in found.items():
        estimates = np.array([one["estimate"] for one in pieces])
        ends = [[one[end] or [None] * len(names) for end in ("low", "high")] for one in pieces]
        intervals = np.array(ends, dtype=float).transpose(0, 2, 1).reshape(len(ends), -1)
        frame = seeded(seeds, estimates, names).assign(MAE=absolute_error(estimates, scenario.controller).mean(axis=1))
        frame = frame.join(pd.DataFrame(intervals, columns=columns))
        frames[key] = frame.assign(processor_s=[one["processor_seconds"] for one in pieces])
    return stacked(frames, "method", "trials")


def summary_frame(scenario: Scenario, runs: pd.DataFrame) -> pd.DataFrame:
    """Return medians over the seeds, the worst MAE, the share of true parameters in their intervals; of `unknown` ones none is."""
    names, truth, rows = list(scenario.parameter_names), np.array(scenario.controller), []
    for (method, trials), own in runs.groupby(["method", "trials"], sort=False):
        errors = np.median(absolute_error(own[names].to_numpy(), truth), axis=0)
        low, high = (own[[f"{end}_{name}" for name in names]].to_numpy() for end in ("low", "high"))
        widths = (high - low)[np.isfinite(high - low)]
        row = {"method": METHODS[method], "trials": trials, "MAE": own["MAE"].median()}
        row |= dict(zip(names, errors, strict=True))
        row["coverage"] = None if method == MIXTURE else float(((low <= truth) & (truth <= high)).mean())
        row |= {"width": widths.mean() if widths.size else None, "processor_s": own["processor_s"].median()}
        unknown = 0 if method == MIXTURE else int(np.isnan(high - low).sum())
        rows.append(row | {"worst": own["MAE"].max(), "unknown": unknown})
    return pd.DataFrame(rows)


def remarks(title: str, summary: pd.DataFrame) -> list[str]:
    """Return sentences about one scenario: who is how accurate, and where Turing Learning is beaten."""

    def named(one: Any) -> str:
        return f"{one.method} {one.MAE:.4f} ({one.worst:.4f}; {one.processor_s:.1f} s)"

    rows: list[Any] = list(summary.itertuples())
    own = {one.trials: one for one in rows if one.method == TURING_LEARNING}
    fit = max((one for one in rows if one.method == MIXTURE), key=lambda one: one.trials)
    texts, wins = [], []
    for trials in own:
        ranked = [one for one in rows if one.trials == trials and one.method != MIXTURE]
        listing = ", ".join(named(one) for one in sorted(ranked, key=lambda one: one.MAE))
        texts.append(
            f"{title}, {trials:,} simulated trials, median MAE (of the worst seed; time): {listing}; "
            f"{named(fit)} without any, from {fit.trials:,} observed ones."
        )
    for one in (one for one in rows if one.method != TURING_LEARNING):
        mixture = one.method == MIXTURE
        rival = own[max(own) if mixture else one.trials]
        better = [f"a smaller median error ({one.MAE:.4f}, {rival.MAE:.4f})"] if one.MAE < rival.MAE else []
        if one.processor_s < rival.processor_s:
            better.append(f"less time ({one.processor_s:.1f} s, {rival.processor_s:.1f} s)")
        effort = f"{one.trials:,} {'observed' if mixture else 'simulated'} trials"
        against = f"Turing Learning{f' with {rival.trials:,}' if mixture else ''}"
        if better:
            wins.append(f"{one.method} with {effort} has {' and '.join(better)} than {against}")
    texts.append(f"**Where the others win, {title.lower()}:** {'; '.join(wins) if wins else 'nowhere'}.")
    some = [f"{one.method} {one.unknown} with {one.trials:,} trials" for one in rows if one.unknown]
    if some:
        texts.append(
            f"Intervals that are not known, and count as not holding the truth: {', '.join(some)}: {WHY_UNKNOWN}."
        )
    return texts
