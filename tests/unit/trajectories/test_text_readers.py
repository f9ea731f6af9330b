import numpy as np
import pytest
from tracker_files import SAID, WRITERS, expected, walk, write_attributes

from turing_learning.trajectories import load_trajectories
from turing_learning.trajectories.readers import _sheets

TIDY = "frame,id,x,y\n"
TWO_FISH = "X1\tY1\tProbId1\tX2\tY2\tProbId2\t\n"
DLC = "scorer,net,net,net\nbodyparts,nose,nose,nose\ncoords,x,y,likelihood\n"


def load(tmp_path, content, **said):
    path = tmp_path / "file.txt"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return load_trajectories(path, **{"fps": 25, "pixels_per_cm": 1, "y_axis": "up"} | said)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            TIDY + "0,a,1,2\n1,a,1\n",
            r"have 4 cells in each row; got 3 \[.*file.txt:3\]. The file may be cut off",
        ),
        (TIDY + "0,a,1,2\n1,a,1,2,3\n", r"have 4 cells in each row; got 5 \[.*file.txt:3\]"),
        (TIDY + "0,a,1,2", r"have at least one row; got none"),
        (TIDY + "0,a,1,two\n", r"have finite numbers or NaN; got 'two' \[.*file.txt:2\]"),
        (TIDY + "0,a,1,inf\n", r"have finite numbers or NaN; got 'inf' \[.*file.txt:2\]"),
        (TIDY + "0,a,1,1_0\n", r"have finite numbers or NaN; got '1_0' \[.*file.txt:2\]"),
        (TIDY + "0,a,1,\n", r"have both x and y or neither; got \[1.0, nan\] \[.*file.txt:2\]"),
        (
            TIDY + "0,a,1,2e9\n",
            r"have coordinates within \+-1e\+09; got \[1.0, 2000000000.0\] \[.*file.txt:2\]",
        ),
        (
            TIDY + "0.5,a,1,2\n",
            r"have frame numbers that are whole, from 0 to 1e\+09; got 0.5 \[.*file.txt:2\]",
        ),
        (
            TIDY + "-1,a,1,2\n",
            r"have frame numbers that are whole, from 0 to 1e\+09; got -1.0 \[.*file.txt:2\]",
        ),
        (TIDY + "0,,1,2\n", r"name the individual in each row; got  \[.*file.txt:2\]"),
        (TIDY + "0,a,,\n", r"hold at least one position; got none \[.*file.txt:2\]"),
        (TIDY, r"have at least one row; got none \[.*file.txt\]"),
        (
            TIDY + "0,a,1,2\n\n1,a,1,2\n",
            r"have no blank line inside; got an empty line \[.*file.txt:3\]",
        ),
        (TIDY + '0,"a,1,2\n', r"have complete quotes; got unexpected end of data \[.*file.txt:2\]"),
        (
            TIDY + "0,a,1,2\n1,a,1,2\n0,a,1,3\n",
            r"give one position .*; got another one for frame 0 than .*file.txt:2 \[.*file.txt:4\]",
        ),
        (
            TIDY + "0,a,1,2\n999999999,a,1,2\n",
            r"name at least one frame in 100 .*; got frames 0 to 999999999 \[.*file.txt:3\]",
        ),
        ("frame,x,x,y\n0,1,2,1\n", r"name each column once; got 'x' twice \[.*file.txt:1\]"),
        (
            "time,id,x,y\n0,a,1,1\n0.1,a,1,1\n0.35,a,1,1\n",
            r"have times \(s\) that are whole frames apart, at .*; got 0.\d+ \[.*\]\. If the rate is another, "
            r"correct `fps`. If they are uneven, make them even by resample=5.7143; or number the frames",
        ),
        (
            "frame,bird,x,y\n0,a,1,1\n0,b,3,3\n",
            r"give one position .*:3\]. If a column that is not read names the individuals, say so: .*'bird'}\.$",
        ),
        (
            "frame,x,y,heading\n0,1,1,\n",
            r"give `heading` wherever it gives x and y; got none \[.*file.txt:2\]",
        ),
        (
            TWO_FISH[:-2] + "3\t\n1\t2\tNaN\t1\t2\tNaN\n",
            r"have the columns X1, Y1, ProbId1, .*; got 6 columns, 'ProbId23' \[",
        ),
        (
            TWO_FISH + "NaN\tNaN\tNaN\tNaN\tNaN\tNaN\n",
            r"hold at least one position; got none \[.*file.txt:2\]",
        ),
        (
            TWO_FISH + "1\tNaN\tNaN\t1\t2\tNaN\n",
            r"have both x and y or neither; got \[1.0, nan\] \[.*file.txt:2\]",
        ),
        (
            "0\t0\t1\t5\t5\t1\n0\t0\t1.5\t5\t5\t1\n",
            r"have whole numbers for arena, track and label .*; got .* \[.*file.txt:2\]",
        ),
        (DLC, r"have 4 header lines; got 3 \["),
        (
            DLC.replace("net\nb", "net,net\nb") + "0,1,2,1\n",
            r"have header lines of the same length; got \[5, 4, 4\] \[",
        ),
        (
            DLC.replace("likelihood", "y") + "0,1,2,1\n",
            r"have x, y and likelihood once for each body part; got 2 columns \(",
        ),
        (DLC + "image,1,2,1\n", r"have finite numbers or NaN; got 'image' \[.*file.txt:4\]"),
        (
            "time,x1,y1\n0,1,2\n0,1,2\n",
            r"have times that grow from row to row; got 0.0 \[.*file.txt:3\]",
        ),
        (
            "time,x1,y1\n0,1,2\n1,1,2\n2,1,2\n5,1,2\n",
            r"have evenly spaced times, with steps of 1 s; got 3.0 \[.*file.txt:5\]",
        ),
        (
            "time,x1,y1\n-1e308,1,2\n1,1,2\n",
            r"have times within \+-1e\+09 s; got -1e\+308 \[.*file.txt:2\]",
        ),
        (
            "time,x1,y1\n,1,2\n1,1,2\n",
            r"have times that are numbers, dates \(ISO 8601\) or h:min:s; got '' \[.*file.txt:2\]",
        ),
        (
            "time,x1,y1,z\n0,1,2,3\n",
            r"have the columns x1, y1, x2, y2, ... after the time; got 4 columns, 'z' \[.*file.txt:1\]",
        ),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_its_line(content, message, tmp_path):
    with pytest.raises(ValueError, match="`path` must " + message):
        load(tmp_path, content)


