"""Exports of programs beyond their plain form: folders, points of the body, uneven times, degrees, units in names."""

import json
import re
import tracemalloc
import zipfile

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from test_misreadings import table, walk
from tracker_files import (
    coco,
    deeplabcut,
    ethovision,
    fasttrack,
    gpx,
    idtracker_ai_h5,
    movebank,
    ros_csv,
    sleap,
    sleap_csv,
    toxtrac,
    toxtrac_csv,
    trackmate,
    trackmate_xml,
    trex_csv,
)
from tracker_files import walk as short_walk

import turing_learning as tl
from turing_learning.errors import RefusedError
from turing_learning.trajectories import load_trajectories

SAID = {"pixels_per_cm": 10, "y_axis": "up"}


def write(tmp_path, rows, name="file.csv", **how):
    rows.to_csv(tmp_path / name, index=False, **how)
    return tmp_path / name


# ---------------------------------------------------------------- times


def jittered(positions, seed=0, fps=25.0, jitter=0.012):
    """Return rows of positions (F, A, 2) that are linear in time, at uneven times (s)."""
    rng = np.random.default_rng(seed)
    frames = len(positions)
    times = np.arange(frames) / fps + rng.uniform(-jitter, jitter, frames)
    times -= times[0]
    rows = [
        (times[frame], who, *(100 + 30 * times[frame] * np.array([1, who + 1])))
        for frame in range(frames)
        for who in range(2)
    ]
    return pd.DataFrame(rows, columns=["time", "id", "x", "y"])


def test_uneven_times_are_refused_with_the_option_that_makes_them_even(tmp_path):
    path = write(tmp_path, jittered(walk()))
    with pytest.raises(
        ValueError, match=r"whole frames apart.*If they are uneven, make them even by resample=25"
    ):
        load_trajectories(path, **SAID)


def test_uneven_times_are_resampled_on_request(tmp_path):
    path = write(tmp_path, jittered(walk()))
    read = load_trajectories(path, resample=25, **SAID)
    assert read.fps == 25
    assert read.present[1:-1].all()
    seconds = np.arange(len(read.positions)) / 25
    np.testing.assert_allclose(read.positions[1:-1, 1, 1], (10 + 6 * seconds)[1:-1])
    assert "times were made even by resampling at 25 per second" in read.remarks
    assert read.reading.fps == "made even by resampling"


def test_resampling_fills_no_gap(tmp_path):
    rows = jittered(walk())
    path = write(tmp_path, rows[(rows.time < 4) | (rows.time > 6)])
    read = load_trajectories(path, resample=25, **SAID)
    seconds = np.arange(len(read.positions)) / 25
    assert not read.present[(seconds > 4.1) & (seconds < 5.9)].any()
    assert read.present[(seconds > 0.1) & (seconds < 3.8)].all()


def test_wide_tables_are_resampled_too(tmp_path):
    rows = jittered(walk())
    wide = rows.pivot(index="time", columns="id")
    wide.columns = [f"{axis}{who + 1}" for axis, who in wide.columns]
    path = write(tmp_path, wide.reset_index())
    read = load_trajectories(path, resample=25, **SAID)
    assert read.individuals == ("1", "2")
    seconds = np.arange(len(read.positions)) / 25
    np.testing.assert_allclose(read.positions[1:-1, 0, 0], (10 + 3 * seconds)[1:-1])


@pytest.mark.parametrize("form", ["%Y-%m-%dT%H:%M:%S.%fZ", "%Y-%m-%d %H:%M:%S.%f", "%H:%M:%S.%f"])
def test_dates_and_times_of_day_are_times(form, tmp_path):
    rows = table(walk())
    begin = pd.Timestamp("2024-05-01 11:59:58")
    stamps = (begin + pd.to_timedelta(rows.frame / 25, unit="s")).dt.strftime(form)
    path = write(tmp_path, rows.drop(columns="frame").assign(timestamp=stamps))
    read = load_trajectories(path, **SAID)
    assert read.fps == 25
    np.testing.assert_allclose(read.positions, walk() / 10)


def test_a_time_that_is_no_time_is_refused_with_its_line(tmp_path):
    rows = table(walk()).rename(columns={"frame": "time"}).astype({"time": object})
    rows.loc[3, "time"] = "noon"
    with pytest.raises(
        ValueError,
        match=r"times that are numbers, dates \(ISO 8601\) or h:min:s; got 'noon' .*:5\]",
    ):
        load_trajectories(write(tmp_path, rows), fps=25, **SAID)


def test_milliseconds_in_the_name_need_no_rate(tmp_path):
    rows = table(walk())
    rows = rows.assign(time_ms=rows.frame * 40).drop(columns="frame")
    assert load_trajectories(write(tmp_path, rows), **SAID).fps == 25


# ---------------------------------------------------------------- units and degrees


@pytest.mark.parametrize(
    ("x", "y", "per_unit"),
    [("x (mm)", "y (mm)", 10), ("x_cm", "y_cm", 1), ("X [m]", "Y [m]", 0.01)],
)
def test_units_in_names_of_columns_are_the_scale(x, y, per_unit, tmp_path):
    rows = table(walk())
    rows[["x", "y"]] *= per_unit / 10
    rows = rows.rename(columns={"x": x, "y": y})
    read = load_trajectories(write(tmp_path, rows), fps=25, y_axis="up")
    assert read.unit == "cm"
    np.testing.assert_allclose(read.positions, walk() / 10)
    assert read.reading.columns == {"frame": "frame", "id": "id", "x": x, "y": y}


def test_degrees_are_positions_on_request_only(tmp_path):
    rows = table(walk()).rename(columns={"x": "longitude", "y": "latitude"})
    rows[["longitude", "latitude"]] = [25.0, 60.0] + rows[["longitude", "latitude"]] * 1e-6
    path = write(tmp_path, rows)
    with pytest.raises(ValueError, match=r"To bring degrees into a plane, add project=True"):
        load_trajectories(path, fps=25)
    with pytest.raises(ValueError, match="To bring degrees into a plane"):
        load_trajectories(
            path, fps=25, columns={"x": "longitude", "y": "latitude"}, pixels_per_cm=1, y_axis="up"
        )
    read = load_trajectories(path, fps=25, project=True)
    assert (read.unit, read.reading.columns["x"]) == ("cm", "longitude")
    # at 60 degrees a degree is 55,800 m of longitude and 111,412 m of latitude (Snyder 1987, table 5)
    extent = np.ptp(read.positions[read.present], axis=0)
    np.testing.assert_allclose(
        extent, np.ptp(walk().reshape(-1, 2), axis=0) * 1e-6 * [5_580_000, 11_141_200], rtol=1e-3
    )


