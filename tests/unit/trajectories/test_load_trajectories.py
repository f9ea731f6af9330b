import os

import numpy as np
import pytest
from tracker_files import (
    FPS,
    PROJECTED,
    SAID,
    UPWARDS,
    WRITERS,
    expected,
    tidy,
    tracktor,
    trex,
    walk,
)

from turing_learning.trajectories import FORMATS, load_trajectories

EVERY = pytest.mark.parametrize("name", FORMATS)


def test_there_is_a_writer_for_every_format():
    assert set(WRITERS) == set(FORMATS)


@EVERY
def test_every_format_is_recognized_by_its_content_and_gives_the_same_positions(name, tmp_path):
    positions = walk()
    read = load_trajectories(WRITERS[name](tmp_path, positions), **SAID[name])
    assert read.format == name
    there = ~np.isnan(positions[:, : read.present.shape[1], 0])
    np.testing.assert_array_equal(read.present, there)
    # degrees are written with twelve digits, and the plane touches the globe at a tenth of a millimeter from 0
    rounding = 1e-3 if name in PROJECTED else 1e-12
    found = read.positions
    if name in PROJECTED:
        found = np.where(there[..., None], found - np.median(found[there], axis=0), 0)
    np.testing.assert_allclose(found, expected(name, positions), atol=rounding)
    assert (read.fps, read.unit, read.first_frame) == (FPS, "cm", 0)


