"""Built-in agents that answer to stimuli: one that responds to light, a robot that does not know its sensors."""

from dataclasses import dataclass

import numpy as np

from ..models import Parameter

DARK, BRIGHT = 0.4, 0.6
"""Light below the one is darkness, from the other on it is bright, of 0 to 1; ours."""
LAST = 3  # of the states, from 0 on; ours
NOISE_CM_S = 0.3  # of the speed that is seen; ours

ARENA_CM, RADIUS_CM, WHEEL_DISTANCE_CM, SPEED_CM_S, INTERVAL_S = 100.0, 3.5, 5.1, 12.8, 0.1
"""Robot and interval: the paper's, section 4.2; sides of the square arena: ours."""
OBSTACLES = np.array(
    [[30.0, 30.0, 8.0], [70.0, 40.0, 6.0], [45.0, 72.0, 10.0]]
)  # x, y, radius (cm); ours
NOISE_CM = 0.3  # of a reading; ours
ANGLES = (0.297, 1.571, -0.855)
"""Of three of the e-puck's eight infrared sensors (Mondada et al. 2009, 17, 90 and -49 degrees)."""
RANGES_CM = (30.0, 20.0, 12.0)  # ours


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
        (number, near), light, count = state, stimulus[:, 0], len(stimulus)
        right = np.where(number % 2 == 0, light < DARK, light >= BRIGHT)
        if self.stochastic:
            climbs = right & (rng.random(count) < parameters[:, LAST + 1])
        else:
            near = near + parameters[:, LAST + 1]
            climbs = right & (near >= 1 - 1e-9)
        number = np.where(right, np.minimum(number + climbs, LAST), 0)
        near = np.where(right & ~climbs, near, 0)
        speeds = parameters[
            np.arange(count), number.astype(np.int64)
        ] + NOISE_CM_S * rng.standard_normal(count)
        return np.stack((number, near)), speeds[:, None]


LIGHT_PARAMETERS = {f"speed{k}": Parameter(0, 10, unit="cm/s") for k in range(LAST + 1)} | {
    "readiness": Parameter(0.05, 1)
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
        (x, y, heading), (left, right) = state, stimulus.T * SPEED_CM_S
        heading = heading + (right - left) / WHEEL_DISTANCE_CM * INTERVAL_S / 2
        forward = (left + right) / 2 * INTERVAL_S
        x, y = _pushed_out(x + forward * np.cos(heading), y + forward * np.sin(heading))
        heading = heading + (right - left) / WHEEL_DISTANCE_CM * INTERVAL_S / 2
        angles = heading[:, None] + parameters[:, ::2]
        free = _free_path(x[:, None], y[:, None], np.cos(angles), np.sin(angles))
        readings = np.minimum(free, parameters[:, 1::2]) + NOISE_CM * rng.standard_normal(
            free.shape
        )
        return np.stack((x, y, heading)), readings


def _pushed_out(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (n,) moved to the nearest place where the robot overlaps neither obstacles nor walls."""
    for center_x, center_y, radius in OBSTACLES:
        dx, dy = x - center_x, y - center_y
        factor = np.maximum(1.0, (radius + RADIUS_CM) / np.maximum(np.hypot(dx, dy), 1e-9))
        x, y = center_x + dx * factor, center_y + dy * factor
    low, high = RADIUS_CM, ARENA_CM - RADIUS_CM
    return np.clip(x, low, high), np.clip(y, low, high)


def _free_path(x: np.ndarray, y: np.ndarray, c: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Return how far rays from (x, y) along (c, s) go before they meet a wall or an obstacle (cm)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        walls = [
            (np.where(way > 0, ARENA_CM, 0.0) - place) / way for place, way in ((x, c), (y, s))
        ]
    free = np.minimum(
        *(np.where(way == 0, np.inf, wall) for way, wall in zip((c, s), walls, strict=True))
    )
    for center_x, center_y, radius in OBSTACLES:
        dx, dy = center_x - x, center_y - y
        ahead, square = dx * c + dy * s, radius**2 - (dx * s - dy * c) ** 2
        entry = ahead - np.sqrt(np.maximum(square, 0.0))
        free = np.where((square > 0) & (ahead > 0), np.minimum(free, entry), free)
    return free


SENSOR_PARAMETERS = {
    f"{what}{k}": Parameter(-np.pi, np.pi, unit="rad")
    if what == "angle"
    else Parameter(5, 50, unit="cm")
    for k in range(1, 4)
    for what in ("angle", "range")
}
SENSOR_TRUTH = tuple(value for pair in zip(ANGLES, RANGES_CM, strict=True) for value in pair)
