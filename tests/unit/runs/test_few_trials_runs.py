"""Runs that infer from a given number of trials: what they state, and that they are resumed to the same bits."""

import json
import math
import shutil
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.analysis import Judgment, Verdict, mixed_interval
from turing_learning.config import ConfigurationError
from turing_learning.families import BurstAndCoast, as_recorded
from turing_learning.few_trials import Matched, SearchSpace, _loop, _readout, _search, combined
from turing_learning.identifiability import Effort, TwoSampleTest
from turing_learning.runs import _loops
from turing_learning.runs._loops import panel_examination
from turing_learning.runs._methods import methods_text
from turing_learning.store import RunFolderError
from turing_learning.systems import Arguments, CustomSystemError, Source
from turing_learning.trajectories import Trajectories

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")

SMALL = {
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "classifiers.population": 8,
    "run.threads": 1,
}


TRIALS = 60
"""Of most runs here: of 50 on, intervals can be stated."""


def inferred(out=None, seed=3, **options):
    return tl.infer("aggregation", trials=TRIALS, seed=seed, settings=SMALL, out=out, **options)


def drift(parameters, rng):
    """Walks whose speed is the first parameter; the second has no effect."""
    noise = rng.normal(0, 3, (len(parameters), 12, 1))
    return parameters[:, :1, None] + noise


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return inferred(tmp_path_factory.mktemp("runs") / "whole")


def test_a_run_spends_its_trials_and_states_them(whole):
    assert whole.complete
    assert whole.trials == TRIALS
    content = json.loads((whole.path / "result.json").read_text())
    assert content["trials"] == TRIALS
    assert set(content["interval"]) == set(whole.estimate)
    assert all(math.isfinite(value) for value in whole.estimate.values())
    assert (whole.path / "report.html").exists()


def test_where_classifiers_tell_the_models_at_the_end_no_interval_is_stated(monkeypatch):
    monkeypatch.setattr(
        "turing_learning.runs._summary.LEAST_P", 0.0
    )  # matching has nothing against the model
    still = 8 + 0.01 * np.random.default_rng(1).standard_normal(
        (60, 12, 1)
    )  # the model's speed is never so steady
    result = tl.infer(
        genuine=still,
        simulate=drift,
        parameters={"speed": (0, 20), "inert": (0, 20)},
        trials=200,
        seed=1,
        settings={"run.threads": 1},
    )
    assert result.verdict == "classifiers can still tell"
    assert np.isnan(list(result.interval.values())).all()
    assert result.covariance is None


def test_the_history_has_a_row_for_each_batch(whole):
    history = whole.history
    assert history["trials"].to_numpy()[-1] == TRIALS
    assert history["typical_model"].shape == (whole.generations, 4)


def test_it_is_described_in_trials(whole):
    assert repr(whole).startswith("<Posterior: aggregation, seed 3, 60 trials, ")
    page = (whole.path / "report.html").read_text()
    assert f"turing-learning check {whole.path}<" in page
    assert "After 60 trials the estimate differs" in page
    assert "Parameters over trials" in page
    assert "generations.csv" not in page
    for axes in (
        whole.plot.fitness(Figure().subplots()),
        *whole.plot.parameters(Figure().subplots(1, 4)),
    ):
        assert (axes.get_xlabel(), axes.get_xlim()) == ("Trials", (0, TRIALS))
        assert [line.get_xdata()[-1] for line in axes.lines[:2]] == [TRIALS, TRIALS]


def test_a_stopped_run_is_resumed_to_the_same_bits(whole, tmp_path):
    stopped = inferred(tmp_path / "run", should_stop=lambda: True)
    assert (stopped.complete, stopped.generations) == (False, 1)
    assert all(math.isnan(end) for ends in stopped.interval.values() for end in ends)
    assert stopped.history["typical_model"].to_numpy()[-1].tolist() == pytest.approx(
        list(stopped.estimate.values())
    )
    resumed = tl.resume(tmp_path / "run")
    assert resumed.estimate == whole.estimate
    assert repr(resumed.interval) == repr(whole.interval)
    for name in sorted(path.name for path in (whole.path / "buffer").iterdir()):
        one, other = (
            np.load(folder / "buffer" / name) for folder in (whole.path, tmp_path / "run")
        )
        assert all(np.array_equal(one[key], other[key]) for key in one.files)


