"""Forty robots in the emulated laboratory's arena: what swarms of agents, and of an inferred model, come to."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from turing_learning.analysis import Comparison, compare, dispersion, largest_cluster
from turing_learning.purposes import VALIDATION_CAMERA, VALIDATION_NOISE, VALIDATION_STARTS
from turing_learning.reproduction._work import Work

KINDS = ("agents", "model")
MARKER = "red"
QUANTITIES = ("proportion at the end", "dispersion at the end", "mean proportion", "mean dispersion")
"""What is compared: of every trial the last moment, and the mean over all moments."""


@dataclass(frozen=True)
class ValidationSizes:
    """How many trials of how many robots, how long, how often the camera looks, and which moments are shown."""

    robots: int = 40
    trials: int = 10
    duration_s: float = 600.0
    every_s: float = 2.0
    shown_s: tuple[float, ...] = (0, 20, 40, 180, 360, 420, 480, 600)
    seed: int = 1

    @property
    def times_s(self) -> np.ndarray:
        """When the camera takes an image (K,)."""
        return np.arange(round(self.duration_s / self.every_s) + 1) * self.every_s


@dataclass(frozen=True, eq=False)
class Gathering:
    """What R trials of A robots look like at K moments.

    Attributes
    ----------
    seen : (R, K, A, 2)
        Positions (cm) that the camera has seen; of a moment at which it has not seen all robots those of the moment before.
    complete : (R, K)
        Whether all robots were seen.
    poses : (R, K, A, 3)
        Where they were.
    radius_cm
        Of a robot.
    """

    seen: np.ndarray
    complete: np.ndarray
    poses: np.ndarray
    radius_cm: float

    @cached_property
    def proportion(self) -> np.ndarray:
        """Share of the robots in the largest cluster (R, K)."""
        return largest_cluster(self.seen, self.radius_cm) / self.seen.shape[2]

    @cached_property
    def dispersion(self) -> np.ndarray:
        """Dispersion of the robots (R, K)."""
        return dispersion(self.seen, self.radius_cm)


@dataclass(frozen=True, eq=False)
class Validation:
    """Trials of the agents' controller and of a model from common initial configurations.

    Attributes
    ----------
    model : (P,)
        What was inferred.
    agents, replicas
        What they do.
    times_s : (K,)
        Moments.
    """

    model: np.ndarray
    agents: Gathering
    replicas: Gathering
    times_s: np.ndarray

    @property
    def comparison(self) -> Comparison:
        """Tests of the four `QUANTITIES`."""
        pairs = [(getattr(self.agents, what), getattr(self.replicas, what)) for what in ("proportion", "dispersion")]
        tests = [compare(a[:, -1], [b[:, -1]]) for a, b in pairs] + [compare(a.mean(1), [b.mean(1)]) for a, b in pairs]
        return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


def validate(work: Work, model: np.ndarray) -> Validation:
    """Let swarms of agents and of replicas of a model (P,) go, a piece of work for each trial."""
    from turing_learning.robots import LABORATORY

    sizes: ValidationSizes = work.sizes.validation
    controllers = dict(zip(KINDS, (np.array(LABORATORY.controller), model), strict=True))
    given = {
        f"validation-{kind}-trial{trial:02d}": (sizes, controllers[kind], trial, KINDS.index(kind))
        for kind in KINDS
        for trial in range(1, sizes.trials + 1)
    }
    pieces = list(work.all_arrays(_filmed, given).values())
    radius = LABORATORY.robot.radius_cm
    agents, replicas = (
        Gathering(**{name: np.stack([one[name] for one in part]) for name in ("seen", "complete", "poses")}, radius_cm=radius)
        for part in (pieces[: sizes.trials], pieces[sizes.trials :])
    )  # fmt: skip
    return Validation(model, agents, replicas, sizes.times_s)


def places_apart(robots: int, sides_cm: tuple[float, float], radius_cm: float, rng: np.random.Generator) -> np.ndarray:
    """Return poses (A, 3) drawn uniformly in an arena, none of which overlap: a place that is taken is drawn again."""
    low, high = radius_cm, np.array(sides_cm) - radius_cm
    placed = np.empty((0, 2))
    while len(placed) < robots:
        place = rng.uniform(low, high)
        if (np.linalg.norm(placed - place, axis=1) > 2 * radius_cm).all():
            placed = np.vstack([placed, place])
    return np.column_stack([placed, rng.uniform(-np.pi, np.pi, robots)])


def _filmed(
    should_stop: Callable[[], bool], sizes: ValidationSizes, controller: np.ndarray, trial: int, kind: int
) -> dict[str, np.ndarray] | None:
    """Run a trial before the emulated camera; find the robots' round markers in its images."""
    from turing_learning.robots import LABORATORY, EmulatedCamera, RoundMarkers, Tracker, move_alone, overhead_camera

    arena, robot, interval = LABORATORY.arena, LABORATORY.robot, LABORATORY.trial.control_interval_s
    sides = float(arena.width_cm or 0), float(arena.height_cm or 0)
    start = places_apart(
        sizes.robots, sides, robot.radius_cm, np.random.default_rng((VALIDATION_STARTS, sizes.seed, trial))
    )
    seed = int(np.random.SeedSequence((VALIDATION_NOISE, sizes.seed, trial, kind)).generate_state(1)[0])
    calibration, markers, labels = overhead_camera(*sides), RoundMarkers(), (MARKER,) * sizes.robots
    look = int(np.random.SeedSequence((VALIDATION_CAMERA, sizes.seed, trial, kind)).generate_state(1)[0])
    camera = EmulatedCamera(calibration, markers, labels, arena_cm=sides, seed=look)
    tracker = Tracker(markers, calibration, labels)
    every = round(sizes.every_s / interval)
    cycles = every * (len(sizes.times_s) - 1)
    poses: list[np.ndarray] = []
    seen: list[np.ndarray] = []
    complete: list[bool] = []
    for cycle, now in enumerate(move_alone(LABORATORY, controller, start, cycles=cycles, seed=seed)):
        if cycle % every:
            continue
        if should_stop():
            return None
        found = tracker.detect(camera.render(now)).positions
        complete.append(len(found) == sizes.robots)
        seen.append(found if complete[-1] else seen[-1] if seen else now[:, :2])
        poses.append(now)
    return {"seen": np.array(seen), "complete": np.array(complete), "poses": np.array(poses)}
