"""Bytes that two public clients send, and what they need to read before they go on.

Recorded from their sources: ePuck.py 1.2.2 (M. Martin Ortiz, 2010) resets, then speaks binary after texts that end with a line
feed; epuck.py of github.com/Payamgha/e-puck2-library (d82ec13) speaks text that ends with CR and LF.
"""

import re
import struct

import pytest
from robot_bodies import Body, Clock

from turing_learning.robots.emulation._emulated_robot import EmulatedRobot

PROXIMITY = struct.pack("<8h", 10, 200, -3, 4, 5, 6, 7, 3000)
ORTIZ = [
    ("connect", b"v\n", rb"v,[^\r]+\r\nHW version: \w+\r\n"),
    ("set_led", b"\xb4\x03\x01", b""),
    ("set_motors_speed", b"\xbc\x2c\x01\x38\xff", b""),
    ("proximity", b"\xb2\0", re.escape(PROXIMITY)),
    ("motor_speed", b"\xbb\0", re.escape(struct.pack("<2h", 300, -200))),
    ("set_motor_position", b"\xb0\x05\0\x06\0", b""),
    ("motor_position", b"\xaf\0", re.escape(struct.pack("<2h", 5, 6))),
    ("accelerometer", b"\x9f\0", rb"(?s).{6}"),
    ("accelerometer_filtered", b"\xbf\0", rb"(?s).{12}"),
    ("light", b"\xb1\0", rb"(?s).{16}"),
    ("microphone", b"\x8b\0", rb"(?s).{6}"),
    ("selector", b"c\n", rb"c,3\r\n"),
    ("camera_parameters", b"J,0,20,30,8\n", rb"j\r\n"),
    ("camera", b"I\n", rb"i,0,20,30,8,600\r\n"),
    ("image", b"\xb7\0", rb"(?s)\x00\x14\x1e.{600}"),
    ("sound", b"T,1\n", rb"t\r\n"),
    ("calibrate", b"k\n", rb"k,[^\r]+\r\nk,[^\r]+\r\n"),
    ("stop", b"S\n", rb"s\r\n"),
]
GHASSEMI = [
    ("accelerometer", b"A\r\n", rb"a,-?\d+,-?\d+,-?\d+\r\n"),
    ("set_speed", b"D,300,-200\r\n", rb"d\r\n"),
    ("speed", b"E\r\n", rb"e,300,-200\r\n"),
    ("proximity", b"N\r\n", rb"n,10,200,-3,4,5,6,7,3000\r\n"),
    ("steps", b"Q\r\n", rb"q,0,0\r\n"),
    ("light", b"O\r\n", rb"o(,\d+){8}\r\n"),
    ("microphone", b"U\r\n", rb"u(,\d+){3}\r\n"),
    ("floor", b"M\r\n", rb"m(,\d+){5}\r\n"),
    ("gyroscope", b"g\r\n", rb"g(,-?\d+){3}\r\n"),
    ("position", b"P,3,4\r\n", rb"p\r\n"),
    ("led", b"L,2,1\r\n", rb"l\r\n"),
]
DIFFERENT = {
    "e-puck": [(b"R\n", rb"r\r\n\f\aWELCOME.*\r\n.*\r\n"), (b"b\n", rb"b,1\r\n"), (b"\x9e\0", b"\1\0"),
               (b"\xb3\0", rb"(?s).{10}"), (b"\xab\0", rb"(?s).{601}")],
    "e-puck2": [(b"R\n", b""), (b"b\n", rb"b,1034 \(87%\)\r\n"), (b"\x9e\0", b"\x0a\x04"),
                (b"\xb3\0", rb"(?s).{8}"), (b"\xab\0", b""),
                (b"\xf8\0", rb"(?s).{37}" + re.escape(PROXIMITY) + rb".{50}"), (b"\xf4\0", rb"(?s).{8}"),
                (b"\xf7\0\x2c\x01\x38\xff" + b"\1" * 14 + b"\xbb\0", re.escape(struct.pack("<2h", 300, -200)))],
}  # fmt: skip


@pytest.mark.parametrize("kind", DIFFERENT)
@pytest.mark.parametrize("client", [ORTIZ, GHASSEMI], ids=["ePuck.py", "epuck.py"])
def test_every_call_of_a_public_client_has_the_answer_that_it_reads(client, kind):
    robot = EmulatedRobot(Body(), clock=Clock(), selector=3, kind=kind)
    for name, sent, read in client:
        assert re.fullmatch(read, robot.receive(sent)), name


@pytest.mark.parametrize("kind", DIFFERENT)
def test_what_the_two_robots_answer_otherwise(kind):
    robot = EmulatedRobot(Body(), clock=Clock(), kind=kind)
    for sent, read in DIFFERENT[kind]:
        assert re.fullmatch(read, robot.receive(sent)), sent