def test_tracks_that_cross_the_date_line_hang_together(tmp_path):
    rows = table(walk()).rename(columns={"x": "lon", "y": "lat"})
    rows["lon"] = (179.9999 + rows.lon * 1e-6 + 180) % 360 - 180
    rows["lat"] *= 1e-6
    assert (rows.lon < 0).any()
    read = load_trajectories(write(tmp_path, rows), fps=25, project=True)
    assert np.ptp(read.positions[read.present][:, 0]) < 1e4


def test_decimal_commas_and_words_for_missing_values_are_read(tmp_path):
    rows = table(walk())
    path = write(tmp_path, rows, sep=";", decimal=",")
    path.write_text(
        path.read_text() + "400;0;NA;NA\n400;1;-;-\n400;2;5,5;6,5\n400;3;;\n400;4;1;1\n"
    )
    read = load_trajectories(path, fps=25, **SAID)
    np.testing.assert_allclose(read.positions[:400], walk() / 10)
    assert read.present[400].tolist() == [False, False, True, False, True]


# ---------------------------------------------------------------- points of the body and folders


@pytest.mark.parametrize("writer", [deeplabcut, sleap])
def test_two_points_of_the_body_give_the_heading(writer, tmp_path):
    path = writer(tmp_path, short_walk())
    read = load_trajectories(
        path, fps=25, pixels_per_cm=10, keypoint="thorax", heading=("head", "thorax")
    )
    # the head is one pixel to the right of the thorax and one below, where y of images grows
    np.testing.assert_allclose(read.headings[read.present], -np.pi / 4)


def test_the_heading_of_ethovision_leads_to_the_nose(tmp_path):
    read = load_trajectories(ethovision(tmp_path, short_walk()), heading=("nose", "center"))
    np.testing.assert_allclose(read.headings[read.present], np.pi / 4)
    assert read.individuals == ("Subject 1",)


def test_headings_of_fasttrack_are_counted_with_y_upwards(tmp_path):
    read = load_trajectories(fasttrack(tmp_path, short_walk()), fps=25, pixels_per_cm=10)
    np.testing.assert_allclose(read.headings[read.present], 0.25)


def test_a_heading_of_one_point_is_refused(tmp_path):
    path = deeplabcut(tmp_path, short_walk())
    with pytest.raises(ValueError, match="`heading` must be two points of the body"):
        load_trajectories(path, fps=25, pixels_per_cm=10, keypoint="thorax", heading=("head",))


def test_the_folder_of_a_session_of_idtracker_ai_is_read(tmp_path):
    (tmp_path / "session_video" / "trajectories").mkdir(parents=True)
    idtracker_ai_h5(tmp_path / "session_video" / "trajectories", short_walk())
    (tmp_path / "session_video" / "session.json").write_text("{}")
    read = load_trajectories(tmp_path / "session_video", pixels_per_cm=10)
    assert read.format == "idtracker.ai-h5"
    assert "read from trajectories/trajectories.h5" in read.remarks


def test_files_of_trex_are_individuals_by_their_numbers(tmp_path):
    read = load_trajectories(trex_csv(tmp_path, short_walk()), fps=25)
    assert read.individuals == ("fish0", "fish1", "fish2")


@pytest.mark.parametrize("folder", [True, False])
def test_trex_writes_zeros_with_decimals_and_frames_twice(folder, tmp_path):
    # header and form of cells as TRex 1.1.9 writes them
    positions = walk(frames=40)[:, :2]
    for who in range(2):
        lines = [
            "frame,SPEED#wcentroid (cm/s),X#wcentroid (cm),Y#wcentroid (cm),frame,missing,time"
        ]
        for frame, (x, y) in enumerate(positions[:, who]):
            missing = frame == 7
            place = "inf,inf" if missing else f"{x},{y}"
            lines.append(f"{frame}.000,0.067,{place},{frame}.000,{missing:d}.000,{frame / 30:.3f}")
        (tmp_path / f"video_fish{who}.csv").write_text("\n".join(lines) + "\n")
    read = load_trajectories(tmp_path if folder else tmp_path / "video_fish0.csv")
    assert read.fps == 30
    assert read.unit == "cm"
    expected = (positions * [1, -1])[:, : 1 + folder]
    np.testing.assert_array_equal(np.flatnonzero(~read.present[:, 0]), [7])
    np.testing.assert_allclose(read.positions[8:], expected[8:])


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 50])
def test_times_with_two_decimals_state_the_rate(fps, tmp_path):
    positions = walk(frames=400)
    rows = {"Frame": range(400), "Time": [f"{frame / fps:.2f}" for frame in range(400)]}
    for who in range(2):
        rows |= {
            f"{axis.upper()}_Arena0_Ind{who}": positions[:, who, k] for k, axis in enumerate("xy")
        }
    path = write(tmp_path, pd.DataFrame(rows), sep=";")
    read = load_trajectories(path, pixels_per_cm=10)
    assert read.format == "animalta"
    assert read.fps == pytest.approx(fps, rel=2e-4)
    assert load_trajectories(path, pixels_per_cm=10, fps=fps).fps == fps
    # long ones, too, whose times begin anywhere and are truncated
    seconds = [f"{int(100 * (639.07 + frame / fps)) / 100:.2f}" for frame in range(400)]
    long = pd.DataFrame({"seconds": seconds, "x": positions[:, 0, 0], "y": positions[:, 0, 1]})
    path = write(tmp_path, long[~long.index.isin(range(100, 160))], "long.csv")
    for said in ({}, {"fps": fps}):
        read = load_trajectories(path, **SAID, **said)
        assert read.fps == pytest.approx(fps, rel=2e-4)
        np.testing.assert_array_equal(np.flatnonzero(~read.present), range(100, 160))


@pytest.mark.parametrize("fps", [29.9, 30.1, 59.5])
def test_rounded_times_of_a_short_file_leave_the_rate_to_the_user(fps, tmp_path):
    rows = {
        "frame": range(40),
        "time": [f"{frame / fps:.2f}" for frame in range(40)],
        "x": walk(frames=40)[:, 0, 0],
        "y": walk(frames=40)[:, 0, 1],
    }
    path = write(tmp_path, pd.DataFrame(rows))
    with pytest.raises(RefusedError, match="no rate is stated by times"):
        load_trajectories(path, **SAID)
    assert load_trajectories(path, fps=fps, **SAID).fps == fps


def test_animalta_with_a_row_for_each_individual_is_read(tmp_path):
    positions = walk(frames=400)[:, :3]
    lines = ["Frame;Time;Arena;Ind;X;Y"]
    for arena, ind, who in ((0, 0, 0), (0, 1, 1), (1, 0, 2)):
        for frame, (x, y) in enumerate(positions[:, who]):
            lines.append(f"{frame:05.2f};{frame / 30:05.2f};{arena};{ind};{x};{y}")
    path = tmp_path / "coordinates.csv"
    path.write_text("\n".join(lines) + "\n")
    read = load_trajectories(path, pixels_per_cm=10)
    assert (read.format, read.fps) == ("animalta", 30)
    assert read.individuals == ("Arena0_Ind0", "Arena0_Ind1", "Arena1_Ind0")
    np.testing.assert_allclose(read.positions, positions * [0.1, -0.1])