@pytest.mark.parametrize("step_s", [1 / 29.97, 0.04, 30.0, 600.0, 3600.0])
def test_times_state_the_frame_rate_of_slow_recordings_too(step_s, tmp_path):
    rows = "".join(f"{k * step_s:.6f},{k},2\n" for k in range(200))
    assert load(tmp_path, "seconds,x1,y1\n" + rows, fps=None).fps == pytest.approx(
        1 / step_s, rel=1e-4
    )
    assert load(tmp_path, "time,x1,y1\n" + rows, fps=1 / step_s).fps == pytest.approx(
        1 / step_s, rel=1e-4
    )


def test_a_zero_byte_in_the_data_is_refused_with_its_line(tmp_path):
    content = (TIDY + "".join(f"{k},a,1,2\n" for k in range(9))).encode() + b"9,a,\0,2\n"
    with pytest.raises(
        ValueError, match=r"`path` must be a text file; got a zero byte \[.*file.txt:11\]"
    ):
        load(tmp_path, content)


def test_a_byte_that_is_no_text_is_refused_with_its_line(tmp_path):
    content = (TIDY + "".join(f"{k},a,1,2\n" for k in range(9))).encode() + b"9,\xff,1,2\n"
    with pytest.raises(
        ValueError, match=r"`path` must be text in UTF-8; got byte 0xff \[.*file.txt:11\]"
    ):
        load(tmp_path, content)


def test_a_line_without_end_is_refused_before_it_fills_the_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(_sheets, "LONGEST_LINE", 100)
    with pytest.raises(
        ValueError, match=r"have lines of at most 100 characters; got a longer one \[.*file.txt:2\]"
    ):
        load(tmp_path, TIDY + "0" * 101)


def test_an_error_in_many_rows_has_the_right_line(tmp_path):
    rows = [f"{k},a,{k},2\n" for k in range(10)]
    np.testing.assert_array_equal(
        load(tmp_path, TIDY + "".join(rows)).positions[:, 0, 0], range(10)
    )
    rows[7] = "7,a,x,2\n"
    with pytest.raises(ValueError, match=r"got 'x' \[.*file.txt:9\]"):
        load(tmp_path, TIDY + "".join(rows))


def test_too_many_cells_are_refused_before_they_fill_the_memory(tmp_path, monkeypatch):
    from turing_learning.trajectories import _recording

    monkeypatch.setattr(_recording, "MOST_CELLS", 3)
    with pytest.raises(
        ValueError,
        match=r"hold at most 3 frames times individuals; got 2 x 2 \[.*\]. Split the recording.",
    ):
        load(tmp_path, TIDY + "0,a,1,2\n1,b,1,2\n")


@pytest.mark.parametrize("name", ["toxtrac", "tracktor", "trackmate", "tidy", "deeplabcut"])
def test_the_order_of_numbered_rows_does_not_matter(name, tmp_path):
    positions = walk()
    path = WRITERS[name](tmp_path, positions)
    lines = path.read_bytes().splitlines(keepends=True)
    skip = {"toxtrac": 0, "deeplabcut": 4, "trackmate": 4}.get(name, 1)
    path.write_bytes(b"".join(lines[:skip] + lines[: skip - 1 if skip else None : -1]))
    np.testing.assert_allclose(
        load_trajectories(path, **SAID[name]).positions, expected(name, positions)
    )


