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
from .._verdicts import ClaimVerdict, Spreads, verdict_on

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
    cases = work.sizes["cases"]
    stored = work.piece(
        "theorem", lambda: {"checks": list(map(asdict, methods.check_statements(cases)))}
    )
    checks = [methods.StatementCheck(**check) for check in stored["checks"]]
    texts = []
    for check in checks:
        texts.append(
            f"{check.statement}: {check.cases} cases, largest difference {check.difference:.0e}"
        )
    holds = all(check.holds for check in checks)
    findings.verdicts += [
        _errors_verdict(aggregation),
        _picture_verdict(clustering, clustering.models),
        _picture_verdict(clustering, clustering.typical, TYPICAL),
        verdict_on("4.5-theorem", holds, "; ".join(texts), "theorem"),
    ]
    frames = {}
    for baseline in (aggregation, clustering):
        frames[baseline.scenario.name] = _show_baseline(findings, baseline, seeds_of(work.sizes))
    findings.table("predictions", stacked(frames, "scenario"))
    columns = ["statement", "cases", "largest_difference", "smallest_distance"]
    frame = pd.DataFrame([list(asdict(check).values()) for check in checks], columns=columns)
    findings.table("theorem", frame.assign(holds=[check.holds for check in checks]))


def _baseline(work: Work, scenario: Scenario, claim: str) -> Baseline:
    scenario = work.in_world(scenario)
    how = {name: work.sizes[name] for name in ("generations", "parents", "offspring")}

    def inferred(seed: int) -> dict[str, Any] | None:
        models = methods.least_squares(scenario, seed, should_stop=work.should_stop, **how)
        return models and {name: model.tolist() for name, model in models.items()}

    def measured() -> dict[str, Any]:
        return {"shares": sensor_shares(scenario, **work.sizes["shares"]).mean(axis=0).tolist()}

    runs = [
        work.piece(f"{scenario.name}-{seed}", partial(inferred, seed))
        for seed in seeds_of(work.sizes)
    ]
    shares = np.array(work.piece(f"shares-{scenario.name}", measured)["shares"])
    return Baseline(
        scenario=scenario,
        claim=claim,
        models=np.array([run["best"] for run in runs]),
        typical=np.array([run["typical"] for run in runs]),
        weighted=_optimum(scenario, shares.mean(axis=0, keepdims=True)),
        corrected=_optimum(scenario, shares),
    )


def _optimum(scenario: Scenario, shares: np.ndarray) -> np.ndarray:
    """Return the model (P,) that least squares prefers, by the shares of the sensor states (T, n)."""
    wheels = np.array(scenario.controller).reshape(-1, 2).T
    optima = [methods.least_squares_optimum(shares, wheel) for wheel in wheels]
    return np.stack(optima, axis=1).ravel()


def _errors_verdict(baseline: Baseline) -> ClaimVerdict:
    names = baseline.scenario.parameter_names
    printed = Spreads.printed(baseline.claim)
    observed = Spreads.of(absolute_error(baseline.models, baseline.scenario.controller))
    left_wheel = baseline.models.mean(axis=0)[[0, 2]]
    came_out = f"{observed.listed(names)}; left wheel {left_wheel[0]:.2f} and {left_wheel[1]:.2f}, weighted mean "
    came_out += f"{baseline.weighted[0]:.4f} with the shares measured here"
    text = (
        f"{printed.listed(names, 2)}; left wheel near -0.54 in both states, weighted mean -0.5504"
    )
    agrees = observed.within(printed)
    return verdict_on(baseline.claim, agrees, came_out, "errors of the baseline", printed=text)


def _picture_verdict(baseline: Baseline, models: np.ndarray, variant: str = "") -> ClaimVerdict:
    """Hold models against a picture: both quartiles are nearer to the weighted mean than to the truth."""
    truth = np.array(baseline.scenario.controller)
    weighted = baseline.weighted
    low, middle, high = np.quantile(models, (0.25, 0.5, 0.75), axis=0)
    agrees = all((abs(bound - weighted) < abs(bound - truth)).all() for bound in (low, high))
    texts = []
    for k, name in enumerate(baseline.scenario.parameter_names):
        texts.append(
            f"{name} {middle[k]:.2f} ({low[k]:.2f} to {high[k]:.2f}; "
            f"weighted mean {weighted[k]:.2f}, truth {truth[k]:g})"
        )
    observed = f"medians and quartiles: {', '.join(texts)}"
    return verdict_on(baseline.claim, agrees, observed, "baseline's picture", variant)


