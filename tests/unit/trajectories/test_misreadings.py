"""Files that say something else than they seem to say: read as they are meant, or refused with what to state."""

import logging
from itertools import product

import numpy as np
import pandas as pd
import pytest
from tracker_files import trackmate

from turing_learning.trajectories import load_trajectories

SAID = {"pixels_per_cm": 10, "y_axis": "up"}
FPS = 25.0


def walk(frames=400, individuals=5, seed=0, step=3.0):
    """Return positions (F, A, 2) of individuals that swim in a tank of 600 by 400, in pixels."""
    rng = np.random.default_rng(seed)
    course = rng.uniform(0, 2 * np.pi, individuals) + np.cumsum(
        rng.normal(0, 0.15, (frames, individuals)), axis=0
    )
    way = np.cumsum(step * np.stack([np.cos(course), np.sin(course)], axis=-1), axis=0)
    size = np.array([600.0, 400.0])
    places = (way + rng.uniform(0, size, (individuals, 2))) % (2 * size)
    return np.round(40 + np.where(places > size, 2 * size - places, places), 2)


def table(positions, **more):
    """Return rows of frame, id, x, y, without those that are not a number."""
    frame, who = np.nonzero(~np.isnan(positions[..., 0]))
    x, y = positions[frame, who].T
    return pd.DataFrame({"frame": frame, "id": who, "x": x, "y": y, **more})


def load(tmp_path, rows, **said):
    rows.to_csv(tmp_path / "file.csv", index=False)
    return load_trajectories(tmp_path / "file.csv", **{"fps": FPS} | SAID | said)


def refused(tmp_path, rows, message, **said):
    with pytest.raises(ValueError, match=message):
        load(tmp_path, rows, **said)


def with_numbers_in_the_frame(rows, seed=1):
    """Return rows whose id is the place of a detection within its frame, beside the track."""
    mixed = rows.sample(frac=1, random_state=seed).sort_values("frame", kind="stable")
    return mixed.rename(columns={"id": "track"}).assign(id=mixed.groupby("frame").cumcount())


# ---------------------------------------------------------------- who is who


@pytest.mark.parametrize("name", ["track", "fish", "particle"])
def test_the_column_by_which_paths_are_continuous_names_the_individuals(name, tmp_path, caplog):
    rows = with_numbers_in_the_frame(table(walk())).rename(columns={"track": name})
    read = load(tmp_path, rows)
    np.testing.assert_allclose(read.positions, walk() / 10)
    (choice,) = read.choices
    assert choice.startswith(
        f"the column {name} names the individuals: 0% of the steps are jumps by it, "
    )
    assert choice in str(read.check())
    assert choice in caplog.text


def test_spots_of_trackmate_are_those_of_their_tracks(tmp_path, caplog):
    rows = table(walk()).rename(columns={"id": "TRACK_ID", "frame": "FRAME"})
    rows.insert(0, "ID", np.random.default_rng(0).permutation(len(rows)) + 1000)
    read = load(tmp_path, rows)
    assert read.individuals == ("0", "1", "2", "3", "4")
    assert "the column track_id names the individuals" in caplog.text


def test_a_table_of_trackmate_is_read_with_all_its_header_lines(tmp_path):
    read = load_trajectories(trackmate(tmp_path, walk()), fps=25, pixels_per_cm=10)
    np.testing.assert_allclose(read.positions, walk() * [0.1, -0.1])
    assert any(
        line.startswith("3 more header lines are no rows: ,,,(quality),(pixel)")
        for line in read.remarks
    )
    path = tmp_path / "renamed.csv"
    with path.open("w") as file:
        file.write("ID,TRACK_ID,x,y,FRAME\nSpot ID,Track ID,X,Y,Frame\n,,(pixel),(pixel),\n")
        file.writelines(
            f"{k},{who},{x},{y},{frame}\n"
            for k, (frame, who, x, y) in enumerate(table(walk()).values)
        )
    np.testing.assert_allclose(load_trajectories(path, fps=25, **SAID).positions, walk() / 10)


def test_whom_two_columns_name_as_well_has_to_be_said(tmp_path):
    rows = table(walk())
    swapped = np.where(
        rows.frame < 200, rows.id, (rows.id + 1) % 5
    )  # an exchange that no jump shows
    rows[["x", "y"]] = 300 + walk(step=0.01)[rows.frame, rows.id] * 0.001
    rows = rows.assign(track=swapped, id=rows.id)
    message = (
        r"have one column that names the individuals; got id and track, by several of which paths are continuous \[.*"
        r"file.csv:1\]\. Say which, for example columns=\{'id': 'track'\}\.$"
    )
    refused(tmp_path, rows, message)
    said = load(tmp_path, rows, columns={"id": "track"})
    assert said.individuals == ("0", "1", "2", "3", "4")
    assert said.choices == ()
    np.testing.assert_allclose(
        said.positions[200:, 1], load(tmp_path, rows, columns={"id": "id"}).positions[200:, 0]
    )


