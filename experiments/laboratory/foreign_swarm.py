"""Robots, a tracker and a clock that share nothing with the package: written from docs/robots/*.md, as a stranger would.

A kinematic swarm of disks on two wheels, in its own virtual time. Each robot acts at its own ticks, whose periods differ by
up to 0.5 %. When it begins to execute a model its first tick comes after its own share of a cycle, always the same unless it
is `redrawn`.
"""
# ruff: noqa: D102  the protocols say what methods do

import heapq
import math
from collections import deque
from collections.abc import Callable, Sequence
from itertools import count

import numba
import numpy as np

from turing_learning.robots import Equipment, Model, Signal, Status, Track

TOP_CM_S, AXLE_CM, RADIUS_CM = 15.0, 8.0, 5.0
WIDTH_CM, HEIGHT_CM = 200.0, 225.0
CYCLE_S = 0.1
WHEEL_NOISE = 0.03  # of a wheel's speed, at most, drawn at each tick
STAND, ROAM, OBEY = range(3)  # what a robot does at a tick
KINDS = ("step", "fixed", "replicas", "redrawn")
"""Phases: all the same; each robot's own, for ever; replicas draw theirs anew in each trial; all robots do."""
TRACKERS = ("moment", "grid")
"""Poses at the moments that the program names, or the next images of a camera that takes ten in a second."""


@numba.njit(cache=True)
def sees(poses, who):
    """Return 1 if another robot is straight ahead, else 0."""
    x, y, heading = poses[who]
    along, aside = math.cos(heading), math.sin(heading)
    for other in range(len(poses)):
        dx, dy = poses[other, 0] - x, poses[other, 1] - y
        ahead = dx * along + dy * aside
        if other != who and ahead > 0 and abs(dy * along - dx * aside) < RADIUS_CM:
            return 1
    return 0


@numba.njit(cache=True)
def blocked(poses, who):
    """Say whether a wall or a robot is 5 cm ahead, or nearer."""
    x, y, heading = poses[who]
    x += (RADIUS_CM + 5) * math.cos(heading)
    y += (RADIUS_CM + 5) * math.sin(heading)
    if not (0 < x < WIDTH_CM and 0 < y < HEIGHT_CM):
        return True
    apart = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
    apart[who] = np.inf
    return apart.min() < RADIUS_CM + 1


@numba.njit(cache=True)
def drive(poses, wheels, seconds):
    """Move robots whose wheels turn as they do; those that touch push each other, and walls hold them."""
    for who in range(len(poses)):
        speed = (wheels[who, 0] + wheels[who, 1]) / 2 * TOP_CM_S
        turn = (wheels[who, 1] - wheels[who, 0]) / AXLE_CM * TOP_CM_S * seconds
        poses[who, 0] += speed * seconds * math.cos(poses[who, 2] + turn / 2)
        poses[who, 1] += speed * seconds * math.sin(poses[who, 2] + turn / 2)
        poses[who, 2] += turn
    for who in range(len(poses)):
        for other in range(who):
            dx, dy = poses[who, 0] - poses[other, 0], poses[who, 1] - poses[other, 1]
            distance = math.hypot(dx, dy)
            if 0 < distance < 2 * RADIUS_CM:
                share = (2 * RADIUS_CM - distance) / 2 / distance
                poses[who, 0] += dx * share
                poses[who, 1] += dy * share
                poses[other, 0] -= dx * share
                poses[other, 1] -= dy * share
    for who in range(len(poses)):
        poses[who, 0] = min(max(poses[who, 0], RADIUS_CM), WIDTH_CM - RADIUS_CM)
        poses[who, 1] = min(max(poses[who, 1], RADIUS_CM), HEIGHT_CM - RADIUS_CM)


@numba.njit(cache=True)
def act(who, poses, wheels, modes, sides, models, rng):
    """Let a robot set its wheels: stand, roam, or obey its model."""
    if modes[who] == STAND:
        wheels[who] = 0.0
    elif modes[who] == ROAM:
        if not blocked(poses, who):
            sides[who] = 0
            wheels[who] = 0.8
            return
        if sides[who] == 0:
            sides[who] = 1 if rng.random() < 0.5 else -1
        wheels[who, 0] = -0.5 * sides[who]
        wheels[who, 1] = 0.5 * sides[who]
    else:
        state = sees(poses, who)
        for side in range(2):
            noise = 1 + WHEEL_NOISE * (2 * rng.random() - 1)
            wheels[who, side] = models[who, 2 * state + side] * noise