@pytest.mark.parametrize("beside", [True, False])
def test_the_long_table_of_idtracker_ai_is_in_pixels_of_an_image(beside, tmp_path):
    positions = walk(frames=100)[:, :2]
    folder = tmp_path / "session_fish" / "trajectories_csv"
    folder.mkdir(parents=True)
    lines = ["frame,time,individual,x,y,probability"]
    for frame in range(100):
        for who in range(2):
            x, y = positions[frame, who]
            # where it interpolated, it has no probability
            sure = "nan" if frame % 9 == 3 else "1.000e+00"
            lines.append(f"{frame},{frame / 28:.3f},{who},{x},{y},{sure}")
    (folder / "trajectories_tidy.csv").write_text("\n".join(lines) + "\n")
    if beside:
        (folder / "attributes.json").write_text(json.dumps({"frames_per_second": 28}))
    read = load_trajectories(tmp_path / "session_fish", pixels_per_cm=10)
    assert read.format == "idtracker.ai-csv"
    assert read.fps == pytest.approx(28, rel=1e-3)
    np.testing.assert_allclose(read.positions, positions * [0.1, -0.1])


DAY = ["30/03/2024 23:59:58", "30/03/2024 23:59:59", "31/03/2024 00:00:00"]
MONTH = ["3/30/2024 23:59:58", "3/30/2024 23:59:59", "3/31/2024 0:00:00"]
SAME = ["3/4/2024 9:59:58", "3/4/2024 9:59:59", "3/4/2024 10:00:00"]


@pytest.mark.parametrize("dates", [DAY, MONTH, SAME])
def test_dates_with_strokes_are_read_where_it_is_clear_what_is_the_day(dates, tmp_path):
    rows = pd.DataFrame({"date": dates, "x": [1.0, 2.0, 3.0], "y": [4.0, 5.0, 6.0]})
    read = load_trajectories(write(tmp_path, rows), **SAID)
    assert read.fps == 1
    np.testing.assert_allclose(read.positions[:, 0] * 10, rows[["x", "y"]])


def test_dates_with_strokes_of_which_it_is_not_clear_are_refused(tmp_path):
    rows = pd.DataFrame({"date": ["1/2/2024", "2/2/2024", "3/2/2024"], "x": 1.0, "y": 2.0})
    with pytest.raises(ValueError, match=r"clear what is the day.*; got '1/2/2024' .*year first"):
        load_trajectories(write(tmp_path, rows), **SAID)


def test_corners_of_cvat_are_those_of_a_box(tmp_path):
    rows = {"frame": range(3), "track_id": 1, "xtl": [0.0, 1, 2], "ytl": 0.0}
    rows |= {"xbr": [10.0, 11, 12], "ybr": 6.0}
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=25, **SAID)
    np.testing.assert_allclose(read.positions[:, 0], [[0.5, 0.3], [0.6, 0.3], [0.7, 0.3]])


def test_boxes_of_cvat_outside_of_the_image_are_no_positions(tmp_path):
    rows = {"frame": range(4), "track_id": 1, "xtl": [0.0, 1, 2, 9], "ytl": 0.0}
    rows |= {"xbr": [10.0, 11, 12, 19], "ybr": 6.0, "outside": [0, 0, 1, 0]}
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=25, **SAID)
    assert read.present[:, 0].tolist() == [True, True, False, True]
    assert "1 rows are left out as not visible" in str(read.check())


@pytest.mark.parametrize("name", ["time", "time (s)", "timestamp"])
@pytest.mark.parametrize(
    ("rate", "gap", "count"),
    [(60, 0, 2000), (60, 7, 2000), (75, 0, 2000), (59.94, 3, 2000), (60, 0, 60)],
)
def test_times_with_two_decimals_that_look_like_a_higher_rate_are_asked_for(
    name, rate, gap, count, tmp_path
):
    numbers = np.delete(np.arange(count), slice(20, 20 + gap))
    rows = {name: (numbers / rate).round(2), "x": numbers * 0.1, "y": 0.0}
    path = write(tmp_path, pd.DataFrame(rows))
    with pytest.raises(
        RefusedError,
        match=rf"of {rate:g} per second, or of 100 with gaps .* Give fps={rate:.2f}?, or fps=100.0",
    ):
        load_trajectories(path, **SAID)
    said = load_trajectories(path, fps=rate, **SAID)
    assert said.fps == rate
    assert np.flatnonzero(said.present[:, 0]).tolist() == numbers.tolist()
    assert load_trajectories(path, fps=100, **SAID).fps == 100


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("count", [8, 11, 12, 14])
def test_a_plain_rate_is_named_where_several_are_those_of_a_few_rounded_times(
    count, start, tmp_path
):
    moments = ((np.arange(count) + start) / 60).round(2)
    path = write(tmp_path, pd.DataFrame({"time": moments, "x": np.arange(count), "y": 0.0}))
    with pytest.raises(
        RefusedError, match=r"(of|or) 60 per second, .* fps=60\.0, or fps=100\.0\.$"
    ):
        load_trajectories(path, **SAID)


def test_no_rate_is_named_that_a_few_rounded_times_leave_open(tmp_path):
    moments = (np.arange(40) / 72).round(2)
    path = write(tmp_path, pd.DataFrame({"time": moments, "x": np.arange(40.0), "y": 0.0}))
    with pytest.raises(
        RefusedError, match=r"those of a lower rate, or of 100 .* fps=100\.0 only if"
    ):
        load_trajectories(path, **SAID)


@pytest.mark.parametrize(
    ("fps", "decimals"), [(24, 2), (29.97, 2), (30, 2), (60, 2), (120, 3), (240, 3)]
)
def test_the_right_rate_beside_rounded_times_is_taken(fps, decimals, tmp_path):
    rows = {"time": (np.arange(120) / fps).round(decimals), "x": np.arange(120.0), "y": 0.0}
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=fps, **SAID)
    assert (read.fps, len(read.positions)) == (fps, 120)
    assert read.present.all()


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize(("count", "gap"), [(12, 4), (24, 9)])
def test_a_rate_is_asked_for_where_few_rounded_times_leave_a_gap_open(count, gap, start, tmp_path):
    numbers = np.delete(np.arange(count), slice(4, 4 + gap))
    moments = ((numbers + start) / 30).round(2)
    path = write(tmp_path, pd.DataFrame({"time": moments, "x": numbers * 0.1, "y": 0.0}))
    with pytest.raises(RefusedError, match=r"how many frames a gap has|whole frames apart"):
        load_trajectories(path, **SAID)
    said = load_trajectories(path, fps=30, **SAID)
    assert np.flatnonzero(said.present[:, 0]).tolist() == numbers.tolist()


