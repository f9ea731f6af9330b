"""What a run costs on the disk however long it is, and what is said of one that is resumed elsewhere."""

import json
import logging

import numpy as np
import pytest

from turing_learning.runs import RunFolder, load_run, resume, start
from turing_learning.runs import _folder as folders
from turing_learning.runs._history import Layout, create_store


def layout(generations, chunk=20):
    return Layout(generations, models=2, parameters=("a",), classifiers=2, weights=3, chunk=chunk)


def test_a_history_of_a_million_generations_begins_with_few_files(tmp_path):
    arrays = create_store(tmp_path / "history.zarr", layout(1_000_000))
    assert sum(path.is_file() for path in (tmp_path / "history.zarr").rglob("*")) < 150
    assert arrays["selection"][-1] == -1
    assert arrays["selection"].chunks[0] % 20 == 0


def test_the_history_of_a_usual_run_has_the_files_that_it_always_had(tmp_path):
    arrays = create_store(tmp_path / "history.zarr", layout(1000))
    assert arrays["selection"].chunks == arrays["best_model"].chunks[:1] == (20,)


@pytest.fixture
def blocks(monkeypatch):
    """Blocks of four generations."""
    monkeypatch.setattr(folders, "BLOCK_GENERATIONS", 4)


def stored(path):
    with np.load(max((path / "checkpoints").iterdir()), allow_pickle=False) as arrays:
        return len(arrays["traces/seconds"])


def test_a_checkpoint_holds_the_traces_since_the_last_block_alone(
    blocks, small, tmp_path, stop_after
):
    usual = start(small(history="thin"), tmp_path / "usual")
    path = tmp_path / "run"
    start(small(history="thin"), path, should_stop=stop_after(5))
    assert stored(path) == 1
    assert [file.name for file in (path / "traces").iterdir()] == ["00001.npz"]
    assert len(load_run(path).history["generation"]) == 5
    assert resume(path).estimate == usual.estimate
    assert stored(path) < 4
    for name in ("typical_model", "model_fitness_quantiles", "selection"):
        np.testing.assert_array_equal(load_run(path).history[name], usual.history[name])
    assert RunFolder(path).traces()["best_model"].shape[0] == usual.generations


def test_a_run_that_is_resumed_with_other_packages_says_so_and_records_it(
    small, tmp_path, stop_after, caplog
):
    start(small(), tmp_path / "run", should_stop=stop_after(2))
    folder = RunFolder(tmp_path / "run")
    folder.update_manifest(versions=folder.manifest()["versions"] | {"numpy": "1.0"})
    with caplog.at_level(logging.WARNING, "turing_learning"):
        resume(tmp_path / "run", should_stop=stop_after(1))
        assert caplog.text.count("was run with numpy 1.0, now") == 1
        resume(tmp_path / "run")
    assert caplog.text.count("was run with") == 1
    (entry,) = json.loads((tmp_path / "run" / "manifest.json").read_text())["resumed"]
    assert entry["versions"]["numpy"] == np.__version__


@pytest.mark.parametrize("version", [0, -1, True])
def test_a_folder_of_no_known_format_is_rejected(small, tmp_path, version):
    from turing_learning.runs import RunFolderError

    start(small(), tmp_path / "run")
    path = tmp_path / "run" / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"format_version": version}))
    with pytest.raises(RunFolderError, match=r"format_version|run folder"):
        load_run(tmp_path / "run")
