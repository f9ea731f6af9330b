import json
import sys

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from tracker_files import (
    SAID,
    WRITERS,
    expected,
    idtracker_ai_h5,
    idtracker_ai_npy,
    sleap,
    trex,
    walk,
)

from turing_learning.trajectories import load_trajectories
from turing_learning.trajectories.readers import _arrays

SAY = {"fps": 25, "pixels_per_cm": 10}


def test_a_pickle_is_not_opened_without_an_explicit_word(tmp_path):
    path = idtracker_ai_npy(tmp_path, walk())
    with pytest.raises(
        ValueError,
        match=r"must not be a pickle; got an npy file .* allow_pickle=True in Python opens it",
    ):
        load_trajectories(path, pixels_per_cm=10)


@pytest.mark.parametrize(
    ("content", "received"),
    [({"a": 1}, "dict"), ({"trajectories": 3}, "dict"), ([1, 2], "list"), (None, "NoneType")],
)
def test_an_npy_without_trajectories_is_refused(content, received, tmp_path):
    stored = content if isinstance(content, np.ndarray) else np.array(content, dtype=object)
    if isinstance(content, list):
        stored = np.empty((), dtype=object)
        stored[()] = content
    np.save(tmp_path / "a.npy", stored, allow_pickle=True)
    with pytest.raises(
        ValueError,
        match=rf"hold a dictionary with the array `trajectories` \(F, A, 2\); got {received} \[",
    ):
        load_trajectories(tmp_path / "a.npy", allow_pickle=True, **SAY)


def test_a_damaged_npy_is_refused(tmp_path):
    path = idtracker_ai_npy(tmp_path, walk())
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(
        ValueError,
        match=r"be a whole npy file; got .* \[.*trajectories.npy\]. The file may be cut off",
    ):
        load_trajectories(path, allow_pickle=True, **SAY)


@pytest.mark.parametrize("name", ["sleap", "idtracker.ai-h5"])
def test_a_damaged_hdf5_file_is_refused(name, tmp_path):
    path = WRITERS[name](tmp_path, walk())
    path.write_bytes(path.read_bytes()[:700])
    with pytest.raises(
        ValueError,
        match=r"be a whole HDF5 file; got .* \[.*h5\]. The file may be cut off or damaged",
    ):
        load_trajectories(path, **SAID[name])


def test_without_h5py_the_user_hears_what_to_install(tmp_path, monkeypatch):
    path = sleap(tmp_path, walk())
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(
        ImportError,
        match=r"h5py, to read .*analysis\.h5, must be installed; .* Run: pip install 'turing-learning\[tracking\]'",
    ):
        load_trajectories(path, **SAID["sleap"])


def test_a_file_of_sleap_and_idtracker_ai_at_once_is_ambiguous(tmp_path):
    path = sleap(tmp_path, walk())
    with h5py.File(path, "a") as file:
        file["trajectories"] = walk()
    with pytest.raises(ValueError, match=r"got what fits idtracker.ai-h5 and sleap"):
        load_trajectories(path, **SAY)


@pytest.mark.parametrize(
    ("trajectories", "message"),
    [
        (
            np.zeros((5, 2)),
            r"hold numbers with 3 dimensions, not empty; got float64 \(5, 2\) \[.*, dataset trajectories\]",
        ),
        (
            np.zeros((0, 2, 2)),
            r"hold numbers with 3 dimensions, not empty; got float64 \(0, 2, 2\) \[",
        ),
        (
            np.zeros((5, 2, 3)),
            r"hold trajectories of shape \(F, A, 2\), not empty; got \(5, 2, 3\) \[",
        ),
        (
            np.full((5, 2, 2), np.nan),
            r"hold at least one position; got none \[.*, dataset trajectories\]",
        ),
        (
            np.full((5, 2, 2), np.inf),
            r"have finite positions or NaN; got \[inf, inf\] \[.*, frame 0\]",
        ),
        (
            np.array([[[1.0, 2.0]], [[np.nan, 2.0]]]),
            r"have both x and y or neither; got \[nan, 2.0\] \[.*, frame 1\]",
        ),
    ],
)
def test_an_hdf5_file_with_wrong_trajectories_is_refused_with_its_dataset(
    trajectories, message, tmp_path
):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["trajectories"] = trajectories
    with pytest.raises(ValueError, match=message):
        load_trajectories(tmp_path / "a.h5", **SAY)


def test_a_huge_dataset_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(_arrays, "MOST_NUMBERS", 10)
    with pytest.raises(
        ValueError, match=r"hold at most 10 numbers; got \(12, 3, .\) \[.*, dataset "
    ):
        load_trajectories(idtracker_ai_h5(tmp_path, walk()), pixels_per_cm=10)


def test_a_frame_rate_that_is_none_is_refused(tmp_path):
    path = idtracker_ai_h5(tmp_path, walk())
    with h5py.File(path, "a") as file:
        file.attrs["frames_per_second"] = "fast"
    with pytest.raises(ValueError, match=r"state a frame rate above 0; got 'fast' \["):
        load_trajectories(path, **SAY)


