"""Runs in which the field of view of the sensor is inferred too."""

import math

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError, load_configuration
from turing_learning.runs import load_run, resume

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.checkpoint_every": 3,
    "run.threads": 1,
}
NAMES = ["vl0", "vr0", "vl1", "vr1", "theta"]


def infer(**arguments):
    return tl.infer(
        "aggregation-field-of-view-60", generations=7, seed=2, settings=SMALL, **arguments
    )


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return infer(out=tmp_path_factory.mktemp("morphology") / "run")


def test_the_field_of_view_is_a_fifth_parameter_in_rad(result):
    assert list(result.estimate) == NAMES
    assert result.truth["theta"] == pytest.approx(math.pi / 3)
    assert 0 < result.best_model["theta"] < 2 * math.pi
    assert result.absolute_error["theta"] == pytest.approx(
        abs(result.best_model["theta"] - math.pi / 3)
    )
    assert result.paper_absolute_error is None  # 2 agents, observed for 1 s


def test_the_history_holds_parameters_not_genomes(result):
    theta = result.history["model"].sel(parameter="theta").to_numpy()
    assert theta.min() >= 0
    assert theta.max() <= 2 * math.pi
    # The first genomes are uniform in [-1, 1]: sig(1) 2 pi = 4.59
    assert theta[0].min() > 1.68
    assert theta[0].max() < 4.6


def test_report_and_figures_name_the_unit(result):
    assert "theta" in (result.path / "report.html").read_text()
    assert "theta (rad)" in (result.path / "figures" / "parameters.svg").read_text()


def test_a_run_that_was_stopped_goes_on_to_the_same_result(result, tmp_path, stop_after):
    infer(out=tmp_path / "run", should_stop=stop_after(4))
    resume(tmp_path / "run")
    assert load_run(tmp_path / "run").estimate == result.estimate


def test_a_line_of_sight_can_be_the_truth():
    result = tl.infer("aggregation-field-of-view-0", generations=2, seed=1, settings=SMALL)
    assert result.truth["theta"] == 0
    assert result.estimate_absolute_error["theta"] == result.estimate["theta"]


def test_an_interval_reaches_the_end_where_the_truth_is():
    result = tl.infer("aggregation-field-of-view-0", trials=300, seed=3)
    low, high = np.array(list(result.interval.values())).T
    truth = np.array([-0.7, -1, 1, -1, 0])
    assert ((low <= truth) & (truth <= high)).all()
    assert low[-1] == 0 < high[-1] < 0.2  # rad
    assert result.verdict == "at a bound"


def test_a_field_of_view_can_be_known_without_being_inferred():
    settings = SMALL | {"scenario.sensor.field_of_view": 1.0}
    result = tl.infer("aggregation", generations=2, seed=1, settings=settings)
    assert list(result.estimate) == NAMES[:4]
    assert (
        result.estimate != tl.infer("aggregation", generations=2, seed=1, settings=SMALL).estimate
    )


def test_replicas_see_with_their_own_field_of_view():
    scenario = load_configuration(overrides=SMALL, scenario="aggregation-field-of-view-0").scenario
    blind, wide = np.array([[0.0, 0.0, 1.0, 1.0, x] for x in (-700.0, 700.0)])
    source = tl.swarm.MixedSwarm(scenario, 1)
    samples = source.collect(np.repeat([blind, wide], 20, axis=0), np.random.default_rng(1))
    driven = np.abs(samples.counterfeit[:, 0, :, 0]).mean(axis=1) > 1
    assert driven[:20].sum() < 5  # a line of sight seldom meets one of two agents
    assert driven[20:].all()  # a full view always does


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"scenario.sensor.field_of_view": 7.0}, r"`scenario\.sensor\.field_of_view` must be an angle .*; got 7\.0"),
        ({"scenario.sensor.field_of_view": -1.0}, r"`scenario\.sensor\.field_of_view` must be an angle .*; got -1\.0"),
        ({"scenario.representation": "elm"}, r"`scenario\.representation` must be one of reactive, morphology.*; got 'elm'"),
    ],
)  # fmt: skip
def test_what_is_no_field_of_view_or_representation_is_refused(setting, message):
    with pytest.raises(ConfigurationError, match=message):
        load_configuration(overrides=setting, scenario="aggregation")


@pytest.mark.parametrize(("preset", "beyond"), [("default", True), ("paper", False)])
def test_only_jumps_leave_the_views_of_the_first_models(tmp_path, preset, beyond):
    still = {
        "models.initial_step_size": 1e-9,
        "models.minimum_step_size": 0.0,
        "models.population": 100,
    }
    run = tl.infer(
        "aggregation-field-of-view-60",
        preset=preset,
        generations=4,
        seed=2,
        settings={**SMALL, **still},
        out=tmp_path / "run",
    )
    views = run.history["model"].sel(parameter="theta").to_numpy()
    first = 2 * math.pi / (1 + math.exp(1.0)), 2 * math.pi / (1 + math.exp(-1.0))
    assert first[0] <= views[0].min()
    assert views[0].max() <= first[1]
    assert (views[1:].min() < 0.5 * first[0]) == beyond
    assert (views[1:].max() > 1.2 * first[1]) == beyond
