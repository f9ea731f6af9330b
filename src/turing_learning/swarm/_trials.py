"""Place swarms and run trials: who executes what in them, and swarms as sources of samples."""

import math
from collections.abc import Callable, Iterable
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

    #: (K, Q): Networks, laid out as in `models.ElmanModel`; finite
    weights: np.ndarray
    hidden: int  #: Their hidden neurons H, with Q = H^2 + 4 H + 2
    #: (R, A): The network, 0 to K - 1, that drives each robot; -1 for a reactive one
    driver: np.ndarray

    def __post_init__(self) -> None:
        integer("hidden", self.hidden, 1)
        size = self.hidden * (self.hidden + 4) + 2
        weights = array("weights", self.weights, "K Q", empty=True, Q=size)
        driver = array("driver", self.driver, "R A", dtype=np.int64, empty=True)
        if driver.size:
            low = int(driver.min())
            high = int(driver.max())
            rule = f"hold numbers of {len(weights)} networks from 0, or -1 for none"
            require(low >= -1 and high < len(weights), "driver", rule, f"{low} to {high}")
        object.__setattr__(self, "weights", _unchangeable(weights))
        object.__setattr__(self, "driver", _unchangeable(driver))

    def networks(self, trials: int, robots: int) -> Networks:
        """Return what the kernels execute; reject drivers of other trials or robots."""
        array("drivers.driver", self.driver, "R A", dtype=np.int64, R=trials, A=robots)
        return new_networks(self.weights, self.driver, self.hidden)


def _unchangeable(numbers: np.ndarray) -> np.ndarray:
    """Return a copy that nobody can change: a kernel takes the numbers for places in memory."""
    copy = np.array(numbers, order="C")
    copy.flags.writeable = False
    return copy


@dataclass(frozen=True)
class Simulation:
    """What was observed in R trials of A robots and O objects for T control cycles."""

    #: (R, T + 1, A + O, 3): x, y (cm), heading (rad, in [-pi, pi)); robots first
    poses: np.ndarray
    sensors: np.ndarray  #: (R, T + 1, A): Sensor state I at each pose
    #: (R, A, T, 2): Linear speed (cm/s), negative against the heading at a cycle's start; angular
    #: (rad/s)
    speeds: np.ndarray


@dataclass(frozen=True)
class _Body:
    """What the kernels have to know of the bodies of a type of item."""

    name: str
    radius_cm: float
    mass_g: float  # inf of what stays where it is
    deceleration: float = 0.0  # by dry friction on the ground (cm/s^2)
    touched: bool = True