def test_a_lost_run_settles_on_a_center_and_is_resumed_to_the_same_bits(monkeypatch, tmp_path):
    monkeypatch.setattr(_search, "LOST_MISFIT", 0.0)
    monkeypatch.setattr(_loop, "FEWEST_TO_SEARCH", 10)
    monkeypatch.setattr(_readout, "FEWEST_IN_SHARE", 60)
    # Each match takes a second or two; where the run goes on is decided by two.
    monkeypatch.setattr(_readout, "CENTERS", 1)
    monkeypatch.setattr(_readout, "SHARES_AT_END", _readout.SHARES_AT_END[:1])
    places = []

    def noted(run, draws, go_on_around=_loop.FewTrials.go_on_around):
        places.append(draws)
        return go_on_around(run, draws)

    monkeypatch.setattr(_loop.FewTrials, "go_on_around", noted)
    known = {"trials": 150, "seed": 2, "settings": SMALL}
    lost = tl.infer("aggregation", **known)
    chosen = len(places)
    assert chosen > 1
    stop = iter([False] * 32 + [True] * 9)
    stopped = tl.infer("aggregation", **known, out=tmp_path / "run", should_stop=lambda: next(stop))
    assert not stopped.complete
    resumed = tl.resume(tmp_path / "run")
    assert resumed.estimate == lost.estimate
    assert repr(resumed.interval) == repr(lost.interval)
    for first, again in zip(places, places[chosen:], strict=False):
        np.testing.assert_array_equal(first, again)
    assert len(places) == 2 * chosen


def solution(place, distance, passed_checks=True, canary_range=1.0):
    draws = place + 0.1 * np.random.default_rng(5).standard_normal((600, 2))
    none = np.full(2, np.nan)
    known = {
        "estimate": none,
        "covariance": none,
        "interval_low": none,
        "interval_high": none,
        "identified": none,
    }
    return Matched(
        **known,
        draws=draws,
        passed_checks=passed_checks,
        distance=distance,
        p_value=0.5,
        leverage=0.1,
        canary_range=canary_range,
        halves_apart=1.0,
        mode=np.zeros(len(draws), dtype=np.int64),
    )


def test_solutions_that_are_told_equally_well_are_mixed():
    several = [
        solution(0.0, 9.0),
        solution(0.4, 2.0),
        solution(-0.8, 1.0, passed_checks=False),
        solution(0.9, 30.0),
    ]
    found = combined(several, np.full(2, 1.0))
    assert (found.passed_checks, found.distance) == (True, 2.0)
    assert len(found.draws) == 600
    np.testing.assert_allclose(found.interval_low, -0.13, atol=0.03)
    np.testing.assert_allclose(found.interval_high, 0.53, atol=0.03)
    assert found.identified.all()
    far = combined([solution(0.0, 21.0)], np.full(2, 1.0))
    assert not far.passed_checks
    assert np.isnan(far.interval_low).all()


@pytest.mark.parametrize(
    ("passed", "canaries", "counts"),
    [
        # two of three pass: that one fails is chance, wherever its canary is
        ((False, True, True), (0.9, 0.8, 1.0), 1.0),
        ((False, False, True), (0.5, 0.4, 1.0), 0.5),
        ((False, False, False), (0.5, 0.4, 0.3), 0.4),
    ],
)
def test_most_of_three_say_whether_a_solution_fails_and_the_middle_canary_counts_or_the_larger_of_two(
    monkeypatch, passed, canaries, counts
):
    sought = [solution(0.0, 1.0, *each) for each in zip(passed, canaries, strict=True)]
    rest = iter(sought)
    monkeypatch.setattr(_readout, "_solution_near", lambda *_: next(rest))
    chosen = _readout.solution(None, None, np.random.default_rng(1), lost=False)
    assert chosen.passed_checks == (sum(passed) > 1)
    assert chosen.canary_range == counts


def test_a_stored_run_is_opened_as_it_ended(whole):
    assert tl.load_run(whole.path) == whole
    assert tl.resume(whole.path) == whole


