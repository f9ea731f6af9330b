"""Sections 3.2 and 4.3: snapshots of both behaviors, and both case studies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import (
    compare,
    dispersion,
    interval,
    largest_cluster,
    least_dispersion,
)
from turing_learning.figures import box_figure
from turing_learning.figures.many_runs import convergence_figure, dispersion_figure
from turing_learning.figures.swarms import snapshots_figure
from turing_learning.purposes import EMERGENCE_STARTS
from turing_learning.runs import RunFolder
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import (
    MODEL_KINDS,
    Findings,
    Runs,
    Sizes,
    Work,
    index_of_median,
    moved,
    sensor_shares,
    stacked,
)
from .._verdicts import (
    ClaimVerdict,
    Spreads,
    errors_verdict,
    load_claims,
    shares_not_worse,
    verdict_on,
)

GATHERED = "3.2-snapshots"
GATHERED_SHARE = 0.9
"""Share of all robots, or objects, in the largest cluster from which on they count as one cluster."""


def conduct_snapshots(work: Work, findings: Findings) -> None:
    """Simulate both behaviors, and show the trial of median dispersion at the end."""
    sizes = work.sizes
    texts = []
    frames = {}
    agrees = True
    clustering_later_s = sizes["clustering_later_s"]
    for scenario, robots, times_s, later_s in (
        (AGGREGATION, sizes["aggregating_robots"], sizes["aggregation_times_s"], []),
        (
            OBJECT_CLUSTERING,
            sizes["clustering_robots"],
            sizes["clustering_times_s"],
            clustering_later_s,
        ),
    ):
        scenario = work.in_world(scenario)
        compute = partial(_simulated, scenario, robots, times_s, later_s, sizes)
        measured = work.piece(f"snapshots-{scenario.name}", compute)
        largest = np.array(measured["largest_cluster"])
        clustered = int(largest[measured["shown"], len(times_s) - 1])
        agrees = agrees and clustered >= GATHERED_SHARE * measured["gathering"]
        texts.append(_gathering_text(scenario, measured, times_s, later_s))
        trials = range(1, len(largest) + 1)
        index = pd.MultiIndex.from_product([trials, times_s + later_s], names=["trial", "time_s"])
        columns = {name: np.ravel(measured[name]) for name in ("dispersion", "largest_cluster")}
        frames[scenario.name] = pd.DataFrame(columns, index).reset_index()
        figure = snapshots_figure(
            np.array(measured["poses"]),
            times_s=times_s,
            robots=robots,
            robot_radius_cm=scenario.robot.radius_cm,
            object_radius_cm=scenario.objects.radius_cm,
        )
        objects = ""
        if scenario.objects.count:
            objects = f" and {measured['gathering']} objects"
        words = {"scenario": scenario, "robots": robots, "objects": objects, "trials": len(largest)}
        findings.picture("{scenario.name}", GATHERED, figure, **words)
    findings.verdicts.append(verdict_on(GATHERED, agrees, "; ".join(texts), "snapshots"))
    findings.table("snapshots", stacked(frames, "behavior"))


def _gathering_text(
    scenario: Scenario, measured: Mapping[str, Any], times_s: list[int], later_s: list[int]
) -> str:
    """Say how many gathered in the trial shown, and in how many trials nearly all did."""
    total = measured["gathering"]
    largest = np.array(measured["largest_cluster"])
    final = len(times_s) - 1
    gathered_trials = np.count_nonzero(largest >= math.ceil(GATHERED_SHARE * total), axis=0)
    bodies = "objects" if scenario.objects.count else "robots"
    text = (
        f"{scenario.title.lower()}: {largest[measured['shown'], final]} of {total} {bodies} in one cluster "
        f"after {times_s[-1]} s in the trial shown, 90 % or more in {gathered_trials[final]} of {len(largest)} trials"
    )
    for k, time in enumerate(later_s, start=final + 1):
        text += f", in {gathered_trials[k]} after {time} s"
    return text


def gathering_disks(scenario: Scenario, poses: np.ndarray, robots: int) -> tuple[np.ndarray, float]:
    """Return positions (..., S, 2) and radius (cm) of those that are to gather: objects, or robots where there are none."""
    if scenario.objects.count:
        return poses[..., robots:, :2], scenario.objects.radius_cm
    return poses[..., :robots, :2], scenario.robot.radius_cm


def _simulated(
    scenario: Scenario, robots: int, times_s: list[int], later_s: list[int], sizes: Sizes
) -> dict[str, Any]:
    trials = sizes["trials"]
    seed = sizes["seed"]
    steps = [round(time / scenario.trial.control_interval_s) for time in times_s + later_s]
    motion = moved(
        scenario, scenario.controller, trials, robots, steps[-1], starts=seed, noise=seed
    )
    poses = motion.poses[:, steps]
    positions, radius = gathering_disks(scenario, poses, robots)
    spread = dispersion(positions, radius)
    median = index_of_median(spread[:, len(times_s) - 1])
    return {
        "dispersion": spread.tolist(),
        "largest_cluster": largest_cluster(positions, radius).tolist(),
        "gathering": positions.shape[2],
        "shown": median,
        "poses": poses[median, : len(times_s)].tolist(),
    }


NEAR_TRUTH = 0.1
"""Absolute error (share of the maximum speed) up to which a parameter is near the truth."""
LASTING = 20
"""Generations for which a parameter is near the truth to have settled."""
SHARE_ROUNDING = 0.0005
"""Half a unit of the last digit of the shares that the paper prints."""
SLOWNESS = 2.0
"""A parameter may settle so many times as late as the paper's text says: it gives round numbers."""
SPREAD_OUT = 2.0
"""A swarm does not gather if its median dispersion is so many times that of the agents."""
SETTLED_BY = {
    "aggregation": (50, 50, 200, 200),
    "object-clustering": (200, 200, 200, 200, 400, 400),
}
"""Generations at which the paper's text sees the parameters close to the truth, or about to be."""
FIRST_REPETITION = 1000
"""Number of the first repetition of the agents' trials, in their seeds; models are numbered from 1 on."""


