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
from .._verdicts import ClaimVerdict, Spreads, errors_verdict, load_claims, valued, verdict_on
from .classifiers import BestAccuracies

ERRORS = "5-physical-ae"
DYNAMICS = "5-physical-dynamics"
VALIDATION = "5-physical-validation"
CLASSIFIERS = "5-physical-classifiers"
PAPER_RUNS = 10
CORRESPONDENCE = 0.1
"""Difference of medians that still counts as good, as "near the truth" does in section 4.3."""
LATE_SHARE = 0.2
"""Share of the generations, the last ones, over which medians are compared."""
PRINTED_ACCURACY = 0.9
"""Accuracy that the objectively best classifier reaches in the paper."""
QUANTITIES = (
    "proportion at the end",
    "dispersion at the end",
    "mean proportion",
    "mean dispersion",
)
"""Of every trial, by which swarms are compared."""
EMULATED = "emulated laboratory"
SIMULATED = "plain simulation"
NAMES = ("vl0", "vr0", "vl1", "vr1")


def error_dynamics(runs: LaboratoryRuns, truth: np.ndarray) -> pd.DataFrame:
    """Return median MAEs over the runs of three models of each generation: average, subjectively best, best."""
    maes = mean_absolute_error(runs.models, truth)
    subjective = mean_absolute_error(runs.fittest, truth)
    columns = {
        "average": np.median(maes.mean(axis=2), axis=0),
        "subjective": np.median(subjective, axis=0),
        "objective": np.median(maes.min(axis=2), axis=0),
    }
    return pd.DataFrame(columns)


def share_between(dynamics: pd.DataFrame) -> float:
    """Return in what share of generations the subjectively best model is between best and average."""
    return float(dynamics["subjective"].between(dynamics["objective"], dynamics["average"]).mean())


def conduct(work: Work, findings: Findings) -> None:
    """Conduct the emulated and the simulated runs; validate the median model; judge random models."""
    sizes = work.sizes
    truth = np.array(robots.LABORATORY.controller)
    emulated = trials.emulated_runs(work)
    simulated = trials.simulated_runs(work, "default")
    outcomes = {
        EMULATED: emulated,
        SIMULATED: simulated,
        f"{SIMULATED}, preset paper": trials.simulated_runs(work, "paper"),
    }
    agents, replicas = trials.gatherings(work, np.median(emulated.best, axis=0))
    times_s = trials.times_of(sizes["validation"])
    best = _accuracies(work, emulated)
    verdicts = findings.verdicts
    for source, runs in outcomes.items():
        verdicts.append(runs_verdict(runs, truth, "" if source == EMULATED else source))
    verdicts.append(dynamics_verdict(emulated, simulated, truth))
    verdicts.append(validation_verdict(agents, replicas, times_s[-1]))
    verdicts.append(classifiers_verdict(best))
    _show_runs(findings, outcomes, seeds_of(sizes["runs"]), truth)
    _show_validation(findings, agents, replicas, times_s, sizes["validation"])
    findings.table("accuracy", best.means_frame("subjective", "objective"))
    figure = accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective)
    words = {"models": sizes["random_models"]["models"], "runs": len(best.objective)}
    findings.picture("accuracy", CLASSIFIERS, figure, **words)


def _accuracies(work: Work, runs: LaboratoryRuns) -> BestAccuracies:
    """Let all stored classifiers judge the same trials of random models (paper, section 5.5)."""
    sizes = work.sizes["runs"]
    path = trials.laboratory_file(work, "default")
    observe = partial(trials.random_models, path, work.sizes["random_models"])
    samples = work.piece("random-models", observe, "npz")
    classifier = classifier_of(robots.load_laboratory(path, sizes["settings"]).configuration)
    genomes = runs.classifiers.reshape(-1, runs.classifiers.shape[-1]).astype(np.float64)
    agents = classifier.judge(genomes, samples["agents"]) >= THRESHOLD
    replicas = classifier.judge(genomes, samples["replicas"]) >= THRESHOLD
    accuracy = analysis.decision_accuracy(agents[..., None], replicas[..., None])
    # The archive is left out.
    by_run = accuracy.reshape(runs.classifier_fitness.shape)
    return BestAccuracies.of("", sizes["kept"], by_run, runs.classifier_fitness)


