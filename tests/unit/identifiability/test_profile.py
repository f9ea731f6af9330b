import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from turing_learning.analysis import UNKNOWN
from turing_learning.identifiability import (
    Check,
    PinnedDown,
    Profile,
    Recovery,
    TwoSampleTest,
    profile,
    read_check,
)
from turing_learning.identifiability.evidence import LEAST_POINTS
from turing_learning.models import Parameter

FLAT = Profile(
    "speed",
    values=(0.0, 5.0, 6.0, 10.0),
    numbers=(-1.0, 0.0, 0.2, 1.0),
    place=2,
    accuracies=(0.9, 0.52, 0.5, 0.9),
    criticals=(0.55,) * 4,
)


def test_what_is_told_apart_ends_what_is_left_open():
    assert FLAT.told_apart == (True, False, False, True)
    assert FLAT.open_share == 1.0
    assert replace(FLAT, accuracies=(0.9, 0.7, 0.5, 0.9)).open_share == pytest.approx(0.5)


def test_where_even_the_estimate_is_told_apart_other_values_must_do_worse():
    wrong = replace(FLAT, accuracies=(0.9, 0.82, 0.8, 0.95))
    assert wrong.told_apart == (True, False, False, True)
    assert not any(replace(FLAT, accuracies=(0.99, 0.98, 0.97, 0.99)).told_apart)


def test_an_estimate_outside_the_initial_range_counts_as_its_end():
    outside = replace(FLAT, numbers=(-1.0, 0.0, 1.0, 1.4), place=3, accuracies=(0.9, 0.9, 0.9, 0.5))
    assert outside.open_share == pytest.approx(0.2)


def test_a_parameter_with_an_effect_is_pinned_down_and_one_without_is_not(evidence, small):
    given, estimate = evidence(), np.array([0.1, 0.2])
    mean, nothing = (profile(given, estimate, place, small, seed=2) for place in (0, 1))
    assert (mean.parameter, nothing.parameter) == ("mean", "nothing")
    assert mean.values == pytest.approx((-3, -1.8, -0.6, 0.1, 0.6, 1.8, 3))
    assert mean.values[mean.place] == pytest.approx(0.1)
    assert mean.open_share < 0.5
    assert nothing.open_share > 0.5


@pytest.mark.parametrize(("bounds", "least"), [((None, None), -4.5), ((-3.0, 3.0), -3.0)])
def test_at_the_end_of_the_range_values_reach_beyond_it_unless_it_is_a_bound(
    evidence, small, bounds, least
):
    given = evidence()
    mean = Parameter(*bounds, initial=(-3.0, 3.0))
    given = replace(given, parameters={**given.parameters, "mean": mean})
    found = profile(given, np.array([-3.0, 0.2]), 0, small, seed=2, beyond=True)
    assert (min(found.values), max(found.values)) == pytest.approx((least, 3.0))


@pytest.mark.parametrize("estimate", [-1.0, -0.6, -0.59, -0.2, 0.0, 0.99])
def test_the_coarsest_profile_can_pin_any_estimate_down(estimate):
    numbers = np.append(np.linspace(-1, 1, LEAST_POINTS), estimate)
    order = np.argsort(numbers, kind="stable")
    near = np.abs(numbers[order] - estimate) < 0.02
    found = Profile(
        "speed",
        values=tuple(numbers[order]),
        numbers=tuple(numbers[order]),
        place=int(np.flatnonzero(order == LEAST_POINTS)[0]),
        accuracies=tuple(np.where(near, 0.5, 1.0)),
        criticals=(0.6,) * (LEAST_POINTS + 1),
    )
    assert PinnedDown("speed", 0.1, found.open_share, None).pinned_down


def test_reasons_name_what_speaks_against_a_parameter():
    assert PinnedDown("speed", 0.1, 0.3, 0.02).pinned_down
    assert PinnedDown("speed", 0.1, None, None).pinned_down
    loose = PinnedDown("speed", 0.6, 1.0, 0.3)
    assert loose.reasons == (
        "its interval is 60% of the initial range",
        "up to 100% of the range may be open",
        "a known truth was missed by 30% of the range",
    )


def test_an_interval_that_is_not_known_speaks_against_a_parameter():
    still = PinnedDown("speed", None, 0.1, 0.02)
    assert not still.pinned_down
    assert still.reasons == ("its interval is not known",)