@dataclass(frozen=True, eq=False)
class Case:
    """One case study; the R trials of its agents begin as those of its models."""

    scenario: Scenario
    key: str  # its name in the ids of the claims
    emergence: Sizes  # how the swarms of its models are measured
    shares: Spreads  # of the sensor readings, over trials
    agents: np.ndarray  # their dispersion (R,) at the end of the trials
    # (K, R), of the agents again, with other noise: how much hangs on their R trials?
    repeated: np.ndarray

    @property
    def gathered(self) -> str:
        """What gathers: "objects" or "robots"."""
        if self.scenario.objects.count:
            return "objects"
        return "robots"

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
    # (R, 2, P), ends of the 90 % interval of each run's estimate; NaN where unknown
    intervals: np.ndarray
    # (G, P), over the runs, of the best model of each generation
    medians: np.ndarray
    # Kind -> dispersion (M, R) of replicas of each of M models
    emergence: dict[str, np.ndarray]


def conduct_case_studies(work: Work, findings: Findings) -> None:
    """Conduct the studies, and measure shares and dispersion."""
    cases = []
    for behavior, key in ((AGGREGATION, "aggregation"), (OBJECT_CLUSTERING, "clustering")):
        scenario = work.in_world(behavior)
        shares = work.piece(
            f"shares-{scenario.name}", partial(_mean_shares, scenario, work.sizes["shares"])
        )
        sizes = work.sizes[key]
        # Repetitions of the agents themselves: how much hangs on the chance of their trials?
        repeated = []
        for k in range(sizes["repeats"]):
            name = f"agents-{k + 1:02d}"
            repeated.append(
                _reached(work, scenario, sizes, name, scenario.controller, FIRST_REPETITION + k)
            )
        agents = _reached(work, scenario, sizes, "agents", scenario.controller, 0)
        cases.append(
            Case(
                scenario,
                key,
                sizes,
                Spreads.of(np.array(shares["shares"])),
                agents,
                np.array(repeated),
            )
        )
    # All runs first: they take hours, and what follows seconds
    outcomes = [_outcome(work, case, preset) for preset in work.presets for case in cases]
    verdicts = findings.verdicts
    for outcome in outcomes:
        runs = outcome.runs
        findings.remarks.append(_coverage(outcome))
        claim = f"4.3-{outcome.case.key}-ae"
        verdicts += [
            errors_verdict(claim, runs.errors[k], runs.names, runs.variant(k)) for k in MODEL_KINDS
        ]
    for preset in work.presets:
        verdicts.append(
            convergence_verdict([outcome for outcome in outcomes if outcome.runs.preset == preset])
        )
    verdicts.append(_shares_verdict(cases))
    for outcome in outcomes:
        verdicts += [emergence_verdict(outcome, readout) for readout in MODEL_KINDS]
    _show_outcomes(findings, outcomes)
    _show_cases(findings, cases, outcomes)


