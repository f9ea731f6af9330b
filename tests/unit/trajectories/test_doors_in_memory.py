"""Tables of pandas, and files of DeepLabCut, movement and others that hold more than their size says."""

import pickle
import zipfile
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest
from tracker_files import (
    SAID,
    deeplabcut_h5,
    expected,
    idtracker_ai_h5,
    movement,
    sleap,
    tidy,
    trex,
    walk,
)

from turing_learning.trajectories import Trajectories, load_trajectories

DATA = Path(__file__).parent / "data"
SAY = {"fps": 25, "pixels_per_cm": 10, "y_axis": "down"}


@pytest.mark.parametrize("name", ["deeplabcut_table.h5", "deeplabcut_fixed.h5", "movement.nc"])
def test_files_that_pandas_and_h5netcdf_wrote_are_read(name):
    said = SAID["movement" if name == "movement.nc" else "deeplabcut-h5"]
    read = load_trajectories(DATA / name, **said)
    np.testing.assert_allclose(read.positions, expected("", walk()), atol=1e-12)
    assert read.individuals == (
        ("a", "b", "c") if name == "movement.nc" else ("mouse1", "mouse2", "mouse3")
    )
    assert set(np.unique(read.confidence[read.present])) <= {0.5, 0.95}
    with pytest.raises(ValueError, match="`keypoint` must be one of thorax, head; got None"):
        load_trajectories(DATA / name, **said | {"keypoint": None})


def test_long_tables_are_read_as_files_are(tmp_path):
    path = tidy(tmp_path, walk())
    read = load_trajectories(pd.read_csv(path).sample(frac=1, random_state=1), **SAY)
    np.testing.assert_array_equal(read.positions, load_trajectories(path, **SAY).positions)
    assert read.format == "pandas"
    indexed = pd.read_csv(path).set_index(["frame", "id"])
    np.testing.assert_array_equal(load_trajectories(indexed, **SAY).positions, read.positions)


@pytest.mark.parametrize("columns", ["x{0}", "fish{0}_x", "two levels"])
def test_wide_tables_are_read(columns, tmp_path):
    positions = walk()
    table = pd.DataFrame(positions.reshape(12, 6))
    if columns == "two levels":
        table.columns = pd.MultiIndex.from_product([["1", "2", "3"], ["x", "y"]])
    else:
        table.columns = [columns.format(k).replace("x", axis) for k in (1, 2, 3) for axis in "xy"]
    read = load_trajectories(table, **SAY)
    np.testing.assert_allclose(read.positions, expected("", positions))
    when = ("time", "") if columns == "two levels" else "time"
    table_with_times = table.copy()
    table_with_times[when] = np.arange(12) / 25
    timed = load_trajectories(table_with_times, **SAY | {"fps": None})
    np.testing.assert_array_equal(timed.positions, read.positions)
    assert timed.fps == 25
    assert load_trajectories(table.set_axis(np.arange(5, 17)), **SAY).first_frame == 5
    with pytest.raises(ValueError, match="`y_axis` must be given"):
        load_trajectories(table, fps=25, pixels_per_cm=1)
    if columns == "fish{0}_x":
        table_with_times.to_csv(tmp_path / "fish.csv", index=False)
        stored = load_trajectories(tmp_path / "fish.csv", **SAY | {"fps": None})
        np.testing.assert_array_equal(stored.positions, read.positions)
        assert (stored.format, stored.individuals, stored.fps) == ("tidy", read.individuals, 25)


def test_tables_of_deeplabcut_are_read(tmp_path):
    labels = [
        ("net", name, part, what)
        for name in "ab"
        for part in ("nose", "tail")
        for what in ("x", "y", "likelihood")
    ]
    values = np.arange(36.0).reshape(3, 12)
    table = pd.DataFrame(values, columns=pd.MultiIndex.from_tuples(labels), index=[4, 5, 6])
    read = load_trajectories(table, **SAY, keypoint="tail")
    assert (read.individuals, read.first_frame) == (("a", "b"), 4)
    np.testing.assert_allclose(read.positions[:, 1], values[:, 9:11] * [0.1, -0.1])
    np.testing.assert_array_equal(read.confidence[:, 0], values[:, 5])


