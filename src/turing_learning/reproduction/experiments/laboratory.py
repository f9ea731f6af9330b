"""Section 5: robots in the loop, in a laboratory that is emulated."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning import analysis, robots
from turing_learning.analysis import absolute_error, mean_absolute_error
from turing_learning.coevolution import THRESHOLD
from turing_learning.config import classifier_of
from turing_learning.figures import box_figure
from turing_learning.figures.many_runs import convergence_figure, error_panels_figure
from turing_learning.figures.one_run import accuracy_figure
from turing_learning.figures.swarms import gathering_figure, snapshots_figure

from .. import _laboratory_trials as trials
from .._experiment import (
    Findings,
    Sizes,
    Work,
    compare_columns,
    errors_frame,
    index_of_median,
    seeded,
    seeds_of,
    stacked,
)
from .._laboratory_trials import Gathering, LaboratoryRuns
from .._verdicts import ClaimVerdict, Spreads, errors_verdict, held, load_claims, valued
from .classifiers import BestAccuracies

ERRORS, DYNAMICS = "5-physical-ae", "5-physical-dynamics"
VALIDATION, CLASSIFIERS = "5-physical-validation", "5-physical-classifiers"
PAPER_RUNS = 10
CORRESPONDENCE = 0.1  # difference of medians that still counts as good, as "near the truth" does in section 4.3
LATE = 0.2  # share of the generations, the last ones, over which medians are compared
HIGH = 0.9
QUANTITIES = ("proportion at the end", "dispersion at the end", "mean proportion", "mean dispersion")  # of every trial
EMULATED, SIMULATED = "emulated laboratory", "plain simulation"
NAMES = ("vl0", "vr0", "vl1", "vr1")


def error_dynamics(runs: LaboratoryRuns, truth: np.ndarray) -> pd.DataFrame:
    """Return median MAEs over the runs of three models of each generation: average, subjectively best, best."""
    maes = mean_absolute_error(runs.models, truth)
    chosen = {"average": maes.mean(axis=2), "subjective": mean_absolute_error(runs.fittest, truth)}
    chosen["objective"] = maes.min(axis=2)
    return pd.DataFrame({name: np.median(each, axis=0) for name, each in chosen.items()})


def share_between(dynamics: pd.DataFrame) -> float:
    """Return in what share of generations the subjectively best model is between best and average."""
    return float(dynamics["subjective"].between(dynamics["objective"], dynamics["average"]).mean())


def conduct(work: Work, findings: Findings) -> None:
    """Conduct the emulated and the simulated runs; validate the median model; judge random models."""
    sizes, truth = work.sizes, np.array(robots.LABORATORY.controller)
    emulated, simulated = trials.emulated_runs(work), trials.simulated_runs(work, "default")
    outcomes = {EMULATED: emulated, SIMULATED: simulated}
    outcomes[f"{SIMULATED}, preset paper"] = trials.simulated_runs(work, "paper")
    agents, replicas = trials.gatherings(work, np.median(emulated.best, axis=0))
    times_s = trials.times_of(sizes["validation"])
    best = _accuracies(work, emulated)
    verdicts = findings.verdicts
    verdicts += [runs_verdict(runs, truth, "" if kind == EMULATED else kind) for kind, runs in outcomes.items()]
    verdicts += [
        dynamics_verdict(emulated, simulated, truth),
        validation_verdict(agents, replicas, times_s[-1]),
        classifiers_verdict(best),
    ]
    _show_runs(findings, outcomes, seeds_of(sizes["runs"]), truth)
    _show_validation(findings, agents, replicas, times_s, sizes["validation"])
    findings.table("accuracy", best.means_frame("subjective", "objective"))
    figure = accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective)
    words = {"models": sizes["random_models"]["models"], "runs": len(best.objective)}
    findings.picture("accuracy", CLASSIFIERS, figure, **words)


def _accuracies(work: Work, runs: LaboratoryRuns) -> BestAccuracies:
    """Let all stored classifiers judge the same trials of random models (paper, section 5.5)."""
    sizes, path = work.sizes["runs"], trials.laboratory_file(work, "default")
    samples = work.piece("random-models", partial(trials.random_models, path, work.sizes["random_models"]), "npz")
    classifier = classifier_of(robots.load_laboratory(path, sizes["settings"]).configuration)
    genomes = runs.classifiers.reshape(-1, runs.classifiers.shape[-1]).astype(np.float64)
    agents, replicas = (classifier.judge(genomes, samples[name]) >= THRESHOLD for name in ("agents", "replicas"))
    accuracy = analysis.decision_accuracy(agents[..., None], replicas[..., None]).reshape(runs.classifier_fitness.shape)
    return BestAccuracies.of("", sizes["kept"], accuracy, runs.classifier_fitness)  # the archive is left out


def medians(runs: LaboratoryRuns) -> np.ndarray:
    """Return the medians over the runs of the subjectively best model of each generation (G, P)."""
    return np.asarray(np.median(runs.fittest, axis=0))


def distances(emulated: LaboratoryRuns, simulated: LaboratoryRuns) -> tuple[np.ndarray, np.ndarray]:
    """Return how far medians are apart (P,), on average over the last fifth and over all generations."""
    apart = np.abs(medians(emulated) - medians(simulated))
    return np.asarray(apart[-max(1, round(LATE * len(apart))) :].mean(axis=0)), np.asarray(apart.mean(axis=0))


def runs_verdict(runs: LaboratoryRuns, truth: np.ndarray, variant: str = "") -> ClaimVerdict:
    """Hold the absolute errors of the post-evaluated best models against the printed ones."""
    printed, observed = (
        f"; median model {', '.join(f'{value:.2f}' for value in values)}"
        for values in (load_claims()[ERRORS].values["median_parameters"], np.median(runs.best, axis=0))
    )
    errors = absolute_error(runs.best, truth)
    also = {"printed_also": printed, "observed_also": observed}
    return errors_verdict(ERRORS, errors, NAMES, variant, paper_runs=PAPER_RUNS, **also)


def dynamics_verdict(emulated: LaboratoryRuns, simulated: LaboratoryRuns, truth: np.ndarray) -> ClaimVerdict:
    """Compare the dynamics of emulated and of simulated runs."""
    shares = [share_between(error_dynamics(runs, truth)) for runs in (emulated, simulated)]
    late, overall = distances(emulated, simulated)
    observed = (
        f"between them in {shares[0]:.0%} of the generations of emulated and {shares[1]:.0%} of simulated runs; medians apart in "
        f"the last fifth of the generations: {valued(NAMES, late)}; over all generations: {valued(NAMES, overall)}"
    )
    return held(DYNAMICS, min(shares) > 0.5 and (late <= CORRESPONDENCE).all(), observed, "dynamics")


def validation_verdict(agents: Gathering, replicas: Gathering, duration_s: float) -> ClaimVerdict:
    """Compare what swarms of agents and of the median model do from the same start, by the four `QUANTITIES`."""
    curves = [(one.proportion, one.dispersion) for one in (agents, replicas)]
    values = [np.column_stack([each[:, -1] for each in own] + [each.mean(axis=1) for each in own]) for own in curves]
    comparison, (shares, spreads) = compare_columns(*values), [[own[:, k].mean() for own in values] for k in (0, 1)]
    observed = (
        f"{agents.seen.shape[2]} robots after {duration_s:g} s: largest cluster {shares[0]:.2f} (agents), {shares[1]:.2f} "
        f"(model) of the robots; dispersion {spreads[0]:.0f}, {spreads[1]:.0f}; p: {valued(QUANTITIES, comparison.p_values, '.2g')}"
    )
    return held(VALIDATION, not comparison.significant.any(), observed, "validation")


def does_not_drop(values: np.ndarray) -> bool:
    """Return if no mean of values (R, G) is below an earlier one by over twice the standard error of the two."""
    spreads = Spreads.of(values)
    errors = np.hypot.outer(spreads.standard_error, spreads.standard_error)
    drops = np.subtract.outer(spreads.mean, spreads.mean)  # from earlier generations, the rows, to later ones
    return bool((drops <= 2 * errors)[np.triu_indices(len(drops))].all())


def classifiers_verdict(best: BestAccuracies) -> ClaimVerdict:
    """Hold the accuracy of the best classifiers against what the text says of the figure."""
    objective, subjective = best.objective.mean(axis=0), best.subjective.mean(axis=0)
    lowest = int(subjective.argmin())
    observed = (
        f"objective best {objective[0]:.2f} at first, {objective[-1]:.2f} in the end; subjective best {subjective[0]:.2f} at "
        f"first, {subjective[-1]:.2f} in the end, lowest {subjective[lowest]:.2f} in generation {best.generations[lowest]}"
    )
    agrees = objective[-1] >= HIGH and does_not_drop(best.subjective)
    return held(CLASSIFIERS, agrees, observed, "classifiers in the laboratory")


def _show_runs(findings: Findings, outcomes: Mapping[str, LaboratoryRuns], seeds: range, truth: np.ndarray) -> None:
    """Add the tables of all runs, and the pictures of those in the laboratory and beside it."""
    errors, models, dynamics, curves = {}, {}, {}, {}
    for kind, runs in outcomes.items():
        errors[kind] = errors_frame(absolute_error(runs.best, truth), NAMES, ERRORS).rename(columns={"runs": "number"})
        models[kind] = seeded(seeds, runs.best, NAMES)
        curves[kind] = error_dynamics(runs, truth)
        frame = pd.DataFrame(medians(runs), columns=NAMES).join(curves[kind].add_prefix("mae_"))
        dynamics[kind] = frame.map(partial(round, ndigits=4)).rename_axis("generation").reset_index()
    findings.table("absolute-errors", stacked(errors, "runs"), True)
    findings.table("models", stacked(models, "runs"))
    findings.table("dynamics", stacked(dynamics, "runs"))
    both, best = {kind.capitalize(): kind for kind in (EMULATED, SIMULATED)}, outcomes[EMULATED].best
    look: dict[str, Any] = {"names": NAMES, "truth": truth}
    parameters = convergence_figure({title: medians(outcomes[kind]) for title, kind in both.items()}, **look)
    named = {title: curves[kind].to_dict("series") for title, kind in both.items()}
    findings.picture("models", ERRORS, box_figure(best, **look), runs=len(best))
    findings.picture("parameter-dynamics", DYNAMICS, parameters, runs=len(best))
    findings.picture("error-dynamics", DYNAMICS, error_panels_figure(named), runs=len(best))


def _show_validation(
    findings: Findings, agents: Gathering, replicas: Gathering, times_s: np.ndarray, sizes: Sizes
) -> None:
    """Add table and pictures of the swarms before the camera."""
    both, frames = (agents, replicas), {}
    for kind, one in zip(trials.KINDS, both, strict=True):
        ends = {"proportion": one.proportion[:, -1], "dispersion": one.dispersion[:, -1]}
        numbers = np.arange(1, len(one.complete) + 1)
        frames[kind] = pd.DataFrame({"trial": numbers, **ends, "images_complete": one.complete.mean(axis=1)})
    findings.table("validation", stacked(frames, "controller"))
    swarms = {"agents": agents, "inferred model": replicas}
    curves = {
        "Proportion in largest cluster": {name: one.proportion for name, one in swarms.items()},
        "Dispersion": {name: one.dispersion for name, one in swarms.items()},
    }
    limits = dict(zip(curves, (1.0, analysis.least_dispersion(sizes["robots"])), strict=True))
    moments = [int(np.argmin(np.abs(times_s - time))) for time in sizes["shown_s"]]
    trial = index_of_median(replicas.dispersion[:, -1])
    look: dict[str, Any] = {"robots": sizes["robots"], "robot_radius_cm": replicas.radius_cm, "columns": 4}
    snapshots = snapshots_figure(replicas.poses[trial, moments], times_s=sizes["shown_s"], **look)
    gathering, words = gathering_figure(times_s, curves, limits=limits), {"robots": sizes["robots"]}
    findings.picture("gathering", VALIDATION, gathering, trials=sizes["trials"], **words)
    findings.picture("snapshots", VALIDATION, snapshots, **words)
