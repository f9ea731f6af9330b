"""Invariants of the protocol under any noise."""

from binascii import crc_hqx

from hypothesis import example, given, settings
from hypothesis import strategies as st
from robot_bodies import Body, Clock

from turing_learning.robots._link import RESYNCHRONIZE
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=60), st.sampled_from(["e-puck", "e-puck2"]))
@example(b"\x89", "e-puck")  # the longest request
@example(b"\xf7", "e-puck2")
def test_whatever_was_on_the_line_the_robot_listens_after_resynchronization(noise, kind):
    robot = EmulatedRobot(Body(), clock=Clock(), kind=kind)
    robot.receive(noise)
    robot.receive(RESYNCHRONIZE)
    assert robot.receive(b"N\r") == b"n,10,200,-3,4,5,6,7,3000\r\n"


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 40), st.integers(1, 255))
def test_a_model_with_one_changed_byte_is_never_taken_for_another(place, change):
    text = b"X,M,17,-7000,-10000,10000,-10000"
    line = bytearray(text + b"*%04X" % crc_hqx(text, 0xFFFF))
    line[place % len(line)] ^= change
    robot = EmulatedRobot(Body(), clock=Clock())
    robot.receive(bytes(line) + b"\r")
    robot.receive(RESYNCHRONIZE)
    robot.enter("R3")
    assert robot.executing is None or robot.executing.parameters == (-0.7, -1.0, 1.0, -1.0)


@settings(max_examples=100, deadline=None)
@given(st.binary(min_size=1, max_size=80), st.data())
def test_answers_do_not_depend_on_how_the_bytes_arrive(data, cut):
    place = cut.draw(st.integers(0, len(data)))
    whole, parts = EmulatedRobot(Body(), clock=Clock()), EmulatedRobot(Body(), clock=Clock())
    assert whole.receive(data) == parts.receive(data[:place]) + parts.receive(data[place:])