def test_longer_paths_are_taken_where_others_are_pieces_of_them(tmp_path):
    rows = table(walk())
    rows = rows.rename(columns={"id": "fish"}).assign(track=rows.id * 100 + rows.frame // 90)
    assert load(tmp_path, rows).individuals == ("0", "1", "2", "3", "4")
    read = load(tmp_path, rows.assign(id=rows.fish, species="zebrafish", animal="zebrafish"))
    assert (read.individuals, read.choices) == (("0", "1", "2", "3", "4"), ())


def test_columns_that_name_the_same_individuals_are_one(tmp_path):
    rows = table(walk())
    read = load(tmp_path, rows.assign(fish=rows.id.map(dict(enumerate("abcde")))))
    assert read.individuals == ("0", "1", "2", "3", "4")
    assert read.choices == ()


def test_numbers_of_detections_alone_are_no_individuals(tmp_path):
    rows = with_numbers_in_the_frame(table(walk())).drop(columns="track")
    message = r"individuals in the column id, not what was detected; got steps of .* give columns=\{'id': 'id'\}\.$"
    refused(tmp_path, rows, message)
    assert len(load(tmp_path, rows, columns={"id": "id"}).individuals) == 5
    alone = rows.assign(id=np.arange(len(rows)))
    refused(tmp_path, alone, "got 2000 individuals, each in one frame only")
    ranked = table(walk(2000)).sort_values(["frame", "x"])
    read = load(tmp_path, ranked.assign(id=ranked.groupby("frame").cumcount()))
    assert (
        "% of all steps are jumps: see whether the file tells individuals apart as they are"
        in str(read.check())
    )


def test_a_file_without_individuals_says_how_to_name_their_column(tmp_path):
    rows = table(walk()).rename(columns={"id": "bird"})
    refused(tmp_path, rows, r"give one position .* say so: columns=\{'id': 'bird'\}\.")
    assert len(load(tmp_path, rows, columns={"id": "bird"}).individuals) == 5


@pytest.mark.parametrize("same_names", [True, False])
def test_recordings_of_other_trials_are_not_together(same_names, tmp_path):
    one, two = table(walk()), table(walk(seed=2))
    two["id"] += 0 if same_names else 5
    rows = pd.concat([one.assign(trial="a"), two.assign(trial="b")])
    refused(
        tmp_path,
        rows,
        "hold one recording; got 2 by the column trial, with the same frames .* Write a file for each",
    )
    rows = pd.concat([one.assign(trial="a"), two.assign(trial="b", frame=two.frame + 400)])
    assert len(load(tmp_path, rows).positions) == 800
    rows = one.assign(arena=np.where(one.x > 300, "right", "left"))
    assert len(load(tmp_path, rows).individuals) == 5


def test_pieces_of_paths_are_told_and_make_no_larger_group(tmp_path, caplog):
    from turing_learning.families import Couzin, as_recorded

    rows = table(walk())
    read = load(tmp_path, rows.assign(id=rows.id * 100 + rows.frame // 40))
    assert (len(read.individuals), read.at_once) == (50, 5)
    assert (
        "50 individuals, of whom at most 5 are there at once, and half for 40 frames or fewer"
        in caplog.text
    )
    assert as_recorded(Couzin, read, read.windows(20)).individuals == 5


# ---------------------------------------------------------------- time


def timed(unit, frames=400):
    rows = table(walk(frames))
    return rows.assign(frame=rows.frame / FPS / unit).rename(columns={"frame": "time"})


@pytest.mark.parametrize(
    ("unit", "name", "rate"),
    [
        (1e-3, "ms", "0.025"),
        (1e-6, "us", "2.5e-05"),
        (60, "min", "1500"),
        (3600, "h", "90000"),
        (86400, "days", r"2.*"),
    ],
)
@pytest.mark.parametrize("shape", ["long", "wide", "beside frames"])
def test_times_in_another_unit_than_seconds_are_asked_for(shape, unit, name, rate, tmp_path):
    rows = timed(unit)
    if shape == "wide":
        rows = pd.DataFrame(
            walk().reshape(400, 10), columns=[f"{axis}{k}" for k in range(1, 6) for axis in "xy"]
        )
        rows.insert(0, "time", np.arange(400) / FPS / unit)
    elif shape == "beside frames":
        rows = table(walk()).assign(time=rows.time)
    message = (
        rf"`fps` must be given where values of `time` may not be in s; got none, and in s they state {rate} frames per second "
        rf"\[.*file.csv:1\]\. If they are in {name}, give fps=25\.0; if in s, give fps={rate}.*\.$"
    )
    refused(tmp_path, rows, message, fps=None)
    read = load(tmp_path, rows, fps=25)
    assert (read.fps, read.every, len(read.positions)) == (25, 1, 400)
    np.testing.assert_allclose(read.positions, walk() / 10)


@pytest.mark.parametrize("rate", [0.02, 0.5, 1.5, 25, 120, 500, 2000])
def test_times_in_seconds_are_read_as_they_are(rate, tmp_path):
    rows = table(walk())
    rows = rows.assign(frame=rows.frame / rate).rename(columns={"frame": "time"})
    read = load(tmp_path, rows, fps=None if rate >= 1 else rate)
    assert (read.fps, len(read.positions)) == (pytest.approx(rate), 400)
    assert load(tmp_path, rows.rename(columns={"time": "seconds"}), fps=None).fps == pytest.approx(
        rate
    )


@pytest.mark.parametrize("shape", ["long", "wide"])
def test_times_that_may_count_frames_are_asked_for(shape, tmp_path):
    rows = table(walk()).rename(columns={"frame": "time"})
    if shape == "wide":
        rows = pd.DataFrame(
            walk().reshape(400, 10), columns=[f"{axis}{k}" for k in range(1, 6) for axis in "xy"]
        )
        rows.insert(0, "time", np.arange(400))
    message = r"count frames, give columns=\{'frame': 'time'\} and the frame rate; if they are in s, give fps=1\."
    refused(tmp_path, rows, message, fps=None)
    refused(
        tmp_path,
        rows,
        r"`fps` must be 1 where values of `time` are whole and 1 apart, if they are in s; got 25",
    )
    assert load(tmp_path, rows, fps=1).fps == 1
    read = load(tmp_path, rows, columns={"frame": "time"})
    assert (read.fps, read.every, len(read.positions)) == (25, 1, 400)


def test_frame_numbers_that_are_times_can_be_said_to_be(tmp_path):
    rows = table(walk())
    read = load(tmp_path, rows.assign(frame=rows.frame * 40))
    with pytest.raises(
        ValueError,
        match=r"only one in 40 .* If frame numbers are times, give columns=\{'time': 'frame'\}\.",
    ):
        read.windows(10)
    read = load(tmp_path, rows.assign(frame=rows.frame * 40), columns={"time": "frame"})
    np.testing.assert_allclose(read.positions, walk() / 10)


def test_times_beside_frame_numbers_state_the_frame_rate(tmp_path):
    rows = table(walk())
    rows = rows.assign(time=rows.frame / FPS)
    assert load(tmp_path, rows, fps=None).fps == 25
    refused(tmp_path, rows, r"`fps` must be what the file states, 25\.0; got 30", fps=30)
    for other in (rows.frame, "12:00:03", np.nan):  # counted frames, a clock, nothing
        assert load(tmp_path, rows.assign(time=other), fps=30).fps == 30


def test_times_of_movement_without_a_unit_are_asked_for(tmp_path):
    dataset = load(tmp_path, table(walk())).to_xarray()
    dataset = dataset.assign_coords(time=np.arange(400) * 40.0)
    del dataset.attrs["fps"], dataset.attrs["time_unit"]
    with pytest.raises(
        ValueError, match=r"If they are in ms, give fps=25\.0; if in s, give fps=0\.025"
    ):
        load_trajectories(dataset)
    assert load_trajectories(dataset, fps=25).fps == 25


# ---------------------------------------------------------------- boxes and points of a body


def boxes(rng=None):
    """Return centers, and left, top, width and height of boxes around individuals."""
    rng = np.random.default_rng(3)
    size = 20 + 2 * rng.random((400, 5, 2))
    return walk(), walk() - size / 2, size


BOXES = {
    "mot": ("bb_left", "bb_top", "bb_width", "bb_height"),
    "plain": ("left", "top", "width", "height"),
    "corners": ("x1", "y1", "x2", "y2"),
    "ends": ("xmin", "ymin", "xmax", "ymax"),
    "prefix": ("bbox_x1", "bbox_y1", "bbox_x2", "bbox_y2"),
}


@pytest.mark.parametrize("kind", BOXES)
def test_positions_are_the_centers_of_boxes(kind, tmp_path, caplog):
    center, corner, size = boxes()
    third = size if kind in ("mot", "plain") else corner + size
    rows = table(center).drop(columns=["x", "y"])
    for name, values in zip(
        BOXES[kind], [*np.moveaxis(corner, -1, 0), *np.moveaxis(third, -1, 0)], strict=True
    ):
        rows[name] = values.reshape(-1)
    read = load(tmp_path, rows)
    np.testing.assert_allclose(read.positions, center / 10)
    assert "positions are the centers of the boxes in the columns " in caplog.text
    if kind == "mot":  # its own x, y and z are those of a world that it does not know
        np.testing.assert_allclose(
            load(tmp_path, rows.assign(conf=1, x=-1, y=-1, z=-1)).positions, center / 10
        )
        moved = rows.assign(x=center[..., 0].ravel(), y=center[..., 1].ravel() + 5)
        np.testing.assert_allclose(load(tmp_path, moved).positions, center / 10 + [0, 0.5])


def test_corners_of_one_box_are_not_two_individuals(tmp_path):
    center, corner, size = boxes()
    one = np.concatenate([corner[:, 0], (corner + size)[:, 0]], axis=1)
    rows = pd.DataFrame(one, columns=["x1", "y1", "x2", "y2"])
    message = r"not hold corners of boxes as individuals; .* give columns=\{'left': 'x1', 'top': 'y1', 'right': 'x2'"
    for each in (rows, rows.assign(frame=range(400))):
        refused(tmp_path, each, message)
    said = {"left": "x1", "top": "y1", "right": "x2", "bottom": "y2"}
    read = load(tmp_path, rows.assign(frame=range(400)), columns=said)
    np.testing.assert_allclose(read.positions, center[:, :1] / 10)
    two = pd.DataFrame(walk(individuals=2).reshape(400, 4), columns=["x1", "y1", "x2", "y2"])
    assert len(load(tmp_path, two).individuals) == 2


@pytest.mark.parametrize("size", [("width", "height"), ("w", "h")])
def test_positions_beside_the_size_of_a_box_have_to_be_explained(size, tmp_path):
    center, corner, extent = boxes()
    rows = table(corner).assign(
        **dict(zip(size, np.moveaxis(extent, -1, 0).reshape(2, -1), strict=True))
    )
    message = rf"say what of a box x and y are; got x and y beside {size[0]} and {size[1]} \[.*center, give columns=\{{'x': 'x'"
    refused(tmp_path, rows, message)
    said = {"left": "x", "top": "y", "width": size[0], "height": size[1]}
    np.testing.assert_allclose(load(tmp_path, rows, columns=said).positions, center / 10)
    np.testing.assert_allclose(
        load(tmp_path, rows, columns={"x": "x", "y": "y"}).positions, corner / 10
    )


@pytest.mark.parametrize(
    "points",
    [
        ("head", "tail"),
        ("nose", "body_center", "tail_base"),
        ("min", "max"),
        ("left_eye", "right_eye"),
    ],
)
def test_points_of_one_body_are_not_individuals(points, tmp_path):
    rows = pd.DataFrame(np.hstack([walk(individuals=1)[:, 0]] * len(points)))
    rows.columns = [f"{point}_{axis}" for point in points for axis in "xy"]
    message = rf"got {', '.join(sorted(points))}, which may be points .* for example columns=\{{'x': '{sorted(points)[0]}_x'"
    refused(tmp_path, rows.assign(frame=range(400)), message)
    said = {"x": f"{points[1]}_x", "y": f"{points[1]}_y"}
    assert load(tmp_path, rows.assign(frame=range(400)), columns=said).individuals == ("1",)


def test_any_names_of_columns_can_be_said(tmp_path):
    rows = table(walk())
    rows.columns = ["frame_idx", "instance", "body.x", "body.y"]
    refused(tmp_path, rows, "have the content of one of")
    said = {"frame": "frame_idx", "id": "instance", "x": "body.x", "y": "BODY.Y"}
    np.testing.assert_allclose(load(tmp_path, rows, columns=said).positions, walk() / 10)
    np.testing.assert_allclose(
        load_trajectories(rows, fps=25, columns=said, **SAID).positions, walk() / 10
    )
    refused(
        tmp_path,
        rows,
        r"have the column 'nothing' once; got frame_idx, instance, ",
        columns=said | {"x": "nothing"},
    )
    refused(
        tmp_path,
        rows,
        "`columns` must be one of frame, time, id, .*; got 'name'",
        columns={"name": "instance"},
    )


def test_columns_are_left_out_where_a_format_has_none(tmp_path):
    path = tmp_path / "toxtrac.txt"
    path.write_text("0\t0\t1\t5\t5\t1\n")
    with pytest.raises(
        ValueError, match=r"`columns` must be left out for format toxtrac; got \{'id': 'track'\}"
    ):
        load_trajectories(path, fps=25, pixels_per_cm=1, columns={"id": "track"}, format="toxtrac")


# ---------------------------------------------------------------- positions that can hardly be true


def lost(how, positions, frames, who=1):
    """Return positions in which one is lost for some frames, as trackers write it."""
    changed = positions.copy()
    changed[frames, who] = changed[frames[0], who] if how == "last" else how
    return changed


@pytest.mark.parametrize(
    ("how", "frames"),
    [
        *product(
            [(0.0, 0.0), (-1.0, -1.0), (-999.0, -999.0), (9999.0, 9999.0)],
            [range(60), range(150, 230), range(340, 400)],
        ),
        ("last", range(150, 230)),
    ],
)
def test_what_stands_for_missing_positions_is_not_learned_from(how, frames, tmp_path, caplog):
    read = load(tmp_path, table(lost(how, walk(), np.array(frames))))
    names = ("speed", "turn", "neighbor_distance", "neighbor_bearing")
    windows = read.windows(10, signals=names, hold_out=0)
    first = windows.learning_index[windows.learning_index[:, 0] == 1, 1]
    assert not any({*range(k, k + 11)} & {*frames[1:]} for k in first)
    without = table(walk())
    without = without[
        ~((without.id == 1) & without.frame.isin(frames if how != "last" else frames[1:]))
    ]
    clean = load(tmp_path, without).windows(10, signals=names, hold_out=0)
    common = [
        np.flatnonzero((clean.learning_index == index).all(axis=1))
        for index in windows.learning_index
    ]
    for window, place in zip(windows.learning, common, strict=True):
        for k in place:
            np.testing.assert_array_equal(window, clean.learning[k])
    # these are read as missing ones
    read_so = how == (-1.0, -1.0)
    said = "at exactly (-1, -1)" if read_so else "at exactly one point, as if for missing ones"
    assert caplog.text.count(said) == 1
    kept = read.windows(10, hold_out=0, jump_factor=None, longest_rest_s=None)
    there = any(
        {*range(k, k + 11)} & {*frames[1:]}
        for k in kept.learning_index[kept.learning_index[:, 0] == 1, 1]
    )
    assert there != read_so


def test_missing_positions_that_are_zero_now_and_then_are_left_out(tmp_path):
    rng, positions = np.random.default_rng(5), walk()
    gone = rng.random((400, 5)) < 0.15
    read = load(tmp_path, table(np.where(gone[..., None], 0.0, positions)))
    np.testing.assert_array_equal(read.cleared().present, ~gone)
    (remark,) = read.cleared().remarks
    assert remark.startswith(
        f"{gone.sum()} positions at exactly one point, as if for missing ones, such as (0, 0) of "
    )
    bridged = read.cleared().bridged(5)
    assert bridged.present.mean() > 0.98


def test_a_track_that_is_lost_till_the_end_is_not_learned_from(tmp_path):
    positions = walk(1000)
    positions[600:, 2] = positions[600, 2]
    read = load(tmp_path, table(positions))
    who, first = read.windows(20, hold_out=0).learning_index.T
    assert first[who == 2].max() < 600
    rests = read.windows(20, hold_out=0, longest_rest_s=60).learning_index
    assert len(rests) > len(who)


def resting(jitter, frames, decimals=2, seed=7):
    """Return positions of individuals that rest now and then for so many frames, and go on from there."""
    rng = np.random.default_rng(seed)
    moves = np.diff(walk(1500), axis=0)
    for who in range(5):
        for begin in rng.integers(50, 150, 4) + 350 * np.arange(4):
            moves[begin : begin + frames, who] = 0
    still = np.concatenate([walk(1500)[:1], moves]).cumsum(axis=0)
    return np.round(still + jitter * rng.normal(size=still.shape), decimals)


@pytest.mark.parametrize(
    ("jitter", "frames", "decimals"),
    [(0.0, 60, 2), (0.0, 200, 2), (0.3, 1000, 2), (0.2, 120, 0), (0.05, 90, 1)],
)
def test_animals_that_rest_are_learned_from(jitter, frames, decimals, tmp_path, caplog):
    read = load(tmp_path, table(resting(jitter, frames, decimals)))
    assert read.cleared() is read
    assert "for missing ones" not in caplog.text


def test_who_rests_for_long_is_learned_from_where_many_rest(tmp_path):
    moving = np.random.default_rng(0).random((30, 5, 1)) < 0.5
    steps = np.diff(walk(3001), axis=0) * np.repeat(moving, 100, axis=0)
    positions = 300 + np.cumsum(steps, axis=0)
    read = load(tmp_path, table(positions))
    assert read.cleared() is read
    positions[700:, 2] = positions[700, 2]  # lost, among those who rest
    assert np.flatnonzero(~load(tmp_path, table(positions)).cleared().present.all(axis=0)) == [2]


@pytest.mark.parametrize("spike", [(1e6, 1e6), (-4000.0, 200.0), (200.0, 9000.0)])
@pytest.mark.parametrize("length", [1, 2, 30])
def test_positions_far_outside_are_left_out_and_told(spike, length, tmp_path, caplog):
    positions = walk()
    positions[100 : 100 + length, 3] = spike + np.arange(length)[:, None] * 2.5
    read = load(tmp_path, table(positions))
    assert f"{length} position{'s' * (length > 1)} far outside all others, such as (" in caplog.text
    cleared = read.cleared()
    assert np.flatnonzero(~cleared.present[:, 3]).tolist() == list(range(100, 100 + length))
    assert np.ptp(cleared.positions[cleared.present], axis=0).max() < 61
    assert np.nanmax(read.windows(10).excerpt) < 70


def test_who_goes_far_away_without_a_jump_is_learned_from(tmp_path):
    positions = walk(1000)
    positions[100:, 3] += 20.0 * np.arange(900)[:, None]
    positions[700:, 3] += 500  # an identity may be lost there, too
    assert load(tmp_path, table(positions[:700])).cleared().present.all()


def test_a_point_for_missing_positions_is_one_where_a_path_begins_or_passes_nearby(tmp_path):
    rows = table(walk())
    there = rows.frame % 9 == 0
    start = rows[rows.id == 0].iloc[200]
    rows.loc[there, ["x", "y"]] = [start.x + 0.01, start.y]
    read = load(tmp_path, rows).cleared()
    assert not read.present[::9].any()
    assert read.present[1:9].all()


def test_most_positions_missing_is_odd(tmp_path):
    rows = table(walk())
    look = load(tmp_path, rows[np.random.default_rng(0).random(len(rows)) < 0.4]).look()
    assert any("59% of the positions are missing" in doubt for doubt in look.doubts)
    every_third = rows[rows.frame % 3 == 0]
    assert "only one frame in 3 is there" in load(tmp_path, every_third).look().doubts[0]


def test_everybody_at_one_point_is_refused(tmp_path):
    read = load(tmp_path, table(np.full((400, 5, 2), 7.0)))
    assert read.problems.still == ("0", "1", "2", "3", "4")
    message = r"`positions` must be of somebody who moves; got 2000 positions at exactly one point, .*longest_rest_s"
    with pytest.raises(ValueError, match=message):
        read.windows(10)


def test_one_bad_position_makes_no_large_tank(tmp_path):
    from turing_learning.families import RecordedSystem

    positions = walk()
    positions[100, 3] = 1e7
    table(positions).to_csv(tmp_path / "fish.csv", index=False)
    options = {"trajectories": [tmp_path / "fish.csv"], "fps": 25.0, "scale": 10.0, "y_axis": "up"}
    options |= {"model": "couzin", "window": 1.0}
    _, family, (motion,) = RecordedSystem(options).opened()
    assert max(family.tank_cm) < 61
    assert "1 position far outside all others" in str(motion.problems)


# ---------------------------------------------------------------- units


def test_headings_in_degrees_are_refused(tmp_path):
    rows = table(walk())
    course = np.arctan2(*np.moveaxis(np.diff(walk(), axis=0, append=walk()[-1:]), -1, 0)[::-1])
    rows["heading"] = course.ravel()
    assert load(tmp_path, rows).headings is not None
    message = r"have headings in rad; got \d+% of them beyond 2 pi, which may be degrees \[.*\]\. Convert them"
    for degrees in (np.degrees(course), np.degrees(course) % 360):
        refused(tmp_path, rows.assign(heading=degrees.ravel()), message)
    assert (
        load(tmp_path, rows.assign(heading=np.unwrap(course, axis=0).ravel())).headings is not None
    )


def test_shares_of_an_image_and_frame_numbers_are_told(tmp_path, caplog):
    load(tmp_path, table(np.round(walk() / 700, 4)))
    assert "all coordinates are from 0 to 1: shares of an image" in caplog.text
    rows = table(walk())
    load(tmp_path, rows.assign(x=rows.frame))
    assert "x grows by 1 in every frame, as frame numbers or times do" in caplog.text
    load(tmp_path, rows.assign(y=rows.frame / FPS))
    assert "y grows by 0.04 in every frame, as frame numbers or times do" in caplog.text


def test_what_else_a_file_may_hold_is_told(tmp_path, caplog):
    rows = table(walk())
    late = np.round(np.arange(400) * 41.7).astype(int)
    again = rows[:1].astype({"id": str}).assign(id="0.0", frame=400)
    lines = {
        "no two frames follow each other, 42 are between most: their numbers may be times": rows.assign(
            frame=late[rows.frame]
        ),
        "individuals are called -1: they may be detections of nobody": rows.assign(id=rows.id - 1),
        "individuals 0 and 0.0 may be one": pd.concat([rows.astype({"id": str}), again]),
        "positions are those in x and y alone, as if all z were the same": rows.assign(
            z=rows.frame
        ),
        "50% of all frames repeat the one before: they may be of a video at a": table(
            np.repeat(walk(), 2, axis=0)
        ),
    }
    for line, content in lines.items():
        caplog.clear()
        load(tmp_path, content)
        assert caplog.text.count(line) == 1, caplog.text
    load(tmp_path, rows, pixels_per_cm=0.05)
    assert (
        "positions are up to 1.05e+04 cm apart: see whether the scale is in pixels per cm, or"
        in caplog.text
    )
    caplog.clear()
    load(tmp_path, rows.assign(z=0.0))
    assert caplog.text == ""
    degrees = rows.rename(columns={"x": "longitude", "y": "latitude"})
    message = r"have positions in a plane; got degrees of longitude and latitude \[.*\]\. .* add project=True\."
    refused(tmp_path, degrees, message, columns={"x": "longitude", "y": "latitude"})


def test_positions_of_low_confidence_are_told(tmp_path, caplog):
    rows = table(walk())
    load(tmp_path, rows.assign(confidence=np.where(rows.frame % 10, 0.9, 0.1)))
    assert (
        "10.0% of all positions have a confidence below 0.5; `min_confidence` drops those"
        in caplog.text
    )


def test_nothing_is_said_of_a_file_that_is_clear(tmp_path, caplog):
    caplog.set_level(logging.INFO)
    read = load(tmp_path, table(walk()))
    assert (caplog.text, read.choices, str(read.check())) == ("", (), "no problems found")


# ---------------------------------------------------------------- what stands before a table


HEADED = {
    "for Excel": "sep=;\nframe;id;x;y\n",
    "for Excel, in quotes": '"sep=;"\r\nframe;id;x;y\n',
    "comments": "# made by a program, 25 fps\n#\nframe;id;x;y\n",
    "names in a comment": "# a comment\n# frame;id;x;y\n",
    "all of it": "sep=;\n#frame;id;x;y\n",
}


@pytest.mark.parametrize("name", HEADED)
def test_what_stands_before_a_table_is_no_row_of_it(name, tmp_path):
    rows = table(walk())
    body = rows.to_csv(index=False, header=False, sep=";", decimal=",")
    file = tmp_path / "file.csv"
    file.write_text(HEADED[name] + body)
    read = load_trajectories(file, fps=FPS, **SAID)
    np.testing.assert_allclose(read.positions, walk() / 10)
    line = HEADED[name].count("\n") + 3
    file.write_text(HEADED[name] + body.replace("\n", "\nx;", 2).replace("\nx;", "\n", 1))
    with pytest.raises(ValueError, match=rf"got 5 .*file.csv:{line}\]"):
        load_trajectories(file, fps=FPS, **SAID)


def test_what_numpy_writes_with_a_header_is_read(tmp_path):
    rows = table(walk())
    np.savetxt(tmp_path / "file.txt", rows, header="frame id x y")
    read = load_trajectories(tmp_path / "file.txt", fps=FPS, **SAID)
    np.testing.assert_allclose(read.positions, walk() / 10)


@pytest.mark.parametrize(
    ("name", "per_s"),
    [("time (min)", 1 / 60), ("Time [h]", 1 / 3600), ("timestamp_us", 1e6), ("elapsed (ms)", 1e3)],
)
def test_times_whose_name_states_the_unit_state_the_frame_rate(name, per_s, tmp_path):
    rows = table(walk()).rename(columns={"frame": name})
    rows[name] *= per_s / FPS
    assert load(tmp_path, rows, fps=None).fps == pytest.approx(FPS)


def test_dates_with_points_are_of_day_month_and_year(tmp_path):
    days = pd.date_range("2024-01-25", periods=60, freq="D")
    rows = table(walk(60)).assign(date=lambda told: days[told.frame].strftime("%d.%m.%Y"))
    read = load(tmp_path, rows.drop(columns="frame"), fps=None)
    assert read.fps == pytest.approx(1 / 86400, rel=1e-4)
    np.testing.assert_allclose(read.positions, walk(60) / 10)


@pytest.mark.parametrize(
    "names", [("centroid_x", "centroid_y"), ("cx", "cy"), ("X center", "Y center")]
)
def test_centers_of_boxes_are_positions(names, tmp_path):
    rows = table(walk()).rename(columns=dict(zip("xy", names, strict=True)))
    rows = rows.rename(columns={"id": "Object ID"}).assign(w=20, h=40)
    np.testing.assert_allclose(load(tmp_path, rows).positions, walk() / 10)


def test_sides_of_a_box_are_no_individuals(tmp_path):
    rows = table(walk(individuals=1)).drop(columns="id")
    sides = rows.assign(x_min=rows.x - 9, y_min=rows.y - 9, x_max=rows.x + 9, y_max=rows.y + 9)
    read = load(tmp_path, sides.drop(columns=["x", "y"]))
    np.testing.assert_allclose(read.positions, walk(individuals=1) / 10)


def test_wide_tables_may_name_the_coordinate_first(tmp_path):
    wide = table(walk()).pivot(index="frame", columns="id", values=["x", "y"])
    wide.columns = [f"{axis}_fish{who}" for axis, who in wide.columns]
    read = load(tmp_path, wide.reset_index())
    assert read.individuals == tuple(f"fish{who}" for who in range(5))
    np.testing.assert_allclose(read.positions, walk() / 10)
    two = wide.reset_index().iloc[:, [0, 1, 6, 2, 7]]
    for names, message in (
        (("mean", "std"), "got x and y of std"),
        (("vel", "acc"), "got x and y of acc, vel"),
        (("true", "pred"), "got pred, true, which may be .* one in several ways"),
    ):
        columns = ["frame", *(f"{axis}_{name}" for name in names for axis in "xy")]
        refused(tmp_path, two.set_axis(columns, axis=1), message)


# as PeTrack 0.9 and JuPedSim 0.9 write them
PETRACK = "# PeTrack project: a.pet\n# framerate: 16 fps\n# id frame x/m y/m z/m\n"
JUPEDSIM = (
    "#description: jpscore\n#framerate: 16.00\n#FR: the current frame\n"
    "#X,Y,Z: the agents coordinates (in metres)\n\n#ID\tFR\tX\tY\tZ\n"
)


@pytest.mark.parametrize(("head", "separator"), [(PETRACK, " "), (JUPEDSIM, "\t")])
def test_tables_of_pedestrians_state_rate_and_unit_in_comments(head, separator, tmp_path):
    rows = table(walk(), z=1.75)[["id", "frame", "x", "y", "z"]]
    text = rows.to_csv(index=False, header=False, sep=separator)
    (tmp_path / "file.txt").write_text(head + text)
    read = load_trajectories(tmp_path / "file.txt", y_axis="up")
    assert read.fps == 16
    np.testing.assert_allclose(read.positions, walk() * 100)


@pytest.mark.parametrize(
    ("names", "absent", "first_frame"),
    [
        ("frame,id,x,y", "#N/A", 0),
        ("Bild,Tier,X-Position,Y-Position", "\u2013", 0),
        ("Slice n\u00b0,Track n\u00b0,X,Y", "#DIV/0!", 1),
        ("image,individu,x,y", ".", 1),
    ],
)
def test_a_table_of_a_spreadsheet_is_read_in_other_words(names, absent, first_frame, tmp_path):
    path = tmp_path / "table.csv"
    rows = [
        f"{frame + first_frame},{who},{absent if frame == 3 else 10 * who + frame},"
        f"{absent if frame == 3 else 5}"
        for frame in range(6)
        for who in range(2)
    ]
    path.write_text("\n".join([names, *rows, ",,,", ""]))
    read = load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")
    assert (read.first_frame, read.individuals) == (first_frame, ("0", "1"))
    expected = np.array([[frame, 10 + frame] for frame in range(6)])
    np.testing.assert_array_equal(read.present[:, 0], [1, 1, 1, 0, 1, 1])
    np.testing.assert_array_equal(
        read.positions[read.present][:, 0], np.delete(expected, 3, 0).ravel()
    )


def test_two_individuals_beside_other_columns_are_no_box(tmp_path):
    path = tmp_path / "mtrack2.csv"
    rows = [f"{k},{10 + k},{20 + k},*,{80 - k},{60 + k * k},*" for k in range(12)]
    path.write_text("\n".join(["Frame,X1,Y1,Flag1,X2,Y2,Flag2", *rows, ""]))
    with pytest.raises(ValueError, match="corners of boxes, or individuals alone"):
        load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")


def test_decimal_commas_in_times_and_units_below_a_wide_header_are_read(tmp_path):
    long = tmp_path / "long.csv"
    rows = [f"{frame * 0.04:.2f};{frame};{2 * frame}".replace(".", ",") for frame in range(12)]
    long.write_text("\n".join(["Time [s];X [cm];Y [cm]", *rows, ""]))
    wide = tmp_path / "wide.csv"
    wide.write_text("\n".join(["Time;X1;Y1", "s;cm;cm", *rows, ""]))
    for path in (long, wide):
        read = load_trajectories(path, y_axis="up")
        assert (read.fps, read.unit) == (25, "cm")
        np.testing.assert_allclose(read.positions[:, 0, 1], 2 * np.arange(12))


def test_turns_that_the_tracker_makes_are_told_with_how_many_frames_to_leave_out(tmp_path):
    noise = np.random.default_rng(3).normal(0, 0.5, (400, 5, 2))
    (doubt,) = load(tmp_path, table(walk() + noise)).problems.doubts
    # noise of 0.05 cm makes turns of 0.05 * sqrt(6) / 0.3 rad, of which a fourth is below 0.12
    assert doubt.startswith("the tracker's noise, about 0.053 cm, makes turns of 0.43 rad")
    assert "by `thinned(4)` or --thin 4, or smooth" in doubt
    assert load(tmp_path, table(walk())).problems.doubts == ()
