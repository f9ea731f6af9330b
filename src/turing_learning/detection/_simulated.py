"""Motion to calibrate detectors with: of a simulated scenario, a laboratory, or a custom system."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from turing_learning.analysis import mean_absolute_error
from turing_learning.arrays import array
from turing_learning.config import ConfigurationError
from turing_learning.errors import LARGEST_COUNT, integer, number
from turing_learning.models import Behavior, Parameter
from turing_learning.purposes import DETECTION
from turing_learning.swarm import AGENT, Scenario, Trials, mixed
from turing_learning.systems import Source, SystemFailedError

from ._motion import Motion

NORMAL_WITHIN = 0.2
"""Controllers whose mean absolute difference from the agents' is below this are not called abnormal."""
OBSERVED_SAMPLES = 1000
"""Samples of a half of the genuine motion that a run keeps to calibrate with, at most."""
RANDOM_MODELS = 200
"""Random models whose motion a run keeps as abnormal, at most."""
# Uses of random numbers: each has a stream of its own. Results of stored runs depend on these numbers.
CALIBRATION = 0
PLANTING = 2
OWN_CALIBRATION = 4
JURORS = 5
ALIKE = 6
CASES = 7
_LOGGER = logging.getLogger("turing_learning")


@dataclass(frozen=True, eq=False)
class SimulatedBehaviors:
    """Motion (individuals, samples, T, D) of agents and of abnormal individuals among them."""

    genuine: np.ndarray
    abnormal: np.ndarray


def stream(seed: int, purpose: int) -> np.random.Generator:
    integer("seed", seed, 0, error=ConfigurationError)
    return np.random.default_rng((DETECTION, seed, purpose))


def random_controllers(
    scenario: Scenario, count: int, rng: np.random.Generator, *, near: float = NORMAL_WITHIN
) -> np.ndarray:
    """Draw controllers (count, P) uniformly from [-1, 1], without those nearly the agents'.

    Parameters
    ----------
    near
        Least mean absolute difference from the agents' controller, in [0, 0.5].
    """
    integer("count", count, 1, LARGEST_COUNT, error=ConfigurationError)
    number("near", near, least=0, most=0.5, error=ConfigurationError)
    return _unlike(np.asarray(scenario.controller), count, rng, near)


def _unlike(
    model: np.ndarray, count: int, rng: np.random.Generator, least_error: float = NORMAL_WITHIN
) -> np.ndarray:
    """Draw models (count, P) uniformly from [-1, 1], without those whose error from a model (P,) is below `least_error`."""
    unlike = np.empty((0, len(model)))
    while len(unlike) < count:
        drawn = rng.uniform(-1, 1, (count, len(model)))
        unlike = np.concatenate((unlike, drawn[mean_absolute_error(drawn, model) >= least_error]))
    return unlike[:count]


