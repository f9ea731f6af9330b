"""What holds for every family."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from turing_learning.families import FAMILIES, BurstAndCoast, Couzin, Robots, Vicsek
from turing_learning.swarm import (
    AGGREGATION,
    AGGREGATION_VIEW_60,
    OBJECT_CLUSTERING,
    Arena,
    simulate,
)
from turing_learning.trajectories import SIGNALS, compute_signals

every_family = pytest.mark.parametrize("make", FAMILIES.values(), ids=FAMILIES)


def models(family, count=3, seed=0):
    ranges = np.array([parameter.initial for parameter in family.parameters.values()])
    return np.random.default_rng(seed).uniform(*ranges.T, size=(count, len(ranges)))


def unbounded(make, **settings):
    return make(**settings, **({"period_cm": None} if make is Vicsek else {}))


@every_family
def test_samples_are_of_observed_individuals_over_all_steps(make):
    family = make(individuals=4, steps=7, observed=3)
    samples = family(models(family, 5), np.random.default_rng(1))
    assert samples.shape == (5, 3, 7, 2)
    assert np.isfinite(samples).all()


@every_family
def test_positions_are_those_of_everybody_in_two_frames_more_than_steps(make):
    family = make(individuals=4, steps=7)
    assert family.simulate(models(family), np.random.default_rng(1)).shape == (3, 9, 4, 2)


@every_family
def test_the_same_random_numbers_give_the_same_motion(make):
    family = make(steps=5)
    runs = [family(models(family), np.random.default_rng(seed)) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert (runs[0] != runs[2]).any()


@every_family
def test_a_model_moves_in_the_same_way_whoever_comes_after_it(make):
    family = make(steps=5)
    parameters = models(family, 4)
    alone = family.simulate(parameters[:1], np.random.default_rng(3))
    among = family.simulate(parameters, np.random.default_rng(3))
    np.testing.assert_array_equal(alone, among[:1])


@every_family
def test_a_model_does_not_depend_on_the_parameters_of_others(make):
    family = make(steps=5)
    parameters = models(family, 3)
    changed = parameters * [[0.5], [1], [0.5]]
    first, second = (
        family.simulate(each, np.random.default_rng(3))[1] for each in (parameters, changed)
    )
    np.testing.assert_array_equal(first, second)


@every_family
def test_samples_are_measured_as_recorded_motion_is(make):
    family = unbounded(make, individuals=4, steps=6, observed=2, signals=tuple(SIGNALS))
    parameters = models(family)
    samples = family(parameters, np.random.default_rng(1))
    positions = family.simulate(parameters, np.random.default_rng(1))
    measured = (
        compute_signals(positions, fps=family.fps, names=family.signals)
        .values[:, 1:, :2]
        .transpose(0, 2, 1, 3)
    )
    if make is Robots:  # with their headings: signed, and turning on the spot
        samples, measured = np.abs(samples[..., [0, 2]]), measured[..., [0, 2]]
    np.testing.assert_allclose(samples, measured, atol=1e-9)


@every_family
def test_what_is_measured_between_two_frames_is_the_displacement(make):
    family = make(individuals=2, steps=6, signals=("speed",))
    parameters = models(family)
    positions = family.simulate(parameters, np.random.default_rng(1))[:, 1:, 0]
    lengths = np.linalg.norm(np.diff(positions, axis=1), axis=-1)
    samples = family(parameters, np.random.default_rng(1))[:, 0, :, 0]
    np.testing.assert_allclose(np.abs(samples) * family.interval_s, lengths, atol=1e-9)


@every_family
def test_settling_comes_before_the_first_frame(make):
    long, late = make(steps=9), make(steps=5, settling_steps=4)
    assert long.moves == late.moves
    parameters = models(long)
    whole, end = (family.simulate(parameters, np.random.default_rng(1)) for family in (long, late))
    np.testing.assert_array_equal(whole[:, 4:], end)


@every_family
def test_parameters_have_units_and_a_finite_range(make):
    family = make()
    assert family.units == {name: parameter.unit for name, parameter in family.parameters.items()}
    assert all(
        np.isfinite([parameter.low, parameter.high]).all()
        for parameter in family.parameters.values()
    )


@every_family
def test_a_family_can_be_sent_to_a_worker_process(make):
    family = make(steps=3)
    assert pickle.loads(pickle.dumps(family)) == family  # noqa: S301 - our own bytes


@every_family
def test_samples_of_a_known_system_come_from_as_many_groups(make):
    family = make(individuals=3, observed=2, steps=4)
    parameters = models(family, 1)
    truth = dict(
        zip(reversed(list(family.parameters)), reversed(parameters[0]), strict=True)
    )  # by name, in any order
    samples = family.observe(truth, groups=5, rng=np.random.default_rng(1))
    expected = family(np.repeat(parameters, 5, axis=0), np.random.default_rng(1))
    np.testing.assert_array_equal(samples, expected.reshape(10, 4, 2))


def test_robots_move_as_those_of_the_swarm():
    robots = Robots(individuals=3, steps=8, observed=3)
    controller = np.array([AGGREGATION.controller])
    poses, headings = robots._paths(controller, np.random.default_rng(1))
    starts = np.concatenate([poses[:, 0], headings[:, 0, :, None]], axis=-1)
    scenario = replace(AGGREGATION, robot=replace(AGGREGATION.robot, wheel_noise=0.0))
    quiet = Robots(individuals=3, steps=8, observed=3, scenario=scenario)
    moved = simulate(scenario, np.tile(controller[:, None], (1, 3, 1)), starts, control_steps=9)
    samples = quiet(controller, np.random.default_rng(1))
    np.testing.assert_allclose(samples, moved.speeds[:, :, 1:], atol=1e-9)


def test_robots_start_within_the_walls():
    arena = replace(AGGREGATION, arena=Arena(100, 50))
    positions = Robots(scenario=arena, steps=3).simulate(
        np.zeros((20, 4)), np.random.default_rng(1)
    )
    assert (positions.max(axis=(0, 1, 2)) <= [100, 50]).all()
    assert (positions.max(axis=(0, 1, 2)) > [80, 40]).all()


@pytest.mark.parametrize(
    "settings",
    [{"start_side_cm": 20}, {"scenario": replace(AGGREGATION, arena=Arena(27, 27))}],
    ids=["square", "walls"],
)
def test_robots_that_have_no_room_where_they_start_are_refused(settings):
    assert Robots(individuals=16, **settings)
    with pytest.raises(
        ValueError,
        match="`individuals` must have room where they start; got 17, and at most 16 of 17 bodies",
    ):
        Robots(individuals=17, **settings)


def test_robots_that_see_objects_have_parameters_for_them():
    robots = Robots(scenario=OBJECT_CLUSTERING, individuals=5, steps=3, start_side_cm=100)
    assert list(robots.parameters) == ["vl0", "vr0", "vl1", "vr1", "vl2", "vr2"]
    assert robots.simulate(models(robots), np.random.default_rng(1)).shape == (3, 5, 5, 2)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"individuals": 0}, "`individuals` must be an integer of at least 1; got 0"),
        ({"individuals": 2.0}, "`individuals` must be an integer of at least 1; got 2.0"),
        ({"steps": 0}, "`steps` must be an integer of at least 1; got 0"),
        ({"observed": 0}, "`observed` must be an integer of at least 1; got 0"),
        ({"observed": 11}, "`observed` must be at most `individuals`, 10; got 11"),
        ({"settling_steps": -1}, "`settling_steps` must be an integer of at least 0; got -1"),
        ({"interval_s": 0.0}, "`interval_s` must be a finite number above 0; got 0.0"),
        ({"start_side_cm": np.inf}, "`start_side_cm` must be a finite number above 0; got inf"),
        (
            {"signals": ("speed", "color")},
            r"`signals` must be a tuple of some of speed, turn, .*; got \('speed', 'col",
        ),
        ({"signals": "speed"}, "`signals` must be a tuple of some of .*; got 'speed'"),
        ({"signals": ()}, r"`signals` must be a tuple .*; got \(\)"),
        (
            {"individuals": 1, "signals": ("neighbor_distance",)},
            r"`signals` must not speak of neighbors where there is one individual; got \('neighbor_distance',\)",
        ),
        ({"variation": 0.0}, "`variation` must be a finite number above 0; got 0.0"),
    ],
)
def test_settings_that_break_a_rule_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        BurstAndCoast(**settings)


@every_family
@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"steps": 10**9}, "`steps` must be an integer from 1 to 100000; got 1000000000"),
        (
            {"settling_steps": 10**20},
            "`steps` must be an integer from 1 to 100000; got 100000000000000000100",
        ),
        (
            {"individuals": 10**12},
            "`individuals` must be an integer from 1 to 99009; got 1000000000000",
        ),
    ],
)
def test_groups_that_would_take_minutes_are_refused_at_once(make, settings, message):
    with pytest.raises(ValueError, match=message):
        make(**settings)


def test_groups_of_many_pairs_are_refused_where_each_looks_at_each():
    with pytest.raises(
        ValueError,
        match="`individuals` must make at most 100000000 pairs in all steps; got 5000, which",
    ):
        Couzin(individuals=5000)
    assert BurstAndCoast(individuals=5000).individuals == 5000


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (np.ones((3, 5)), r"`parameters` must be of shape \(M, P\) = \(any, 6\); got \(3, 5\)"),
        (np.ones(6), r"`parameters` must be of shape \(M, P\) = \(any, 6\); got \(6,\)"),
        (np.ones((0, 6)), r"got \(0, 6\)"),
        ([["1"] * 6], "`parameters` must be an array of numbers; got an array of <U1"),
        (
            np.ones((2, 6)) * [[1], [-1]],
            r"must be finite and 0 or more; got speed = -1.0 \[model 1\]",
        ),
        (
            np.array([[1, 1, np.nan, 1, 1, 1]]),
            r"must be finite and 0 or more; got repulsion_radius = nan \[model 0\]",
        ),
    ],
)
def test_parameters_that_break_a_rule_are_refused(parameters, message):
    with pytest.raises(ValueError, match=message):
        Couzin().simulate(parameters, np.random.default_rng(1))


def test_wheel_speeds_may_be_negative_but_must_be_finite():
    with pytest.raises(ValueError, match=r"`parameters` must be finite; got vr1 = inf \[model 0\]"):
        Robots()(np.array([[-1, -1, 0, np.inf]]), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("truth", "groups", "message"),
    [
        ({"speed": 1}, 1, "`truth` must name speed, noise, radius; got speed"),
        ({}, 1, "`truth` must name speed, noise, radius; got nothing"),
        (
            {"speed": 1, "noise": 0, "radius": 1},
            2**63,
            "`groups` must be an integer from 1 to 99009; got",
        ),
        (
            {"speed": 1, "noise": 0, "radius": 1},
            0,
            "`groups` must be an integer from 1 to .*; got 0",
        ),
    ],
)
def test_a_known_system_must_be_named_completely(truth, groups, message):
    with pytest.raises(ValueError, match=message):
        Vicsek().observe(truth, groups=groups, rng=np.random.default_rng(1))


def test_the_field_of_view_of_robots_can_be_a_parameter():
    robots = Robots(
        scenario=AGGREGATION_VIEW_60, individuals=3, steps=8, observed=3, start_side_cm=60
    )
    assert robots.parameters["theta"].unit == "rad"
    blind, wide = ([0.0, 0.0, 1.0, 1.0, theta] for theta in (0.0, 2 * np.pi))
    moved = robots.simulate(np.repeat([blind, wide], 20, axis=0), np.random.default_rng(1))
    still = (moved[:, 0] == moved[:, -1]).all(axis=-1).all(axis=-1)
    assert still[:20].any()
    assert not still[20:].any()
