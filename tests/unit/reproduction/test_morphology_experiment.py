"""What is said of runs that infer a field of view, too."""

import numpy as np
import pytest

from turing_learning.reproduction._experiment import Runs
from turing_learning.reproduction.experiments.generality import morphology_verdict
from turing_learning.swarm import AGGREGATION_VIEW_0

SEEDS = (2001, 2002, 2003)
TRUTH = np.array(AGGREGATION_VIEW_0.truth)


def verdict(errors):
    return verdict_of(TRUTH + errors)


def verdict_of(models):
    models = np.array(models, dtype=float)
    errors = np.abs(models - TRUTH)
    names = AGGREGATION_VIEW_0.parameter_names
    runs = Runs("default", names, SEEDS, {"best_model": models}, {"best_model": errors})
    return morphology_verdict("4.6.1-morphology-0", runs, "best_model")


def test_one_run_that_is_off_is_named_and_the_claim_differs():
    found = verdict([[0.01] * 5, [0.02] * 5, [0.9] * 5])
    assert not found.agrees
    said = "the mean error exceeds 0.1 in 1 of 3 runs (seeds 2003), without them vl0 0.015 (0.007), vr0 0.015 (0.007), "
    assert said in found.observed


def test_runs_that_are_all_near_agree_and_are_said_to_be():
    found = verdict([[0.01] * 5, [0.02] * 5, [0.01] * 5])
    assert found.agrees
    assert found.observed.endswith("; the mean error is at most 0.1 in every run")


def test_runs_that_are_all_off_leave_no_others():
    assert verdict([[1.0] * 5] * 3).observed.endswith("in 3 of 3 runs (seeds 2001, 2002, 2003)")


@pytest.mark.parametrize("theta", [0.0, 0.1])
def test_the_field_of_view_counts_as_any_parameter(theta):
    assert verdict([[0.01, 0.01, 0.01, 0.01, theta]] * 3).agrees == (theta == 0.0)


def test_runs_in_a_mirror_image_or_with_another_view_are_the_reason_why_a_claim_differs():
    found = verdict_of(
        [TRUTH, [0.97, -1.13, -0.68, -0.98, 6.21], TRUTH + np.array([0, 0, -0.6, 0, 0])]
    )
    assert "in 2 of 3 runs (seeds 2002, 2003)" in found.observed
    assert found.reason.startswith("a mirror image of the truth")
    assert found.reason.endswith("(seeds 2002); docs/decisions/0016")
    assert verdict_of([TRUTH, TRUTH, TRUTH + np.array([0, 0, 0, 0, 4.6])]).reason == (
        "a field of view that is far off beside the right wheel speeds (seeds 2003); docs/decisions/0016"
    )


@pytest.mark.parametrize("error", [0.01, 0.9])
def test_runs_that_only_are_off_have_no_such_reason(error):
    assert not verdict([[0.01] * 5, [0.02] * 5, [error] * 5]).reason