def simulate_behaviors(
    scenario: Scenario, controllers: np.ndarray, *, trials: int = 10, rng: np.random.Generator,
    threads: int | None = None,
) -> SimulatedBehaviors:  # fmt: skip
    """Simulate agents among whom replicas execute something else, a swarm for each controller.

    Source: paper, sections 4.2 and 4.4.

    Parameters
    ----------
    controllers : (M, P)
        What the replicas execute.
    trials
        Number of trials of each swarm, >= 1, each from new initial poses: the samples of an
        individual.
    """
    controllers = array(
        "controllers", controllers, "M P", error=ConfigurationError, P=len(scenario.controller)
    )
    integer("trials", trials, 1, LARGEST_COUNT // len(controllers), error=ConfigurationError)
    drawn = Trials.draw(scenario, mixed(scenario, len(controllers), trials), rng)
    swarms = by_individual(drawn.observe(Behavior(controllers), threads), trials)
    genuine = swarms[:, : scenario.agents]
    abnormal = swarms[:, scenario.agents :]
    shape = (-1, *swarms.shape[2:])
    return SimulatedBehaviors(genuine.reshape(shape), abnormal.reshape(shape))


def by_individual(speeds: np.ndarray, trials: int) -> np.ndarray:
    """Return what was observed, (M x trials, A, T, D), by individual: (M, A, trials, T, D)."""
    return speeds.reshape(-1, trials, *speeds.shape[1:]).swapaxes(1, 2)


def plant_abnormal(
    scenario: Scenario, count: int, *, samples: int = 10, seed: int = 0, threads: int | None = None
) -> Motion:
    """Simulate a swarm in which `count` individuals execute random controllers.

    Individuals, named "agent 1", ..., "planted 1", ..., are in random order; each sample is a trial
    from new initial poses.
    """
    integer("samples", samples, 1, LARGEST_COUNT, error=ConfigurationError)
    size = scenario.individuals
    remedy = f"The swarm has {size} individuals."
    integer("simulate", count, 1, size - 1, remedy=remedy, error=ConfigurationError)
    rng = stream(seed, PLANTING)
    controllers = random_controllers(scenario, count, rng)
    agents = size - count
    executed = np.append(np.full(agents, AGENT), np.arange(count))
    trials = Trials.draw(scenario, np.repeat(executed[None], samples, axis=0), rng)
    speeds = trials.observe(Behavior(controllers), threads).swapaxes(0, 1)
    names = [f"agent {k + 1}" for k in range(agents)]
    names += [f"planted {k + 1}" for k in range(count)]
    order = rng.permutation(size)
    return Motion(tuple(names[k] for k in order), speeds[order])


def observed_calibration(
    *,
    learned: np.ndarray,
    held_out: np.ndarray,
    replicas: np.ndarray,
    models: np.ndarray,
    estimate: np.ndarray,
) -> dict[str, np.ndarray] | None:
    """Return what ``calibration.npz`` shall hold of samples (any, T, D) from a laboratory.

    Of "genuine" samples the first half weighs votes, and the second says what scores are usual:
    agents that the run `learned` from, and `held_out` after it. "abnormal" are `replicas` (M, T, D)
    of the first of its models (M, P), which are nearly random, that are not near the estimate (P,).
    None if one kind is missing.
    """
    abnormal = replicas[mean_absolute_error(models, estimate) >= NORMAL_WITHIN][:RANDOM_MODELS]
    count = min(len(learned), len(held_out), OBSERVED_SAMPLES)
    if count < 2 or len(abnormal) == 0:
        return None
    genuine = np.concatenate((_spread(learned, count), _spread(held_out, count)))
    return {"genuine": genuine, "abnormal": abnormal}


def _spread(samples: np.ndarray, count: int) -> np.ndarray:
    """Return `count` of the samples, evenly spread."""
    return samples[np.linspace(0, len(samples) - 1, count).round().astype(int)]


def simulated_calibration(
    source: Source, parameters: Mapping[str, Parameter], estimate: np.ndarray, seed: int
) -> dict[str, np.ndarray] | None:
    """Return what ``calibration.npz`` shall hold of a system, and of random models of it.

    Models are drawn from the initial ranges without those near the estimate (P,), in the
    parameters' units. None if fewer than two samples were held out, or the simulations fail.
    """
    rng = stream(seed, OWN_CALIBRATION)
    # the run is over
    source.generation = None
    try:
        data = source.genuine
        assert data is not None
        genuine = source.genuine_samples(1, rng)[: 2 * OBSERVED_SAMPLES]
        if data.live is None:
            held_out = data.testing[:OBSERVED_SAMPLES]
            genuine = np.concatenate((_spread(data.learning, len(held_out)), held_out))
        if len(genuine) < 4:
            return None
        pairs = zip(parameters.values(), estimate, strict=True)
        numbers = np.array(
            [float(parameter.to_numbers(np.array(value))) for parameter, value in pairs]
        )
        models = _unlike(numbers, RANDOM_MODELS, rng)
        samples = source.simulate(source.to_units(models), rng)
    except (SystemFailedError, ValueError) as error:
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", error)
        return None
    return {"genuine": genuine, "abnormal": samples[:, 0]}
