import numpy as np
import pytest

from turing_learning.reproduction._experiment import Runs
from turing_learning.reproduction._verdicts import ClaimVerdict, Spreads, shares_not_worse
from turing_learning.reproduction.experiments.case_studies import (
    Case,
    Outcome,
    emergence_verdict,
    settled,
)
from turing_learning.swarm import AGGREGATION


def spreads(*pairs):
    """Means and standard deviations over 30 runs."""
    return Spreads(*np.array(pairs).T, 30)


PRINTED = spreads((0.1, 0.03))


def test_mean_and_standard_deviation_are_those_of_the_runs():
    found = Spreads.of(np.array([[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]))
    assert (found.mean.tolist(), found.standard_deviation.tolist(), found.runs) == (
        [2.0, 0.0],
        [1.0, 0.0],
        3,
    )
    assert found.standard_error[0] == pytest.approx(1 / 3**0.5)


def test_a_single_run_has_no_spread():
    assert Spreads.of(np.array([[0.2]])).standard_deviation == 0.0


@pytest.mark.parametrize(
    ("observed", "agrees"),
    [
        (spreads((0.0, 0.01)), True),  # a smaller error
        # both standard errors are 0.03 / sqrt(30) = 0.005477, that of the difference 0.007746: the limit is 0.1205
        (spreads((0.120, 0.03)), True),
        (spreads((0.121, 0.03)), False),
        # one of 30 runs is off by 1000: a standard deviation of 183 does not widen the limit
        (Spreads.of(np.array([[0.0]] * 29 + [[1000.0]])), False),
        (spreads((0.0, 0.0), (0.9, 0.1)), False),  # one parameter that is worse
    ],
)
def test_errors_agree_up_to_twice_the_printed_standard_error_of_the_difference(observed, agrees):
    assert observed.not_worse(PRINTED) is agrees


@pytest.mark.parametrize(
    ("mean", "agrees"), [(0.066, True), (0.064, False), (0.134, True), (0.136, False)]
)
def test_a_baseline_must_be_neither_worse_nor_better_than_printed(mean, agrees):
    assert spreads((mean, 0.5)).within(PRINTED) is agrees


@pytest.mark.parametrize(
    ("own", "printed", "agrees"), [(28, 30, True), (26, 30, False), (20, 26, True), (17, 26, False)]
)
def test_a_share_may_fall_short_by_twice_the_standard_error_of_the_difference(own, printed, agrees):
    assert shares_not_worse(own / 30, 30, printed / 30, 30) is agrees


def test_printed_errors_are_those_of_30_runs():
    found = Spreads.printed("4.3-aggregation-ae")
    assert (found.mean[0], found.standard_deviation[0], found.runs) == (0.01, 0.01, 30)


def test_numbers_are_listed_with_their_names():
    assert (
        spreads((0.1, 0.03), (0.1, 0.03)).listed(("vl0", "vr0"), 2)
        == "vl0 0.10 (0.03), vr0 0.10 (0.03)"
    )


def test_a_verdict_without_a_stated_rule_is_refused():
    with pytest.raises(ValueError, match=r"`rule` must be one of absolute errors, .*; got 'mood'"):
        ClaimVerdict("3.2-snapshots", True, "", "", "mood")


def test_a_verdict_from_a_comparison_of_arrays_can_be_stored():
    verdict = ClaimVerdict("4.6.4-random-behaviors", np.float64(1) < 2, "", "", "random behaviors")
    assert verdict.agrees is True


def test_an_outcome_names_the_reason_of_a_difference():
    verdict = ClaimVerdict(
        "4.3-sensor-shares", False, "0.9", "0.8", "shares", reason="the simulator"
    )
    assert (verdict.word, verdict.outcome) == ("differ", "0.8 (why: the simulator)")


def test_values_settle_where_they_are_near_the_truth_for_twenty_generations():
    values = [1.0] * 5 + [0.55] + [1.0] * 3 + [0.45] * 30
    assert settled(np.array(values), 0.5) == (9, 9)


def test_values_that_leave_again_have_settled_and_not_for_good():
    values = np.array([0.5] * 30 + [1.0] + [0.5] * 10)
    assert settled(values, 0.5) == (0, 31)
    assert settled(values[:31], 0.5) == (0, None)


def test_values_that_leave_again_and_again_never_settle():
    assert settled(np.array([0.5, 0.5, 1.0] * 20), 0.5) == (None, None)


@pytest.mark.parametrize(("dispersions", "agrees"), [((10.0, 10.0), True), ((10.0, 30.0), False)])
def test_a_swarm_that_does_not_gather_makes_the_claim_differ(dispersions, agrees):
    # all of four trials alike: no test can be significant, so that only the second condition decides
    agents, models = np.full((3, 4), 10.0), np.array([[d] * 4 for d in dispersions])
    case = Case(
        AGGREGATION, "aggregation", {"robots": 5, "trials": 4}, PRINTED, agents[0], agents[1:]
    )
    runs = Runs("default", AGGREGATION.parameter_names, (1, 2), {}, {})
    outcome = Outcome(case, runs, np.zeros((2, 2, 4)), np.zeros((1, 4)), {"best_model": models})
    assert emergence_verdict(outcome, "best_model").agrees is agrees