@EVERY
def test_the_format_may_be_named(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    assert load_trajectories(path, format=name, **SAID[name]).format == name


@EVERY
def test_no_format_is_taken_for_another_one_that_is_named(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    for other in set(FORMATS) - {name}:
        with pytest.raises((ValueError, IsADirectoryError)):
            load_trajectories(path, format=other, allow_pickle=True, fps=FPS, pixels_per_cm=10)


@pytest.mark.parametrize("name", [name for name in FORMATS if name not in UPWARDS])
def test_the_way_y_was_turned_is_told(name, tmp_path):
    read = load_trajectories(WRITERS[name](tmp_path, walk()), **SAID[name])
    assert "y pointed down in the file and was turned upwards" in read.problems.remarks


@pytest.mark.parametrize("name", [name for name in FORMATS if "fps" in SAID[name]])
def test_a_frame_rate_is_never_guessed(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    why = r"(the file does not state it|no rate is stated by times .*, or count frames) \["
    with pytest.raises(ValueError, match="`fps` must be given; got none, and " + why):
        load_trajectories(path, **SAID[name] | {"fps": None})


@pytest.mark.parametrize("name", [name for name in FORMATS if "pixels_per_cm" in SAID[name]])
def test_a_scale_is_never_guessed(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    with pytest.raises(
        ValueError, match=r"`pixels_per_cm` must be given; got none.*Give 1 for a file in cm"
    ):
        load_trajectories(path, **SAID[name] | {"pixels_per_cm": None})


@pytest.mark.parametrize("name", [name for name in FORMATS if "fps" not in SAID[name]])
def test_a_frame_rate_that_contradicts_the_file_is_refused(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    with pytest.raises(ValueError, match=r"`fps` must be what the file states, 25.0; got 30"):
        load_trajectories(path, **SAID[name] | {"fps": 30})


def test_a_scale_that_contradicts_the_file_is_refused(tmp_path):
    with pytest.raises(
        ValueError, match="`pixels_per_cm` must be left out for a file in cm; got 10"
    ):
        load_trajectories(trex(tmp_path, walk()), pixels_per_cm=10)
    assert load_trajectories(trex(tmp_path, walk()), pixels_per_cm=1).unit == "cm"


def test_positions_stay_in_pixels_when_the_scale_is_said_to_be_unknown(tmp_path):
    positions = walk(missing=0)
    read = load_trajectories(
        tidy(tmp_path, positions), fps=25, pixels_per_cm="unknown", y_axis="up"
    )
    assert read.unit == "px"
    np.testing.assert_allclose(read.positions, positions)


def test_the_direction_of_y_in_a_plain_table_is_never_guessed(tmp_path):
    with pytest.raises(ValueError, match="`y_axis` must be given; got none"):
        load_trajectories(tidy(tmp_path, walk()), fps=25, pixels_per_cm=1)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (
            {"fps": 0},
            r"`fps` must be a finite number of at least 1e-09 and of at most 1e\+09; got 0",
        ),
        (
            {"fps": np.inf},
            r"`fps` must be a finite number of at least 1e-09 and of at most 1e\+09; got inf",
        ),
        (
            {"fps": 1e-12},
            r"`fps` must be a finite number of at least 1e-09 and of at most 1e\+09; got 1e-12",
        ),
        (
            {"pixels_per_cm": -1},
            r"`pixels_per_cm` must be a finite number of at least 1e-09 and of at most 1e\+09; got -1",
        ),
        (
            {"pixels_per_cm": 1e300},
            r"`pixels_per_cm` must be a finite number of at least 1e-09 and of at most 1e\+09; got 1e\+300",
        ),
        (
            {"pixels_per_cm": "ten"},
            r"`pixels_per_cm` must be a finite number of at least 1e-09 and of at most 1e\+09; got 'ten'",
        ),
        ({"y_axis": "left"}, "`y_axis` must be 'up' or 'down'; got 'left'"),
        ({"min_confidence": np.nan}, "`min_confidence` must be a finite number; got nan"),
        (
            {"min_confidence": 0.5},
            "`min_confidence` must be left out; got 0.5 for a file without confidence",
        ),
        ({"format": "fishtrack"}, "`format` must be one of idtracker, .*; got 'fishtrack'"),
        ({"keypoint": "head"}, "`keypoint` must be left out for format tracktor; got 'head'"),
    ],
)
def test_options_that_make_no_sense_are_refused(said, message, tmp_path):
    path = tracktor(tmp_path, walk())
    with pytest.raises(ValueError, match=message):
        load_trajectories(path, **{"fps": 25, "pixels_per_cm": 10} | said)


def test_a_scale_that_makes_distances_absurd_is_refused(tmp_path):
    path = tmp_path / "fish.csv"
    path.write_text("frame,x,y\n0,1,500\n1,3,4\n")
    message = r"`pixels_per_cm` must leave coordinates within \+-1e\+09 cm; got 1e-07, by which 500 is 5e\+09 cm \["
    with pytest.raises(ValueError, match=message):
        load_trajectories(path, fps=25, pixels_per_cm=1e-7, y_axis="up")
    assert load_trajectories(path, fps=25, pixels_per_cm=1e-6, y_axis="up").positions.max() == 5e8


def test_an_ambiguous_content_is_refused_and_the_candidates_are_named(tmp_path):
    path = tmp_path / "both.csv"
    path.write_text("frame,id,x,y,pos_x,pos_y\n0,a,1,2,3,4\n")
    with pytest.raises(ValueError, match=r"got what fits tracktor and tidy.*Give `format`"):
        load_trajectories(path, fps=25, pixels_per_cm=10)
    read = load_trajectories(path, fps=25, pixels_per_cm="unknown", format="tidy", y_axis="up")
    np.testing.assert_array_equal(read.positions, [[[1, 2]]])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"a,b\n1,2\n",
            r"have the content of one of .*; got a first line of a, b \[.*\]\. Name the",
        ),
        (b"hello", r"have the content of one of .*; got a first line of hello \[.*\]\. Name the"),
        (b"a\rb\r", r"have line ends of one kind; .* Save it with line ends of Unix or Windows"),
        (b"\xff\n", r"have the content of one of .*; got a first line of ÿ"),
        (b"\x00\x01\xff" * 50, r"be text, HDF5 or arrays; got no text in its first lines"),
        (b"\n\n\n", r"be text, HDF5 or arrays; got no text in its first lines"),
        (b"MATLAB 5.0 MAT-file\n", r"be a whole npz or mat file; got .*cut off or damaged"),
        (
            b"Im,cx,cy,z\n1,2,3,4\n",
            r"got a first line of Im, .*example columns=\{'x': 'cx', 'y': 'cy'\}",
        ),
        (b"frame_nr,bx,by\n1,2,3\n", r"example columns=\{'x': 'x_cm'\}"),
    ],
)
def test_an_unknown_content_is_refused_with_what_it_is(content, message, tmp_path):
    path = tmp_path / "some.dat"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"`path` must .*{message}"):
        load_trajectories(path, fps=25, pixels_per_cm=10)


TABLE = "frame,id,x (µm),y (µm),winkel (°)\n0,fähe,1000,2000,3\n1,fähe,1000,2000,3\n"


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "latin-1", "cp1252"]
)
def test_a_table_is_read_in_any_encoding_that_programs_write(encoding, tmp_path):
    path = tmp_path / "fish.csv"
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    path.write_bytes((mark + TABLE).replace("\n", "\r\n").encode(encoding))
    read = load_trajectories(path, fps=25, y_axis="up")
    assert read.individuals == ("fähe",)
    np.testing.assert_allclose(read.positions[:, 0], [[0.1, 0.2]] * 2)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"frame,id,x,y\n" + b"0,b,1,2\n" * 6 + b"0,b\xe4,1,2\n",
            r"be text in UTF-8; got byte 0xe4 \[.*fish.csv:8\]. It may be damaged",
        ),
        (TABLE.partition("\n1")[0].encode("utf-16"), r"have at least one row; got none"),
    ],
)
def test_damaged_characters_are_refused_with_their_line(content, message, tmp_path):
    path = tmp_path / "fish.csv"
    path.write_bytes(content)
    with pytest.raises(ValueError, match="`path` must " + message):
        load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up")


