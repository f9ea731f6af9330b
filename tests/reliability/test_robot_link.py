"""Faults on the line to a robot: noise, answers cut in two, links that break and come back."""

import threading

import pytest

from turing_learning.robots import EPuck, LinkError, Model, open_link
from turing_learning.robots.emulation._emulated_robot import EmulatedRobot
from turing_learning.robots.emulation._lines import TcpServer, TerminalServer

READINGS = (1, 2, 3, 4, 5, 6, 7, 8)


class Still:
    def proximity(self):
        return READINGS

    def battery_ok(self):
        return True


@pytest.fixture(params=[TcpServer, TerminalServer])
def served(request):
    with request.param(EmulatedRobot(Still())) as server:
        yield server


@pytest.fixture
def epuck(served):
    with open_link(served.port) as link:
        driver = EPuck(link, timeout_s=1.0, retries=5)
        driver.version()
        yield driver


def once(change):
    """Spoil the next answer alone."""
    left = [True]

    def spoil(data):
        return change(data) if left and left.pop() else [data]

    return spoil


def test_noise_before_an_answer_is_passed_over(epuck, served):
    served.spoil = once(lambda data: [b"\x00\xff\x13#q,,7\r\n" + data])
    assert epuck.proximity() == READINGS
    assert epuck.garbled == 1


def test_an_answer_full_of_noise_is_asked_for_again(epuck, served):
    served.spoil = once(lambda data: [data.replace(b"4", b"?")])
    assert epuck.proximity() == READINGS


def test_an_answer_cut_in_two_is_put_together(epuck, served):
    served.spoil = lambda data: [data[:5], data[5:]]
    assert epuck.proximity() == READINGS
    assert epuck.drive(1, 2) == READINGS


def test_an_answer_whose_end_is_lost_is_asked_for_again(epuck, served):
    served.spoil = once(lambda data: [data[:9]])
    assert epuck.proximity() == READINGS


def test_a_binary_answer_whose_end_is_lost_is_asked_for_again(epuck, served):
    served.spoil = once(lambda data: [data[:7]])
    assert epuck.drive(3, 4) == READINGS


def test_a_lost_answer_is_asked_for_again(epuck, served):
    served.spoil = once(lambda data: [])
    epuck.set_speed(5, 6)
    assert served.robot.wheels == (5, 6)


def test_noise_that_leaves_the_robot_in_a_binary_request_does_not_block_it(epuck, served):
    epuck._link.send(b"\x9a\xbc\x01")
    assert epuck.proximity() == READINGS


def test_a_model_spoiled_on_the_way_back_arrives_once_more_and_right(epuck, served):
    served.spoil = once(lambda data: [data.replace(b"M", b"W")])
    epuck.send_model(Model(3, (0.5, -0.5)))
    served.robot.enter("R3")
    assert served.robot.executing == Model(3, (0.5, -0.5))


def test_a_signal_with_a_wrong_checksum_is_no_signal(epuck, served):
    served.spoil = once(lambda data: [data.replace(b"START", b"STOP")])
    served.signal("START")
    with pytest.raises(TimeoutError, match="`STOP` must be signalled"):
        epuck.wait_for("STOP", 0.2)
    assert epuck.garbled == 1


def test_a_link_that_comes_back_is_opened_again(epuck, served):
    served.drop()
    back = threading.Timer(0.3, served.restore)
    back.start()
    assert epuck.proximity() == READINGS
    back.join()
    assert epuck.reconnections >= 1


def test_a_link_that_stays_away_is_told(served):
    with open_link(served.port) as link:
        driver = EPuck(link, timeout_s=1.0, retries=2)
        driver.version()
        served.drop()
        with pytest.raises(
            LinkError, match=r"the robot at .* must answer 'N'; got .* in 3 attempts"
        ):
            driver.proximity()


def test_a_link_lost_while_waiting_for_a_signal_is_told(epuck, served):
    threading.Timer(0.1, served.drop).start()
    with pytest.raises(LinkError, match=r"the link to .* is lost"):
        epuck.wait_for("START", 10.0)


def test_a_robot_that_never_answers_is_told(served):
    served.spoil = lambda data: []
    with (
        open_link(served.port) as link,
        pytest.raises(
            LinkError, match=r"must answer 'V'; got no answer that makes sense in 2 attempts"
        ),
    ):
        EPuck(link, timeout_s=0.1, retries=1).version()


def test_a_babbling_robot_is_told(served):
    served.spoil = lambda data: [b"babble\r\n" * 50]
    with (
        open_link(served.port) as link,
        pytest.raises(LinkError, match="got no answer that makes sense"),
    ):
        EPuck(link, timeout_s=0.1, retries=1).version()
