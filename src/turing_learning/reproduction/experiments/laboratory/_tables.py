"""Tables and figures of section 5."""

from typing import Any

import numpy as np

from turing_learning.analysis import absolute_error, least_dispersion
from turing_learning.reproduction._experiment import Cell, Picture, Table
from turing_learning.reproduction._verdicts import Spread, printed_spreads
from turing_learning.reproduction.experiments.classifier_accuracy import BestAccuracies

from ._runs import LaboratoryRuns
from ._validation import KINDS, Validation, ValidationSizes
from ._verdicts import CLASSIFIERS, DYNAMICS, ERRORS, VALIDATION, ErrorDynamics, medians

EMULATED, SIMULATED = "emulated laboratory", "plain simulation"


def errors_table(
    outcomes: dict[str, LaboratoryRuns], truth: np.ndarray, names: tuple[str, ...], printed: dict[str, Any]
) -> Table:
    """Return the absolute errors of all kinds of runs, beside the printed ones."""
    theirs = printed_spreads(printed)
    rows: list[tuple[Cell, ...]] = []
    for kind, runs in outcomes.items():
        errors = absolute_error(runs.best, truth)
        for k, name in enumerate(names):
            own = Spread.of(errors[:, k])
            numbers = own.mean, own.standard_deviation, float(np.median(errors[:, k]))
            rows.append((kind, name, own.runs, *numbers, theirs[k].mean, theirs[k].standard_deviation))
    return Table(
        "absolute-errors",
        "Absolute errors of the post-evaluated best models, beside what the paper prints of its physical runs",
        (
            "runs", "parameter", "number", "mean", "standard_deviation", "median", "paper_mean", "paper_standard_deviation",
        ),
        rows,
        inline=True,
    )  # fmt: skip


def models_table(outcomes: dict[str, LaboratoryRuns], seeds: tuple[int, ...], names: tuple[str, ...]) -> Table:
    """Return what every run has inferred."""
    rows: list[tuple[Cell, ...]] = [
        (kind, seed, *map(float, model))
        for kind, runs in outcomes.items()
        for seed, model in zip(seeds, runs.best, strict=True)
    ]
    return Table("models", "What every run has inferred: the post-evaluated best model", ("runs", "seed", *names), rows)


def dynamics_table(outcomes: dict[str, LaboratoryRuns], truth: np.ndarray, names: tuple[str, ...]) -> Table:
    """Return the medians over the runs, generation by generation."""
    rows: list[tuple[Cell, ...]] = []
    for kind, runs in outcomes.items():
        errors = ErrorDynamics.of(runs, truth)
        curves = np.column_stack([medians(runs), errors.average, errors.subjective, errors.objective])
        rows += [(kind, g, *(round(float(value), 4) for value in row)) for g, row in enumerate(curves)]
    return Table(
        "dynamics",
        "Medians over the runs of each generation: parameters of the subjectively best model; errors of all models on average, "
        "of the subjectively and of the objectively best one",
        ("runs", "generation", *names, "mae_average", "mae_subjective", "mae_objective"),
        rows,
    )


def gathering_table(validation: Validation) -> Table:
    """Return the swarms at the end of every trial."""
    rows = [
        (kind, trial + 1, float(one.proportion[trial, -1]), float(one.dispersion[trial, -1]), float(share))
        for kind, one in zip(KINDS, (validation.agents, validation.replicas), strict=True)
        for trial, share in enumerate(one.complete.mean(axis=1))
    ]
    return Table(
        "validation",
        "Swarms at the end of every trial, and the share of the images in which the camera has seen all robots",
        ("controller", "trial", "proportion", "dispersion", "images_complete"),
        rows,
    )


