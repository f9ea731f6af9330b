"""Built-in agents that answer to stimuli: one that responds to light, a robot that does not know its sensors."""

from dataclasses import dataclass

import numpy as np

from ..models import Parameter

DARK = 0.4


BRIGHT = 0.6
"""Light below `DARK`, of 0 to 1, is darkness; from `BRIGHT` on it is bright. Both are ours."""


HIGHEST = 3
"""State of the light's agent in which it stays while it is bright; states begin with 0. Ours."""
NOISE_CM_S = 0.3
"""Standard deviation of an observed speed; ours."""

ARENA_CM = 100.0
"""Side of the square arena; ours."""


RADIUS_CM = 3.5


WHEEL_DISTANCE_CM = 5.1


SPEED_CM_S = 12.8


INTERVAL_S = 0.1
"""Robot and control interval: the paper's, section 4.2."""
OBSTACLES = np.array([[30.0, 30.0, 8.0], [70.0, 40.0, 6.0], [45.0, 72.0, 10.0]])
"""x, y and radius (cm) of disks; ours."""
NOISE_CM = 0.3
"""Standard deviation of a reading; ours."""
ANGLES = (0.297, 1.571, -0.855)
"""Of three of the e-puck's eight infrared sensors (Mondada et al. 2009, 17, 90 and -49 degrees)."""
RANGES_CM = (30.0, 20.0, 12.0)
"""Of these sensors; ours."""


