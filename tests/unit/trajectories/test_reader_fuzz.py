"""Damaged files: a clear error that names the file, or exactly what the file says.

What a damaged text file says is what the plain twin in naive_readers.py reads. The suite runs the same few hundred cases every
time; to run others, say how many in all:

    TURING_LEARNING_FUZZ_CASES=10000 pytest tests/unit/trajectories/test_reader_fuzz.py
"""

import os
import re
from contextlib import suppress
from pathlib import Path

import naive_readers
import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tracker_files import PROJECTED, SAID, WRITERS, expected, walk

from turing_learning.errors import RefusedError
from turing_learning.trajectories import load_trajectories

CASES = int(os.environ.get("TURING_LEARNING_FUZZ_CASES", "400"))
TEXT = tuple(naive_readers.READERS)
TIMED = ("trackmate-xml", "trex-csv", "toxtrac-csv", "ethovision", "gpx", "ros-csv", "movebank")
"""Formats whose rows have times, or that are no tables: what they say where they are damaged has no plain twin."""
ARRAYS = (
    "idtracker.ai-h5", "idtracker.ai-npy", "sleap", "trex", "deeplabcut-h5", "movement", "via", "coco", "sleap-slp", "nwb",
)  # fmt: skip
DATA = Path(__file__).parent / "data"
REAL = {name: DATA / name for name in ("deeplabcut_table.h5", "deeplabcut_fixed.h5", "movement.nc")}
"""Files that pandas, PyTables and h5netcdf wrote."""
NUMBERED = {
    "toxtrac": 0, "tracktor": 1, "trackmate": 4, "tidy": 1, "deeplabcut": 4, "fasttrack": 1, "sleap-csv": 1, "mot": 0,
}  # fmt: skip
"""Formats whose rows carry a frame number, with their header lines."""
TESTS = 2 * len(TEXT) + 2 * len(TIMED) + len(ARRAYS) + len(NUMBERED) + 9

