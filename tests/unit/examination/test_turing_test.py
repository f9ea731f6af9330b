import json
from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.examination import QUICK, Ridge, TuringTest
from turing_learning.examination._samples import pair_of
from turing_learning.trajectories import Trajectories

RNG = np.random.default_rng(5)
OPTIONS = {"window_s": None, "smooth_frames": 1, "seed": 0}


def walkers(individuals=6, frames=400, turn=0.3, fps=10.0, **more):
    """Return a recording of individuals that walk with a speed of their own at every step."""
    headings = np.cumsum(turn * RNG.standard_normal((frames, individuals)), axis=0)
    steps = (0.5 + 0.1 * RNG.random((frames, individuals)))[..., None]
    positions = np.cumsum(steps * np.stack((np.cos(headings), np.sin(headings)), axis=-1), axis=0)
    names = tuple(f"walker {k}" for k in range(individuals))
    return Trajectories(positions, np.ones((frames, individuals), dtype=bool), fps, names, **more)


def test_two_recordings_are_told_apart_by_the_signal_that_differs():
    found = tl.test(walkers(), walkers(turn=0.9), examiners=QUICK, control=True)
    assert isinstance(found, TuringTest)
    assert found.verdict == "told apart"
    assert found.accuracy > 0.95
    first = found.telling[0]
    assert first.kind == "statistic"
    assert "turn" in first.what or "straight" in first.what
    assert found.control.p_value > 0.01
    assert "Told by (simulated against real):" in found.text
    assert "individuals" in found.text or "blocks of time" in " ".join(found.remarks)
    json.dumps(found.to_json())
    assert str(found).startswith("told apart: ")


def test_recordings_of_the_same_walkers_are_not_told_apart():
    found = tl.test(walkers(), walkers(), names=["speed", "turn"], examiners=QUICK)
    assert found.p_value > 0.05
    assert found.verdict in ("cannot tell", "cannot say")
    assert "told from" not in found.text


