import math
from dataclasses import replace

import numpy as np
import pytest
from arena_laboratories import SMALL, replicas, small_laboratory

from turing_learning import swarm
from turing_learning.robots import Conditions, EmulatedLaboratory, Model, Tracker
from turing_learning.robots.emulation._arena import Drives

STATES = ("R1", "R2", "R3", "R4", "R5")


@pytest.fixture
def laboratory():
    return small_laboratory()


@pytest.fixture(scope="module")
def tracker():
    built = small_laboratory()
    return Tracker(built.markers, built.calibration, built.labels)


def states(laboratory):
    return [laboratory.robot(name).emulated.state for name in laboratory.names]


def test_robots_wait_for_the_remote_control_and_begin_together(laboratory):
    before = laboratory.poses()
    laboratory.clock.sleep(5.0)
    np.testing.assert_allclose(
        laboratory.poses(), before, atol=0.1
    )  # those that overlapped have been pushed apart
    assert states(laboratory) == ["R0"] * 5
    laboratory.operator.press_remote()
    began = laboratory.clock.now()
    for state, middle in zip(STATES, (0.5, 5.0, 9.5, 10.5, 14.5), strict=True):
        laboratory.clock.sleep_until(began + middle)
        assert states(laboratory) == [state] * 5


def test_replicas_signal_and_execute_what_they_are_sent(laboratory):
    first, second = replicas(laboratory)
    laboratory.operator.press_remote()
    began = laboratory.clock.now()
    for robot, sequence in ((first, 7), (second, 8)):
        assert robot.wait_for("STOP", 2.0).sequence == -1
        robot.send_model(Model(sequence, (0.5, 0.5, 0.5, 0.5)))
    signals = [robot.wait_for("START", 12.0) for robot in (first, second)]
    assert [(signal.trial, signal.sequence) for signal in signals] == [(1, 7), (1, 8)]
    assert laboratory.clock.now() - began == pytest.approx(10.1, abs=0.15)
    laboratory.clock.sleep(1.2)
    before = laboratory.poses()[3:]
    laboratory.clock.sleep(0.5)
    moved = np.hypot(*(laboratory.poses()[3:] - before)[:, :2].T)
    assert moved.max() == pytest.approx(3.2, rel=0.05)
    assert [robot.wait_for("STOP", 8.0).trial for robot in (first, second)] == [1, 1]


def test_clocks_drift_apart_and_the_remote_control_brings_them_together():
    laboratory = small_laboratory(clock_drift=0.009)
    laboratory.operator.press_remote()
    laboratory.clock.sleep(18 * 3 + 14.5)
    seen = set()
    for _ in range(60):
        laboratory.clock.sleep(0.1)
        seen.add(len(set(states(laboratory))))
    assert max(seen) > 1
    laboratory.operator.press_remote()
    laboratory.clock.sleep(9.5)
    assert states(laboratory) == ["R3"] * 5