def test_all_that_is_missing_is_named_at_once(tmp_path):
    path = tidy(tmp_path, walk())
    message = (
        r"`fps` must be given; got none, and the file does not state it \[.*fish.csv\]. Give `pixels_per_cm`, too: 1 for a file in "
        r'cm. Give `y_axis`, too: "down" for positions in images, "up" for'
    )
    with pytest.raises(ValueError, match=message):
        load_trajectories(path)
    with pytest.raises(
        ValueError,
        match=r"`pixels_per_cm` must be given; .* Give 1 for .* Give `y_axis`, too: \"down\"",
    ):
        load_trajectories(path, fps=25)


@pytest.mark.parametrize("line", ["0,fish,1,2", "0,1,2.5,3e2", "0 1 2", "1;nan;-3"])
def test_a_file_without_a_header_line_is_called_that(line, tmp_path):
    path = tmp_path / "bare.csv"
    path.write_text(f"{line}\n" * 3)
    rule = (
        "have the content of one of"
        if "fish" in line
        else r"begin with a header line; got numbers alone, .*bare.csv:1\]"
    )
    with pytest.raises(ValueError, match=f"`path` must {rule}"):
        load_trajectories(path, fps=25)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    with pytest.raises(ValueError, match=r"must be a file; got a pipe or device \[.*pipe.npz\]"):
        load_trajectories(pipe, fps=25)
    with pytest.raises(ValueError, match="hold arrays `frame`, X and Y; got none"):
        load_trajectories(tmp_path, format="trex")


def test_a_list_gives_a_list(tmp_path):
    one, two = WRITERS["tidy"](tmp_path, walk(seed=1)), WRITERS["toxtrac"](tmp_path, walk(seed=2))
    read = load_trajectories([one, two], fps=25, pixels_per_cm=10, y_axis="down")
    assert [each.format for each in read] == ["tidy", "toxtrac"]
    message = "`path` must be a file, a DataFrame, a Dataset, an array of positions, or a list of them; got int"
    with pytest.raises(ValueError, match=message):
        load_trajectories(3)


def test_an_empty_file_is_refused(tmp_path):
    path = tmp_path / "empty.csv"
    path.touch()
    with pytest.raises(ValueError, match=r"`path` must not be empty; got 0 bytes \[.*empty.csv\]"):
        load_trajectories(path)


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"nowhere.csv"):
        load_trajectories(tmp_path / "nowhere.csv")


def test_positions_of_which_the_tracker_is_unsure_count_as_missing_when_asked(tmp_path):
    path = tmp_path / "fish.csv"
    path.write_text("frame,x,y,confidence\n0,1,2,0.9\n1,3,4,0.2\n2,5,6,0.8\n")
    said = {"fps": 25, "pixels_per_cm": 1, "y_axis": "up"}
    np.testing.assert_array_equal(load_trajectories(path, **said).present[:, 0], [True, True, True])
    sure = load_trajectories(path, min_confidence=0.5, **said)
    np.testing.assert_array_equal(sure.present[:, 0], [True, False, True])
    assert sure.remarks == ("1 positions with a confidence below 0.5 count as missing",)
    with pytest.raises(
        ValueError, match=r"hold a position with confidence 2 or more; got at most 0.9"
    ):
        load_trajectories(path, min_confidence=2, **said)


def test_headings_turn_with_the_direction_of_y(tmp_path):
    path = tmp_path / "fish.csv"
    path.write_text("frame,x,y,heading\n0,1,2,0.5\n")
    assert load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="up").headings[0, 0] == 0.5
    assert load_trajectories(path, fps=25, pixels_per_cm=1, y_axis="down").headings[0, 0] == -0.5


def test_shuffled_rows_without_frame_numbers_are_refused(tmp_path):
    path = WRITERS["idtracker"](tmp_path, walk(frames=300, missing=0))
    assert load_trajectories(path, fps=25, pixels_per_cm=1).problems.jumps == ()
    header, *rows = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([header, *np.random.default_rng(1).permutation(rows)]))
    with pytest.raises(
        ValueError,
        match=r"must have its rows in the order of time; got a typical step of .* may be shuffled",
    ):
        load_trajectories(path, fps=25, pixels_per_cm=1)