@pytest.fixture(scope="module")
def extended(whole, tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "extended"
    shutil.copytree(whole.path, path)
    return tl.resume(path, trials=66)


def test_a_finished_run_is_extended_to_the_bits_of_its_definition(whole, extended, tmp_path):
    assert (extended.trials, extended.complete) == (66, True)
    assert extended.generations > whole.generations
    assert tl.load_run(extended.path) == extended
    defined = tl.infer(
        "aggregation", trials=66, seed=3, settings={**SMALL, "run.extended": [[60, 60]]}
    )
    assert defined.estimate == extended.estimate
    assert repr(defined.interval) == repr(extended.interval)

    shutil.copytree(whole.path, tmp_path / "run")
    result = tl.resume(tmp_path / "run", trials=66, should_stop=lambda: True)
    while not result.complete:  # stopped after each batch, and resumed by the same call
        result = tl.resume(tmp_path / "run", trials=66, should_stop=lambda: True)
    assert (result.estimate, result.covariance) == (extended.estimate, extended.covariance)
    assert result.trials == 66


def test_another_tolerance_is_not_taken_for_that_of_the_call_before(whole, tmp_path):
    shutil.copytree(whole.path, tmp_path / "run")
    tl.resume(tmp_path / "run", trials=66, tolerance=0.001, should_stop=lambda: True)
    with pytest.raises(RunFolderError, match="`run` must be finished, to get more trials; got"):
        tl.resume(tmp_path / "run", trials=66, tolerance=0.0)


def test_a_run_is_extended_more_than_once(extended):
    again = tl.resume(extended.path, trials=70)
    assert again.configuration.run.extended == ((60, 60), (66, 66))
    assert again.trials == 70


def test_what_cannot_be_extended_is_rejected(whole, tmp_path):
    for options, message in (
        ({"trials": 60}, r"`trials` must be more than the 60 that the run has spent; got 60"),
        ({"tolerance": 0.1}, r"`tolerance` must be given beside `trials`; got 0\.1 alone"),
    ):
        with pytest.raises(RunFolderError, match=message):
            tl.resume(whole.path, **options)
    stopped = inferred(tmp_path / "stopped", should_stop=lambda: True)
    with pytest.raises(RunFolderError, match="`run` must be finished, to get more trials; got"):
        tl.resume(stopped.path, trials=200)
    tl.infer(
        "aggregation",
        generations=1,
        settings={**SMALL, "models.population": 6},
        out=tmp_path / "generations",
    )
    with pytest.raises(
        RunFolderError, match="`run` must be one of trials, to get more of them; got"
    ):
        tl.resume(tmp_path / "generations", trials=200)


def speeds(out=None, trials=200, **options):
    genuine = drift(np.full((60, 2), 7.0), np.random.default_rng(1))
    ranges = {"speed": (0.0, 20.0), "inert": (0.0, 20.0)}
    known = {"genuine": genuine, "simulate": drift}
    settings = {"run.threads": 1}
    return known, tl.infer(
        **known,
        parameters=ranges,
        trials=trials,
        settings=settings,
        out=out,
        **{"seed": 1, **options},
    )


@pytest.fixture(scope="module")
def walked(tmp_path_factory):
    """A run on recorded speeds, and its system; the folder is not to be changed."""
    return speeds(tmp_path_factory.mktemp("runs") / "walked", trials=60)


@pytest.mark.parametrize("how", ["stopped", "interrupted"])
def test_a_run_that_ends_while_its_estimate_is_examined_is_resumed_to_the_same_bits(
    how, walked, tmp_path, caplog
):
    known, whole = walked
    last = []

    def interrupting(parameters, rng):
        # symmetries may be simulated before the end, too
        if how == "interrupted" and any(last):
            raise KeyboardInterrupt
        return drift(parameters, rng)

    run = {
        **known,
        "simulate": interrupting,
        "parameters": {"speed": (0.0, 20.0), "inert": (0.0, 20.0)},
        "settings": {"run.threads": 1},
        "trials": 60,
        "seed": 1,
        "out": tmp_path / "run",
        "observer": lambda progress: last.append(progress.last),
        "should_stop": lambda: how == "stopped" and last[-1],
    }
    caplog.set_level("INFO", "turing_learning.runs")
    if how == "stopped":
        assert not tl.infer(**run).complete
    else:
        with pytest.raises(KeyboardInterrupt):
            tl.infer(**run)
        assert "At least 230 simulations follow, for " in caplog.text
    # the last batch is not simulated again
    assert sum(last) == 1
    stored = tl.load_run(tmp_path / "run")
    assert (stored.trials, stored.complete) == (60, False)
    resumed = tl.resume(tmp_path / "run", **known)
    assert resumed.complete
    assert resumed.to_json() | {"seconds_total": 0, "seconds_per_generation": 0} == (
        whole.to_json() | {"seconds_total": 0, "seconds_per_generation": 0}
    )


def test_a_parameter_that_is_not_identified_keeps_a_run_from_converging(walked):
    _, result = walked
    assert result.verdict == "not identified"
    assert result.not_identified == ("inert",)
    assert result.modes[0].interval == result.interval
    assert "the whole range: inert" in str(result)


def test_a_run_stops_within_its_tolerance_and_can_be_extended(tmp_path):
    known, result = speeds(tmp_path / "run", tolerance=0.1)
    assert result.complete
    assert result.trials < 200
    low, high = result.interval["speed"]
    assert (high - low) / 2 <= 0.1 * 20
    assert result.interval["inert"] == [
        0,
        20,
    ]  # not identified: does not keep the run from stopping
    assert tl.load_run(tmp_path / "run") == result
    more = tl.resume(tmp_path / "run", trials=150, tolerance=0.0, **known)
    assert (more.trials, more.complete) == (150, True)
    settings = {"run.extended": [[200, result.trials]], "run.threads": 1}
    ranges = {"speed": (0.0, 20.0), "inert": (0.0, 20.0)}
    assert (
        tl.infer(**known, parameters=ranges, trials=150, seed=1, settings=settings).estimate
        == more.estimate
    )


def test_covariance_and_draws_are_those_of_the_matched_estimate(walked):
    _, result = walked
    assert result.estimate["speed"] == pytest.approx(7.0, abs=1)
    draws = result.draws()
    np.testing.assert_allclose(
        np.cov(draws.T), [list(row.values()) for row in result.covariance.values()]
    )
    np.testing.assert_allclose(result.interval["speed"], np.quantile(draws[:, 0], [0.05, 0.95]))
    np.testing.assert_allclose(list(result.estimate.values()), np.median(draws, axis=0))
    stored = json.loads((result.path / "result.json").read_text())
    assert stored["covariance"] == result.covariance
    assert result.draws(5, seed=2).shape == (5, 2)
    np.testing.assert_array_equal(
        tl.load_run(result.path).draws(5, seed=2), result.draws(5, seed=2)
    )


@pytest.mark.parametrize("ends", [(-1.0, 1.0), None])
@pytest.mark.parametrize(
    ("share", "matched", "estimate", "high"),
    [
        (0.0, 0.98, 0.95, 0.98),
        (0.0, 0.995, 0.95, None),
        (0.1, 0.98, 0.95, None),
        (0.6, 0.98, None, None),
    ],
)
def test_where_models_end_the_interval_reaches_the_end(share, matched, estimate, high, ends):
    end = np.inf if ends is None else 1.0
    draws, tried = np.full((10, 2), [[0.95, 0.95]]), np.full((100, 2), [[0.9, 0.9]])
    tried[: round(100 * share)] = 1.0
    low, upper = np.full(2, 0.9), np.full(2, matched)
    found = SimpleNamespace(interval_low=low, interval_high=upper, draws=draws)
    ends = {"saturated": [True, False], "end": end}
    space = SearchSpace.between([-1.0, -1.0], [1.0, 1.0], **ends)
    stated, interval = _readout.estimate_and_interval(found, tried, space)
    assert stated.tolist() == [end if estimate is None else estimate, 0.95]
    assert interval.tolist() == [[0.9, 0.9], [end if high is None else high, matched]]


def test_a_run_of_generations_has_no_draws():
    result = tl.infer("aggregation", generations=2, settings={**SMALL, "models.population": 6})
    assert isinstance(result, tl.Evolution)
    assert not hasattr(result, "draws")


def test_no_model_of_a_custom_system_is_tried_beyond_a_range_that_ends_at_its_bounds(tmp_path):
    speeds(tmp_path / "run", trials=60)
    tried = np.concatenate(
        [np.load(path)["parameters"] for path in (tmp_path / "run" / "buffer").iterdir()]
    )
    assert np.abs(tried).max() <= 1  # beyond, a model is the mirror image of another


def test_trials_and_generations_are_not_given_together():
    with pytest.raises(
        ConfigurationError,
        match=r"`trials` must be given without `generations`; got 100 beside 5\.",
    ):
        tl.infer("aggregation", trials=100, generations=5)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"run.trials": 5}, r"`run\.trials` must be 0, or at least 20; got 5"),
        (
            {"run.trials": 100, "models.hidden": 3},
            r"`run\.trials` must be 0 where models are networks",
        ),
        (
            {"run.tolerance": 0.1, "run.generations": 5},
            r"`run\.tolerance` must be 0 without `run\.trials`; got 0\.1",
        ),
        (
            {"run.trials": 600, "run.batch": 64},
            r"`run\.batch` must be 0, or from 2 to a tenth of run\.trials, 60; got 64",
        ),
        (
            {"run.trials": 100, "run.extended": [[200, 100]]},
            r"`run\.extended` must be pairs of trials",
        ),
    ],
)
def test_trials_that_cannot_be_are_rejected(settings, message):
    with pytest.raises(ConfigurationError, match=message):
        tl.infer("aggregation", settings=settings)