def medians(runs: LaboratoryRuns) -> np.ndarray:
    """Return the medians over the runs of the subjectively best model of each generation (G, P)."""
    return np.asarray(np.median(runs.fittest, axis=0))


def distances(emulated: LaboratoryRuns, simulated: LaboratoryRuns) -> tuple[np.ndarray, np.ndarray]:
    """Return how far medians are apart (P,), on average over the last fifth and over all generations."""
    apart = np.abs(medians(emulated) - medians(simulated))
    late = apart[-max(1, round(LATE_SHARE * len(apart))) :]
    return np.asarray(late.mean(axis=0)), np.asarray(apart.mean(axis=0))


def runs_verdict(runs: LaboratoryRuns, truth: np.ndarray, variant: str = "") -> ClaimVerdict:
    """Hold the absolute errors of the post-evaluated best models against the printed ones."""

    def median_model(values: np.ndarray) -> str:
        return f"; median model {', '.join(f'{value:.2f}' for value in values)}"

    return errors_verdict(
        ERRORS,
        absolute_error(runs.best, truth),
        NAMES,
        variant,
        paper_runs=PAPER_RUNS,
        printed_also=median_model(load_claims()[ERRORS].values["median_parameters"]),
        observed_also=median_model(np.median(runs.best, axis=0)),
    )


def dynamics_verdict(
    emulated: LaboratoryRuns, simulated: LaboratoryRuns, truth: np.ndarray
) -> ClaimVerdict:
    """Compare the dynamics of emulated and of simulated runs."""
    emulated_share = share_between(error_dynamics(emulated, truth))
    simulated_share = share_between(error_dynamics(simulated, truth))
    late, overall = distances(emulated, simulated)
    observed = (
        f"between them in {emulated_share:.0%} of the generations of emulated and {simulated_share:.0%} of "
        f"simulated runs; medians apart in the last fifth of the generations: {valued(NAMES, late)}; "
        f"over all generations: {valued(NAMES, overall)}"
    )
    agrees = min(emulated_share, simulated_share) > 0.5 and (late <= CORRESPONDENCE).all()
    return verdict_on(DYNAMICS, agrees, observed, "dynamics")


def validation_verdict(agents: Gathering, replicas: Gathering, duration_s: float) -> ClaimVerdict:
    """Compare what swarms of agents and of the median model do from the same start, by the four `QUANTITIES`."""
    values = list(map(_quantities, (agents, replicas)))
    comparison = compare_columns(*values)
    share, dispersion = values[0][:, :2].mean(axis=0)
    model_share, model_dispersion = values[1][:, :2].mean(axis=0)
    observed = (
        f"{agents.seen.shape[2]} robots after {duration_s:g} s: largest cluster {share:.2f} (agents), "
        f"{model_share:.2f} (model) of the robots; dispersion {dispersion:.0f}, {model_dispersion:.0f}; "
        f"p: {valued(QUANTITIES, comparison.p_values, '.2g')}"
    )
    return verdict_on(VALIDATION, not comparison.significant.any(), observed, "validation")


def _quantities(swarm: Gathering) -> np.ndarray:
    """Return the `QUANTITIES` of each trial (R, 4)."""
    columns = (
        swarm.proportion[:, -1],
        swarm.dispersion[:, -1],
        swarm.proportion.mean(axis=1),
        swarm.dispersion.mean(axis=1),
    )
    return np.column_stack(columns)


def does_not_drop(values: np.ndarray) -> bool:
    """Return if no mean of values (R, G) is below an earlier one by over twice the standard error of the two."""
    spreads = Spreads.of(values)
    errors = np.hypot.outer(spreads.standard_error, spreads.standard_error)
    # From earlier generations, the rows, to later ones.
    drops = np.subtract.outer(spreads.mean, spreads.mean)
    return bool((drops <= 2 * errors)[np.triu_indices(len(drops))].all())


