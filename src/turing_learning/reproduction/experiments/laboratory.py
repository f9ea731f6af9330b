"""Section 5: robots in the loop, in a laboratory that is emulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from turing_learning.analysis import (
    Comparison,
    absolute_error,
    compare,
    decision_accuracy,
    least_dispersion,
    mean_absolute_error,
)
from turing_learning.figures import Picture, box_figure
from turing_learning.figures._classifiers import accuracy_figure
from turing_learning.figures._many_runs import convergence_panels_figure, error_panels_figure
from turing_learning.figures._swarms import gathering_figure, snapshots_figure

from .._claims import load_claims
from .._experiment import Experiment, Findings, Table, stacked
from .._laboratory_trials import (
    KINDS,
    Gathering,
    LaboratoryRuns,
    LaboratoryRunSizes,
    RandomModelSizes,
    ValidationSizes,
    emulated_runs,
    gatherings,
    laboratory_file,
    random_models,
    simulated_runs,
)
from .._verdicts import Spread, Verdict, errors_verdict, printed_spreads, valued
from .._work import Work
from ._shared import errors_frame, spreads_frame
from .classifier_accuracy import BestAccuracies

ERRORS, DYNAMICS, VALIDATION, CLASSIFIERS = (
    f"5-physical-{what}" for what in ("ae", "dynamics", "validation", "classifiers")
)
PAPER_RUNS = 10
CORRESPONDENCE = 0.1
"""Difference of medians that still counts as good correspondence, as "near the truth" does in section 4.3."""
LATE = 0.2
"""Share of the generations, the last ones, over which medians are compared."""
HIGH = 0.9
QUANTITIES = ("proportion at the end", "dispersion at the end", "mean proportion", "mean dispersion")
"""What is compared: of every trial the last moment, and the mean over all moments."""
EMULATED, SIMULATED = "emulated laboratory", "plain simulation"
NAMES = ("vl0", "vr0", "vl1", "vr1")
NO_NOISE = (
    "as in simulation, the fittest classifier comes to know the present models only; the paper supposes that the noise of its "
    "robots has prevented that, and emulated robots have none but that of their wheels and of the camera"
)


@dataclass(frozen=True)
class LaboratorySizes:
    """Which runs, which trials of many robots, and how many random models."""

    runs: LaboratoryRunSizes = field(default_factory=LaboratoryRunSizes)
    validation: ValidationSizes = field(default_factory=ValidationSizes)
    random_models: RandomModelSizes = field(default_factory=RandomModelSizes)


@dataclass(frozen=True, eq=False)
class ErrorDynamics:
    """Medians over the runs of the MAE of three models of each generation (G,)."""

    average: np.ndarray
    subjective: np.ndarray
    objective: np.ndarray

    @classmethod
    def of(cls, runs: LaboratoryRuns, truth: np.ndarray) -> "ErrorDynamics":
        """Return the errors of all models on average, of the subjectively best, and of the best."""
        maes = mean_absolute_error(runs.models, truth)
        return cls(
            average=np.median(maes.mean(axis=2), axis=0),
            subjective=np.median(mean_absolute_error(runs.fittest, truth), axis=0),
            objective=np.median(maes.min(axis=2), axis=0),
        )

    @property
    def share_between(self) -> float:
        """Share of the generations in which the subjectively best model lies between the best and the average one."""
        return float(np.mean((self.objective <= self.subjective) & (self.subjective <= self.average)))


@dataclass(frozen=True, eq=False)
class Validation:
    """Trials of the agents' controller and of the inferred model (P,) from common initial configurations, at K moments."""

    model: np.ndarray
    agents: Gathering
    replicas: Gathering
    times_s: np.ndarray

    @property
    def comparison(self) -> Comparison:
        """Tests of the four `QUANTITIES`."""
        pairs = [(getattr(self.agents, what), getattr(self.replicas, what)) for what in ("proportion", "dispersion")]
        tests = [compare(a[:, -1], [b[:, -1]]) for a, b in pairs] + [compare(a.mean(1), [b.mean(1)]) for a, b in pairs]
        return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


