import json
import shutil

import numpy as np
import pytest

from turing_learning.runs import TIMINGS, infer, load_run, resume, start


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


@pytest.fixture(scope="module")
def pair(small, tmp_path_factory):
    """The same run with both histories."""
    folder = tmp_path_factory.mktemp("histories")
    for history in ("full", "thin"):
        start(small(history=history), folder / history)
    return folder


def test_a_thin_run_infers_the_same(pair):
    assert untimed(pair / "thin") == untimed(pair / "full")


def test_a_thin_run_keeps_no_populations_no_figures_and_no_state(pair):
    assert sorted(path.name for path in (pair / "thin").iterdir()) == [
        "checkpoints", "config.toml", "lock", "manifest.json", "result.json", "seals.txt"
    ]  # fmt: skip
    (checkpoint,) = (pair / "thin" / "checkpoints").iterdir()
    with np.load(checkpoint, allow_pickle=False) as arrays:
        assert not [name for name in arrays.files if name.startswith("coevolution/")]


def test_a_thin_history_has_the_models_and_quartiles_of_the_fitness(pair):
    thin, full = load_run(pair / "thin").history, load_run(pair / "full").history
    for name in ("best_model", "typical_model", "selection"):
        np.testing.assert_array_equal(thin[name], full[name])
    for population in ("model", "classifier"):
        expected = np.quantile(full[f"{population}_fitness"], (0, 0.25, 0.5, 0.75, 1), axis=1).T
        np.testing.assert_allclose(
            thin[f"{population}_fitness_quantiles"], expected, rtol=0, atol=1e-12
        )
    assert thin["quantile"].to_numpy().tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert thin["selection"].attrs == full["selection"].attrs


@pytest.mark.parametrize("kind", ["thin", "full"])
def test_a_report_is_given_the_history_without_the_populations(pair, kind):
    result = load_run(pair / kind)
    series = result.stored().series()
    history = result.history.drop_vars(["model", "classifier"], errors="ignore")
    assert set(series) == set(history.data_vars)
    for name, values in series.items():
        np.testing.assert_array_equal(values, history[name])


def test_a_thin_run_can_be_reported_on_demand(pair, tmp_path):
    page = load_run(pair / "thin").report(tmp_path / "page.html").read_text()
    assert "Fitness over generations" in page
    assert "Step sizes over generations" not in page


def test_a_stopped_thin_run_goes_on_to_the_same_result(pair, small, tmp_path, stop_after):
    start(small(history="thin"), tmp_path / "run", should_stop=stop_after(4))
    assert len(load_run(tmp_path / "run").history["generation"]) == 4
    resume(tmp_path / "run")
    assert untimed(tmp_path / "run") == untimed(pair / "thin")
    assert resume(tmp_path / "run").complete


def test_a_finished_thin_run_survives_the_loss_of_its_result(pair, tmp_path):
    shutil.copytree(pair / "thin", tmp_path / "run")
    (tmp_path / "run" / "result.json").unlink()
    assert load_run(tmp_path / "run").estimate == load_run(pair / "thin").estimate


def test_a_thin_history_is_there_in_memory_too(small):
    result = infer(config=small(history="thin"))
    assert set(result.stored().series()) == set(result.history)
    assert set(result.history) == {
        "best_model", "typical_model", "selection", "model_fitness_quantiles", "classifier_fitness_quantiles"
    }  # fmt: skip
