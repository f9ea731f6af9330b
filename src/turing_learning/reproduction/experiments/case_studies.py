"""Sections 3.2 and 4.3: snapshots of both behaviors, and both case studies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import Comparison, compare, dispersion, interval, largest_cluster, least_dispersion
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._many_runs import convergence_figure, dispersion_figure
from turing_learning.figures._swarms import snapshots_figure
from turing_learning.purposes import EMERGENCE_STARTS
from turing_learning.results import RunFolder
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import (
    KINDS,
    PRESETS,
    Captions,
    Experiment,
    Findings,
    Runs,
    RunSizes,
    ShareSizes,
    Table,
    Work,
    gathered,
    moved,
    sensor_shares,
    small,
    stacked,
    variant_of,
)
from .._verdicts import (
    PRINTED,
    REASONS,
    ClaimVerdict,
    Spread,
    errors_verdict,
    load_claims,
    shares_not_worse,
    spreads_of,
)

GATHERED = "3.2-snapshots"
SHARE = 0.9  # of all robots, or objects, in the largest cluster: then they count as one cluster


@dataclass(frozen=True)
class SnapshotSizes:
    """How many trials, of how many robots, when they are shown, and when else they are measured."""

    trials: int = 30
    aggregating_robots: int = 50
    aggregation_times_s: tuple[int, ...] = (0, 60, 180, 300)
    clustering_robots: int = 5
    clustering_times_s: tuple[int, ...] = (0, 20, 40, 60)
    clustering_later_s: tuple[int, ...] = (120, 240)
    seed: int = 1


def conduct_snapshots(work: Work) -> Findings:
    """Simulate both behaviors, and show the trial of median dispersion at the end."""
    sizes: SnapshotSizes = work.sizes
    captions, frames, pictures, texts, agrees = Captions("3.2"), {}, [], [], True
    for scenario, robots, times_s, later_s in (
        (AGGREGATION, sizes.aggregating_robots, sizes.aggregation_times_s, ()),
        (OBJECT_CLUSTERING, sizes.clustering_robots, sizes.clustering_times_s, sizes.clustering_later_s),
    ):
        compute = partial(_simulated, scenario, robots, times_s, later_s, sizes)
        found = work.piece(f"snapshots-{scenario.name}", compute)
        total, largest, end = found["gathering"], np.array(found["largest_cluster"]), len(times_s) - 1
        shown, trials = int(largest[found["shown"], end]), len(largest)
        enough = np.count_nonzero(largest >= math.ceil(SHARE * total), axis=0)
        agrees = agrees and shown >= SHARE * total
        later = "".join(f", in {enough[end + 1 + k]} after {time} s" for k, time in enumerate(later_s))
        texts.append(
            f"{scenario.title.lower()}: {shown} of {total} {'objects' if scenario.objects.count else 'robots'} in one cluster "
            f"after {times_s[-1]} s in the trial shown, 90 % or more in {enough[end]} of {trials} trials{later}"
        )
        measured_s = times_s + later_s
        frame = {"trial": np.repeat(np.arange(1, trials + 1), len(measured_s)), "time_s": np.tile(measured_s, trials)}
        frame |= {name: np.ravel(found[name]) for name in ("dispersion", "largest_cluster")}
        frames[scenario.name] = pd.DataFrame(frame)
        radii: dict[str, Any] = {"robot_radius_cm": scenario.robot.radius_cm}
        radii["object_radius_cm"] = scenario.objects.radius_cm
        figure = snapshots_figure(np.array(found["poses"]), times_s=times_s, robots=robots, **radii)
        objects = f" and {total} objects" if scenario.objects.count else ""
        words = {"scenario": scenario, "robots": robots, "objects": objects, "trials": trials}
        pictures.append(captions.picture("{scenario.name}", GATHERED, figure, **words))
    reason = "" if agrees else REASONS[GATHERED]
    verdict = ClaimVerdict(GATHERED, agrees, PRINTED[GATHERED], "; ".join(texts), "snapshots", reason=reason)
    return Findings([verdict], [captions.table("snapshots", stacked(frames, "behavior"))], pictures)


def _simulated(
    scenario: Scenario, robots: int, times_s: tuple[int, ...], later_s: tuple[int, ...], sizes: SnapshotSizes
) -> dict[str, Any]:
    trials, seed, last = sizes.trials, sizes.seed, len(times_s) - 1
    steps = [round(time / scenario.trial.control_interval_s) for time in times_s + later_s]
    poses = moved(scenario, scenario.controller, trials, robots, steps[-1], starts=seed, noise=seed).poses[:, steps]
    positions, radius = gathered(scenario, poses, robots)
    spread = dispersion(positions, radius)
    shown = int(np.argsort(spread[:, last], kind="stable")[(trials - 1) // 2])
    return {
        "dispersion": spread.tolist(),
        "largest_cluster": largest_cluster(positions, radius).tolist(),
        "gathering": positions.shape[2],
        "shown": shown,
        "poses": poses[shown, : last + 1].tolist(),
    }


SNAPSHOTS = Experiment.of(
    "3.2", conduct_snapshots, full=SnapshotSizes(),
    fast=SnapshotSizes(trials=3, aggregating_robots=12, aggregation_times_s=(0, 30, 90, 150)),
)  # fmt: skip


CAPTIONS = Captions("4.3")
NEAR = 0.1
LASTING = 20
SHARE_ROUNDING = 0.0005
SLOWNESS = 2.0
SPREAD_OUT = 2.0  # A swarm does not gather if its median dispersion is this many times that of the agents
NAMED = {"aggregation": (50, 50, 200, 200), "object-clustering": (200, 200, 200, 200, 400, 400)}
"""Generations at which the paper's text sees the parameters close to the truth, or about to be."""
REPEATS = 1000  # number of the first repetition of the agents' trials; models are numbered from 1 on


