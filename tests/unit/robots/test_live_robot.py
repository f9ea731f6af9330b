"""The program of a robot whose computer runs Python: it survives its peers and its hardware, and stands when nobody is there."""

import re
import socket
import threading
import time
import tracemalloc

import numpy as np
import pytest
from robot_bodies import Body, Clock, PublicClient

from turing_learning.robots import EPuck, LinkError, Model, live
from turing_learning.robots._clock import RealClock
from turing_learning.robots._link import sealed
from turing_learning.robots.emulation import _lines
from turing_learning.robots.emulation._emulated_robot import ALONE_S, LARGEST_ANSWER, EmulatedRobot
from turing_learning.robots.emulation._lines import TcpServer

QUIET = (60,) * 8


def message(text):
    return (sealed(text) + "\r").encode()


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def robot(clock):
    return EmulatedRobot(Body(), clock=clock)


def test_a_position_beyond_16_bits_does_not_deafen_the_robot(robot):
    assert robot.receive(b"D,500,500\rP,99999,5\r") == b"d\r\np\r\n"
    assert robot.receive(b"\0\xaf\0") == (32767).to_bytes(2, "little") + b"\5\0"
    assert robot.receive(b"S\r") == b"s\r\n"
    assert robot.wheels == (0, 0)


def test_readings_beyond_16_bits_are_sent_as_the_firmware_sends_them(robot):
    robot._body.readings = (70_000, -1, 0, 0, 0, 0, 0, 0)
    assert robot.receive(b"\0\xb2\0")[:4] == bytes([0x70, 0x11, 0xFF, 0xFF])


def test_forty_thousand_requests_of_an_image_take_little_memory(robot):
    robot.receive(b"J,1,255,128,8\r\0")
    tracemalloc.start()
    longest = max(len(robot.receive(b"\xb7" * 4000)) for _ in range(10))
    longest = max(longest, len(robot.receive(b"\0" + b"\xb7\0" * 20_000)))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert longest <= LARGEST_ANSWER
    assert peak < 2_000_000


def test_an_image_that_is_larger_than_the_buffer_becomes_the_usual_one(robot):
    assert (
        robot.receive(b"J,1,255,128,8\rI\r") == b"j\r\ni,1,40,40,8,3200\r\n"
    )  # as in the makers' Asercom.c


def test_a_battery_that_cannot_be_read_costs_its_answer_alone(robot):
    def broken():
        raise OSError("no answer")

    robot._body.battery_ok = broken
    assert robot.receive(b"b\r") == b""
    assert robot.receive(b"\0\x9e\xbb\0") == bytes(4)
    assert robot.receive(b"E\r") == b"e,0,0\r\n"


@pytest.mark.parametrize(
    ("line", "answer", "wheels"),
    [
        (b"D,1500,-2000", b"e,1500,-2000", (1000, -1000)),
        (b"D,+50,60", b"e,50,60", (50, 60)),
        (b"D,1.5,2", b"e,1,8", (1, 8)),
        (b"D, 3,\t4", b"e,3,4", (3, 4)),
        (b"D;3,4", b"e,7,8", (7, 8)),
    ],
)
def test_speeds_are_read_and_told_as_both_firmwares_do(robot, line, answer, wheels):
    assert robot.receive(b"D,7,8\r" + line + b"\rE\r") == b"d\r\nd\r\n" + answer + b"\r\n"
    assert robot.wheels == wheels


def test_wheels_that_a_client_has_set_stand_when_nothing_is_heard(robot, clock):
    robot.receive(b"D,500,500\r")
    clock.now = ALONE_S - 0.1
    robot.receive(b"E\r")
    clock.now = 2 * ALONE_S - 0.2
    assert robot.step(clock.now, 0, QUIET) == (0.5, 0.5)
    robot.receive(b"\r\n?\r\xff\0X,Q*0000\r")  # makes no sense
    clock.now += 0.2
    assert robot.step(clock.now, 0, QUIET) == (0.0, 0.0)


def test_a_robot_that_a_pc_has_started_stands_when_nothing_is_heard(robot, clock):
    robot.receive(message("X,M,1,5000,5000,5000,5000") + message("X,G"))
    moved_s = 0.0
    for cycle in range(1, 1000):
        clock.now = 0.1 * cycle
        if robot.step(clock.now, 0, QUIET) != (0.0, 0.0):
            moved_s = clock.now
    assert 1.0 < moved_s <= ALONE_S + 0.1


