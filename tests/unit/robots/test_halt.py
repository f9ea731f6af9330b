"""Robots stand when the PC says so, and when it is no longer there."""

import subprocess
import sys
import time

import numpy as np
import pytest
from arena_laboratories import SMALL
from robot_bodies import Body, Clock

from turing_learning.robots import ArenaService, EPuck, Model, open_link
from turing_learning.robots._link import sealed
from turing_learning.robots.emulation import obey
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot
from turing_learning.robots.emulation._lines import TcpServer

ALIVE = (sealed("X,A") + "\r").encode()
MODEL = (sealed("X,M,1,5000,5000,5000,5000") + "\r").encode()
PC = """
import sys, time
from turing_learning.robots import EPuck, Model, open_link
EPuck(open_link(sys.argv[1], alive_s=0.5)).send_model(Model(1, (0.5, 0.4, 0.5, 0.4)))
print("there", flush=True)
time.sleep(600)
"""


class Replica:
    """A replica in its loop, stepped by hand ten times a second, and a PC that talks to it."""

    def __init__(self):
        self.clock, self.signals, self.cycle = Clock(), [], 0
        self.robot = EmulatedRobot(
            Body(), clock=self.clock, tell=self.signals.append, rng=np.random.default_rng(1)
        )
        self.robot.receive(MODEL)
        self.robot.start(0.0)

    def go(self, seconds, alive=True):
        """Return the states that it was in, and in which of them it moved."""
        states, moved = [], set()
        for _ in range(round(10 * seconds)):
            if alive and self.cycle % 5 == 0:
                assert self.robot.receive(ALIVE) == b""
            self.clock.now = 0.1 * self.cycle
            if self.robot.step(self.clock.now, 0, (60,) * 8) != (0.0, 0.0):
                moved.add(self.robot.state)
            states.append(self.robot.state)
            self.cycle += 1
        return list(dict.fromkeys(states)), moved


def test_a_replica_that_is_halted_stands_and_waits_for_the_remote_control():
    robot = EmulatedRobot(Body(), clock=Clock())
    robot.receive(MODEL + b"D,300,300\r")
    robot.enter("R3")
    assert robot.receive(b"X,H*B1B4\r") == b"x,H*3772\r\n"
    assert (robot.state, robot.executing, robot.wheels) == ("R0", None, (0, 0))


def test_the_driver_halts_a_replica():
    robot = EmulatedRobot(Body())
    with TcpServer(robot) as server, open_link(server.port) as link:
        epuck = EPuck(link, timeout_s=20.0)
        epuck.send_model(Model(1, (0.1, 0.2)))
        robot.enter("R5")
        epuck.halt()
        assert epuck.status().state == "R0"


def test_a_replica_stands_when_its_pc_is_gone_and_goes_on_when_it_is_back():
    replica = Replica()
    assert replica.go(18.0) == (["R1", "R2", "R3", "R4", "R5"], {"R2", "R5"})
    replica.go(3.0)
    replica.go(2.1, alive=False)
    states, moved = replica.go(12.9, alive=False)
    assert (states, moved) == (["R2", "R3", "R4", "R5"], set())
    assert replica.go(18.0)[1] == {"R2", "R5"}


def test_a_trial_in_which_a_replica_stood_is_not_reported_as_done():
    replica = Replica()
    replica.go(12.0)
    replica.go(4.0, alive=False)
    replica.go(20.0)
    assert replica.signals == ["STOP", "START", "START"]
    replica.go(1.0)
    assert replica.signals[3:] == ["STOP"]


@pytest.mark.parametrize(("alive", "asked"), [(False, True), (True, True), (False, False)])
def test_a_replica_that_is_asked_nothing_for_five_loops_halts_unless_it_never_met_a_pc(
    alive, asked
):
    replica = Replica()
    if not asked:
        replica.robot.restart()
        replica.robot.start(0.0)
    replica.go(5 * 18.0, alive)
    assert replica.robot.state != "R0"
    replica.go(1.0, alive)
    assert (replica.robot.state == "R0") == asked
    assert asked or replica.go(18.0, alive)[1] == {"R2"}


@pytest.mark.parametrize("lines", ["terminal", "tcp"])
def test_an_emulated_robot_stands_within_three_seconds_after_its_pc_was_killed(lines):
    with ArenaService(SMALL, lines=lines) as service:
        laboratory = service.laboratory
        for name in ("agent-1", "agent-2", "agent-3", "replica-2"):
            obey(laboratory, f"stick {name}")  # so that nobody pushes it

        def state_and_pose():
            with laboratory.lock:
                return laboratory.robot("replica-1").emulated.state, laboratory.poses()[3].tolist()

        address = service.addresses["replica-1"]
        with subprocess.Popen(
            [sys.executable, "-c", PC, address], stdout=subprocess.PIPE, text=True
        ) as pc:
            assert pc.stdout.readline() == "there\n"
            obey(laboratory, "remote")
            before, deadline = state_and_pose()[1], time.monotonic() + 60
            while state_and_pose()[1] == before:
                assert time.monotonic() < deadline
                time.sleep(0.01)
            pc.kill()
        killed_s = laboratory.clock.now()
        while laboratory.clock.now() < killed_s + 3.0:
            time.sleep(0.01)
        state, stands = state_and_pose()
        while laboratory.clock.now() < killed_s + 4.0:
            time.sleep(0.01)
        assert state == "R2"  # in which it would move
        assert state_and_pose()[1] == stands
