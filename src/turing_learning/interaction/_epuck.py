"""An e-puck that does not know its sensors, and whose wheels the interrogator drives.

Source of the numbers: the group's public code (repository wawachen/Turing_learning, folders
TL_source, TL_interactive and TL_passive, 2019), and the Enki simulator (commit bb486bf), of which
the equations were taken and no code. See docs/decisions/0052-the-published-interrogation.md.
"""

from dataclasses import dataclass

import numpy as np

from ..kernels.court import LEFT, Court, Infrared, drive, read, to_walls_of
from ..models import Parameter

SPEED_CM_S = 12.8
"""Of a wheel of the e-puck at full speed; noise does not get it above this."""
WHEEL_NOISE = 0.05
"""Each speed is multiplied by a number uniform in 1 - 0.05 to 1 + 0.05, in every cycle anew."""
FIELD = Court(
    side=50.0,
    radius=3.7,
    post_radius=1.85,
    wheel_distance=5.1,
    step_s=0.01,
    steps=10,
    bounce=0.81,
    wall_bounce=0.9,
    dry_friction=0.25 * 9.81,
    viscous_friction=0.01,
)
"""The arena; contacts and friction are Enki's, whose gravity is 9.81 in its centimetres."""
GRID_CM = (12.5, 25.0, 37.5)
"""x, and y, of the nine posts."""
INFRARED = Infrared(
    range=12.0, peak=3731.0, x0=0.3, c=0.7, aperture=np.pi / 12, noise=10.0, full=3000.0
)
"""Enki's infrared sensor of the e-puck, and what the public code divides its values by."""
ANGLES_DEG = (-18.0, -45.0, -90.0, -142.0, 142.0, 90.0, 45.0, 18.0)
"""Directions of the e-puck's sensors."""
POSITIONS_CM = ((3.35, 1.05), (2.3, 2.6), (0.0, 3.3), (3.0, 1.8))
"""Distances of four of them from the robot's center along its axes; the other four mirror them."""
LONGEST_CM = 200.0
"""Distance at which the answer of the rangefinder is that to infinity."""


@dataclass
class Robots:
    """States of n robots; each step changes them."""

    robots: np.ndarray  # (n, 6), see kernels.court
    posts: np.ndarray  # (n, K, 4)
    cycles: int = 0
    mounts: np.ndarray | None = None  # (n, 8, 4)
    answers: np.ndarray | None = None  # what the robot's own controller reacts to


@dataclass(frozen=True)
class EPuck:
    """A robot alone among posts: it starts anywhere, in any direction, at rest.

    A cycle passes between a reading and the motion that it causes: what is chosen after the reading
    of a cycle is commanded at the end of the next one. The wheels stand still in the first two
    cycles.
    """

    posts: bool

    def initial(self, count: int, rng: np.random.Generator) -> Robots:
        """Return robots anywhere, over posts, too: contacts push these away."""
        robots = np.zeros((count, 6))
        robots[:, :2] = rng.uniform(FIELD.radius, FIELD.side - FIELD.radius, (count, 2))
        robots[:, 2] = rng.uniform(-np.pi, np.pi, count)
        grid = np.zeros((0, 4))
        if self.posts:
            x, y = np.meshgrid(GRID_CM, GRID_CM)
            grid = np.stack((x.ravel(), y.ravel(), 0 * x.ravel(), 0 * x.ravel()), axis=1)
        return Robots(robots, np.tile(grid, (count, 1, 1)))

    def move(self, state: Robots, stimulus: np.ndarray, rng: np.random.Generator) -> None:
        """Advance robots by a cycle, at whose end the wheels take over the stimulus (n, 2)."""
        drive(state.robots, state.posts, FIELD)
        noise = rng.uniform(1 - WHEEL_NOISE, 1 + WHEEL_NOISE, stimulus.shape)
        # What is chosen before the first reading is never done.
        if state.cycles > 0:
            commands = np.clip(SPEED_CM_S * stimulus * noise, -SPEED_CM_S, SPEED_CM_S)
            state.robots[:, LEFT:] = commands
        state.cycles += 1


