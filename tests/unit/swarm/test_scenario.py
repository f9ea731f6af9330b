import math
import re
from dataclasses import FrozenInstanceError, replace

import pytest

from turing_learning.robots import LABORATORY
from turing_learning.studies import BEHAVIORS
from turing_learning.swarm import (
    AGGREGATION,
    OBJECT_CLUSTERING,
    SCENARIOS,
    Arena,
    Objects,
    Robot,
    Sensor,
    Tracking,
    Trial,
)
from turing_learning.swarm._scenario import most_disks


def test_presets_are_the_papers_case_studies():
    assert AGGREGATION.controller == (-0.7, -1.0, 1.0, -1.0)
    assert (AGGREGATION.agents, AGGREGATION.replicas, AGGREGATION.objects.count) == (10, 1, 0)
    assert OBJECT_CLUSTERING.controller == (0.5, 1.0, 1.0, 0.5, 0.1, 0.5)
    assert (
        OBJECT_CLUSTERING.agents,
        OBJECT_CLUSTERING.replicas,
        OBJECT_CLUSTERING.objects.count,
    ) == (4, 1, 10)
    assert all(scenario.name == name for name, scenario in SCENARIOS.items())


def test_parameters_are_named_by_wheel_and_sensor_state():
    assert OBJECT_CLUSTERING.parameter_names == ("vl0", "vr0", "vl1", "vr1", "vl2", "vr2")


def test_samples_have_a_hundred_steps_and_are_scaled_by_the_robots_largest_speeds():
    assert AGGREGATION.control_steps == 100
    assert AGGREGATION.input_scale == pytest.approx((12.8, 5.0196), abs=1e-4)


def test_a_sensor_reads_kinds_by_their_place_and_passes_through_others():
    assert [
        OBJECT_CLUSTERING.sensor.reading_of(kind) for kind in ("background", "object", "robot")
    ] == [0, 1, 2]
    assert AGGREGATION.sensor.reading_of("object") == 0


def test_agents_that_nobody_knows_have_no_truth():
    assert AGGREGATION.truth == AGGREGATION.controller
    assert replace(AGGREGATION, known=False).truth is None


@pytest.mark.parametrize("scenario", SCENARIOS.values(), ids=SCENARIOS)
def test_known_scenarios_are_in_enkis_world(scenario):
    assert scenario.world == "enki"
    assert scenario.in_world("paper").in_world("enki") == scenario