def _show_baseline(findings: Findings, baseline: Baseline, seeds: range) -> pd.DataFrame:
    """Add models and pictures of a case study; return quartiles beside what the theorem predicts."""
    scenario = baseline.scenario
    names = scenario.parameter_names
    truth = np.array(scenario.controller)
    frames = {
        "best_model": seeded(seeds, baseline.models, names),
        "typical": seeded(seeds, baseline.typical, names),
    }
    findings.table(
        "{scenario.name}-models", stacked(frames, "model"), scenario=scenario, typical=TYPICAL
    )
    words: dict[str, Any] = {"scenario": scenario, "runs": len(seeds)}
    boxes = box_figure(baseline.models, names=names, truth=truth)
    findings.picture("{scenario.name}-boxes", baseline.claim, boxes, **words)
    columns = {
        "parameter": names,
        "truth": truth,
        "theorem_1": baseline.weighted,
        "corollary_3": baseline.corrected,
    }
    frame = pd.DataFrame(columns).join(Spreads.of(baseline.models).frame())
    for baseline_kind, prefix, quantity, models in (
        ("predictions", "", "best model of the last generation", baseline.models),
        ("typical", "typical_", TYPICAL, baseline.typical),
    ):
        quartiles = []
        for quartile in ("lower_quartile", "median", "upper_quartile"):
            quartiles.append(f"{prefix}{quartile}")
        frame[quartiles] = np.quantile(models, (0.25, 0.5, 0.75), axis=0).T
        figure = prediction_figure(models, predicted=baseline.weighted, names=names, truth=truth)
        findings.picture(
            "{scenario.name}-{kind}",
            baseline.claim,
            figure,
            kind=baseline_kind,
            what=quantity,
            **words,
        )
    return frame


TURING_LEARNING = "Turing Learning"
ABC_SMC = "ABC-SMC"
NPE_IN_ROUNDS = "NPE in rounds"
MIXTURE = "mixture"
METHODS = {
    "turing-learning": TURING_LEARNING,
    "abc-smc": ABC_SMC,
    "npe": "NPE",
    "npe-rounds": NPE_IN_ROUNDS,
    MIXTURE: MIXTURE,
}
"""Key of a method -> its name."""


def conduct_comparison(work: Work, findings: Findings) -> None:
    """Run every method with every number of trials."""
    sizes = work.sizes
    seeds = range(sizes["first_seed"], sizes["first_seed"] + sizes["seeds"])
    fits = all(
        trials % sizes["group"] == 0 == trials % sizes["population"] for trials in sizes["trials"]
    )
    rule = f"be multiples of {sizes['group']} and {sizes['population']}"
    require(fits, "trials", rule, str(sizes["trials"]))
    # Imported here: what the import takes is not the time of a method.
    for package in ("pyabc", "sbi", "sklearn"):
        methods.baseline(package)
    panels: dict[str, dict[str, dict[int, np.ndarray]]] = {}
    for scenario in (AGGREGATION, OBJECT_CLUSTERING):
        panel: dict[str, dict[int, np.ndarray]] = {}
        pieces = {}
        for method, name in METHODS.items():
            panel[name] = {}
            for trials in sizes["observed" if method == MIXTURE else "trials"]:
                inferred = [_inferred(work, scenario, method, trials, seed) for seed in seeds]
                pieces[method, trials] = inferred
                estimates = [piece["estimate"] for piece in inferred]
                panel[name][trials] = absolute_error(estimates, scenario.controller).mean(axis=1)
        panels[scenario.title] = panel
        runs = runs_frame(scenario, pieces, seeds)
        summary = summary_frame(scenario, runs)
        findings.table(
            "{scenario.name}", summary.drop(columns=["worst", "unknown"]), True, scenario=scenario
        )
        findings.table("{scenario.name}-runs", runs.drop(columns="processor_s"), scenario=scenario)
        findings.remarks += remarks(scenario.title, summary)
    findings.picture("accuracy", "", budget_figure(panels), seeds=len(seeds))