def test_a_run_of_generations_states_its_trials_too():
    result = tl.infer("aggregation", generations=2, settings={**SMALL, "models.population": 6})
    assert result.trials == 12


def test_a_history_that_is_shorter_than_the_result_is_not_shown(whole, tmp_path):
    path = shutil.copytree(whole.path, tmp_path / "run")
    max((path / "checkpoints").iterdir()).unlink()
    result = tl.load_run(path)
    assert result.estimate == whole.estimate
    with pytest.raises(
        RunFolderError, match=r"its last checkpoint as it was written; got .*generations is left"
    ):
        _ = result.history


def test_a_pool_mixes_the_draws_of_the_runs_that_have_settled():
    runs = [speeds(seed=seed, trials=60)[1] for seed in (4, 5, 6)]
    assert all(run.covariance is not None for run in runs)
    pooled = tl.pool(
        [*runs[:2], replace(runs[2], covariance=None)]
    )  # as if the third had not settled
    draws = np.concatenate([run.draws()[:, 0] for run in runs[:2]])
    np.testing.assert_allclose(pooled.interval["speed"], np.quantile(draws, [0.05, 0.95]))
    assert pooled.interval["inert"] == [0, 20]
    assert pooled.estimate["speed"] == np.mean(pooled.estimates["speed"][:2])
    assert set(pooled.runs_agree.values()) == {"agree"}
    assert "3 runs, seeds 4, 5, 6, 60 trials" in str(pooled)