def build_world(
    scenario: Scenario,
    robots: int,
    objects: int,
    wheel_noise: float,
    fields_of_view: np.ndarray | None = None,
) -> World:
    """Return the constants of trials with so many robots and objects, and fields of view (R, A), if any."""
    robot = scenario.robot
    gravity = scenario.objects.gravity_cm_s2
    numbers = [robots, objects]
    bodies = [_Body("robot", robot.radius_cm, robot.mass_g)]
    deceleration = scenario.objects.friction * gravity
    bodies.append(
        _Body("object", scenario.objects.radius_cm, scenario.objects.mass_g, deceleration)
    )
    for name, item in scenario.items.items():
        numbers.append(item.count)
        mass_g = math.inf if item.mobility == "fixed" else item.mass_g
        deceleration = item.friction * gravity
        bodies.append(_Body(name, item.radius_cm, mass_g, deceleration, item.touched))

    def of_all(values: Iterable[float]) -> np.ndarray:
        return np.repeat(np.array(list(values), dtype=np.float64), numbers)

    readings = [scenario.sensor.reading_of(body.name) for body in bodies]
    sectors = None
    if fields_of_view is not None:
        sectors = np.stack((np.cos(fields_of_view / 2), np.sin(fields_of_view / 2)))
    return World(
        robots=robots,
        bodies=sum(numbers),
        # Nothing bumps into a radius of NaN.
        radius=of_all(body.radius_cm if body.touched else math.nan for body in bodies),
        inverse_mass=of_all(1 / body.mass_g for body in bodies),
        # The moment of inertia of a homogeneous disk (g cm^2).
        inverse_inertia=of_all(1 / (0.5 * body.mass_g * body.radius_cm**2) for body in bodies),
        # Invisible bodies have a negative radius.
        sight_radius=of_all(
            body.radius_cm if reading else -1.0
            for body, reading in zip(bodies, readings, strict=True)
        ),
        reading=of_all(readings).astype(np.int64),
        sectors=sectors,
        deceleration=of_all(body.deceleration for body in bodies),
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
    scenario: Scenario,
    controllers: np.ndarray,
    initial_poses: np.ndarray,
    *,
    control_steps: int,
    seed: int = 0,
    wheel_noise: float | None = None,
    fields_of_view: np.typing.ArrayLike | None = None,
    threads: int | None = None,
    drivers: Drivers | None = None,
) -> Simulation:
    """Run trials of a swarm; the numbers of robots and objects come from the arrays, that of items from the scenario.

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
        x, y (cm), heading (rad); robots first, then objects, then items of one's own.
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
    size = 2 * scenario.sensor.states
    controllers = np.ascontiguousarray(array("controllers", controllers, "R A S", S=size))
    trials, robots = controllers.shape[:2]
    poses = np.ascontiguousarray(array("initial_poses", initial_poses, "R B 3", R=trials))
    bodies = poses.shape[1]
    rule = f"hold a pose of each of the {robots} robots, then of objects"
    if scenario.items:
        rule += f", then of {scenario.own_bodies} items"
    require(bodies >= robots + scenario.own_bodies, "initial_poses", rule, bodies)
    integer("control_steps", control_steps, 1, LARGEST_COUNT)
    integer("seed", seed, 0)
    if wheel_noise is None:
        wheel_noise = scenario.robot.wheel_noise
    number("wheel_noise", wheel_noise, least=0, below=1)
    if threads is not None:
        integer("threads", threads, 1, remedy="None takes every processor.")
    if fields_of_view is not None:
        _check_fields_of_view(fields_of_view, trials, robots)
    world = _world_of(scenario, robots, poses, wheel_noise, fields_of_view)
    if scenario.arena.bounded:
        _check_inside(scenario, world, poses)
    keys = np.random.SeedSequence(seed).generate_state(trials, np.uint64)
    result = _recorded(scenario, world, controllers, poses, keys, drivers, control_steps, threads)
    if not scenario.tracker.perfect:
        result.speeds[:] = tracked_speeds(scenario, result.poses[:, :, :robots], keys)
    return result


def _check_fields_of_view(fields_of_view: np.typing.ArrayLike, trials: int, robots: int) -> None:
    fields = array("fields_of_view", fields_of_view, "...", finite=False, empty=True)
    shape = (trials, robots)
    rule = f"have shape (), (A,) or (R, A) = {shape}"
    require(fields.shape in ((), shape[1:], shape), "fields_of_view", rule, fields.shape)
    wrong = fields[~((fields >= 0) & (fields <= FULL_VIEW))]
    rule = f"be from 0 to 2 pi = {FULL_VIEW:.6f} rad"
    require(not wrong.size, "fields_of_view", rule, wrong[:1].tolist())


def _check_inside(scenario: Scenario, world: World, poses: np.ndarray) -> None:
    """Reject bodies that touch or cross a wall of the arena."""
    size = (scenario.arena.width_cm, scenario.arena.height_cm)
    # What nothing touches has no radius (NaN), and may be behind a wall.
    margin = world.radius[:, None]
    outside = (poses[..., :2] < margin) | (poses[..., :2] > np.array(size) - margin)
    for trial, body in np.argwhere(outside.any(axis=-1))[:1].tolist():
        rule = f"lie inside the arena of {size[0]} x {size[1]} cm"
        got = f"x, y = {poses[trial, body, :2].tolist()}"
        refuse("initial_poses", rule, got, place=f"body {body} of trial {trial}")


def _world_of(
    scenario: Scenario,
    robots: int,
    poses: np.ndarray,
    wheel_noise: float,
    fields_of_view: np.typing.ArrayLike | None,
) -> World:
    """Return the constants of trials whose poses are (R, B, 3)."""
    trials, bodies = poses.shape[:2]
    if fields_of_view is None:
        fields_of_view = scenario.sensor.field_of_view
    views = None
    fields = np.asarray(fields_of_view, dtype=np.float64)
    if fields.any():  # else all have a line of sight
        views = np.broadcast_to(fields, (trials, robots))
    objects = bodies - robots - scenario.own_bodies
    return build_world(scenario, robots, objects, wheel_noise, views)


class Cycles:
    """Robots that move one control cycle at a time, by other controllers in each: an emulated laboratory has clocks of its own.

    The constants of the trials are computed once, which takes longer than a cycle of a few robots.

    Parameters
    ----------
    scenario
        As for `simulate`, without objects, items and networks.
    robots
        Number of robots A.
    """

    def __init__(self, scenario: Scenario, robots: int) -> None:
        self._scenario = scenario
        somewhere = np.zeros((1, robots, 3))
        noise = scenario.robot.wheel_noise
        self._world = _world_of(scenario, robots, somewhere, noise, None)

    def move(
        self, poses: np.ndarray, controllers: np.ndarray, seed: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return poses (A, 3) and sensor readings (A,) after a cycle that `simulate` would begin at poses (A, 3).

        Arguments are taken as they are; controllers are (A, 2 n), poses lie within the walls.
        """
        keys = np.random.SeedSequence(seed).generate_state(1, np.uint64)
        trial = self._scenario, self._world, controllers[None], poses[None], keys
        result = _recorded(*trial, None, 1, 1)
        return result.poses[0, 1], result.sensors[0, 1]


