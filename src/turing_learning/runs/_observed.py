"""What a run in a laboratory keeps of the motion that it has observed, for detectors."""

import logging
from collections.abc import Sequence

import numpy as np

from turing_learning.detection import keep_observed
from turing_learning.store import RunFolderError

from ._folder import CALIBRATION, RunFolder
from ._post_evaluation import POST_EVALUATION, read_post_evaluation
from ._result import Result
from ._trials import read_trials

_LOGGER = logging.getLogger("turing_learning")


def keep_observed_motion(result: Result, folder: RunFolder) -> None:
    """Write ``calibration.npz``, see `detection.keep_observed`, once all last models have been observed again.

    Agents were learned from in the generations, and are held out in the post-evaluations.
    """
    again = read_post_evaluation(folder.path)
    if again is None or not again.complete:
        return
    try:
        learned, replicas, models = _motion(folder, [f"generation-{g:04d}" for g in range(result.generations)])
        held_out, _, _ = _motion(folder, [f"{POST_EVALUATION}{k + 1}" for k in range(again.repeats)])
    except RunFolderError as error:
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", error)
        return
    estimate = np.array(list(result.estimate.values()))
    with folder.storage():
        kept = keep_observed(learned=learned, held_out=held_out, replicas=replicas, models=models, estimate=estimate)
        if kept is not None:
            folder.write(CALIBRATION, kept)
    if kept is None:
        _LOGGER.warning(
            "Nothing is kept to calibrate detectors with: too few samples, or all models are near the estimate."
        )


def _motion(folder: RunFolder, stages: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return samples of agents (S, T, 2) and of replicas (M, T, 2), and their models (M, P), of all trials of some stages."""
    trials = [read_trials(folder.path, stage) for stage in stages]
    samples = [each.samples() for each in trials]
    return (
        np.concatenate([each.genuine for each in samples]),
        np.concatenate([each.counterfeit[:, 0] for each in samples]),
        np.concatenate([each.models.reshape(-1, each.models.shape[2]) for each in trials]),
    )