def test_dispersal_separates_robots_that_have_gathered():
    laboratory = small_laboratory(seed=4)
    for number, name in enumerate(laboratory.names):
        laboratory.put(name, (40 + 7.2 * (number % 3), 45 + 7.2 * (number // 3), number))
    laboratory.operator.press_remote()
    laboratory.clock.sleep(9.5)
    places = laboratory.poses()[:, :2]
    apart = np.linalg.norm(places[:, None] - places[None], axis=-1)[np.triu_indices(5, 1)]
    assert np.median(apart) > 30
    assert (places > 3.4).all()
    assert (places < np.array(laboratory.arena_cm) - 3.4).all()


@pytest.mark.parametrize(
    "controller", [(1.0, 1.0, 1.0, 1.0), (-1.0, -1.0, -1.0, -1.0), (-0.7, -1.0, 1.0, -1.0)]
)
def test_nobody_stays_at_a_wall_during_a_trial(controller):
    laboratory = small_laboratory(scenario=replace(SMALL, controller=controller))
    laboratory.operator.press_remote()
    touching = np.zeros(3)
    for _ in range(4):
        laboratory.clock.sleep_until(18 * round(laboratory.clock.now() / 18) + 11.2)
        for _ in range(66):
            laboratory.clock.sleep(0.1)
            low = laboratory.poses()[:3, :2]
            touching += (np.minimum(low, np.array(laboratory.arena_cm) - low) < 3.55).any(axis=1)
    assert touching.max() <= 0.1 * 4 * 66


def test_robots_that_meet_in_a_trial_move_as_if_they_had_no_infrared_sensors():
    scenario = replace(SMALL, robot=swarm.Robot(clamp_wheel_speeds=True, wheel_noise=0.0))
    laboratory = small_laboratory(scenario=scenario, clock_drift=0.0, own_phases=False)
    laboratory.operator.press_remote()
    laboratory.clock.sleep(11.0 + 1e-9)
    places = [(35, 40, 0.1), (45, 41, 2.5), (40, 52, -1.0), (20, 80, 0.0), (70, 80, 0.0)]
    for name, pose in zip(laboratory.names, places, strict=True):
        laboratory.put(name, pose)
    laboratory.clock.sleep(0.2)
    poses = laboratory.poses()[None]
    nearest = np.inf
    for _ in range(60):
        laboratory.clock.sleep(0.1)
        controllers = np.array([scenario.controller] * 3 + [(0.0,) * 4] * 2)[None]
        poses = swarm.simulate(scenario, controllers, poses, control_steps=1, threads=1).poses[:, 1]
        np.testing.assert_allclose(laboratory.poses()[:3, :2], poses[0, :3, :2], atol=0.02)
        poses = laboratory.poses()[None]
        between = np.linalg.norm(poses[0, :3, None, :2] - poses[0, None, :3, :2], axis=-1)[
            np.triu_indices(3, 1)
        ]
        nearest = min(nearest, between.min())
    assert nearest < 7.1  # they did meet


def test_motion_is_that_of_the_simulated_swarm():
    scenario = replace(SMALL, robot=swarm.Robot(clamp_wheel_speeds=True, wheel_noise=0.0))
    laboratory = small_laboratory(scenario=scenario, clock_drift=0.0)
    laboratory.clock.sleep(0.05)
    laboratory.put("agent-1", (45.0, 50.0, 0.0))
    laboratory.link("agent-1").send(b"D,500,1000\r")
    laboratory.clock.sleep_until(0.3 + 1e-9)
    before = laboratory.poses()
    laboratory.clock.sleep(1.0)
    controllers = np.array([(0.5, 1.0) * 2] + [(0.0,) * 4] * 4)[None]
    expected = swarm.simulate(
        scenario, controllers, before[None], control_steps=10, threads=1
    ).poses[0, -1]
    np.testing.assert_allclose(laboratory.poses()[0], expected[0], atol=0.02)


def test_wheels_have_noise_and_a_largest_speed():
    laboratory = small_laboratory()
    laboratory.clock.sleep(0.05)
    laboratory.put("agent-1", (12.0, 50.0, 0.0))
    laboratory.link("agent-1").send(b"D,1000,1000\r")
    laboratory.clock.sleep(0.25 + 1e-6)
    steps = []
    for _ in range(30):
        before = laboratory.poses()[0, :2]
        laboratory.clock.sleep(0.1)
        steps.append(math.dist(laboratory.poses()[0, :2], before) / 0.1)
    assert max(steps) <= 12.8 + 1e-6
    assert 0.05 < np.std(steps) < 0.5


def test_the_same_seed_gives_the_same_bits_and_another_one_others():
    ends = []
    for seed in (1, 1, 2):
        laboratory = small_laboratory(seed=seed)
        laboratory.operator.press_remote()
        laboratory.clock.sleep(16.0)
        ends.append((laboratory.poses(), laboratory.camera.take()))
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    np.testing.assert_array_equal(ends[0][1], ends[1][1])
    assert not np.array_equal(ends[0][0], ends[2][0])


def test_an_image_is_rendered_only_when_one_is_taken(laboratory, monkeypatch):
    rendered = []
    render = laboratory._eye.render
    monkeypatch.setattr(
        laboratory._eye, "render", lambda *told: rendered.append(1) or render(*told)
    )
    laboratory.clock.sleep(20.0)
    assert rendered == []
    laboratory.camera.take()
    assert rendered == [1]


def test_images_come_ten_times_a_second_and_none_twice(laboratory):
    laboratory.clock.sleep(3.33)
    times = []
    for _ in range(5):
        laboratory.camera.take()
        times.append(laboratory.clock.now())
    np.testing.assert_allclose(np.diff(times), 0.1, atol=1e-9)
    assert times[0] == pytest.approx(3.337)


def test_an_image_that_is_rendered_late_shows_where_the_robots_were_when_it_was_due(laboratory):
    laboratory.operator.press_remote()
    laboratory.clock.sleep(11.037)
    due, poses = laboratory.clock.now(), laboratory.poses()
    laboratory.clock.sleep(0.18)
    assert np.abs(laboratory.poses() - poses).max() > 0.5
    np.testing.assert_array_equal(laboratory.poses(due), poses)
    laboratory._eye.render = lambda shown, _: shown
    np.testing.assert_array_equal(laboratory.camera.snapshot(due), poses)


def test_the_tracker_finds_the_robots_where_they_are(laboratory, tracker):
    laboratory.operator.press_remote()
    laboratory.clock.sleep(11.0)
    truth, images = [], []
    for _ in range(6):
        images.append(laboratory.camera.take())
        truth.append(laboratory.poses())
    track = tracker.track(images)
    assert track.faults == ()
    for seen, true in zip(track.poses, truth, strict=True):
        apart = np.linalg.norm(seen[:, None, :2] - true[None, :, :2], axis=-1).min(axis=1)
        assert apart.max() < 0.2


def test_poses_between_two_cycles_lie_between_them():
    laboratory = small_laboratory(own_phases=False)
    laboratory.link("agent-1").send(b"D,800,300\r")
    laboratory.clock.sleep(0.5 + 1e-9)
    first = laboratory.poses()[0]
    laboratory.clock.sleep(0.05)
    middle = laboratory.poses()[0]
    laboratory.clock.sleep(0.05)
    last = laboratory.poses()[0]
    np.testing.assert_allclose(middle, (first + last) / 2, atol=1e-6)
    assert math.dist(first[:2], last[:2]) > 0.5


def test_emulated_robots_act_as_late_as_the_scenario_says_and_each_wheel_has_its_scale():
    exact = replace(SMALL.robot, wheel_noise=0.0)
    drives = {}
    for name, changes in {
        "plain": {},
        "late": {"actuation_lag_cycles": 3},
        "scaled": {"wheel_scale_spread": 0.2},
    }.items():
        scenario = replace(SMALL, robot=replace(exact, **changes))
        drives[name] = Drives(scenario, 2, seed=1)
    poses = {name: np.array([[20.0, 20.0, 0.0], [20.0, 60.0, 0.0]]) for name in drives}
    wheels = np.full((2, 2), 0.5)
    for cycle in range(10):
        for name in drives:
            poses[name], _ = drives[name].move(poses[name], wheels, cycle)
        if cycle == 2:
            np.testing.assert_array_equal(poses["late"][:, 0], 20.0)
    np.testing.assert_allclose(poses["plain"][:, 0], 20.0 + 6.4, atol=1e-9)
    np.testing.assert_allclose(poses["late"][:, 0], 20.0 + 0.7 * 6.4, atol=1e-9)
    assert (np.abs(poses["scaled"][:, 2]) > 1e-3).all()
    assert poses["scaled"][0, 2] != poses["scaled"][1, 2]


def test_images_of_an_emulated_laboratory_have_the_noise_and_the_delay_of_its_tracker():
    def shown(**settings):
        laboratory = small_laboratory(scenario=replace(SMALL, tracker=swarm.Tracking(**settings)))
        laboratory._eye.render = lambda poses, _: poses
        laboratory.link("agent-1").send(b"D,800,300\r")
        laboratory.clock.sleep(0.8)
        images = np.array([laboratory.camera.snapshot(0.8) for _ in range(200)])
        return images, laboratory.poses(0.8), laboratory.poses(0.5)

    images, now, _ = shown()
    np.testing.assert_array_equal(images[0], now)
    images, now, before = shown(delay_s=0.3)
    np.testing.assert_array_equal(images[0], before)
    assert np.abs(now - before)[:, :2].max() > 0.5
    images, now, _ = shown(position_noise_cm=0.5, heading_noise_rad=0.1)
    # 1000 poses: their standard deviations are known to 2 %.
    np.testing.assert_allclose((images - now).std(axis=(0, 1)), [0.5, 0.5, 0.1], rtol=0.1)


def test_what_a_laboratory_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"`scenario.arena` must have walls; got an unbounded one"):
        EmulatedLaboratory(swarm.AGGREGATION)
    with pytest.raises(
        ValueError, match=r"`scenario.replicas` must be at most 4, one for each color; got 5"
    ):
        EmulatedLaboratory(replace(SMALL, replicas=5))


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("clock_drift", -1e-5, "a finite number of at least 0 and below 0.01; got -1e-05"),
        ("battery_s", 0.0, "a finite number above 0; got 0.0"),
        ("latency_s", (0.2, 0.1), "two times, the first not above the second"),
        ("intervention_s", -1.0, "a finite number of at least 0; got -1.0"),
        ("camera_lag_s", 0.1, "a finite number of at least 0 and below 0.1; got 0.1"),
    ],
)
def test_conditions_that_cannot_be_are_refused(name, value, rule):
    with pytest.raises(ValueError, match=f"`conditions.{name}` must be {rule}"):
        Conditions(**{name: value})