def _mean_shares(scenario: Scenario, sizes: Sizes) -> dict[str, Any]:
    """Return the share of each sensor state (R, n) in each trial."""
    return {"shares": sensor_shares(scenario, **sizes).mean(axis=1).tolist()}


def _coverage(outcome: Outcome) -> str:
    """Say how often the intervals of the estimates hold the true parameters."""
    low, high = np.moveaxis(outcome.intervals, 1, 0)
    truth = np.array(outcome.case.scenario.controller)
    coverage = float(((low <= truth) & (truth <= high)).mean())
    return (
        f"{outcome.case.scenario.title}, preset {outcome.runs.preset}: "
        f"the 90 % intervals of the estimates hold {coverage:.1%} of the true parameters."
    )


def _outcome(work: Work, case: Case, preset: str) -> Outcome:
    from turing_learning.studies import StudyFolder, convergences

    scenario = case.scenario
    runs = work.runs(
        f"study-{scenario.name}-{preset}", scenario.name, preset, scenario.parameter_names
    )
    emergence = {}
    for readout, prefix in (("best_model", preset), ("estimate", f"{preset}-estimate")):
        spreads = []
        for k, model in enumerate(runs.models[readout], start=1):
            spreads.append(_reached(work, scenario, case.emergence, f"{prefix}-{k:02d}", model, k))
        emergence[readout] = np.array(spreads)
    folder = StudyFolder(runs.result.path)
    plan = folder.plan()
    intervals = []
    for run in runs.result.runs:
        # Read off the run's typical models by the present rule.
        traces = RunFolder(folder.run_path(run.number)).traces()
        assert traces is not None  # of a complete run
        typical = traces["typical_model"]
        # The estimate is read off the generations from this one on.
        begin = plan.configuration(run.number).run.estimated_from(len(typical))
        intervals.append(interval(typical, begin).T)
    medians = convergences(folder, plan, runs.result.runs)[0][1]["best_model"]
    return Outcome(case, runs, np.array(intervals), medians, emergence)


def _reached(
    work: Work, scenario: Scenario, sizes: Sizes, name: str, controller: Any, number: int
) -> np.ndarray:
    """Return the dispersion at the end of each trial (R,) of those that are to gather, a piece of work."""

    def compute() -> dict[str, list[float]]:
        seed = sizes["seed"]
        robots = sizes["robots"]
        noise = int(
            np.random.SeedSequence((EMERGENCE_STARTS + 1 + number, seed)).generate_state(1)[0]
        )
        steps = round(sizes["duration_s"] / scenario.trial.control_interval_s)
        starts = (EMERGENCE_STARTS, seed)
        simulation = moved(
            scenario, controller, sizes["trials"], robots, steps, starts=starts, noise=noise
        )
        positions, radius = gathering_disks(scenario, simulation.poses[:, -1], robots)
        return {"dispersion": dispersion(positions, radius).tolist()}

    return np.array(work.piece(f"dispersion-{scenario.name}-{name}", compute)["dispersion"])