def test_gaps_between_many_truncated_times_leave_their_rate(tmp_path):
    numbers = np.delete(np.arange(60), slice(20, 23))
    moments = np.floor(numbers / 25 * 100) / 100
    path = write(tmp_path, pd.DataFrame({"time": moments, "x": numbers * 0.1, "y": 0.0}))
    read = load_trajectories(path, **SAID)
    assert read.fps == 25
    assert np.flatnonzero(read.present[:, 0]).tolist() == numbers.tolist()


@pytest.mark.parametrize("fps", [10, 25, 30, 50, 120])
def test_half_the_rate_of_the_times_is_refused_with_theirs(fps, tmp_path):
    rows = {"time": (np.arange(120) / fps).round(3), "x": np.arange(120.0), "y": 0.0}
    path = write(tmp_path, pd.DataFrame(rows))
    with pytest.raises(
        RefusedError, match=r"whole frames apart, at .* They are, at fps=(.*)\.$"
    ) as refusal:
        load_trajectories(path, fps=fps / 2, **SAID)
    proposed = float(str(refusal.value).rpartition("=")[2].rstrip("."))
    assert proposed == pytest.approx(fps, rel=1e-3)


@pytest.mark.parametrize("fps", [24, 29.97, 30, 48, 240])
def test_the_rate_that_is_proposed_for_whole_milliseconds_is_theirs(fps, tmp_path):
    rows = {"time": (1000 * np.arange(400) / fps).round(), "x": np.arange(400.0), "y": 0.0}
    path = write(tmp_path, pd.DataFrame(rows))
    with pytest.raises(RefusedError, match="If they are in ms, give fps=") as refusal:
        load_trajectories(path, **SAID)
    proposed = float(str(refusal.value).partition("give fps=")[2].partition(";")[0])
    assert proposed == pytest.approx(fps, rel=1e-3)
    assert len(load_trajectories(path, fps=fps, **SAID).positions) == 400


MOMENTS = pd.date_range("2024-03-31 23:59:58", periods=100, freq="40ms", tz="UTC")
BY_ROW = pd.DataFrame({"x": np.arange(100.0), "y": 0.0})


@pytest.mark.parametrize(
    "form", ["%Y-%m-%d %H:%M:%S.%f UTC", "%d-%m-%Y %H:%M:%S.%f", "%H:%M:%S.%f"]
)
@pytest.mark.parametrize("animals", [1, 2])
def test_dates_of_more_forms_and_clocks_over_midnight_are_times(form, animals, tmp_path):
    tables = []
    for who in range(animals):
        tables.append(BY_ROW.assign(time=MOMENTS.strftime(form), id=who))
    read = load_trajectories(write(tmp_path, pd.concat(tables)), **SAID)
    assert (read.fps, len(read.individuals)) == (25, animals)
    np.testing.assert_allclose(read.positions[:, -1, 0] * 10, BY_ROW.x)


@pytest.mark.parametrize("last", [40, 100])
def test_clocks_over_midnight_may_begin_with_an_individual_that_comes_later(last, tmp_path):
    clocks = BY_ROW.assign(time=MOMENTS.strftime("%H:%M:%S.%f"))
    tables = [clocks[25:].assign(id="a"), clocks[:last].assign(id="b")]
    read = load_trajectories(write(tmp_path, pd.concat(tables)), **SAID)
    assert read.present.sum(axis=0).tolist() == [75, last]
    np.testing.assert_allclose(read.positions[:last, 1, 0] * 10, BY_ROW.x[:last])
    np.testing.assert_allclose(read.positions[25:, 0, 0] * 10, BY_ROW.x[25:])


def test_dates_beside_frame_numbers_state_the_rate(tmp_path):
    rows = BY_ROW.assign(frame=range(100), timestamp=[moment.isoformat() for moment in MOMENTS])
    assert load_trajectories(write(tmp_path, rows), **SAID).fps == 25
    words = rows.assign(timestamp="soon")
    with pytest.raises(RefusedError, match="no rate is stated by times in the column timestamp"):
        load_trajectories(write(tmp_path, words), **SAID)


def test_times_of_a_hundred_frames_per_second_with_gaps_stay_so(tmp_path):
    numbers = np.flatnonzero(np.random.default_rng(0).random(3000) < 0.6)
    path = write(tmp_path, pd.DataFrame({"time": numbers / 100, "x": numbers * 0.1, "y": 0.0}))
    assert "rounded" not in str(load_trajectories(path, **SAID).check())


@pytest.mark.parametrize("skipped", [None, [1, 2, 3]])
def test_spots_of_trackmate_read_by_pandas_are_those_of_the_file(skipped, tmp_path):
    lines = ["LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME"]
    lines += ["Label,Spot ID,Track ID,X,Y,Z,T,Frame"] * 2
    lines.append(",,,(micron),(micron),(micron),(sec),")
    for frame in range(5):
        lines += [
            f"ID{who},{who},{who},{frame}.5,{who}.5,0.0,{frame / 10},{frame}" for who in (3, 8)
        ]
    lines.append("ID9,9,,7.5,7.5,0.0,0.1,1")
    path = tmp_path / "spots.csv"
    path.write_text("\n".join(lines) + "\n")
    table = pd.read_csv(path, skiprows=skipped)
    given = {}
    if skipped is not None:
        given = {"pixels_per_cm": 1e4, "fps": 10}
    read, of_file = load_trajectories(table, **given), load_trajectories(path)
    np.testing.assert_allclose(read.positions, of_file.positions)
    assert (read.fps, read.individuals) == (10, of_file.individuals) == (10, ("3", "8"))
    assert "1 rows are left out: they are of no track" in str(read.check())


def test_rows_of_mot_with_other_columns_are_refused_with_their_format(tmp_path):
    path = tmp_path / "gt.txt"
    path.write_text("".join(f"{frame},1,{frame}.0,2.0,10,6,1,1,0.87\n" for frame in range(1, 5)))
    with pytest.raises(ValueError, match=r"for boxes of MOT give format='mot'"):
        load_trajectories(path, fps=25, pixels_per_cm=1)
    assert load_trajectories(path, fps=25, pixels_per_cm=1, format="mot").positions[0, 0, 0] == 6


