import numpy as np
import pytest

from turing_learning.coevolution import Samples
from turing_learning.evolution import EvolutionStrategy
from turing_learning.few_trials import (
    FewTrials,
    SearchSpace,
    _loop,
    _readout,
    _search,
    batch_schedule,
)

TRUTH = np.array([1.5, 0.5])
STEPS = 20


class Walk:
    """Samples with a mean and a slope."""

    def __init__(self):
        self.trials, self.failed = 0, np.zeros(0, bool)

    def collect(self, models, rng):
        self.trials += len(models)
        self.failed = np.zeros(len(models), bool)
        self.failed[5::7] = True
        time = np.linspace(-1, 1, STEPS)

        def motion(parameters):
            noise = 0.5 * rng.standard_normal((len(parameters), STEPS))
            return (parameters[:, :1] + parameters[:, 1:] * time + noise)[..., None]

        counterfeit = motion(models)
        counterfeit[self.failed] = 0
        return Samples(motion(np.tile(TRUTH, (3 * len(models), 1))), counterfeit[:, None])


class Slopes:
    """A sigmoid of a weighted sum of the steps."""

    parameters = STEPS + 1

    def judge(self, genomes, samples):
        z = np.clip(genomes[:, 1:] @ samples[:, :, 0].T / 4 + genomes[:, :1], -30, 30)
        return (1 / (1 + np.exp(-z))).astype(np.float32)

    def draw(self, count, samples, rng):
        return rng.standard_normal((count, self.parameters))


def begun(trials=300, source=None, seed=1, **options):
    return FewTrials(
        source or Walk(),
        Slopes(),
        EvolutionStrategy(Slopes.parameters, parents=10, offspring=10, seed=3),
        SearchSpace.between([0.0, -2.0], [4.0, 2.0]),
        trials=trials,
        seed=seed,
        **{"observers": Slopes(), **options},
    )


def finished(run, batches=None):
    for k, _ in enumerate(run, 1):
        if k == batches:
            break
    return run


def test_three_hundred_trials_tell_what_they_can():
    run = finished(begun())
    # A trial tells the mean to 0.5 / sqrt(20) = 0.11 and the slope to 0.18; 200 of them and more lie near the truth.
    np.testing.assert_allclose(run.estimate, TRUTH, atol=0.08)
    assert (run.batch.spread < [0.2, 0.25]).all()
    assert run.batch.misfit < 4


def test_trials_are_those_of_the_source_and_no_more():
    source = Walk()
    run = begun(101, source)
    spent = [batch.trials for batch in run]
    assert source.trials == spent[-1] == len(run.buffer) == 101
    assert spent == sorted(set(spent))


@pytest.mark.parametrize("recorded", [True, False])
def test_observers_are_drawn_anew_for_recorded_samples_only(monkeypatch, recorded):
    monkeypatch.setattr(_loop, "STILL", 2.0)  # outputs are 0 to 1: all of them vary less
    source = Walk()
    genuine = source.collect(np.tile(TRUTH, (30, 1)), np.random.default_rng(2)).genuine
    run = begun(source=source, genuine=genuine if recorded else None)
    run.step()
    drawn = run.state()["drawn"]
    for _ in range(3):
        run.step()
    assert (run.state()["drawn"] == drawn).all() != recorded


def test_failed_trials_count_and_are_not_matched():
    run = finished(begun(100))
    assert 0 < (~run.buffer.usable).sum() < 30
    assert np.abs(run.estimate - TRUTH).max() < 0.3


def test_a_fixed_recording_is_taken_as_it_is():
    recording = Walk().collect(np.zeros((20, 2)), np.random.default_rng(5)).genuine
    run = finished(begun(120, genuine=recording))
    np.testing.assert_array_equal(run.buffer.genuine, recording.astype(np.float32))
    assert np.abs(run.estimate - TRUTH).max() < 0.3


def test_a_resumed_run_is_the_same_to_the_bit():
    whole, half = (
        begun(310),
        finished(begun(310), batches=36),
    )  # at its end, a map of all trials joins in
    part = begun(310)
    part.restore(half.state())
    np.testing.assert_array_equal(part.batch.estimate, half.batch.estimate)
    for run in (whole, part):
        finished(run)
    for name, value in whole.state().items():
        np.testing.assert_array_equal(part.state()[name], value, err_msg=name)


def test_a_run_resumes_after_each_batch():
    run, copies = begun(40), begun(40)
    while not run.complete:
        run.step()
        copies.step()
        state = copies.state()
        copies = begun(40)
        copies.restore(state)
    np.testing.assert_array_equal(copies.draws, run.draws)


@pytest.mark.parametrize(
    "spent", [40, 26]
)  # all that it had; fewer, because it was stopped by its tolerance
def test_a_finished_run_with_more_trials_is_the_run_that_was_to_be_extended(spent):
    short = begun(40)
    while len(short.buffer) < spent:
        short.step()
    if spent < 40:
        short.average()
    longer, whole = (begun(700, extended=[(40, spent)]) for _ in range(2))
    longer.restore(short.state())
    finished(longer, 1)
    resumed = begun(700, extended=[(40, spent)])
    resumed.restore(longer.state())
    finished(resumed, 1)
    while len(whole.buffer) < len(resumed.buffer):
        whole.step()
    assert whole.buffer.pool_size == 700  # of a run of 40 trials it is 500
    for name, value in whole.state().items():
        np.testing.assert_array_equal(resumed.state()[name], value, err_msg=name)