@dataclass(frozen=True)
class EmergenceSizes:
    """How many trials of how many robots, and for how long; how often the agents' are repeated.

    Objects grow in proportion to the robots.
    """

    robots: int
    trials: int = 30
    duration_s: float = 400.0
    repeats: int = 10
    seed: int = 1


@dataclass(frozen=True)
class CaseStudySizes(RunSizes):
    """How many runs and generations, and what is done with the models."""

    settings: Mapping[str, Any] = field(default_factory=dict)
    shares: ShareSizes = field(default_factory=ShareSizes)
    aggregation: EmergenceSizes = field(default_factory=lambda: EmergenceSizes(robots=50))
    clustering: EmergenceSizes = field(default_factory=lambda: EmergenceSizes(robots=25))


@dataclass(frozen=True)
class Case:
    """One case study."""

    scenario: Scenario
    key: str  # its name in the ids of the claims
    emergence: EmergenceSizes  # how the swarms of its models are measured

    @property
    def gathered(self) -> str:
        """What gathers: "objects" or "robots"."""
        return "objects" if self.scenario.objects.count else "robots"

    @property
    def gathering(self) -> int:
        """How many objects or robots are to gather when emergence is measured."""
        objects = round(self.scenario.objects.count * self.emergence.robots / self.scenario.individuals)
        return objects or self.emergence.robots