def some_bytes(rng):
    """Return commands of both protocols, sound, spoilt, or neither."""
    numbers = [
        str(int(rng.integers(-2, 3)) * 10 ** int(rng.integers(40))) for _ in range(rng.integers(19))
    ]
    some = rng.choice(["X,A", "X,Q", "X,G", "X,H", "X,M", "X,", f"X,M,{rng.integers(70_000)}"])
    sound = bytearray(
        message(",".join([str(some), *numbers[:8]]) if rng.random() < 0.5 else str(some))
    )
    letter = chr(rng.integers(32, 127))
    text = f"{letter}{''.join(',' + number for number in numbers)}{'9' * rng.integers(0, 400)}\r".encode()
    noise = rng.bytes(int(rng.integers(0, 60)))
    binary = (
        b"\0"
        + bytes([256 - rng.integers(1, 128)])
        + rng.bytes(int(rng.integers(0, 40)))
        + bytes(40)
    )
    pick = rng.integers(5)
    if pick == 0 and len(sound) > 2:
        sound[rng.integers(len(sound))] = rng.integers(256)
    return (bytes(sound), bytes(sound), text, noise, binary)[pick]


def test_no_message_of_20_000_raises_fills_the_memory_or_moves_a_robot_that_nobody_drives(clock):
    rng = np.random.default_rng(1)

    class Failing(Body):
        def proximity(self):
            return self._reading(super().proximity())

        def battery_ok(self):
            return self._reading(super().battery_ok())

        def _reading(self, value):
            if rng.random() < 0.1:
                raise OSError(121, "Remote I/O error")
            return value

    moved = 0
    for kind in ("e-puck", "e-puck2"):
        robot = EmulatedRobot(Failing(), clock=clock, kind=kind, rng=rng)
        for case in range(10_000):
            assert len(robot.receive(some_bytes(rng))) <= LARGEST_ANSWER
            if case % 50 == 0:
                robot.receive(
                    bytes(40)
                    + b"\r"
                    + message("X,M,3,9000,9000,9000,9000")
                    + message("X,G")
                    + b"D,500,500\r"
                )
            clock.now += 0.05
            moved += robot.step(clock.now, 0, QUIET) != (0.0, 0.0)
            if case % 100 == 99:  # silence
                clock.now += ALONE_S
                for _ in range(30):
                    clock.now += 0.1
                    assert robot.step(clock.now, int(rng.integers(2)), QUIET) == (0.0, 0.0)
        robot.receive(bytes(40) + b"\r")
        assert robot.receive(message("X,H")) == b"x,H*3772\r\n"
    assert moved > 500


class Served:
    """`live` in a thread, its body, and what moved the body's wheels."""

    def __init__(self, body, **options):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.body, self._done = body, threading.Event()
        options = {"host": "127.0.0.1", "port": self.port, "ended": self._done.is_set, **options}
        self._thread = threading.Thread(target=live, args=(body,), kwargs=options)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._done.set()
        self._thread.join()

    def connect(self):
        deadline = time.monotonic() + 60
        while True:
            try:
                return socket.create_connection(("127.0.0.1", self.port), timeout=60)
            except OSError:
                assert time.monotonic() < deadline
                time.sleep(0.02)


class Wheels(Body):
    """A body that notes its speeds, and fails while `broken`."""

    def __init__(self):
        super().__init__()
        self.readings, self.speeds = QUIET, []
        self.broken, self.blind, self.hangs_s = False, False, 0.0

    def set_speed(self, left, right):
        self._fail()
        self.speeds.append((left, right))

    def sight(self):
        time.sleep(self.hangs_s)
        return 0

    def proximity(self):
        self._fail()
        if self.blind:
            raise OSError(5, "Input/output error")
        return super().proximity()

    def battery_ok(self):
        self._fail()
        return super().battery_ok()

    def _fail(self):
        if self.broken:
            raise OSError(121, "Remote I/O error")


def until(holds):
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_hardware_that_fails_for_a_moment_ends_nothing_and_stands_when_it_fails_for_long():
    body = Wheels()
    with Served(body, clock=RealClock(speed=10.0)) as served, served.connect() as line:
        client = PublicClient(line.fileno())
        body.broken = True
        assert client.ask("V").startswith("v,")
        client.line()
        assert client.ask("b") == "b,1"  # as before
        time.sleep(0.3)  # 3 s of its clock
        body.broken = False
        assert client.ask("D,300,400") == "d"
        until(lambda: (300, 400) in body.speeds)
        body.broken = True
        time.sleep(0.5)
        assert client.ask("D,300,400") == "d"
        body.broken, body.blind = False, True
        until(lambda: body.speeds[-1] == (0, 0))
    assert body.speeds[-1] == (0, 0)


def test_a_control_cycle_that_hangs_does_not_leave_the_wheels_turning():
    body = Wheels()
    with Served(body, clock=RealClock(speed=10.0)) as served, served.connect() as line:
        client = PublicClient(line.fileno())
        assert client.ask("D,300,400") == "d"
        until(lambda: (300, 400) in body.speeds)
        body.hangs_s = 3.0
        began = time.monotonic()
        until(lambda: body.speeds[-1] == (0, 0))
        assert time.monotonic() - began < 2.0  # of 3 in the camera
        body.hangs_s = 0.0