def test_repeated_rows_are_dropped_and_told(tmp_path):
    read = load(tmp_path, TIDY + "0,a,1,2\n1,a,3,4\n0,a,1,2\n")
    assert read.remarks == ("1 rows said the same as another and were dropped",)
    np.testing.assert_array_equal(read.positions[:, 0], [[1, 2], [3, 4]])


@pytest.mark.parametrize(
    "names",
    [
        "Frame,ID,X,Y",
        "TIME,individual,x,Y",
        "time_s,fish,X,y",
        "frame,track_id,x,y",
        '"Seconds","Animal","x","y"',
    ],
)
def test_a_plain_table_may_name_its_columns_in_any_case_and_count_times(names, tmp_path):
    scale = 1 if "frame" in names.lower() else 25
    rows = "".join(f"{k / scale},{who},{k},{2 * k}\n" for k in (3, 4, 7) for who in "ab")
    read = load(tmp_path, f"{names}\n{rows}", fps=25)
    assert (read.individuals, read.first_frame, read.fps) == (("a", "b"), 3, 25)
    np.testing.assert_array_equal(read.present[:, 0], [True, True, False, False, True])
    np.testing.assert_array_equal(read.positions[4, 1], [7, 14])
    if scale == 25:
        assert load(tmp_path, f"{names}\n{rows}", fps=None).fps == 25


def test_columns_that_may_name_individuals_are_told(tmp_path):
    one_after_another = "".join(f"{k},{'abc'[k // 2]},{k},2,7\n" for k in range(6))
    read = load(tmp_path, "frame,bird,x,y,light\n" + one_after_another)
    assert read.remarks == (
        "without a column id all rows are of one individual; columns not read: bird, light",
    )
    assert read.remarks[0] in str(read.problems)
    assert load(tmp_path, "frame,id,x,y,light\n" + one_after_another).remarks == ()


def test_frames_that_are_not_in_the_file_are_missing(tmp_path):
    read = load(tmp_path, TIDY + "7,a,1,2\n10,a,3,4\n")
    assert (read.first_frame, read.present[:, 0].tolist()) == (7, [True, False, False, True])
    assert read.problems.empty_frames == (8, 9)


def test_individuals_are_in_natural_order(tmp_path):
    read = load(
        tmp_path,
        TIDY + "".join(f"0,{name},1,2\n" for name in ("fish10", "fish9", "07", "7", "ant")),
    )
    assert read.individuals == ("07", "7", "ant", "fish9", "fish10")


def test_quotes_tabs_and_a_byte_order_mark_are_read(tmp_path):
    read = load(tmp_path, '\ufeff"frame"\t"id"\t"x"\t"y"\n0\t"a\tb"\t1\t2\n')
    assert read.individuals == ("a\tb",)


@pytest.mark.parametrize("end", [",", ";", "\t"])
def test_a_separator_at_the_end_of_lines_opens_no_cell(end, tmp_path):
    content = "frame,id,x,y,\n0,a,1,2,\n1,a,3,4,\n".replace(",", end)
    np.testing.assert_array_equal(load(tmp_path, content).positions[:, 0], [[1, 2], [3, 4]])


def test_blank_lines_at_the_end_are_no_rows(tmp_path):
    assert len(load(tmp_path, TIDY + "0,a,1,2\n\n \n").positions) == 1


def test_columns_of_idtracker_are_told_by_their_names(tmp_path):
    content = "X1\tY1\tProbId1\tProbId2\tY2\tX2\n1\t2\t0.5\t0.6\t4\t3\n"
    read = load(tmp_path, content)
    np.testing.assert_array_equal(read.positions[0], [[1, 2], [3, 4]])
    np.testing.assert_array_equal(read.confidence[0], [0.5, 0.6])


def test_positions_that_idtracker_estimated_are_told(tmp_path):
    read = load(tmp_path, "X1\tY1\tProbId1\n1\t2\t-1\n1\t3\t0.9\n")
    assert read.remarks == ("1 positions were estimated by idTracker (negative ProbId)",)
    assert read.confidence is None


def test_tracks_of_several_arenas_are_different_individuals(tmp_path):
    read = load(tmp_path, "0\t0\t1\t5\t5\t1\n0\t1\t1\t6\t6\t0\n")
    assert read.individuals == ("0:1", "1:1")
    assert read.remarks == ("1 rows have the label 0",)


def test_tracktor_of_a_single_animal_has_no_id(tmp_path):
    assert load(tmp_path, ",frame,pos_x,pos_y\n0,1,2,3\n").individuals == ("1",)


