"""Decision accuracy of classifiers over a wide range of models."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import THRESHOLD, Classifier
from turing_learning.config import ConfigurationError
from turing_learning.config._sections import check
from turing_learning.errors import integer
from turing_learning.models import Behavior
from turing_learning.swarm import Scenario, Trials, initial_poses, mixed

from ._simulated import POST_EVALUATION, stream

BLOCK_BYTES = 256_000_000  # of samples that are simulated and judged at once
GENOMES = 500  # that judge a block at once
SPARSE = 0.2  # share of undecided individuals below which a classifier's are picked out, which costs more for each
WHOLE = slice(None)
MOST_GRID_MODELS = 10_000_000


@dataclass(frozen=True, eq=False)
class PostEvaluation:
    """How well classifiers decide about individuals."""

    sensitivity: np.ndarray  #: (N,), share of the replicas that were decided to be models
    specificity: np.ndarray  #: (N,), share of the agents that were decided to be agents

    @property
    def accuracy(self) -> np.ndarray:
        """Decision accuracy (N,): the mean of both. 0.5 for a classifier that decides the same about all."""
        return (self.sensitivity + self.specificity) / 2

    @classmethod
    def of_counts(cls, counts: np.ndarray, scenario: Scenario, models: int) -> "PostEvaluation":
        """Return shares from what `count_agents` has counted in the swarms of all M models."""
        shares = counts / (models * np.array([scenario.agents, scenario.replicas]))
        return cls(sensitivity=1 - shares[:, 1], specificity=shares[:, 0])


def grid_models(scenario: Scenario, points: int = 11, low: float = -1.0, high: float = 1.0) -> np.ndarray:
    """Return models (points^P, P) on a grid over the parameter space, as in section 4.4 of the paper; the last
    parameter changes fastest.

    Parameters
    ----------
    points
        Settings of each parameter, >= 2; points^P at most 10 million.
    low, high
        Smallest and largest setting, fractions of the maximum speed.
    """
    parameters = len(scenario.controller)
    integer("points", points, 2, error=ConfigurationError)
    fits, got = points**parameters <= MOST_GRID_MODELS, f"{points}, which gives {points}^{parameters}"
    check(fits, "points", f"give at most {MOST_GRID_MODELS} models", got)
    fits = bool(np.isfinite([low, high]).all()) and low < high
    check(fits, "low", "be below `high`, both finite", f"{low} and {high}")
    axes = np.meshgrid(*[np.linspace(low, high, points)] * parameters, indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, parameters)


def decide(judged_genuine: np.ndarray) -> np.ndarray:
    """Decide by judgments (..., S) of samples: "model" only if all say so, "agent" (True) otherwise (paper, section 4.4)."""
    return np.any(judged_genuine, axis=-1)


def post_evaluate(
    classifier: Classifier, genomes: np.ndarray, scenario: Scenario, models: np.ndarray, *, trials: int = 10,
    seed: int = 0, threads: int | None = None,
) -> PostEvaluation:  # fmt: skip
    """Let classifiers decide about the agents and replicas of many swarms.

    A replica executes each model among agents, in several trials from initial poses that are common to all
    models and classifiers. A classifier judges each individual once a trial, and decides that it is a model
    only if all judgments say so.

    Source: paper, section 4.4.

    Parameters
    ----------
    classifier
        Judges.
    genomes : (N, Q)
        Classifiers, N >= 1.
    scenario
        Its agents and replicas; the paper has ten and one.
    models : (M, P)
        What replicas execute, for example `grid_models`.
    trials
        Number of trials of each model, >= 1; ten in the paper.
    seed
        Of initial poses and noise, >= 0. The result depends on nothing else.
    threads
        Number of threads of the simulation; None takes every processor.
    """
    counts = count_agents(classifier, genomes, scenario, models, trials=trials, seed=seed, threads=threads)
    assert counts is not None  # nobody asks for a stop
    return PostEvaluation.of_counts(counts, scenario, len(models))


def count_agents(
    classifier: Classifier, genomes: np.ndarray, scenario: Scenario, models: np.ndarray, *, part: slice = WHOLE,
    trials: int = 10, seed: int = 0, threads: int | None = None, should_stop: Callable[[], bool] | None = None,
) -> np.ndarray | None:  # fmt: skip
    """Count the agents, and the replicas, that classifiers decide to be agents (N, 2): what `post_evaluate` does, in parts.

    Parameters
    ----------
    classifier, genomes, scenario, models, trials, seed, threads
        As in `post_evaluate`.
    part
        Which of the models; the counts of parts that cover all add up to those of all.
    should_stop
        Asked before every 500 classifiers; None is returned if it was stopped.
    """
    integer("trials", trials, 1, error=ConfigurationError)
    models = array("models", models, "M P", error=ConfigurationError, P=len(scenario.controller))
    genomes = np.asarray(genomes)
    check(genomes.ndim == 2 and len(genomes), "genomes", "have the shape (N, Q), N >= 1", genomes.shape)
    counts, individuals = np.zeros((len(genomes), 2), dtype=np.int64), scenario.individuals
    rng = stream(seed, POST_EVALUATION)
    poses = initial_poses(scenario, trials, rng)
    keys = rng.integers(0, 2**64, size=(len(models), trials), dtype=np.uint64)[part]
    bytes_of_model = 8 * individuals * trials * scenario.control_steps * len(scenario.input_scale)
    models, size = models[part], max(1, BLOCK_BYTES // bytes_of_model)
    for first in range(0, len(models), size):
        block = models[first : first + size]
        starts, executed = np.tile(poses, (len(block), 1, 1)), mixed(scenario, len(block), trials)
        begun = Trials(scenario, executed, starts, keys[first : first + size].ravel())
        samples = begun.observe(Behavior(block), threads).swapaxes(0, 1)
        samples = samples.reshape(-1, trials, *samples.shape[2:])  # (individuals x models of the block, trials, T, D)
        for start in range(0, len(genomes), GENOMES):
            if should_stop is not None and should_stop():
                return None
            chosen = slice(start, start + GENOMES)
            agent = _decided(classifier, genomes[chosen], samples).reshape(-1, individuals, len(block)).sum(axis=2)
            sides = agent[:, : scenario.agents], agent[:, scenario.agents :]
            counts[chosen] += np.stack([side.sum(axis=1) for side in sides], axis=1)
    return counts


def _decided(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return who of samples (K, trials, T, D) is an agent, see `decide`, to each classifier (N, K), one trial after the other.

    Who has been judged genuine once is an agent, and is not judged again by that classifier.
    """
    agent = np.zeros((len(genomes), len(samples)), dtype=bool)
    for trial in range(samples.shape[1]):
        observed = np.ascontiguousarray(samples[:, trial])
        left = agent.shape[1] - agent.sum(axis=1)
        many = left > SPARSE * agent.shape[1]
        if many.any():
            agent[many] |= classifier.judge(genomes[many], observed) >= THRESHOLD
        for n in np.flatnonzero(~many & (left > 0)):
            undecided = np.flatnonzero(~agent[n])
            agent[n, undecided] = classifier.judge(genomes[n : n + 1], observed[undecided])[0] >= THRESHOLD
    return agent