def tracked_speeds(scenario: Scenario, poses: np.ndarray, keys: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) that the scenario's tracker measures of robots at poses (R, T + 1, A, 3).

    Each trial has its own noise, drawn by its key. The heading as tracked tells forwards from
    backwards.
    """
    tracker = scenario.tracker
    interval_s = scenario.trial.control_interval_s
    final = poses.shape[1] - 1
    # The delay puts images between poses; before the trial, robots rest.
    times = np.maximum(np.arange(final + 1) - tracker.delay_s / interval_s, 0.0)
    before = np.floor(times).astype(int)
    share = (times - before)[:, None, None]
    step = poses[:, np.minimum(before + 1, final)] - poses[:, before]
    step[..., 2] = _wrapped(step[..., 2])
    images = poses[:, before] + share * step
    deviations = [tracker.position_noise_cm, tracker.position_noise_cm, tracker.heading_noise_rad]
    for trial, key in enumerate(keys.tolist()):
        rng = np.random.default_rng([TRACKING, key])
        images[trial] += rng.standard_normal(images.shape[1:]) * deviations
    moved = np.diff(images, axis=1)
    heading = images[:, :-1, :, 2]
    forwards = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    linear = np.where(forwards < 0, -1, 1) * np.hypot(moved[..., 0], moved[..., 1])
    speeds = np.stack([linear, _wrapped(moved[..., 2])], axis=-1) / interval_s
    return speeds.transpose(0, 2, 1, 3)


def _wrapped(angles: np.ndarray) -> np.ndarray:
    return (angles + math.pi) % (2 * math.pi) - math.pi


def observe(
    scenario: Scenario,
    controllers: np.ndarray,
    poses: np.ndarray,
    keys: np.ndarray,
    threads: int | None,
    fields_of_view: np.ndarray | None = None,
    drivers: Drivers | None = None,
) -> np.ndarray:
    """Return the speeds (R, A, T, 2) alone, of trials of the scenario's duration.

    Arguments are taken as they are.
    """
    trials, robots = controllers.shape[:2]
    steps = scenario.control_steps
    world = _world_of(scenario, robots, poses, scenario.robot.wheel_noise, fields_of_view)
    speeds = _new_speeds(trials, robots, steps)
    arguments = scenario, world, controllers, poses, keys, drivers, threads, speeds
    if scenario.tracker.perfect:
        _run(observe_trials, *arguments)
        return speeds
    recorded = np.empty((trials, steps + 1, poses.shape[1], 3))
    _run(record_trials, *arguments, recorded, np.empty((trials, steps + 1, robots), np.int8))
    speeds[:] = tracked_speeds(scenario, recorded[:, :, :robots], keys)
    return speeds


def _new_speeds(trials: int, robots: int, steps: int) -> np.ndarray:
    """Return room for speeds (R, A, T, 2), in memory robot by robot, as they are judged."""
    # Room for two at least: else the layout of a single trial would be another.
    return np.empty((robots, max(trials, 2), steps, 2))[:, :trials].transpose(1, 0, 2, 3)


def _recorded(
    scenario: Scenario,
    world: World,
    controllers: np.ndarray,
    poses: np.ndarray,
    keys: np.ndarray,
    drivers: Drivers | None,
    control_steps: int,
    threads: int | None,
) -> Simulation:
    """Run trials whose arguments are those of `_run`, and return all that is recorded of them."""
    trials, robots = controllers.shape[:2]
    result = Simulation(
        poses=np.empty((trials, control_steps + 1, poses.shape[1], 3)),
        sensors=np.empty((trials, control_steps + 1, robots), np.int8),
        speeds=_new_speeds(trials, robots, control_steps),
    )
    poses = poses.copy()
    poses[..., 2] = _wrapped(poses[..., 2])
    outputs = result.speeds, result.poses, result.sensors
    _run(record_trials, scenario, world, controllers, poses, keys, drivers, threads, *outputs)
    return result


def _run(
    kernel: Callable[..., None],
    scenario: Scenario,
    world: World,
    controllers: np.ndarray,
    poses: np.ndarray,
    keys: np.ndarray,
    drivers: Drivers | None,
    threads: int | None,
    *outputs: np.ndarray,
) -> None:
    """Let a kernel fill the outputs of trials.

    Their controllers are (R, A, 2 n), poses (R, A + O, 3) and keys (R,).
    """
    trials, robots = controllers.shape[:2]
    networks = None
    if drivers is not None:
        networks = drivers.networks(trials, robots)
        controllers = np.where(networks.driver[..., None] >= 0, LARGEST_OUTPUT, controllers)
    robot = scenario.robot
    sensor = scenario.sensor
    imperfections = None
    if robot.wheel_scale_spread or robot.slip or robot.actuation_lag_cycles or sensor.mistakes:
        imperfections = new_imperfections(
            robot.slip, sensor.mistakes, sensor.states, robot.actuation_lag_cycles, robots
        )
    advance = partial(kernel, world=world, networks=networks, imperfections=imperfections)
    grain = slots_of(world.bodies)
    run_range(advance, trials, threads, poses, controllers, keys, *outputs, grain=grain)


def initial_poses(
    scenario: Scenario,
    trials: int,
    rng: np.random.Generator,
    *,
    robots: int | None = None,
    side_cm: float | None = None,
) -> np.ndarray:
    """Place robots, objects and items uniformly in the scenario's start square, in any direction (paper, section 4.2).

    Items that have centers of their own are there.

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
        x, y (cm), heading (rad); robots first, then objects, then items of one's own. Bodies may
        overlap; they are pushed apart as they begin to move.
    """
    integer("trials", trials, 1, LARGEST_COUNT)
    if robots is not None:
        integer("robots", robots, 1, LARGEST_COUNT)
    if side_cm is not None:
        number("side_cm", side_cm, above=0)
    start = scenario.start(robots, side_cm)
    if side_cm is None and start.crowd:
        rule = "have room where the scenario lets them start"
        got = f"{robots}, and {start.crowd}"
        refuse("robots", rule, got, "Take fewer, or another scenario.")
    fits = trials * start.bodies <= LARGEST_COUNT
    rule = f"have at most {LARGEST_COUNT} bodies in all"
    require(fits, "trials", rule, f"{trials} with {trials * start.bodies}")
    poses = rng.random((trials, start.bodies, 3))
    poses[..., 2] = math.pi * (2 * poses[..., 2] - 1)
    poses[..., :2] = start.corner_cm + poses[..., :2] * start.sides_cm
    body = start.bodies - scenario.own_bodies
    for item in scenario.items.values():
        if item.centers_cm:
            poses[:, body : body + item.count, :2] = item.centers_cm
        body += item.count
    return poses


AGENT = -1
"""In the place of the number of a model: a robot that executes the agents' controller."""

