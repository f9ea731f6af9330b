import numpy as np
import pytest
import xarray as xr

from turing_learning.runs._history import (
    FULL,
    HistoryRecorder,
    Layout,
    create_store,
    damaged_generations,
    dataset_in_memory,
    dataset_on_disk,
    intact,
    memory_arrays,
    open_store,
    require_sound,
)
from turing_learning.store import DamagedError

LAYOUT = Layout(generations=10, models=3, parameters=("a", "b"), classifiers=4, weights=5, chunk=4)


def values(number):
    rng = np.random.default_rng(number)
    made = {}
    for name, (_, kind, _) in FULL.items():
        shape = LAYOUT.shape(name)
        made[name] = (
            np.array(number % 3, np.int8) if kind == "<i1" else rng.random(shape).astype(kind)
        )
    return made


def record(recorder, start, stop):
    for number in range(start, stop):
        recorder.record(values(number))


def assert_holds(dataset, generations):
    for number in range(generations):
        for name, value in values(number).items():
            np.testing.assert_array_equal(dataset[name].to_numpy()[number], value, err_msg=name)


def test_a_history_on_disk_opens_with_one_call_of_xarray(tmp_path):
    path = tmp_path / "history.zarr"
    record(HistoryRecorder(LAYOUT, create_store(path, LAYOUT)), 0, 8)
    dataset = xr.open_zarr(path)
    assert dict(dataset.sizes) == {
        "generation": 10, "individual": 3, "parameter": 2, "classifier_individual": 4, "weight": 5,
    }  # fmt: skip
    assert list(dataset["parameter"].to_numpy()) == ["a", "b"]
    assert dataset["generation"].to_numpy().tolist() == list(range(10))
    assert_holds(dataset, 8)


def test_generations_that_have_not_been_run_are_marked(tmp_path):
    path = tmp_path / "history.zarr"
    record(HistoryRecorder(LAYOUT, create_store(path, LAYOUT)), 0, 4)
    dataset = xr.open_zarr(path)
    assert np.isnan(dataset["model"].to_numpy()[4:]).all()
    assert (dataset["selection"].to_numpy()[4:] == -1).all()
    assert dataset["selection"].attrs["flag_meanings"] == "not_run active all_accepted all_rejected"


def test_a_history_that_is_flushed_and_opened_in_mid_chunk_goes_on(tmp_path):
    path = tmp_path / "history.zarr"
    recorder = HistoryRecorder(LAYOUT, create_store(path, LAYOUT))
    record(recorder, 0, 6)
    recorder.flush()
    recorder = HistoryRecorder(LAYOUT, open_store(path), recorder.seals())
    assert recorder.seals()["stops"].tolist() == [4, 6]
    record(recorder, 6, 10)
    recorder.flush()
    assert_holds(dataset_on_disk(path, 10), 10)


def test_a_history_in_memory_is_the_same(tmp_path):
    arrays = memory_arrays(LAYOUT)
    recorder = HistoryRecorder(LAYOUT, arrays)
    record(recorder, 0, 7)
    recorder.flush()
    dataset = dataset_in_memory(arrays, LAYOUT.parameters, 7)
    assert dataset.sizes["generation"] == 7
    assert_holds(dataset, 7)


def test_a_history_knows_how_far_it_reaches(tmp_path):
    path = tmp_path / "history.zarr"
    recorder = HistoryRecorder(LAYOUT, create_store(path, LAYOUT))
    record(recorder, 0, 6)
    recorder.flush()
    assert intact(path, LAYOUT, 6, recorder.seals())
    assert not intact(path, LAYOUT, 8, recorder.seals())


@pytest.mark.parametrize("name", ["classifier/1.0.0", ".zgroup", ".zmetadata"])
def test_a_history_that_lacks_a_file_is_recognized(name, tmp_path):
    path = tmp_path / "history.zarr"
    recorder = HistoryRecorder(LAYOUT, create_store(path, LAYOUT))
    record(recorder, 0, 8)
    (path / name).unlink()
    assert not intact(path, LAYOUT, 8, recorder.seals())


