"""Decision accuracy of classifiers over a wide range of models (paper, section 4.4)."""

from collections.abc import Callable

import numpy as np

from turing_learning.coevolution import THRESHOLD, Classifier
from turing_learning.models import Behavior
from turing_learning.purposes import DETECTION
from turing_learning.swarm import Scenario, Trials, initial_poses, mixed

POST_EVALUATION = 3
"""Which of the random numbers of `DETECTION`."""
BLOCK_BYTES = 256_000_000
"""Of samples that are simulated and judged at once: they must fit into memory."""
CLASSIFIERS_AT_ONCE = 500
"""Classifiers that judge a block at once."""
FEW_UNDECIDED = 0.2
"""Share of undecided individuals below which a classifier judges these alone: to pick them out takes time, too."""
ALL = slice(None)


def grid_models(parameters: int, points: int) -> np.ndarray:
    """Return models (points^P, P) on a grid from -1 to 1, fractions of the maximum speed; the last parameter changes fastest."""
    axes = np.meshgrid(*[np.linspace(-1, 1, points)] * parameters, indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, parameters)


def count_agents(
    classifier: Classifier, genomes: np.ndarray, scenario: Scenario, models: np.ndarray, *, trials: int, seed: int,
    chunk: slice = ALL, threads: int | None = None, should_stop: Callable[[], bool] = lambda: False,
) -> np.ndarray | None:  # fmt: skip
    """Count the agents, and the replicas, that classifiers decide to be agents: (N, 2).

    A replica executes each model among agents, in several trials from initial poses that are common
    to all models and classifiers. A classifier judges each individual once a trial, and decides
    that it is a model only if all judgments say so.

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
    chunk
        Which of the models; the counts of chunks that cover all add up to those of all.
    threads
        Number of threads of the simulation; None takes every processor.
    should_stop
        Asked before every 500 classifiers; None is returned if it was stopped.
    """
    counts = np.zeros((len(genomes), 2), dtype=np.int64)
    individuals = scenario.individuals
    rng = np.random.default_rng((DETECTION, seed, POST_EVALUATION))
    poses = initial_poses(scenario, trials, rng)
    keys = rng.integers(0, 2**64, size=(len(models), trials), dtype=np.uint64)[chunk]
    models = models[chunk]
    bytes_of_model = 8 * individuals * trials * scenario.control_steps * len(scenario.input_scale)
    block_size = max(1, BLOCK_BYTES // bytes_of_model)
    for begin in range(0, len(models), block_size):
        block = models[begin : begin + block_size]
        block_keys = keys[begin : begin + block_size].ravel()
        starts = np.tile(poses, (len(block), 1, 1))
        swarms = Trials(scenario, mixed(scenario, len(block), trials), starts, block_keys)
        motion = swarms.observe(Behavior(block), threads).swapaxes(0, 1)
        # (individuals x models of the block, trials, T, D)
        samples = motion.reshape(-1, trials, *motion.shape[2:])
        # In groups, so that a stop is noticed in between.
        for start in range(0, len(genomes), CLASSIFIERS_AT_ONCE):
            if should_stop():
                return None
            chosen = slice(start, start + CLASSIFIERS_AT_ONCE)
            is_agent = _decided(classifier, genomes[chosen], samples)
            by_individual = is_agent.reshape(-1, individuals, len(block)).sum(axis=2)
            counts[chosen, 0] += by_individual[:, : scenario.agents].sum(axis=1)
            counts[chosen, 1] += by_individual[:, scenario.agents :].sum(axis=1)
    return counts


def decision_accuracies(counts: np.ndarray, scenario: Scenario, models: int) -> np.ndarray:
    """Return the decision accuracy (N,) of classifiers by what `count_agents` has counted in the swarms of all M models.

    It is the mean of sensitivity and specificity: 0.5 for a classifier that decides the same about
    all.
    """
    specificity = counts[:, 0] / (models * scenario.agents)
    sensitivity = 1 - counts[:, 1] / (models * scenario.replicas)
    return (sensitivity + specificity) / 2


def _decided(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return who of samples (K, trials, T, D) is an agent to each classifier (N, K), one trial after the other.

    Who has been judged genuine once is an agent, and is not judged again by that classifier.
    """
    is_agent = np.zeros((len(genomes), len(samples)), dtype=bool)
    for trial in range(samples.shape[1]):
        observed = np.ascontiguousarray(samples[:, trial])
        undecided = len(samples) - is_agent.sum(axis=1)
        many = undecided > FEW_UNDECIDED * len(samples)
        if many.any():
            is_agent[many] |= classifier.judge(genomes[many], observed) >= THRESHOLD
        for n in np.flatnonzero(~many & (undecided > 0)):
            pending = np.flatnonzero(~is_agent[n])
            judgments = classifier.judge(genomes[n : n + 1], observed[pending])[0]
            is_agent[n, pending] = judgments >= THRESHOLD
    return is_agent
