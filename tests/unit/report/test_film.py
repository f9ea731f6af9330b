import importlib
import sys
from itertools import islice

import numpy as np
import pytest
from PIL import Image

from turing_learning import report
from turing_learning.report._replay import poses_at

WRITERS = [report.write_gif, report.write_mp4]


@pytest.fixture
def replay():
    poses = np.zeros((11, 2, 3))
    poses[:, 0, 0] = np.linspace(0, 50, 11)
    poses[:, 1, 1] = 30
    swarms = (
        report.Swarm("Agents", poses, 1),
        report.Swarm("Replicas", poses, 1, np.array([True])),
    )
    return report.Replay("Both", 3.5, 5.0, 0.1, swarms, walls_cm=(-5.0, -5.0, 60.0, 40.0))


def pixels_like(picture, color):
    return np.argwhere(
        np.abs(np.asarray(picture.convert("RGB")).astype(int) - color).max(axis=2) < 24
    )


def test_a_gif_lasts_as_long_as_the_motion(replay, tmp_path):
    with Image.open(report.write_gif(replay, tmp_path / "a.gif", frames_per_second=10)) as film:
        durations = []
        for k in range(film.n_frames):
            film.seek(k)
            durations.append(film.info["duration"])
    assert durations == [100] * 11


def test_speed_shortens_the_film(replay, tmp_path):
    with Image.open(
        report.write_gif(replay, tmp_path / "a.gif", speed=2, frames_per_second=10)
    ) as film:
        assert film.n_frames == 6


def test_a_gif_repeats_forever(replay, tmp_path):
    with Image.open(report.write_gif(replay, tmp_path / "a.gif", speed=5)) as film:
        assert film.info["loop"] == 0


def test_the_agent_in_the_gif_moves_to_the_right(replay, tmp_path):
    with Image.open(report.write_gif(replay, tmp_path / "a.gif", frames_per_second=10)) as film:
        columns = []
        for k in (0, 5, 10):
            film.seek(k)
            columns.append(pixels_like(film, (0, 114, 178))[:, 1].mean())
    left, _, right, _ = replay.view_cm
    assert np.diff(columns) == pytest.approx(480 * 25 / (right - left), abs=3)


def test_y_points_up(replay, tmp_path):
    with Image.open(report.write_gif(replay, tmp_path / "a.gif", speed=5)) as film:
        agent, item = (
            pixels_like(film, color)[:, 0].mean() for color in ((0, 114, 178), (77, 187, 157))
        )
    assert item < agent


def test_replicas_are_in_the_second_panel(replay, tmp_path):
    with Image.open(report.write_gif(replay, tmp_path / "a.gif", speed=5)) as film:
        assert pixels_like(film, (213, 94, 0))[:, 1].min() > film.width / 2


def test_an_mp4_holds_every_frame(replay, tmp_path):
    av = pytest.importorskip("av")
    with av.open(str(report.write_mp4(replay, tmp_path / "a.mp4", frames_per_second=10))) as film:
        stream = film.streams.video[0]
        frames = [frame.to_image() for frame in film.decode(stream)]
        assert stream.average_rate == 10
    assert len(frames) == 11
    assert (
        pixels_like(frames[-1], (0, 114, 178))[:, 1].mean()
        > pixels_like(frames[0], (0, 114, 178))[:, 1].mean() + 100
    )


def test_mp4_without_the_extra_names_it(replay, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(ImportError, match=r"av must be installed; .*turing-learning\[video\]"):
        report.write_mp4(replay, tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", WRITERS)
def test_a_film_that_cannot_be_finished_leaves_the_old_one(replay, tmp_path, monkeypatch, write):
    if write is report.write_mp4:
        pytest.importorskip("av")
    (tmp_path / "film").write_text("old")
    film = importlib.import_module("turing_learning.report._replay")
    draw = film._pictures

    def fail(*arguments):
        yield from islice(draw(*arguments), 5)
        raise OSError("No space left on device")

    monkeypatch.setattr(film, "_pictures", fail)
    with pytest.raises(OSError, match="No space left"):
        write(replay, tmp_path / "film")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("film", "old")]


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("speed", [0, -1.0, np.inf, np.nan])
def test_a_speed_that_is_not_positive_is_refused(replay, tmp_path, write, speed):
    with pytest.raises(ValueError, match=f"`speed` must be a finite number above 0; got {speed}"):
        write(replay, tmp_path / "film", speed=speed)


@pytest.mark.parametrize(("write", "most"), [(report.write_gif, 50), (report.write_mp4, 120)])
def test_a_frame_rate_out_of_range_is_refused(replay, tmp_path, write, most):
    for rate in (0, most + 1):
        with pytest.raises(
            ValueError, match=f"`frames_per_second` must be an integer from 1 to {most}; got {rate}"
        ):
            write(replay, tmp_path / "film", frames_per_second=rate)


def test_between_frames_headings_take_the_shorter_arc():
    poses = np.zeros((2, 1, 3))
    poses[:, 0, 2] = [np.pi - 0.1, -np.pi + 0.1]
    poses[1, 0, 0] = 4
    replay = report.Replay("t", 3.5, 5.0, 0.1, (report.Swarm("a", poses, 1),))
    np.testing.assert_allclose(poses_at(replay, replay.swarms[0], 0.05), [[2, 0, np.pi]])


def test_before_and_after_the_motion_it_stands_still(replay):
    swarm = replay.swarms[0]
    np.testing.assert_array_equal(poses_at(replay, swarm, -1.0), swarm.poses[0])
    np.testing.assert_array_equal(poses_at(replay, swarm, 99.0), swarm.poses[-1])
