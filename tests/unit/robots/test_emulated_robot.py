"""The emulated robot against a client written from the public protocol alone (GCtronic wiki, "Advanced sercom protocol")."""

import os
import socket
import struct
import termios
from binascii import crc_hqx

import pytest
from robot_bodies import Body, Clock, PublicClient

from turing_learning.robots.emulation._emulated_robot import EmulatedRobot
from turing_learning.robots.emulation._lines import TcpServer, TerminalServer


@pytest.fixture
def body():
    return Body()


@pytest.fixture
def robot(body):
    return EmulatedRobot(body, clock=Clock(), selector=3)


@pytest.fixture(params=["tcp", "terminal"])
def client(request, robot):
    if request.param == "tcp":
        with TcpServer(robot) as server:
            host, port = server.port.removeprefix("socket://").split(":")
            with socket.create_connection((host, int(port)), timeout=60) as line:
                yield PublicClient(line.fileno())
    else:
        with TerminalServer(robot) as server:
            descriptor = os.open(server.port, os.O_RDWR | os.O_NOCTTY)
            client = PublicClient(descriptor)
            assert [client.line()[-6:] for _ in range(2)] == ["e-Puck", "r help"]
            yield client
            os.close(descriptor)


def test_a_public_client_is_told_the_version_in_two_lines(client):
    assert client.ask("V").endswith("v,Version 1.2.2 emulated")
    assert client.line() == "HW version: 102"


def test_a_robot_greets_when_it_is_switched_on_and_not_when_somebody_connects(robot):
    with TerminalServer(robot) as server:
        clients = [PublicClient(os.open(server.port, os.O_RDWR | os.O_NOCTTY)) for _ in range(2)]
        assert clients[0].line().endswith("WELCOME to the SerCom protocol on e-Puck")
        assert clients[0].line() == 'the EPFL education robot type "H" for help'
        assert clients[1].ask("E") == "e,0,0"
        for each in clients:
            os.close(each.descriptor)


def test_a_public_client_sets_and_reads_speeds(client, robot):
    assert client.ask("D,-700,1000") == "d"
    assert client.ask("E") == "e,-700,1000"
    assert robot.wheels == (-700, 1000)


def test_a_public_client_reads_proximity(client):
    assert client.ask("N") == "n,10,200,-3,4,5,6,7,3000"


def test_a_public_client_chains_binary_requests(client, robot):
    request = (
        bytes([256 - ord("D")])
        + struct.pack("<hh", -5, 300)
        + bytes([256 - ord("E"), 256 - ord("N"), 0])
    )
    answer = client.binary(request, 20)
    assert struct.unpack("<10h", answer) == (-5, 300, 10, 200, -3, 4, 5, 6, 7, 3000)
    assert robot.wheels == (-5, 300)


def test_unknown_commands_are_answered_with_an_error_line(client):
    assert client.ask("?") == "z,Command not found"


def answers(robot, text):
    return robot.receive(text).decode("ascii").split("\r\n")[:-1]


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        (b"b\r", ["b,1"]),
        (b"C\n", ["c,3"]),
        (b"B,1\r", ["b"]),
        (b"F,1\r", ["f"]),
        (b"L,2,1\r", ["l"]),
        (b"d,1,2\r", ["d"]),
        (b"S\r\n", ["s"]),
    ],
)
def test_commands_have_the_answers_of_the_table(robot, command, answer):
    assert answers(robot, command) == answer


def test_help_lists_the_commands(robot):
    assert {'"D,#,#"', '"I"', '"X"'} < set(answers(robot, b"H\r"))


def test_lights_are_switched_on_off_and_over(robot):
    robot.receive(b"L,2,1\rB,1\rF,2\r")
    assert robot.lights == [0, 0, 1, 0, 0, 0, 0, 0, 1, 1]
    robot.receive(b"F,2\rL,8,1\r")
    assert robot.lights == [1] * 9 + [0]
    robot.receive(bytes([256 - ord("L"), 9, 1, 256 - ord("L"), 8, 0, 256 - ord("L"), 77, 0, 0]))
    assert robot.lights == [0] * 9 + [1]


def test_a_low_battery_is_told_in_both_modes(robot, body):
    body.battery = False
    assert answers(robot, b"b\r") == ["b,0"]
    assert robot.receive(bytes([256 - ord("b"), 0])) == b"\0\0"


def test_after_an_end_of_line_a_binary_request_is_taken_for_text(robot):
    request = bytes([256 - ord("E"), 0])
    assert robot.receive(b"E\r" + request) == b"e,0,0\r\n\0\0\0\0"
    assert robot.receive(b"E\r\n" + request + b"\r") == b"e,0,0\r\nz,Command not found\r\n"


def test_speeds_beyond_the_maximum_are_cut(robot):
    robot.receive(b"D,5000,-5000\r")
    assert robot.wheels == (1000, -1000)


def test_a_speed_that_cannot_be_read_leaves_the_old_one(robot):
    robot.receive(b"D,100,200\rD,7,x\r")
    assert robot.wheels == (7, 200)