OBSERVED_SWARMS = 10
"""Number of swarms that an `ObservedSwarm` observes at once."""


@dataclass(frozen=True, eq=False)
class Execution:
    """What each robot of R trials executes, as `simulate` and `observe` take it."""

    #: Wheel speeds (R, A, 2 n), of a network the largest that it may give
    controllers: np.ndarray
    fields_of_view: np.ndarray | None  #: (R, A), None where all are the scenario's
    #: Networks that drive some of the robots, None if all are reactive
    drivers: Drivers | None


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
    speeds = models.wheel_speeds[executed]
    fields_of_view = None
    if models.field_of_view is not None:
        view = models.field_of_view[executed]
        fields_of_view = np.where(replica, view, scenario.sensor.field_of_view)
    drivers = None
    if models.weights is not None:
        drivers = Drivers(models.weights, models.hidden, executed)
    return Execution(
        controllers=np.where(replica[..., None], speeds, scenario.controller),
        fields_of_view=fields_of_view,
        drivers=drivers,
    )


@dataclass(frozen=True, eq=False)
class Trials:
    """R trials of a scenario's A robots: who executes which model, from which poses, with which wheel noise."""

    scenario: Scenario  #: Of the agents, the arena and the duration
    #: (R, A): The model that each robot executes; -1 for an agent
    executed: np.ndarray
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
        if models is None:
            models = Behavior(np.asarray([self.scenario.controller], dtype=np.float64))
        robots = execution_of(self.scenario, models, self.executed)
        return observe(
            self.scenario,
            robots.controllers,
            self.poses,
            self.keys,
            threads,
            robots.fields_of_view,
            robots.drivers,
        )


