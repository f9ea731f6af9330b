"""Motion that a run stores to calibrate detectors with: samples observed in a laboratory, or of a custom system."""

import logging
from collections.abc import Mapping

import numpy as np

from turing_learning.analysis import mean_absolute_error
from turing_learning.models import Parameter
from turing_learning.systems import Source, SystemFailedError, cut_samples

from ._simulated import NEAR, OWN_CALIBRATION, stream

CALIBRATION_FILE = "calibration.npz"
MOST = 1000  # samples of each kind
MODELS = 200
_LOGGER = logging.getLogger("turing_learning")


def keep_observed(
    *,
    learned: np.ndarray,
    held_out: np.ndarray,
    replicas: np.ndarray,
    models: np.ndarray,
    estimate: np.ndarray,
) -> dict[str, np.ndarray] | None:
    """Return what ``calibration.npz`` shall hold of samples that a run has observed in a laboratory.

    As abnormal ones those of the first models that are not near the estimate: they are nearly random.

    Parameters
    ----------
    learned, held_out : (S, T, D), (K, T, D)
        Samples of the agents, from the run and from after it.
    replicas : (M, T, D)
        Samples of the replicas, one of each model, the first models first.
    models : (M, P)
        What they executed.
    estimate : (P,)
        In the parameters' units.

    Returns
    -------
    dict or None
        "genuine" (S, T, D), of which the first half weighs the votes and the second says what scores are
        usual, and "abnormal" (S, T, D); None if there is not enough of one kind.
    """
    far = replicas[mean_absolute_error(models, estimate) >= NEAR][:MODELS]
    count = min(len(learned), len(held_out), MOST)
    if count < 2 or len(far) == 0:
        return None
    return {"genuine": np.concatenate((spread(learned, count), spread(held_out, count))), "abnormal": far}


def spread(samples: np.ndarray, count: int) -> np.ndarray:
    """Return `count` of the samples, evenly spread."""
    return samples[np.linspace(0, len(samples) - 1, count).round().astype(int)]


def keep_calibration(
    source: Source, parameters: Mapping[str, Parameter], estimate: np.ndarray, seed: int
) -> dict[str, np.ndarray] | None:
    """Return what ``calibration.npz`` shall hold: held-out samples of a system, and samples of random models of it.

    The first half of the genuine samples are some that the run learned from, to weigh votes; the second half those that were
    held out, to place the threshold. Random models are drawn from the initial ranges without those near the estimate.

    Parameters
    ----------
    source, parameters
        Of the run; the source has genuine samples.
    estimate : (P,)
        In the parameters' units.
    seed
        Of the run.

    Returns
    -------
    dict or None
        As in `keep_observed`; None if fewer than two samples were held out, or the simulations fail.
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
    return {"genuine": genuine, "abnormal": samples[:, 0]}


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
