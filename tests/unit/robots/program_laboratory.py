"""A small laboratory in virtual time for the PC program: real bytes, real images, scripted motion."""

import math
from functools import cache

import numpy as np
from robot_bodies import Body

from turing_learning.robots import (
    CameraPoses,
    EmulatedCamera,
    EPuck,
    Equipment,
    Link,
    Optics,
    Tracker,
    TriangleMarkers,
    overhead_camera,
)
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot

ARENA = (60.0, 68.0)
HOMES = np.array([(15.0, 15.0, 0.3), (45.0, 15.0, 1.5), (15.0, 52.0, -1.0), (45.0, 52.0, 2.5)])
LABELS = ("blue", "blue", "orange", "purple")
NAMES = ("r-orange", "r-purple")
STATES = (("R1", 1.0), ("R2", 8.0), ("R3", 1.0), ("R4", 1.0), ("R5", 7.0))
CALIBRATION = overhead_camera(*ARENA, above_cm=90.0, image_size=(448, 384))


class Wire:
    """The near end of a replica's line, and what a test does to it."""

    def __init__(self, laboratory, robot):
        self._laboratory, self.robot = laboratory, robot
        self.cut = False
        self.silent = False
        self.noise = b""
        self.halve = False
        self._arrived = bytearray()

    @property
    def in_waiting(self):
        self._require()
        return len(self._arrived)

    def read(self, size):
        self._require()
        if not self._arrived:
            # as a real port: back as soon as something comes. To wait out the time would make messages
            # late by what sums of tenths of seconds round to, which differs from session to session
            clock = self._laboratory.clock
            clock.sleep_until(clock.now() + 0.02, lambda: bool(self._arrived) or self.cut)
            self._require()
        data = bytes(self._arrived[:size])
        del self._arrived[:size]
        return data

    def write(self, data):
        self._require()
        self.come(self.robot.receive(data))

    def come(self, data):
        if self.cut or not data:
            return
        data, self.noise = self.noise + data, b""
        if self.halve:
            first, rest = data[: len(data) // 2], data[len(data) // 2 :]
            self._arrived += first
            clock = self._laboratory.clock
            clock.call_at(clock.now() + 0.06, lambda: self._arrived.extend(rest))
        else:
            self._arrived += data

    def connect(self):
        self._require()
        self._arrived.clear()
        return self

    def close(self):
        pass

    def _require(self):
        if self.cut:
            raise OSError("no carrier")


class ScriptedLaboratory:
    """Two agents and two replicas, each in its own corner, driving the arc that the model of I = 0 makes there."""

    agent = (-0.7, -1.0)

    def __init__(self, *, noise=0.0):
        self.clock = VirtualClock()
        self.bodies = [Body() for _ in NAMES]
        self.wires = {
            name: Wire(self, EmulatedRobot(body, clock=self.clock.now))
            for name, body in zip(NAMES, self.bodies, strict=True)
        }
        self._render = EmulatedCamera(
            CALIBRATION,
            TriangleMarkers(),
            LABELS,
            arena_cm=ARENA,
            wall_cm=5.0,
            optics=Optics(noise=noise),
        )
        self._round = 0
        self._since = None
        self.asked = []
        self.heal()
        self.on_ask = lambda what: None
        self.images = 0
        self._next_image = 0.0

    def heal(self):
        """Undo whatever a test has done, as an operator would."""
        self.covered, self.carried, self.stuck, self.frozen, self.dead_camera = (
            (),
            None,
            (),
            None,
            False,
        )
        for wire in self.wires.values():
            wire.cut = wire.silent = wire.halve = False
        for body in self.bodies:
            body.battery = True

    def after(self, seconds, name, value):
        """Set an attribute in a while."""
        self.clock.call_at(self.clock.now() + seconds, lambda: setattr(self, name, value))

    def press_remote(self):
        """Let all robots begin their loops at the next whole second."""
        self._round += 1
        self._enter(0, math.ceil(self.clock.now()) + 1.0, self._round)

    def _enter(self, number, at_s, round_):
        def enter():
            if round_ != self._round:
                return
            state, duration = STATES[number % 5]
            self._state, self._since = state, at_s
            for wire in self.wires.values():
                wire.robot.enter(state)
                kind = {"R1": "STOP", "R4": "START"}.get(state)
                if kind:
                    signal = wire.robot.signal(kind)
                    if not wire.silent:
                        wire.come(signal)
            self._enter(number + 1, at_s + duration, round_)

        self.clock.call_at(at_s, enter)

    def poses(self):
        """Where everybody is now (A, 3)."""
        poses = HOMES.copy()
        running = self._since is not None and self._state == "R5"
        for k in range(4):
            elapsed = (
                round(self.clock.now() - self._since, 6) if running and k not in self.stuck else 0.0
            )
            left, right = self.agent if k < 2 else self._model(k - 2)
            speed, turn = 0.5 * (left + right), right - left
            heading = HOMES[k, 2] + turn * elapsed
            half = 0.5 * turn * elapsed
            way = speed * elapsed * np.sinc(half / math.pi)
            poses[k] += (
                way * math.cos(HOMES[k, 2] + half),
                way * math.sin(HOMES[k, 2] + half),
                0.0,
            )
            poses[k, 2] = heading
        if self.carried is not None and running and self.clock.now() - self._since > 3.5:
            poses[self.carried, :2] = (30.0, 33.0)
        return poses

    def _model(self, replica):
        model = self.wires[NAMES[replica]].robot.executing
        return (0.5, 0.2) if model is None else model.parameters[:2]

    def take(self):
        from turing_learning.robots import CameraError

        if self.dead_camera:
            raise CameraError("`source` must give images; got none more from camera 0.")
        at_s = max(self._next_image, 0.1 * math.ceil(round(self.clock.now() / 0.1, 6)))
        self.clock.sleep_until(at_s)
        self._next_image = at_s + 0.1
        if self.frozen is None:
            self.images += 1
            self.image = self._render.render(self.poses(), self.covered)
        return self.image

    def close(self):
        pass

    def ask(self, what_to_do):
        self.asked.append(what_to_do)
        self.on_ask(what_to_do)
        self.heal()
        self.press_remote()
        if len(self.asked) > 20:
            raise AssertionError(self.asked[-1])

    def open_link(self, address):
        link = Link(address, clock=self.clock, connect=self.wires[address].connect)
        link.open()
        return link

    def open_camera(self):
        return self

    def equipment(self, tracker=None):
        return Equipment(
            self.clock,
            lambda address: EPuck(self.open_link(address)),
            lambda: CameraPoses(self.open_camera(), tracker or new_tracker(), self.clock),
            self,
        )


@cache
def new_tracker():
    return Tracker(TriangleMarkers(), CALIBRATION, LABELS)


FILE = f"""
[camera]
calibration = "camera.json"

[interventions]
batteries_every = 0

[evaluation]
repeats = 0

[[robots]]
name = "a1"
role = "agent"
marker = "blue"

[[robots]]
name = "a2"
role = "agent"
marker = "blue"

[[robots]]
name = "r1"
role = "replica"
marker = "orange"
address = "{NAMES[0]}"

[[robots]]
name = "r2"
role = "replica"
marker = "purple"
address = "{NAMES[1]}"

[models]
population = 4

[classifiers]
population = 8

[scenario.arena]
width_cm = {ARENA[0]}
height_cm = {ARENA[1]}

[scenario.trial]
duration_s = 1.0

[run]
generations = 3
threads = 1
"""