def settled(values: np.ndarray, truth: float) -> tuple[int | None, int | None]:
    """Return the first generations from which values (G,) are near the truth for some time, and to the end.

    None stands for never.
    """
    is_near = np.abs(values - truth) <= NEAR_TRUTH
    lasting = []
    for generation in range(len(is_near)):
        lasting.append(is_near[generation : generation + LASTING].all())
    # Near in this generation and in all after it
    to_the_end = np.logical_and.accumulate(is_near[::-1])[::-1]
    return _first_true(np.array(lasting)), _first_true(to_the_end)


def _first_true(values: np.ndarray) -> int | None:
    return int(np.argmax(values)) if values.any() else None


def convergence_verdict(outcomes: Sequence[Outcome]) -> ClaimVerdict:
    """Hold the generations at which the medians settle, of outcomes of one preset, against the text."""
    observed = []
    agrees = True
    for outcome in outcomes:
        scenario = outcome.case.scenario
        limits = SETTLED_BY[scenario.name]
        texts = []
        for k, name in enumerate(outcome.runs.names):
            for_some_time, for_good = settled(outcome.medians[:, k], scenario.controller[k])
            agrees &= for_some_time is not None and for_some_time <= SLOWNESS * limits[k]
            text = f"{name} {_generation(for_some_time)}"
            if for_some_time not in (None, for_good):
                text += f" (for good {_generation(for_good)})"
            texts.append(text)
        observed.append(f"{scenario.title.lower()}: {', '.join(texts)}")
    variant = outcomes[0].runs.variant()
    return verdict_on("4.3-convergence", agrees, "; ".join(observed), "convergence", variant)


def _generation(number: int | None) -> str:
    return "never" if number is None else str(number)


def _shares_verdict(cases: Sequence[Case]) -> ClaimVerdict:
    """Hold the shares of the sensor readings against the printed ones."""
    claim = "4.3-sensor-shares"
    values = load_claims()[claim].values
    agrees = True
    for case in cases:
        differences = np.abs(case.shares.mean - values[case.key])
        agrees &= bool((differences <= 2 * case.shares.standard_error + SHARE_ROUNDING).all())

    def listed(shares: Mapping[str, Any]) -> str:
        texts = []
        for key in observed:
            texts.append(f"{key}: {' / '.join(f'{share:.3f}' for share in shares[key])}")
        return "; ".join(texts)

    observed = {case.key: case.shares.mean for case in cases}
    return verdict_on(claim, agrees, listed(observed), "shares", printed=listed(values))


def emergence_verdict(outcome: Outcome, readout: str) -> ClaimVerdict:
    """Hold the number of models whose swarms do what the agents do against the printed one."""
    case = outcome.case
    models = outcome.emergence[readout]
    claim = f"4.3-emergent-{case.key}"
    count, total = load_claims()[claim].values["no_significant_difference"]
    alike = compare(case.agents, models).without_difference
    runs = len(models)
    repeated = [compare(agents, models).without_difference for agents in case.repeated]
    # One number if all repetitions have the same.
    span = " to ".join(map(str, sorted({min(repeated), max(repeated)})))
    agents = np.median(case.agents)
    medians = np.median(models, axis=1)
    enough = shares_not_worse(alike / runs, runs, count / total, total)
    agrees = enough and medians.max() <= SPREAD_OUT * agents
    observed = (
        f"no significant difference in {alike} of {runs} cases "
        f"({span} with {len(repeated)} repetitions of the agents' trials); "
        f"median dispersion of the agents {agents:.0f}, of the models {medians.min():.0f} to {medians.max():.0f}"
    )
    if agrees and alike < count:
        observed += f"; {alike} is fewer than {count}, but not by more than chance explains"
    printed = f"no significant difference in {count} of {total} cases"
    return verdict_on(
        claim, agrees, observed, "counts", outcome.runs.variant(readout), printed=printed
    )