def test_a_recovery_is_kept_with_null_where_its_interval_is_not_known():
    given = Recovery(
        1, 3, {"a": 0.5}, {"a": 0.4}, {"a": [UNKNOWN, UNKNOWN], "b": [0.1, 0.2]}, {"a": 0.05}
    )
    kept = json.loads(json.dumps(given.to_json(), allow_nan=False))
    assert kept["interval"] == {"a": [None, None], "b": [0.1, 0.2]}
    test = TwoSampleTest(0.61, 0.012, 0.55, 40, 40, 200, 200, "samples")
    content = Check(test, (PinnedDown("a", None, None, 0.1),), (), (), ())
    stored = {
        "test": test.to_json(),
        "parameters": json.loads(
            json.dumps([asdict(each) for each in content.parameters], allow_nan=False)
        ),
        "profiles": {},
        "recoveries": [kept],
        "quantities": [],
    }
    assert read_check(stored) == replace(content, recoveries=(given,))


def test_a_check_from_before_is_read_as_it_is():
    test = TwoSampleTest(0.61, 0.012, 0.55, 40, 40, 200, 200, "samples")
    point = {"parameter": "a", "interval_share": 0.0, "open_share": None, "recovery_error": None}
    stored = {
        "test": test.to_json(),
        "parameters": [point],
        "profiles": {},
        "recoveries": [],
        "quantities": [],
    }
    found = read_check(stored)
    assert found.parameters == (PinnedDown("a", 0.0, None, None, rejected=True),)
    assert found.verdict == "classifiers can still tell"


def test_nothing_is_pinned_down_at_a_bound_or_of_a_model_that_is_rejected():
    bound = PinnedDown("turning_rate", 0.01, 0.2, 0.0, bound="6 rad/s")
    assert (bound.pinned_down, bound.verdict) == (False, "at the bound 6 rad/s")
    good = PinnedDown("speed", 0.01, 0.2, 0.0)
    test = TwoSampleTest(0.61, 0.5, 0.6, 10, 5, 10, 5, "individuals")
    said = Check(test, (bound, PinnedDown("b", 0.9, 0.2, 0.0)), (), (), ()).text
    assert said.endswith("Not pinned down: turning_rate (at the bound 6 rad/s), b.")
    told = Check(replace(test, p_value=0.001), (good,), (), (), ())
    assert told.parameters[0].reasons == ("the estimate does not fit",)
    assert told.text.endswith("Not pinned down: speed.")


@pytest.mark.parametrize(
    ("value", "bound"),
    [(6.0, "6 rad/s"), (5.95, "6 rad/s"), (5.8, ""), (0.0, "0 rad/s"), (3.0, "")],
)
def test_an_estimate_within_a_hundredth_of_the_range_is_at_its_bound(value, bound):
    assert Parameter(0, 6, unit="rad/s").bound_at(value) == bound
    assert Parameter(None, None, initial=(0, 6)).bound_at(value) == ""


def test_a_check_names_what_is_not_pinned_down():
    test = TwoSampleTest(0.51, 0.412, 0.55, 40, 40, 200, 200, "samples")
    parameters = (PinnedDown("a", 0.1, 0.2, 0.0), PinnedDown("b", 0.9, 0.2, 0.0))
    found = Check(test, parameters, (), (), ())
    assert found.text == (
        "The estimate passes: fresh classifiers cannot tell held-out samples from the model "
        "(accuracy 0.510, p = 0.412). Not pinned down: b."
    )
    lines = str(found).splitlines()
    assert lines[0] == "40 held-out samples, 0 known truths, 0 profiles: converged"
    assert "its interval is 90% of the initial range" in next(
        line for line in lines if line.startswith("b ")
    )
    unfinished = replace(found, unfinished=(3, 10))
    assert (
        unfinished.text
        == f"{found.text} The run was not finished: the estimate is that after 3 of 10 generations."
    )
    of_trials = replace(
        unfinished, parameters=tuple(replace(each, sides=(True, False)) for each in parameters)
    )
    assert of_trials.text.endswith("that after 3 of 10 trials.")
    assert of_trials.parameters[0].reasons == ("higher values are not shown to fit worse",)
    assert replace(found, parameters=parameters[:1]).not_pinned_down == ()


def test_a_run_of_trials_without_profiles_says_nothing_of_its_parameters():
    test = TwoSampleTest(0.51, 0.412, 0.55, 40, 40, 200, 200, "samples")
    found = Check(test, (PinnedDown("a", 0.1, None, 0.0, sides=(False, False)),), (), (), ())
    assert found.verdict == "converged"
    assert found.text.endswith("Without profiles the check says nothing of single parameters.")
    assert found.parameters[0].reasons == ("it has no profile",)


def test_few_groups_have_little_power_and_voters_without_an_opinion_none():
    many = TwoSampleTest(0.5, 0.5, 0.53, 40, 40, 200, 200, "samples")
    assert many.power > 0.99
    assert 0.05 < replace(many, critical=0.65).power < 0.8
    assert replace(many, critical=0.5).power == 0