def _inferred(
    work: Work, scenario: Scenario, method: str, trials: int, seed: int
) -> dict[str, Any]:
    """Return what a method has inferred with a seed, a piece of work."""
    sizes = work.sizes

    def compute() -> dict[str, Any] | None:
        groups = methods.Groups(scenario, sizes["group"])
        observed = trials if method == MIXTURE else max(sizes["observed"])
        genuine = groups.observe(observed, np.random.default_rng((COMPARISON_OBSERVATION, seed)))
        begin = time.process_time()
        inferred = _infer(work, groups, genuine, method, trials, seed)
        if inferred is None:
            return None
        return as_json(inferred, time.process_time() - begin)

    return work.piece(f"{scenario.name}-{method}-{trials}-seed{seed}", compute)


def _infer(
    work: Work, groups: methods.Groups, genuine: np.ndarray, method: str, trials: int, seed: int
) -> methods.Inferred | None:
    """Infer by a method from the motion of agents (K, T, 2) and so many trials; None if it was stopped."""
    if METHODS[method] == TURING_LEARNING:
        return _infer_by_turing_learning(work, groups.scenario, trials, seed)
    if method == MIXTURE:
        return methods.fit_mixture(genuine, groups.scenario, seed)
    summaries = methods.summaries(genuine, groups.scenario)
    evaluations = trials // groups.size
    if METHODS[method] == ABC_SMC:
        return methods.infer_by_abc_smc(groups, summaries, evaluations, seed, work.should_stop)
    rounds = work.sizes["rounds"] if METHODS[method] == NPE_IN_ROUNDS else 1
    return methods.infer_by_npe(
        groups, summaries, evaluations, seed, work.should_stop, rounds=rounds
    )


def _infer_by_turing_learning(
    work: Work, scenario: Scenario, trials: int, seed: int
) -> methods.Inferred | None:
    from turing_learning.runs import Evolution, infer

    population = work.sizes["population"]
    populations = {"models.population": population, "classifiers.population": population}
    result = infer(
        scenario,
        generations=trials // population,
        seed=seed,
        threads=1,
        settings=populations | work.sizes["settings"],
        should_stop=work.should_stop,
    )
    if not result.complete:
        return None
    assert isinstance(result, Evolution)
    low, high = np.array(list(result.wandering.values())).T
    return methods.Inferred(np.array(list(result.estimate.values())), low, high)


def as_json(inferred: methods.Inferred, seconds: float) -> dict[str, Any]:
    """Return what a piece of work holds: None where a number is not known."""
    content: dict[str, Any] = {}
    for name, values in vars(inferred).items():
        content[name] = None
        if values is not None:
            content[name] = [value if is_known(value) else None for value in values.tolist()]
    return content | {"processor_seconds": round(seconds, 2)}


def runs_frame(
    scenario: Scenario,
    pieces: Mapping[tuple[str, int], Sequence[Mapping[str, Any]]],
    seeds: Sequence[int],
) -> pd.DataFrame:
    """Return every run, by pieces of work by method and number of trials, seed by seed; ends not known are empty."""
    names = scenario.parameter_names
    columns = []
    for name in names:
        for bound in ("low", "high"):
            columns.append(f"{bound}_{name}")
    unknown = [None] * len(names)
    frames = {}
    for key, runs in pieces.items():
        estimates = np.array([run["estimate"] for run in runs])
        maes = absolute_error(estimates, scenario.controller).mean(axis=1)
        bounds = [[run["low"] or unknown, run["high"] or unknown] for run in runs]
        intervals = np.array(bounds, dtype=float).transpose(0, 2, 1).reshape(len(bounds), -1)
        frame = seeded(seeds, estimates, names).assign(MAE=maes)
        frame = frame.join(pd.DataFrame(intervals, columns=columns))
        frames[key] = frame.assign(processor_s=[run["processor_seconds"] for run in runs])
    return stacked(frames, "method", "trials")


