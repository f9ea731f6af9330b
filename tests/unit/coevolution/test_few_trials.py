import numpy as np
import pytest

from turing_learning.coevolution import FewTrials, Samples
from turing_learning.evolution import EvolutionStrategy

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
        low=[0.0, -2.0],
        high=[4.0, 2.0],
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


def test_evolved_classifiers_do_without_observers():
    assert np.abs(finished(begun(150, observers=None)).estimate - TRUTH).max() < 0.3


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
    whole, half = begun(310), finished(begun(310), batches=36)  # at its end, a map of all trials joins in
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


def test_a_finished_run_takes_more_trials():
    short = finished(begun(40))
    longer = begun(60)
    longer.restore(short.state())
    assert finished(longer).batch.trials == 60
    np.testing.assert_array_equal(longer.buffer.parameters[:40], short.buffer.parameters)


def test_seeds_differ():
    assert not np.array_equal(finished(begun(40)).estimate, finished(begun(40, seed=2)).estimate)


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (lambda: begun(9), "`trials` must be an integer of at least 10; got 9"),
        (lambda: begun(seed=-1), "`seed` must be an integer of at least 0; got -1"),
        (lambda: finished(begun(20)).step(), "`trials` must be more than the run has spent; got 20"),
        (lambda: begun().restore({}), "`state` must be that of an estimate from few trials"),
    ],
)
def test_what_does_not_fit_is_rejected(do, message):
    with pytest.raises(ValueError, match=message):
        do()
