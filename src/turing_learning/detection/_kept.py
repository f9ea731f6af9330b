"""Motion that a run has kept to calibrate detectors with."""

import zipfile
import zlib
from pathlib import Path

import numpy as np

from turing_learning._files import whole
from turing_learning.analysis import mean_absolute_error

from ._simulated import NEAR

CALIBRATION_FILE = "calibration.npz"
MOST = 1000  # samples of each kind
MODELS = 200


def keep_observed(
    path: Path,
    *,
    learned: np.ndarray,
    held_out: np.ndarray,
    replicas: np.ndarray,
    models: np.ndarray,
    estimate: np.ndarray,
) -> Path | None:
    """Write samples that a run has observed in a laboratory to ``calibration.npz`` in its folder.

    Genuine ones as `write_calibration` wants them; as abnormal ones those of the first models that are not near the estimate:
    they are nearly random.

    Parameters
    ----------
    path
        The run folder.
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
    Path or None
        The file; None if there is not enough of one kind.
    """
    far = replicas[mean_absolute_error(models, estimate) >= NEAR][:MODELS]
    count = min(len(learned), len(held_out), MOST)
    if count < 2 or len(far) == 0:
        return None
    genuine = np.concatenate((spread(learned, count), spread(held_out, count)))
    return write_calibration(path, genuine, far)


def spread(samples: np.ndarray, count: int) -> np.ndarray:
    """Return `count` of the samples, evenly spread."""
    return samples[np.linspace(0, len(samples) - 1, count).round().astype(int)]


def write_calibration(path: Path, genuine: np.ndarray, abnormal: np.ndarray) -> Path:
    """Write motion to ``calibration.npz`` in a run folder, and return the file.

    Parameters
    ----------
    path
        The run folder.
    genuine : (S, T, D)
        Samples of the system: the first half weighs the votes, the second, which nothing has learned from, says what scores are
        usual.
    abnormal : (S, T, D)
        Samples of what is not the system.
    """
    target = path / CALIBRATION_FILE
    with whole(target) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, genuine=genuine, abnormal=abnormal)
    return target


def stored_calibration(path: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """Return genuine and abnormal motion (individuals, 1, T, D) of a run folder; None if there is none."""
    try:
        with np.load(path / CALIBRATION_FILE, allow_pickle=False) as archive:
            return archive["genuine"][:, None], archive["abnormal"][:, None]
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile, zlib.error):
        return None