@pytest.mark.parametrize("wide", [True, False])
def test_times_that_state_no_rate_are_named_where_one_is_asked_for(wide, tmp_path):
    rows = pd.DataFrame({"frame": range(6), "Time": [0.0, 0.03, 0.07, 0.01, 0.13, 0.17]})
    for name in ("x_a", "y_a", "x_b", "y_b") if wide else ("x", "y"):
        rows[name] = np.arange(6.0)
    with pytest.raises(
        ValueError, match=r"`fps` must be given; got none, and no rate .* column Time"
    ):
        load_trajectories(write(tmp_path, rows), **SAID)


def test_a_folder_of_other_tables_is_refused_with_what_to_give(tmp_path):
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("frame,x,y\n0,1,1\n1,2,2\n")
    with pytest.raises(
        ValueError, match=r"a folder of TRex, .*; got a folder of 2 tables .* each is a recording"
    ):
        load_trajectories(tmp_path, fps=25, **SAID)


def test_a_zip_of_other_files_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "tables.zip", "w") as archive:
        archive.writestr("a.csv", "frame,x,y\n0,1,1\n")
    with pytest.raises(ValueError, match=r"got a compressed file .*Unpack it\."):
        load_trajectories(tmp_path / "tables.zip", fps=25, **SAID)


def test_boxes_beside_positions_are_not_said_to_be_read(tmp_path):
    # as OCTRON writes them, below lines of facts
    rows = {"frame_idx": [0, 1], "track_id": [1, 1], "pos_x": [32.0, 31.0], "pos_y": [29.0, 30.0]}
    rows |= {
        "bbox_x_min": [26, 25],
        "bbox_x_max": [36, 36],
        "bbox_y_min": [19, 20],
        "bbox_y_max": [35, 37],
    }
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=25, **SAID)
    np.testing.assert_allclose(read.positions[:, 0], [[3.2, 2.9], [3.1, 3.0]])
    assert read.reading.columns["x"] == "pos_x"
    assert "left" not in read.reading.columns
    assert "bbox_x_min" in read.reading.unread


def test_an_array_of_positions_is_a_recording(tmp_path):
    positions = short_walk()
    np.save(tmp_path / "positions.npy", positions)
    for source in (positions, tmp_path / "positions.npy"):
        read = load_trajectories(source, fps=25, **SAID)
        np.testing.assert_array_equal(read.present, ~np.isnan(positions[..., 0]))
        np.testing.assert_allclose(read.positions, np.nan_to_num(positions) / 10)
    with pytest.raises(
        ValueError, match=r"must be numbers of shape \(F, A, 2\), not empty.*got float64 \(12, 6\)"
    ):
        load_trajectories(positions.reshape(12, 6), fps=25, **SAID)


def test_nan_in_a_recording_is_refused_with_what_makes_one_of_it():
    positions = short_walk()
    with pytest.raises(
        ValueError,
        match=r"`positions` must be finite; got nan .*`load_trajectories\(positions, fps=",
    ):
        tl.Trajectories(positions, np.ones(positions.shape[:2], dtype=bool), 25.0, ("a", "b", "c"))


def test_a_workbook_is_refused_with_a_remedy(tmp_path):
    (tmp_path / "book.xlsx").write_bytes(b"PK\x03\x04\x14\x00\x06\x00[Content_Types].xml")
    with pytest.raises(ValueError, match=r"got a workbook \[.*\]\. Save its sheet as CSV"):
        load_trajectories(tmp_path / "book.xlsx", fps=25)


def test_a_track_without_times_is_refused(tmp_path):
    path = gpx(tmp_path, short_walk())
    path.write_text(path.read_text().replace("<time>", "<time2>").replace("</time>", "</time2>"))
    with pytest.raises(
        ValueError, match=r"give a time for each point; got [0-9]+ points without one"
    ):
        load_trajectories(path, project=True)


# ---------------------------------------------------------------- gaps


def test_who_is_away_for_long_is_another_individual_after_that(tmp_path):
    rows = table(walk())
    rows = rows[~((rows.id == 1) & rows.frame.between(100, 199))]
    read = load_trajectories(write(tmp_path, rows), fps=25, **SAID)
    pieces = read.split(3)
    assert pieces.individuals == ("0", "1", "1 (2)", "2", "3", "4")
    assert (pieces.at_once, pieces.present.sum()) == (5, read.present.sum())
    assert read.split(4.1) is read


# ---------------------------------------------------------------- as users have them


def with_units(tmp_path, length, time, interval):
    """Return a table of TrackMate whose fourth line states these units, with spots of no track at its end."""
    lines = trackmate(tmp_path, short_walk()).read_text().splitlines()
    lines[3] = lines[3].replace("(pixel)", f"({length})").replace("(sec)", f"({time})")
    for number, line in enumerate(lines[4:], 4):
        cells = line.split(",")
        cells[7] = str(int(cells[8]) * interval)
        lines[number] = ",".join(cells)
    lines += ["ID900,900,,3.2,7,7,0.0,0,0,4", "ID901,901,None,3.2,9,9,0.0,0,0,4"]
    (tmp_path / "spots.csv").write_text("\n".join(lines) + "\n")
    return tmp_path / "spots.csv"


@pytest.mark.parametrize(
    ("length", "cm", "time", "interval", "fps"),
    [
        ("micron", 1e-4, "sec", 0.5, 2),
        ("\N{MICRO SIGN}m", 1e-4, "ms", 40, 25),
        ("mm", 0.1, "min", 5, 1 / 300),
    ],
)
def test_trackmate_states_units_and_interval(length, cm, time, interval, fps, tmp_path):
    read = load_trajectories(with_units(tmp_path, length, time, interval))
    assert read.fps == pytest.approx(fps, rel=1e-4)
    np.testing.assert_allclose(read.positions, np.nan_to_num(short_walk()) * [cm, -cm])
    assert read.choices == ("2 rows are left out: they are of no track",)


@pytest.mark.parametrize("time", ["sec", "frame"])
def test_what_nobody_has_calibrated_is_asked_for(time, tmp_path):
    path = with_units(tmp_path, "pixel", time, 1)
    with pytest.raises(ValueError, match=r"`fps` must be given; .* Give `pixels_per_cm`, too"):
        load_trajectories(path)
    read = load_trajectories(path, fps=25, pixels_per_cm=10)
    np.testing.assert_allclose(read.positions, np.nan_to_num(short_walk()) * [0.1, -0.1])


def test_tracks_of_trackmate_as_xml_state_units_and_interval(tmp_path):
    path = trackmate_xml(tmp_path, short_walk())
    text = path.read_text().replace('"pixel"', '"micron"')
    path.write_text(text.replace('frameInterval="1.0"', 'frameInterval="0.04"'))
    read = load_trajectories(path)
    assert read.fps == 25
    np.testing.assert_allclose(read.positions, np.nan_to_num(short_walk()) * [1e-4, -1e-4])