def test_a_robot_is_reached_from_its_own_computer_or_by_named_peers_alone():
    with pytest.raises(
        ValueError,
        match=r"`peers` must name who may move the robot at host '0\.0\.0\.0'; got nobody\.",
    ):
        live(Wheels(), host="0.0.0.0", ended=lambda: True)
    with (
        Served(Wheels(), host="0.0.0.0", peers=["10.0.0.0/24"]) as served,
        served.connect() as line,
    ):
        assert line.recv(1) == b""  # hung up
    with (
        Served(Wheels(), host="0.0.0.0", peers=["10.0.0.1", "127.0.0.1"]) as served,
        served.connect() as line,
    ):
        assert PublicClient(line.fileno()).ask("C") == "c,0"


@pytest.mark.parametrize(
    ("where", "message"),
    [
        ({"host": "::1"}, "`host` must be an address or a name of IPv4; got '::1'"),
        (
            {"host": "0.0.0.0", "peers": ["10.0.0.x"]},
            "`peers` must be addresses or networks; got '10.0.0.x'",
        ),
    ],
)
def test_a_host_or_a_peer_that_is_none_is_named(where, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        live(Wheels(), ended=lambda: True, **where)


def test_a_client_that_makes_no_sense_does_not_lock_the_pc_out(robot, monkeypatch):
    monkeypatch.setattr(_lines, "IDLE_S", 0.5)
    with TcpServer(robot) as server:
        host, port = server.port.removeprefix("socket://").split(":")
        nonsense = socket.create_connection((host, int(port)), timeout=60)
        done = threading.Event()

        def talk():
            while not done.wait(0.1):
                try:
                    nonsense.sendall(b"\r")
                except OSError:
                    return

        thread = threading.Thread(target=talk)
        thread.start()
        with socket.create_connection((host, int(port)), timeout=10) as line:
            assert PublicClient(line.fileno()).ask("C") == "c,0"
        done.set()
        thread.join()
        nonsense.close()


class Spoiling:
    """The near end of a line to a robot whose answers are spoilt in some way, or never end."""

    def __init__(self, robot, rng, clock):
        self._robot, self._rng, self._clock, self._arrived = robot, rng, clock, bytearray()

    @property
    def in_waiting(self):
        return len(self._arrived)

    def read(self, size):
        if not self._arrived:
            self._clock.now_s += 0.02
        data = bytes(self._arrived[:size])
        del self._arrived[:size]
        return data

    def write(self, data):
        rng, answer = self._rng, bytearray(self._robot.receive(bytes(data)))
        pick = rng.integers(8)
        if answer and pick < 3:
            answer[rng.integers(len(answer))] = rng.integers(256)
        elif pick == 3:
            text = f"x,Q,R5,{'9' * rng.integers(1, 500)},{-rng.integers(99)},1,1"
            answer += (sealed(text) + "\r\n").encode()
        elif pick == 4:
            answer = bytearray(rng.bytes(int(rng.integers(0, 300))))
        elif pick == 5:
            answer += message(f"x,START,{'1' * rng.integers(1, 400)},3") * int(rng.integers(1, 60))
        self._arrived += answer

    def close(self):
        self._arrived.clear()


def test_no_answer_of_20_000_raises_anything_but_a_lost_link(robot):
    rng = np.random.default_rng(2)

    class Passing:
        now_s = 0.0

        def now(self):
            self.now_s += 1e-4
            return self.now_s

        def sleep(self, seconds):
            self.now_s += max(seconds, 0.0)

    time_s = Passing()
    from turing_learning.robots import Link

    link = Link("fuzz", clock=time_s, connect=lambda: Spoiling(robot, rng, time_s)).open()
    epuck = EPuck(link, timeout_s=0.1, retries=1)
    model = Model(3, (0.1, 0.2, 0.3, 0.4))
    asked = [
        epuck.version, epuck.status, epuck.proximity, epuck.speed, epuck.battery_ok, epuck.start, epuck.halt, epuck.stop,
        epuck.drop_signals, lambda: epuck.send_model(model), lambda: epuck.drive(5, 5), lambda: epuck.set_speed(1, 2),
        lambda: epuck.wait_for("START", 0.05),
    ]  # fmt: skip
    answered = 0
    for case in range(20_000):
        try:
            asked[case % len(asked)]()
            answered += 1
        except (LinkError, TimeoutError):
            pass
    assert 10_000 < answered < 20_000
    assert len(epuck._signals) <= 1000