@pytest.mark.parametrize("unit", ["cm", "px"])
def test_a_recording_survives_the_way_to_pandas_and_back(unit):
    positions = np.nan_to_num(walk())
    present = ~np.isnan(walk()[..., 0])
    before = Trajectories(
        positions,
        present,
        25.0,
        ("a", "b", "c"),
        unit=unit,
        first_frame=7,
        headings=np.where(present, 0.5, 0.0),
    )
    after = load_trajectories(before.to_dataframe())
    for name in ("positions", "present", "headings"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    assert (after.unit, after.first_frame, after.fps) == (unit, 7, 25)


def test_attributes_that_are_wrong_are_refused():
    table = load_trajectories(DATA / "movement.nc", **SAID["movement"]).to_pandas()
    for name, value, message in (
        ("fps", "fast", "state a frame rate above 0; got 'fast'"),
        ("unit", "mm", "be one that is known; got 'mm'"),
        ("y_axis", ["up"], r"be one that is known; got \['up'\]"),
    ):
        changed = table.copy()
        changed.attrs = table.attrs | {name: value}
        with pytest.raises(ValueError, match=message):
            load_trajectories(changed)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            pd.DataFrame({"frame": [], "x": [], "y": []}),
            r"have at least one row; got none \[DataFrame\]",
        ),
        (
            pd.DataFrame({"frame": [0], "x": ["one"], "y": [2]}),
            r"finite numbers or NaN; got 'one' \[DataFrame, row 0\]",
        ),
        (
            pd.DataFrame({"frame": [0, 1], "x": [1, 1], "y": [2, np.inf]}),
            r"finite numbers or NaN; got .*inf.* \[DataFrame, row 1\]",
        ),
        (
            pd.DataFrame({"frame": [0], "x1": [1.0], "z": [2.0]}),
            r"have the columns frame or time, and x and y of each .*'z' \[",
        ),
        (
            pd.DataFrame({"frame": [0, 2], "x1": [1, 1], "y1": [2, 2]}),
            "have frame numbers that follow without a break; got 2",
        ),
    ],
)
def test_a_table_that_is_wrong_is_refused_with_its_row(table, message):
    with pytest.raises(ValueError, match="`path` must .*" + message):
        load_trajectories(table, **SAY)


def test_a_pickle_in_a_table_of_deeplabcut_that_calls_anything_is_not_opened(tmp_path):
    path = deeplabcut_h5(tmp_path, walk())
    with h5py.File(path, "a") as file:
        file["df_with_missing/table"].attrs["values_block_0_kind"] = np.bytes_(
            pickle.dumps([np.float64], protocol=0)
        )
    with pytest.raises(
        ValueError, match=r"be a whole HDF5 file; got a pickle that calls numpy\.float64"
    ):
        load_trajectories(path, **SAID["deeplabcut-h5"])


def test_a_name_that_a_table_of_pandas_does_not_have_is_damage(tmp_path):
    path = tmp_path / "fixed.h5"
    path.write_bytes((DATA / "deeplabcut_fixed.h5").read_bytes())
    with h5py.File(path, "a") as file:
        table = next(each for each in file.values() if "pandas_type" in each.attrs)
        table["block0_items_label1"][0] = 99
    with pytest.raises(
        ValueError, match=r"be a whole HDF5 file; got list index out of range \[.*fixed\.h5\]"
    ):
        load_trajectories(path, **SAID["deeplabcut-h5"])


@pytest.mark.parametrize("write", [idtracker_ai_h5, sleap], ids=["idtracker.ai", "sleap"])
def test_an_hdf5_file_of_zeros_is_refused_before_it_fills_the_memory(write, tmp_path):
    path = write(tmp_path, walk())
    with h5py.File(path, "a") as file:
        name = "trajectories" if "trajectories" in file else "tracks"
        shape = (2_000_000, 30, 2) if name == "trajectories" else (3, 2, 2, 8_000_000)
        del file[name]
        file.create_dataset(name, shape=shape, dtype="f8", compression="gzip")
    with pytest.raises(ValueError, match=r"must unpack to at most 67108864 bytes; got \d{9} \["):
        load_trajectories(path, **SAID["sleap" if name == "tracks" else "idtracker.ai-h5"])


def test_an_archive_that_unpacks_to_much_more_than_it_is_is_refused(tmp_path):
    path = trex(tmp_path, walk()) / "video_fish0.npz"
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive,
        archive.open("posture.npy", "w") as file,
    ):
        for _ in range(80):
            file.write(bytes(1_000_000))
    with pytest.raises(ValueError, match=r"must unpack to at most 67108864 bytes; got 8\d{7} \["):
        load_trajectories(path)


@pytest.mark.parametrize("kind", ["link", "external", "virtual"])
def test_data_in_another_file_is_not_followed(kind, tmp_path):
    (tmp_path / "other").mkdir()
    other, path = idtracker_ai_h5(tmp_path / "other", walk()), tmp_path / "file.h5"
    with h5py.File(path, "w") as file:
        if kind == "link":
            file["trajectories"] = h5py.ExternalLink(str(other), "trajectories")
        elif kind == "external":
            where = [(str(tmp_path / "raw"), 0, 8 * 12 * 6)]
            file.create_dataset("trajectories", shape=(12, 3, 2), dtype="f8", external=where)
        else:
            layout = h5py.VirtualLayout(shape=(12, 3, 2), dtype="f8")
            layout[:] = h5py.VirtualSource(str(other), "trajectories", shape=(12, 3, 2))
            file.create_virtual_dataset("trajectories", layout)
    with pytest.raises(
        ValueError,
        match=r"must hold its data itself; got a link to another file \[.*file.h5, trajectories\]",
    ):
        load_trajectories(path, **SAY)


def test_dimensions_of_movement_may_be_in_the_singular(tmp_path):
    import xarray as xr

    with xr.open_dataset(movement(tmp_path, walk()), engine="scipy") as opened:
        dataset = opened.load().rename(individuals="individual", keypoints="keypoint")
    read = load_trajectories(dataset, pixels_per_cm=10, y_axis="down", keypoint="thorax")
    np.testing.assert_allclose(read.positions, expected("", walk()))