def test_scenarios_are_frozen():
    with pytest.raises(FrozenInstanceError):
        AGGREGATION.agents = 3


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Robot(radius_cm=-1), r"`robot.radius_cm` must be a finite number above 0; got -1"),
        (
            lambda: Robot(mass_g=float("nan")),
            r"`robot.mass_g` must be a finite number above 0; got nan",
        ),
        (lambda: Robot(wheel_noise=1), r"`robot.wheel_noise` must be .* below 1; got 1"),
        (
            lambda: Robot(wheel_scale_spread=1),
            r"`robot.wheel_scale_spread` must be .* below 1; got 1",
        ),
        (lambda: Robot(slip=-0.1), r"`robot.slip` must be .* at least 0 and below 1; got -0.1"),
        (
            lambda: Robot(actuation_lag_cycles=-1),
            r"`robot.actuation_lag_cycles` must be .* from 0 to 1000; got -1",
        ),
        (
            lambda: Objects(gravity_cm_s2=-1),
            r"`objects.gravity_cm_s2` must be .* at least 0; got -1",
        ),
        (lambda: Sensor(mistakes=1.1), r"`sensor.mistakes` must be .* of at most 1; got 1.1"),
        (
            lambda: Tracking(position_noise_cm=-1),
            r"`tracker.position_noise_cm` must be .* at least 0; got -1",
        ),
        (
            lambda: Tracking(heading_noise_rad=-1),
            r"`tracker.heading_noise_rad` must be .* at least 0; got -1",
        ),
        (
            lambda: AGGREGATION.in_world("enky"),
            r"`world` must be a known world; got 'enky'. Did you mean `enki`?",
        ),
        (lambda: Objects(count=-1), r"`objects.count` must be .* at least 0; got -1"),
        (lambda: Objects(friction=-0.1), r"`objects.friction` must be .* at least 0; got -0.1"),
        (lambda: Arena(width_cm=10), r"must be both given or both left out; got \(10, None\)"),
        (lambda: Arena(10, 0), r"`arena.height_cm` must be a finite number above 0; got 0"),
        (
            lambda: Sensor(("robot",)),
            r"`sensor.readings` must be 'background', then any of .*; got \('robot',\)",
        ),
        (lambda: Trial(physics_steps=0), r"`trial.physics_steps` must be .* at least 1; got 0"),
        (
            lambda: Trial(duration_s=0.25),
            r"`trial.duration_s` must be a whole number of control intervals of 0.1 s",
        ),
        (lambda: replace(AGGREGATION, agents=0), r"`scenario.agents` must be .* at least 1; got 0"),
        (
            lambda: replace(AGGREGATION, replicas=0),
            r"`scenario.replicas` must be .* at least 1; got 0",
        ),
        (
            lambda: replace(AGGREGATION, controller=(1.0,)),
            r"`scenario.controller` must be 4 wheel speeds, two for each",
        ),
        (
            lambda: replace(AGGREGATION, controller=(1.0, 1, 1, float("inf"))),
            "must be finite wheel speeds",
        ),
        (
            lambda: replace(AGGREGATION, arena=Arena(50.0, 6.5)),
            r"`scenario.arena.height_cm` must be more than the diameter of what moves in it, 7; got 6.5",
        ),
        (
            lambda: replace(AGGREGATION, arena=Arena(10.0, 10.0)),
            r"`scenario.arena` must have room for .*; got 10 x 10 cm, where at most 2 of 11 bodies of radius 3.5 cm have room",
        ),
        (
            lambda: replace(AGGREGATION, robot=Robot(radius_cm=1000.0)),
            r"`scenario.trial.start_side_cm` must have room for .*; got 331.66 cm, where at most 1 of 11 bodies of radius 1000 cm",
        ),
        (
            lambda: replace(OBJECT_CLUSTERING, arena=Arena(30.0, 30.0)),
            r"at most 9 of 10 bodies of radius 5 cm have room",  # the robots alone would fit
        ),
        (
            lambda: replace(OBJECT_CLUSTERING, agents=50, arena=Arena(50.0, 50.0)),
            r"at most 50 of 61 bodies of radius 3.5 cm or more have room",  # the objects alone would fit
        ),
    ],
)
def test_values_that_make_no_sense_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize("radius", [0.1, 3.5, 1e-5])
def test_disks_that_fit_are_never_refused(radius):
    for rows in range(1, 40):
        for columns in range(1, 40):
            square = (2 * radius * (columns - 1), 2 * radius * (rows - 1))
            assert most_disks(square, radius) >= rows * columns
            staggered = (2 * radius * (columns - 1 / 2), math.sqrt(3) * radius * (rows - 1))
            assert most_disks(staggered, radius) >= rows * columns


def test_an_arena_that_nine_disks_fill_has_no_room_for_a_tenth():
    nine = replace(AGGREGATION, agents=8, arena=Arena(21.0, 21.0))
    assert nine.individuals == 9
    with pytest.raises(ValueError, match="at most 9 of 10 bodies"):
        replace(nine, agents=9)


@pytest.mark.parametrize("scenario", [*SCENARIOS.values(), BEHAVIORS, LABORATORY])
def test_a_description_says_no_numbers_that_may_be_set_otherwise(scenario):
    """Those of the paper's sections, and of the field of view that is in the name, stay true."""
    said = re.sub(r"\(paper, section [\d.]+\)|and is [^(]+", "", scenario.description)
    assert not re.search(r"\d|\b(two|three|four|five|eight|ten|eleven)\b", said)