def classifiers_verdict(best: BestAccuracies) -> ClaimVerdict:
    """Hold the accuracy of the best classifiers against what the text says of the figure."""
    objective = best.objective.mean(axis=0)
    subjective = best.subjective.mean(axis=0)
    lowest = int(subjective.argmin())
    observed = (
        f"objective best {objective[0]:.2f} at first, {objective[-1]:.2f} in the end; "
        f"subjective best {subjective[0]:.2f} at first, {subjective[-1]:.2f} in the end, "
        f"lowest {subjective[lowest]:.2f} in generation {best.generations[lowest]}"
    )
    agrees = objective[-1] >= PRINTED_ACCURACY and does_not_drop(best.subjective)
    return verdict_on(CLASSIFIERS, agrees, observed, "classifiers in the laboratory")


def _show_runs(
    findings: Findings, outcomes: Mapping[str, LaboratoryRuns], seeds: range, truth: np.ndarray
) -> None:
    """Add the tables of all runs, and the pictures of those in the laboratory and beside it."""
    errors = {}
    models = {}
    dynamics = {}
    curves = {}
    for source, runs in outcomes.items():
        frame = errors_frame(absolute_error(runs.best, truth), NAMES, ERRORS)
        errors[source] = frame.rename(columns={"runs": "number"})
        models[source] = seeded(seeds, runs.best, NAMES)
        curves[source] = error_dynamics(runs, truth)
        frame = pd.DataFrame(medians(runs), columns=NAMES).join(curves[source].add_prefix("mae_"))
        dynamics[source] = (
            frame.map(partial(round, ndigits=4)).rename_axis("generation").reset_index()
        )
    findings.table("absolute-errors", stacked(errors, "runs"), True)
    findings.table("models", stacked(models, "runs"))
    findings.table("dynamics", stacked(dynamics, "runs"))
    best = outcomes[EMULATED].best
    look: dict[str, Any] = {"names": NAMES, "truth": truth}
    findings.picture("models", ERRORS, box_figure(best, **look), runs=len(best))
    compared = (EMULATED, SIMULATED)
    models_by_title = {source.capitalize(): medians(outcomes[source]) for source in compared}
    parameters = convergence_figure(models_by_title, **look)
    findings.picture("parameter-dynamics", DYNAMICS, parameters, runs=len(best))
    errors_by_title = {source.capitalize(): curves[source].to_dict("series") for source in compared}
    findings.picture(
        "error-dynamics", DYNAMICS, error_panels_figure(errors_by_title), runs=len(best)
    )


def _show_validation(
    findings: Findings, agents: Gathering, replicas: Gathering, times_s: np.ndarray, sizes: Sizes
) -> None:
    """Add table and pictures of the swarms before the camera."""
    frames = {}
    for role, swarm in zip(trials.SWARM_KINDS, (agents, replicas), strict=True):
        columns = {
            "trial": np.arange(1, len(swarm.complete) + 1),
            "proportion": swarm.proportion[:, -1],
            "dispersion": swarm.dispersion[:, -1],
            "images_complete": swarm.complete.mean(axis=1),
        }
        frames[role] = pd.DataFrame(columns)
    findings.table("validation", stacked(frames, "controller"))
    proportions = {"agents": agents.proportion, "inferred model": replicas.proportion}
    dispersions = {"agents": agents.dispersion, "inferred model": replicas.dispersion}
    gathering = gathering_figure(
        times_s,
        {"Proportion in largest cluster": proportions, "Dispersion": dispersions},
        limits={
            "Proportion in largest cluster": 1.0,
            "Dispersion": analysis.least_dispersion(sizes["robots"]),
        },
    )
    words = {"robots": sizes["robots"]}
    findings.picture("gathering", VALIDATION, gathering, trials=sizes["trials"], **words)
    moments = [int(np.argmin(np.abs(times_s - time))) for time in sizes["shown_s"]]
    trial = index_of_median(replicas.dispersion[:, -1])
    snapshots = snapshots_figure(
        replicas.poses[trial, moments],
        times_s=sizes["shown_s"],
        robots=sizes["robots"],
        robot_radius_cm=replicas.radius_cm,
        columns=4,
    )
    findings.picture("snapshots", VALIDATION, snapshots, **words)