def test_the_schedule_of_batches():
    assert batch_schedule(1000, 4)[:3] == [100, 123, 146]
    assert batch_schedule(1000, 4)[-1] == 1000
    extended = batch_schedule(3000, 4, [(1000, 146)])
    assert extended[:4] == [100, 123, 146, 146 + 71]
    assert extended[-1] == 3000
    # what is left over comes first: 160 + 2840 % 64
    given = batch_schedule(3000, 4, batch=64)
    assert given[:3] == [184, 248, 312]
    assert given[-2:] == [2936, 3000]
    assert batch_schedule(3000, 4, [(1000, 168)], batch=64)[:3] == [104, 168, 232]


def test_a_run_with_a_batch_of_its_own_resumes_to_the_bit():
    whole, begun_again = begun(200, batch=16), begun(200, batch=16)
    stopped = finished(begun(200, batch=16), 3)
    assert stopped.spent == 20 + 180 % 16 + 2 * 16
    begun_again.restore(stopped.state())
    np.testing.assert_array_equal(finished(begun_again).draws, finished(whole).draws)


def test_seeds_differ():
    assert not np.array_equal(finished(begun(40)).estimate, finished(begun(40, seed=2)).estimate)


@pytest.fixture
def lost(monkeypatch):
    """Each run is held to be lost, also a short one."""
    monkeypatch.setattr(_search, "LOST_MISFIT", 0.0)
    monkeypatch.setattr(_loop, "FEWEST_TO_SEARCH", 10)
    monkeypatch.setattr(_readout, "FEWEST_IN_SHARE", 60)


def test_a_lost_run_settles_and_resumes_to_the_bit(lost):
    run, copies = begun(400, searches=True, seed=2), begun(400, searches=True, seed=2)
    decided = None
    while not run.complete:
        for each in (run, copies):
            each.step()
        if run.search.decided and decided is None:
            decided = run.spent
            assert len(run.search.centers) > 1
        assert not run.decision_due
        state = copies.state()
        copies = begun(400, searches=True, seed=2)
        copies.restore(state)
    assert 320 <= decided < 340
    np.testing.assert_array_equal(copies.draws, run.draws)
    assert np.abs(run.estimate - TRUTH).max() < 0.1


def test_a_state_of_a_run_that_knew_no_searches_is_that_of_one_that_is_not_lost(lost):
    run = finished(begun(100, searches=True), 30)
    assert run.search.lost
    old = {name: value for name, value in run.state().items() if not name.startswith("climb/")}
    restored = begun(100, searches=True)
    restored.restore(old)
    assert not restored.search.lost


def test_a_run_that_does_not_search_is_not_lost(lost):
    assert not finished(begun(60)).search.lost


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (lambda: begun(9), "`trials` must be an integer of at least 10; got 9"),
        (lambda: begun(seed=-1), "`seed` must be an integer of at least 0; got -1"),
        (
            lambda: finished(begun(20)).step(),
            "`trials` must be more than the run has spent; got 20",
        ),
        (
            lambda: finished(begun(40), 3).go_on_around(np.zeros((5, 2))),
            "`trials` must be those of a lost run",
        ),
        (lambda: begun().restore({}), "`state` must be that of an estimate from few trials"),
    ],
)
def test_what_does_not_fit_is_rejected(do, message):
    with pytest.raises(ValueError, match=message):
        do()


@pytest.mark.parametrize("recorded", [True, False])
def test_draws_are_wider_where_walkers_of_a_recording_are_elsewhere(monkeypatch, recorded):
    genuine = Walk().collect(np.tile(TRUTH, (30, 1)), np.random.default_rng(2)).genuine
    run = finished(begun(genuine=genuine if recorded else None))
    monkeypatch.setattr(_loop, "birge_ratio", lambda draws, walkers: 1.0)
    narrow = run.readout()
    monkeypatch.setattr(_loop, "birge_ratio", lambda draws, walkers: 1.5)
    wide = run.readout()
    middle = narrow["estimate"]
    np.testing.assert_allclose(wide["estimate"], middle)
    factor = 1.5 if recorded else 1.0
    for name in ("interval", "mode_interval", "draws"):
        np.testing.assert_allclose(wide[name] - middle, factor * (narrow[name] - middle))


def test_walkers_disagree_with_draws_that_are_farther_away_than_they_spread():
    walkers = np.array([[-1.0, -2.0], [1.0, 2.0]])  # of standard deviations 1 and 2
    draws = np.zeros((3, 2))
    assert _readout.birge_ratio(draws, walkers) == 1
    # 2 and 1 standard deviations: a mean square of 5 / 2
    assert _readout.birge_ratio(draws + 2, walkers) == pytest.approx(np.sqrt(2 * 5 / 2))


def test_wider_draws_of_each_solution_keep_their_median_and_stay_in_the_space():
    draws = np.concatenate([np.linspace(-0.9, -0.5, 41), np.linspace(0.1, 0.3, 21)])[:, None]
    mode = np.repeat([0, 1], [41, 21])
    wide = _readout.widened(draws, mode, 3.0, np.ones(1))
    np.testing.assert_allclose(np.median(wide[mode == 0]), -0.7)
    np.testing.assert_allclose(np.median(wide[mode == 1]), 0.2)
    np.testing.assert_allclose([wide.min(), wide[mode == 1].max()], [-1.0, 0.5])


def test_a_run_is_not_tolerated_where_walkers_are_elsewhere(monkeypatch):
    genuine = Walk().collect(np.tile(TRUTH, (30, 1)), np.random.default_rng(2)).genuine
    known = {"genuine": genuine, "tolerance": 0.3}
    assert finished(begun(**known)).tolerated
    monkeypatch.setattr(_loop, "birge_ratio", lambda draws, walkers: 100.0)
    assert not finished(begun(**known)).tolerated
