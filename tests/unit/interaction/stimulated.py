"""A system with stimuli of ten lines, in a module that another process can import."""

import numpy as np

PARAMETERS = {"rate": (0, 1), "gain": (0, 5)}
TRUTH = {"rate": 0.1, "gain": 2.0}
STIMULATED = {"stimulus": {"light": (0, 1)}, "signals": ("speed",), "steps": 30}


def eye(state, parameters, stimulus, rng):
    """Answer to the difference between the light and the light that the eye is used to."""
    (rate, gain), light, used_to = parameters.T, stimulus[:, 0], state[:, 0]
    speed = gain * (light - used_to) + 0.05 * rng.standard_normal(len(light))
    return (used_to + rate * (light - used_to))[:, None], speed[:, None]


def living_eye(state, stimulus, rng):
    """Answer as an eye does whose parameters nobody gives."""
    return eye(state, np.tile(list(TRUTH.values()), (len(stimulus), 1)), stimulus, rng)