def test_a_pool_spans_the_draws_of_runs_that_disagree():
    draws = [np.random.default_rng(seed).normal((0, 5 * seed), 1, (500, 2)) for seed in (0, 1)]
    intervals = [np.quantile(each, (0.05, 0.95), axis=0).T.tolist() for each in draws]
    ends, birge = mixed_interval(draws, intervals, 2)
    np.testing.assert_allclose(ends, np.quantile(np.concatenate(draws), (0.05, 0.95), axis=0).T)
    assert birge[0] < 0.2
    assert birge[1] == pytest.approx(5 / np.sqrt(2), rel=0.1)


def test_runs_that_have_not_settled_have_an_estimate_and_no_interval():
    runs = [tl.infer("aggregation", trials=40, seed=seed, settings=SMALL) for seed in (1, 2)]
    assert all(run.covariance is None for run in runs)
    pooled = tl.pool(runs)
    assert pooled.runs_agree == dict.fromkeys(pooled.estimate, "unknown")
    assert "at most one run has settled" in str(pooled)


def test_a_run_of_trials_is_checked(walked, tmp_path):
    known, result = walked
    path = shutil.copytree(result.path, tmp_path / "run")
    result = tl.load_run(path)
    effort = Effort(samples=100, points=6)
    check = result.check(effort=effort, recoveries=1, **known)
    assert check.verdicts == result.verdicts == tl.load_run(path).verdicts
    assert check.judgment.line in str(result)
    # After 60 trials models differ, and each is told from the others more or less: with seeds 1 to 30
    # of the run these 90 accuracies are from 0.33 to 0.85, in the median 0.56.
    assert all(0.25 < one < 0.95 for each in check.recoveries for one in each.attainable)
    speed, inert = check.parameters
    assert speed.pinned_down
    assert inert.reasons
    assert tl.load_run(path).check(effort=effort, recoveries=1, **known) == check
    with pytest.raises(
        ConfigurationError,
        match="`recovery_generations` must be left out for a run of trials; got 5",
    ):
        result.check(recovery_generations=5)


def test_a_run_whose_simulator_fails_says_so_and_is_resumed_to_the_same_bits(tmp_path):
    calls = []

    def broken(parameters, rng):
        calls.append(len(parameters))
        if len(calls) > 4:
            raise OSError("no license")
        return drift(parameters, rng)

    given = {
        "genuine": drift(np.full((30, 2), 0.4), np.random.default_rng(5)),
        "seed": 3,
        "trials": 24,
    }
    given |= {"parameters": {"speed": (-1, 1), "nothing": (-1, 1)}, "settings": {"run.threads": 1}}
    expected = tl.infer(simulate=drift, **given)
    with pytest.raises(CustomSystemError, match="no license"):
        tl.infer(simulate=broken, out=tmp_path / "run", **given)
    assert tl.load_run(tmp_path / "run").trials < 24
    found = tl.resume(tmp_path / "run", genuine=given["genuine"], simulate=drift)
    assert (found.trials, found.estimate) == (24, expected.estimate)


def squares(parameters, rng):
    """Return samples (M, 20, 1) whose mean is the square of a parameter: its sign does not show."""
    return parameters[:, :1, None] ** 2 + rng.standard_normal((len(parameters), 20, 1))


TWO_SOLUTIONS = {
    "genuine": squares(np.full((60, 1), 1.5), np.random.default_rng(1)),
    "parameters": {"root": (-3.0, 3.0)},
    "trials": 400,
    "seed": 1,
    "settings": {"run.threads": 1},
}


@pytest.fixture(scope="module")
def two_solutions():
    """The result of a run with two solutions."""
    return tl.infer(simulate=squares, **TWO_SOLUTIONS)


def test_two_solutions_are_found_and_stated(two_solutions):
    result = two_solutions
    assert result.verdict == "several solutions"
    assert sorted(np.sign(mode.estimate["root"]) for mode in result.modes) == [-1, 1]
    assert sum(mode.weight for mode in result.modes) == pytest.approx(1, abs=0.01)
    low, high = result.interval["root"]
    assert low < -1.4 < 1.4 < high
    ends = [mode.interval["root"] for mode in result.modes]
    assert (low, high) == (min(ends)[0], max(ends)[1])