def _show_outcomes(findings: Findings, outcomes: Sequence[Outcome]) -> None:
    """Add the tables and pictures of each scenario and preset."""
    errors = {}
    for outcome in outcomes:
        case = outcome.case
        runs = outcome.runs
        scenario = case.scenario
        words: dict[str, Any] = {
            "scenario": scenario,
            "preset": runs.preset,
            "runs": len(runs),
            "case": case,
        }
        errors[scenario.name, runs.preset] = runs.errors_frame(f"4.3-{case.key}-ae")
        frame = pd.DataFrame(outcome.medians.astype(float), columns=runs.names)
        frame = frame.map(partial(round, ndigits=4)).rename_axis("generation").reset_index()
        findings.table("{scenario.name}-{preset}-convergence", frame, **words)
        look: dict[str, Any] = {"names": runs.names, "truth": scenario.controller}
        boxes = box_figure(runs.models["best_model"], **look)
        findings.picture("{scenario.name}-{preset}-boxes", f"4.3-{case.key}-ae", boxes, **words)
        curves = convergence_figure({"": outcome.medians}, **look)
        findings.picture("{scenario.name}-{preset}-convergence", "4.3-convergence", curves, **words)
        swarms = dispersion_figure(
            case.agents,
            outcome.emergence["best_model"],
            least_possible=least_dispersion(case.gathering),
            gathered=case.gathered,
        )
        findings.picture(
            "{scenario.name}-{preset}-dispersion", f"4.3-emergent-{case.key}", swarms, **words
        )
    findings.table("absolute-errors", stacked(errors, "scenario", "preset"))


def _show_cases(findings: Findings, cases: Sequence[Case], outcomes: Sequence[Outcome]) -> None:
    """Add the tables of each scenario, of both presets."""
    readings = {}
    printed = load_claims()["4.3-sensor-shares"].values
    for case in cases:
        scenario = case.scenario
        own_outcomes = [outcome for outcome in outcomes if outcome.case is case]
        models = {outcome.runs.preset: _models_frame(outcome) for outcome in own_outcomes}
        findings.table("{scenario.name}-models", stacked(models, "preset"), scenario=scenario)
        dispersions = _dispersion_frame(case, own_outcomes)
        findings.table("{scenario.name}-dispersion", dispersions, scenario=scenario, case=case)
        shares = {
            "reading": range(len(case.shares.mean)),
            "share": case.shares.mean,
            "standard_error": case.shares.standard_error,
            "paper": printed[case.key],
        }
        readings[scenario.name] = pd.DataFrame(shares)
    findings.table("sensor-shares", stacked(readings, "scenario"))


def _models_frame(outcome: Outcome) -> pd.DataFrame:
    """Return what every run has inferred, and the intervals of its estimate."""
    runs = outcome.runs
    columns = []
    for bound in ("low", "high"):
        for name in runs.names:
            columns.append(f"{bound}_{name}")
    intervals = pd.DataFrame(outcome.intervals.reshape(len(runs), -1), columns=columns)
    # Estimates come after best models, which have no intervals.
    intervals.index += len(runs)
    return runs.models_frame().join(intervals)


def _dispersion_frame(case: Case, outcomes: Sequence[Outcome]) -> pd.DataFrame:
    """Return the dispersion of agents and of models in each trial, and tests of the models against the agents."""
    trials = [f"trial_{k}" for k in range(1, case.emergence["trials"] + 1)]
    frames = {("", "agents"): pd.DataFrame([case.agents], columns=trials)}
    for outcome in outcomes:
        for readout, models in outcome.emergence.items():
            tests = compare(case.agents, models)
            columns = {
                "seed": outcome.runs.seeds,
                "p_value": tests.p_values,
                "significant": tests.significant.astype(object),
            }
            frame = pd.DataFrame(columns).join(pd.DataFrame(models, columns=trials))
            frames[outcome.runs.preset, readout] = frame
    columns_in_order = ["preset", "model", "seed", "p_value", "significant", *trials]
    return stacked(frames, "preset", "model")[columns_in_order]