def test_sleap_may_order_its_dimensions_otherwise(tmp_path):
    positions = walk()
    path = sleap(tmp_path, positions)
    with h5py.File(path, "a") as file:
        tracks = file["tracks"][()].T
        del file["tracks"]
        file["tracks"] = tracks
        file["tracks"].attrs["dims"] = json.dumps(["frame", "node", "xy", "track"])
    read = load_trajectories(path, **SAID["sleap"])
    np.testing.assert_allclose(read.positions, expected("sleap", positions))
    with h5py.File(path, "a") as file:
        file["tracks"].attrs["dims"] = json.dumps(["frame", "node", "xy"])
    with pytest.raises(
        ValueError,
        match=r"name the dimensions \['track', 'xy', 'node', 'frame'\]; got .*, dataset tracks, dims\]",
    ):
        load_trajectories(path, **SAID["sleap"])


def test_names_that_do_not_fit_the_tracks_are_refused(tmp_path):
    path = sleap(tmp_path, walk())
    with h5py.File(path, "a") as file:
        del file["track_names"]
        file["track_names"] = np.array([b"one"])
    with pytest.raises(
        ValueError,
        match=r"have `tracks` of .* = \(1, 2, 2, F\); got \(3, 2, 2, 12\) \[.*, dataset tracks\]",
    ):
        load_trajectories(path, **SAID["sleap"])


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            np.array([b"a", b"a", b"b"]),
            r"`individuals` must be 3 different names; got \('a', 'a', 'b'\) \[.*\.h5\]",
        ),
        (
            np.array([[b"a", b"b", b"c"]]),
            r"hold a list of names; got \(1, 3\) \[.*, dataset track_names\]",
        ),
    ],
)
def test_odd_names_of_tracks_are_refused(names, message, tmp_path):
    path = sleap(tmp_path, walk())
    with h5py.File(path, "a") as file:
        del file["track_names"]
        file["track_names"] = names
    with pytest.raises(ValueError, match=message):
        load_trajectories(path, **SAID["sleap"])


def test_tracks_without_names_are_numbered_and_scores_are_optional(tmp_path):
    path = sleap(tmp_path, walk())
    with h5py.File(path, "a") as file:
        del file["track_names"], file["point_scores"]
    read = load_trajectories(path, **SAID["sleap"])
    assert (read.individuals, read.confidence) == (("1", "2", "3"), None)


def test_scores_are_the_confidence(tmp_path):
    read = load_trajectories(sleap(tmp_path, walk()), **SAID["sleap"])
    np.testing.assert_array_equal(read.confidence, np.where(read.present, 0.8, 0))
    read = load_trajectories(idtracker_ai_h5(tmp_path, walk()), pixels_per_cm=10)
    np.testing.assert_array_equal(read.confidence, np.where(read.present, 0.9, 0))


def test_one_file_of_trex_is_one_individual(tmp_path):
    positions = walk(missing=0)
    read = load_trajectories(trex(tmp_path, positions) / "video_fish1.npz")
    assert read.individuals == ("fish1",)
    np.testing.assert_allclose(read.positions[:, 0], positions[:, 1] * [1, -1])


def test_trex_offers_the_head_too(tmp_path):
    read = load_trajectories(trex(tmp_path, walk(missing=0)), keypoint="head")
    np.testing.assert_allclose(read.positions, (walk(missing=0) + 1) * [1, -1])
    with pytest.raises(ValueError, match="`keypoint` must be one of head, wcentroid; got 'tail'"):
        load_trajectories(trex(tmp_path, walk()), keypoint="tail")


def test_angles_of_trex_are_the_headings_where_they_are_complete(tmp_path):
    angles = np.linspace(0, 1, 12)
    np.testing.assert_allclose(
        load_trajectories(trex(tmp_path, walk(missing=0), ANGLE=angles)).headings[:, 2], -angles
    )
    angles[3] = np.inf
    read = load_trajectories(trex(tmp_path, walk(missing=0), ANGLE=angles))
    assert read.headings is None
    assert read.remarks[0] == "headings are left out: 3 positions come without one"


def test_trex_frames_that_are_marked_missing_count_as_missing(tmp_path):
    read = load_trajectories(trex(tmp_path, walk(missing=0), missing=np.arange(12) == 5))
    np.testing.assert_array_equal(np.flatnonzero(~read.present.all(axis=1)), [5])


def test_a_frame_rate_that_trex_states_goes_before_its_times(tmp_path):
    assert load_trajectories(trex(tmp_path, walk(), frame_rate=np.array(50.0))).fps == 50


def test_uneven_times_of_trex_state_no_frame_rate(tmp_path):
    path = trex(tmp_path, walk(), time=np.geomspace(1, 9, 12))
    with pytest.raises(ValueError, match="`fps` must be given; got none"):
        load_trajectories(path)


