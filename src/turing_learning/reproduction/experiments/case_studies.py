"""Sections 3.2 and 4.3: snapshots of both behaviors, and both case studies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import compare, dispersion, interval, largest_cluster, least_dispersion
from turing_learning.figures import box_figure
from turing_learning.figures.many_runs import convergence_figure, dispersion_figure
from turing_learning.figures.swarms import snapshots_figure
from turing_learning.purposes import EMERGENCE_STARTS
from turing_learning.results import RunFolder
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import KINDS, PRESETS, Findings, Runs, Sizes, Work, index_of_median, moved, sensor_shares, stacked
from .._verdicts import ClaimVerdict, Spreads, errors_verdict, held, load_claims, shares_not_worse

GATHERED = "3.2-snapshots"
SHARE = 0.9  # of all robots, or objects, in the largest cluster: then they count as one cluster


def conduct_snapshots(work: Work, findings: Findings) -> None:
    """Simulate both behaviors, and show the trial of median dispersion at the end."""
    sizes, frames, texts, agrees = work.sizes, {}, [], True
    for scenario, robots, times_s, later_s in (
        (AGGREGATION, sizes["aggregating_robots"], sizes["aggregation_times_s"], []),
        (OBJECT_CLUSTERING, sizes["clustering_robots"], sizes["clustering_times_s"], sizes["clustering_later_s"]),
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
        index = pd.MultiIndex.from_product([range(1, trials + 1), times_s + later_s], names=["trial", "time_s"])
        columns = {name: np.ravel(found[name]) for name in ("dispersion", "largest_cluster")}
        frames[scenario.name] = pd.DataFrame(columns, index).reset_index()
        look: dict[str, Any] = {"robots": robots, "robot_radius_cm": scenario.robot.radius_cm}
        look["object_radius_cm"] = scenario.objects.radius_cm
        figure = snapshots_figure(np.array(found["poses"]), times_s=times_s, **look)
        objects = f" and {total} objects" if scenario.objects.count else ""
        words = {"scenario": scenario, "robots": robots, "objects": objects, "trials": trials}
        findings.picture("{scenario.name}", GATHERED, figure, **words)
    findings.verdicts.append(held(GATHERED, agrees, "; ".join(texts), "snapshots"))
    findings.table("snapshots", stacked(frames, "behavior"))


def gathering_disks(scenario: Scenario, poses: np.ndarray, robots: int) -> tuple[np.ndarray, float]:
    """Return positions (..., S, 2) and radius (cm) of those that are to gather: objects, or robots where there are none."""
    if scenario.objects.count:
        return poses[..., robots:, :2], scenario.objects.radius_cm
    return poses[..., :robots, :2], scenario.robot.radius_cm


def _simulated(scenario: Scenario, robots: int, times_s: list[int], later_s: list[int], sizes: Sizes) -> dict[str, Any]:
    trials, seed, last = sizes["trials"], sizes["seed"], len(times_s) - 1
    steps = [round(time / scenario.trial.control_interval_s) for time in times_s + later_s]
    poses = moved(scenario, scenario.controller, trials, robots, steps[-1], starts=seed, noise=seed).poses[:, steps]
    positions, radius = gathering_disks(scenario, poses, robots)
    spread = dispersion(positions, radius)
    shown = index_of_median(spread[:, last])
    return {
        "dispersion": spread.tolist(),
        "largest_cluster": largest_cluster(positions, radius).tolist(),
        "gathering": positions.shape[2],
        "shown": shown,
        "poses": poses[shown, : last + 1].tolist(),
    }


NEAR = 0.1
LASTING = 20
SHARE_ROUNDING = 0.0005
SLOWNESS = 2.0
SPREAD_OUT = 2.0  # A swarm does not gather if its median dispersion is this many times that of the agents
NAMED = {"aggregation": (50, 50, 200, 200), "object-clustering": (200, 200, 200, 200, 400, 400)}
"""Generations at which the paper's text sees the parameters close to the truth, or about to be."""
REPEATS = 1000  # number of the first repetition of the agents' trials; models are numbered from 1 on


