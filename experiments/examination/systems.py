"""Cheap systems, each with a model that is right and one that lacks a mechanism."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Simulator = Callable[[np.ndarray, np.random.Generator], np.ndarray]

STEPS = 40
STEP_S = 0.1


@dataclass(frozen=True)
class Case:
    """A system, what it is made of, and two models of it."""

    ranges: dict[str, tuple[float, float]]  #: Of the parameters of the models
    truth: tuple[float, ...]  #: Parameters of the system
    right: Simulator  #: (models (M, P), rng) -> samples (M, T, D)
    #: The system with a mechanism that `right` lacks, at the same parameters
    system: Simulator
    lacking: str  #: The mechanism


def persistent_walk(
    models: np.ndarray,
    rng: np.random.Generator,
    *,
    memory: float = 0.0,
    tracker: float = 0.0,
    gait: float = 0.0,
    wall: float = 0.0,
) -> np.ndarray:
    """Return speed and turn (M, T, 2) of walkers with a mean speed and a noise of the turns.

    `memory` is the correlation of successive turns, `tracker` the noise of positions (cm), `gait`
    the share by which the speed rises and falls within 0.8 s, `wall` half of the width of a square
    tank (cm), whose walls turn walkers towards the middle; 0: none.
    """
    count = len(models)
    mean, noise = models[:, 0], models[:, 1]
    heading = rng.uniform(-np.pi, np.pi, count)
    half = wall or 10.0
    position = rng.uniform(-half, half, (count, 2))
    phase = rng.uniform(0, 2 * np.pi, count)
    own = np.zeros(count)
    paths = [position]
    for step in range(STEPS + 1):
        own = memory * own + np.sqrt(1 - memory**2) * rng.normal(size=count)
        turn = noise * own
        if wall:
            outside = np.abs(position + np.stack((np.cos(heading), np.sin(heading)), 1)).max(1)
            inward = np.arctan2(-position[:, 1], -position[:, 0]) - heading
            inward = (inward + np.pi) % (2 * np.pi) - np.pi
            turn = turn + np.where(outside > half, 0.5 * inward, 0.0)
        heading = heading + turn
        rhythm = 1 + gait * np.sin(phase + 2 * np.pi * step * STEP_S / 0.8)
        speed = mean * np.exp(0.3 * rng.normal(size=count)) * rhythm
        position = position + speed[:, None] * STEP_S * np.stack(
            (np.cos(heading), np.sin(heading)), axis=1
        )
        paths.append(position)
    seen = np.stack(paths, axis=1)
    seen = seen + tracker * rng.normal(size=seen.shape)
    moved = np.diff(seen, axis=1)
    directions = np.arctan2(moved[..., 1], moved[..., 0])
    turns = (np.diff(directions, axis=1) + np.pi) % (2 * np.pi) - np.pi
    speeds = np.hypot(moved[..., 0], moved[..., 1]) / STEP_S
    return np.stack((speeds[:, 1:], turns / STEP_S), axis=-1)


def pair(
    models: np.ndarray, rng: np.random.Generator, *, alignment: float = 0.0, gap: float = 0.0
) -> np.ndarray:
    """Return speed, turn and distance of a neighbor (M, T, 3) of one of two that attract each other.

    The models have a speed, a noise of the turns and a strength of attraction. `alignment` is the
    share of the difference of headings that is turned away in a step; `gap` is a distance (cm)
    below which they repel each other.
    """
    count = len(models)
    mean, noise, strength = models[:, 0], models[:, 1], models[:, 2]
    position = rng.normal(0, 3, (count, 2, 2))
    heading = rng.uniform(-np.pi, np.pi, (count, 2))
    columns = []
    for step in range(STEPS + 20):
        away = position[:, ::-1] - position
        distance = np.hypot(away[..., 0], away[..., 1])
        bearing = np.arctan2(away[..., 1], away[..., 0]) - heading
        pull = strength[:, None] * np.sin(bearing)
        if gap:
            pull = np.where(distance < gap, -0.5 * np.sin(bearing), pull)
        other = heading[:, ::-1] - heading
        turn = pull + alignment * np.sin(other) + noise[:, None] * rng.normal(size=(count, 2))
        heading = heading + turn
        speed = mean[:, None] * np.exp(0.2 * rng.normal(size=(count, 2)))
        position = position + speed[..., None] * STEP_S * np.stack(
            (np.cos(heading), np.sin(heading)), axis=-1
        )
        if step >= 20:
            columns.append(np.stack((speed[:, 0], turn[:, 0] / STEP_S, distance[:, 0]), axis=-1))
    return np.stack(columns, axis=1)


def relaxation(
    models: np.ndarray, rng: np.random.Generator, *, delay: int = 0, heavy: bool = False
) -> np.ndarray:
    """Return a value (M, T, 1) that relaxes to a level at a rate, with noise.

    `delay` is how many steps the restoring force is late; `heavy` noise has jumps.
    """
    count = len(models)
    level, rate, noise = models[:, 0], models[:, 1], models[:, 2]
    values = [level + noise * rng.normal(size=count)]
    for step in range(STEPS + 20):
        felt = values[max(0, step - delay)]
        shock = rng.normal(size=count)
        if heavy:
            shock = np.where(rng.random(count) < 0.1, 3.0, 0.33) * shock
        values.append(values[-1] + rate * (level - felt) + noise * shock)
    return np.stack(values[-STEPS:], axis=1)[..., None]


def _with(function: Callable[..., np.ndarray], **mechanism: float) -> Simulator:
    def simulate(models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return function(models, rng, **mechanism)

    return simulate


_WALK = {"speed": (0.0, 15.0), "turn_noise": (0.0, 1.0)}
_PAIR = {"speed": (0.0, 15.0), "turn_noise": (0.0, 1.0), "attraction": (0.0, 1.0)}
_RELAX = {"level": (-5.0, 5.0), "rate": (0.0, 1.0), "noise": (0.0, 3.0)}


def _case(
    function: Callable[..., np.ndarray],
    ranges: dict[str, tuple[float, float]],
    truth: tuple[float, ...],
    lacking: str,
    **mechanism: float,
) -> Case:
    return Case(ranges, truth, _with(function), _with(function, **mechanism), lacking)


TUNED = {
    "memory": _case(persistent_walk, _WALK, (6.0, 0.3), "memory of turns", memory=0.5),
    "delay": _case(relaxation, _RELAX, (1.0, 0.3, 1.0), "a delay", delay=3),
}
"""Cases by which margins and efforts were chosen."""

REPORTED = {
    "wall": _case(persistent_walk, _WALK, (8.0, 0.2), "walls", wall=6.0),
    "tracker": _case(persistent_walk, _WALK, (5.0, 0.3), "noise of the tracker", tracker=0.05),
    "gait": _case(persistent_walk, _WALK, (7.0, 0.4), "a rhythm of the speed", gait=0.4),
    "alignment": _case(pair, _PAIR, (6.0, 0.2, 0.3), "alignment", alignment=0.3),
    "repulsion": _case(pair, _PAIR, (5.0, 0.2, 0.4), "repulsion", gap=2.0),
    "jumps": _case(relaxation, _RELAX, (-1.0, 0.2, 0.8), "jumps", heavy=True),
}
"""Others."""