@dataclass(frozen=True, eq=False)
class GenerationAccuracies:
    """Decision accuracies of the classifiers of some generations (G,), counted from 0: of all classifiers (G,
    N), and of the one with the highest subjective fitness in its generation (G,), the first of equals."""

    generations: np.ndarray
    accuracy: np.ndarray
    subjective: np.ndarray

    @property
    def objective(self) -> np.ndarray:
        """Highest accuracy of a single classifier in each generation (G,)."""
        return self.accuracy.max(axis=1)


def sampled_generations(generations: int, points: int = 16) -> np.ndarray:
    """Return generations (about `points`,) of a run of so many: the first, the last, and about even ratios between, ascending."""
    integer("generations", generations, 1, error=ConfigurationError)
    integer("points", points, 2, error=ConfigurationError)
    if generations == 1:
        return np.zeros(1, dtype=np.int64)
    between = np.geomspace(1, generations - 1, points - 1)
    return np.unique(np.concatenate(([0], np.rint(between)))).astype(np.int64)


def accuracy_over_generations(
    classifier: Classifier, populations: Any, fitness: Any, scenario: Scenario, *, models: np.ndarray | None = None,
    generations: Sequence[int] | np.ndarray | None = None, trials: int = 10, seed: int = 0,
    threads: int | None = None,
) -> GenerationAccuracies:  # fmt: skip
    """Post-evaluate the classifiers of some generations of a run, all in the same trials.

    Source: paper, section 4.4, figure 7.

    Parameters
    ----------
    classifier
        Judges.
    populations : (G, N, Q)
        All classifiers of all generations: ``result.history["classifier"]`` of a run with a full history.
    fitness : (G, N)
        Their subjective fitness: ``result.history["classifier_fitness"]``.
    models : (M, P)
        What replicas execute; None takes `grid_models`, 11 settings of each parameter.
    generations
        Which generations; None takes `sampled_generations`.
    trials, seed, threads
        As in `post_evaluate`.
    """
    total = len(populations)
    chosen = sampled_generations(total) if generations is None else np.asarray(generations, dtype=np.int64)
    fits = chosen.ndim == 1 and chosen.size and ((chosen >= 0) & (chosen < total)).all()
    check(fits, "generations", f"be numbers from 0 to {total - 1}", chosen.tolist())
    genomes = np.stack([np.asarray(populations[int(g)]) for g in chosen])
    scores = np.stack([np.asarray(fitness[int(g)]) for g in chosen])
    got = f"{scores.shape} and {genomes.shape}"
    check(scores.shape == genomes.shape[:2], "fitness", "have the shape (G, N), as populations", got)
    models = grid_models(scenario) if models is None else models
    flat = genomes.reshape(-1, genomes.shape[2])
    evaluation = post_evaluate(classifier, flat, scenario, models, trials=trials, seed=seed, threads=threads)
    accuracy = evaluation.accuracy.reshape(scores.shape)
    return GenerationAccuracies(chosen, accuracy, accuracy[np.arange(len(chosen)), scores.argmax(axis=1)])