def test_the_session_of_trackmate_is_refused_with_what_to_export(tmp_path):
    path = tmp_path / "session.xml"
    path.write_text('<?xml version="1.0"?>\n<TrackMate version="7.9.2">\n<Model/></TrackMate>\n')
    with pytest.raises(ValueError, match=r"got the session of TrackMate .* its tracks as XML"):
        load_trajectories(path, fps=25)


@pytest.mark.parametrize(
    "name", ["frame_idx", "frame_number", "Frame ID", "FrameNo", "video_frame"]
)
def test_frame_numbers_have_many_names(name, tmp_path):
    path = write(tmp_path, table(walk()).rename(columns={"frame": name}))
    read = load_trajectories(path, fps=25, **SAID)
    np.testing.assert_allclose(read.positions, walk() / 10)
    assert read.reading.columns["frame"] == name


def test_columns_that_stand_below_each_other_are_read(tmp_path):
    path = tmp_path / "table.txt"
    path.write_text(table(walk()).to_string(index=False) + "\n")
    np.testing.assert_allclose(load_trajectories(path, fps=25, **SAID).positions, walk() / 10)


def test_row_names_of_r_are_no_column(tmp_path):
    rows = table(walk())
    lines = ['"frame" "id" "x" "y"']
    for number, (frame, who, x, y) in enumerate(rows.itertuples(index=False), 1):
        lines.append(f'"{number}" {frame} {who} {x} {y}')
    (tmp_path / "table.txt").write_text("\n".join(lines) + "\n")
    read = load_trajectories(tmp_path / "table.txt", fps=25, **SAID)
    np.testing.assert_allclose(read.positions, walk() / 10)


def test_deeplabcut_saved_by_a_program_for_spreadsheets_is_read(tmp_path):
    path = deeplabcut(tmp_path, short_walk())
    plain = load_trajectories(path, fps=25, pixels_per_cm=10, keypoint="head")
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))
    read = load_trajectories(path, fps=25, pixels_per_cm=10, keypoint="head")
    np.testing.assert_array_equal(read.positions, plain.positions)


def test_several_robots_in_a_row_are_not_one(tmp_path):
    rows = pd.DataFrame({"__time": np.arange(60) / 10})
    for robot in ("r1", "r2"):
        for axis in "xy":
            rows[f"/{robot}/odom/pose/pose/position/{axis}"] = walk()[:60, int(robot[1]), 0]
    path = write(tmp_path, rows)
    with pytest.raises(ValueError, match=r"one position in a row; got /r1/.*, /r2/.* example col"):
        load_trajectories(path)
    said = {axis: f"/r2/odom/pose/pose/position/{axis}" for axis in "xy"}
    read = load_trajectories(path, columns=said)
    np.testing.assert_allclose(read.positions[:, 0, 0], 100 * walk()[:60, 2, 0])


def test_poses_in_a_plane_have_a_heading(tmp_path):
    rows = pd.DataFrame({"%time": 1_700_000_000_000_000_000 + 40_000_000 * np.arange(60)})
    rows = rows.assign(**{"field.x": 1.0, "field.y": 2.0, "field.theta": 0.5})
    read = load_trajectories(write(tmp_path, rows))
    assert (read.fps, read.format, read.headings[0, 0]) == (25, "ros-csv", 0.5)
    np.testing.assert_allclose(read.positions[0, 0], [100, 200])


def test_orientations_that_are_none_are_left_out(tmp_path):
    path = ros_csv(tmp_path, short_walk())
    rows = pd.read_csv(path)
    rows["field.pose.pose.orientation.w"] = 0.0
    read = load_trajectories(write(tmp_path, rows))
    assert read.headings is None
    assert "headings are left out" in read.choices[0]


def test_animals_that_were_not_tracked_are_one_or_refused(tmp_path):
    path = sleap_csv(tmp_path, short_walk())
    lines = path.read_text().splitlines()
    alone = [line for line in lines if "track_1" not in line and "track_2" not in line]
    said = {"fps": 25, "pixels_per_cm": 10, "keypoint": "head"}
    path.write_text("\n".join(alone).replace("track_0", "") + "\n")
    assert load_trajectories(path, **said).individuals == ("1",)
    path.write_text("\n".join(re.sub("track_[0-9]", "", line) for line in lines) + "\n")
    with pytest.raises(ValueError, match=r"one position for each individual .*not read: track"):
        load_trajectories(path, **said)


def test_of_points_of_a_body_in_rows_of_their_own_one_is_asked_for(tmp_path):
    rows = table(walk()).assign(bodypart="nose")
    both = pd.concat([rows, rows.assign(bodypart="tail", x=rows.x + 3)])
    file = write(tmp_path, both)
    with pytest.raises(ValueError, match=r"`keypoint` must be one of nose, tail; got None"):
        load_trajectories(file, fps=25, **SAID)
    nose, tail = (load_trajectories(file, fps=25, keypoint=k, **SAID) for k in ("nose", "tail"))
    shift = tail.positions - nose.positions
    np.testing.assert_allclose(shift[..., 0], 0.3)
    np.testing.assert_allclose(shift[..., 1], 0.0)
    with pytest.raises(ValueError, match=r"without a column of key points; got 'nose'"):
        load_trajectories(write(tmp_path, rows.drop(columns="bodypart")), keypoint="nose", **SAID)


def test_fixes_of_every_ten_minutes_or_so_are_refused_with_what_makes_them_even(tmp_path):
    path = movebank(tmp_path, short_walk())
    rows = pd.read_csv(path)
    numbers = np.arange(len(rows))
    seconds = 600 * numbers + 371 * (numbers % 2)
    seconds[-1] = seconds[-2] + 1
    late = pd.to_timedelta(seconds, unit="s")
    rows["timestamp"] = (pd.Timestamp("2024-05-01") + late).strftime("%Y-%m-%d %H:%M:%S")
    rows.to_csv(path, index=False)
    with pytest.raises(ValueError, match=r"one frame in 100 .*uneven, .* by resample="):
        load_trajectories(path, project=True)
    assert load_trajectories(path, project=True, resample=1 / 600).present.any()


@pytest.mark.parametrize("frame", ["frame", "frame_number"])
def test_two_individuals_side_by_side_are_no_box(frame, tmp_path):
    path = tmp_path / "wide.csv"
    rows = [f"{k},{k},{2 * k},{3 * k + 1},{k + 5}" for k in range(6)]
    path.write_text("\n".join([f"{frame},x1,y1,x2,y2", *rows]) + "\n")
    recording = tl.load_trajectories(path, fps=10, pixels_per_cm=1, y_axis="up")
    assert recording.positions[2].tolist() == [[2.0, 4.0], [7.0, 7.0]]