def mixed(scenario: Scenario, models: int, trials: int = 1) -> np.ndarray:
    """Return who executes what (M x trials, A) in some trials of each of M models.

    The replicas execute the model of their trial; the agents come before them.
    """
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
    #: What a model is; None takes the scenario's
    model: Representation | None = None

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2).

        The models are (M, P).
        """
        replicas = self._replicas(models)
        trials = Trials.draw(self.scenario, mixed(self.scenario, len(models)), rng)
        speeds = trials.observe(replicas, self.threads)
        agents = self.scenario.agents
        return Samples(genuine=_one_by_one(speeds[:, :agents]), counterfeit=speeds[:, agents:])

    def _replicas(self, models: np.ndarray) -> Behavior:
        """Return what replicas of models (M, P), as the optimizer has them, execute."""
        model = self.model or self.scenario.model
        size = len(model.parameter_names)
        models = array("models", models, "M P", finite=False, empty=True, P=size)
        return model.behavior(model.to_units(models))


@dataclass(frozen=True)
class SeparatedSwarm(MixedSwarm):
    """Groups of agents and groups of replicas, never mixed: a trial of each per model, all replicas of which execute it.

    Both groups have as many individuals as the scenario (paper, section 4.6.3).
    """

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, individuals, T, 2).

        The models are (M, P).
        """
        scenario = self.scenario
        replicas = self._replicas(models)
        agents = Trials.draw(scenario, alone(scenario, len(models)), rng)
        genuine = agents.observe(None, self.threads)
        groups = np.repeat(np.arange(len(models))[:, None], scenario.individuals, axis=1)
        counterfeit = Trials.draw(scenario, groups, rng).observe(replicas, self.threads)
        return Samples(_one_by_one(genuine), counterfeit)


@dataclass(frozen=True)
class ObservedSwarm:
    """A live source of genuine motion: swarms of a scenario without replicas, from new initial poses each time.

    `turing_learning.infer` makes one of a scenario that is given as `genuine`.
    """

    scenario: Scenario  #: What moves; its replicas are agents, too
    trials: int = OBSERVED_SWARMS  #: Number of swarms R that are observed at once

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
