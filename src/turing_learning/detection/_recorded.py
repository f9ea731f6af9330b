"""Recorded motion as the classifiers of a run want it."""

from dataclasses import dataclass, replace

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.systems import same_time_step
from turing_learning.trajectories import SIGNALS, Trajectories

from ._run import RunClassifiers


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """Windows of the motion of individuals, in order of time.

    Attributes
    ----------
    individuals
        Names (A,).
    samples : A arrays (W, T, D)
        Windows of each individual, without gaps and jumps; W differs, and may be 0.
    times : A arrays (W, 2)
        When each window begins and ends, from the first frame of the recording (s).
    duration_s
        Of the recording (s).
    """

    individuals: tuple[str, ...]
    samples: tuple[np.ndarray, ...]
    times: tuple[np.ndarray, ...]
    duration_s: float


def recorded_motion(recording: Trajectories, run: RunClassifiers) -> RecordedMotion:
    """Cut a recording into windows of the length and the signals that the classifiers of a run were evolved with.

    For a run without headings, those of the recording are left out of account.

    Parameters
    ----------
    recording
        What a tracker wrote, at the frame rate of the run.
    run
        From `run_classifiers`.

    Raises
    ------
    ConfigurationError
        If the run has other signals than a recording yields or does not know its time step, the recording has another frame
        rate, lacks headings that the run has, or is too short.
    """
    _check_signals(recording, run)
    _check_rate(recording, run)
    if run.headings == "without":
        recording = replace(recording, headings=None)
    try:
        windows = recording.windows(run.steps, signals=run.names, hold_out=0.0)
    except ValueError as error:
        if recording.every > 1:
            raise ConfigurationError(str(error)) from error
        raise ConfigurationError(
            f"`motion` must hold a window of {run.steps} steps ({run.steps / recording.fps:.4g} s) without gaps and jumps; "
            f"got {len(recording.positions)} frames, of which none does. Record for longer, or bridge gaps."
        ) from error
    who, first = windows.learning_index.T
    places = [np.flatnonzero(who == k) for k in range(len(recording.individuals))]
    return RecordedMotion(
        individuals=recording.individuals,
        samples=tuple(windows.learning[place] for place in places),
        times=tuple(np.stack((first[p], first[p] + run.steps), axis=1) / recording.fps for p in places),
        duration_s=recording.duration_s,
    )


def _check_signals(recording: Trajectories, run: RunClassifiers) -> None:
    unknown = [name for name in run.names if name not in SIGNALS]
    if unknown:
        raise ConfigurationError(
            f"`run` must have signals that a recording yields, {', '.join(SIGNALS)}; got {', '.join(unknown)}. "
            "Give motion in a .npy, .npz or .csv file, see docs/detection.md."
        )
    if run.headings == "with" and recording.headings is None:
        raise ConfigurationError(
            "`motion` must have headings, as the run has, whose speeds are negative backwards; got a recording without. Give one "
            "with headings, or motion in a .npy, .npz or .csv file, see docs/detection.md."
        )
    if recording.unit != "cm":
        raise ConfigurationError(f"`motion` must be in cm; got {recording.unit}. Say how many pixels are 1 cm.")


def _check_rate(recording: Trajectories, run: RunClassifiers) -> None:
    if run.interval_s == 0:
        raise ConfigurationError(
            "`run` must know its time step, as runs on windows of recorded motion do; got one on samples alone. "
            "Give motion in a .npy, .npz or .csv file, see docs/detection.md."
        )
    if not same_time_step(run.interval_s, 1 / recording.fps):
        raise ConfigurationError(
            f"`fps` must be that of the run, {1 / run.interval_s:.6g}; got {recording.fps:.6g}. Speeds and turns of another "
            "frame rate have other noise. Thin the faster recording, and infer again if that is the run's."
        )
