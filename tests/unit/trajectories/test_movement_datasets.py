import numpy as np
import pytest
from tracker_files import SAID, sleap, tidy, walk

from turing_learning.trajectories import Trajectories, from_xarray, load_trajectories


@pytest.fixture
def recording(tmp_path):
    return load_trajectories(sleap(tmp_path, walk()), **SAID["sleap"])


def test_a_dataset_has_the_dimensions_and_attributes_of_movement(recording):
    dataset = recording.to_xarray()
    assert dataset["position"].dims == ("time", "space", "keypoints", "individuals")
    assert dataset["confidence"].dims == ("time", "keypoints", "individuals")
    assert list(dataset["space"].values) == ["x", "y"]
    assert list(dataset["individuals"].values) == ["track_0", "track_1", "track_2"]
    assert {
        "fps": 25.0,
        "time_unit": "seconds",
        "ds_type": "poses",
        "source_software": "sleap",
    }.items() <= dataset.attrs.items()
    np.testing.assert_allclose(dataset["time"], np.arange(12) / 25)


def test_missing_positions_are_nan_in_a_dataset(recording):
    missing = np.isnan(recording.to_xarray()["position"].values[:, 0, 0])
    np.testing.assert_array_equal(missing, ~recording.present)


def test_a_recording_survives_the_way_to_xarray_and_back(recording):
    back = from_xarray(recording.to_xarray())
    for name in ("positions", "present", "confidence"):
        np.testing.assert_array_equal(getattr(back, name), getattr(recording, name))
    for name in ("fps", "unit", "individuals", "first_frame", "source", "format"):
        assert getattr(back, name) == getattr(recording, name)


def test_headings_first_frame_and_pixels_survive_too():
    positions = walk(missing=0)
    before = Trajectories(
        positions,
        np.ones((12, 3), bool),
        25.0,
        ("a", "b", "c"),
        unit="px",
        first_frame=7,
        headings=positions[..., 0],
    )
    after = from_xarray(before.to_xarray())
    np.testing.assert_array_equal(after.headings, before.headings)
    assert (after.unit, after.first_frame) == ("px", 7)


def test_a_dataset_of_movement_itself_needs_scale_and_direction(recording):
    foreign = recording.to_xarray()
    for name in ("length_unit", "y_axis"):
        del foreign.attrs[name]
    with pytest.raises(ValueError, match="`pixels_per_cm` must be given; got none"):
        from_xarray(foreign, y_axis="down")
    with pytest.raises(ValueError, match="`y_axis` must be given; got none"):
        from_xarray(foreign, pixels_per_cm=10)
    read = from_xarray(foreign, pixels_per_cm=10, y_axis="down")
    np.testing.assert_allclose(read.positions, recording.positions * [0.1, -0.1])


def test_order_of_dimensions_and_key_points_do_not_matter(recording):
    dataset = recording.to_xarray()
    plain = dataset.squeeze("keypoints", drop=True).transpose("individuals", "space", "time")
    np.testing.assert_array_equal(from_xarray(plain).positions, recording.positions)
    with pytest.raises(
        ValueError, match="`keypoint` must be left out for a dataset without key points; got 'tail'"
    ):
        from_xarray(plain, keypoint="tail")


def test_the_key_point_of_a_dataset_is_never_guessed(recording):
    import xarray as xr

    one = recording.to_xarray()
    two = xr.concat([one, one.assign_coords(keypoints=["tail"])], dim="keypoints")
    with pytest.raises(
        ValueError, match=r"`keypoint` must be one of centroid, tail; got None \[dataset\]"
    ):
        from_xarray(two)
    np.testing.assert_array_equal(from_xarray(two, keypoint="tail").positions, recording.positions)


def test_a_dataset_without_positions_is_refused(recording):
    with pytest.raises(ValueError, match=r"`dataset` must have `position` \('time', .*; got \{"):
        from_xarray(recording.to_xarray().drop_vars("position"))


def test_a_dataset_in_three_dimensions_is_refused(recording):
    with pytest.raises(ValueError, match="`dataset` must have the coordinates x, y in space; got"):
        from_xarray(recording.to_xarray().assign_coords(space=["y", "z"]))


def test_uneven_times_are_refused(recording):
    with pytest.raises(
        ValueError, match="`dataset` must have evenly spaced times as numbers; got others"
    ):
        from_xarray(recording.to_xarray().isel(time=[0, 1, 5]))