def test_the_text_on_methods_states_each_solution(two_solutions):
    text = methods_text(two_solutions, {})
    assert "Estimates and 90 % intervals of 2 solutions: (1) with " in text
    for number, mode in enumerate(two_solutions.modes, start=1):
        low, high = mode.interval["root"]
        stated = f"root {mode.estimate['root']:.3f} [{low:.3f}, {high:.3f}]"
        assert f"({number}) with {mode.weight:.0%} of the draws: {stated}" in text


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
def test_a_simulator_that_fails_in_the_examination_leaves_a_run_to_resume(tolerance, tmp_path):
    spent = []

    def breaking(parameters, rng):
        if spent:
            raise OSError("license expired")
        return drift(parameters, rng)

    path = tmp_path / "run"
    options = {
        "simulate": breaking,
        "genuine": drift(np.full((60, 1), 7.0), np.random.default_rng(1)),
    }
    with pytest.raises(CustomSystemError) as caught:
        tl.infer(
            **options,
            parameters={"speed": (0.0, 20.0)},
            trials=300,
            seed=1,
            tolerance=tolerance,
            settings={"run.threads": 1},
            out=path,
            observer=lambda progress: spent.extend([1] * progress.last),
        )
    stored = tl.load_run(path)
    text = str(caught.value)
    assert "of the examination; got" in text
    assert "generation" not in text
    assert f" {stored.trials} trials are stored; resume with `turing_learning.resume(" in text
    assert json.loads((path / "manifest.json").read_text())["state"] == "stopped"
    assert (stored.trials < 300) == bool(tolerance)
    assert stored.judgment.line == (
        "Verdict: not yet examined. All trials are spent, but the estimate is not yet examined: resume the run."
    )
    assert "The run's verdict is: not yet examined." in methods_text(stored, {})
    spent.clear()
    assert tl.resume(path, **options).verdict == "converged"


def test_a_run_that_has_noticed_two_solutions_is_resumed_to_the_same_bits(two_solutions, tmp_path):
    calls = []

    def broken(parameters, rng):
        calls.append(len(parameters))
        if len(calls) > 14:  # ten batches, and a look at the walkers before
            raise OSError("no license")
        return squares(parameters, rng)

    with pytest.raises(CustomSystemError, match="no license"):
        tl.infer(simulate=broken, out=tmp_path / "run", **TWO_SOLUTIONS)
    genuine = TWO_SOLUTIONS["genuine"]
    found = tl.resume(tmp_path / "run", genuine=genuine, simulate=squares)
    assert found.modes == two_solutions.modes
    assert tl.load_run(tmp_path / "run").modes == found.modes
    assert len(json.loads((tmp_path / "run" / "result.json").read_text())["modes"]) == 2


def test_a_simulator_without_noise_is_inferred():
    def swing(parameters, rng):
        return (parameters[:, :1] * np.sin(parameters[:, 1:] * np.arange(30) / 10))[:, :, None]

    genuine = swing(np.full((20, 2), [1.3, 2.2]), np.random.default_rng(1))
    ranges = {"height": (0.1, 3.0), "rate": (0.5, 5.0)}
    result = tl.infer(genuine=genuine, simulate=swing, parameters=ranges, trials=600, seed=2)
    assert result.estimate["height"] == pytest.approx(1.3, abs=0.01)
    assert result.estimate["rate"] == pytest.approx(2.2, abs=0.01)


TRUTH = np.array([12.0, 0.5, 0.8, 0.5])
TANK = (40.0, 40.0)


def recorded(averaged=1, frames=2000, individuals=6):
    """Return a run on a group that bursts and coasts, its windows, and the family as they were recorded."""
    rng = np.random.default_rng(1)
    group = BurstAndCoast(steps=frames - 2, individuals=individuals, interval_s=0.1, tank_cm=TANK)
    positions = group.simulate(TRUTH[None], rng)[0]
    # what a tracker does that smooths: the family cannot
    positions = np.mean([positions[k : len(positions) - averaged + k] for k in range(averaged)], 0)
    present = np.ones(positions.shape[:2], dtype=bool)
    names = tuple("abcdef"[:individuals])
    recording = Trajectories(positions, present, 10.0, names)
    windows = recording.windows(length_s=4.0, signals=("speed", "turn"))
    family = as_recorded(BurstAndCoast, recording, windows, tanks=[TANK])
    run = tl.infer(
        genuine=windows, simulate=family, parameters=family.parameters, trials=20, seed=1
    )
    return run, windows, family


def panel_says(run, genuine, simulate, spread=0.02):
    """Return what the panel says of models around the truth."""
    rng = np.random.default_rng(2)
    draws = TRUTH * np.exp(spread * rng.standard_normal((100, 4)))
    with run.configuration.system.open(Arguments(genuine, simulate)) as source:
        said = panel_examination(run.configuration, source, draws)
        assert source.generation == 0
        assert source.failures.count == 0
    return said