def summary_frame(scenario: Scenario, runs: pd.DataFrame) -> pd.DataFrame:
    """Return medians over the seeds, the worst MAE, and the share of true parameters in their intervals.

    Intervals that are not known hold no truth; `unknown` is their number.
    """
    names = list(scenario.parameter_names)
    truth = np.array(scenario.controller)
    rows = []
    for (method, trials), group in runs.groupby(["method", "trials"], sort=False):
        low = group[[f"low_{name}" for name in names]].to_numpy()
        high = group[[f"high_{name}" for name in names]].to_numpy()
        widths = high - low
        finite = widths[np.isfinite(widths)]
        row: dict[str, Any] = {
            "method": METHODS[method],
            "trials": trials,
            "MAE": group["MAE"].median(),
        }
        errors = np.median(absolute_error(group[names].to_numpy(), truth), axis=0)
        row |= dict(zip(names, errors, strict=True))
        # A mixture has no intervals.
        row["coverage"] = (
            None if method == MIXTURE else float(((low <= truth) & (truth <= high)).mean())
        )
        row["width"] = finite.mean() if finite.size else None
        row["processor_s"] = group["processor_s"].median()
        row["worst"] = group["MAE"].max()
        row["unknown"] = 0 if method == MIXTURE else int(np.isnan(widths).sum())
        rows.append(row)
    return pd.DataFrame(rows)


def remarks(title: str, summary: pd.DataFrame) -> list[str]:
    """Return sentences about one scenario: who is how accurate, and where Turing Learning is beaten."""
    rows: list[Any] = list(summary.itertuples())
    simulating = [row for row in rows if row.method != MIXTURE]
    mixture = max((row for row in rows if row.method == MIXTURE), key=lambda row: row.trials)
    turing_learning = {row.trials: row for row in rows if row.method == TURING_LEARNING}
    sentences = []
    for trials in turing_learning:
        ranked = sorted(
            (row for row in simulating if row.trials == trials), key=lambda row: row.MAE
        )
        listing = ", ".join(map(_accuracy, ranked))
        sentences.append(
            f"{title}, {trials:,} simulated trials, median MAE (of the worst seed; time): {listing}; "
            f"{_accuracy(mixture)} without any, from {mixture.trials:,} observed ones."
        )
    most_trials = max(turing_learning)
    wins = []
    for row in rows:
        if row.method == MIXTURE:
            wins += _wins(row, turing_learning[most_trials], "observed", f" with {most_trials:,}")
        elif row.method != TURING_LEARNING:
            wins += _wins(row, turing_learning[row.trials], "simulated", "")
    sentences.append(f"**Where the others win, {title.lower()}:** {'; '.join(wins) or 'nowhere'}.")
    unknown = [
        f"{row.method} {row.unknown} with {row.trials:,} trials" for row in rows if row.unknown
    ]
    if unknown:
        listing = ", ".join(unknown)
        sentences.append(
            f"Intervals that are not known, and count as not holding the truth: {listing}: {WHY_UNKNOWN}."
        )
    return sentences


def _accuracy(row: Any) -> str:
    return f"{row.method} {row.MAE:.4f} ({row.worst:.4f}; {row.processor_s:.1f} s)"


def _wins(row: Any, turing_learning: Any, trials: str, beside: str) -> list[str]:
    """Say in what a method beats Turing Learning, if it does: in accuracy, or in time."""
    better = []
    if row.MAE < turing_learning.MAE:
        better.append(f"a smaller median error ({row.MAE:.4f}, {turing_learning.MAE:.4f})")
    if row.processor_s < turing_learning.processor_s:
        better.append(f"less time ({row.processor_s:.1f} s, {turing_learning.processor_s:.1f} s)")
    if not better:
        return []
    effort = f"{row.method} with {row.trials:,} {trials} trials"
    return [f"{effort} has {' and '.join(better)} than Turing Learning{beside}"]