def test_arrays_are_samples():
    real, simulated = RNG.standard_normal((30, 20, 2)), 2 * RNG.standard_normal((30, 20, 2))
    found = tl.test(real, simulated, names=("x", "y"), examiners=QUICK)
    assert found.verdict == "told apart"
    assert found.signals == ("x", "y")
    groups = [np.arange(30) // 3] * 2
    assert tl.test(real, simulated, groups, examiners=QUICK).examined.groups == (10, 10)
    flat = np.concatenate((np.arange(30) // 3, np.arange(30) // 5))
    assert tl.test(real, simulated, flat, examiners=QUICK).examined.groups == (10, 6)


def test_the_keys_of_the_command_are_there():
    found = tl.test(
        RNG.standard_normal((20, 20, 1)), RNG.standard_normal((20, 20, 1)), examiners=QUICK
    ).to_json()
    wanted = {"accuracy", "interval", "p_value", "auc", "power_accuracy", "examiners", "telling"}
    assert wanted <= found.keys()
    assert {"name", "accuracy", "p_value"} == found["examiners"][0].keys()
    assert {"what", "accuracy"} <= found["telling"][0].keys()


def test_many_recordings_are_groups_and_few_are_not():
    four = [walkers(individuals=2, frames=120) for _ in range(4)]
    assert pair_of(four, four, names=None, **OPTIONS).groupings == ["recordings"]
    one = [walkers()]
    assert pair_of(one, one, names=None, **OPTIONS).groupings == ["individuals", "blocks of time"]
    two = [walkers(individuals=2)]
    assert pair_of(two, two, names=None, **OPTIONS).groupings == ["blocks of time"]


def test_signals_of_the_group_are_there_where_there_is_one():
    four = [walkers(frames=100) for _ in range(4)]
    pair = pair_of(four, four, names=None, **OPTIONS)
    assert pair.names == (
        "speed",
        "turn",
        "neighbor_distance",
        "neighbor_bearing",
        "polarization",
        "area",
    )
    aligned = pair.real.samples[..., 4]
    assert ((aligned >= 0) & (aligned <= 1)).all()
    assert pair_of(four[:1], four[:1], names=None, **OPTIONS).names == pair.names[:4]
    alone = pair_of([walkers(individuals=1)], [walkers()], names=None, **OPTIONS)
    assert alone.names == ("speed", "turn")


def test_a_signal_that_is_seldom_there_does_not_leave_out_the_others():
    """Of four recordings one has a third individual for a moment, so that its group has an area then."""
    four = [walkers(individuals=3, frames=100) for _ in range(4)]
    seldom = np.ones((100, 3), dtype=bool)
    seldom[60:, 2] = False
    four[1] = replace(four[1], present=seldom, positions=four[1].positions * seldom[..., None])
    pair = pair_of(four, four, names=None, window_s=3.0, smooth_frames=1, seed=0)
    assert pair.names[-1] == "polarization"
    assert "area is left out" in " ".join(pair.remarks)
    others = [recording for number, recording in enumerate(four) if number != 1]
    assert "area" in pair_of(others, [*others, *others], names=None, **OPTIONS).names


def test_a_recording_in_which_individuals_hardly_meet_is_seen_by_speed_and_turn():
    """One individual follows another: both are there in five of 100 frames, a window has 15."""
    followed = walkers(individuals=2, frames=100)
    present = np.ones((100, 2), dtype=bool)
    present[50:, 0] = False
    present[:45, 1] = False
    followed = replace(followed, present=present, positions=followed.positions * present[..., None])
    pair = pair_of([followed], [walkers()], names=None, **OPTIONS)
    assert pair.names == ("speed", "turn")
    assert "nobody has company" in " ".join(pair.remarks)


def test_the_area_is_that_of_a_disk_of_evenly_spread_points():
    places = RNG.uniform(-1, 1, (4_000, 2))
    places = 3 * places[(places**2).sum(axis=1) < 1]
    still = np.repeat(places[None], 12, axis=0) + 0.01 * RNG.standard_normal(
        (12, *places.shape)
    ).cumsum(axis=0)
    names = tuple(map(str, range(len(places))))
    recording = Trajectories(still, np.ones(still.shape[:2], dtype=bool), 10.0, names)
    pair = pair_of([recording], [recording], names=["area"], **OPTIONS)
    assert pair.real.samples.mean() == pytest.approx(9 * np.pi, rel=0.05)


def test_a_faster_recording_is_thinned_to_the_rate_of_the_other():
    pair = pair_of([walkers(fps=30.0, frames=900)], [walkers(fps=10.0)], names=["speed"], **OPTIONS)
    assert pair.interval_s == 0.1
    assert any("one frame in 3" in remark for remark in pair.remarks)


@pytest.mark.parametrize(
    ("real", "simulated", "options", "message"),
    [
        (
            walkers(fps=25.0),
            walkers(),
            {},
            "`fps` must be a whole multiple of the lowest rate, 10 per second; got 25",
        ),
        (
            walkers(unit="px"),
            walkers(),
            {},
            "`unit` must be the same for all recordings; got cm and px",
        ),
        (
            walkers(),
            walkers(),
            {"names": ["sped"]},
            "`signals` must be some of speed, .* got 'sped'. Did you mean",
        ),
        (walkers(), walkers(), {"window_s": 0.1}, "`window_s` must be at least two steps"),
        (walkers(), 5, {}, "`simulated` must be an array"),
        (np.zeros((3, 4, 2)), np.zeros((3, 5, 2)), {}, r"`simulated` must be of shape \(L, T, D\)"),
        (
            np.zeros((3, 4, 2)),
            np.zeros((3, 4, 2)),
            {"names": ["x"]},
            "`names` must be one for each of the 2 signals",
        ),
        (
            np.zeros((3, 4, 2)),
            np.zeros((3, 4, 2)),
            {"groups": [[1, 2], [1]]},
            "`groups` must be one label for each",
        ),
        (walkers(), walkers(), {"groups": [1]}, "`groups` must be left out for recordings"),
    ],
)
def test_what_cannot_be_compared_is_rejected(real, simulated, options, message):
    with pytest.raises(ValueError, match=message):
        tl.test(real, simulated, **options)


def test_statistics_that_tell_only_together_are_named():
    # both signals go up together in one kind, against each other in the other
    rng = np.random.default_rng(6)
    sides = []
    for sign in (1, -1):
        level = rng.choice([-1.0, 1.0], size=(150, 1))
        samples = rng.standard_normal((150, 30, 2))
        samples[..., 0] += level
        samples[..., 1] += sign * level
        sides.append(samples)
    found = tl.test(*sides, names=["speed", "turn"], examiners=QUICK)
    shuffled = {cue.what: cue.accuracy for cue in found.telling if cue.kind == "shuffled"}
    assert shuffled["all statistics"] > 0.95
    assert shuffled["mean speed shuffled"] < 0.65
    assert shuffled["mean turn shuffled"] < 0.65
    assert "No single statistic tells it as well" in str(found)
    assert "mean turn shuffled" in str(found)


def test_nothing_is_shuffled_where_the_sides_are_alike():
    rng = np.random.default_rng(7)
    found = tl.test(*rng.standard_normal((2, 100, 30, 2)), examiners=QUICK)
    assert not [cue for cue in found.telling if cue.kind == "shuffled"]


def test_individuals_are_no_groups_where_signals_are_those_of_the_whole_group():
    # all of one recording share the signal: each would be a copy of the others, and any two recordings told apart
    sides = [walkers(frames=1200)], [walkers(frames=1200)]
    assert "individuals" in pair_of(*sides, names=["speed"], **OPTIONS).groupings
    for names in (["polarization"], ["speed", "area"]):
        assert pair_of(*sides, names=names, **OPTIONS).groupings == ["blocks of time"]


def test_samples_that_are_all_the_same_do_not_ask_for_more_recordings():
    # at such an offset nothing of the motion is left in a billionth of the largest value
    far = [1e12 + RNG.standard_normal((20, 20, 1)) for _ in range(2)]
    found = tl.test(*far, names=["x"], examiners=QUICK)
    assert found.verdict == "cannot say"
    assert "All samples look the same to the examiners." in found.text
    assert "Give more recordings" not in found.text
    assert any(remark.startswith("x is constant") for remark in found.remarks)


def recordings(speeds):
    """Return a recording of walkers for each speed, which all of it share."""
    made = []
    for speed in speeds:
        plain = walkers(individuals=6, frames=300)
        made.append(replace(plain, positions=speed * plain.positions))
    return made


def test_what_recordings_share_is_no_difference_of_the_sides():
    """Three against three: smaller groups tell them, and would tell most divisions of the six."""
    real, simulated = recordings((1.0, 1.05, 2.0)), recordings((2.0, 2.05, 2.1))
    found = tl.test(real, simulated, examiners=QUICK)
    assert found.verdict == "cannot say"
    assert found.examined.grouping == "recordings"
    assert "other divisions of the recordings" in " ".join(found.remarks)
    assert "could not have noticed" not in found.text
    assert "which differ themselves" in str(found).replace("\n", " ")
    assert not any("blocks of time" in remark for remark in found.remarks)
    slower = tl.test(recordings((1.0, 1.05, 1.1)), recordings((1.5, 1.6, 1.7)), examiners=QUICK)
    assert slower.verdict == "told apart"
    assert slower.examined.grouping != "recordings"
    assert "chance alone tells them apart in one of 10 tests" in str(slower).replace("\n", " ")


def test_copies_of_real_samples_are_named():
    real, simulated = RNG.standard_normal((2, 20, 20, 1))
    assert not any(
        "equal a real one" in remark for remark in tl.test(real, simulated, examiners=QUICK).remarks
    )
    simulated[:3] = real[5:8]
    found = tl.test(real, simulated, examiners=QUICK)
    assert "3 of 20 simulated samples equal a real one, as far as the panel sees." in found.remarks


def test_values_that_differ_are_not_written_alike():
    real, simulated = np.full((20, 20, 1), 3.0), np.full((20, 20, 1), 3.0001)
    found = tl.test(real, simulated, names=["x"], examiners=QUICK)
    assert "mean x (3.0001 against 3)" in found.text


def test_too_few_exchanges_of_labels_are_rejected():
    with pytest.raises(ValueError, match="`permutations` must be an integer of at least 19"):
        tl.test(*RNG.standard_normal((2, 20, 20, 1)), permutations=5)


def test_examiners_that_are_none_or_see_what_there_is_not_are_rejected():
    sides = RNG.standard_normal((2, 20, 20, 1))
    with pytest.raises(ValueError, match="`examiners` must be one or several; got none"):
        tl.test(*sides, examiners=[])
    with pytest.raises(
        ValueError, match=r"`examiners` must see one of statistics, .*; got 'pixels'"
    ):
        tl.test(*sides, examiners=[Ridge("mine", "pixels")])