def test_tracktor_needs_its_columns_when_it_is_named(tmp_path):
    with pytest.raises(
        ValueError,
        match=r"have the columns frame, pos_x, pos_y; got \['frame', 'id', 'x', 'y'\] \[",
    ):
        load(tmp_path, TIDY + "0,a,1,2\n", format="tracktor")


def test_deeplabcut_of_a_single_animal_is_read(tmp_path):
    read = load(tmp_path, DLC + "0,1,2,0.9\n1,3,4,0.1\n", min_confidence=0.5)
    np.testing.assert_array_equal(read.present[:, 0], [True, False])


def test_the_key_point_of_deeplabcut_is_never_guessed(tmp_path):
    path = WRITERS["deeplabcut"](tmp_path, walk())
    with pytest.raises(
        ValueError,
        match=r"`keypoint` must be one of thorax, head; got None \[.*Say which point of the body",
    ):
        load_trajectories(path, **SAID["deeplabcut"] | {"keypoint": None})
    head = load_trajectories(path, **SAID["deeplabcut"] | {"keypoint": "head"})
    np.testing.assert_allclose(
        head.positions[head.present], expected("deeplabcut", walk() + 1)[head.present]
    )


def test_individuals_without_the_key_point_are_left_out_and_told(tmp_path):
    header = "scorer,n,n,n,n,n,n\nindividuals,m,m,m,single,single,single\nbodyparts,nose,nose,nose,lamp,lamp,lamp\n"
    read = load(
        tmp_path, header + "coords,x,y,likelihood,x,y,likelihood\n0,1,2,1,3,4,1\n", keypoint="nose"
    )
    assert read.individuals == ("m",)
    assert read.remarks == ("1 of the individuals have no key point 'nose'",)


def test_deeplabcut_needs_its_header_when_it_is_named(tmp_path):
    with pytest.raises(
        ValueError, match=r"begin with the header lines scorer, .*; got frame \[.*:1\]"
    ):
        load(tmp_path, TIDY + "0,a,1,2\n" * 4, format="deeplabcut")


def test_attributes_beside_an_idtracker_ai_csv_state_the_frame_rate(tmp_path):
    write_attributes(tmp_path)
    assert load(tmp_path, "x1,y1\n1,2\n3,4\n", fps=None).fps == 25


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", r"have a whole attributes.json beside it; got .* \[.*attributes.json\]"),
        ('{"frames_per_second": -1}', r"state a frame rate above 0; got -1 \[.*attributes.json\]"),
        (
            '{"frames_per_second": "25"}',
            r"state a frame rate above 0; got '25' \[.*attributes.json\]",
        ),
    ],
)
def test_attributes_that_are_wrong_are_refused(text, message, tmp_path):
    write_attributes(tmp_path, text)
    with pytest.raises(ValueError, match=message):
        load(tmp_path, "x1,y1\n1,2\n", fps=None)


@pytest.mark.parametrize("size", [7, 64, 1 << 24])
def test_large_files_are_read_in_blocks(size, tmp_path, monkeypatch):
    monkeypatch.setattr(_sheets, "ROWS", size)
    rows = [f"{k},a,{k}.5,{-k}.25\n" for k in range(1, 51)]
    for same in ("", ",", "\r", "\r\r"):
        changed = [
            *rows[:29],
            rows[29].replace("\n", f"{same}\n"),
            '31,"a",31.5, -31.25\n',
            *rows[31:],
            "\n\n",
        ]
        found = load(tmp_path, TIDY + "".join(changed))
        np.testing.assert_array_equal(
            found.positions[:, 0], [(k + 0.5, -k - 0.25) for k in range(1, 51)]
        )
    wrong = {
        "30,a,1": "3",
        "30,a,x,2": "'x'",
        "30,a,1,\udcff": "byte 0xff",
        "3\r0,a,1,2": "a carriage return",
    }
    for row, got in wrong.items():
        content = (TIDY + "".join([*rows[:29], f"{row}\n", *rows[30:]])).encode(
            errors="surrogateescape"
        )
        with pytest.raises(ValueError, match=rf"got {got}.* \[.*file.txt:31\]"):
            load(tmp_path, content)
    unended = load(tmp_path, TIDY + "".join(rows) + "51,a,1,51.25")
    np.testing.assert_array_equal(unended.positions, found.positions)
    assert any("the last line has no line end and is left out" in line for line in unended.remarks)


@pytest.mark.parametrize("blank", ["\t\t", " \t \t ", "\t\t\r"])
def test_a_line_of_tabs_alone_is_blank(blank, tmp_path):
    text = f"X1\tY1\tProbId1\n1\t2\t1\n{blank}\n3\t4\t1\n"
    with pytest.raises(
        ValueError, match=r"must have no blank line inside; got an empty line \[.*file.txt:3\]"
    ):
        load(tmp_path, text)