def conduct(work: Work) -> Findings:
    """Conduct the runs in the emulated laboratory and in simulation; validate the median model; judge random models."""
    from turing_learning.robots import LABORATORY

    sizes: LaboratorySizes = work.sizes
    truth = np.array(LABORATORY.controller)
    emulated, simulated = emulated_runs(work), simulated_runs(work, "default")
    outcomes = {EMULATED: emulated, SIMULATED: simulated, f"{SIMULATED}, preset paper": simulated_runs(work, "paper")}
    median = np.median(emulated.best, axis=0)
    validation = Validation(median, *gatherings(work, median), sizes.validation.times_s)
    best = _accuracies(work, emulated)
    return Findings(
        [
            *(runs_verdict(runs, truth, "" if kind == EMULATED else kind) for kind, runs in outcomes.items()),
            dynamics_verdict(emulated, simulated, truth),
            validation_verdict(validation),
            classifiers_verdict(best),
        ],
        [*_runs_tables(outcomes, sizes.runs.seeds, truth), _validation_table(validation), _accuracy_table(best)],
        [
            *_runs_pictures(outcomes, truth),
            *_validation_pictures(validation, sizes.validation),
            _accuracy_picture(best, sizes.random_models.models),
        ],
    )


def _accuracies(work: Work, runs: LaboratoryRuns) -> BestAccuracies:
    """Let the classifiers of all runs and kept generations judge the same trials of random models.

    Source
    ------
    Paper, section 5.5.
    """
    from turing_learning.coevolution import THRESHOLD
    from turing_learning.config import classifier_of
    from turing_learning.robots import load_laboratory

    sizes, path = work.sizes.runs, laboratory_file(work, "default")
    samples = random_models(work, path)
    classifier = classifier_of(load_laboratory(path, dict(sizes.settings)).configuration)
    genomes = runs.classifiers.reshape(-1, runs.classifiers.shape[-1]).astype(np.float64)
    agents, replicas = (classifier.judge(genomes, samples[name]) >= THRESHOLD for name in ("agents", "replicas"))
    accuracy = decision_accuracy(agents[..., None], replicas[..., None]).reshape(runs.classifier_fitness.shape)
    return BestAccuracies.of("", sizes.kept, accuracy, runs.classifier_fitness)  # the archive is left out


# Verdicts.


def medians(runs: LaboratoryRuns) -> np.ndarray:
    """Return the medians over the runs of the subjectively best model of each generation (G, P)."""
    return np.asarray(np.median(runs.fittest, axis=0))


