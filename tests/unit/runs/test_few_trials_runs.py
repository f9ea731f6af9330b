"""Runs that infer from a given number of trials: what they state, and that they are resumed to the same bits."""

import json
import math
import shutil

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.store import RunFolderError

SMALL = {
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "classifiers.population": 8,
    "run.threads": 1,
}


def inferred(out=None, **options):
    return tl.infer("aggregation", trials=90, seed=3, settings=SMALL, out=out, **options)


def drift(parameters, rng):
    """Walks whose speed is the first parameter; the second has no effect."""
    noise = rng.normal(0, 0.3, (len(parameters), 12, 1))
    return parameters[:, :1, None] + noise


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return inferred(tmp_path_factory.mktemp("runs") / "whole")


def test_a_run_spends_its_trials_and_states_them(whole):
    assert whole.complete
    assert whole.trials == 90
    content = json.loads((whole.path / "result.json").read_text())
    assert content["trials"] == 90
    assert set(content["interval"]) == set(whole.estimate)
    assert all(math.isfinite(value) for value in whole.estimate.values())
    assert (whole.path / "report.html").exists()


def test_the_history_has_a_row_for_each_batch(whole):
    history = whole.history
    assert history.sizes["generation"] == whole.generations
    assert history["typical_model"].to_numpy()[-1].tolist() == pytest.approx(list(whole.estimate.values()))


def test_a_stopped_run_is_resumed_to_the_same_bits(whole, tmp_path):
    stopped = inferred(tmp_path / "run", should_stop=lambda: True)
    assert (stopped.complete, stopped.generations) == (False, 1)
    assert all(math.isnan(end) for ends in stopped.interval.values() for end in ends)
    resumed = tl.resume(tmp_path / "run")
    assert resumed.estimate == whole.estimate
    assert repr(resumed.interval) == repr(whole.interval)
    for name in sorted(path.name for path in (whole.path / "buffer").iterdir()):
        one, other = (np.load(folder / "buffer" / name) for folder in (whole.path, tmp_path / "run"))
        assert all(np.array_equal(one[key], other[key]) for key in one.files)


def test_a_stored_run_is_opened_as_it_ended(whole):
    assert tl.load_run(whole.path) == whole
    assert tl.resume(whole.path) == whole


def test_a_custom_system_is_inferred_from_few_trials_of_its_simulator():
    rng = np.random.default_rng(1)
    genuine = drift(np.full((60, 2), 7.0), rng)
    calls = []

    def simulate(parameters, rng):
        calls.append(len(parameters))
        return drift(parameters, rng)

    ranges = {"speed": (0.0, 20.0), "inert": (0.0, 20.0)}
    result = tl.infer(
        genuine=genuine, simulate=simulate, parameters=ranges, trials=200, seed=1, settings={"run.threads": 1}
    )
    assert sum(calls) >= 200
    assert result.trials == 200
    assert result.estimate["speed"] == pytest.approx(7.0, abs=0.5)


def test_trials_and_generations_are_not_given_together():
    with pytest.raises(ConfigurationError, match=r"`trials` must be given without `generations`; got 100 beside 5\."):
        tl.infer("aggregation", trials=100, generations=5)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"run.trials": 5}, r"`run\.trials` must be 0, or at least 20; got 5"),
        ({"run.trials": 100, "models.hidden": 3}, r"`run\.trials` must be 0 where models are networks"),
    ],
)
def test_trials_that_cannot_be_are_rejected(settings, message):
    with pytest.raises(ConfigurationError, match=message):
        tl.infer("aggregation", settings=settings)


def test_a_run_of_generations_states_its_trials_too():
    result = tl.infer("aggregation", generations=2, settings={**SMALL, "models.population": 6})
    assert result.trials == 12


def test_runs_of_trials_are_neither_checked_nor_pooled_yet(whole):
    with pytest.raises(
        ConfigurationError, match=r"`run` must be one of generations, to be checked; got one of 90 trials"
    ):
        whole.check()
    other = inferred(None)
    with pytest.raises(ConfigurationError, match="`runs` must be"):
        tl.pool([whole, other])


def test_a_history_that_is_shorter_than_the_result_is_not_shown(whole, tmp_path):
    path = shutil.copytree(whole.path, tmp_path / "run")
    max((path / "checkpoints").iterdir()).unlink()
    result = tl.load_run(path)
    assert result.estimate == whole.estimate
    with pytest.raises(RunFolderError, match=r"its last checkpoint as it was written; got .*generations is left"):
        _ = result.history