each = settings(
    max_examples=-(-CASES // TESTS),
    deadline=None,
    database=None,
    derandomize="TURING_LEARNING_FUZZ_CASES" not in os.environ,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

CELLS = st.sampled_from(
    [
        "",
        "nan",
        "inf",
        "-1",
        "0",
        "1",
        "2.5",
        "1e1",
        "1e308",
        "-1e308",
        "1e9",
        "1_0",
        "0x10",
        "9" * 400,
        "\u0663",
        '"',
        "'",
        " 7 ",
        "a",
    ]
)
BYTES = st.one_of(
    st.binary(max_size=12),
    st.sampled_from([b"\n", b"\r", b"\0", b"\t", b",", b'"', b"-", b".", b"e", b"\xef\xbb\xbf"]),
)


@st.composite
def damage(draw, content):
    """Return the content cut off, overwritten, with pieces inserted, removed or repeated, once or a few times."""
    for _ in range(draw(st.integers(1, 3))):
        content = draw(
            st.sampled_from(
                [cut, overwrite, insert, remove, repeat, swap_lines, replace_cell, rename, recode]
            )
        )(draw, content)
    return content


NAMES = st.sampled_from(
    ["x", "y", "id", "frame", "time", "TRACK_ID", "POSITION_ZZ", "heading", "missing", "visible",
     "x (mm)", "y (\N{MICRO SIGN}m)", "POSITION_T", "confidence", "z", "w", "h", ""]
)  # fmt: skip


def rename(draw, content):
    """Call a column of one of the first lines otherwise."""
    lines = content.splitlines(keepends=True) or [b""]
    at = draw(st.integers(0, min(5, len(lines) - 1)))
    separator = max(b",\t;", key=lines[at].count)
    separator = bytes([separator])
    cells = lines[at].rstrip(b"\r\n").split(separator)
    cells[draw(st.integers(0, len(cells) - 1))] = draw(NAMES).encode()
    lines[at] = separator.join(cells) + b"\n"
    return b"".join(lines)


def recode(draw, content):
    """Write the text in another encoding, or with other line ends."""
    text = content.decode("utf-8", "replace")
    how = draw(
        st.sampled_from(["utf-8-sig", "utf-16", "utf-16-le", "utf-32", "cp1252", "\r\n", "\r"])
    )
    if how.isspace():
        return text.replace("\r\n", "\n").replace("\n", how).encode()
    return text.encode(how, "replace")


def _place(draw, content):
    return draw(st.integers(0, len(content)))


def cut(draw, content):
    return content[: _place(draw, content)]


def overwrite(draw, content):
    at, new = _place(draw, content), draw(BYTES)
    return content[:at] + new + content[at + len(new) :]


def insert(draw, content):
    at = _place(draw, content)
    return content[:at] + draw(BYTES) + content[at:]


def remove(draw, content):
    at = _place(draw, content)
    return content[:at] + content[at + draw(st.integers(1, 60)) :]


def repeat(draw, content):
    lines = content.splitlines(keepends=True) or [b""]
    at = draw(st.integers(0, len(lines) - 1))
    return b"".join(
        lines[: at + 1] + [lines[at]] * draw(st.sampled_from([1, 2, 300])) + lines[at + 1 :]
    )


def swap_lines(draw, content):
    return b"".join(draw(st.permutations(content.splitlines(keepends=True))))


def replace_cell(draw, content):
    lines = content.splitlines(keepends=True) or [b""]
    at = draw(st.integers(0, len(lines) - 1))
    separator = b"\t" if b"\t" in lines[at] else b","
    row = lines[at].split(separator)
    row[draw(st.integers(0, len(row) - 1))] = draw(CELLS).encode()
    lines[at] = separator.join(row)
    return b"".join(lines)


def outcome(path, said):
    """Return the recording, or None where it is refused with a message that names the file."""
    message = ""
    try:
        return load_trajectories(path, **said)
    except ValueError as error:
        message = str(error)
    assert str(path) in message
    assert " must " in message
    assert "\n" not in message
    return None


def as_dictionary(read):
    """Return (frame, individual) -> (x, y) in pixels of the file."""
    return {
        (read.first_frame + frame, read.individuals[who]): tuple(
            read.positions[frame, who] * [10, -10]
        )
        for frame, who in np.argwhere(read.present)
    }


@pytest.mark.parametrize("name", TEXT)
@given(data=st.data())
@each
def test_a_damaged_text_file_is_refused_or_read_as_it_stands(name, tmp_path, data):
    path = WRITERS[name](tmp_path, walk(frames=8))
    content = data.draw(damage(path.read_bytes()))
    path.write_bytes(content)
    read = outcome(path, SAID[name])
    if read is not None:
        assert read.fps == 25
        stated = naive_readers.read(read.format, content)
        found = as_dictionary(read)
        assert found.keys() == stated.keys()
        assert all(np.allclose(found[key], stated[key], rtol=1e-12, atol=1e-12) for key in found)


@pytest.mark.parametrize("name", TEXT)
@given(data=st.data())
@each
def test_a_text_file_that_is_cut_off_is_refused_or_gives_whole_rows(name, tmp_path, data):
    positions = walk(frames=8)
    path = WRITERS[name](tmp_path, positions)
    path.write_bytes(cut(data.draw, path.read_bytes()))
    read = outcome(path, SAID[name])
    if read is not None:
        whole = expected(name, positions)[: len(read.positions), : len(read.individuals)]
        np.testing.assert_allclose(read.positions[read.present], whole[read.present])


@pytest.mark.parametrize("name", TIMED)
@given(data=st.data())
@each
def test_a_damaged_export_is_refused_or_has_no_position_that_it_does_not_state(
    name, tmp_path, data
):
    path = WRITERS[name](tmp_path, walk(frames=8))
    path = sorted(path.glob("*.csv"))[0] if path.is_dir() else path
    content = data.draw(damage(path.read_bytes()))
    path.write_bytes(content)
    read = outcome(path, SAID[name])
    if read is None:
        return
    text = naive_readers.decoded(content)
    numbers = {
        float(word)
        for word in re.findall(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?", text)
    }
    found = read.positions[read.present]
    assert np.isfinite(found).all()
    if name in PROJECTED:  # the origin is theirs, too: as many places as different numbers at most
        assert len(np.unique(found[:, 0])) <= len(numbers)
        return
    stated = np.array(sorted({abs(number) for number in numbers if abs(number) <= 1e9}))
    per_cm = SAID[name].get("pixels_per_cm", 1)
    units = np.array(CM_PER_UNIT) / per_cm if per_cm != 1 else np.array(CM_PER_UNIT)
    possible = np.unique(np.concatenate([stated * unit for unit in units]))
    nearest = np.searchsorted(possible, np.abs(found))
    around = [possible[np.clip(nearest + shift, 0, len(possible) - 1)] for shift in (-1, 0)]
    error = np.minimum(*(np.abs(np.abs(found) - near) for near in around))
    assert (error <= 1e-9 * np.maximum(1, np.abs(found))).all()


CM_PER_UNIT = (1.0, 0.1, 100.0, 1e-4)
"""Units of length that a header may come to state."""


@pytest.mark.parametrize("name", TIMED)
@given(data=st.data())
@each
def test_an_export_that_is_cut_off_is_refused_or_gives_whole_rows(name, tmp_path, data):
    positions = walk(frames=8)
    path = WRITERS[name](tmp_path, positions)
    if path.is_dir():  # a file for each individual
        path = sorted(path.glob("*.csv"))[0]
        positions = positions[:, :1]
    path.write_bytes(cut(data.draw, path.read_bytes()))
    read = outcome(path, SAID[name])
    if read is not None and name not in PROJECTED:
        whole = expected(name, positions)[: len(read.positions), : len(read.individuals)]
        np.testing.assert_allclose(read.positions[read.present], whole[read.present], atol=1e-9)


@pytest.mark.parametrize("name", NUMBERED)
@given(data=st.data())
@each
def test_shuffled_rows_with_frame_numbers_give_the_same(name, tmp_path, data):
    positions = walk(frames=8, individuals=2)
    path = WRITERS[name](tmp_path, positions)
    lines = path.read_bytes().split(b"\n")[:-1]
    rows = data.draw(st.permutations(lines[NUMBERED[name] :]))
    path.write_bytes(b"\n".join([*lines[: NUMBERED[name]], *rows, b""]))
    np.testing.assert_allclose(
        load_trajectories(path, **SAID[name]).positions, expected(name, positions)
    )


@pytest.mark.parametrize("name", ARRAYS)
@given(data=st.data())
@each
def test_a_file_of_arrays_that_is_cut_off_or_damaged_is_refused_or_right(name, tmp_path, data):
    positions = walk(frames=8)
    path = WRITERS[name](tmp_path, positions)
    file = path / "video_fish0.npz" if path.is_dir() else path
    content = file.read_bytes()
    if name == "trex":  # checksums find a byte that is wrong; HDF5 and pickle have none
        file.write_bytes(
            data.draw(st.one_of(st.just(cut), st.just(overwrite), st.just(remove)))(
                data.draw, content
            )
        )
    else:
        file.write_bytes(cut(data.draw, content))
    read = outcome(path, SAID[name])
    if read is not None:
        whole = expected(name, positions)
        # a table gives its whole rows
        if name == "via":
            whole = whole[: len(read.positions), : len(read.individuals)]
            whole = np.where(read.present[..., None], whole, 0)
        np.testing.assert_allclose(read.positions, whole)


@pytest.mark.parametrize("name", ["idtracker.ai-h5", "sleap", "deeplabcut-h5", "movement", *REAL])
@given(data=st.data())
@each
def test_a_binary_file_with_wrong_bytes_never_ends_in_another_error(name, tmp_path, data):
    path = REAL.get(name) or WRITERS[name](tmp_path, walk(frames=8))
    content = overwrite(data.draw, path.read_bytes())
    (tmp_path / "damaged").write_bytes(content)
    outcome(
        tmp_path / "damaged",
        {"fps": 25, "pixels_per_cm": 10, "keypoint": "thorax", "y_axis": "up"} | SAID.get(name, {}),
    )


COLUMNS = st.sampled_from(
    ["frame", "time", "Time", "id", "track", "trial", "x", "y", "z", "X", "x1", "y1", "x2", "y2", "w", "h", "bb_left", "bb_top",
     "bb_width", "bb_height", "a_x", "a_y", "a_confidence", "heading", "", 0, 3.5]
)  # fmt: skip
VALUES = st.sampled_from(
    [
        [0, 1, 2],
        [0.0, 0.5, np.nan],
        ["a", "b", None],
        ["1", "2", "x"],
        [True, False, True],
        [np.inf, 1e300, -1.0],
        [1j, 0, 0],
        [2**70, 1, 0],
        [object(), {}, []],
        pd.array([1, None, 3], dtype="Int64"),
        pd.Categorical(["a", "b", "a"]),
        pd.date_range("2020-01-01", periods=3),
    ]
)


ROLES = st.sampled_from(
    [
        "frame",
        "time",
        "id",
        "x",
        "y",
        "heading",
        "left",
        "top",
        "right",
        "bottom",
        "width",
        "nonsense",
    ]
)


@given(
    columns=st.lists(st.tuples(COLUMNS, VALUES), max_size=7),
    labels=st.sampled_from([None, 2, 3, 4]),
    said=st.dictionaries(ROLES, COLUMNS.map(str), max_size=3),
    fps=st.sampled_from([2, None]),
)
@each
def test_a_table_in_memory_is_read_or_refused(columns, labels, said, fps):
    table = pd.DataFrame({k: values for k, (_, values) in enumerate(columns)})
    names = [name for name, _ in columns]
    if labels and columns:
        table.columns = pd.MultiIndex.from_tuples(
            [tuple(names[(k - j) % len(names)] for j in range(labels)) for k in range(len(names))]
        )
    else:
        table.columns = pd.Index(names, dtype=object)
    with suppress(RefusedError):
        assert len(
            load_trajectories(table, fps=fps, pixels_per_cm=1, y_axis="up", columns=said).positions
        )


@given(
    start=st.sampled_from([b"", b"\x89HDF\r\n\x1a\n", b"PK\x03\x04", b"\x93NUMPY\x01\x00"]),
    content=st.binary(max_size=400),
)
@each
def test_binary_rubbish_is_refused(start, content, tmp_path):
    path = tmp_path / "rubbish"
    path.write_bytes(start + content)
    assert outcome(path, {"fps": 25, "pixels_per_cm": 10, "y_axis": "up"}) is None