@pytest.mark.parametrize(
    "change",
    [
        lambda dataset: dataset.isel(time=slice(None, None, 3)),
        lambda dataset: dataset.coarsen(time=3, boundary="trim").mean(),
        lambda dataset: dataset.interp(time=np.arange(4) * 0.12),
    ],
)
def test_times_that_contradict_the_frame_rate_are_refused_until_it_is_said(change, recording):
    changed = change(recording.to_xarray())
    message = r"must have the same frame rate in its times, 8\.3333, and in its attribute fps; got 25\. .* give fps=8\.3333;"
    with pytest.raises(ValueError, match=message):
        from_xarray(changed)
    with pytest.raises(ValueError, match=r"`fps` must be what the file states, 8\.3333; got 25"):
        from_xarray(changed, fps=25)
    assert from_xarray(changed, fps=8.3333).fps == 8.3333


def test_a_frame_rate_that_contradicts_the_times_is_refused(recording):
    bare = recording.to_xarray().drop_attrs()
    said = {"pixels_per_cm": 1, "y_axis": "up"}
    with pytest.raises(ValueError, match=r"`fps` must be what the file states, 25\.0; got 30"):
        from_xarray(bare, fps=30, **said)
    assert from_xarray(bare, **said).fps == 25


def test_the_first_frame_is_that_of_the_times(recording):
    dataset = recording.to_xarray()
    assert from_xarray(dataset.sel(time=slice(0.2, None))).first_frame == 5
    assert from_xarray(dataset.isel(time=[5])).first_frame == 5


def test_times_may_count_frames(recording):
    dataset = (
        recording.to_xarray().assign_coords(time=np.arange(12) + 3).assign_attrs(time_unit="frames")
    )
    assert (from_xarray(dataset).fps, from_xarray(dataset).first_frame) == (25, 3)
    unsaid = dataset.drop_attrs()
    assert from_xarray(unsaid, fps=25, pixels_per_cm=1, y_axis="up").first_frame == 3
    assert from_xarray(recording.to_xarray().drop_vars("time")).fps == 25
    with pytest.raises(
        ValueError,
        match=r"must have times one frame apart, as their unit is frames; got 3\. Number the",
    ):
        from_xarray(dataset.isel(time=slice(None, None, 3)))


def test_a_unit_of_time_that_is_unknown_is_refused(recording):
    with pytest.raises(
        ValueError, match="`time_unit` must be 'seconds' or 'frames' in `dataset`; got 'ms'"
    ):
        from_xarray(recording.to_xarray().assign_attrs(time_unit="ms"))


def test_a_direction_that_contradicts_the_dataset_is_refused(recording):
    with pytest.raises(
        ValueError,
        match="`y_axis` must be 'up' or 'down', as the dataset states; got 'down' and 'up'",
    ):
        from_xarray(recording.to_xarray(), y_axis="down")


def test_a_frame_rate_that_is_no_number_is_refused(recording):
    with pytest.raises(
        ValueError, match=r"state a frame rate above 0; got 'fast' \[dataset, fps\]"
    ):
        from_xarray(recording.to_xarray().assign_attrs(fps="fast"))


def test_a_recording_without_confidence_has_an_unknown_one_in_the_dataset_as_writers_want_it(
    tmp_path,
):
    dataset = load_trajectories(tidy(tmp_path, walk()), **SAID["tidy"]).to_xarray()
    assert np.isnan(dataset["confidence"]).all()
    assert from_xarray(dataset).confidence is None


def test_individuals_of_one_name_are_refused_with_the_file(recording):
    dataset = recording.to_xarray().assign_coords(individuals=["a", "b", "a"])
    with pytest.raises(
        ValueError, match=r"`individuals` must be 3 different names; got \('a', .*analysis\.h5\]"
    ):
        from_xarray(dataset)


def test_what_is_said_of_a_dataset_is_checked_and_holds(recording):
    dataset = recording.to_xarray()
    with pytest.raises(ValueError, match="`fps` must be a finite number of at least 1e-09"):
        from_xarray(dataset, fps=-1)
    with pytest.raises(
        ValueError, match=r"hold a position with confidence 0\.9 or more; got at most 0\.8"
    ):
        load_trajectories(dataset, min_confidence=0.9)
