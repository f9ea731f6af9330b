import numpy as np
import pytest
from robot_bodies import Body, Clock

from turing_learning.robots.emulation._emulated_robot import (
    LOOP,
    OBSTACLE,
    SENSOR_ANGLES,
    WALL,
    EmulatedRobot,
    avoid_walls,
)

NOTHING = (60,) * 8
AGENT = (-0.7, -1.0, 1.0, -1.0)


class Rig:
    """A robot whose program is stepped by hand, ten times a second."""

    def __init__(self, controller=None, rate=1.0, seed=0):
        self.clock, self.rate = Clock(), rate
        self.signals = []
        self.robot = EmulatedRobot(
            Body(),
            clock=self.clock,
            controller=controller,
            tell=lambda kind: self.signals.append((kind, round(self.clock.now, 6))),
            rng=np.random.default_rng(seed),
        )
        self.cycle = 0
        self.entered = {}

    def step(self, sight=0, proximity=NOTHING):
        self.clock.now = self.cycle * 0.1
        wheels = self.robot.step(self.clock.now * self.rate, sight, proximity)
        self.entered.setdefault(self.robot.state, round(self.clock.now, 6))
        self.cycle += 1
        return wheels

    def go_to(self, state, **told):
        wheels = self.step(**told)
        while self.robot.state != state:
            wheels = self.step(**told)
        return wheels


@pytest.fixture
def replica():
    rig = Rig()
    rig.robot.start(0.0)
    return rig


def near(direction_degrees, reading):
    """Readings with one surface at a direction."""
    nearest = np.argmin(
        np.abs(np.angle(np.exp(1j * (SENSOR_ANGLES - np.radians(direction_degrees)))))
    )
    return tuple(reading if k == nearest else 60 for k in range(8))


def test_the_states_last_as_long_as_in_the_paper(replica):
    for _ in range(181):
        replica.step()
    assert replica.entered == {"R1": 0.0, "R2": 1.0, "R3": 9.0, "R4": 10.0, "R5": 11.0}
    assert replica.robot.state == "R1"
    assert sum(LOOP.values()) == 18.0


def test_a_replica_signals_stop_in_r1_and_start_in_r4(replica):
    for _ in range(300):
        replica.step()
    assert replica.signals == [("STOP", 0.0), ("START", 10.0), ("STOP", 18.0), ("START", 28.0)]


def test_an_agent_goes_through_the_same_states_and_signals_no_model():
    agent = Rig(AGENT)
    agent.robot.start(0.0)
    for _ in range(300):
        agent.step()
    assert agent.entered == {"R1": 0.0, "R2": 1.0, "R3": 9.0, "R4": 10.0, "R5": 11.0}
    assert [kind for kind, _ in agent.signals] == ["STOP", "START", "STOP", "START"]
    assert agent.robot.signal("STOP").startswith(b"x,STOP,0,-1*")


def test_a_robot_with_a_slow_clock_is_late_and_does_not_add_up_its_cycles():
    slow = Rig(rate=1 / 1.001)
    slow.robot.start(0.0)
    for _ in range(18 * 100 * 10):
        slow.step()
    starts = [time for kind, time in slow.signals if kind == "START"]
    assert starts[0] == pytest.approx(10.01, abs=0.1)
    assert starts[-1] == pytest.approx((10 + 18 * (len(starts) - 1)) * 1.001, abs=0.1)


def test_a_robot_that_waits_for_the_remote_control_obeys_the_pc():
    rig = Rig()
    rig.robot.receive(b"D,300,-200\r")
    assert rig.step() == (0.3, -0.2)
    assert rig.robot.state == "R0"
    assert rig.signals == []


def test_a_robot_stands_still_while_it_talks(replica):
    for state in ("R1", "R3", "R4"):
        assert replica.go_to(state, sight=1) == (0.0, 0.0)


