import struct

import pytest
from robot_bodies import Body, Clock

from turing_learning.robots import EPuck, Link, LinkError, Model, open_link
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots._link import RESYNCHRONIZE
from turing_learning.robots.emulation._emulated_robot import NOT_FOUND, EmulatedRobot
from turing_learning.robots.emulation._lines import TcpServer, TerminalServer


@pytest.fixture
def body():
    return Body()


@pytest.fixture
def robot(body):
    return EmulatedRobot(body, clock=Clock())


@pytest.fixture(params=[TcpServer, TerminalServer])
def served(request, robot):
    with request.param(robot) as server:
        yield server


@pytest.fixture
def epuck(served):
    with open_link(served.port) as link:
        yield EPuck(link, timeout_s=20.0, retries=1)


def test_the_driver_speaks_with_a_robot_over_tcp_and_serial(epuck, robot, body):
    assert epuck.version() == "Version 1.2.2 emulated"
    epuck.set_speed(-300, 450)
    assert robot.wheels == (-300, 450)
    assert epuck.speed() == (-300, 450)
    assert epuck.proximity() == body.readings
    assert epuck.battery_ok()
    epuck.stop()
    assert robot.wheels == (0, 0)
    assert epuck.garbled == 0


def test_one_binary_request_sets_speeds_and_reads_proximity(epuck, robot, body):
    epuck.version()
    assert epuck.drive(-1000, 12) == body.readings
    assert robot.wheels == (-1000, 12)


def test_a_model_arrives_and_is_told_by_the_status(epuck, robot):
    epuck.send_model(Model(9, (0.12344, -1.0, 1.0, 0.0)))
    assert epuck.status().waiting == 9
    robot.enter("R3")
    status = epuck.status()
    assert (status.state, status.waiting, status.executing, status.battery_ok) == (
        "R3",
        -1,
        9,
        True,
    )
    assert robot.executing.parameters == (0.1234, -1.0, 1.0, 0.0)


def test_signals_are_waited_for_and_kept_while_commands_are_answered(epuck, served):
    epuck.version()
    served.signal("START")
    assert epuck.speed() == (0, 0)
    assert epuck.wait_for("START", 20.0).trial == 1
    served.signal("STOP")
    assert epuck.wait_for("STOP", 20.0).sequence == -1


def test_a_signal_that_does_not_come_is_told(epuck, served):
    epuck.version()
    with pytest.raises(
        TimeoutError,
        match=r"`START` must be signalled within 0\.05 s; got nothing from .*Check the",
    ):
        epuck.wait_for("START", 0.05)


def test_the_robot_greets_again_after_a_reset(epuck):
    epuck.reset()
    assert epuck.version().startswith("Version")


def test_a_port_that_does_not_exist_is_refused():
    with pytest.raises(
        LinkError,
        match=r"at which a robot listens; got '/dev/no-robot' .*Check that the robot is switched",
    ):
        open_link("/dev/no-robot")


def test_a_link_that_is_closed_is_refused(served):
    link = open_link(served.port)
    link.close()
    with pytest.raises(LinkError, match=r"`link` to .* must be open; got a closed one\. Open it"):
        link.send(b"V\r")


def test_without_pyserial_the_extra_is_named(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(
        ImportError,
        match=r"pyserial must be installed; got no such module\. Run: pip install 'turing-learning\[robot\]'",
    ):
        open_link("/dev/ttyS0")


def test_speeds_beyond_the_maximum_are_refused(epuck):
    with pytest.raises(ValueError, match="`left` must be an integer from -1000 to 1000; got 1001"):
        epuck.set_speed(1001, 0)


def test_a_signal_of_another_kind_is_refused(epuck):
    with pytest.raises(ValueError, match="`kind` must be one of START, STOP; got 'GO'"):
        epuck.wait_for("GO", 1.0)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"timeout_s": 0}, "`timeout_s` must be a finite number above 0; got 0"),
        ({"retries": -1}, "`retries` must be an integer of at least 0; got -1"),
    ],
)
def test_settings_of_the_driver_are_checked(settings, message):
    with pytest.raises(ValueError, match=message):
        EPuck(None, **settings)


