"""Whether tracks can be those of the robots that were sent the models: wrong headings, wrong lengths, exchanged robots.

A robot on two wheels moves along its heading, and a replica's wheels turn as its model says in one of the sensor's
states. What is compared needs no threshold of a robot: how often steps of a replica's track are those of its model,
and how much more often than those of the models of other trials.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.spatial.distance import pdist

from turing_learning.robots.tracking._tracker import Track, room_around, signed_speeds
from turing_learning.swarm import Arena, Robot
from turing_learning.trajectories import wrap

WINDOW = 10  #: Trials that are looked at together, the last ones
LEAST_TRIALS = 4  #: Before which nothing is said
TRIALS_OF_ONE = 7  #: And before which nothing is said of one replica alone
LEAST_STEPS = 150  #: Steps of robots that move, before anything is said of headings
#: Share of the largest speed from which on a step shows a direction, beyond the tracker's noise
MOVING = 0.25
#: Mean resultant length from which on directions agree; 0 for any directions, 1 for equal ones
COHERENT = 0.6
INCOHERENT = 0.35  #: And below which they do not
#: Angle between headings and directions that no marker glued on by hand has
OFFSET_RAD = math.radians(25.0)
STILL_RAD = 0.02  #: Change of a heading in a trial below which it is frozen
#: Steps in which a course has a direction, and between which it may turn
STRETCHES = (5, 12, 25)
BEND_RAD = 0.6  #: Turn of a course that headings follow, unless they are frozen
CERTAIN_TURN_ERRORS = 4.0  #: Standard errors of a turn of a course, from which on it is one
#: Turn of most headings meanwhile, below which they are frozen, whatever their noise
FROZEN_RAD = 0.1
LEAST_BENDS = 10  #: Courses that turn, before anything is said of them
#: Mean resultant length below which headings that never change are not those of robots that drive straight
DRIVEN = 0.98
#: Difference of wheel speeds, as fractions of the maximum, within which a step is that of a model
SAME_MODEL = 0.12
#: Share of steps, in excess of chance, from which on a track is that of a model
SPECIFIC = 0.25
#: Mean excess over all replicas from which on a supposed mistake (metres, mirrored axes, ...) is taken for the true one
SURE_EXCESS = 0.3
#: Excess below which a track is not that of its model
NONE = 0.1
#: Share of the states of a replica's models, in excess of those of other trials, from which on these differ enough
DIFFERENT = 0.5
#: Shares of the configured speed that robots may have
SPEED_SHARES = (0.4, 0.5, 0.6, 0.7, 0.8, 1.0, 1.2, 1.5, 2.0)
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


_MISTAKES_OF_ONE: Mapping[str, Callable[[Wheels], Wheels]] = {
    "moves backward where it was sent forward. Turn its marker.": _reversed,
    "turns to the wrong side. Exchange its wheels.": _mirrored,
}
"""What may be wrong with one replica -> how wheel speeds that were seen become those that were sent."""

FROZEN = "headings look frozen: they do not follow where robots drive. Check the tracker."
UNCHANGED = "headings look frozen: nobody's has changed in any trial. Check the tracker."


@dataclass(frozen=True)
class _Seen:
    """What a trial has shown: displacements, headings midway and their changes of A individuals, T steps each."""

    along: np.ndarray  # (A, T), displacements' directions (rad)
    heading: np.ndarray  # (A, T), rad, midway
    raw: np.ndarray  # (A, T), headings at the beginning of the steps, as they are
    moving: np.ndarray  # (A, T), whether the direction is certain
    free: np.ndarray  # (A, T), whether it is, and nothing can have pushed the robot
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
    arena
        Whose walls may push robots.
    """

    def __init__(self, robot: Robot, replicas: Sequence[str], arena: Arena | None = None) -> None:
        self._robot = robot
        self._arena = arena
        self._replicas = tuple(replicas)
        self._trials: deque[_Seen] = deque(maxlen=WINDOW)
        self._count = 0

    def fault(self, track: Track, models: np.ndarray) -> str:
        """Add a trial with models (R, P) that were sent to the replicas; return what is wrong, nothing if that is not certain."""
        if not track.has_headings:
            return ""
        if self._too_near(track):
            return IN_METRES
        self._trials.append(self._seen(track, models))
        self._count += 1
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
        reach = self._robot.maximum_speed_cm_s * track.interval_s
        moving = valid & (length > MOVING * reach)
        free = room_around(poses[..., :2], self._robot, self._arena) > reach
        return _Seen(
            along=np.arctan2(steps[..., 1], steps[..., 0]).T,
            heading=(poses[:-1, :, 2] + turns / 2).T,
            raw=poses[:-1, :, 2].T,
            moving=moving.T,
            free=(moving & free[1:] & free[:-1]).T,
            turned=np.abs(np.where(valid, turns, 0.0)).sum(axis=0),
            speeds=signed_speeds(poses, track.interval_s),
            valid=valid.T,
            models=models,
        )

    def _wrong_headings(self) -> str:
        """Hold headings against displacements: these lie along them, or against them."""
        # Models differ from trial to trial: not all of them let a replica stand.
        unchanged = max(trial.turned.max() for trial in self._trials) < STILL_RAD
        moving = np.concatenate([trial.moving.ravel() for trial in self._trials])
        if moving.sum() < LEAST_STEPS:
            return UNCHANGED if unchanged else ""
        all_along = np.concatenate([trial.along.ravel() for trial in self._trials])
        all_headings = np.concatenate([trial.heading.ravel() for trial in self._trials])
        # Twice the angle: forward and backward are the same
        beside = np.exp(2j * (all_along - all_headings))
        free = np.concatenate([trial.free.ravel() for trial in self._trials])
        driven = moving
        if free.sum() >= LEAST_STEPS:
            driven = free
        if (unchanged and abs(beside[driven].mean()) < DRIVEN) or self._frozen():
            return FROZEN
        between = beside[moving].mean()
        along = all_along[moving]
        heading = all_headings[moving]
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

    def _frozen(self) -> bool:
        """Say whether headings stay as they are, but for noise, where courses turn."""
        followed = []
        for trial in self._trials:
            for steps in STRETCHES:
                course, error = _directions(trial.along, trial.free, steps)
                heading, _ = _directions(trial.heading, trial.free, steps)
                turn = abs(np.angle(course[:, 1:] / course[:, :-1]))
                limit = np.maximum(
                    BEND_RAD, CERTAIN_TURN_ERRORS * np.hypot(error[:, 1:], error[:, :-1])
                )
                followed.append(abs(np.angle(heading[:, 1:] / heading[:, :-1]))[turn > limit])
        turns = np.concatenate(followed)
        return len(turns) >= LEAST_BENDS and bool(np.median(turns) < FROZEN_RAD)

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
            if np.mean(repaired) >= SURE_EXCESS and np.mean(same) < np.mean(repaired) / 2:
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
            if len(self._trials) < TRIALS_OF_ONE:
                continue
            if self._specific(replica, [agents + replica], trials_ago=1) >= SPECIFIC:
                return f"replica {name} executes the model before. Check when it takes one from its buffer."
        if len(self._trials) < TRIALS_OF_ONE:
            return ""
        for replica in replicas:
            others = [share for number, share in enumerate(same) if number != replica]
            if min(others, default=1.0) < NONE:
                continue
            for text, repair in _MISTAKES_OF_ONE.items():
                share = self._specific(replica, [agents + replica], repair)
                if share >= SURE_EXCESS and same[replica] < share / 2:
                    return f"replica {self._replicas[replica]} {text}"
        # Of the first trials alone: later ones have models that are alike
        if self._count != WINDOW:
            return ""
        obeying = []
        for replica in replicas:
            if same[replica] >= NONE or not self._disobeys(replica, agents + replica):
                obeying.append(self._replicas[replica])
        disobeying = [name for name in self._replicas if name not in obeying]
        remedy = "Check the tracker, programs, and [scenario.robot]."
        if not obeying:
            return f"no replica executes what it was sent. {remedy}"
        if disobeying:
            return f"replica {disobeying[0]} does not execute what it was sent. {remedy}"
        return ""

    def _disobeys(self, replica: int, individual: int) -> bool:
        """Say whether a replica that moves, in tracks without much noise, executes none of models that differ enough.

        It may be slower or faster than was said.
        """
        models = [trial.models[replica] for trial in self._trials]
        differences = []
        for model in models:
            states = model.reshape(1, -1, 2)
            every = np.ones(states.shape[:2], bool)
            # A model's own is among them
            known = [_shares(states, every, another)[0] for another in models]
            differences.append((len(models) - sum(known)) / (len(models) - 1))
        if np.mean(differences) < DIFFERENT:
            return False
        wheels = [
            wheel_speeds(trial.speeds[[individual]], self._robot)[0] for trial in self._trials
        ]
        # A quarter of the steps, at least, lie between two of the same sensor state
        noise = np.quantile(np.linalg.norm(np.diff(wheels, axis=1), axis=-1), 0.25)
        moves = (np.linalg.norm(wheels, axis=-1) > SAME_MODEL).sum() >= LEAST_STEPS
        if noise > SAME_MODEL or not moves:
            return False
        executed = []
        for scale in SPEED_SHARES:
            executed.append(self._specific(replica, [individual], partial(np.multiply, 1 / scale)))
        return max(executed) < NONE

    def _specific(
        self,
        replica: int,
        individuals: Sequence[int],
        repair: Callable[[Wheels], Wheels] = _same,
        length: float = 1.0,
        trials_ago: int = 0,
    ) -> float:
        """Return how much larger a share of steps is that of the model sent to a replica than of its models in other trials.

        The mean over trials; of the individual whose share is largest in each. `trials_ago` is 1 for the model of
        the trial before.
        """
        trials = list(self._trials)
        differences = []
        for number in range(trials_ago, len(trials)):
            trial, sent = trials[number], trials[number - trials_ago]
            wheels = repair(wheel_speeds(trial.speeds[individuals], self._robot, length))
            valid = trial.valid[individuals]
            share_here = _shares(wheels, valid, sent.models[replica]).max()
            shares_elsewhere = []
            for another in trials:
                if another is not sent:
                    shares = _shares(wheels, valid, another.models[replica])
                    shares_elsewhere.append(shares.max())
            differences.append(share_here - np.mean(shares_elsewhere))
        return float(np.mean(differences))


def _directions(angles: np.ndarray, free: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean directions (A, S), complex, of angles (A, T) in stretches of so many steps, and their errors (rad).

    The error is infinite where not all steps show a robot that drives where it will.
    """
    stretches = angles.shape[1] // steps
    shape = (len(angles), stretches, steps)
    cut = np.exp(1j * angles[:, : stretches * steps]).reshape(shape)
    whole = free[:, : stretches * steps].reshape(shape).all(axis=-1)
    mean = cut.mean(axis=-1)
    error = np.sqrt(-2 * np.log(np.clip(abs(mean), 1e-9, 1.0)) / steps)
    return mean, np.where(whole, error, np.inf)


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
