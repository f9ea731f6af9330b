import numpy as np
import pytest

import turing_learning as tl
from turing_learning.families import BurstAndCoast, Couzin, Vicsek, recorded_ranges, said_ranges


def group(speed_cm_s, apart_cm, individuals=4, frames=300, fps=10.0):
    """Return a recording of individuals in a row that swim side by side."""
    rng = np.random.default_rng(0)
    steps = speed_cm_s / fps * np.exp(1j * np.cumsum(rng.normal(0, 0.1, frames)))
    path = np.cumsum(steps)
    places = path[:, None] + apart_cm * np.arange(individuals)
    positions = np.stack([places.real, places.imag], axis=-1)
    return tl.load_trajectories(positions, fps=fps, pixels_per_cm=1, y_axis="up")


def test_ranges_that_fit_the_recording_are_kept():
    family = Couzin(individuals=4)
    assert recorded_ranges(family, group(6.0, 5.0)) == family.parameters


def test_faster_animals_have_faster_models():
    """Goats that walk at 20.6 cm/s, where the suggested range ends at 20."""
    found = recorded_ranges(Couzin(individuals=4), group(20.6, 5.0))
    assert found["speed"].high == 41.0
    assert found["repulsion_radius"].high == 5.0
    assert found["speed"].unit == "cm/s"


def test_groups_that_are_wide_apart_have_wide_zones():
    found = recorded_ranges(Couzin(individuals=4), group(6.0, 75.0))
    assert found["speed"].high == 20
    assert [found[f"{zone}_width"].high for zone in ("orientation", "attraction")] == [150, 150]
    assert found["repulsion_radius"].high == 50
    assert found["turning_rate"].high == 6


def test_slow_animals_in_a_dish_have_narrow_ranges():
    found = recorded_ranges(Vicsek(individuals=4, period_cm=None), [group(0.1, 0.3)])
    assert found["speed"].high == pytest.approx(0.2)
    assert found["radius"].high == pytest.approx(0.6)


def test_one_alone_has_no_distances():
    found = recorded_ranges(BurstAndCoast(individuals=1), group(100.0, 1.0, individuals=1))
    assert found["speed"].high == 200
    assert found["glide_time"] == BurstAndCoast(individuals=1).parameters["glide_time"]


def test_ranges_are_said():
    known = Couzin(individuals=4).parameters
    found = said_ranges(["speed=5:300", "noise=0.001:1:log"], known)
    assert (found["speed"].low, found["speed"].high, found["speed"].unit) == (5, 300, "cm/s")
    assert found["noise"].scale == "log"
    assert list(found) == list(known)
    count = said_ranges(["count=1:20:integer"])["count"]
    assert count.to_units(np.array([-1.0, 0.01, 1.0])).tolist() == [1.0, 11.0, 20.0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "speed",
            r"`range` must be NAME=LOW:HIGH, .*; got 'speed'\. For example: range='speed=5:300'",
        ),
        ("speed=5", "must be NAME=LOW:HIGH"),
        ("speed=5:4", r"`range` must begin with its lower end; got 'speed=5:4'"),
        ("speed=1:2:normal", "must end with log or integer, if with a word"),
        ("sped=1:2", r"must name one of speed, .*Did you mean `speed`\?"),
        ("noise=0.5:3:integer", "must be an integer for an integer parameter; got 0.5"),
    ],
)
def test_ranges_that_are_none_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        said_ranges([text], Couzin(individuals=4).parameters)


def test_a_range_is_given_once():
    with pytest.raises(ValueError, match="must be given once for each parameter; got 'speed=1:3'"):
        said_ranges(["speed=1:2", "speed=1:3"], Couzin(individuals=4).parameters)