@pytest.mark.parametrize("averaged", [1, 5])
def test_a_panel_tells_models_that_lack_what_was_recorded(averaged):
    said = panel_says(*recorded(averaged))
    assert bool(said["told_by_panel"]) == (averaged > 1)


def test_a_wide_posterior_is_not_told_because_it_is_wide(monkeypatch):
    right = recorded()
    asked = []
    references = _loops.reference_accuracies

    def noted(*arguments, **options):
        for accuracy in references(*arguments, **options):
            asked.append(accuracy)
            yield accuracy

    monkeypatch.setattr(_loops, "reference_accuracies", noted)
    assert not panel_says(*right, spread=0.8)["told_by_panel"]
    # the panel tells them: only its margin excuses them, and the first that is told as well is enough
    assert asked
    assert np.argmax(asked) == len(asked) - 1
    assert len(asked) < _loops.PANEL_EFFORT.references


@pytest.mark.parametrize(
    ("usual", "asked", "told"),
    [
        # the first, the last and none of them is told as well as the models
        ((0.8, 0.5, 0.5, 0.5), 1, False),
        ((0.5, 0.5, 0.5, 0.7), 4, False),
        ((0.5, 0.51, 0.52, 0.5), 4, True),
        # their limit is above the models, though each of them is below
        ((0.5, 0.69, 0.5, 0.65), 4, False),
    ],
)
def test_a_panel_that_asks_no_further_says_what_all_references_say(monkeypatch, usual, asked, told):
    said = TwoSampleTest(
        accuracy=0.7,
        p_value=0.001,
        critical=0.6,
        genuine_samples=40,
        genuine_groups=8,
        counterfeit_samples=100,
        counterfeit_groups=20,
        grouping="one sample",
    )
    rest = iter(usual)
    monkeypatch.setattr(_loops, "evidence_of", lambda *_: None)
    monkeypatch.setattr(_loops, "two_sample_test", lambda *_, **__: said)
    monkeypatch.setattr(_loops, "reference_accuracies", lambda *_, **__: rest)
    run = SimpleNamespace(run=SimpleNamespace(seed=1))
    source = SimpleNamespace(cheap=True, genuine=None, independent=None, generation=0)
    of_all = Judgment(examination=replace(said, plausible=usual)).fits is False
    assert panel_examination(run, source, None) == {"told_by_panel": of_all}
    assert (of_all, len(usual) - len(list(rest))) == (told, asked)


class Failing(BurstAndCoast):
    """A family whose simulations fail."""

    def __call__(self, parameters, rng):
        raise RuntimeError("no more")


def test_a_panel_is_silent_where_it_cannot_be_asked():
    run, windows, family = recorded()
    # a function of a user may cost anything
    assert panel_says(run, windows, lambda parameters, rng: family(parameters, rng)) == {}

    # most simulations fail
    assert panel_says(run, windows, Failing(**vars(family))) == {}
    # too little is held out
    few = recorded(frames=260, individuals=2)
    assert len(few[1].held_out) < 4
    assert panel_says(*few) == {}


def test_a_batch_has_as_many_trials_as_are_asked_for():
    sizes = []
    result = tl.infer(
        "aggregation",
        trials=TRIALS,
        seed=3,
        settings=SMALL | {"run.batch": 4},
        observer=lambda progress: sizes.append(len(progress.batch.models)),
    )
    assert result.complete
    assert sum(sizes) == TRIALS
    assert set(sizes[1:]) == {4}
    assert len(sizes) == result.configuration.length


def test_what_a_panel_tells_is_said_and_intervals_stay(monkeypatch):
    told = {"told_by_panel": np.array(True)}
    monkeypatch.setattr(_loops, "panel_examination", lambda *of: told)
    whole = inferred()
    monkeypatch.undo()
    usual = inferred()
    assert whole.interval == usual.interval
    assert not math.isnan(whole.interval["vl0"][0])
    assert {*whole.found} - {*usual.found} == {Verdict.DIFFERENT}


def test_what_no_model_explains_is_said_and_no_interval_stated(monkeypatch):
    monkeypatch.setattr(Source, "told_by_phases", lambda self, *of: True)
    told = inferred()
    other = inferred(seed=4)
    monkeypatch.undo()
    usual = inferred()
    assert not math.isnan(usual.interval["vl0"][0])
    assert all(math.isnan(end) for ends in told.interval.values() for end in ends)
    assert told.verdict is Verdict.PHASES
    remedy = "wait for a random part of a cycle"
    assert remedy in told.verdict.meaning
    # more trials are no remedy, and nothing says so
    assert told.unknown == ""
    with pytest.raises(RuntimeError, match=f"got one whose phases differ.*{remedy}"):
        told.draws()
    pooled = tl.pool([told, other])
    assert pooled.verdict is Verdict.PHASES
    assert "unknown for vl0, vr0, vl1, vr1: phases differ, which more trials" in str(pooled)
    assert "more trials." not in str(told) + str(pooled)
    with pytest.raises(ValueError, match=f"`pool` must have .*{remedy}"):
        pooled.to_xarray()