def test_imaris_positions_below_titles_are_read_in_their_unit(tmp_path):
    rows = [
        f"{1000 * who + 2.5 * frame},{50 + frame},0,um,Spot,Position,{frame + 1},10000000{who},{2 * frame + who},"
        for frame in range(12)
        for who in range(2)
    ]
    columns = "Position X,Position Y,Position Z,Unit,Category,Collection,Time,TrackID,ID,"
    path = tmp_path / "imaris.csv"
    path.write_text("\n".join(["", "Position", "=" * 20, " ", columns, *rows, ""]))
    said = {"fps": 25, "y_axis": "up"}
    with pytest.raises(ValueError, match=r"If they count frames, give columns=\{'frame': 'time'\}"):
        load_trajectories(path, **said)
    read = load_trajectories(path, columns={"frame": "Time"}, **said)
    assert (read.unit, read.first_frame) == ("cm", 1)
    np.testing.assert_allclose(read.positions[:, 1, 0], 0.1 + 2.5e-4 * np.arange(12))
    np.testing.assert_allclose(read.positions[:, 0, 1], 5e-3 + 1e-4 * np.arange(12))


def test_centroids_of_bonsai_are_read(tmp_path):
    rows = [f"{10 + frame} 20.5 0.1 2026-01-01T10:00:{frame / 25:010.7f}Z" for frame in range(12)]
    path = tmp_path / "bonsai.csv"
    columns = "Value.Centroid.X Value.Centroid.Y Value.Orientation Timestamp"
    path.write_text("\n".join([columns, *rows, ""]))
    read = load_trajectories(path, pixels_per_cm=1, y_axis="up")
    assert read.fps == 25
    np.testing.assert_allclose(read.positions[:, 0, 0], 10 + np.arange(12))


def test_flies_of_ctrax_are_read_by_frame(tmp_path):
    arrays = {
        "x_pos": np.arange(5.0),
        "y_pos": 2 * np.arange(5.0),
        "identity": [0, 1, 1, 0, 1],
        "ntargets": [2, 1, 0, 2],
        "timestamps": np.arange(4) / 20,
    }
    savemat(tmp_path / "flies.mat", arrays)
    read = load_trajectories(tmp_path / "flies.mat", pixels_per_cm=1, y_axis="up")
    assert read.fps == 20
    np.testing.assert_array_equal(read.present, [[1, 1], [0, 1], [0, 0], [1, 1]])
    np.testing.assert_array_equal(read.positions[3], [[3, 6], [4, 8]])


def flies_of_jaaba(lengths, **changes):
    """Return `trx` as JAABA writes it, flies of so many frames, the second of which comes in frame 3."""
    fields = ["x", "y", "theta", "x_mm", "y_mm", "firstframe", "fps"]
    trx = np.zeros((1, len(lengths)), dtype=[(name, object) for name in fields])
    for k, length in enumerate(lengths):
        along = np.arange(float(length))
        fly = {
            "x": along,
            "y": 2 * along,
            "theta": along / 10,
            "x_mm": along / 5,
            "y_mm": along + k,
        }
        fly |= {"firstframe": 1 + 2 * k, "fps": 30} | changes
        for name in fields:
            trx[0, k][name] = np.atleast_2d(fly[name])
    return {"trx": trx}


def test_flies_of_jaaba_are_read_in_cm(tmp_path):
    savemat(tmp_path / "registered_trx.mat", flies_of_jaaba((6, 4)))
    read = load_trajectories(tmp_path / "registered_trx.mat", y_axis="up")
    assert (read.fps, read.unit, read.first_frame) == (30, "cm", 1)
    np.testing.assert_allclose(read.positions[:, 0, 0], np.arange(6) / 50)
    np.testing.assert_array_equal(read.present[:, 1], [0, 0, 1, 1, 1, 1])
    np.testing.assert_allclose(read.positions[2:, 1, 1], (np.arange(4) + 1) / 10)
    np.testing.assert_allclose(read.headings[:, 0], np.arange(6) / 10)


def test_flies_of_jaaba_with_fields_that_do_not_fit_are_refused(tmp_path):
    path = tmp_path / "registered_trx.mat"
    savemat(path, flies_of_jaaba((6, 4), theta=np.zeros(3)))
    with pytest.raises(ValueError, match=r"as many x_mm, y_mm and theta.*trx\(1\)"):
        load_trajectories(path, y_axis="up")
    savemat(path, {"trx": np.array([[(1.0,)]], dtype=[("x", object)])})
    with pytest.raises(ValueError, match="have `trx` with x, y, firstframe"):
        load_trajectories(path, y_axis="up")


VIA = "#filename,file_size,file_attributes,region_count,region_id,region_shape_attributes,region_attributes"


def test_points_of_via_are_read_and_outlines_refused(tmp_path):
    path = tmp_path / "via.csv"
    point = '"{{""name"":""point"",""cx"":{},""cy"":20}}"'
    rows = [f'v_{k:03d}.jpg,12,"{{}}",1,0,{point.format(10 + k)},"{{}}"' for k in range(5)]
    path.write_text("\n".join([VIA, 'v_000.jpg,12,"{}",0,0,"{}","{}"', *rows, ""]))
    read = load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")
    np.testing.assert_array_equal(read.positions[:, 0], [[10 + k, 20] for k in range(5)])
    path.write_text(path.read_text().replace("v_003", "w_003"))
    with pytest.raises(ValueError, match="hold one recording; got images of 2 videos, such as v_"):
        load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")
    path.write_text(path.read_text().replace("w_003", "v_003"))
    path.write_text(path.read_text().replace("point", "polygon").replace("cx", "all_points_x"))
    with pytest.raises(ValueError, match=r"have rectangles, points.*via.csv:3\]"):
        load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")


def test_a_folder_of_toxtrac_is_read_by_the_tracks_of_its_only_arena(tmp_path):
    positions = short_walk()
    toxtrac(tmp_path, positions)
    pixels = load_trajectories(tmp_path, fps=25, pixels_per_cm=10)
    toxtrac_csv(tmp_path, positions)
    (tmp_path / "Stats_1.txt").write_text("Video FrameRate:\n25\n")
    read = load_trajectories(tmp_path)
    assert (pixels.format, read.format) == ("toxtrac", "toxtrac-csv")
    np.testing.assert_allclose(read.positions, pixels.positions)
    (tmp_path / "Tracking_RealSpace_2.txt").write_text("of another arena")
    message = "tracks of one arena; got Tracking_RealSpace_1.txt, Tracking_RealSpace_2.txt"
    with pytest.raises(ValueError, match=message):
        load_trajectories(tmp_path)


