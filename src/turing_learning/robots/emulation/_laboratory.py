"""The emulated laboratory: faults and an operator, also as typed commands; runs before it, in virtual time or plain simulation."""

import inspect
import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import Samples
from turing_learning.config import ConfigurationError
from turing_learning.errors import choice, refuse, refusing_as, require
from turing_learning.models import Behavior
from turing_learning.purposes import CLOCKS, REHEARSAL, TRACKING
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots._link import EPuck, Link
from turing_learning.robots.program._equipment import (
    CameraPoses,
    Equipment,
    PoseSource,
    laboratory_tracker,
)
from turing_learning.robots.program._setup import Laboratory
from turing_learning.robots.program._source import WHEEL_SPEED_RANGE, trial_samples
from turing_learning.robots.tracking._camera import Calibration
from turing_learning.robots.tracking._markers import Markers, TriangleMarkers
from turing_learning.robots.tracking._tracker import Track
from turing_learning.swarm import Scenario, Trials, alone, initial_poses
from turing_learning.systems import Source
from turing_learning.trajectories import wrap

from ._arena import (
    LABORATORY,
    ArenaCamera,
    Conditions,
    Drives,
    EmulatedCamera,
    overhead_camera,
    read_infrared,
    sides_cm,
)
from ._emulated_robot import STILL, EmulatedRobot, Wheels
from ._lines import Line, Spoil, VirtualLine, whole

_GARBAGE = b"\x9a\xff\x01x,START,9"
"""Noise on a line: bytes that are no text, and the beginning of a line that never ends."""
_REPLICA_COLORS = ("orange", "purple", "green", "red")
_BEST_BATTERY = 1.4
_CYCLES = 4  # whose poses are kept, because an image may be rendered late
# Of a control cycle, at whose ends robots may act where each has its own phase
_PARTS = 5
_EARLY_S = 1e-9  # by which a robot may act before its time, for want of digits
_OTHER_NAMES = {"press_remote": "remote", "put_in_order": "repair"}
LOW_BATTERY = 0.15  #: Share of its charge below which a robot's LED lights
BATTERY_LIGHT = 8


