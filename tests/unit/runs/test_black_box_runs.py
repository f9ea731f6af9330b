"""Runs whose models are networks, and runs with separated groups."""

import json

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError, with_settings
from turing_learning.models import ElmanModel
from turing_learning.runs import TIMINGS, RunFolder, resume, start

MODEL = ElmanModel(hidden=3)


def configured(small, **settings):
    return with_settings(
        small(), {"models.hidden": 3} | {key.replace("__", "."): v for key, v in settings.items()}
    )


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


@pytest.fixture(scope="module")
def whole(tmp_path_factory, small):
    """A finished run of networks that no test may change."""
    path = tmp_path_factory.mktemp("whole") / "run"
    start(configured(small), path)
    return path


def test_a_result_states_what_the_networks_do_beside_what_the_agents_do(whole):
    result = tl.load_run(whole)
    assert result.truth == {"vl0": -0.7, "vr0": -1.0, "vl1": 1.0, "vr1": -1.0}
    weights = np.array(list(result.networks["best_model"].values()))
    np.testing.assert_array_equal(list(result.best_model.values()), MODEL.described(weights))
    errors = np.abs(np.array(list(result.best_model.values())) - list(result.truth.values()))
    np.testing.assert_allclose(list(result.absolute_error.values()), errors)
    assert result.mae == pytest.approx(errors.mean())
    assert result.paper_absolute_error is None


def test_the_weights_are_named_and_are_those_of_the_last_generation(whole):
    result = tl.load_run(whole)
    assert tuple(result.networks["best_model"]) == MODEL.parameter_names
    assert result.history["best_model"].shape == (7, 23)
    np.testing.assert_array_equal(
        result.history["best_model"][-1], list(result.networks["best_model"].values())
    )


def test_the_estimate_is_a_median_of_outputs_and_its_network_the_typical_one_nearest_to_it(whole):
    result = tl.load_run(whole)
    typical = result.history["typical_model"].to_numpy()[-2:]  # the last 0.3 of 7 generations
    outputs = MODEL.described(typical)
    np.testing.assert_allclose(list(result.estimate.values()), np.median(outputs, axis=0))
    distances = np.abs(outputs - np.median(outputs, axis=0)).sum(axis=1)
    np.testing.assert_array_equal(
        list(result.networks["estimate"].values()), typical[np.argmin(distances)]
    )


def test_the_report_shows_outputs_and_not_weights(whole):
    page = (whole / "report.html").read_text()
    assert "Outputs of the networks after 20 steps of each constant sensor reading." in page
    assert "steady outputs of the networks" in page
    assert "left_bias" not in page
    names = {path.stem for path in (whole / "figures").iterdir()}
    assert names == {"parameters", "error", "fitness", "step-sizes"}


def test_networks_have_not_settled_after_a_few_generations(small):
    result = tl.infer(
        config=configured(small, run__generations=30, run__seed=2)
    )  # whose last nine wander about a place
    assert result.verdict == "still moving"


def test_a_run_of_networks_that_was_stopped_ends_as_one_that_was_not(
    whole, small, tmp_path, stop_after
):
    start(configured(small, run__history="thin"), tmp_path / "run", should_stop=stop_after(5))
    resume(tmp_path / "run")
    assert untimed(tmp_path / "run") == untimed(whole)


def test_a_run_of_networks_gives_the_same_bits_on_any_number_of_threads(whole, small):
    result = tl.infer(config=configured(small, run__threads=3, run__history="thin"))
    assert result.networks == tl.load_run(whole).networks


def test_the_observer_sees_outputs_beside_the_agents_parameters(small):
    seen = []
    tl.infer(config=configured(small), observer=seen.append)
    last = seen[-1]
    assert last.parameter_names == ("vl0", "vr0", "vl1", "vr1")
    assert last.generation.best_model.shape == (23,)
    np.testing.assert_array_equal(
        last.shown(last.generation.best_model), MODEL.described(last.generation.best_model)
    )
    assert last.outlook is not None


def test_results_of_reactive_models_have_no_networks(small, tmp_path):
    start(small(history="thin"), tmp_path / "run")
    assert "networks" not in untimed(tmp_path / "run")
    assert tl.load_run(tmp_path / "run").networks is None


def test_a_run_folder_remembers_what_its_models_are(whole):
    assert RunFolder(whole).configuration().models.hidden == 3


def test_networks_may_be_inferred_from_separated_groups(small, tmp_path, stop_after):
    configuration = configured(small, scenario__grouping="separated", run__history="thin")
    once = start(configuration, tmp_path / "once")
    start(configuration, tmp_path / "twice", should_stop=stop_after(2))
    assert resume(tmp_path / "twice").networks == once.networks


@pytest.mark.parametrize("hidden", [0, 3])
def test_separated_groups_are_judged_otherwise_than_mixed_ones(small, hidden):
    mixed, separated = (
        tl.infer(
            config=configured(
                small, models__hidden=hidden, scenario__grouping=grouping, run__history="thin"
            )
        ).history["model_fitness_quantiles"]
        for grouping in ("mixed", "separated")
    )
    assert (mixed != separated).any()


def test_networks_are_refused_for_a_system_of_ones_own():
    with pytest.raises(
        ConfigurationError, match=r"`models\.hidden` must be 0 for a custom system, .*got 2"
    ):
        tl.infer(
            genuine=np.random.default_rng(0).normal(size=(20, 5, 2)),
            simulate=lambda parameters, rng: np.zeros((len(parameters), 5, 2)),
            parameters={"speed": (0, 1)},
            settings={"models.hidden": 2},
        )