@dataclass(frozen=True)
class LightResponse:
    """Speed of an agent with states 0 to 3, which it climbs where darkness and bright light follow each other at the right time.

    In the states 0 and 2 it waits for darkness, in 1 and 3 for bright light. In other light it
    falls back to state 0. In the right light a stochastic agent climbs with the probability
    `readiness` in each step; a deterministic one gets nearer to the next state by the share
    `readiness`. In state 3 it stays while it is bright. `speed0` to `speed3` are its speeds in the
    states, measured with noise.

    Source: Li, Gauci and Gross (2013), Gross, Gu, Li and Gauci (2017): that the interrogator
    controls the light, that the agent moves in one dimension and answers through internal states,
    deterministic or stochastic. States and numbers are ours.
    """

    stochastic: bool = False

    def initial(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return states (2, n): the number of the state, and how near the next one is."""
        return np.zeros((2, count))

    def __call__(
        self,
        state: np.ndarray,
        parameters: np.ndarray,
        stimulus: np.ndarray,
        rng: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the next states and the speeds (n, 1) of agents with parameters (n, 5) in light (n, 1)."""
        number, nearness = state
        light = stimulus[:, 0]
        count = len(light)
        readiness = parameters[:, HIGHEST + 1]
        is_right = np.where(number % 2 == 0, light < DARK, light >= BRIGHT)
        if self.stochastic:
            climbs = is_right & (rng.random(count) < readiness)
        else:
            nearness = nearness + readiness
            climbs = is_right & (nearness >= 1 - 1e-9)
        number = np.where(is_right, np.minimum(number + climbs, HIGHEST), 0)
        nearness = np.where(is_right & ~climbs, nearness, 0)
        speeds = parameters[np.arange(count), number.astype(np.int64)]
        speeds = speeds + NOISE_CM_S * rng.standard_normal(count)
        return np.stack((number, nearness)), speeds[:, None]


LIGHT_PARAMETERS = {
    "speed0": Parameter(0, 10, unit="cm/s"),
    "speed1": Parameter(0, 10, unit="cm/s"),
    "speed2": Parameter(0, 10, unit="cm/s"),
    "speed3": Parameter(0, 10, unit="cm/s"),
    "readiness": Parameter(0.05, 1),
}
LIGHT_TRUTH = (2.0, 6.0, 1.0, 8.0, 0.3)
"""Ours."""


class SensorConfiguration:
    """Readings of three distance sensors of a differential-wheeled robot whose wheels the interrogator drives.

    A reading is the distance (cm) from the center of the robot to the nearest wall or obstacle in
    the sensor's direction, and the sensor's range where that is less, with noise. Walls and
    obstacles stop the robot. Trials begin anywhere, in any direction. Source: Gross, Gu, Li and
    Gauci (2017), where a robot infers its own sensors so; the numbers: see this module.
    """

    def initial(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return poses (3, n) anywhere but in obstacles."""
        x, y = rng.uniform(RADIUS_CM, ARENA_CM - RADIUS_CM, (2, count))
        return np.stack((*_pushed_out(x, y), rng.uniform(-np.pi, np.pi, count)))

    def __call__(
        self,
        state: np.ndarray,
        parameters: np.ndarray,
        stimulus: np.ndarray,
        rng: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the next poses and the readings (n, 3) of robots with parameters (n, 6) and wheel speeds (n, 2)."""
        x, y, heading = state
        left, right = stimulus.T * SPEED_CM_S
        # Half of the turn before the way, half after it.
        half_turn = (right - left) / WHEEL_DISTANCE_CM * INTERVAL_S / 2
        heading = heading + half_turn
        forward = (left + right) / 2 * INTERVAL_S
        x, y = _pushed_out(x + forward * np.cos(heading), y + forward * np.sin(heading))
        heading = heading + half_turn
        angles = heading[:, None] + parameters[:, ::2]
        ranges = parameters[:, 1::2]
        free = _free_path(x[:, None], y[:, None], np.cos(angles), np.sin(angles))
        noise = NOISE_CM * rng.standard_normal(free.shape)
        return np.stack((x, y, heading)), np.minimum(free, ranges) + noise


def _pushed_out(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (n,) moved to the nearest place where the robot overlaps neither obstacles nor walls."""
    for center_x, center_y, radius in OBSTACLES:
        offset_x = x - center_x
        offset_y = y - center_y
        distance = np.maximum(np.hypot(offset_x, offset_y), 1e-9)
        factor = np.maximum(1.0, (radius + RADIUS_CM) / distance)
        x = center_x + offset_x * factor
        y = center_y + offset_y * factor
    low = RADIUS_CM
    high = ARENA_CM - RADIUS_CM
    return np.clip(x, low, high), np.clip(y, low, high)


def _free_path(x: np.ndarray, y: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Return how far rays from (x, y) go before they meet a wall or an obstacle (cm)."""
    free = np.minimum(_to_wall(x, cosine), _to_wall(y, sine))
    for center_x, center_y, radius in OBSTACLES:
        offset_x = center_x - x
        offset_y = center_y - y
        # The center of the obstacle is so far along the ray, and half of the chord that the ray
        # cuts is the root of this square.
        along = offset_x * cosine + offset_y * sine
        square = radius**2 - (offset_x * sine - offset_y * cosine) ** 2
        entry = along - np.sqrt(np.maximum(square, 0.0))
        meets = (square > 0) & (along > 0)
        free = np.where(meets, np.minimum(free, entry), free)
    return free


def _to_wall(position: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return how far rays go before they meet one of the two walls across an axis."""
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (np.where(direction > 0, ARENA_CM, 0.0) - position) / direction
    return np.where(direction == 0, np.inf, distance)


SENSOR_PARAMETERS = {
    "angle1": Parameter(-np.pi, np.pi, unit="rad"),
    "range1": Parameter(5, 50, unit="cm"),
    "angle2": Parameter(-np.pi, np.pi, unit="rad"),
    "range2": Parameter(5, 50, unit="cm"),
    "angle3": Parameter(-np.pi, np.pi, unit="rad"),
    "range3": Parameter(5, 50, unit="cm"),
}
SENSOR_TRUTH = (ANGLES[0], RANGES_CM[0], ANGLES[1], RANGES_CM[1], ANGLES[2], RANGES_CM[2])