@numba.njit(cache=True)
def pass_time(now, until, ticks, periods, poses, wheels, modes, sides, models, rng):
    """Let everybody act at its ticks, and move, until a time."""
    while True:
        who = np.argmin(ticks)
        next_s = min(ticks[who], until)
        if next_s > now:
            drive(poses, wheels, next_s - now)
            now = next_s
        if ticks[who] > until:
            return
        ticks[who] += periods[who]
        act(who, poses, wheels, modes, sides, models, rng)


class Swarm:
    """The world, and its clock: time passes while the program sleeps."""

    def __init__(
        self, truth: Sequence[float], agents: int = 8, replicas: int = 2, seed: int = 0, kind: str = "fixed"
    ) -> None:  # fmt: skip
        robots = agents + replicas
        self.rng = rng = np.random.default_rng(seed)
        self.time_s = 100.0
        self._events: list[tuple[float, int, Callable[[], None]]] = []
        self._number = count()
        places = []
        for x in np.arange(20, WIDTH_CM - 10, 30):
            for y in np.arange(20, HEIGHT_CM - 10, 30):
                places.append((x, y))
        self.poses = np.empty((robots, 3))
        self.poses[:, :2] = np.array(places)[rng.permutation(len(places))[:robots]]
        self.poses[:, 2] = rng.uniform(-math.pi, math.pi, robots)
        self.wheels = np.zeros((robots, 2))
        self.models = np.tile(np.array(truth), (robots, 1))
        self.periods = CYCLE_S * (1 + 0.005 * rng.uniform(-1, 1, robots))
        self.phases = rng.uniform(0, 1, robots)
        self.redrawn = np.zeros(robots, bool)
        self.redrawn[agents:] = kind in ("replicas", "redrawn")
        self.redrawn[:agents] = kind == "redrawn"
        if kind == "step":
            self.phases[:] = 0
            self.periods[:] = CYCLE_S
        self.ticks = self.time_s + CYCLE_S * self.phases
        self.modes, self.sides = np.zeros(robots, np.int64), np.zeros(robots, np.int64)
        self.robots = [SwarmRobot(self, who) for who in range(robots)]

    def now(self) -> float:
        return self.time_s

    def sleep(self, seconds: float) -> None:
        self.run(self.time_s + max(seconds, 0.0), lambda: False)

    def call_at(self, time_s: float, action: Callable[[], None]) -> None:
        heapq.heappush(self._events, (time_s, next(self._number), action))

    def run(self, until: float, ready: Callable[[], bool]) -> None:
        """Let time pass until then, or until something is ready."""
        while not ready():
            if not self._events or self._events[0][0] > until:
                self._pass_time(until)
                return
            time_s, _, action = heapq.heappop(self._events)
            self._pass_time(max(time_s, self.time_s))
            action()

    def _pass_time(self, until: float) -> None:
        pass_time(
            self.time_s, until, self.ticks, self.periods, self.poses, self.wheels, self.modes, self.sides,
            self.models, self.rng,
        )  # fmt: skip
        self.time_s = until

    def equipment(self, addresses: Sequence[str], tracker: "SwarmPoses") -> Equipment:
        robots = dict(zip(addresses, self.robots, strict=True))
        return Equipment(self, robots.__getitem__, lambda: tracker, Helper())


