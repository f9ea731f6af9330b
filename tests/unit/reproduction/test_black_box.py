"""Section 4.6.2 and 4.6.3: what is made of the runs."""

import numpy as np
import pytest

from turing_learning.analysis import dynamic_outputs, response_error
from turing_learning.models import ElmanModel
from turing_learning.reproduction._experiment import Runs
from turing_learning.reproduction.experiments.generality import (
    NAMES,
    TRUTH,
    NetworkRuns,
    black_box_verdict,
    separated_verdict,
    settling,
)
from turing_learning.studies import load_study


def steady(*steps):
    """Return outputs of a network that is astray in the given steps, counted from 1."""
    outputs = np.repeat([[-0.7, -1.0], [1.0, -1.0], [-0.7, -1.0]], 10, axis=0)
    outputs[np.array(steps, dtype=int) - 1, 0] += 0.5
    return outputs


@pytest.mark.parametrize(
    ("astray", "step"), [((), 1), ((1,), 2), ((11, 12), 3), ((23,), 4), ((2, 27), 8)]
)
def test_outputs_have_settled_when_they_are_near_where_they_end_to_stay(astray, step):
    assert settling(steady(*astray)) == step


def black_box(shift=0.0, slow=0.0):
    """Return an outcome of three runs whose outputs are near the truth, shifted by `shift`."""
    model = ElmanModel(hidden=1)
    right = 2 * np.arctanh(-0.999)
    # the left wheel follows the reading; with `slow` the hidden neuron needs many steps
    network = [40.0, 0.0, -20.0, 8.0, 0.0, 2 * np.arctanh(-0.7), right]
    if slow:
        network = [slow, 8.0, -4.2, 8.0, 0.0, 2 * np.arctanh(-0.7), right]
    return NetworkRuns(runs_of(np.tile(TRUTH + shift, (3, 1))), model, np.tile(network, (3, 1)))


def runs_of(outputs):
    errors = np.abs(outputs - TRUTH)
    return Runs(
        "default",
        NAMES,
        tuple(range(len(outputs))),
        {"best_model": outputs},
        {"best_model": errors},
    )


def test_outputs_near_the_agents_parameters_that_settle_at_once_agree():
    verdict = black_box_verdict([black_box(), black_box(shift=0.05)])
    assert verdict.agrees
    assert "settled in step 1" in verdict.observed


def test_one_size_of_the_network_that_misses_makes_the_claim_differ():
    assert not black_box_verdict([black_box(), black_box(shift=0.2)]).agrees


@pytest.mark.parametrize(
    ("hidden", "astray", "agrees"), [(1, 2, True), (1, 6, False), (5, 6, True), (5, 10, False)]
)
def test_more_runs_with_an_output_far_off_than_printed_make_the_claim_differ(
    hidden, astray, agrees
):
    model = ElmanModel(hidden=hidden)
    outputs = np.tile(TRUTH, (30, 1))
    outputs[:astray, 2] += 1.0
    outcome = NetworkRuns(runs_of(outputs), model, np.zeros((30, len(model.parameter_names))))
    verdict = black_box_verdict([outcome])
    assert (
        "medians vl0 -0.70, vr0 -1.00, vl1 1.00, vr1 -1.00" in verdict.observed
    )  # which do not notice
    assert f"in {astray} of 30 runs" in verdict.observed
    assert verdict.agrees is agrees


def test_outputs_that_settle_slowly_make_the_claim_differ():
    outcome = black_box(slow=2.2)
    assert settling(outcome.dynamics) > 3
    assert not black_box_verdict([outcome]).agrees


def separated(shift):
    rng = np.random.default_rng(0)
    errors = {
        name: np.abs(rng.normal(0, 0.02, (30, 4))) + more
        for name, more in (("mixed", 0.0), ("separated", shift))
    }
    return {
        name: Runs("default", NAMES, tuple(range(30)), {}, {"best_model": one})
        for name, one in errors.items()
    }


@pytest.mark.parametrize(("shift", "agrees"), [(0.0, True), (0.1, False)])
def test_the_errors_of_separated_runs_are_tested_against_those_of_mixed_ones(shift, agrees):
    verdict = separated_verdict(separated(shift), "best_model")
    assert verdict.agrees is agrees
    assert "p: vl0" in verdict.observed


def test_the_network_whose_dynamics_are_shown_is_the_median_by_the_papers_metric(conducted, rows):
    runs = load_study(conducted / "4.6.2" / "pieces" / "study-3-hidden-default").runs
    networks = np.array([list(run.result["networks"]["best_model"].values()) for run in runs])
    model = ElmanModel(hidden=3)
    errors = response_error(model, networks, TRUTH)
    chosen = np.argsort(errors)[0]  # of two, the better one
    stated = [row for row in rows("4.6.2", "steady-outputs") if row["hidden"] == "3"]
    assert [row["is_median"] for row in stated] == [str(k == chosen) for k in range(2)]
    np.testing.assert_allclose([float(row["metric"]) for row in stated], errors, rtol=1e-5)
    shown = [row for row in rows("4.6.2", "dynamic-outputs") if row["hidden"] == "3"]
    np.testing.assert_allclose(
        [[float(row["left"]), float(row["right"])] for row in shown],
        dynamic_outputs(model, networks[chosen]),
        atol=1e-5,
    )


def test_mixed_and_separated_runs_have_the_same_seeds_and_other_results(rows):
    found = rows("4.6.3", "default-models")
    by_grouping = {
        name: [row for row in found if row["grouping"] == name and row["model"] == "best_model"]
        for name in ("mixed", "separated")
    }
    assert [row["seed"] for row in by_grouping["mixed"]] == [
        row["seed"] for row in by_grouping["separated"]
    ]
    found_by = {name: [row["vl0"] for row in of] for name, of in by_grouping.items()}
    assert found_by["mixed"] != found_by["separated"]
