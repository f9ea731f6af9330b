"""Robots in a simulator that owns its time: pymunk here, in the same way Webots, ARGoS or Gazebo; see docs/robots/any-robot.md.

`pip install turing-learning pymunk`, then `python simulator.py runs/simulated 60` for 60 trials.
"""

import math
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pymunk

from turing_learning.robots import LABORATORY, load_laboratory, supervise
from turing_learning.runs import start_laboratory

FILE = Path(__file__).parent / "simulator.toml"
SPEED_CM_S, AXLE_CM, RADIUS_CM = 12.8, 5.1, 3.7  # as [scenario.robot] in the laboratory's file
WALL_CM = 3.0  # a robot whose edge is nearer than this to a wall avoids it


class Discs:
    """Robots on two wheels that push each other, between four walls: a `Simulator`."""

    def __init__(self, robots: int, width_cm: float, height_cm: float, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self._size = (width_cm, height_cm)
        self._space = pymunk.Space()
        corners = [(0, 0), (width_cm, 0), (width_cm, height_cm), (0, height_cm), (0, 0)]
        for start, end in pairwise(corners):
            self._space.add(pymunk.Segment(self._space.static_body, start, end, 0.1))
        self._bodies = []
        for _ in range(robots):
            body = pymunk.Body(mass=150.0, moment=pymunk.moment_for_circle(150.0, 0.0, RADIUS_CM))
            body.position = tuple(rng.uniform(10.0, (width_cm - 10.0, height_cm - 10.0)))
            body.angle = rng.uniform(-math.pi, math.pi)
            self._space.add(body, pymunk.Circle(body, RADIUS_CM))
            self._bodies.append(body)

    def step(self, dt_s: float, wheels: np.ndarray) -> np.ndarray:
        for body, (left, right) in zip(self._bodies, SPEED_CM_S * wheels, strict=True):
            body.velocity = pymunk.Vec2d.from_polar((left + right) / 2, body.angle)
            body.angular_velocity = (right - left) / AXLE_CM
        self._space.step(dt_s)
        return np.array([(*body.position, body.angle) for body in self._bodies])

    def sights(self) -> list[int]:
        return [self._sees(body) for body in self._bodies]

    def _sees(self, body: pymunk.Body) -> int:
        ahead = pymunk.Vec2d.from_polar(1.0, body.angle)
        hit = self._space.segment_query_first(
            body.position + 1.01 * RADIUS_CM * ahead,
            body.position + 500 * ahead,
            0,
            pymunk.ShapeFilter(),
        )
        return int(hit is not None and hit.shape.body is not self._space.static_body)

    def proximity(self) -> list[list[int]]:
        """Return what an e-puck's front sensors, the first, second, seventh and eighth, read of a wall ahead."""
        readings = []
        for body in self._bodies:
            ahead = body.position + (RADIUS_CM + WALL_CM) * pymunk.Vec2d.from_polar(1.0, body.angle)
            inside = all(0 < place < side for place, side in zip(ahead, self._size, strict=True))
            front = 60 if inside else 1000
            readings.append([front, front, 60, 60, 60, 60, front, front])
        return readings


if __name__ == "__main__":
    out, trials = sys.argv[1:]
    laboratory = load_laboratory(FILE, {"run.trials": int(trials)})
    robots = len(laboratory.setup.robots)
    simulator = Discs(robots, float(LABORATORY.arena.width_cm), float(LABORATORY.arena.height_cm))
    result = start_laboratory(laboratory, out, equipment=supervise(laboratory, simulator))
    print(result)
