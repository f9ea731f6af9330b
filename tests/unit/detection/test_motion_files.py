import io
import os
import zipfile

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import holds_motion, load_motion

SAMPLES = np.arange(2 * 3 * 4 * 2, dtype=float).reshape(2, 3, 4, 2)


def load(path):
    return load_motion(path, steps=4, signals=2)


def as_text(samples, *, names=("a", "b"), rows=None):
    lines = [
        f"{names[i]},{s},{t},{','.join(map(str, samples[i, s, t]))}"
        for i, s, t in np.ndindex(samples.shape[:3])
    ]
    return (
        "\n".join(
            [
                "individual,sample,step,speed,turn",
                *(lines if rows is None else [lines[k] for k in rows]),
            ]
        )
        + "\n"
    )


@pytest.mark.parametrize(
    ("name", "save", "given", "names"),
    [
        ("motion.npy", np.save, {"arr": SAMPLES}, ("1", "2")),
        ("motion.npz", np.savez, {"samples": SAMPLES}, ("1", "2")),
        (
            "motion.npz",
            np.savez,
            {"samples": SAMPLES, "individuals": np.array(["Ada", "Bo"])},
            ("Ada", "Bo"),
        ),
    ],
)
def test_arrays_are_read_with_the_names_of_an_archive_or_counted(
    tmp_path, name, save, given, names
):
    save(tmp_path / name, **given)
    motion = load(tmp_path / name)
    assert motion.individuals == names
    np.testing.assert_array_equal(motion.samples, SAMPLES)


def test_long_recordings_are_cut_into_samples(tmp_path):
    long = np.arange(2 * 9 * 2, dtype=float).reshape(2, 9, 2)
    np.save(tmp_path / "motion.npy", long)
    motion = load(tmp_path / "motion.npy")
    assert motion.samples.shape == (2, 2, 4, 2)
    np.testing.assert_array_equal(motion.samples[:, 1], long[:, 4:8])


def test_the_rows_of_a_table_may_be_in_any_order(tmp_path):
    rows = np.random.default_rng(0).permutation(24)
    (tmp_path / "motion.csv").write_text(as_text(SAMPLES, rows=rows))
    motion = load(tmp_path / "motion.csv")
    order = [motion.individuals.index(name) for name in ("a", "b")]
    np.testing.assert_array_equal(motion.samples[order], SAMPLES)


def test_a_table_without_samples_is_cut(tmp_path):
    rows = [f"{name},{t + 1},{t}.5,-1" for name in "ab" for t in range(9)]
    (tmp_path / "motion.csv").write_text("\n".join(["individual,step,speed,turn", *rows]))
    motion = load(tmp_path / "motion.csv")
    assert motion.individuals == ("a", "b")
    assert motion.samples[1, :, :, 0].tolist() == [[0.5, 1.5, 2.5, 3.5], [4.5, 5.5, 6.5, 7.5]]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"^`motion` must begin with individual,step or .* got '' \[.*motion.csv:1\]"),
        ("id,frame,x,y\n", r"must begin with individual,step or .* got 'id,frame,x,y' \["),
        ("individual,sample,step\n", "must begin with .* and the names of signals"),
        ("individual,step,a,b\n", r"must hold at least one step; got none \["),
        (
            "individual,step,a,b\nx,0,1,fast\n",
            r"must hold numbers; got 'x,0,1,fast' \[.*motion.csv:2\]",
        ),
        (
            "individual,step,a,b\nx,0,1,2\nx,1,1\n",
            r"must have 4 entries in each row; got 3 \[.*motion.csv:3\]",
        ),
        (
            "individual,step,a,b\nx,0,1,2\n\nx,0,1,2\n",
            r"hold each step once; got individual 'x', sample 0, step 0 again \[.*:4\]",
        ),
        (
            "individual,step,a,b\nx,0,1,2\nx,2,1,2\n",
            r"must count each step consecutively; got 2 after 0 \[",
        ),
        (
            "individual,step,a,b\nx,0,1,2\nx,1,1,2\ny,0,1,2\n",
            r"got no row for individual 'y', sample 0, step 1 \[",
        ),
        (
            "individual,step,a,b\nx,0,1,2\n",
            "must be at least one sample of 4 steps long; got 1 steps",
        ),
        (
            as_text(SAMPLES[..., :1]).replace(",turn", ""),
            r"= \(any, any, 4, 2\); got \(2, 3, 4, 1\)",
        ),
        (
            as_text(SAMPLES).replace("b,1,2,36.0", "b,1,2,nan"),
            r"got nan \[individual b, sample 1, step 2, signal 0\]",
        ),
    ],
)
def test_a_table_that_does_not_hold_motion_is_refused(tmp_path, content, message):
    (tmp_path / "motion.csv").write_text(content)
    with pytest.raises(ConfigurationError, match=message):
        load(tmp_path / "motion.csv")