class Helper:
    """An operator who says that it is done, and remembers what was asked."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def ask(self, what_to_do: str) -> None:
        self.asked.append(what_to_do)


class SwarmRobot:
    """A `Replica`, agents are ones, too: the loop of docs/robots/protocol.md."""

    reconnections = 0

    def __init__(self, swarm: Swarm, who: int) -> None:
        self._swarm, self._who = swarm, who
        self._signals: deque[Signal] = deque()
        self._state, self._since, self._trial = "R0", 0.0, 0
        self._waiting: Model | None = None
        self._executing = -1
        self._loop = 0  # how often it was begun: what an older loop has scheduled does nothing

    def version(self) -> str:
        return "a robot of a foreign swarm"

    def status(self) -> Status:
        waiting = -1 if self._waiting is None else self._waiting.sequence
        in_state_s = self._swarm.now() - self._since
        return Status(self._state, in_state_s, waiting, self._executing, True)

    def start(self) -> None:
        self._loop += 1
        self._after(0.0, self._stop)

    def halt(self) -> None:
        self._loop += 1
        self._state, self._waiting, self._executing = "R0", None, -1
        self._do(STAND)

    def send_model(self, model: Model) -> None:
        self._waiting = model

    def wait_for(self, kind: str, timeout_s: float) -> Signal:
        deadline = self._swarm.now() + timeout_s
        while True:
            while self._signals:
                signal = self._signals.popleft()
                if signal.kind == kind:
                    return signal
            if self._swarm.now() >= deadline:
                raise TimeoutError(f"no {kind} has come")
            self._swarm.run(deadline, lambda: bool(self._signals))

    def drop_signals(self) -> None:
        self._signals.clear()

    def close(self) -> None:
        pass

    def _after(self, seconds: float, action: Callable[[], None]) -> None:
        loop = self._loop
        self._swarm.call_at(
            self._swarm.now() + seconds, lambda: action() if loop == self._loop else None
        )

    def _do(self, mode: int) -> None:
        self._swarm.modes[self._who] = mode
        if mode == STAND:
            self._swarm.wheels[self._who] = 0.0

    def _enter(self, state: str, lasts_s: float, then: Callable[[], None]) -> None:
        self._state, self._since = state, self._swarm.now()
        self._after(lasts_s, then)

    def _tell(self, kind: str) -> None:
        self._signals.append(Signal(kind, self._trial, self._executing, self._swarm.now()))

    def _stop(self) -> None:
        self._do(STAND)
        self._tell("STOP")
        self._enter("R1", 1.0, self._disperse)

    def _disperse(self) -> None:
        self._do(ROAM)
        self._enter("R2", 8.0, self._take_model)

    def _take_model(self) -> None:
        self._do(STAND)
        if self._waiting is not None:
            self._executing = self._waiting.sequence
            self._swarm.models[self._who] = self._waiting.parameters
            self._waiting = None
        self._enter("R3", 1.0, self._announce)

    def _announce(self) -> None:
        self._trial += 1
        self._tell("START")
        self._enter("R4", 1.0, self._execute)

    def _execute(self) -> None:
        swarm = self._swarm
        phase = swarm.phases[self._who]
        if swarm.redrawn[self._who]:
            phase = swarm.rng.random()
        swarm.ticks[self._who] = swarm.now() + CYCLE_S * phase
        self._do(OBEY)
        self._enter("R5", 7.0, self._stop)


class SwarmPoses:
    """A `PoseSource`: poses with noise (cm, cm, rad), a share of the images `lost`, all spoilt by `spoil`."""

    def __init__(
        self, swarm: Swarm, labels: tuple[str, ...], tracker: str = "moment", *, seed: int = 0, lost: float = 0.0,
        noise: Sequence[float] = (0.03, 0.03, 0.005), spoil: Callable[[np.ndarray], np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        self._swarm, self._labels, self._tracker = swarm, labels, tracker
        self._lost, self._noise, self._spoil = lost, noise, spoil
        self._rng = np.random.default_rng([seed, 5])

    def track(self, begin_s: float, images: int) -> Track:
        if self._tracker == "grid":
            begin_s = math.ceil(begin_s / CYCLE_S) * CYCLE_S
        seen: list[np.ndarray] = []
        present = np.ones((images, len(self._labels)), bool)
        for image in range(images):
            self._swarm.sleep(begin_s + image * CYCLE_S - self._swarm.now())
            if image and self._rng.random() < self._lost:
                seen.append(seen[-1])
                present[image] = False
                continue
            poses = self._swarm.poses + self._rng.normal(0, 1, (len(self._labels), 3)) * self._noise
            if self._spoil is not None:
                poses = self._spoil(poses)
            poses[:, 2] = (poses[:, 2] + math.pi) % (2 * math.pi) - math.pi
            seen.append(poses)
        return Track(np.array(seen), present, self._labels, CYCLE_S)

    def close(self) -> None:
        pass