def accuracy_table(best: BestAccuracies) -> Table:
    """Return the accuracies of the best classifiers, generation by generation."""
    rows = []
    for k, generation in enumerate(best.generations.tolist()):
        spreads = [Spread.of(runs[:, k]) for runs in (best.subjective, best.objective)]
        rows.append((generation, *(number for one in spreads for number in (one.mean, one.standard_deviation))))
    return Table(
        "accuracy",
        "Decision accuracy of the subjectively and of the objectively best classifier, mean and standard deviation over the runs",
        ("generation", "subjective", "subjective_deviation", "objective", "objective_deviation"),
        rows,
    )


def run_pictures(outcomes: dict[str, LaboratoryRuns], truth: np.ndarray, names: tuple[str, ...]) -> list[Picture]:
    """Return the inferred models, and the dynamics in the emulated laboratory and in plain simulation."""
    from turing_learning.figures import box_figure
    from turing_learning.figures._many_runs import convergence_panels_figure, error_panels_figure

    shown = [outcomes[kind] for kind in (EMULATED, SIMULATED)]
    number, titles = len(shown[0].best), [f"{kind[0].upper()}{kind[1:]}" for kind in (EMULATED, SIMULATED)]
    errors = [ErrorDynamics.of(runs, truth) for runs in shown]
    curves = [
        {"average of all models": e.average, "subjectively best": e.subjective, "objectively best": e.objective}
        for e in errors
    ]
    return [
        Picture(
            "models",
            f"Emulated laboratory: parameters of the post-evaluated best model of the last generation, {number} runs; the truth "
            "is dashed.",
            ERRORS,
            box_figure(shown[0].best, names=names, truth=truth),
        ),
        Picture(
            "parameter-dynamics",
            f"Medians over {number} emulated and {number} simulated runs of the subjectively best model of each generation; the "
            "truth is thin.",
            DYNAMICS,
            convergence_panels_figure([medians(runs) for runs in shown], titles=titles, names=names, truth=truth),
        ),
        Picture(
            "error-dynamics",
            f"Medians over {number} emulated and {number} simulated runs of the errors of the models of each generation.",
            DYNAMICS,
            error_panels_figure(curves, titles=titles),
        ),
    ]


def validation_pictures(validation: Validation, sizes: ValidationSizes) -> list[Picture]:
    """Return what swarms come to over time, and moments of a trial with the inferred model."""
    from turing_learning.figures._swarms import gathering_figure, snapshots_figure

    names = {"agents": validation.agents, "inferred model": validation.replicas}
    share, spread = "Proportion in largest cluster", "Dispersion"
    curves = {
        share: {name: one.proportion for name, one in names.items()},
        spread: {name: one.dispersion for name, one in names.items()},
    }
    limits = {share: 1.0, spread: least_dispersion(sizes.robots)}
    moments = [int(np.argmin(np.abs(sizes.times_s - time))) for time in sizes.shown_s]
    ends = validation.replicas.dispersion[:, -1]
    trial = int(np.argsort(ends, kind="stable")[(len(ends) - 1) // 2])
    return [
        Picture(
            "gathering",
            f"Emulated laboratory: {sizes.robots} robots, mean (line) and standard deviation (band) over {sizes.trials} trials "
            "with the agents' controller and with the median inferred model.",
            VALIDATION,
            gathering_figure(validation.times_s, curves, limits=limits),
        ),
        Picture(
            "snapshots",
            f"Emulated laboratory: {sizes.robots} robots that execute the median inferred model; the trial of median dispersion "
            "at the end.",
            VALIDATION,
            snapshots_figure(
                validation.replicas.poses[trial, moments],
                times_s=sizes.shown_s,
                robots=sizes.robots,
                robot_radius_cm=validation.replicas.radius_cm,
                columns=4,
            ),
        ),
    ]


def accuracy_picture(best: BestAccuracies, models: int) -> Picture:
    """Return the accuracy of the best classifiers over generations."""
    from turing_learning.figures._classifiers import accuracy_figure

    return Picture(
        "accuracy",
        f"Emulated laboratory: decision accuracy over {models} random models, mean and standard deviation over "
        f"{len(best.objective)} runs.",
        CLASSIFIERS,
        accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective),
    )