class InfraredSensors(EPuck):
    """Readings of eight infrared sensors, whose directions and distances from the center are inferred.

    A sensor lies in its direction from the center. Readings are 0 to 1, of three rays each.
    """

    def __init__(self) -> None:
        super().__init__(posts=True)

    def __call__(
        self, state: Robots, parameters: np.ndarray, stimulus: np.ndarray, rng: np.random.Generator
    ) -> tuple[Robots, np.ndarray]:
        """Return the next states and the readings (n, 8) of robots with parameters (n, 16)."""
        if state.mounts is None:
            state.mounts = _mounts(parameters)
        self.move(state, stimulus, rng)
        noise = rng.standard_normal((len(stimulus), len(ANGLES_DEG)))
        readings = np.empty_like(noise)
        read(state.robots, state.posts, state.mounts, noise, readings, FIELD, INFRARED)
        state.answers = readings
        return state, readings

    def own(self, state: Robots, parameters: np.ndarray) -> np.ndarray:
        """Return what a robot does that avoids obstacles by what its sensors say (n, 2).

        Source: the public code, where this is commented out. It turns away from the side of the
        larger readings, the more, the larger their sum is ahead.
        """
        if state.answers is None or state.mounts is None:
            return np.zeros((len(state.robots), 2))
        ahead = (state.answers * state.mounts[:, :, 2]).sum(axis=1)
        left = (state.answers * state.mounts[:, :, 3]).sum(axis=1)
        urge = np.where(ahead > 0, np.minimum(np.hypot(ahead, left), 1.0), 0.0)
        forward = 0.8 * (1 - urge)
        turning = np.sign(left) * urge
        return np.clip(np.stack((forward + turning, forward - turning), axis=1), -1, 1)


def _mounts(parameters: np.ndarray) -> np.ndarray:
    """Return positions and directions (n, 8, 4) of sensors with angles and displacements (n, 16)."""
    angles, displacements = np.split(parameters, 2, axis=1)
    direction = np.stack((np.cos(angles), np.sin(angles)), axis=2)
    return np.concatenate((displacements[..., None] * direction, direction), axis=2)


class RangefinderResponse(EPuck):
    """Answer of one distance sensor ahead, without noise, in an arena without posts.

    The answer is gain x + offset, where x is the distance (cm) from the robot to the wall over 200.
    """

    def __init__(self) -> None:
        super().__init__(posts=False)

    def __call__(
        self, state: Robots, parameters: np.ndarray, stimulus: np.ndarray, rng: np.random.Generator
    ) -> tuple[Robots, np.ndarray]:
        """Return the next states and the answers (n, 1) of robots with parameters (n, 2)."""
        self.move(state, stimulus, rng)
        distances = np.empty(len(stimulus))
        to_walls_of(state.robots, distances, FIELD)
        state.answers = distances
        gain, offset = parameters.T
        return state, (gain * np.minimum(distances / LONGEST_CM, 1.0) + offset)[:, None]

    def own(self, state: Robots, parameters: np.ndarray) -> np.ndarray:
        """Return what a robot does that turns where gain x + offset is at most 11, x in cm (n, 2).

        Source: the public code, where the robot drives at 6.4 cm/s, and turns on the spot at 8.4.
        """
        if state.answers is None:
            return np.zeros((len(state.robots), 2))
        gain, offset = parameters.T
        is_near = gain * state.answers + offset <= 11.0
        left = np.where(is_near, -8.4, 6.4) / SPEED_CM_S
        right = np.where(is_near, 8.4, 6.4) / SPEED_CM_S
        return np.stack((left, right), axis=1)


INFRARED_PARAMETERS = {f"angle{k}": Parameter(-np.pi, np.pi, unit="rad") for k in range(1, 9)} | {
    f"displacement{k}": Parameter(0, FIELD.radius, unit="cm") for k in range(1, 9)
}
_RIGHT_CM = tuple(float(np.hypot(*position)) for position in POSITIONS_CM)
INFRARED_TRUTH = (*np.radians(ANGLES_DEG).tolist(), *_RIGHT_CM, *_RIGHT_CM[::-1])
"""The e-puck's sensors, each moved into its direction."""
RANGEFINDER_PARAMETERS = {"gain": Parameter(-np.pi, np.pi), "offset": Parameter(0, 3.7)}
RANGEFINDER_TRUTH = (2.0, 1.0)
