"""Whether agents and replicas act at different phases of a control cycle, by which they can be told whatever they execute.

A robot that begins a control cycle between two images has, in that step of its track, a mixture of the wheel speeds of
two sensor states. The share of the new ones is its phase.
"""

from itertools import permutations

import numpy as np

from turing_learning.swarm import Robot

from ._plausible import wheel_speeds

#: Distance of wheel speeds, as fractions of the maximum, up to which a step is one of a sensor state, or a mixture
STATE_DISTANCE = 0.15
#: Distance of the wheel speeds of two states from which on mixtures show a phase
STATES_APART = 0.5
HARMONICS = np.arange(1, 4)  #: Of a cycle, in which distributions of phases are compared
#: Squared distance of two distributions of phases from which on intervals miss the truth
TOLD_DISTANCE = 0.05
#: The same where replicas show all phases evenly, so that models are compared at each of them
TELLING_OF_AGENTS = 0.4
#: What is added for n samples, divided by n, for what chance does
BY_CHANCE = 8.0
FEWEST_STATE_STEPS = 5  #: In a state, by which its wheel speeds are known better
FEWEST_SAMPLES = 30  #: Samples of replicas that show a phase, below which nothing is said


def told_by_phase(
    genuine: np.ndarray,
    agents: np.ndarray,
    counterfeit: np.ndarray,
    models: np.ndarray,
    robot: Robot,
) -> bool:
    """Say whether phases of agents and of replicas are distributed differently.

    Of robots that begin their cycles together, or at another phase in each trial, they are not.

    Parameters
    ----------
    genuine : (K, T, 2)
        Samples of agents: linear speed (cm/s), angular speed (rad/s).
    agents : (K, P)
        Their wheel speeds in each sensor state, as fractions of the maximum.
    counterfeit : (N, T, 2)
        Samples of replicas.
    models : (N, P)
        Their wheel speeds.
    robot
        Its largest speed and the distance of its wheels.
    """
    of_agents = _phases(wheel_speeds(genuine, robot), agents)
    of_replicas = _phases(wheel_speeds(counterfeit, robot), models)
    fewest = min(len(of_agents), len(of_replicas))
    if fewest < FEWEST_SAMPLES:
        return False
    limit = TOLD_DISTANCE + BY_CHANCE / fewest
    by_chance = _scatter(of_replicas)
    uneven = np.abs(of_replicas.mean(axis=0)) ** 2 - by_chance
    if _total(uneven) < limit:
        limit = TELLING_OF_AGENTS
    apart = np.abs(of_agents.mean(axis=0) - of_replicas.mean(axis=0)) ** 2
    return _total(apart - by_chance - _scatter(of_agents)) > limit


def _scatter(phases: np.ndarray) -> np.ndarray:
    """Return the squared distance (H,) that the mean of so many phases (S, H) has from the true one, on average."""
    return np.asarray((np.abs(phases) ** 2).mean(axis=0) / len(phases))


def _total(distances: np.ndarray) -> float:
    """Return the squared distance of two distributions, of those of their harmonics (H,)."""
    return float((distances / HARMONICS**2).sum())


def _phases(wheels: np.ndarray, models: np.ndarray) -> np.ndarray:
    """Return the mean phases (S', H), complex numbers, of those samples that show one.

    Of wheel speeds (S, T, 2) of models (S, P), for each harmonic.
    """
    states = _seen_states(wheels, models)
    sums = np.zeros((len(models), len(HARMONICS)), dtype=complex)
    steps = np.zeros(len(models))
    for old, new in permutations(range(states.shape[1]), 2):
        jump = states[:, new] - states[:, old]
        length = np.linalg.norm(jump, axis=-1)
        before, after = wheels[:, :-1] - states[:, old], wheels[:, 1:] - states[:, old]
        share = (after * jump).sum(axis=-1) / np.maximum(length, STATES_APART) ** 2
        aside = np.linalg.norm(after - share[..., None] * jump, axis=-1)
        shows = (
            (length > STATES_APART)
            & (np.linalg.norm(before, axis=-1) < STATE_DISTANCE)
            & (aside < STATE_DISTANCE)
        )
        # where nothing has changed yet, the robot may see what it saw
        shows &= (share * length > STATE_DISTANCE) & ((share - 1) * length < STATE_DISTANCE)
        phases = np.exp(2j * np.pi * share[..., None] * HARMONICS) * shows[..., None]
        sums += phases.sum(axis=1)
        steps += shows.sum(axis=1)
    shown = steps > 0
    return sums[shown] / steps[shown, None]


def _seen_states(wheels: np.ndarray, models: np.ndarray) -> np.ndarray:
    """Return the wheel speeds (S, n, 1, 2) that samples (S, T, 2) show in each state of their models (S, P).

    Wheels may be wrong by some per cent, and the models of agents are an estimate.
    """
    states = models.reshape(len(models), -1, 1, 2).copy()
    _, which = np.unique(models, axis=0, return_inverse=True)
    for model in range(which.max() + 1):
        samples = which == model
        for state in range(states.shape[1]):
            steps = wheels[samples].reshape(-1, 2)
            seen = steps[
                np.linalg.norm(steps - states[samples, state][0], axis=-1) < STATE_DISTANCE
            ]
            if len(seen) >= FEWEST_STATE_STEPS:
                states[samples, state] = np.median(seen, axis=0)
    return states