@pytest.mark.parametrize(
    ("size", "head"),
    [
        ("300,40,40", (44, 40, 40)),
        ("1,-7,40", (1, 40, 40)),
        ("0,70000,1000", (1, 40, 40)),
        ("0,160,120", (0, 160, 120)),
    ],
)
def test_an_image_of_a_size_that_cannot_be_has_the_usual_size(robot, size, head):
    assert answers(robot, f"J,{size},8\r".encode()) == ["j"]
    image = robot.receive(bytes([256 - ord("I"), 0]))
    assert image[:3] == bytes(head)
    assert len(image) == 3 + head[1] * head[2] * (2 if head[0] else 1)
    assert answers(robot, b"E\r") == ["e,0,0"]


def test_stop_stops_the_wheels_and_the_lights(robot):
    robot.receive(b"D,5,5\rL,0,1\rS\r")
    assert robot.wheels == (0, 0)
    assert robot.lights == [0] * 10


def test_reset_stops_forgets_and_greets_again(robot):
    robot.receive(b"D,5,5\r")
    robot.enter("R4")
    assert answers(robot, b"R\r")[:1] == ["r"]
    robot.enter("R4")
    assert answers(robot, b"R\r")[1].endswith("WELCOME to the SerCom protocol on e-Puck")
    assert robot.wheels == (0, 0)
    assert robot.state == "R0"


def test_noise_that_begins_a_binary_request_swallows_what_follows_until_a_zero(robot):
    assert robot.receive(b"\x9aV\r") == b""
    assert robot.receive(b"\0V\r").startswith(b"v,")


def test_binary_lights_and_unknown_binary_requests_are_silent(robot):
    assert robot.receive(bytes([256 - ord("L"), 4, 1, 200, 0])) == b""
    assert robot.lights[4] == 1


def sealed(text):
    return f"{text}*{crc_hqx(text.encode(), 0xFFFF):04X}"


def test_a_model_waits_in_the_buffer_until_state_r3(robot):
    assert answers(robot, sealed("X,M,17,-7000,10000,9999,-1").encode() + b"\r") == [
        sealed("x,M,17")
    ]
    assert robot.executing is None
    robot.enter("R3")
    assert robot.executing.sequence == 17
    assert robot.executing.parameters == (-0.7, 1.0, 0.9999, -0.0001)


def test_a_model_with_a_wrong_checksum_is_not_taken(robot):
    good = sealed("X,M,17,-7000,10000")
    assert answers(robot, good.replace("7000", "7001").encode() + b"\r") == [sealed("x,E,checksum")]
    robot.enter("R3")
    assert robot.executing is None


@pytest.mark.parametrize(
    "text", ["X,M,17", "X,M,17,10001", "X,M,70000,1", "X,M,1,a", "X,M,-1,1", "X,Y", "X,M"]
)
def test_a_message_that_makes_no_sense_is_refused(robot, text):
    assert answers(robot, sealed(text).encode() + b"\r") == [sealed("x,E,message")]


def test_signals_count_trials_and_name_the_model(robot):
    robot.receive(sealed("X,M,5,1,1").encode() + b"\r")
    robot.enter("R3")
    assert robot.signal("START") == sealed("x,START,1,5").encode() + b"\r\n"
    assert robot.signal("STOP") == sealed("x,STOP,1,5").encode() + b"\r\n"
    assert robot.signal("START") == sealed("x,START,2,5").encode() + b"\r\n"


def test_a_signal_that_does_not_exist_is_refused(robot):
    with pytest.raises(ValueError, match="`kind` must be one of START, STOP; got 'PAUSE'"):
        robot.signal("PAUSE")


def test_the_status_tells_state_time_and_models(body):
    clock = Clock()
    robot = EmulatedRobot(body, clock=clock)
    robot.receive(sealed("X,M,5,1,1").encode() + b"\r")
    robot.enter("R5")
    clock.now = 2.25
    assert answers(robot, sealed("X,Q").encode() + b"\r") == [sealed("x,Q,R5,2250,5,-1,1")]


def test_a_line_without_end_does_not_fill_the_memory(robot):
    assert robot.receive(b"?" * 100_000 + b"\r") == b"z,Command not found\r\n"


def test_the_pseudo_terminal_is_a_terminal(robot):
    with TerminalServer(robot) as server:
        descriptor = os.open(server.port, os.O_RDWR | os.O_NOCTTY)
        assert termios.tcgetattr(descriptor)
        os.close(descriptor)


def test_a_client_that_says_nothing_gives_way_to_the_next(robot, monkeypatch):
    monkeypatch.setattr("turing_learning.robots.emulation._lines.IDLE_S", 0.2)
    with TcpServer(robot) as server:
        host, port = server.port.removeprefix("socket://").split(":")
        for _ in range(2):  # each is left as it is
            line = socket.create_connection((host, int(port)), timeout=60)
            assert PublicClient(line.fileno()).ask("V").startswith("v,")
            line.detach()


def test_a_client_that_speaks_is_not_disturbed_by_another(robot):
    with TcpServer(robot) as server:
        host, port = server.port.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port)), timeout=60) as line:
            first = PublicClient(line.fileno())
            assert first.ask("V").startswith("v,")
            assert first.line().startswith("HW version")
            with socket.create_connection((host, int(port)), timeout=60):
                assert first.ask("C") == "c,3"
                assert first.ask("E") == "e,0,0"
