import re
from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import Detector, detect, recorded_motion, run_classifiers
from turing_learning.runs import infer, load_run
from turing_learning.trajectories import Trajectories

SMALL = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


def paths(frames, individuals=3, seed=0):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(0.3, 0.1, (frames, individuals, 2)), axis=0)


def recording(frames=60, fps=10.0, **fields):
    positions = paths(frames)
    present = np.ones(positions.shape[:2], dtype=bool)
    return replace(Trajectories(positions, present, fps, ("a", "b", "c")), **fields)


def walks(parameters, rng):
    speed = parameters[:, :1] + rng.normal(0, 0.5, (len(parameters), 6))
    return np.stack([speed, rng.normal(size=speed.shape)], axis=-1)


@pytest.fixture(scope="module")
def fish(tmp_path_factory):
    """A small run on a recording, in a folder."""
    folder = tmp_path_factory.mktemp("fish") / "run"
    windows = recording(400).windows(6)
    infer(
        genuine=windows,
        simulate=walks,
        parameters={"speed": (0, 20)},
        generations=6,
        settings=SMALL,
        out=folder,
        seed=2,
    )
    return load_run(folder)


def test_windows_of_each_individual_come_in_order_of_time(fish):
    motion = recorded_motion(recording(60), run_classifiers(fish))
    assert motion.individuals == ("a", "b", "c")
    for samples, times in zip(motion.samples, motion.times, strict=True):
        assert samples.shape == (9, 6, 2)
        np.testing.assert_allclose(times[:, 1] - times[:, 0], 0.6)
        assert (np.diff(times[:, 0]) > 0).all()
    assert motion.times[0][0, 0] == pytest.approx(0.1)  # the first turn needs a step before it


def test_positions_are_smoothed_as_for_the_run_that_was_inferred(tmp_path):
    smoothed = recording(400).windows(6, smooth_frames=3)
    infer(
        genuine=smoothed,
        simulate=walks,
        parameters={"speed": (0, 20)},
        generations=2,
        settings=SMALL,
        out=tmp_path / "run",
    )
    run, given = run_classifiers(load_run(tmp_path / "run")), recording(60)
    assert run.smooth_frames == 3
    for frames, asked in ((3, None), (5, 5), (1, 1)):
        found = recorded_motion(given, run, smooth_frames=asked)
        expected = given.windows(6, hold_out=0, smooth_frames=frames)
        assert sum(map(len, found.samples)) == len(expected.learning)
        np.testing.assert_array_equal(
            found.samples[0], expected.learning[expected.learning_index[:, 0] == 0]
        )


def test_the_windows_are_those_that_learning_takes(fish):
    given = recording(60)
    expected = given.windows(6, hold_out=0)
    motion = recorded_motion(given, run_classifiers(fish))
    np.testing.assert_array_equal(
        motion.samples[1], expected.learning[expected.learning_index[:, 0] == 1]
    )


def test_who_is_never_there_for_long_has_no_window_and_no_verdict(fish):
    present = np.ones((60, 3), dtype=bool)
    present[5:, 2] = False
    motion = recorded_motion(recording(60, present=present), run_classifiers(fish))
    assert len(motion.samples[2]) == 0
    verdict = Detector.from_run(fish).timeline(motion)[2]
    assert (verdict.windows, verdict.abnormal, verdict.spells) == (0, False, ())


def test_broken_tracks_are_normal_recordings_too(fish):
    run = replace(run_classifiers(fish), names=("speed", "neighbor_bearing"))
    present = np.ones((400, 3), dtype=bool)
    present[:100, 1] = False
    present[30:, 2] = False
    broken = recorded_motion(recording(400, present=present), run)
    detection = detect(run, recorded_motion(recording(60), run), genuine=[broken])
    # "c" leaves before "b" comes: who does then as "b" does rests, and has no bearing.
    assert re.search(r"On 3[123] planted individuals \(11 kinds\)", detection.remarks[-1])


def test_a_run_keeps_what_calibrates_a_detector(fish):
    genuine, abnormal = run_classifiers(fish).calibration
    held_out = recording(400).windows(6).held_out
    np.testing.assert_array_equal(genuine[len(genuine) // 2 :, 0], held_out)
    assert abnormal.shape[1:] == (1, 6, 2)
    near = np.abs(abnormal[..., 0].mean(axis=(1, 2)) - fish.estimate["speed"])
    assert near.min() > 1  # a fifth of half the range is 2, and the mean of six steps scatters
    one, two = (Detector.from_run(fish) for _ in range(2))
    np.testing.assert_array_equal(one.genuine_scores, two.genuine_scores)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fps": 25.0}, "`fps` must be that of the run, 10; got 25"),
        ({"unit": "px"}, "`motion` must be in cm; got px"),
        (
            {"present": np.arange(60)[:, None] % 5 * np.ones(3) > 0},
            "must hold a window of 6 steps .* got 60 frames",
        ),
    ],
)
def test_a_recording_that_does_not_fit_is_refused(fish, changes, message):
    with pytest.raises(ConfigurationError, match=message):
        recorded_motion(recording(60, **changes), run_classifiers(fish))


def test_a_short_recording_is_refused(fish):
    with pytest.raises(ConfigurationError, match=r"must hold a window of 6 steps .* got 6 frames"):
        recorded_motion(recording(6), run_classifiers(fish))


def test_a_run_that_does_not_know_its_time_step_or_sees_other_signals_is_refused(fish):
    run = run_classifiers(fish)
    with pytest.raises(ConfigurationError, match="`run` must know its time step"):
        recorded_motion(recording(), replace(run, interval_s=0.0))
    with pytest.raises(
        ConfigurationError, match=r"`run` must have signals that a recording yields, .* got heat"
    ):
        recorded_motion(recording(), replace(run, names=("speed", "heat")))


def test_robots_need_headings(run):
    with pytest.raises(
        ConfigurationError,
        match=r"`motion` must have headings, as the run has, .*; got a recording without",
    ):
        recorded_motion(recording(), run_classifiers(run))
    heading = np.zeros((60, 3))
    motion = recorded_motion(recording(60, headings=heading), run_classifiers(run))
    assert motion.samples[0].shape == (5, 10, 2)


def test_motion_is_measured_as_that_of_the_run(fish):
    run = run_classifiers(fish)
    assert run.headings == "without"
    facing = recording(60, headings=np.full((60, 3), np.pi))
    expected = recorded_motion(recording(60), run).samples
    for found, samples in zip(recorded_motion(facing, run).samples, expected, strict=True):
        np.testing.assert_array_equal(found, samples)
    assert (recorded_motion(facing, replace(run, headings="with")).samples[0][..., 0] < 0).any()
    with pytest.raises(ConfigurationError, match="`motion` must have headings"):
        recorded_motion(recording(60), replace(run, headings="with"))