def test_json_has_a_bound_of_its_own_by_the_memory_that_it_takes(tmp_path):
    path = coco(tmp_path, short_walk(frames=300))
    tracemalloc.start()
    load_trajectories(path, fps=25, pixels_per_cm=10)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 16 * path.stat().st_size
    with path.open("r+b") as file:
        # a hole, which takes no room
        file.truncate((1 << 28) + 1)
    with pytest.raises(ValueError, match="have at most 268435456 bytes; got 268435457"):
        load_trajectories(path, fps=25, pixels_per_cm=10)


def test_individuals_of_coco_without_tracks_and_other_json_are_refused(tmp_path):
    path = tmp_path / "boxes.json"
    boxes = [{"id": k, "image_id": k // 2, "bbox": [k, 0, 4, 2]} for k in range(4)]
    images = [{"id": k, "file_name": f"frame_{k:04d}.png"} for k in range(2)]
    said = {"fps": 25, "pixels_per_cm": 1, "y_axis": "up"}
    path.write_text(json.dumps({"images": images, "annotations": boxes}))
    with pytest.raises(ValueError, match="annotations have to name their tracks"):
        load_trajectories(path, **said)
    for box in boxes:
        box["track_id"] = box["id"] % 2
    path.write_text(json.dumps({"images": images, "annotations": boxes}))
    read = load_trajectories(path, **said)
    np.testing.assert_array_equal(read.positions[:, :, 0], [[2, 3], [4, 5]])
    path.write_text('[{"image_id": "0.jpg", "keypoints": [1, 2, 3]}]')
    with pytest.raises(ValueError, match="hold images and annotations, as COCO does; got a list"):
        load_trajectories(path, **said)


def test_rows_of_decimal_commas_alone_are_no_header_lines(tmp_path):
    rows = [f"0,{4 * frame:02d};{frame},5;{frame},25" for frame in range(20)]
    path = tmp_path / "german.csv"
    path.write_text("\n".join(["time;x;y", *rows]) + "\n")
    read = load_trajectories(path, **SAID)
    assert (read.fps, len(read.positions)) == (25, 20)
    np.testing.assert_allclose(read.positions[0, 0] * 10, [0.5, 0.25])


def test_an_index_without_a_name_is_left_out_of_wide_tables(tmp_path):
    positions = walk(frames=30)[:, :3]
    rows = {"": range(30), "frame": range(30)}
    rows |= {
        f"{axis}_{who}": positions[:, who, k] for k, axis in enumerate("xy") for who in range(3)
    }
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=25, **SAID)
    np.testing.assert_allclose(read.positions * 10, positions)


def test_positions_that_are_called_as_by_trackmate_have_individuals(tmp_path):
    rows = {"frame": np.repeat(range(9), 2), "id": [1, 2] * 9, "position_x": np.arange(18.0)}
    path = write(tmp_path, pd.DataFrame(rows | {"position_y": 0.0}))
    read = load_trajectories(path, fps=25, **SAID)
    assert (read.format, read.individuals) == ("tidy", ("1", "2"))


@pytest.mark.parametrize("name", ["theta", "yaw", "angle", "heading_rad", "orientation (rad)"])
def test_headings_that_are_left_out_are_said(name, tmp_path):
    rows = {"frame": range(9), "x": np.arange(9.0), "y": 0.0, name: 0.1}
    path = write(tmp_path, pd.DataFrame(rows))
    read = load_trajectories(path, fps=25, **SAID)
    assert f"{name} is not read: if it is the heading in rad" in str(read.check())
    said = load_trajectories(path, fps=25, columns={"heading": name}, **SAID)
    assert said.headings is not None
    assert "is not read" not in str(said.check())


@pytest.mark.parametrize("name", ["Angle (deg)", "angle_deg", "theta_deg", "yaw [degrees]"])
def test_headings_in_degrees_are_said_with_how_to_convert_them(name, tmp_path):
    rows = {"frame": range(9), "x": np.arange(9.0), "y": 0.0, name: 5.0}
    read = load_trajectories(write(tmp_path, pd.DataFrame(rows)), fps=25, **SAID)
    assert read.headings is None
    said = f"{name} is not read: headings have to be in rad. If it is the heading, multiply it by pi / 180"
    assert said in str(read.check())


@pytest.mark.parametrize("lowest", [0.0, -5.0])
def test_positions_of_minus_one_are_missing_where_all_others_are_in_the_image(lowest, tmp_path):
    rows = pd.DataFrame({"frame": range(40), "x": np.arange(40.0) + lowest, "y": 3.0})
    rows.loc[[7, 20, 21], ["x", "y"]] = -1
    read = load_trajectories(write(tmp_path, rows), fps=25, **SAID)
    missing = [7, 20, 21] if lowest == 0 else []
    assert np.flatnonzero(~read.present).tolist() == missing
    assert ("3 positions at exactly (-1, -1)" in str(read.check())) == bool(missing)


@pytest.mark.parametrize("gone", [False, True])
def test_a_path_through_minus_one_stays_and_a_single_one_from_afar_is_missing(gone, tmp_path):
    x = np.abs(np.arange(41.0) - 20) - 1
    rows = pd.DataFrame({"frame": range(41), "x": x, "y": x})
    if gone:
        rows.loc[20, ["x", "y"]] = 0
        rows.loc[3, ["x", "y"]] = -1
    read = load_trajectories(write(tmp_path, rows), fps=25, **SAID)
    assert np.flatnonzero(~read.present).tolist() == [3] * gone
    assert ("0 or more: 1 position at exactly (-1, -1)" in str(read.check())) == gone


def test_an_individual_that_is_always_at_minus_one_is_left_out(tmp_path):
    tables = [pd.DataFrame({"frame": range(20), "id": "fish", "x": np.arange(20.0), "y": 3.0})]
    tables.append(tables[0].assign(id="nobody", x=-1.0, y=-1.0))
    rows = pd.concat(tables).assign(heading=0.1, confidence=1.0)
    read = load_trajectories(write(tmp_path, rows), fps=25, **SAID)
    assert (read.individuals, read.positions.shape) == (("fish",), (20, 1, 2))
    assert read.headings.shape == read.confidence.shape == (20, 1)
    assert "left out, as they have no other positions: nobody" in str(read.check())


def test_many_short_gaps_are_said_with_what_fills_them(tmp_path):
    positions = walk(frames=900)[:, :1]
    rows = pd.DataFrame({"frame": range(900), "x": positions[:, 0, 0], "y": positions[:, 0, 1]})
    path = write(
        tmp_path, rows.drop(index=[frame for k in range(40, 880, 50) for frame in range(k, k + 3)])
    )
    look = load_trajectories(path, fps=25, **SAID).look()
    assert "0% of the positions in stretches of 4 s" in look.doubts[-1]
    assert "filled, by `bridged(3)` or --bridge 3, it is 100%" in look.doubts[-1]
    whole = load_trajectories(write(tmp_path, rows, "whole.csv"), fps=25, **SAID)
    assert whole.look().doubts == ()
