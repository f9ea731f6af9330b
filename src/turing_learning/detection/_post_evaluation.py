"""Decision accuracy of classifiers over a wide range of models."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from turing_learning.coevolution import THRESHOLD, Classifier
from turing_learning.config import ConfigurationError
from turing_learning.swarm import Scenario, initial_poses

from ._checks import checked_models, require_at_least
from ._simulated import POST_EVALUATION, observe_models, stream

BLOCK_BYTES = 64_000_000  # of samples that are simulated and judged at once
GENOMES = 500  # that judge a block at once
MOST_GRID_MODELS = 10_000_000


@dataclass(frozen=True, eq=False)
class PostEvaluation:
    """How well classifiers decide about individuals.

    Attributes
    ----------
    sensitivity : (N,)
        Share of the replicas that were decided to be models.
    specificity : (N,)
        Share of the agents that were decided to be agents.
    """

    sensitivity: np.ndarray
    specificity: np.ndarray

    @property
    def accuracy(self) -> np.ndarray:
        """Decision accuracy (N,): the mean of both. 0.5 for a classifier that decides the same about all."""
        return (self.sensitivity + self.specificity) / 2


def grid_models(scenario: Scenario, points: int = 11, low: float = -1.0, high: float = 1.0) -> np.ndarray:
    """Return models on a grid over the parameter space.

    Parameters
    ----------
    points
        Settings of each parameter, >= 2; points^P at most 10 million.
    low, high
        Smallest and largest setting, fractions of the maximum speed.

    Returns
    -------
    (points^P, P)
        The last parameter changes fastest.

    Raises
    ------
    ConfigurationError
        If a number breaks its rule.

    Source
    ------
    Paper, section 4.4.
    """
    parameters = len(scenario.controller)
    require_at_least(2, points=points)
    if points**parameters > MOST_GRID_MODELS:
        raise ConfigurationError(
            f"`points` must give at most {MOST_GRID_MODELS} models; got {points}, which gives {points}^{parameters}."
        )
    if not (np.isfinite([low, high]).all() and low < high):
        raise ConfigurationError(f"`low` must be below `high`, both finite; got {low} and {high}.")
    axes = np.meshgrid(*[np.linspace(low, high, points)] * parameters, indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, parameters)


def decide(judged_genuine: np.ndarray) -> np.ndarray:
    """Decide about individuals: "model" only if all judgments say so, "agent" (True) otherwise.

    Parameters
    ----------
    judged_genuine : (..., S)
        Judgments of the S samples of an individual.

    Source
    ------
    Paper, section 4.4.
    """
    return np.any(judged_genuine, axis=-1)


def post_evaluate(
    classifier: Classifier,
    genomes: np.ndarray,
    scenario: Scenario,
    models: np.ndarray,
    *,
    trials: int = 10,
    seed: int = 0,
    threads: int | None = None,
) -> PostEvaluation:
    """Let classifiers decide about the agents and replicas of many swarms.

    A replica executes each model among agents, in several trials from initial poses that are common to all models and
    classifiers. A classifier judges each individual once a trial, and decides that it is a model only if all
    judgments say so. The trials do not depend on the classifiers: each is simulated once, in blocks of models that all
    classifiers judge, so that memory does not grow with the number of models.

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

    Raises
    ------
    ConfigurationError
        If a shape or number does not fit.

    Source
    ------
    Paper, section 4.4.
    """
    require_at_least(1, trials=trials)
    models = checked_models("models", models, scenario)
    genomes = np.asarray(genomes)
    if genomes.ndim != 2 or not len(genomes):
        raise ConfigurationError(f"`genomes` must have the shape (N, Q), N >= 1; got {genomes.shape}.")
    as_agents = np.zeros((len(genomes), 2), dtype=np.int64)  # numbers of agents and replicas
    for samples in _blocks(scenario, models, trials, seed, threads):
        for start in range(0, len(genomes), GENOMES):
            part = slice(start, start + GENOMES)
            as_agents[part] += _count_agents(classifier, genomes[part], samples, scenario.agents)
    shares = as_agents / (len(models) * np.array([scenario.agents, scenario.replicas]))
    return PostEvaluation(sensitivity=1 - shares[:, 1], specificity=shares[:, 0])


def _blocks(
    scenario: Scenario, models: np.ndarray, trials: int, seed: int, threads: int | None
) -> Iterator[np.ndarray]:
    """Yield samples (individuals, models of the block, trials, T, D)."""
    rng = stream(seed, POST_EVALUATION)
    poses = initial_poses(scenario, trials, rng)
    keys = rng.integers(0, 2**64, size=(len(models), trials), dtype=np.uint64)
    size = _block_size(scenario, trials)
    for start in range(0, len(models), size):
        block = models[start : start + size]
        starts = np.repeat(poses[None], len(block), axis=0)
        yield observe_models(scenario, block, starts, keys[start : start + size], threads)


def _block_size(scenario: Scenario, trials: int) -> int:
    bytes_of_model = 8 * scenario.individuals * trials * scenario.control_steps * len(scenario.input_scale)
    return max(1, BLOCK_BYTES // bytes_of_model)


def _count_agents(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray, agents: int) -> np.ndarray:
    """Return the numbers (N, 2) of agents and of replicas that are decided to be agents."""
    individuals, models, trials, *series = samples.shape
    outputs = classifier.judge(genomes, samples.reshape(-1, *series))
    decisions = decide((outputs >= THRESHOLD).reshape(len(genomes), individuals, models, trials))
    counts = decisions.sum(axis=2)
    return np.stack([counts[:, :agents].sum(axis=1), counts[:, agents:].sum(axis=1)], axis=1)