def test_a_run_and_its_report_leave_packages_of_named_arrays_alone(tmp_path):
    code = (
        "import sys, turing_learning as tl;"
        f"tl.infer('aggregation', trials=20, seed=1, settings={SMALL!r}, out={str(tmp_path / 'run')!r});"
        "sys.exit(bool({'xarray', 'pandas', 'scipy.stats'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert (tmp_path / "run" / "report.html").is_file()


def drifting(parameters, rng):
    """Steps of a particle: only mobility x heat and mobility x force show."""
    mobility, heat, force = parameters.T[..., None]
    shocks = rng.standard_normal((len(parameters), 60))
    return (mobility * force + np.sqrt(2 * mobility * heat) * shocks)[..., None]


RIDGE = {
    "genuine": drifting(np.tile([2.5, 2.0, 2.0], (60, 1)), np.random.default_rng(1)),
    "parameters": {"mobility": (0.1, 10.0), "heat": (0.1, 10.0), "force": (0.1, 10.0)},
    "vectorized": True,
    "trials": 600,
    "seed": 2,
    "progress": False,
}


def test_intervals_reach_all_along_a_ridge_also_after_a_resume(tmp_path):
    calls = []

    def broken(parameters, rng):
        calls.append(len(parameters))
        if len(calls) > 20:
            raise OSError("no license")
        return drifting(parameters, rng)

    whole = tl.infer(simulate=drifting, **RIDGE)
    assert len(whole.ridge) == 2
    assert {"mobility x heat", "mobility x force"} & {*whole.ridge}
    # what shows of 2.5 and 2 goes from 0.5 to 10, a twentieth of it beyond 5
    low, high = whole.interval["mobility"]
    assert low < 0.7
    assert high > 3.5
    # the estimate keeps what shows of the draws; medians do not, one by one
    mobility, heat, _ = whole.draws().T
    estimate = whole.estimate
    assert whole.modes[0].estimate == estimate
    assert "mobility x heat" in whole.ridge
    heating = np.median(mobility * heat)
    assert estimate["mobility"] * estimate["heat"] == pytest.approx(heating, rel=1e-6)
    assert np.median(mobility) * np.median(heat) != pytest.approx(heating, rel=1e-3)
    for name, (lowest, highest) in whole.interval.items():
        assert lowest < estimate[name] < highest
    assert "only " + " and ".join(whole.ridge) + " show" in str(whole)
    with pytest.raises(CustomSystemError, match="no license"):
        tl.infer(simulate=broken, out=tmp_path / "run", **RIDGE)
    resumed = tl.resume(tmp_path / "run", genuine=RIDGE["genuine"], simulate=drifting)
    assert (resumed.ridge, resumed.interval) == (whole.ridge, whole.interval)
    assert tl.load_run(tmp_path / "run").ridge == whole.ridge
    assert methods_text(resumed, {}).count("as good") == 1


@pytest.mark.parametrize("seed", [3, 4])
def test_a_ridge_is_found_where_its_two_sides_were_taken_for_images(seed):
    # heat and force are alike in the truth, so that a run may follow their exchange
    result = tl.infer(simulate=drifting, **RIDGE | {"seed": seed})
    assert len(result.ridge) == 2
    low, high = result.interval["mobility"]
    assert low < 0.7
    assert high > 3.5


def test_a_pool_states_the_ridge_that_half_of_its_runs_state():
    first = tl.infer(simulate=drifting, **RIDGE | {"trials": 200})
    seeds = range(1, 5)

    def pooled(*ridges):
        """Pool runs that differ in their ridges and estimates alone."""
        runs = []
        for seed, ridge in zip(seeds, ridges, strict=False):
            estimate = {name: value + seed for name, value in first.estimate.items()}
            runs.append(replace(first, seed=seed, ridge=ridge, estimate=estimate))
        return tl.pool(runs), runs

    product, quotient = ("mobility x heat",), ("heat / force",)
    together, runs = pooled(product, quotient)
    assert tl.pool(runs[::-1]).estimate == together.estimate
    assert together.ridge == quotient  # as many state the other: the first by its text
    assert together.estimate == runs[1].estimate
    together, runs = pooled(product, (), ())
    assert together.ridge == ()
    assert together.estimate == runs[1].estimate  # the median
    together, runs = pooled(product, product, (), ())
    assert together.ridge == product
    assert together.estimate == runs[1].estimate