@pytest.mark.parametrize(
    ("sequence", "parameters", "message"),
    [
        (65536, (0.0,), "`sequence` must be an integer from 0 to 65535; got 65536"),
        (1, (), "`parameters` must be 1 to 16 numbers; got 0"),
        (
            1,
            (1.2, 0.0),
            r"`parameters` must be in \[-1, 1\]; got \[1\.2, 0\.0\]\. Apply tanh before",
        ),
        (1, (float("nan"),), r"`parameters` must be in \[-1, 1\]; got \[nan\]"),
    ],
)
def test_a_model_that_no_robot_can_execute_is_refused(sequence, parameters, message):
    with pytest.raises(ValueError, match=message):
        Model(sequence, parameters)


class Babbler:
    """A line on which something never stops to arrive."""

    in_waiting = 8

    def __init__(self, clock, data):
        self.clock, self.data = clock, data

    def read(self, size):
        self.clock.sleep(0.01)
        return self.data

    def write(self, data):
        pass

    def close(self):
        pass


@pytest.mark.parametrize("data", [b"noise...", b"babble\r\n"])
def test_a_peer_that_never_stops_sending_does_not_hang_the_driver(data):
    clock = VirtualClock()
    link = Link("line", clock=clock, connect=lambda: Babbler(clock, data))
    link.open()
    robot = EPuck(link, timeout_s=0.5, retries=0)
    with pytest.raises(LinkError, match="must answer 'V'; got no answer that makes sense"):
        robot.version()
    with pytest.raises(TimeoutError, match="`START` must be signalled"):
        robot.wait_for("START", 1.0)
    assert clock.now() < 10


class Recorded:
    """A line on which each command has the bytes that a robot of another firmware answers."""

    def __init__(self, clock, answers):
        self.clock, self.answers, self.arrived, self.sent = clock, answers, b"", b""

    @property
    def in_waiting(self):
        return len(self.arrived)

    def read(self, size):
        self.clock.sleep(0.01)
        data, self.arrived = self.arrived[:size], self.arrived[size:]
        return data

    def write(self, data):
        self.sent += data
        self.arrived += self.answers.get(data, b"")

    def close(self):
        pass


def recorded(answers):
    clock = VirtualClock()
    line = Recorded(clock, answers)
    link = Link("line", clock=clock, connect=lambda: line)
    link.open()
    return EPuck(link, timeout_s=0.5, retries=1), line


@pytest.mark.parametrize(
    ("answer", "good"),
    [
        (b"b,1\r\n", True),
        (b"b,0\r\n", False),
        (b"b,1034 (87%)\r\n", True),
        (b"b,870 (9%)\r\n", False),
    ],
)
def test_the_battery_of_an_epuck_and_of_an_epuck2_is_understood(answer, good):
    robot, _ = recorded({b"b\r": answer})
    assert robot.battery_ok() is good
    assert robot.garbled == 0


def test_a_reset_that_no_robot_answers_is_followed_by_its_version():
    welcome = b'\f\aWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
    robot, line = recorded(
        {b"V\r": welcome + b"v,Version 1.1.3 March 2010 (Michael Bonani)\r\nHW version: 0\r\n"}
    )
    robot.reset()
    assert line.sent.endswith(b"R\rV\r")
    assert robot.version().startswith("Version 1.1.3")
    assert robot.garbled == 0


@pytest.mark.parametrize(
    "broken", [b"D,900,9", b"\xbc\x2c\x01", b"\xbc\x2c\x01\x2c\x01", b"V\r\n", b"", b"\xff"]
)
def test_a_broken_command_is_ended_stopped_and_followed_by_any_other(robot, body, broken):
    robot.receive(b"D,300,300\r" + broken)
    robot.receive(RESYNCHRONIZE)
    assert robot.wheels == (0, 0)
    assert robot.receive(b"\xb2\0") == struct.pack("<8h", *body.readings)


def test_an_epuck_without_the_firmware_of_a_replica_is_named(robot, monkeypatch):
    obey = robot._obey
    monkeypatch.setattr(
        robot, "_obey", lambda line: NOT_FOUND if line.startswith("X") else obey(line)
    )
    with TcpServer(robot) as server, open_link(server.port) as link:
        epuck = EPuck(link, timeout_s=20.0, retries=1)
        assert epuck.version().startswith("Version")
        with pytest.raises(LinkError, match="an ordinary e-puck without replica firmware"):
            epuck.status()
