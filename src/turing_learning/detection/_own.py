"""Motion by which detectors of a run on a custom system are calibrated."""

import logging
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from turing_learning.models import Parameter
from turing_learning.systems import Source, SystemFailedError, cut_samples

from ._kept import MODELS, MOST, spread, write_calibration
from ._simulated import NEAR, OWN_CALIBRATION, stream

_LOGGER = logging.getLogger("turing_learning")


def keep_calibration(
    path: Path, source: Source, parameters: Mapping[str, Parameter], estimate: np.ndarray, seed: int
) -> Path | None:
    """Write held-out samples of a system, and samples of random models of it, to ``calibration.npz`` in a run folder.

    The first half of the genuine samples are some that the run learned from, to weigh votes; the second half those that were
    held out, to place the threshold. Random models are drawn from the initial ranges without those near the estimate.

    Parameters
    ----------
    path
        The run folder.
    source, parameters
        Of the run; the source has genuine samples.
    estimate : (P,)
        In the parameters' units.
    seed
        Of the run.

    Returns
    -------
    Path or None
        The file; None if fewer than two samples were held out, or the simulations fail.
    """
    rng = stream(seed, OWN_CALIBRATION)
    source.generation = None  # the run is over
    try:
        genuine = _genuine(source, rng)
        if len(genuine) < 4:
            return None
        samples = source.simulate(source.to_units(_random_numbers(parameters, estimate, rng)), rng)
    except (SystemFailedError, ValueError) as error:
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", error)
        return None
    return write_calibration(path, genuine, samples[:, 0])


def _genuine(source: Source, rng: np.random.Generator) -> np.ndarray:
    data = source.genuine
    assert data is not None
    if data.live is not None:
        return cut_samples(data.live(rng), data.samples.shape[1])[: 2 * MOST]
    held_out = data.testing[:MOST]
    return np.concatenate((spread(data.learning, len(held_out)), held_out))


def _random_numbers(parameters: Mapping[str, Parameter], estimate: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    pairs = zip(parameters.values(), estimate, strict=True)
    near = np.array([float(parameter.to_numbers(np.array(value))) for parameter, value in pairs])
    found = np.empty((0, len(near)))
    while len(found) < MODELS:
        drawn = rng.uniform(-1, 1, (MODELS, len(near)))
        found = np.concatenate((found, drawn[np.abs(drawn - near).mean(axis=1) >= NEAR]))
    return found[:MODELS]
