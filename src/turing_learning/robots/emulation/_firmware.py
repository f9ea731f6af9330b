"""The program of the robots: the states R1 to R5, and the two behaviors that need infrared sensors.

Source: paper, sections 5.1.2 and 5.2. How the robots disperse and avoid walls is only in the paper's
supplement; the rules here are ours (docs/robots/arena.md).
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from ._emulated_robot import EmulatedRobot

LOOP = {"R1": 1.0, "R2": 8.0, "R3": 1.0, "R4": 1.0, "R5": 7.0}  #: States and how long they last (s)
_AFTER = dict(zip(LOOP, (*tuple(LOOP)[1:], "R1"), strict=True))
_SIGNALS = {"R1": "STOP", "R4": "START"}
SENSOR_ANGLES = np.radians([-17.0, -47.0, -90.0, -151.0, 151.0, 90.0, 47.0, 17.0])
"""Directions of the eight infrared sensors, from the heading, anticlockwise (rad); from the front right one clockwise."""
OBSTACLE = 120  #: Least infrared reading at which a dispersing robot turns: walls at about 5 cm, black skirts at 1 cm
WALL = 400  #: Infrared reading that only a wall causes, nearer than 2 cm: a black skirt does not, even when it touches
_AHEAD, _ALONG = math.cos(math.radians(75)), math.cos(math.radians(100))
_ANYWHERE_S = (0.0, 1.25)  # up to once around in place, at full speed
_AWAY_S = (0.2, 0.8)
_TICK = 1e-9
ALONE_S = 2.0
"""A replica whose PC says that it is there stands when it has not heard it for so long; its loop continues."""
MOST_LOOPS = 5  #: A replica that its PC has asked nothing for so many loops halts, and waits for the remote control
Wheels = tuple[float, float]  #: Left and right wheel speed, fractions of the maximum
STILL: Wheels = (0.0, 0.0)


def is_in_the_way(proximity: Sequence[int], threshold: int, least: float, forward: float = 1.0) -> bool:
    """Return whether the strongest reading reaches a threshold, at a sensor that points where the robot goes.

    `least` is the cosine of the widest angle from there that counts; `forward` is negative for a robot that drives backward.
    """
    strongest = int(np.argmax(proximity))
    toward = math.copysign(1.0, forward) * math.cos(SENSOR_ANGLES[strongest])
    return proximity[strongest] >= threshold and toward > least


def avoid_walls(wheels: Wheels, proximity: Sequence[int]) -> Wheels:
    """Return the wheel speeds, or a turn in place while a wall is in front of the robot or beside it.

    The robot continues to turn to the same side, so that it leaves the wall on the arc on which it would have
    come; one that drives straight turns anticlockwise. A robot that turns in place, as the agents do when
    they see another, goes on turning, and so does one that meets a robot: its skirt is too dark.
    """
    left, right = wheels
    if left + right == 0 or not is_in_the_way(proximity, WALL, _ALONG, left + right):
        return wheels
    return (-1.0, 1.0) if right >= left else (1.0, -1.0)


class Firmware:
    """Lead a robot, which holds the state and the models, through its loop; `rng` is that of dispersal.

    An agent has a `controller`, wheel speeds (2 n) for each sensor state; without one this is a replica,
    which executes the models that it receives. Both call `signal` with START and STOP.
    """

    def __init__(
        self, robot: EmulatedRobot, rng: np.random.Generator, *, controller: tuple[float, ...] | None = None,
        signal: Callable[[str], None] = lambda kind: None,
    ) -> None:  # fmt: skip
        self._robot, self._rng, self._controller, self._signal = robot, rng, controller, signal
        self._until = 0.0
        self._turn_until, self._side = 0.0, 1.0
        self._stood = False  # in this trial, for want of the PC

    def start(self, time_s: float) -> None:
        """Begin the loop, anew if it runs: the remote control was pressed."""
        self._stood = False
        self._enter("R1", time_s)

    def step(self, time_s: float, sight: int, proximity: Sequence[int], manual: Wheels = STILL) -> Wheels:
        """Return the wheel speeds of a control cycle at a time by the robot's own clock.

        `sight` is the reading I of the line-of-sight sensor, `proximity` (8,) are infrared readings, `manual` the wheel speeds
        that the PC has commanded, executed before the loop has begun.
        """
        if self._robot.called:
            self._robot.called = False
            self.start(time_s)
        if self._robot.state not in LOOP:
            return manual
        while time_s >= self._until - _TICK:
            self._enter(_AFTER[self._robot.state], self._until)
        if self._controller is None and self._robot.unasked_s > MOST_LOOPS * sum(LOOP.values()):
            self._robot.halt()
        if self._robot.alone_s > ALONE_S:
            self._stood |= self._robot.state == "R5"
            return STILL
        if self._robot.state == "R2":
            return self._disperse(time_s, proximity)
        return self._execute(sight, proximity) if self._robot.state == "R5" else STILL

    def _enter(self, state: str, time_s: float) -> None:
        self._robot.enter(state)
        self._until = time_s + LOOP[state]
        if state == "R2":
            self._turn(time_s, _ANYWHERE_S)
        if state in _SIGNALS and not self._stood:
            self._signal(_SIGNALS[state])
        self._stood &= state == "R5"

    def _turn(self, time_s: float, lasting_s: tuple[float, float]) -> None:
        """Turn in place from now on, to either side."""
        self._turn_until = time_s + self._rng.uniform(*lasting_s)
        self._side = float(self._rng.choice((-1.0, 1.0)))

    def _disperse(self, time_s: float, proximity: Sequence[int]) -> Wheels:
        """Turn to a random direction; then drive straight, and turn for a while where anything is in the way."""
        if time_s >= self._turn_until and is_in_the_way(proximity, OBSTACLE, _AHEAD):
            self._turn(time_s, _AWAY_S)
        return (-self._side, self._side) if time_s < self._turn_until else (1.0, 1.0)

    def _execute(self, sight: int, proximity: Sequence[int]) -> Wheels:
        model = self._robot.executing
        table = self._controller or (model.parameters if model is not None else ())
        wheels = table[2 * sight : 2 * sight + 2]
        return avoid_walls((wheels[0], wheels[1]), proximity) if len(wheels) == 2 else STILL