def test_a_history_of_other_sizes_is_recognized(tmp_path):
    path = tmp_path / "history.zarr"
    seals = HistoryRecorder(LAYOUT, create_store(path, LAYOUT)).seals()
    other = Layout(
        generations=10, models=4, parameters=("a", "b"), classifiers=4, weights=5, chunk=4
    )
    assert intact(path, LAYOUT, 0, seals)
    assert not intact(path, other, 0, seals)
    assert not intact(tmp_path / "missing.zarr", LAYOUT, 0, seals)


def test_a_chunk_of_zeros_is_kept_as_a_file(tmp_path):
    path = tmp_path / "history.zarr"
    recorder = HistoryRecorder(LAYOUT, create_store(path, LAYOUT))
    for number in range(LAYOUT.generations):
        recorder.record(values(number) | {"selection": np.array(0, np.int8)})
    recorder.flush()
    assert (path / "selection" / "0").exists()
    assert intact(path, LAYOUT, LAYOUT.generations, recorder.seals())


@pytest.fixture
def flushed(tmp_path):
    """A history of six generations, flushed after the fourth and the sixth, and its seals."""
    path = tmp_path / "history.zarr"
    recorder = HistoryRecorder(LAYOUT, create_store(path, LAYOUT))
    record(recorder, 0, 6)
    recorder.flush()
    return path, recorder.seals()


@pytest.mark.parametrize("name", ["model/1.0.0", "selection/1"])
def test_a_damaged_chunk_is_written_over_also_by_part_of_its_generations(name, flushed):
    path, seals = flushed
    (path / name).write_bytes(b"")
    recorder = HistoryRecorder(
        LAYOUT, open_store(path), {name: each[:1] for name, each in seals.items()}
    )
    record(recorder, 4, 5)
    recorder.flush()
    assert intact(path, LAYOUT, 5, recorder.seals())
    dataset = xr.open_zarr(path)
    assert_holds(dataset, 5)
    assert np.isnan(dataset["model"].to_numpy()[5:]).all()
    assert (dataset["selection"].to_numpy()[5:] == -1).all()


def test_a_history_that_was_not_touched_is_intact(flushed):
    path, seals = flushed
    assert intact(path, LAYOUT, 6, seals)
    record(HistoryRecorder(LAYOUT, open_store(path), seals), 6, 8)  # a later block changes nothing
    assert intact(path, LAYOUT, 6, seals)


def test_seals_of_other_generations_do_not_fit(flushed):
    path, seals = flushed
    assert not intact(path, LAYOUT, 4, seals)
    assert not intact(path, LAYOUT, 0, seals)


def test_damage_names_its_generations_and_other_coordinates_are_no_history_of_the_run(flushed):
    path, seals = flushed
    content = (path / "model" / "0.0.0").read_bytes()
    (path / "model" / "0.0.0").write_bytes(altered(content))
    assert damaged_generations(path, LAYOUT, 6, seals) == [(0, 4)]
    with pytest.raises(
        DamagedError, match=r"as it was written; got damage in generations 0 to 3 \["
    ):
        require_sound(path, LAYOUT, 6, seals)
    (path / "model" / "0.0.0").write_bytes(content)
    require_sound(path, LAYOUT, 6, seals)
    (path / "parameter" / "0").write_bytes((path / "parameter" / "0").read_bytes()[::-1])
    assert damaged_generations(path, LAYOUT, 6, seals) is None
    with pytest.raises(DamagedError, match="got files that cannot be read, or of another run"):
        require_sound(path, LAYOUT, 6, seals)


def altered(content):
    return bytes([content[0] ^ 1]) + content[1:]


@pytest.mark.parametrize("damage", [lambda content: content[:-1], lambda content: b"", altered])
@pytest.mark.parametrize("name", ["model/0.0.0", "classifier_step_size/1.0.0", "selection/0"])
def test_a_chunk_that_is_cut_short_or_altered_is_recognized(name, damage, flushed):
    path, seals = flushed
    (path / name).write_bytes(damage((path / name).read_bytes()))
    assert not intact(path, LAYOUT, 6, seals)