def test_a_table_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "motion.csv").write_bytes(b"individual,step,a\n\xff\xfe\x00")
    with pytest.raises(
        ConfigurationError, match=r"^`motion` must be text in UTF-8; got byte 0xff \[.*motion.csv\]"
    ):
        load(tmp_path / "motion.csv")


def pickled():
    buffer = io.BytesIO()
    np.save(buffer, np.array([{}], dtype=object), allow_pickle=True)
    return buffer.getvalue()


def stored(array):
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def headed(header):
    return b"\x93NUMPY\x01\x00" + (118).to_bytes(2, "little") + header.ljust(117) + b"\n"


HEADERS = [
    b"{'descr': '<f8', 'fortran_order': False, 'shape': (-3, 4, 2), }",
    b"{'descr': '<f8', 'shape': (3, ",
]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
@pytest.mark.parametrize("suffix", ["npy", "npz", "csv"])
def test_nobody_waits_for_a_pipe(tmp_path, suffix):
    path = tmp_path / f"motion.{suffix}"
    os.mkfifo(path)
    assert not holds_motion(path)
    with pytest.raises(
        ConfigurationError,
        match=r"^`motion` must be a file; got .*, a pipe or device. Write what comes",
    ):
        load(path)


def test_an_archive_that_unpacks_to_too_much_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "motion.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("samples.npy", bytes(100_000_000))
    with pytest.raises(
        ConfigurationError, match=r"^`motion` must unpack to at most 67108864 bytes; got 100000000"
    ):
        load(tmp_path / "motion.npz")


@pytest.mark.parametrize("name", ["motion.npy", "motion.npz"])
@pytest.mark.parametrize(
    "content",
    [b"", b"speed", pickled(), stored(SAMPLES)[:-8], b"PK\x03\x04rest", *map(headed, HEADERS)],
)
def test_a_file_that_is_no_array_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(
        ConfigurationError, match=r"^`motion` must be a file of numbers in NumPy's format; got "
    ):
        load(tmp_path / name)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (np.zeros(3), r"^`motion` must be of shape .* got \(3,\)"),
        (np.float64(3), r"^`motion` must be of shape .* got \(\)"),
        (np.zeros((2, 3, 5, 2)), r"^`motion` must be .* = \(any, any, 4, 2\); got \(2, 3, 5, 2\)"),
        (np.zeros((2, 0, 4, 2)), r"not empty; got \(2, 0, 4, 2\)"),
        (
            np.zeros((2, 3, 4, 2), complex),
            "must be an array of numbers; got an array of complex128",
        ),
        (np.zeros((2, 3, 2)), "must be at least one sample of 4 steps long; got 3 steps"),
    ],
)
def test_an_array_that_does_not_fit_is_refused(tmp_path, array, message):
    np.save(tmp_path / "motion.npy", array)
    with pytest.raises(ConfigurationError, match=message):
        load(tmp_path / "motion.npy")


def test_an_archive_without_samples_is_refused(tmp_path):
    np.savez(tmp_path / "motion.npz", poses=SAMPLES)
    with pytest.raises(
        ConfigurationError, match=r"^`motion` must hold an array `samples`; got \['poses'\] \["
    ):
        load(tmp_path / "motion.npz")


def test_each_individual_has_one_name(tmp_path):
    np.savez(tmp_path / "motion.npz", samples=SAMPLES, individuals=np.array(["Ada"]))
    with pytest.raises(
        ConfigurationError, match=r"^`individuals` must be one name for each of the 2 .* got 1"
    ):
        load(tmp_path / "motion.npz")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("motion.txt", r"^`motion` must be a file that ends with one of .npy, .npz, .csv; got "),
        ("motion.csv", r"^`motion` must be a file that can be read; got .* \(No such file"),
        ("motion.npy", r"^`motion` must be a file that can be read; got .* \(No such file"),
        (".", "^`motion` must be a file that ends with one of"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused(tmp_path, name, message):
    with pytest.raises(ConfigurationError, match=message):
        load(tmp_path / name)


def test_columns_of_a_table_are_found_by_the_names_of_the_signals(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(as_text(SAMPLES[..., ::-1]).replace("speed,turn", "turn,speed"))
    found = load_motion(path, steps=4, signals=2, names=("speed", "turn"))
    np.testing.assert_array_equal(found.samples, SAMPLES)


def test_columns_with_other_names_are_refused(tmp_path):
    path = tmp_path / "motion.csv"
    path.write_text(as_text(SAMPLES).replace("speed,turn", "v,turn"))
    with pytest.raises(
        ConfigurationError,
        match=r"the signals of the run, speed, turn, in any order; got v, turn \[",
    ):
        load_motion(path, steps=4, signals=2, names=("speed", "turn"))
