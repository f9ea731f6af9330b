"""The rules of the room's doors that several of its files share."""

from collections.abc import Callable
from typing import Any

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.swarm import Scenario


def checked_models(name: str, models: Any, scenario: Scenario) -> np.ndarray:
    """Return models (M, P) of a scenario, M >= 1, as floats; refuse what is not that."""
    models = np.asarray(models, dtype=np.float64)
    parameters = len(scenario.controller)
    if models.ndim != 2 or models.shape[1] != parameters or not len(models):
        raise ConfigurationError(
            f"`{name}` must have the shape (M, P) = (1 or more, {parameters}); got {models.shape}."
        )
    if not np.isfinite(models).all():
        place = int(np.argwhere(~np.isfinite(models))[0, 0])
        raise ConfigurationError(f"`{name}` must be finite; got {models[place].tolist()} at {place}.")
    return models


def checked_motion(
    name: str, motion: Any, *, signals: int, steps: int | None = None, where: Callable[[int], str] = str
) -> np.ndarray:
    """Return motion (individuals, samples, T, D) as floats; refuse what is not that, is empty, or not finite."""
    motion = np.asarray(motion)
    wanted = f"(individuals, samples, T, D) = (any, any, {steps or 'any'}, {signals})"
    fits = motion.ndim == 4 and motion.size and motion.shape[3] == signals and steps in (None, motion.shape[2])
    if not fits or motion.dtype.kind not in "fiu":
        raise ConfigurationError(
            f"`{name}` must be real numbers of shape {wanted}, not empty; got {motion.dtype} of shape {motion.shape}. "
            "A classifier is calibrated for samples of one length."
        )
    if not np.isfinite(motion).all():
        individual, *rest = (int(k) for k in np.argwhere(~np.isfinite(motion))[0])
        place = "sample {}, step {}, signal {}".format(*rest)
        raise ConfigurationError(
            f"`{name}` must be finite; got {motion[individual, *rest]} [individual {where(individual)}, {place}]. "
            "Leave such samples out."
        )
    return motion.astype(np.float64, copy=False)
