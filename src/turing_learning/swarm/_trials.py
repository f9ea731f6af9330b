"""Place swarms and run trials: who executes what in them, and swarms as sources of samples."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Self

import numpy as np

from ..arrays import array
from ..coevolution import Samples
from ..errors import LARGEST_COUNT, integer, number, refuse, require
from ..kernels.parallel import run_range
from ..kernels.trials import observe_trials, record_trials, slots_of
from ..kernels.world import Networks, World, new_imperfections, new_networks
from ..models import FULL_VIEW, Behavior, Representation
from ..purposes import TRACKING
from ._scenario import Scenario

LARGEST_OUTPUT = 1.0
"""Of a network that drives a robot: how far the robot may move follows from it."""


@dataclass(frozen=True, eq=False)
class Drivers:
    """Which robots of R trials are driven by a network, and by which."""

    weights: np.ndarray  #: (K, Q): Networks, laid out as in `models.ElmanModel`; finite
    hidden: int  #: Their hidden neurons H, with Q = H^2 + 4 H + 2
    #: (R, A): The network, 0 to K - 1, that drives each robot; -1 for a reactive one
    driver: np.ndarray

    def __post_init__(self) -> None:
        integer("hidden", self.hidden, 1)
        weights = array(
            "weights", self.weights, "K Q", empty=True, Q=self.hidden * (self.hidden + 4) + 2
        )
        driver = array("driver", self.driver, "R A", dtype=np.int64, empty=True)
        if driver.size:
            low, high = int(driver.min()), int(driver.max())
            rule = f"hold numbers of {len(weights)} networks from 0, or -1 for none"
            require(low >= -1 and high < len(weights), "driver", rule, f"{low} to {high}")
        for name, checked in (("weights", weights), ("driver", driver)):
            # a copy that nobody changes: a kernel takes the numbers for places in memory
            own = np.array(checked, order="C")
            own.flags.writeable = False
            object.__setattr__(self, name, own)

    def networks(self, trials: int, robots: int) -> Networks:
        """Return what the kernels execute; reject drivers of other trials or robots."""
        array("drivers.driver", self.driver, "R A", dtype=np.int64, R=trials, A=robots)
        return new_networks(self.weights, self.driver, self.hidden)


@dataclass(frozen=True)
class Simulation:
    """What was observed in R trials of A robots and O objects for T control cycles."""

    poses: np.ndarray  #: (R, T + 1, A + O, 3): x, y (cm), heading (rad, in [-pi, pi)); robots first
    sensors: np.ndarray  #: (R, T + 1, A): Sensor state I at each pose
    #: (R, A, T, 2): Linear speed (cm/s), negative against the heading at a cycle's start; angular
    #: (rad/s)
    speeds: np.ndarray


def build_world(
    scenario: Scenario,
    robots: int,
    objects: int,
    wheel_noise: float,
    fields_of_view: np.ndarray | None = None,
) -> World:
    """Return the constants of trials with the given numbers of robots and objects, and fields of view (R, A), if there are any."""
    robot, item, sensor = scenario.robot, scenario.objects, scenario.sensor

    def bodies(of_robot: float, of_object: float) -> np.ndarray:
        return np.repeat([of_robot, of_object], [robots, objects])

    readings = sensor.reading_of("robot"), sensor.reading_of("object")
    inertia = (0.5 * robot.mass_g * robot.radius_cm**2, 0.5 * item.mass_g * item.radius_cm**2)
    return World(
        robots=robots,
        bodies=robots + objects,
        radius=bodies(robot.radius_cm, item.radius_cm),
        inverse_mass=bodies(1 / robot.mass_g, 1 / item.mass_g),
        inverse_inertia=bodies(1 / inertia[0], 1 / inertia[1]),
        sight_radius=bodies(
            robot.radius_cm if readings[0] else -1.0, item.radius_cm if readings[1] else -1.0
        ),
        reading=bodies(*readings).astype(np.int64),
        sectors=None
        if fields_of_view is None
        else np.stack((np.cos(fields_of_view / 2), np.sin(fields_of_view / 2))),
        deceleration=item.friction * item.gravity_cm_s2,
        wheel_distance=robot.wheel_distance_cm,
        maximum_speed=robot.maximum_speed_cm_s,
        wheel_noise=float(wheel_noise),
        wheel_scale_spread=float(robot.wheel_scale_spread),
        clamp=robot.clamp_wheel_speeds,
        interval=scenario.trial.control_interval_s,
        substeps=scenario.trial.physics_steps,
        width=float(scenario.arena.width_cm or 0.0),
        height=float(scenario.arena.height_cm or 0.0),
    )


def simulate(
    scenario: Scenario, controllers: np.ndarray, initial_poses: np.ndarray, *, control_steps: int,
    seed: int = 0, wheel_noise: float | None = None, fields_of_view: np.typing.ArrayLike | None = None,
    threads: int | None = None, drivers: Drivers | None = None,
) -> Simulation:  # fmt: skip
    """Run trials of a swarm; the numbers of robots and objects come from the arrays.

    Source: paper, sections 3.2, 4.1 and 4.6.2; docs/physics.md.

    Parameters
    ----------
    scenario
        Robots, objects, sensor, arena and control interval; its numbers of individuals and its
        duration do not count.
    controllers : (R, A, 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum, for each
        trial and individual.
    initial_poses : (R, A + O, 3)
        x, y (cm), heading (rad); robots first, then objects.
    control_steps
        Number of control cycles T, >= 1.
    seed
        Seed of the wheel noise, >= 0.
    wheel_noise
        Relative wheel noise in [0, 1); None takes the scenario's.
    fields_of_view : (), (A,) or (R, A)
        Of the robots' sensors (rad), from 0 to 2 pi; None takes the scenario's.
    threads
        Number of threads, >= 1; None takes every processor. It does not change the result.
    drivers
        Networks that drive some of the robots, whose controllers do not count; None if all are
        reactive.

    Returns
    -------
    Simulation
        Poses, sensor states and speeds at every control cycle.
    """
    controllers = np.ascontiguousarray(
        array("controllers", controllers, "R A S", S=2 * scenario.sensor.states)
    )
    trials, robots = controllers.shape[:2]
    poses = np.ascontiguousarray(array("initial_poses", initial_poses, "R B 3", R=trials))
    rule = f"hold a pose of each of the {robots} robots, then of objects"
    require(poses.shape[1] >= robots, "initial_poses", rule, poses.shape[1])
    integer("control_steps", control_steps, 1, LARGEST_COUNT)
    integer("seed", seed, 0)
    noise = scenario.robot.wheel_noise if wheel_noise is None else wheel_noise
    number("wheel_noise", noise, least=0, below=1)
    if threads is not None:
        integer("threads", threads, 1, remedy="None takes every processor.")
    if fields_of_view is not None:
        fields, shape = (
            array("fields_of_view", fields_of_view, "...", finite=False, empty=True),
            (trials, robots),
        )
        rule = f"have shape (), (A,) or (R, A) = {shape}"
        require(fields.shape in ((), shape[1:], shape), "fields_of_view", rule, fields.shape)
        wrong = fields[~((fields >= 0) & (fields <= FULL_VIEW))]
        require(
            not wrong.size,
            "fields_of_view",
            f"be from 0 to 2 pi = {FULL_VIEW:.6f} rad",
            wrong[:1].tolist(),
        )
    if scenario.arena.bounded:
        size = (scenario.arena.width_cm, scenario.arena.height_cm)
        radius = np.repeat(
            [scenario.robot.radius_cm, scenario.objects.radius_cm],
            [robots, poses.shape[1] - robots],
        )
        outside = (poses[..., :2] < radius[:, None]) | (
            poses[..., :2] > np.array(size) - radius[:, None]
        )
        for trial, body in np.argwhere(outside.any(axis=-1))[:1].tolist():
            got, place = (
                f"x, y = {poses[trial, body, :2].tolist()}",
                f"body {body} of trial {trial}",
            )
            refuse(
                "initial_poses",
                f"lie inside the arena of {size[0]} x {size[1]} cm",
                got,
                place=place,
            )
    keys = np.random.SeedSequence(seed).generate_state(trials, np.uint64)
    room = (trials, control_steps + 1)
    sensors, speeds = np.empty((*room, robots), np.int8), _new_speeds(trials, robots, control_steps)
    result = Simulation(np.empty((*room, poses.shape[1], 3)), sensors, speeds)
    poses = poses.copy()
    poses[..., 2] = _wrapped(poses[..., 2])
    outputs = (result.speeds, result.poses, result.sensors)
    _run(
        record_trials,
        scenario,
        controllers,
        poses,
        keys,
        noise,
        fields_of_view,
        drivers,
        threads,
        *outputs,
    )
    if not scenario.tracker.perfect:
        speeds[:] = tracked_speeds(scenario, result.poses[:, :, :robots], keys)
    return result


def tracked_speeds(scenario: Scenario, poses: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) that the scenario's tracker measures of robots at poses (R, T + 1, A, 3).

    Each trial has its own noise, drawn by its key. The direction of motion is told by the heading
    as tracked.
    """
    tracker, interval = scenario.tracker, scenario.trial.control_interval_s
    last = poses.shape[1] - 1
    times = np.maximum(np.arange(last + 1) - tracker.delay_s / interval, 0.0)
    before = np.floor(times).astype(int)
    share = (times - before)[:, None, None]
    way = poses[:, np.minimum(before + 1, last)] - poses[:, before]
    way[..., 2] = _wrapped(way[..., 2])
    seen = poses[:, before] + share * way
    deviations = [tracker.position_noise_cm, tracker.position_noise_cm, tracker.heading_noise_rad]
    for trial, key in enumerate(keys.tolist()):
        rng = np.random.default_rng([TRACKING, key])
        seen[trial] += rng.standard_normal(seen.shape[1:]) * deviations
    moved = np.diff(seen, axis=1)
    heading = seen[:, :-1, :, 2]
    ahead = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    linear = np.where(ahead < 0, -1, 1) * np.hypot(moved[..., 0], moved[..., 1])
    speeds = np.stack([linear, _wrapped(moved[..., 2])], axis=-1) / interval
    return speeds.transpose(0, 2, 1, 3)


def _wrapped(angles: np.ndarray) -> np.ndarray:
    """Return angles in [-pi, pi)."""
    return (angles + math.pi) % (2 * math.pi) - math.pi


def observe(
    scenario: Scenario, controllers: np.ndarray, poses: np.ndarray, keys: np.ndarray, threads: int | None,
    fields_of_view: np.ndarray | None = None, drivers: Drivers | None = None,
) -> np.ndarray:  # fmt: skip
    """Return the speeds (R, A, T, 2) alone, of trials of the scenario's duration.

    Arguments are taken as they are.
    """
    trials, robots = controllers.shape[:2]
    steps, noise = scenario.control_steps, scenario.robot.wheel_noise
    speeds = _new_speeds(trials, robots, steps)
    given = (scenario, controllers, poses, keys, noise, fields_of_view, drivers, threads, speeds)
    if scenario.tracker.perfect:
        _run(observe_trials, *given)
        return speeds
    moved = np.empty((trials, steps + 1, poses.shape[1], 3))
    _run(record_trials, *given, moved, np.empty((trials, steps + 1, robots), np.int8))
    speeds[:] = tracked_speeds(scenario, moved[:, :, :robots], keys)
    return speeds


def _new_speeds(trials: int, robots: int, steps: int) -> np.ndarray:
    """Return room for speeds (R, A, T, 2), in memory robot by robot, as they are judged.

    That of one trial in the same layout.
    """
    return np.empty((robots, max(trials, 2), steps, 2))[:, :trials].transpose(1, 0, 2, 3)


def _run(
    kernel: Callable[..., None], scenario: Scenario, controllers: np.ndarray, poses: np.ndarray, keys: np.ndarray,
    wheel_noise: float, fields_of_view: np.typing.ArrayLike | None, drivers: Drivers | None, threads: int | None,
    *outputs: np.ndarray,
) -> None:  # fmt: skip
    """Let a kernel fill the outputs of trials with these controllers (R, A, 2 n), poses (R, A + O, 3) and keys (R,)."""
    trials, robots = controllers.shape[:2]
    fields = np.asarray(
        scenario.sensor.field_of_view if fields_of_view is None else fields_of_view,
        dtype=np.float64,
    )
    views = (
        np.broadcast_to(fields, (trials, robots)) if fields.any() else None
    )  # else all have a line of sight
    world = build_world(scenario, robots, poses.shape[1] - robots, wheel_noise, views)
    networks = None if drivers is None else drivers.networks(trials, robots)
    if networks is not None:
        controllers = np.where(networks.driver[..., None] >= 0, LARGEST_OUTPUT, controllers)
    robot, sensor = scenario.robot, scenario.sensor
    imperfections = None
    if robot.wheel_scale_spread or robot.slip or robot.actuation_lag_cycles or sensor.mistakes:
        imperfections = new_imperfections(
            robot.slip, sensor.mistakes, sensor.states, robot.actuation_lag_cycles, robots
        )
    advance = partial(kernel, world=world, networks=networks, imperfections=imperfections)
    run_range(
        advance, trials, threads, poses, controllers, keys, *outputs, grain=slots_of(world.bodies)
    )


def initial_poses(
    scenario: Scenario, trials: int, rng: np.random.Generator, *, robots: int | None = None,
    side_cm: float | None = None,
) -> np.ndarray:  # fmt: skip
    """Place robots and objects uniformly in the scenario's start square, in any direction (paper, section 4.2).

    Parameters
    ----------
    scenario
        What is placed, and where: within the walls, or in the start square of its trial.
    trials
        Number of trials R, >= 1.
    rng
        Draws the places and headings.
    robots
        Number of robots; objects and the area of the square grow in proportion. None takes the
        scenario's.
    side_cm
        Side of a start square, however crowded; None keeps within the walls, or to the scenario's
        density.

    Returns
    -------
    (R, A + O, 3)
        x, y (cm), heading (rad). Bodies may overlap; they are pushed apart as they begin to move.
    """
    integer("trials", trials, 1, LARGEST_COUNT)
    integer("robots", scenario.individuals if robots is None else robots, 1, LARGEST_COUNT)
    number("side_cm", 1.0 if side_cm is None else side_cm, above=0)
    start = scenario.start(robots, side_cm)
    if side_cm is None and start.crowd:
        rule, remedy = (
            "have room where the scenario lets them start",
            "Take fewer, or another scenario.",
        )
        refuse("robots", rule, f"{robots}, and {start.crowd}", remedy)
    bodies = trials * start.bodies
    require(
        bodies <= LARGEST_COUNT,
        "trials",
        f"have at most {LARGEST_COUNT} bodies in all",
        f"{trials} with {bodies}",
    )
    poses = rng.random((trials, start.bodies, 3))
    poses[..., 2] = math.pi * (2 * poses[..., 2] - 1)
    poses[..., :2] = start.corner_cm + poses[..., :2] * start.sides_cm
    return poses


AGENT = -1
"""In the place of the number of a model: a robot that executes the agents' controller."""

TRIALS = 10


@dataclass(frozen=True, eq=False)
class Execution:
    """What each robot of R trials executes, as `simulate` and `observe` take it."""

    controllers: np.ndarray  #: Wheel speeds (R, A, 2 n), of a network the largest that it may give
    fields_of_view: np.ndarray | None  #: (R, A), None where all are the scenario's
    drivers: Drivers | None  #: Networks that drive some of the robots, None if all are reactive


def execution_of(scenario: Scenario, models: Behavior, executed: np.ndarray) -> Execution:
    """Return what robots execute of which some are replicas.

    Parameters
    ----------
    models : (M, ...)
        What replicas of M models execute.
    executed : (R, A)
        The model, 0 to M - 1, that each robot executes; -1 for an agent.
    """
    replica = executed >= 0
    speeds, view = models.wheel_speeds, models.field_of_view
    return Execution(
        controllers=np.where(replica[..., None], speeds[executed], scenario.controller),
        fields_of_view=None
        if view is None
        else np.where(replica, view[executed], scenario.sensor.field_of_view),
        drivers=None
        if models.weights is None
        else Drivers(models.weights, models.hidden, executed),
    )


@dataclass(frozen=True, eq=False)
class Trials:
    """R trials of a scenario's A robots: who executes which model, from which poses, with which wheel noise."""

    scenario: Scenario  #: Of the agents, the arena and the duration
    executed: np.ndarray  #: (R, A): The model that each robot executes; -1 for an agent
    #: (R, A + O, 3): x, y (cm), heading (rad) at the beginning; robots first, then objects
    poses: np.ndarray
    keys: np.ndarray  #: (R,): Of the wheel noise, one for each trial

    @classmethod
    def draw(cls, scenario: Scenario, executed: np.ndarray, rng: np.random.Generator) -> Self:
        """Return trials with new keys and initial poses, drawn in this order."""
        keys = rng.integers(0, 2**64, size=len(executed), dtype=np.uint64)
        return cls(scenario, executed, initial_poses(scenario, len(executed), rng), keys)

    def observe(self, models: Behavior | None = None, threads: int | None = None) -> np.ndarray:
        """Return the speeds (R, A, T, 2) of robots that execute models (M, ...); None if all are agents.

        Linear speed (cm/s), negative when moving against the heading, and angular speed (rad/s).
        The number of threads, None for every processor, does not change them.
        """
        agents = Behavior(np.asarray([self.scenario.controller], dtype=np.float64))
        robots = execution_of(self.scenario, agents if models is None else models, self.executed)
        more = (robots.fields_of_view, robots.drivers)
        return observe(self.scenario, robots.controllers, self.poses, self.keys, threads, *more)


def mixed(scenario: Scenario, models: int, trials: int = 1) -> np.ndarray:
    """Return who executes what (M x trials, A) in some trials of each of M models: the replicas its model, agents before them."""
    executed = np.full((models * trials, scenario.individuals), AGENT)
    executed[:, scenario.agents :] = np.repeat(np.arange(models), trials)[:, None]
    return executed


def alone(scenario: Scenario, trials: int) -> np.ndarray:
    """Return who executes what (trials, A) where all robots are agents."""
    return np.full((trials, scenario.individuals), AGENT)


@dataclass(frozen=True)
class MixedSwarm:
    """Replicas mixed into a group of agents: one trial per model, in which every replica executes it.

    Source: paper, sections 3.2.2 and 4.2.
    """

    scenario: Scenario
    #: Number of threads; None takes every processor. It does not change the samples
    threads: int | None = None
    model: Representation | None = None  #: What a model is; None takes the scenario's

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2) of models (M, P)."""
        agents, replicas = self.scenario.agents, self._replicas(models)
        speeds = Trials.draw(self.scenario, mixed(self.scenario, len(models)), rng).observe(
            replicas, self.threads
        )
        return Samples(genuine=_one_by_one(speeds[:, :agents]), counterfeit=speeds[:, agents:])

    def _replicas(self, models: np.ndarray) -> Behavior:
        """Return what replicas of models (M, P), as the optimizer has them, execute."""
        model = self.model or self.scenario.model
        models = array(
            "models", models, "M P", finite=False, empty=True, P=len(model.parameter_names)
        )
        return model.behavior(model.to_units(models))


@dataclass(frozen=True)
class SeparatedSwarm(MixedSwarm):
    """Groups of agents and groups of replicas, never mixed: a trial of each per model, all replicas of which execute it.

    Both groups have as many individuals as the scenario (paper, section 4.6.3).
    """

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, individuals, T, 2) of models (M, P)."""
        scenario, replicas = self.scenario, self._replicas(models)
        groups = np.repeat(np.arange(len(models))[:, None], scenario.individuals, axis=1)
        genuine = Trials.draw(scenario, alone(scenario, len(models)), rng).observe(
            None, self.threads
        )
        return Samples(
            _one_by_one(genuine), Trials.draw(scenario, groups, rng).observe(replicas, self.threads)
        )


@dataclass(frozen=True)
class ObservedSwarm:
    """A live source of genuine motion: swarms of a scenario without replicas, from new initial poses each time.

    `turing_learning.infer` makes one of a scenario that is given as `genuine`.
    """

    scenario: Scenario  #: What moves; its replicas are agents, too
    trials: int = TRIALS  #: Number of swarms R that are observed at once

    names = ("speed", "turn")
    headings = True

    @property
    def interval_s(self) -> float:
        """Duration of a time step (s)."""
        return self.scenario.trial.control_interval_s

    def __call__(self, rng: np.random.Generator) -> np.ndarray:
        """Return samples (R x individuals, T, 2): linear speed (cm/s) and angular speed (rad/s)."""
        speeds = Trials.draw(self.scenario, alone(self.scenario, self.trials), rng).observe()
        return speeds.reshape(-1, *speeds.shape[2:])


def _one_by_one(speeds: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of all individuals as samples (A x R, T, 2)."""
    return speeds.transpose(1, 0, 2, 3).reshape(-1, *speeds.shape[2:])
