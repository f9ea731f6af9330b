"""Random behaviors: what is counted, and what is told of those that are not inferred."""

import numpy as np
import pytest

from turing_learning.reproduction._experiment import Runs
from turing_learning.reproduction._verdicts import shares_not_worse
from turing_learning.reproduction.experiments.generality import (
    NAMES,
    behaviors_verdict,
    depends_on_the_reading,
)


def errors_like_the_papers(runs, rng):
    return rng.uniform(0.5, 1.5, (runs, 4)) * (0.01, 0.01, 0.04, 0.05)


def verdict_on(errors, of_most=None):
    runs = Runs(
        "default", NAMES, tuple(range(len(errors))), {"best_model": errors}, {"best_model": errors}
    )
    return behaviors_verdict(runs, "best_model", errors if of_most is None else of_most)


def test_small_errors_that_are_larger_where_another_robot_is_seen_agree():
    assert verdict_on(errors_like_the_papers(100, np.random.default_rng(1))).agrees


def test_errors_that_do_not_depend_on_the_sensor_differ():
    errors = np.random.default_rng(1).uniform(0.0, 0.02, (100, 4))
    verdict = verdict_on(errors)
    assert not verdict.agrees
    assert "not significantly lower" in verdict.observed


def test_too_many_runs_that_fail_make_it_differ():
    errors = errors_like_the_papers(100, np.random.default_rng(1))
    errors[:20] += 0.2
    verdict = verdict_on(errors)
    assert not verdict.agrees
    assert "MAE below 0.05 in 80.0% of 100 runs, above 0.1 in 20.0%" in verdict.observed


def test_a_share_agrees_up_to_twice_the_standard_error_of_the_difference():
    # standard errors 0.03 and 0.00949 (p = 0.9, 100 and 1000 runs): the limit is 0.0629
    assert shares_not_worse(0.9, 100, 0.96, 10**9)
    assert not shares_not_worse(0.9, 100, 0.961, 10**9)
    assert shares_not_worse(0.9, 100, 0.9628, 400)


def test_lower_errors_for_one_wheel_alone_are_not_enough():
    errors = np.random.default_rng(2).uniform(0.5, 1.5, (60, 4)) * (0.01, 0.05, 0.05, 0.05)
    assert not depends_on_the_reading(errors)


def test_a_few_runs_that_do_not_show_the_difference_are_told_with_how_often_as_few_do():
    rng = np.random.default_rng(3)
    many = rng.uniform(0.0, 1.0, (200, 4)) * (0.01, 0.01, 0.016, 0.016)
    few = rng.uniform(0.0, 0.01, (20, 4))
    verdict = verdict_on(few, many)
    assert verdict_on(many).agrees
    assert not verdict.agrees
    share = int(verdict.reason.split("preset, ")[1].split("%")[0])
    assert "of 200 draws of 20 from the 200 runs" in verdict.reason
    assert 0 < share < 100
    assert verdict_on(few + 0.3, many).reason == ""  # larger errors are another reason


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_every_behavior_is_listed_with_its_estimate(rows, preset):
    found = rows("4.6.4", f"{preset}-runs")
    for row in found:
        errors = [
            abs(float(row[name]) - float(row[f"estimate_{name}"]))
            for name in ("vl0", "vr0", "vl1", "vr1")
        ]
        assert float(row["estimate_mae"]) == pytest.approx(np.mean(errors), abs=2e-4)
    assert len({row["vl0"] for row in found}) == len(found) == {"default": 4, "paper": 3}[preset]


def test_those_that_fail_are_told_with_how_often_they_see_another_robot(rows):
    bad = [
        row["seed"] for row in rows("4.6.4", "default-runs") if float(row["estimate_mae"]) >= 0.05
    ]
    told = rows("4.6.4", "failures")
    assert [row["seed"] for row in told] == bad
    assert all(0 <= float(row["share_of_I_1"]) <= 1 and 1 <= int(row["rank"]) <= 4 for row in told)