@dataclass(frozen=True, eq=False)
class Case:
    """One case study; the R trials of its agents begin as those of its models."""

    scenario: Scenario
    key: str  # its name in the ids of the claims
    emergence: Sizes  # how the swarms of its models are measured
    shares: Spreads  # of the sensor readings, over trials
    agents: np.ndarray  # their dispersion (R,) at the end of the trials
    repeated: np.ndarray  # (K, R), of the agents again, with other noise: how much hangs on their R trials?

    @property
    def gathered(self) -> str:
        """What gathers: "objects" or "robots"."""
        return "objects" if self.scenario.objects.count else "robots"

    @property
    def gathering(self) -> int:
        """How many objects or robots are to gather when emergence is measured."""
        robots: int = self.emergence["robots"]
        return round(self.scenario.objects.count * robots / self.scenario.individuals) or robots


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the runs of one case study with one preset have inferred."""

    case: Case
    runs: Runs
    intervals: np.ndarray  # (R, 2, P), ends of the 90 % interval of each run's estimate; NaN where unknown
    medians: np.ndarray  # (G, P), over the runs, of the best model of each generation
    emergence: dict[str, np.ndarray]  # kind -> dispersion (M, R) of replicas of each of M models


def conduct_case_studies(work: Work, findings: Findings) -> None:
    """Conduct the studies, and measure shares and dispersion."""
    cases = []
    for scenario, key in ((AGGREGATION, "aggregation"), (OBJECT_CLUSTERING, "clustering")):
        # of each sensor state (R, n)
        compute = partial(lambda one: {"shares": sensor_shares(one, **work.sizes["shares"]).mean(1).tolist()}, scenario)
        shares = Spreads.of(np.array(work.piece(f"shares-{scenario.name}", compute)["shares"]))
        reached = partial(_reached, work, scenario, sizes := work.sizes[key])
        again = [reached(f"agents-{k + 1:02d}", scenario.controller, REPEATS + k) for k in range(sizes["repeats"])]
        agents = reached("agents", scenario.controller, 0)
        cases.append(Case(scenario, key, sizes, shares, agents, np.array(again)))
    outcomes = [_outcome(work, case, preset) for preset in PRESETS for case in cases]
    verdicts = findings.verdicts
    for one in outcomes:
        (low, high), truth = np.moveaxis(one.intervals, 1, 0), np.array(one.case.scenario.controller)
        findings.remarks.append(
            f"{one.case.scenario.title}, preset {one.runs.preset}: the 90 % intervals of the estimates hold "
            f"{float(((low <= truth) & (truth <= high)).mean()):.1%} of the true parameters."
        )
        claim, runs = f"4.3-{one.case.key}-ae", one.runs
        verdicts += [errors_verdict(claim, runs.errors[k], runs.names, runs.variant(k)) for k in KINDS]
    verdicts += [convergence_verdict([one for one in outcomes if one.runs.preset == preset]) for preset in PRESETS]
    verdicts += [_shares_verdict(cases), *(emergence_verdict(one, kind) for one in outcomes for kind in KINDS)]
    _show(findings, cases, outcomes)


def _outcome(work: Work, case: Case, preset: str) -> Outcome:
    from turing_learning.studies import StudyFolder, convergences

    scenario = case.scenario
    runs = work.runs(f"study-{scenario.name}-{preset}", scenario.name, preset, scenario.parameter_names)
    emergence, reached = {}, partial(_reached, work, scenario, case.emergence)
    for kind, name in (("best_model", preset), ("estimate", f"{preset}-estimate")):
        spreads = [reached(f"{name}-{k:02d}", model, k) for k, model in enumerate(runs.models[kind], start=1)]
        emergence[kind] = np.array(spreads)
    folder, intervals = StudyFolder(runs.result.path), []
    plan = folder.plan()
    for run in runs.result.runs:  # read off its typical models by the present rule
        traces = RunFolder(folder.run_path(run.number)).traces()
        assert traces is not None  # of a complete run
        typical = traces["typical_model"]
        intervals.append(interval(typical, plan.configuration(run.number).run.estimated_from(len(typical))).T)
    medians = convergences(folder, plan, runs.result.runs)[0][1]["best_model"]
    return Outcome(case, runs, np.array(intervals), medians, emergence)


def _reached(work: Work, scenario: Scenario, sizes: Sizes, name: str, controller: Any, number: int) -> np.ndarray:
    """Return the dispersion at the end of each trial (R,) of those that are to gather, a piece of work."""

    def compute() -> dict[str, list[float]]:
        seed, robots = sizes["seed"], sizes["robots"]
        noise = int(np.random.SeedSequence((EMERGENCE_STARTS + 1 + number, seed)).generate_state(1)[0])
        steps, starts = round(sizes["duration_s"] / scenario.trial.control_interval_s), (EMERGENCE_STARTS, seed)
        simulation = moved(scenario, controller, sizes["trials"], robots, steps, starts=starts, noise=noise)
        positions, radius = gathering_disks(scenario, simulation.poses[:, -1], robots)
        return {"dispersion": dispersion(positions, radius).tolist()}

    return np.array(work.piece(f"dispersion-{scenario.name}-{name}", compute)["dispersion"])


def settled(values: np.ndarray, truth: float) -> tuple[int | None, int | None]:
    """Return the first generations from which values (G,) are near the truth for some time, and to the end; None if never."""
    near = np.abs(values - truth) <= NEAR
    lasting = [near[generation : generation + LASTING].all() for generation in range(len(near))]
    to_the_end = np.logical_and.accumulate(near[::-1])[::-1]
    first, last = (int(np.argmax(each)) if np.any(each) else None for each in (lasting, to_the_end))
    return first, last


def convergence_verdict(outcomes: Sequence[Outcome]) -> ClaimVerdict:
    """Hold the generations at which the medians settle, of outcomes of one preset, against the text."""
    observed, agrees = [], True
    for outcome in outcomes:
        scenario, texts = outcome.case.scenario, []
        curves = zip(outcome.runs.names, outcome.medians.T, scenario.controller, NAMED[scenario.name], strict=True)
        for name, values, truth, limit in curves:
            first, last = settled(values, truth)
            agrees &= first is not None and first <= SLOWNESS * limit
            later = "" if first is None or first == last else f" (for good {'never' if last is None else last})"
            texts.append(f"{name} {'never' if first is None else first}{later}")
        observed.append(f"{scenario.title.lower()}: {', '.join(texts)}")
    return held("4.3-convergence", agrees, "; ".join(observed), "convergence", outcomes[0].runs.variant())


def _shares_verdict(cases: Sequence[Case]) -> ClaimVerdict:
    """Hold the shares of the sensor readings against the printed ones."""
    claim = "4.3-sensor-shares"
    values = load_claims()[claim].values
    agrees = all(
        (np.abs(one.shares.mean - values[one.key]) <= 2 * one.shares.standard_error + SHARE_ROUNDING).all()
        for one in cases
    )

    def text(numbers: Mapping[str, Any]) -> str:
        return "; ".join(f"{one.key}: {' / '.join(f'{share:.3f}' for share in numbers[one.key])}" for one in cases)

    observed = text({one.key: one.shares.mean for one in cases})
    return held(claim, agrees, observed, "shares", printed=text(values))


def emergence_verdict(outcome: Outcome, kind: str) -> ClaimVerdict:
    """Hold the number of models whose swarms do what the agents do against the printed one."""
    case, models = outcome.case, outcome.emergence[kind]
    claim, alike, runs = f"4.3-emergent-{case.key}", compare(case.agents, models).without_difference, len(models)
    count, total = load_claims()[claim].values["no_significant_difference"]
    agents, medians = np.median(case.agents), np.median(models, axis=1)
    others = [compare(again, models).without_difference for again in case.repeated]
    span = " to ".join(str(n) for n in sorted({min(others), max(others)}))
    agrees = shares_not_worse(alike / runs, runs, count / total, total) and medians.max() <= SPREAD_OUT * agents
    fewer = f"; {alike} is fewer than {count}, but not by more than chance explains" if agrees and alike < count else ""
    observed = (
        f"no significant difference in {alike} of {runs} cases ({span} with {len(others)} repetitions of the agents' trials); "
        f"median dispersion of the agents {agents:.0f}, of the models {medians.min():.0f} to {medians.max():.0f}{fewer}"
    )
    printed = f"no significant difference in {count} of {total} cases"
    return held(claim, agrees, observed, "counts", outcome.runs.variant(kind), printed=printed)


def _show(findings: Findings, cases: Sequence[Case], outcomes: Sequence[Outcome]) -> None:
    """Add tables and pictures."""
    errors, readings, printed = {}, {}, load_claims()["4.3-sensor-shares"].values
    for one in outcomes:
        case, runs, scenario, preset = one.case, one.runs, one.case.scenario, one.runs.preset
        words: dict[str, Any] = {"scenario": scenario, "preset": preset, "runs": len(runs), "case": case}
        errors[scenario.name, preset] = runs.errors_frame(f"4.3-{case.key}-ae")
        frame = pd.DataFrame(one.medians.astype(float), columns=runs.names).map(partial(round, ndigits=4))
        frame = frame.rename_axis("generation").reset_index()
        findings.table("{scenario.name}-{preset}-convergence", frame, **words)
        look: dict[str, Any] = {"names": runs.names, "truth": scenario.controller}
        least, best = least_dispersion(case.gathering), one.emergence["best_model"]
        swarms = dispersion_figure(case.agents, best, least=least, gathered=case.gathered)
        for name, claim, figure in (
            ("boxes", f"4.3-{case.key}-ae", box_figure(runs.models["best_model"], **look)),
            ("convergence", "4.3-convergence", convergence_figure({"": one.medians}, **look)),
            ("dispersion", f"4.3-emergent-{case.key}", swarms),
        ):
            findings.picture("{scenario.name}-{preset}-" + name, claim, figure, **words)
    for case in cases:
        scenario, names = case.scenario, case.scenario.parameter_names
        frames, ends = {}, [f"{end}_{name}" for end in ("low", "high") for name in names]
        columns = [f"trial_{k}" for k in range(1, case.emergence["trials"] + 1)]
        reached = {("", "agents"): pd.DataFrame([case.agents], columns=columns)}
        for one in (each for each in outcomes if each.case is case):
            intervals = pd.DataFrame(one.intervals.reshape(len(one.runs), -1), columns=ends)
            intervals.index += len(one.runs)  # estimates come after best models, which have none
            frames[one.runs.preset] = one.runs.models_frame().join(intervals)
            for kind, models in one.emergence.items():
                tests = compare(case.agents, models)
                found = {"p_value": tests.p_values, "significant": tests.significant.astype(object)}
                frame = pd.DataFrame({"seed": one.runs.seeds, **found})
                reached[one.runs.preset, kind] = frame.join(pd.DataFrame(models, columns=columns))
        findings.table("{scenario.name}-models", stacked(frames, "preset"), scenario=scenario)
        frame = stacked(reached, "preset", "model")[["preset", "model", "seed", "p_value", "significant", *columns]]
        findings.table("{scenario.name}-dispersion", frame, scenario=scenario, case=case)
        shares = {"share": case.shares.mean, "standard_error": case.shares.standard_error}
        numbers = range(len(case.shares.mean))
        readings[scenario.name] = pd.DataFrame({"reading": numbers, **shares, "paper": printed[case.key]})
    findings.table("absolute-errors", stacked(errors, "scenario", "preset"))
    findings.table("sensor-shares", stacked(readings, "scenario"))
