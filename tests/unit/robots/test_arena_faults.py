"""Each fault as the PC sees it: on the wire, or in the images."""

import numpy as np
import pytest
from arena_laboratories import replicas, small_laboratory

from turing_learning.robots import CameraError, EPuck, LinkError, Model, Tracker
from turing_learning.robots.emulation._laboratory import BATTERY_LIGHT


@pytest.fixture
def laboratory():
    return small_laboratory()


@pytest.fixture
def robot(laboratory):
    return EPuck(laboratory.link("replica-1"))


@pytest.fixture(scope="module")
def tracker():
    built = small_laboratory()
    return Tracker(built.markers, built.calibration, built.labels)


def test_bytes_take_their_time(laboratory, robot):
    began = laboratory.clock.now()
    robot.version()
    assert 0.02 <= laboratory.clock.now() - began <= 0.09


def test_bytes_do_not_overtake_each_other():
    laboratory = small_laboratory(latency_s=(0.0, 0.3))
    link = laboratory.link("replica-1")
    for k in range(20):
        link.send(b"D,%d,0\rE\r" % k)
    lines = [link.read_line(laboratory.clock.now() + 5.0) for _ in range(40)]
    assert lines[1::2] == [f"e,{k},0" for k in range(20)]


def test_a_lost_link_is_an_error_until_the_operator_resets_it(laboratory, robot):
    laboratory.faults.lose_link("replica-1")
    with pytest.raises(LinkError, match="the robot at replica-1 must answer"):
        robot.version()
    with pytest.raises(LinkError, match="got 'replica-1' \\(no connection\\)"):
        laboratory.link("replica-1")
    laboratory.operator.reset_link("replica-1")
    assert robot.version() == "Version 1.2.2 emulated"
    assert robot.reconnections == 1


def test_a_signal_without_a_link_is_lost(laboratory):
    first, second = replicas(laboratory)
    laboratory.faults.lose_link("replica-1")
    laboratory.operator.press_remote()
    assert second.wait_for("STOP", 1.0).trial == 0
    with pytest.raises(LinkError):
        first.wait_for("STOP", 1.0)


def test_garbage_on_the_line_is_seen_and_overcome(laboratory, robot):
    laboratory.faults.garble("replica-1")
    assert robot.speed() == (0, 0)
    assert robot.garbled >= 1


def test_a_reply_in_two_pieces_is_one_reply(laboratory, robot):
    laboratory.faults.cut_reply("replica-1")
    began = laboratory.clock.now()
    robot.send_model(Model(3, (0.1, 0.2, 0.3, 0.4)))
    assert laboratory.clock.now() - began > 0.05
    assert robot.garbled == 0
    assert robot.status().waiting == 3


def test_half_a_reply_is_asked_for_again(laboratory, robot):
    laboratory.faults.lose_half_reply("replica-1")
    began = laboratory.clock.now()
    robot.send_model(Model(3, (0.1, 0.2, 0.3, 0.4)))
    assert laboratory.clock.now() - began > 0.5  # the time the driver waits for an answer
    assert robot.status().waiting == 3


def test_a_silent_replica_signals_nothing_until_it_is_restarted(laboratory, robot):
    laboratory.faults.silence("replica-1")
    laboratory.operator.press_remote()
    with pytest.raises(TimeoutError, match=r"`STOP` must be signalled within 5.0 s"):
        robot.wait_for("STOP", 5.0)
    laboratory.operator.restart("replica-1")
    assert robot.status().state == "R0"
    laboratory.operator.press_remote()
    assert robot.wait_for("STOP", 1.0).trial == 0


def test_a_low_battery_is_told_by_the_status_and_the_light(laboratory, robot):
    assert robot.battery_ok()
    laboratory.faults.drain("replica-1")
    laboratory.clock.sleep(0.2)
    assert not robot.battery_ok()
    assert not robot.status().battery_ok
    assert laboratory.robot("replica-1").emulated.lights[BATTERY_LIGHT] == 1
    laboratory.operator.replace_battery("replica-1")
    laboratory.clock.sleep(0.2)
    assert robot.battery_ok()
    assert laboratory.robot("replica-1").emulated.lights[BATTERY_LIGHT] == 0