class ArenaRobot:
    """A robot whose clock is wrong by the share `drift`, whose battery (`charge` 1 if full) lasts `battery_s`,
    and whose signals get lost if it is `silent`.
    """

    def __init__(
        self, name: str, controller: tuple[float, ...] | None, *, clock: Callable[[], float], drift: float,
        battery_s: float, rng: np.random.Generator, make_line: Callable[[EmulatedRobot, str], Line],
    ) -> None:  # fmt: skip
        self._own_time: Callable[[], float] = lambda: clock() * (1 + drift)
        self._battery_s = battery_s
        self.emulated = EmulatedRobot(
            self, clock=self._own_time, controller=controller, tell=self._tell, rng=rng
        )
        self.line = make_line(self.emulated, name)
        self.silent = False
        self.charge = 1.0
        self._readings: Sequence[int] = (0,) * 8

    def proximity(self) -> Sequence[int]:
        return self._readings

    def battery_ok(self) -> bool:
        return self.charge > LOW_BATTERY

    def hear_remote(self) -> None:
        if self.charge > 0:
            self.emulated.start(self._own_time())

    def restart(self) -> None:
        """Switch off and on: state, models and silence are forgotten, the connection is lost."""
        self.silent = False
        self.emulated.restart()
        self.line.drop()
        self.line.restore()

    def step(self, interval_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle; see `EmulatedRobot.step`."""
        if self.charge <= 0:
            return STILL
        self._readings = proximity
        self.charge = max(self.charge - interval_s / self._battery_s, 0.0)
        self.emulated.lights[BATTERY_LIGHT] = int(not self.battery_ok())
        if self.charge == 0.0:
            self.line.drop()
        return self.emulated.step(self._own_time(), sight, proximity)

    def _tell(self, signal: str) -> None:
        if not self.silent:
            self.line.signal(signal)


@dataclass
class Faults:
    """Faults on demand: each method is one; robots are named as in `EmulatedLaboratory.names`."""

    _arena: "EmulatedLaboratory"

    def lose_link(self, name: str) -> None:
        """Break a robot's connection, until the operator resets it."""
        self._arena.robot(name).line.drop()

    def garble(self, name: str) -> None:
        """Put garbage before what the robot sends next."""
        self._spoil_once(name, lambda data: [_GARBAGE + b"\r\n" + data])

    def cut_reply(self, name: str) -> None:
        """Send the next reply in two pieces, with a pause between them."""
        self._spoil_once(name, lambda data: [data[: len(data) // 2], data[len(data) // 2 :]])

    def lose_half_reply(self, name: str) -> None:
        """Lose the second half of what the robot sends next."""
        self._spoil_once(name, lambda data: [data[: len(data) // 2]])

    def silence(self, name: str) -> None:
        """Let a replica send no more signals, until it is restarted."""
        self._arena.robot(name).silent = True

    def drain(self, name: str) -> None:
        """Let a robot's battery be low; it lasts a little longer."""
        robot = self._arena.robot(name)
        robot.charge = min(robot.charge, 0.1)

    def empty(self, name: str) -> None:
        """Let a robot stop for want of power."""
        self._arena.robot(name).charge = 1e-12

    def stick(self, name: str) -> None:
        """Let a robot be stuck on the floor: its wheels turn in vain."""
        self._arena.stuck.add(self._arena.number(name))

    def carry(self, name: str, x_cm: float, y_cm: float, heading: float = 0.0) -> None:
        """Carry a robot to another place."""
        self._arena.put(name, (x_cm, y_cm, heading))

    def cover(self, name: str) -> None:
        """Hide a robot's marker from the camera."""
        self._arena.covered.add(self._arena.number(name))

    def freeze_camera(self) -> None:
        """Let the camera give the same image again and again."""
        self._arena.camera.frozen = True

    def unplug_camera(self) -> None:
        """Let the camera give no images."""
        self._arena.camera.unplugged = True

    def _spoil_once(self, name: str, spoil: Spoil) -> None:
        line = self._arena.robot(name).line

        def once(data: bytes) -> Iterable[bytes]:
            line.spoil = whole
            return spoil(data)

        line.spoil = once


@dataclass
class EmulatedOperator:
    """The human in the laboratory: asked for help, it takes time, repairs everything, and presses the remote control."""

    _arena: "EmulatedLaboratory"
    asked: list[str] = field(default_factory=list)

    def ask(self, what_to_do: str) -> None:
        """Do whatever is needed; `asked` lists what was said."""
        self.asked.append(what_to_do)
        self._arena.clock.sleep(self._arena.conditions.intervention_s)
        self.put_in_order()
        self.press_remote()

    def put_in_order(self) -> None:
        """Free and uncover the robots, look after links and camera, and replace all batteries."""
        self._arena.stuck.clear()
        self.restart_camera()
        for name in self._arena.names:
            self.uncover(name)
            self.reset_link(name)
            self.replace_battery(name)

    def press_remote(self) -> None:
        """Let all robots begin their loops."""
        for name in self._arena.names:
            self._arena.robot(name).hear_remote()

    def replace_battery(self, name: str) -> None:
        """Put a full battery into a robot, which restarts and waits for the remote control."""
        robot = self._arena.robot(name)
        robot.charge = 1.0
        robot.restart()

    def restart(self, name: str) -> None:
        """Switch a robot off and on; it waits for the remote control."""
        self._arena.robot(name).restart()

    def reset_link(self, name: str) -> None:
        """Make it possible to connect to a robot again."""
        self._arena.robot(name).line.restore()

    def free(self, name: str) -> None:
        """Lift a robot that is stuck."""
        self._arena.stuck.discard(self._arena.number(name))

    def uncover(self, name: str) -> None:
        """Clear the sight to a robot's marker."""
        self._arena.covered.discard(self._arena.number(name))

    def restart_camera(self) -> None:
        """Bring the camera back to work."""
        self._arena.camera.frozen = self._arena.camera.unplugged = False


class EmulatedLaboratory:
    """Everything that a PC program finds in a laboratory (paper, section 5), and an operator; faults happen on demand.

    Time passes while somebody waits by its `clock`: for a line, an image, or nothing. `faults` are what goes
    wrong, `operator` is who helps, `camera` the one overhead; `names` are those of all robots, agents first,
    then replicas. Numbers of the robots that do not move are `stuck`, of those whose marker is hidden
    `covered`; sizes are `arena_cm` (width, height), and `interval_s`, of a control cycle and between images.

    Parameters
    ----------
    scenario, conditions
        Robots, walls, and the agents' controller; what is not ideal.
    seed
        Of places, noise, batteries and the robots' own choices.
    calibration
        Where the camera is, and its lens; by default above the arena's middle.
    markers, labels
        What the robots wear, agents first; by default triangles, blue ones, and one of another color for each
        replica.
    make_line
        Robot and its name -> the robot's end of a line; by default one in this process, in virtual time.
    """

    def __init__(
        self, scenario: Scenario = LABORATORY, *, conditions: Conditions | None = None, seed: int = 0,
        calibration: Calibration | None = None, markers: Markers | None = None, labels: Sequence[str] = (),
        make_line: Callable[[EmulatedRobot, str], Line] | None = None,
    ) -> None:  # fmt: skip
        remedy = "Give its width_cm and height_cm."
        require(scenario.arena.bounded, "scenario.arena", "have walls", "an unbounded one", remedy)
        rule = f"be at most {len(_REPLICA_COLORS)}, one for each color"
        require(
            labels or scenario.replicas <= len(_REPLICA_COLORS),
            "scenario.replicas",
            rule,
            scenario.replicas,
        )
        self.scenario = scenario
        self.conditions = conditions or Conditions()
        self._seed = seed
        self.arena_cm = sides_cm(scenario)
        self.interval_s = scenario.trial.control_interval_s
        self.clock = VirtualClock()
        self.lock = threading.RLock()
        agents = scenario.agents
        replicas = scenario.replicas
        names_of_agents = [f"agent-{k + 1}" for k in range(agents)]
        names_of_replicas = [f"replica-{k + 1}" for k in range(replicas)]
        self.names = (*names_of_agents, *names_of_replicas)
        self.labels = tuple(labels) or ("blue",) * agents + _REPLICA_COLORS[:replicas]
        self.markers: Markers = markers or TriangleMarkers()
        self.calibration = calibration or overhead_camera(*self.arena_cm)
        streams = np.random.SeedSequence(seed).spawn(4 + 2 * scenario.individuals)
        self._rng, self._air, placing, batteries = map(np.random.default_rng, streams[:4])
        # Each robot and each line has its own: what one draws does not shift the others
        generators = list(map(np.random.default_rng, streams[4:]))

        def open_line(robot: EmulatedRobot, name: str) -> Line:
            rng = generators[scenario.individuals + self.names.index(name)]
            return VirtualLine(robot, name, self.clock, self.conditions.latency_s, rng)

        self._robots = []
        for k, name in enumerate(self.names):
            robot = ArenaRobot(
                name,
                scenario.controller if k < agents else None,
                clock=self.clock.now,
                drift=batteries.uniform(-1, 1) * self.conditions.clock_drift,
                battery_s=batteries.uniform(1, _BEST_BATTERY) * self.conditions.battery_s,
                rng=generators[k],
                make_line=make_line or open_line,
            )
            self._robots.append(robot)
        # Control cycles of real robots are not in step, nor equally long
        clocks = np.random.default_rng([CLOCKS, seed])
        own_phases = self.conditions.own_phases
        robots = scenario.individuals
        phases = _PARTS if own_phases else 1
        self._part_s = self.interval_s / phases
        errors = clocks.uniform(-1, 1, robots) * self.conditions.period_spread * own_phases
        self._periods_s = self.interval_s * (1 + errors)
        self._due_s = clocks.uniform(0, 1, robots) * self.interval_s * own_phases
        self._wheels = np.zeros((robots, 2))
        self.stuck: set[int] = set()
        self.covered: set[int] = set()
        # Images show where robots were: places are kept for as long as a tracker is late
        older = math.ceil(scenario.tracker.delay_s / self.interval_s)
        self._places = deque(
            [initial_poses(scenario, 1, placing)[0]] * 2, maxlen=(_CYCLES + older) * phases
        )
        self._drives = Drives(scenario, scenario.individuals, seed, phases)
        self._jitter = np.random.default_rng([TRACKING, seed])
        self._sight = np.zeros(scenario.individuals, int)
        self._part = 0
        self.camera = ArenaCamera(
            self.clock, self._render, self.interval_s, self.conditions.camera_lag_s
        )
        self.faults = Faults(self)
        self.operator = EmulatedOperator(self)
        self.clock.call_at(0.0, self._advance)

    @property
    def commands(self) -> dict[str, Callable[..., None]]:
        """Name -> what it does: all that the operator can do by hand, and all faults."""
        commands: dict[str, Callable[..., None]] = {}
        for hand in (self.operator, self.faults):
            for name, method in inspect.getmembers(hand, inspect.ismethod):
                # the program asks, nobody types that
                if not name.startswith("_") and name != "ask":
                    commands[_OTHER_NAMES.get(name, name.replace("_", "-"))] = method
        return commands

    @cached_property
    def _eye(self) -> EmulatedCamera:
        equipment: dict[str, Any] = {
            "arena_cm": self.arena_cm,
            "optics": self.conditions.optics,
            "seed": self._seed,
        }
        return EmulatedCamera(self.calibration, self.markers, self.labels, **equipment)

    def _render(self, at_s: float | None) -> np.ndarray:
        tracker = self.scenario.tracker
        now = self.clock.now() if at_s is None else at_s
        deviations = [
            tracker.position_noise_cm,
            tracker.position_noise_cm,
            tracker.heading_noise_rad,
        ]
        poses = self.poses(now - tracker.delay_s)
        poses += self._jitter.standard_normal(poses.shape) * deviations
        return self._eye.render(poses, tuple(self.covered))

    def link(self, name: str) -> Link:
        """Return an open link to a robot, as `open_link` does; raise LinkError if the connection is lost."""
        return self.robot(name).line.link()

    def poses(self, at_s: float | None = None) -> np.ndarray:
        """Return where the robots are now (A, 3), or were at a time of the last cycles: x, y (cm), heading (rad)."""
        if at_s is None:
            at_s = self.clock.now()
        phase = self._part
        while at_s < (phase - 1) * self._part_s and self._part - phase < len(self._places) - 2:
            phase -= 1
        before, after = (self._places[phase - self._part - steps_back] for steps_back in (2, 1))
        displacement = after - before
        displacement[:, 2] = wrap(displacement[:, 2])
        share = np.clip((at_s - (phase - 1) * self._part_s) / self._part_s, 0, 1)
        return np.asarray(before + share * displacement)

    def put(self, name: str, pose: tuple[float, float, float]) -> None:
        """Put a robot at a place inside the arena: x, y (cm), heading (rad)."""
        radius, (width, height) = self.scenario.robot.radius_cm, self.arena_cm
        if not (radius <= pose[0] <= width - radius and radius <= pose[1] <= height - radius):
            refuse("pose", f"be inside the arena of {width} x {height} cm", f"{pose} for {name!r}")
        number = self.number(name)
        for k, poses in enumerate(self._places):
            self._places[k] = poses.copy()
            self._places[k][number] = pose

    def number(self, name: str) -> int:
        return self.names.index(choice("name", name, self.names))

    def robot(self, name: str) -> ArenaRobot:
        return self._robots[self.number(name)]

    def close(self) -> None:
        """End all lines."""
        for robot in self._robots:
            robot.line.close()

    def _advance(self) -> None:
        """Let those whose cycle begins sense and decide, and everybody move for a part of a cycle; schedule the next one."""
        before = self._places[-1]
        now_s = self._part * self._part_s
        acting = np.flatnonzero(self._due_s <= now_s + _EARLY_S).tolist()
        if acting:
            proximity = self._infrared(before)
        for who in acting:
            robot = self._robots[who]
            self._wheels[who] = robot.step(
                self._periods_s[who], int(self._sight[who]), proximity[who]
            )
            pause_s = robot.emulated.take_pause(self.interval_s)
            self._due_s[who] += self._periods_s[who] + pause_s * self.conditions.own_phases
        wheels = self._wheels.copy()
        stuck = list(self.stuck)
        wheels[stuck] = 0.0
        after, self._sight = self._move(before, wheels, acting)
        after[stuck] = before[stuck]
        self._places.append(after)
        self._part += 1
        self.clock.call_at(self._part * self._part_s, self._advance)

    def _infrared(self, poses: np.ndarray) -> Sequence[Sequence[int]]:
        """Return the infrared readings (A, 8) of robots at poses (A, 3)."""
        readings = read_infrared(poses, self.arena_cm, self.scenario.robot.radius_cm, self._air)
        return readings.tolist()

    def _move(
        self, poses: np.ndarray, wheels: np.ndarray, acting: list[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return poses (A, 3) after a part of a cycle with wheel speeds (A, 2), and readings I (A,)."""
        return self._drives.move(poses, wheels, int(self._rng.integers(2**63)), acting)


def usage(laboratory: EmulatedLaboratory) -> Iterator[tuple[str, str]]:
    """Yield each command with its arguments, and what it does."""
    for name, method in laboratory.commands.items():
        typed = " ".join([name, *map(str.upper, inspect.signature(method).parameters)])
        yield typed, (inspect.getdoc(method) or "").split("\n")[0]


def obey(laboratory: EmulatedLaboratory, text: str) -> None:
    """Execute a typed line, a command and its arguments; reject one that makes no sense."""
    name, *arguments = text.split()
    method = laboratory.commands[choice("command", name, laboratory.commands)]
    parameters = inspect.signature(method).parameters.values()
    required = sum(parameter.default is parameter.empty for parameter in parameters)
    expected = " ".join(parameter.name.upper() for parameter in parameters)
    fits = required <= len(arguments) <= len(parameters)
    require(fits, name, f"be followed by {expected or 'nothing'}", repr(text.strip()))
    values: list[Any] = []
    for parameter, word in zip(parameters, arguments, strict=False):
        try:
            values.append(float(word) if parameter.annotation is float else word)
        except ValueError:
            refuse(parameter.name, "be a number", repr(word))
    with laboratory.lock:
        method(*values)


@contextmanager
def as_emulated(laboratory: Laboratory) -> Iterator[Laboratory]:
    """Yield a laboratory in the form that can be rehearsed, for `rehearse` and the run: marked as emulated, and so are its runs.

    It has no landmarks, which are not rendered, and emulated e-pucks before a camera, whatever the real ones
    are. If the file of the calibration does not exist yet, it has that of a camera above the arena's middle, in
    a file that is removed at the end.
    """
    setup = laboratory.setup
    scenario = laboratory.configuration.swarm
    changes: dict[str, object] = {"landmarks": {}}
    with TemporaryDirectory() as folder:
        calibrated = (
            setup.camera.calibration is not None and Path(setup.camera.calibration).exists()
        )
        if scenario.arena.bounded and not calibrated:
            changes["calibration"] = str(Path(folder) / "camera.json")
            overhead_camera(*sides_cm(scenario)).save(Path(folder) / "camera.json")
        plain: dict[str, object] = {"emulated": True, "open_replica": None, "tracker": None}
        # Robots that no camera tracks wear no markers of ours; emulated ones need some
        if setup.tracker:
            changes["markers"] = "aruco"
            marked = []
            for number, robot in enumerate(setup.robots):
                marked.append(robot.model_copy(update={"marker": str(number)}))
            plain["robots"] = tuple(marked)
        plain["camera"] = setup.camera.model_copy(update=changes)
        yield replace(laboratory, setup=setup.model_copy(update=plain))


class Simulator(Protocol):
    """A simulator that owns its time, as Webots, ARGoS and Gazebo do. A robots are in the order agents, replicas."""

    def step(self, dt_s: float, wheels: np.ndarray) -> np.ndarray:
        """Let a time pass with wheel speeds (A, 2), left and right, fractions of the largest; return the poses (A, 3) then.

        These are x, y (cm) and heading (rad), anticlockwise from x.
        """

    def sights(self) -> Sequence[int]:
        """Return the reading I of each robot's line-of-sight sensor (A,): 1 if a robot is ahead."""

    def proximity(self) -> Sequence[Sequence[int]]:
        """Return infrared readings (A, 8) as of e-pucks: 60 with nothing near, 400 and more at a wall (`read_infrared`)."""


class _SupervisedLaboratory(EmulatedLaboratory):
    """Robots with their programs, whose bodies are in a simulator."""

    def __init__(self, simulator: Simulator, scenario: Scenario, seed: int) -> None:
        super().__init__(scenario, seed=seed, labels=("robot",) * scenario.individuals)
        self._simulator = simulator

    def _infrared(self, poses: np.ndarray) -> Sequence[Sequence[int]]:
        return self._simulator.proximity()

    def _move(
        self, poses: np.ndarray, wheels: np.ndarray, acting: list[int]
    ) -> tuple[np.ndarray, np.ndarray]:
        after = self._simulator.step(self._part_s, wheels)
        moved = array("poses", after, "A 3", A=len(poses))
        return moved.copy(), np.array(self._simulator.sights(), int)


class _KnownPoses(PoseSource):
    """The poses that a simulator says, at the moments at which a camera would take images."""

    def __init__(self, laboratory: EmulatedLaboratory, labels: Sequence[str]) -> None:
        self._laboratory = laboratory
        self._labels = tuple(labels)

    def track(self, begin_s: float, images: int) -> Track:
        clock = self._laboratory.clock
        interval_s = self._laboratory.interval_s
        first_s = max(begin_s, clock.now())
        poses = []
        for image in range(images):
            clock.sleep_until(first_s + image * interval_s)
            poses.append(self._laboratory.poses())
        present = np.ones((images, len(self._labels)), bool)
        return Track(np.array(poses), present, self._labels, interval_s)

    def close(self) -> None:
        """Release nothing."""


def supervise(laboratory: Laboratory, simulator: Simulator, seed: int | None = None) -> Equipment:
    """Return the devices of a laboratory whose robots are in a simulator that owns its time.

    The robots' programs, with their loop and their clocks, run here, over lines in virtual time; time passes as
    fast as the simulator steps. All robots need addresses, which may be any. The seed of phases and of the robots'
    own choices is that of the run if None. See docs/robots/any-robot.md.
    """
    setup = laboratory.setup
    configuration = laboratory.configuration
    if seed is None:
        seed = configuration.run.seed
    emulated = _SupervisedLaboratory(simulator, configuration.swarm, seed)
    poses = _KnownPoses(emulated, setup.labels)
    return _virtual_equipment(laboratory, emulated, poses)


def _virtual_equipment(
    laboratory: Laboratory, emulated: EmulatedLaboratory, poses: PoseSource
) -> Equipment:
    """Return the devices of an emulated laboratory, at the addresses of a laboratory's file."""
    names = {}
    robots = (*laboratory.setup.agents, *laboratory.setup.replicas)
    for robot, name in zip(robots, emulated.names, strict=True):
        if robot.address:
            names[str(robot.address)] = name
    return Equipment(
        emulated.clock,
        lambda address: EPuck(emulated.link(names[address])),
        lambda: poses,
        emulated.operator,
    )


def rehearse(laboratory: Laboratory, seed: int | None = None) -> Equipment:
    """Return the devices of an emulated laboratory with the robots, the arena and the calibration of a run.

    Time passes as fast as the computer can. The seed of places, noise and batteries is that of the run if None;
    a resumed run should not meet the same noise again. Raise ConfigurationError for a calibration that cannot
    be read, or an unknown marker.
    """
    setup = laboratory.setup
    configuration = laboratory.configuration
    tracker = laboratory_tracker(setup, configuration.swarm.robot)
    with refusing_as(ConfigurationError):
        scenario = configuration.swarm
        if seed is None:
            seed = configuration.run.seed
        equipment: dict[str, Any] = {
            "calibration": tracker.calibration,
            "markers": tracker.markers,
            "labels": setup.labels,
        }
        emulated = EmulatedLaboratory(scenario, seed=seed, **equipment)
    return _virtual_equipment(
        laboratory, emulated, CameraPoses(emulated.camera, tracker, emulated.clock)
    )


class SimulatedLaboratory(Source):
    """The counterpart of `LaboratorySource` in plain simulation (paper, section 5.4), without links, images and
    sensors: robots begin each trial at places drawn uniformly; a wall only stops them. The seed is that of
    `observe`.
    """

    whole_batches = True

    def __init__(self, scenario: Scenario, seed: int = 0, *, of_trials: bool = False) -> None:
        self._scenario = scenario
        self._seed = seed
        self.together = scenario.replicas
        self.ends = WHEEL_SPEED_RANGE if of_trials else None

    def to_units(self, models: np.ndarray) -> np.ndarray:
        return models if self.ends else np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        return self.observe(self.to_units(models), rng=rng)

    def observe(
        self, speeds: np.ndarray, stage: str = "", rng: np.random.Generator | None = None
    ) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`. Each stage has its own random numbers."""
        rng = rng or np.random.default_rng([REHEARSAL, self._seed, *stage.encode()])
        scenario = self._scenario
        trials, remainder = divmod(len(speeds), scenario.replicas)
        rule = f"be a multiple of {scenario.replicas} replicas, not 0"
        require(trials and not remainder, "models", rule, len(speeds))
        executed = alone(scenario, trials)
        executed[:, scenario.agents :] = np.arange(len(speeds)).reshape(trials, -1)
        motion = Trials.draw(scenario, executed, rng).observe(Behavior(speeds), 1)
        return trial_samples(motion, scenario.replicas)