def test_other_files_in_the_folder_of_trex_are_told(tmp_path):
    path = trex(tmp_path, walk())
    np.savez(path / "video_posture_fish0.npz", offsets=np.zeros(3))
    assert load_trajectories(path).remarks[0] == "1 npz files of the folder hold no track"


def test_files_of_trex_that_differ_in_the_front_keep_their_whole_names(tmp_path):
    path = trex(tmp_path, walk(individuals=2))
    (path / "video_fish1.npz").rename(path / "other_fish0.npz")
    assert load_trajectories(path).individuals == ("other_fish0", "video_fish0")


def test_files_of_trex_with_different_frame_rates_are_refused(tmp_path):
    path = trex(tmp_path, walk())
    np.savez(
        path / "video_fish0.npz",
        **{"frame": np.arange(3), "X": np.ones(3), "Y": np.ones(3), "frame_rate": 50.0},
    )
    with pytest.raises(
        ValueError, match=r"state one frame rate for all individuals; got \[25.0, 50.0\] \["
    ):
        load_trajectories(path, keypoint=None)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (
            {"X#wcentroid": np.ones(5)},
            r"have arrays of one length, not empty; got .* \[.*video_fish0.npz\]",
        ),
        (
            {"X#wcentroid": np.ones((12, 2))},
            r"hold lists of numbers; got float64 \(12, 2\) \[.*, array X#wcentroid\]",
        ),
        (
            {"frame": np.arange(12) / 2},
            r"have frame numbers that are whole, .*; got 0.5 \[.*video_fish0.npz, index 1\]",
        ),
        (
            {"frame": np.zeros(12)},
            r"give one position .*; got another one .* \[.*video_fish0.npz, index",
        ),
    ],
)
def test_arrays_of_trex_that_are_wrong_are_refused_with_the_file(arrays, message, tmp_path):
    path = trex(tmp_path, walk(), **arrays)
    with pytest.raises(ValueError, match=message):
        load_trajectories(path, fps=25)


def test_a_folder_without_tracks_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"hold arrays `frame`, X and Y; got none \["):
        load_trajectories(tmp_path, format="trex")


@pytest.mark.parametrize("keep", [0.3, 0.9])
def test_a_damaged_npz_is_refused(keep, tmp_path):
    path = trex(tmp_path, walk()) / "video_fish0.npz"
    content = path.read_bytes()
    path.write_bytes(content[: int(keep * len(content))])
    with pytest.raises(
        ValueError,
        match=r"be a whole npz file; got .* \[.*video_fish0.npz\]. The file may be cut off",
    ):
        load_trajectories(path)


def test_flipped_bytes_in_an_npz_are_found(tmp_path):
    path = trex(tmp_path, walk()) / "video_fish0.npz"
    content = bytearray(path.read_bytes())
    content[content.find(b"X#wcentroid") + 200] ^= 255
    path.write_bytes(content)
    with pytest.raises(ValueError, match="be a whole npz file; got Bad CRC-32"):
        load_trajectories(path)


@pytest.mark.parametrize(("place", "damaged"), [(128 + 0x48, 255), (128 + 4, 1 << 30)])
def test_an_element_of_no_type_in_a_file_of_matlab_is_refused_and_ends_no_process(
    tmp_path, place, damaged
):
    path = tmp_path / "trajectories.mat"
    savemat(path, {"trajectories": walk()})
    assert len(load_trajectories(path, **SAID["toxtrac"], y_axis="up").positions) == 12
    content = bytearray(path.read_bytes())
    content[place : place + 4] = damaged.to_bytes(4, "little")
    path.write_bytes(content)
    with pytest.raises(ValueError, match="be a whole npz or mat file; got type"):
        load_trajectories(path, **SAID["toxtrac"], y_axis="up")


def test_no_pickle_in_an_npz_is_opened(tmp_path):
    path = trex(tmp_path, walk(individuals=1), time=np.array([{}] * 12)) / "video_fish0.npz"
    with pytest.raises(ValueError, match="be a whole npz file; got Object arrays cannot be loaded"):
        load_trajectories(path)


def test_an_npz_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(_arrays, "MOST_BYTES", 1000)
    with pytest.raises(ValueError, match=r"unpack to at most 1000 bytes; got \d+ \["):
        load_trajectories(trex(tmp_path, walk()))


@pytest.mark.parametrize(
    ("of", "by"),
    [
        (b"PK\x05\x06", "size of the directory"),  # of no bytes: an archive without members
        (b"X#wcentroid.npy", "name"),  # of a member, in the directory alone
    ],
)
def test_a_track_whose_archive_has_a_damaged_directory_is_refused_and_not_left_out(
    tmp_path, of, by
):
    folder = WRITERS["trex"](tmp_path, walk(frames=8))
    file = folder / "video_fish0.npz"
    content = bytearray(file.read_bytes())
    at = content.rindex(of)
    if by == "name":
        content[at : at + 1] = b"Z"
    else:
        content[at + 12 : at + 16] = bytes(4)
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"must be a whole npz file; got .*video_fish0\.npz"):
        load_trajectories(folder)