def test_batteries_run_down_by_themselves():
    laboratory = small_laboratory(battery_s=20.0)
    robot = EPuck(laboratory.link("replica-1"))
    laboratory.clock.sleep(10.0)
    assert robot.battery_ok()
    laboratory.clock.sleep(14.0)
    charges = [laboratory.robot(name).charge for name in laboratory.names]
    assert len(set(charges)) > 0
    assert min(charges) < 0.15
    laboratory.clock.sleep(10.0)
    with pytest.raises(LinkError):
        robot.version()


def test_a_robot_without_power_stands_still_and_says_nothing(laboratory, robot):
    laboratory.operator.press_remote()
    laboratory.clock.sleep(4.0)
    laboratory.faults.empty("replica-1")
    laboratory.clock.sleep(0.3)
    before = laboratory.poses()[3]
    laboratory.clock.sleep(2.0)
    assert np.hypot(*(laboratory.poses()[3] - before)[:2]) < 3.0  # others may push it
    with pytest.raises(LinkError):
        robot.version()
    laboratory.operator.replace_battery("replica-1")
    assert robot.status().state == "R0"
    assert robot.status().executing == -1


def test_a_frozen_camera_repeats_its_image_and_the_tracker_says_so(laboratory, tracker):
    laboratory.camera.take()
    laboratory.faults.freeze_camera()
    images = [laboratory.camera.take() for _ in range(3)]
    np.testing.assert_array_equal(images[0], images[2])
    assert [fault.kind for fault in tracker.track(images).faults] == ["frozen camera"]
    laboratory.operator.restart_camera()
    assert not np.array_equal(laboratory.camera.take(), images[0])


def test_an_unplugged_camera_gives_no_images(laboratory):
    laboratory.faults.unplug_camera()
    with pytest.raises(CameraError, match="`source` must give images; got none more"):
        laboratory.camera.take()
    laboratory.operator.restart_camera()
    assert laboratory.camera.take().shape == (480, 640, 3)


def test_a_covered_marker_is_missing_until_it_is_uncovered(laboratory, tracker):
    images = [laboratory.camera.take()]
    laboratory.faults.cover("replica-2")
    images += [laboratory.camera.take() for _ in range(2)]
    (fault,) = tracker.track(images).faults
    assert (fault.kind, fault.frame) == ("marker missing", 1)
    assert "individual 4 (purple)" in fault.text
    laboratory.operator.uncover("replica-2")
    assert tracker.detect(laboratory.camera.take()).labels.count("purple") == 1


def test_a_robot_that_is_carried_away_is_noticed(laboratory, tracker):
    for number, name in enumerate(laboratory.names):
        laboratory.put(name, (15 + 15 * number, 20, 0.0))
    laboratory.clock.sleep(0.2)
    images = [laboratory.camera.take()]
    laboratory.faults.carry("replica-1", 20.0, 80.0)
    images += [laboratory.camera.take() for _ in range(2)]
    np.testing.assert_allclose(laboratory.poses()[3, :2], (20, 80), atol=0.1)
    assert "carried away" in [fault.kind for fault in tracker.track(images).faults]


def test_a_stuck_robot_stays_where_it_is_until_it_is_freed(laboratory):
    laboratory.faults.stick("agent-1")
    laboratory.clock.sleep(0.3)
    before = laboratory.poses()[0]
    laboratory.operator.press_remote()
    laboratory.clock.sleep(9.0)
    np.testing.assert_array_equal(laboratory.poses()[0], before)
    laboratory.operator.free("agent-1")
    laboratory.operator.press_remote()
    laboratory.clock.sleep(6.0)
    assert np.hypot(*(laboratory.poses()[0] - before)[:2]) > 5


def test_the_operator_who_is_asked_takes_time_and_puts_everything_in_order(laboratory, robot):
    for fault in ("lose_link", "silence", "drain", "stick", "cover"):
        getattr(laboratory.faults, fault)("replica-1")
    laboratory.faults.freeze_camera()
    began = laboratory.clock.now()
    laboratory.operator.ask("look after everything")
    assert laboratory.operator.asked == ["look after everything"]
    assert laboratory.clock.now() == began + 60.0
    status = robot.status()
    assert (status.state, status.battery_ok) == ("R1", True)
    assert laboratory.stuck == laboratory.covered == set()
    assert not laboratory.camera.frozen
    assert {laboratory.robot(name).emulated.state for name in laboratory.names} == {"R1"}