def test_the_model_that_came_in_time_is_executed_by_what_is_seen(replica):
    replica.go_to("R2")
    replica.robot.receive(b"X,M,17,-7000,-10000,10000,-9000*")  # without its checksum: not taken
    replica.robot.receive(b"\r")
    replica.go_to("R3")
    assert replica.robot.executing is None
    assert replica.go_to("R5") == (0.0, 0.0)
    replica.go_to("R2")
    replica.robot.receive(b"X,M,17,-7000,-10000,10000,-10000*D1F2\r")
    replica.go_to("R5")
    assert replica.step(sight=0) == (-0.7, -1.0)
    assert replica.step(sight=1) == (1.0, -1.0)


def test_an_agent_executes_its_own_controller():
    agent = Rig(AGENT)
    agent.robot.start(0.0)
    agent.go_to("R5")
    assert [agent.step(sight=0), agent.step(sight=1)] == [(-0.7, -1.0), (1.0, -1.0)]


def test_the_remote_control_begins_the_loop_anew(replica):
    replica.go_to("R5")
    replica.robot.start(replica.clock.now)
    assert replica.robot.state == "R1"
    before = replica.clock.now
    replica.go_to("R2")
    assert replica.clock.now - before == pytest.approx(1.0, abs=1e-6)


def test_a_reset_by_the_pc_ends_the_loop(replica):
    replica.go_to("R5")
    replica.robot.receive(b"R\r")
    assert replica.step() == (0.0, 0.0)
    assert replica.robot.state == "R0"


def test_a_dispersing_robot_turns_to_anywhere_and_then_drives_straight(replica):
    replica.go_to("R2")
    wheels = [replica.step() for _ in range(70)]
    turning = [left + right == 0 for left, right in wheels]
    assert sum(turning) <= 13
    assert wheels[-1] == (1.0, 1.0)


def test_dispersing_robots_turn_to_different_directions():
    turns = set()
    for seed in range(12):
        rig = Rig(seed=seed)
        rig.robot.start(0.0)
        rig.go_to("R2")
        wheels = [rig.step() for _ in range(14)]
        turns.add((wheels[0], sum(left + right == 0 for left, right in wheels)))
    assert len(turns) >= 8


@pytest.mark.parametrize(
    ("direction", "turns"), [(17, True), (-47, True), (90, False), (151, False)]
)
def test_a_dispersing_robot_turns_where_something_is_in_its_way(replica, direction, turns):
    replica.go_to("R2")
    for _ in range(20):
        replica.step()
    left, right = replica.step(proximity=near(direction, OBSTACLE))
    assert (left + right == 0) == turns
    assert replica.step(proximity=near(direction, OBSTACLE - 1))[0] == (left if turns else 1.0)


@pytest.mark.parametrize("direction", [17, -17, 47, -47, 90, -90])
def test_a_wall_before_a_robot_that_drives_forward_turns_it_its_own_way(direction):
    wall = near(direction, WALL)
    assert avoid_walls((0.5, 1.0), wall) == (-1.0, 1.0)
    assert avoid_walls((1.0, 0.5), wall) == (1.0, -1.0)
    assert avoid_walls((1.0, 1.0), wall) == (-1.0, 1.0)


def test_a_wall_behind_a_robot_that_drives_backward_turns_it_its_own_way():
    assert avoid_walls((-0.7, -1.0), near(151, WALL)) == (1.0, -1.0)
    assert avoid_walls((-1.0, -0.7), near(-151, WALL)) == (-1.0, 1.0)


@pytest.mark.parametrize(
    ("wheels", "direction"),
    [
        ((1.0, 1.0), 151),
        ((-0.7, -1.0), 17),
        ((-0.7, -1.0), 47),
        ((1.0, -1.0), 17),
        ((0.0, 0.0), 17),
    ],
)
def test_a_wall_that_is_not_in_the_way_changes_nothing(wheels, direction):
    assert avoid_walls(wheels, near(direction, 4000)) == wheels


def test_what_is_too_dark_for_a_wall_changes_nothing():
    assert avoid_walls((1.0, 1.0), near(17, WALL - 1)) == (1.0, 1.0)


def test_walls_are_avoided_in_the_trial_and_robots_only_while_dispersing():
    agent = Rig(AGENT)
    agent.robot.start(0.0)
    agent.go_to("R5")
    assert agent.step(proximity=near(151, OBSTACLE)) == (-0.7, -1.0)
    assert agent.step(proximity=near(151, WALL)) == (1.0, -1.0)