def distances(emulated: LaboratoryRuns, simulated: LaboratoryRuns) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the medians of two kinds of runs are apart (P,), on average over the last fifth and over all generations."""
    apart = np.abs(medians(emulated) - medians(simulated))
    return np.asarray(apart[-max(1, round(LATE * len(apart))) :].mean(axis=0)), np.asarray(apart.mean(axis=0))


def runs_verdict(runs: LaboratoryRuns, truth: np.ndarray, variant: str = "") -> Verdict:
    """Hold the absolute errors of the post-evaluated best models against the printed ones."""
    texts = {
        end: f"; median model {', '.join(f'{value:.2f}' for value in values)}"
        for end, values in (
            ("printed_also", load_claims()[ERRORS].values["median_parameters"]),
            ("observed_also", np.median(runs.best, axis=0)),
        )
    }
    errors = absolute_error(runs.best, truth)
    return errors_verdict(ERRORS, errors, NAMES, variant, paper_runs=PAPER_RUNS, **texts)


def dynamics_verdict(emulated: LaboratoryRuns, simulated: LaboratoryRuns, truth: np.ndarray) -> Verdict:
    """Compare the dynamics of emulated and of simulated runs."""
    shares = [ErrorDynamics.of(runs, truth).share_between for runs in (emulated, simulated)]
    late, overall = distances(emulated, simulated)
    return Verdict(
        DYNAMICS,
        bool(min(shares) > 0.5 and (late <= CORRESPONDENCE).all()),
        "good correspondence of physical and simulated runs; the subjectively best model lies between the best and the average "
        "one in the majority of the generations of both",
        f"between them in {shares[0]:.0%} of the generations of emulated and {shares[1]:.0%} of simulated runs; medians apart in "
        f"the last fifth of the generations: {valued(NAMES, late)}; over all generations: {valued(NAMES, overall)}",
        "dynamics",
    )


def validation_verdict(validation: Validation) -> Verdict:
    """Compare what swarms of the median model and of agents do."""
    swarms, comparison = (validation.agents, validation.replicas), validation.comparison
    shares = [one.proportion[:, -1].mean() for one in swarms]
    spreads = [one.dispersion[:, -1].mean() for one in swarms]
    return Verdict(
        VALIDATION,
        not comparison.significant.any(),
        "the dynamics of the agents and of the median inferred model show good correspondence",
        f"{validation.agents.seen.shape[2]} robots after {validation.times_s[-1]:g} s: largest cluster {shares[0]:.2f} (agents), "
        f"{shares[1]:.2f} (model) of the robots; dispersion {spreads[0]:.0f}, {spreads[1]:.0f}; p: "
        f"{valued(QUANTITIES, comparison.p_values, '.2g')}",
        "validation",
    )


def does_not_drop(values: np.ndarray) -> bool:
    """Return whether no generation's mean over the runs (R, G) is below an earlier one by more than twice the standard error of
    the difference."""  # fmt: skip
    spreads = [Spread.of(column) for column in values.T]
    return all(
        earlier.mean - later.mean <= 2 * float(np.hypot(earlier.standard_error, later.standard_error))
        for k, later in enumerate(spreads)
        for earlier in spreads[:k]
    )


def classifiers_verdict(best: BestAccuracies) -> Verdict:
    """Hold the accuracy of the best classifiers against what the text says of the figure."""
    objective, subjective = best.objective.mean(axis=0), best.subjective.mean(axis=0)
    lowest = int(subjective.argmin())
    agrees = bool(objective[-1] >= HIGH and does_not_drop(best.subjective))
    return Verdict(
        CLASSIFIERS,
        agrees,
        "best classifier (objective) high; best classifier (subjective) does not drop within 100 generations",
        f"objective best {objective[0]:.2f} at first, {objective[-1]:.2f} in the end; subjective best {subjective[0]:.2f} at "
        f"first, {subjective[-1]:.2f} in the end, lowest {subjective[lowest]:.2f} in generation {best.generations[lowest]}",
        "classifiers in the laboratory",
        reason="" if agrees else NO_NOISE,
    )


# Tables and figures.


def _runs_tables(outcomes: Mapping[str, LaboratoryRuns], seeds: tuple[int, ...], truth: np.ndarray) -> list[Table]:
    errors, models, dynamics = {}, {}, {}
    printed = spreads_frame(printed_spreads(ERRORS, PAPER_RUNS), "paper_mean", "paper_standard_deviation")
    for kind, runs in outcomes.items():
        statistics = errors_frame(absolute_error(runs.best, truth), NAMES).rename(columns={"runs": "number"})
        errors[kind] = statistics.join(printed)
        models[kind] = pd.DataFrame({"seed": seeds}).join(pd.DataFrame(runs.best, columns=NAMES))
        curves = ErrorDynamics.of(runs, truth)
        maes = {f"mae_{name}": getattr(curves, name) for name in ("average", "subjective", "objective")}
        frame = pd.DataFrame(medians(runs), columns=NAMES).assign(**maes).map(lambda value: round(value, 4))
        frame.insert(0, "generation", frame.index)
        dynamics[kind] = frame
    return [
        Table(
            "absolute-errors",
            "Absolute errors of the post-evaluated best models, beside what the paper prints of its physical runs",
            stacked(errors, "runs"),
            inline=True,
        ),
        Table("models", "What every run has inferred: the post-evaluated best model", stacked(models, "runs")),
        Table(
            "dynamics",
            "Medians over the runs of each generation: parameters of the subjectively best model; errors of all models on average, "
            "of the subjectively and of the objectively best one",
            stacked(dynamics, "runs"),
        ),
    ]


def _validation_table(validation: Validation) -> Table:
    frames = {}
    for kind, one in zip(KINDS, (validation.agents, validation.replicas), strict=True):
        ends = {"proportion": one.proportion[:, -1], "dispersion": one.dispersion[:, -1]}
        trials = np.arange(1, len(one.complete) + 1)
        frames[kind] = pd.DataFrame({"trial": trials, **ends, "images_complete": one.complete.mean(axis=1)})
    caption = "Swarms at the end of every trial, and the share of the images in which the camera has seen all robots"
    return Table("validation", caption, stacked(frames, "controller"))


def _accuracy_table(best: BestAccuracies) -> Table:
    caption = (
        "Decision accuracy of the subjectively and of the objectively best classifier, mean and standard deviation over the "
        "runs"
    )
    return Table("accuracy", caption, best.means_frame("subjective", "objective"))


def _runs_pictures(outcomes: Mapping[str, LaboratoryRuns], truth: np.ndarray) -> list[Picture]:
    both = [outcomes[kind] for kind in (EMULATED, SIMULATED)]
    number, titles = len(both[0].best), [f"{kind[0].upper()}{kind[1:]}" for kind in (EMULATED, SIMULATED)]
    errors = [ErrorDynamics.of(runs, truth) for runs in both]
    curves = [
        {"average of all models": e.average, "subjectively best": e.subjective, "objectively best": e.objective}
        for e in errors
    ]
    middle = [medians(runs) for runs in both]
    return [
        Picture(
            "models",
            ERRORS,
            f"Emulated laboratory: parameters of the post-evaluated best model of the last generation, {number} runs; the truth "
            "is dashed.",
            box_figure(both[0].best, names=NAMES, truth=truth),
        ),
        Picture(
            "parameter-dynamics",
            DYNAMICS,
            f"Medians over {number} emulated and {number} simulated runs of the subjectively best model of each generation; the "
            "truth is thin.",
            convergence_panels_figure(middle, titles=titles, names=NAMES, truth=truth),
        ),
        Picture(
            "error-dynamics",
            DYNAMICS,
            f"Medians over {number} emulated and {number} simulated runs of the errors of the models of each generation.",
            error_panels_figure(curves, titles=titles),
        ),
    ]


def _validation_pictures(validation: Validation, sizes: ValidationSizes) -> list[Picture]:
    swarms = {"agents": validation.agents, "inferred model": validation.replicas}
    curves = {
        "Proportion in largest cluster": {name: one.proportion for name, one in swarms.items()},
        "Dispersion": {name: one.dispersion for name, one in swarms.items()},
    }
    limits = dict(zip(curves, (1.0, least_dispersion(sizes.robots)), strict=True))
    moments = [int(np.argmin(np.abs(sizes.times_s - time))) for time in sizes.shown_s]
    ends = validation.replicas.dispersion[:, -1]
    trial = int(np.argsort(ends, kind="stable")[(len(ends) - 1) // 2])
    snapshots = snapshots_figure(
        validation.replicas.poses[trial, moments],
        times_s=sizes.shown_s,
        robots=sizes.robots,
        robot_radius_cm=validation.replicas.radius_cm,
        columns=4,
    )
    return [
        Picture(
            "gathering",
            VALIDATION,
            f"Emulated laboratory: {sizes.robots} robots, mean (line) and standard deviation (band) over {sizes.trials} trials "
            "with the agents' controller and with the median inferred model.",
            gathering_figure(validation.times_s, curves, limits=limits),
        ),
        Picture(
            "snapshots",
            VALIDATION,
            f"Emulated laboratory: {sizes.robots} robots that execute the median inferred model; the trial of median dispersion "
            "at the end.",
            snapshots,
        ),
    ]


def _accuracy_picture(best: BestAccuracies, models: int) -> Picture:
    caption = (
        f"Emulated laboratory: decision accuracy over {models} random models, mean and standard deviation over "
        f"{len(best.objective)} runs."
    )
    figure = accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective)
    return Picture("accuracy", CLASSIFIERS, caption, figure)


EXPERIMENT = Experiment.of(
    "5",
    conduct,
    full=LaboratorySizes(),
    fast=LaboratorySizes(
        runs=LaboratoryRunSizes(
            runs=1,
            generations=2,
            repeats=1,
            kept=(0, 1),
            settings={"models.population": 2, "classifiers.population": 10},
        ),
        validation=ValidationSizes(robots=12, trials=2, duration_s=8.0, every_s=4.0, shown_s=(0, 4, 8)),
        random_models=RandomModelSizes(models=4),
    ),
)
