"""Files that other programs have written themselves, see data/write.py: exact positions, whoever is in which file."""

from pathlib import Path

import numpy as np
import pytest

from turing_learning.trajectories import load_trajectories

WRITTEN = Path(__file__).parent / "data" / "written"
POINT = {"keypoint": "thorax"}
PIXELS = {"pixels_per_cm": 10, "y_axis": "down"}
SAID = {
    "sleap-io.analysis.h5": POINT,
    "sleap-io.sleap.csv": POINT,
    "sleap-io.dlc.csv": POINT,
    "sleap-io.points.csv": POINT,
    "sleap-io.instances.csv": POINT,
    "movement.nc": POINT,
    "movement.sleap.h5": POINT,
    "movement.dlc.csv": POINT,
    "movement.dlc.h5": POINT,
    "movement.lp_a.csv": POINT,
    "trackpy.csv": {},
    "trackpy.de.csv": {},
    "scipy.mat": {},
    "numpy.npz": {},
    "positions.npy": {},
    "movement.via.csv": {},
    "sleap-io.coco.json": POINT,
    "sleap-io.slp": POINT,
    "movement.nwb": POINT,
    "pynwb.nwb": {"pixels_per_cm": None},
}
"""File -> what the user has to say beside scale, rate and direction of y."""


@pytest.mark.parametrize("name", SAID)
def test_what_other_programs_write_is_read_exactly(name):
    read = load_trajectories(WRITTEN / name, fps=25, **{**PIXELS, **SAID[name]})
    positions = np.load(WRITTEN / "positions.npy")
    if name in ("movement.lp_a.csv", "movement.nwb", "pynwb.nwb"):  # a file for each individual
        positions = positions[:, :1]
    missing = np.isnan(positions[..., 0])
    np.testing.assert_array_equal(read.present, ~missing)
    expected = positions * [1, -1] / 10
    np.testing.assert_allclose(read.positions[~missing], expected[~missing], rtol=1e-12)
    assert read.fps == 25
    if name == "sleap-io.dlc.csv":  # it leaves the likelihood empty
        assert read.confidence is None


def test_every_written_file_is_read():
    files = {file.name for file in WRITTEN.iterdir()}
    assert files - {"movement.lp_b.csv"} == set(SAID)


def test_arrays_with_individuals_first_are_refused():
    rng = np.random.default_rng(0)
    paths = 100 * np.arange(1, 6)[:, None, None] + np.cumsum(rng.normal(size=(5, 40, 2)), axis=1)
    with pytest.raises(ValueError, match=r"frames before individuals; got \(5, 40, 2\)"):
        load_trajectories(paths, fps=25, **PIXELS)
    assert load_trajectories(paths.transpose(1, 0, 2), fps=25, **PIXELS).positions.shape[0] == 40


def test_archives_of_several_arrays_have_to_name_one(tmp_path):
    positions = np.load(WRITTEN / "positions.npy")
    np.savez(tmp_path / "a.npz", first=positions, second=positions)
    with pytest.raises(ValueError, match=r"hold one array of positions .*'first': \(12, 2, 2\)"):
        load_trajectories(tmp_path / "a.npz", fps=25, **PIXELS)