@dataclass(frozen=True, eq=False)
class Emergence:
    """The dispersion at the end of R trials, all from the same initial configurations."""

    agents: np.ndarray  # (R,)
    models: np.ndarray  # (M, R), of replicas of each of M models
    repeated: np.ndarray  # (K, R), of the agents again, with other noise: how much hangs on their R trials?

    @property
    def comparison(self) -> Comparison:
        """Each model's trials tested against those of the agents."""
        return compare(self.agents, self.models)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the runs of one case study with one preset have inferred."""

    case: Case
    runs: Runs
    intervals: np.ndarray  # (R, 2, P), ends of the 90 % interval of each run's estimate; NaN where unknown
    medians: np.ndarray  # (G, P), over the runs, of the best model of each generation
    emergence: dict[str, Emergence]  # by the kind of the models


def conduct_case_studies(work: Work) -> Findings:
    """Conduct the studies, and measure shares and dispersion."""
    sizes: CaseStudySizes = work.sizes
    cases = [Case(AGGREGATION, "aggregation", sizes.aggregation)]
    cases.append(Case(OBJECT_CLUSTERING, "clustering", sizes.clustering))
    outcomes = [_outcome(work, case, preset) for preset in PRESETS for case in cases]
    shares = {}
    for case in cases:
        compute = partial(_shares, case.scenario, sizes.shares)
        shares[case] = spreads_of(np.array(work.piece(f"shares-{case.scenario.name}", compute)["shares"]))
    remarks = []
    for one in outcomes:
        (low, high), truth = np.moveaxis(one.intervals, 1, 0), np.array(one.case.scenario.controller)
        remarks.append(
            f"{one.case.scenario.title}, preset {one.runs.preset}: the 90 % intervals of the estimates hold "
            f"{float(((low <= truth) & (truth <= high)).mean()):.1%} of the true parameters."
        )
    verdicts = []
    for one in outcomes:
        claim, runs = f"4.3-{one.case.key}-ae", one.runs
        verdicts += [errors_verdict(claim, runs.errors[k], runs.names, variant_of(runs.preset, k)) for k in KINDS]
    verdicts += [convergence_verdict([one for one in outcomes if one.runs.preset == preset]) for preset in PRESETS]
    verdicts += [_shares_verdict(shares), *(emergence_verdict(one, kind) for one in outcomes for kind in KINDS)]
    pictures = [picture for one in outcomes for picture in _pictures(one)]
    return Findings(verdicts, _tables(outcomes, shares), pictures, remarks)


def _outcome(work: Work, case: Case, preset: str) -> Outcome:
    from turing_learning.studies import StudyFolder
    from turing_learning.studies._table import convergences

    result = work.runs(f"study-{case.scenario.name}-{preset}", case.scenario.name, preset)
    runs, folder = Runs.of(result, preset, case.scenario.parameter_names), StudyFolder(result.path)
    emergence = {
        kind: _emergence(work, case, runs.models[kind], name)
        for kind, name in (("best_model", preset), ("estimate", f"{preset}-estimate"))
    }
    plan, intervals = folder.plan(), []
    for run in result.runs:  # read off its typical models by the present rule
        traces = RunFolder(folder.run_path(run.number)).traces()
        assert traces is not None  # of a complete run
        typical = traces["typical_model"]
        intervals.append(interval(typical, plan.configuration(run.number).run.estimated_from(len(typical))).T)
    medians = convergences(folder, plan, result.runs)[0].best_model
    return Outcome(case, runs, np.array(intervals), medians, emergence)


def _emergence(work: Work, case: Case, models: np.ndarray, name: str) -> Emergence:
    """Measure the dispersion of agents and of replicas of models (M, P), a piece of work for each (paper, section 4.3)."""
    scenario, sizes = case.scenario, case.emergence

    starts, steps = (EMERGENCE_STARTS, sizes.seed), round(sizes.duration_s / scenario.trial.control_interval_s)

    def reached(name: str, controller: Any, number: int) -> list[float]:
        """Return the dispersion at the end of each trial (R,): of the objects where there are any, otherwise of the robots."""

        def compute() -> dict[str, list[float]]:
            noise = int(np.random.SeedSequence((EMERGENCE_STARTS + 1 + number, sizes.seed)).generate_state(1)[0])
            found = moved(scenario, controller, sizes.trials, sizes.robots, steps, starts=starts, noise=noise)
            return {"dispersion": dispersion(*gathered(scenario, found.poses[:, -1], sizes.robots)).tolist()}

        return work.piece(f"dispersion-{scenario.name}-{name}", compute)["dispersion"]

    return Emergence(
        np.array(reached("agents", scenario.controller, 0)),
        np.array([reached(f"{name}-{k:02d}", model, k) for k, model in enumerate(models, start=1)]),
        np.array([reached(f"agents-{k + 1:02d}", scenario.controller, REPEATS + k) for k in range(sizes.repeats)]),
    )


def _shares(scenario: Scenario, sizes: ShareSizes) -> dict[str, Any]:
    return {"shares": sensor_shares(scenario, sizes).mean(axis=1).tolist()}  # of each sensor state (R, n)


def settled(values: np.ndarray, truth: float) -> int | None:
    """Return the first generation from which the values (G,) are near the truth for some time; None if they never are."""
    near = np.abs(values - truth) <= NEAR
    for generation in np.flatnonzero(near):
        if near[generation : generation + LASTING].all():
            return int(generation)
    return None


def settled_for_good(values: np.ndarray, truth: float) -> int | None:
    """Return the first generation from which the values (G,) are near the truth until the end; None if they are not in the end."""
    far = np.flatnonzero(np.abs(values - truth) > NEAR)
    first = int(far[-1]) + 1 if far.size else 0
    return first if first < len(values) else None


def convergence_verdict(outcomes: Sequence[Outcome]) -> ClaimVerdict:
    """Hold the generations at which the medians settle, of outcomes of one preset, against the text."""
    observed, agrees = [], True
    for outcome in outcomes:
        scenario, texts = outcome.case.scenario, []
        curves = zip(outcome.runs.names, outcome.medians.T, scenario.controller, NAMED[scenario.name], strict=True)
        for name, values, truth, limit in curves:
            first, last = settled(values, truth), settled_for_good(values, truth)
            agrees &= first is not None and first <= SLOWNESS * limit
            later = "" if first is None or first == last else f" (for good {'never' if last is None else last})"
            texts.append(f"{name} {'never' if first is None else first}{later}")
        observed.append(f"{scenario.title.lower()}: {', '.join(texts)}")
    variant = variant_of(outcomes[0].runs.preset)
    claim = "4.3-convergence"
    return ClaimVerdict(claim, agrees, PRINTED[claim], "; ".join(observed), "convergence", variant)


def _shares_verdict(shares: Mapping[Case, Sequence[Spread]]) -> ClaimVerdict:
    """Hold the shares of the sensor readings against the printed ones."""
    claim = "4.3-sensor-shares"
    values = load_claims()[claim].values
    agrees = all(
        abs(one.mean - printed) <= 2 * one.standard_error + SHARE_ROUNDING
        for case, found in shares.items()
        for one, printed in zip(found, values[case.key], strict=True)
    )

    def text(numbers: Mapping[str, Sequence[float]]) -> str:
        return "; ".join(f"{key}: {' / '.join(f'{one:.3f}' for one in each)}" for key, each in numbers.items())

    printed = text({case.key: values[case.key] for case in shares})
    observed = text({case.key: [one.mean for one in found] for case, found in shares.items()})
    return ClaimVerdict(claim, agrees, printed, observed, "shares", reason="" if agrees else REASONS[claim])


def emergence_verdict(outcome: Outcome, kind: str) -> ClaimVerdict:
    """Hold the number of models whose swarms do what the agents do against the printed one."""
    claim, emergence = f"4.3-emergent-{outcome.case.key}", outcome.emergence[kind]
    count, total = load_claims()[claim].values["no_significant_difference"]
    alike, models = emergence.comparison.without_difference, len(emergence.models)
    agents, medians = np.median(emergence.agents), np.median(emergence.models, axis=1)
    others = [compare(agents, emergence.models).without_difference for agents in emergence.repeated]
    span = " to ".join(str(n) for n in sorted({min(others), max(others)}))
    agrees = shares_not_worse(alike / models, models, count / total, total) and medians.max() <= SPREAD_OUT * agents
    fewer = f"; {alike} is fewer than {count}, but not by more than chance explains" if agrees and alike < count else ""
    observed = (
        f"no significant difference in {alike} of {models} cases ({span} with {len(others)} repetitions of the agents' trials); "
        f"median dispersion of the agents {agents:.0f}, of the models {medians.min():.0f} to {medians.max():.0f}{fewer}"
    )
    printed = f"no significant difference in {count} of {total} cases"
    return ClaimVerdict(claim, agrees, printed, observed, "counts", variant_of(outcome.runs.preset, kind))


def _tables(outcomes: Sequence[Outcome], shares: Mapping[Case, Sequence[Spread]]) -> list[Table]:
    errors, convergence, printed = {}, [], load_claims()["4.3-sensor-shares"].values
    for one in outcomes:
        scenario, preset = one.case.scenario, one.runs.preset
        errors[scenario.name, preset] = one.runs.errors_frame(f"4.3-{one.case.key}-ae")
        frame = pd.DataFrame(one.medians.astype(float), columns=one.runs.names).map(partial(round, ndigits=4))
        frame.insert(0, "generation", frame.index)
        convergence.append(
            CAPTIONS.table("{scenario.name}-{preset}-convergence", frame, scenario=scenario, preset=preset)
        )
    models, readings, dispersions = [], {}, []
    for case, found in shares.items():
        words: dict[str, Any] = {"scenario": case.scenario, "case": case}
        own, names = [one for one in outcomes if one.case == case], case.scenario.parameter_names
        frames, ends = {}, [f"{end}_{name}" for end in ("low", "high") for name in names]
        trials = [f"trial_{k}" for k in range(1, case.emergence.trials + 1)]
        reached = {("", "agents"): pd.DataFrame([own[0].emergence["best_model"].agents], columns=trials)}
        for one in own:
            intervals = pd.DataFrame(one.intervals.reshape(len(one.runs), -1), columns=ends)
            intervals.index += len(one.runs)  # the estimates come after the best models, which have no intervals
            frames[one.runs.preset] = one.runs.models_frame().join(intervals)
            for kind, emergence in one.emergence.items():
                tests = emergence.comparison
                found_by = {"p_value": tests.p_values, "significant": tests.significant.astype(object)}
                frame = pd.DataFrame({"seed": one.runs.seeds, **found_by})
                reached[one.runs.preset, kind] = frame.join(pd.DataFrame(emergence.models, columns=trials))
        models.append(CAPTIONS.table("{scenario.name}-models", stacked(frames, "preset"), **words))
        frame = stacked(reached, "preset", "model")[["preset", "model", "seed", "p_value", "significant", *trials]]
        dispersions.append(CAPTIONS.table("{scenario.name}-dispersion", frame, **words))
        numbers = {"share": [one.mean for one in found], "standard_error": [one.standard_error for one in found]}
        readings[case.scenario.name] = pd.DataFrame(
            {"reading": range(len(found)), **numbers, "paper": printed[case.key]}
        )
    return [
        CAPTIONS.table("absolute-errors", stacked(errors, "scenario", "preset")),
        *models,
        *convergence,
        CAPTIONS.table("sensor-shares", stacked(readings, "scenario")),
        *dispersions,
    ]


def _pictures(outcome: Outcome) -> list[Picture]:
    case, runs, scenario = outcome.case, outcome.runs, outcome.case.scenario
    words: dict[str, Any] = {"scenario": scenario, "preset": runs.preset, "runs": len(runs), "case": case}
    look: dict[str, Any] = {"names": runs.names, "truth": scenario.controller}
    emergence, least = outcome.emergence["best_model"], least_dispersion(case.gathering)
    swarms = dispersion_figure(emergence.agents, emergence.models, least=least, gathered=case.gathered)
    pictures = (
        ("boxes", f"4.3-{case.key}-ae", box_figure(runs.models["best_model"], **look)),
        ("convergence", "4.3-convergence", convergence_figure(outcome.medians, **look)),
        ("dispersion", f"4.3-emergent-{case.key}", swarms),
    )
    return [
        CAPTIONS.picture("{scenario.name}-{preset}-" + name, claim, figure, **words) for name, claim, figure in pictures
    ]


CASE_STUDIES = Experiment.of(
    "4.3", conduct_case_studies, full=CaseStudySizes(),
    fast=CaseStudySizes(
        runs=3, generations=12, settings=small(10, 12), shares=ShareSizes(trials=5),
        aggregation=EmergenceSizes(robots=11, trials=4, duration_s=20.0, repeats=2),
        clustering=EmergenceSizes(robots=5, trials=4, duration_s=20.0, repeats=2),
    ),
)  # fmt: skip
