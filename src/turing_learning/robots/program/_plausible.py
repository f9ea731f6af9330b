"""Whether tracks can be those of the robots that were sent the models: wrong headings, wrong lengths, exchanged robots.

A robot on two wheels moves along its heading, and a replica's wheels turn as its model says in one of the sensor's
states. What is compared needs no threshold of a robot: how often steps of a replica's track are those of its model,
and how much more often than those of the models of other trials.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import pdist

from turing_learning.robots.tracking._tracker import Track, signed_speeds
from turing_learning.swarm import Robot
from turing_learning.trajectories import wrap

WINDOW = 10  #: Trials that are looked at together, the last ones
LEAST_TRIALS = 4  #: Before which nothing is said
LEAST_STEPS = 150  #: Steps of robots that move, before anything is said of headings
#: Share of the largest speed from which on a step shows a direction, beyond the tracker's noise
MOVING = 0.25
#: Mean resultant length from which on directions agree; 0 for any directions, 1 for equal ones
COHERENT = 0.6
INCOHERENT = 0.35  #: And below which they do not
#: Angle between headings and directions that no marker glued on by hand has
OFFSET_RAD = math.radians(25.0)
STILL_RAD = 0.02  #: Change of a heading in a trial below which it is frozen
#: Difference of wheel speeds, as fractions of the maximum, within which a step is that of a model
SAME_MODEL = 0.12
#: Share of steps, in excess of chance, from which on a track is that of a model
SPECIFIC = 0.25
#: Mean excess over all replicas from which on a supposed mistake (metres, mirrored axes, ...) is taken for the true one
SURE = 0.3
#: Excess below which a track is not that of its model
NONE = 0.1
METRES, INCH, MILLIMETRES = 0.01, 1 / 2.54, 10.0  #: Lengths that are given for a cm
Wheels = np.ndarray


def _same(wheels: Wheels) -> Wheels:
    return wheels


def _reversed(wheels: Wheels) -> Wheels:
    return -wheels[..., ::-1]


def _mirrored(wheels: Wheels) -> Wheels:
    return wheels[..., ::-1]


IN_METRES = "positions look like metres. Give them in cm."
_MISTAKES: Mapping[str, tuple[Callable[[Wheels], Wheels], float]] = {
    "headings look reversed: robots that were sent forward move backward. Turn the markers.": (
        _reversed,
        1.0,
    ),
    "positions and headings look mirrored: robots turn to the wrong side. Check the axes.": (
        _mirrored,
        1.0,
    ),
    IN_METRES: (_same, METRES),
    "positions look like inches. Give them in cm.": (_same, INCH),
    "positions look like millimetres. Give them in cm.": (_same, MILLIMETRES),
}
"""What may be wrong -> how wheel speeds that were seen become those that were executed, and the unit of lengths."""


@dataclass(frozen=True)
class _Seen:
    """What a trial has shown: displacements, headings midway and their changes of A individuals, T steps each."""

    along: np.ndarray  # (A, T), displacements' directions (rad)
    heading: np.ndarray  # (A, T), rad, midway
    raw: np.ndarray  # (A, T), headings at the beginning of the steps, as they are
    moving: np.ndarray  # (A, T), whether the direction is certain
    turned: np.ndarray  # (A,), by how much headings changed in all (rad)
    speeds: np.ndarray  # (A, T, 2), cm/s, rad/s
    valid: np.ndarray  # (A, T)
    models: np.ndarray  # (R, P), wheel speeds


class TrackCheck:
    """Look at trials one after the other: `fault` says what is wrong with poses or addresses, in words for the operator.

    Parameters
    ----------
    robot
        Its largest speed and the distance of its wheels.
    replicas
        Names of the replicas, the last individuals of a track.
    """

    def __init__(self, robot: Robot, replicas: Sequence[str]) -> None:
        self._robot = robot
        self._replicas = tuple(replicas)
        self._trials: deque[_Seen] = deque(maxlen=WINDOW)

    def fault(self, track: Track, models: np.ndarray) -> str:
        """Add a trial with models (R, P) that were sent to the replicas; return what is wrong, nothing if that is not certain."""
        if not track.has_headings:
            return ""
        if self._too_near(track):
            return IN_METRES
        self._trials.append(self._seen(track, models))
        if len(self._trials) < LEAST_TRIALS:
            return ""
        return self._wrong_headings() or self._wrong_robots()

    def _too_near(self, track: Track) -> bool:
        """Say whether most robots lie in each other, as if a metre were a cm; robots that push each other do not.

        This is seen at once, before somebody is asked to free robots that hardly move.
        """
        first = track.poses[0, track.present[0], :2]
        return len(first) > 2 and bool(np.median(pdist(first)) < self._robot.radius_cm / 2)

    def _seen(self, track: Track, models: np.ndarray) -> _Seen:
        poses = track.poses
        steps = np.diff(poses[..., :2], axis=0)
        turns = wrap(np.diff(poses[..., 2], axis=0))
        valid = track.present[1:] & track.present[:-1]
        length = np.hypot(steps[..., 0], steps[..., 1])
        moving = valid & (length > MOVING * self._robot.maximum_speed_cm_s * track.interval_s)
        return _Seen(
            along=np.arctan2(steps[..., 1], steps[..., 0]).T,
            heading=(poses[:-1, :, 2] + turns / 2).T,
            raw=poses[:-1, :, 2].T,
            moving=moving.T,
            turned=np.abs(np.where(valid, turns, 0.0)).sum(axis=0),
            speeds=signed_speeds(poses, track.interval_s),
            valid=valid.T,
            models=models,
        )

    def _wrong_headings(self) -> str:
        """Hold headings against displacements: these lie along them, or against them."""
        # Models differ from trial to trial: not all of them let a replica drive straight.
        if max(trial.turned.max() for trial in self._trials) < STILL_RAD:
            return "headings look frozen: nobody's has changed in any trial. Check the tracker."
        moving = np.concatenate([trial.moving.ravel() for trial in self._trials])
        if moving.sum() < LEAST_STEPS:
            return ""
        along = np.concatenate([trial.along.ravel() for trial in self._trials])[moving]
        heading = np.concatenate([trial.heading.ravel() for trial in self._trials])[moving]
        # Twice the angle: forward and backward are the same
        between = np.exp(2j * (along - heading)).mean()
        if abs(between) >= COHERENT:
            offset = float(np.angle(between)) / 2
            if abs(offset) < OFFSET_RAD:
                return ""
            degrees = 5 * round(abs(math.degrees(offset)) / 5)
            return f"headings are off by about {degrees} degrees from where robots drive. Check markers and axes."
        if abs(between) > INCOHERENT:
            return ""
        raw = np.concatenate([trial.raw.ravel() for trial in self._trials])[moving]
        if abs(np.exp(2j * (along - np.radians(raw))).mean()) >= COHERENT:
            return "headings look like degrees. Give them in radians."
        if abs(np.exp(2j * (along + heading)).mean()) >= COHERENT:
            return "headings look mirrored: robots that turn left seem to turn right. Check the direction of the axes."
        return ""

    def _wrong_robots(self) -> str:
        """Hold tracks against the models that were sent."""
        replicas = range(len(self._replicas))
        agents = self._trials[0].speeds.shape[0] - len(self._replicas)
        same = [self._specific(replica, [agents + replica]) for replica in replicas]
        for text, (repair, length) in _MISTAKES.items():
            repaired = []
            for replica in replicas:
                share = self._specific(replica, [agents + replica], repair, length)
                repaired.append(share)
            if np.mean(repaired) >= SURE and np.mean(same) < np.mean(repaired) / 2:
                return text
        for replica in replicas:
            if same[replica] >= NONE:
                continue
            name = self._replicas[replica]
            for candidate in replicas:
                if candidate == replica:
                    continue
                if self._specific(replica, [agents + candidate]) >= SPECIFIC:
                    culprit = self._replicas[candidate]
                    diagnosis = f"replica {culprit} executes what replica {name} was sent"
                    return f"{diagnosis}. Exchange their addresses, or their markers."
            if self._specific(replica, range(agents)) >= SPECIFIC:
                return f"an agent executes what replica {name} was sent. Exchange their markers, or their addresses."
        return ""

    def _specific(
        self,
        replica: int,
        individuals: Sequence[int],
        repair: Callable[[Wheels], Wheels] = _same,
        length: float = 1.0,
    ) -> float:
        """Return how much larger a share of steps is that of the model sent to a replica than of its models in other trials.

        The mean over trials; of the individual whose share is largest in each.
        """
        differences = []
        for trial in self._trials:
            wheels = repair(wheel_speeds(trial.speeds[individuals], self._robot, length))
            valid = trial.valid[individuals]
            share_here = _shares(wheels, valid, trial.models[replica]).max()
            shares_elsewhere = []
            for another in self._trials:
                if another is not trial:
                    shares = _shares(wheels, valid, another.models[replica])
                    shares_elsewhere.append(shares.max())
            differences.append(share_here - np.mean(shares_elsewhere))
        return float(np.mean(differences))


def wheel_speeds(speeds: np.ndarray, robot: Robot, length: float = 1.0) -> Wheels:
    """Return the wheel speeds (A, T, 2), fractions of the maximum, of speeds (A, T, 2) in units of `length` (cm)."""
    linear = speeds[..., 0] / length
    half = speeds[..., 1] * robot.wheel_distance_cm / 2
    return np.stack([linear - half, linear + half], axis=-1) / robot.maximum_speed_cm_s


def _shares(wheels: Wheels, valid: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return the share of each individual's steps (A,) that are those of a model (2 n,) in one of its n states."""
    states = model.reshape(-1, 2)
    apart = np.linalg.norm(wheels[:, :, None] - states, axis=-1).min(axis=-1)
    steps = np.maximum(valid.sum(axis=1), 1)
    return (valid & (apart < SAME_MODEL)).sum(axis=1) / steps
