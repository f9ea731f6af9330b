"""Robots that a network drives: Elman networks from the sensor reading to the wheel speeds.

In each control cycle the network of such a robot writes its outputs where a reactive robot has the wheel speeds of the present
reading. All that follows, from the noise of the wheels to the contacts, is the same for both kinds.
"""

import math
from typing import NamedTuple

import numpy as np

from .compile import inlined
from .world import State


class Networks(NamedTuple):
    """K networks of H hidden neurons, the robots that they drive, and what those remember."""

    weights: np.ndarray  # (K, Q), laid out as in `models.ElmanModel`
    driver: np.ndarray  # (R, A) int64, the network that drives each robot; -1 for a reactive one
    memory: np.ndarray  # (slots, A, 2 H) activations of the hidden neurons, and room for the next ones


def new_networks(weights: np.ndarray, driver: np.ndarray, hidden: int) -> Networks:
    """Return networks without memory, which each thread has for itself."""
    return Networks(weights, driver, np.zeros((0, driver.shape[1], 2 * hidden)))


def with_memory(networks: Networks, slots: int) -> Networks:
    """Return the networks with room for `slots` trials side by side."""
    return networks._replace(memory=np.zeros((slots, *networks.memory.shape[1:])))


@inlined
def logistic(z: float) -> float:
    """Return the logistic sigmoid."""
    return 1.0 / (1.0 + math.exp(-z))


@inlined
def respond(reading: float, weights: np.ndarray, memory: np.ndarray, outputs: np.ndarray) -> None:
    """Advance a network by a time step: memory (2 H) and, from -1 to 1, the outputs (2,)."""
    hidden = memory.shape[0] // 2
    recurrent, biases = hidden, hidden + hidden * hidden
    output = biases + hidden
    for j in range(hidden):
        z = weights[biases + j] + weights[j] * reading
        for k in range(hidden):
            z += weights[recurrent + j * hidden + k] * memory[k]
        memory[hidden + j] = logistic(z)
    for j in range(hidden):
        memory[j] = memory[hidden + j]
    for side in range(2):
        z = weights[output + 2 * hidden + side]
        for j in range(hidden):
            z += weights[output + side * hidden + j] * memory[j]
        outputs[side] = 2.0 * logistic(z) - 1.0


@inlined
def drive(block: int, controllers: np.ndarray, state: State, networks: Networks) -> None:
    """Let the networks write the wheel speeds of the present readings into the controllers of the robots that they drive."""
    for w in range(state.crowd.shape[0]):
        for i in range(networks.driver.shape[1]):
            network = networks.driver[block + w, i]
            if network >= 0:
                reading = state.reading[i, w]
                outputs = controllers[block + w, i, 2 * reading : 2 * reading + 2]
                respond(float(reading), networks.weights[network], networks.memory[w, i], outputs)