def test_robots_and_places_that_do_not_exist_are_refused(laboratory):
    with pytest.raises(ValueError, match=r"`name` must be one of agent-1, .*; got 'agent-9'"):
        laboratory.link("agent-9")
    with pytest.raises(
        ValueError,
        match=r"`pose` must be inside the arena of 90.0 x 100.0 cm; got \(95.0, 10.0, 0.0\)",
    ):
        laboratory.faults.carry("agent-1", 95.0, 10.0)


def beginnings(**conditions):
    """Return when each robot begins to move (A,), in parts of a fiftieth of a second, after all were told at once."""
    laboratory = small_laboratory(latency_s=(0.0, 0.0), **conditions)
    laboratory.clock.sleep(0.2 + 1e-6)
    links = [laboratory.link(name) for name in laboratory.names]
    before = laboratory.poses()
    for link in links:
        link.send(b"D,500,-500\r")
    moved = np.full(len(links), -1)
    for part in range(1, 16):
        laboratory.clock.sleep(0.02)
        turned = np.abs(laboratory.poses()[:, 2] - before[:, 2]) > 1e-3
        moved[turned & (moved < 0)] = part
    return moved


def test_robots_begin_their_control_cycles_at_moments_of_their_own():
    own, together = beginnings(), beginnings(own_phases=False)
    assert len(set(own)) >= 3
    assert own.min() > 0
    assert len(set(together)) == 1


def test_periods_differ_so_phases_drift():
    laboratory = small_laboratory(period_spread=0.005)
    laboratory.clock.sleep(1.0)
    before = laboratory._due_s % laboratory.interval_s
    laboratory.clock.sleep(10.0)
    drift = (laboratory._due_s % laboratory.interval_s) - before
    assert np.abs(np.exp(2j * np.pi * drift / laboratory.interval_s) - 1).max() > 0.5


def test_a_robot_waits_for_a_random_part_of_a_cycle_before_each_trial():
    laboratory = small_laboratory()
    laboratory.operator.press_remote()
    pauses = []
    for robot in laboratory._robots:
        take = robot.emulated.take_pause
        robot.emulated.take_pause = lambda interval_s, take=take: (
            pauses.append(take(interval_s)) or pauses[-1]
        )
    laboratory.clock.sleep(37.0)
    waited = [pause for pause in pauses if pause > 0]
    assert len(waited) == 2 * len(laboratory.names)  # once in each loop
    assert 0.01 < np.std(waited) < 0.05
    assert max(waited) < 0.1
