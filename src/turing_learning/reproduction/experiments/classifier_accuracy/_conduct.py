"""Section 4.4: how well the classifiers of all generations decide over the whole space of behaviors."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from turing_learning.reproduction._experiment import Experiment, Findings, Picture, Table
from turing_learning.reproduction._verdicts import Spread
from turing_learning.reproduction._work import Work
from turing_learning.reproduction.experiments._variants import PRESETS, variant_of
from turing_learning.swarm import AGGREGATION, Scenario

from ._populations import Populations, RunSizes, run_populations
from ._verdicts import CLAIM, BestAccuracies, accuracy_verdicts


@dataclass(frozen=True)
class AccuracySizes:
    """Which runs and generations, and the grid of models; its trials are done in so many parts."""

    runs: RunSizes = field(default_factory=RunSizes)
    generations: tuple[int, ...] = (
        0, 1, 2, 3, 5, 10, 20, 50, 99, 199, 299, 499, 699, 899, 999,
    )  # fmt: skip
    points: int = 11
    trials: int = 10
    parts: int = 22
    seed: int = 1


@dataclass(frozen=True, eq=False)
class _Outcome:
    """Decision accuracies (R, G, N) of the classifiers of one preset."""

    preset: str
    accuracy: np.ndarray
    best: BestAccuracies
    archive: bool


def conduct(work: Work) -> Findings:
    """Conduct the runs, let all of their classifiers judge the same trials, and compare the best of each generation."""
    sizes: AccuracySizes = work.sizes
    populations = {
        preset: run_populations(work, sizes.runs, AGGREGATION.name, preset, sizes.generations) for preset in PRESETS
    }
    accuracies = _accuracies(work, AGGREGATION, populations)
    outcomes = [_outcome(sizes, preset, populations[preset], *accuracies[preset]) for preset in PRESETS]
    return Findings(
        [verdict for outcome in outcomes for verdict in accuracy_verdicts(outcome.best)],
        [_means_table(outcomes), _runs_table(outcomes, sizes.runs.seeds)],
        [_picture(outcome) for outcome in outcomes],
    )


def _accuracies(
    work: Work, scenario: Scenario, populations: dict[str, Populations]
) -> dict[str, tuple[np.ndarray, list[np.ndarray]]]:
    """Return preset -> accuracies of the populations (R, G, N) and of what was archived, R of (U,).

    Each trial is simulated once, for the classifiers of all runs and presets.
    """
    from turing_learning.detection import PostEvaluation, grid_models

    sizes: AccuracySizes = work.sizes
    models = grid_models(scenario, sizes.points)
    groups = [
        group for one in populations.values() for group in (one.classifiers.reshape(-1, one.weights), *one.archived)
    ]
    genomes = np.concatenate(groups)
    counts = sum(
        work.arrays(f"grid-part{k + 1:02d}", partial(_counted, work, scenario, models, genomes, k))["agents"]
        for k in range(sizes.parts)
    )
    accuracy = PostEvaluation.of_counts(np.asarray(counts), scenario, len(models)).accuracy
    parts = iter(np.split(accuracy, np.cumsum([len(group) for group in groups])[:-1]))
    return {
        preset: (next(parts).reshape(one.fitness.shape), [next(parts) for _ in one.archived])
        for preset, one in populations.items()
    }


def _counted(
    work: Work, scenario: Scenario, models: np.ndarray, genomes: np.ndarray, part: int
) -> dict[str, np.ndarray] | None:
    from turing_learning.config import classifier_of
    from turing_learning.detection import count_agents

    sizes: AccuracySizes = work.sizes
    bounds = [len(models) * k // sizes.parts for k in range(sizes.parts + 1)]
    counts = count_agents(
        classifier_of(sizes.runs.configuration(scenario.name, PRESETS[0], sizes.runs.first_seed)),
        genomes,
        scenario,
        models,
        part=slice(bounds[part], bounds[part + 1]),
        trials=sizes.trials,
        seed=sizes.seed,
        should_stop=work.should_stop,
    )
    return None if counts is None else {"agents": counts.astype(np.uint32)}


def _outcome(
    sizes: AccuracySizes, preset: str, populations: Populations, accuracy: np.ndarray, archived: list[np.ndarray]
) -> _Outcome:
    fittest = populations.fitness.argmax(axis=2, keepdims=True)  # the first of equals
    objective = accuracy.max(axis=2)
    referees = [
        np.where(judging, one, 0.0).max(axis=1, initial=0.0)
        for judging, one in zip(populations.judging, archived, strict=True)
    ]
    best = BestAccuracies(
        variant=variant_of(preset),
        generations=np.array(sizes.generations),
        subjective=np.take_along_axis(accuracy, fittest, axis=2)[..., 0],
        objective=objective,
        jury=np.maximum(objective, referees),
    )
    return _Outcome(preset, accuracy, best, archive=any(len(one) for one in archived))


# Tables and pictures.


def _means_table(outcomes: list[_Outcome]) -> Table:
    rows = []
    for one in outcomes:
        for k, generation in enumerate(one.best.generations.tolist()):
            spreads = [Spread.of(runs[:, k]) for runs in (one.best.subjective, one.best.objective, one.best.jury)]
            numbers = [number for each in spreads for number in (each.mean, each.standard_deviation)]
            rows.append((one.preset, generation, *numbers, float(one.accuracy[:, k].mean())))
    return Table(
        "accuracy",
        "Decision accuracy of the subjectively and of the objectively best classifier of each generation's population, and of "
        "the best of the jury (population and archive), mean and standard deviation over the runs, and the mean accuracy of "
        "the population",
        (
            "preset", "generation", "subjective", "subjective_deviation", "objective", "objective_deviation", "jury",
            "jury_deviation", "all",
        ),
        rows,
    )  # fmt: skip


def _runs_table(outcomes: list[_Outcome], seeds: tuple[int, ...]) -> Table:
    rows = [
        (
            one.preset,
            seed,
            generation,
            *(float(runs[run, k]) for runs in (one.best.subjective, one.best.objective, one.best.jury)),
        )
        for one in outcomes
        for run, seed in enumerate(seeds)
        for k, generation in enumerate(one.best.generations.tolist())
    ]
    columns = ("preset", "seed", "generation", "subjective", "objective", "jury")
    return Table("accuracy-runs", "The same in every run", columns, rows)


def _picture(outcome: _Outcome) -> Picture:
    from turing_learning.figures._classifiers import accuracy_figure

    best = outcome.best
    return Picture(
        f"accuracy-{outcome.preset}",
        f"Aggregation, preset {outcome.preset}: decision accuracy over the whole space of behaviors, mean and standard "
        f"deviation over {len(best.objective)} runs.",
        CLAIM,
        accuracy_figure(
            best.generations,
            subjective=best.subjective,
            objective=best.objective,
            jury=best.jury if outcome.archive else None,
        ),
    )


EXPERIMENT = Experiment(
    id="4.4",
    title="The classifiers over the whole space of behaviors",
    cost="about 2 hours",
    claims=(CLAIM,),
    deviations=(
        "The classifiers of 15 of the 1000 generations are judged, all of them in each of these: 0, 1, 2, 3, 5, 10, 20, 50, 99, "
        "then every hundredth or two hundredth. The default preset renews its classifiers after generations 99, 199, 299, 399 "
        "and 499, the last ones before a renewal; those that follow one, random again, are not among the 15.",
        "The ten initial configurations are common to all classifiers, as in the paper, and to all models; the wheel noise of "
        "every trial is its own.",
        "All agents of all trials count: the agents' half of the accuracy rests on 146,410 decisions about the ten agents "
        "beside each model.",
        "The verdict is about the default preset, whose archive, votes and renewal the paper does not have; the preset `paper` "
        "stands beside it. Its models are judged by a jury of present and archived classifiers, and the objectively best is that "
        "of the jury; the population without its archive stands beside it, too (decision 0019).",
    ),
    full=AccuracySizes(),
    fast=AccuracySizes(
        runs=RunSizes(runs=3, generations=12, settings={"models.population": 10, "classifiers.population": 10}),
        generations=(0, 1, 5, 11),
        points=2,
        trials=4,
        parts=3,
    ),
    conduct=conduct,
)
