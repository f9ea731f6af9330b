import numpy as np
import pytest

from turing_learning.few_trials import PooledClassifier


def samples(count=40, steps=50, signals=2, seed=0):
    return np.random.default_rng(seed).standard_normal((count, steps, signals))


def mean_of_windows(genome, sample):
    taps, gap, threshold = int(genome[0]), int(genome[1]), genome[2]
    weights = genome[3 : 3 + taps * sample.shape[1]].reshape(taps, -1)
    reach = (taps - 1) * gap
    z = [
        threshold + (weights * sample[t : t + reach + 1 : gap]).sum()
        for t in range(len(sample) - reach)
    ]
    return np.mean(1 / (1 + np.exp(-np.array(z))))


@pytest.mark.parametrize("signals", [1, 3])
def test_the_output_is_the_mean_of_a_neuron_over_all_windows(signals):
    motion, scale = samples(signals=signals), np.arange(1.0, signals + 1)
    judge = PooledClassifier(inputs=signals, scale=scale)
    genomes = judge.draw(18, motion, np.random.default_rng(1))
    expected = [
        [mean_of_windows(genome, sample / scale) for sample in motion] for genome in genomes
    ]
    np.testing.assert_allclose(judge.judge(genomes, motion), expected, atol=2e-5)


def test_an_output_depends_neither_on_the_threads_nor_on_the_samples_beside():
    motion = samples(100)
    genomes = PooledClassifier().draw(9, motion, np.random.default_rng(1))
    outputs = PooledClassifier(threads=1).judge(genomes, motion)
    np.testing.assert_array_equal(outputs, PooledClassifier(threads=3).judge(genomes, motion))
    np.testing.assert_array_equal(
        outputs[:, 37:45], PooledClassifier().judge(genomes, motion[37:45])
    )


@pytest.mark.parametrize(("steps", "longest"), [(1, 1), (3, 2), (100, 46)])
def test_windows_fit_into_the_samples(steps, longest):
    genomes = PooledClassifier().draw(90, samples(steps=steps), np.random.default_rng(1))
    windows = 1 + (genomes[:, 0] - 1) * genomes[:, 1]
    assert windows.min() == 1
    assert windows.max() == longest


def test_each_threshold_lies_at_a_moment_that_was_observed():
    constant = np.full((5, 20, 2), 0.7)
    judge = PooledClassifier()
    genomes = judge.draw(30, constant, np.random.default_rng(1))
    np.testing.assert_allclose(judge.judge(genomes, constant), 0.5, atol=1e-5)


def test_huge_values_are_judged():
    judge = PooledClassifier()
    outputs = judge.judge(judge.draw(20, samples(), np.random.default_rng(1)), 1e300 * samples())
    assert ((outputs >= 0) & (outputs <= 1)).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PooledClassifier(inputs=0), "`inputs` must be an integer of at least 1; got 0"),
        (
            lambda: PooledClassifier(scale=(1.0,)),
            r"`scale` must be of shape \(D,\) = \(2,\); got \(1,\)",
        ),
        (lambda: PooledClassifier(scale=(1.0, 0.0)), "`scale` must hold positive numbers"),
        (
            lambda: PooledClassifier().judge(
                np.array([[8.0, 3.0, *np.zeros(33)]]), samples(steps=20)
            ),
            "`samples` must have at least 22 time steps; got 20",
        ),
        (
            lambda: PooledClassifier().judge(np.zeros((1, 4)), samples()),
            r"`genomes` must be of shape \(N, Q\)",
        ),
    ],
)
def test_what_cannot_be_judged_is_rejected(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_half_of_the_neurons_see_changes_of_a_signal_that_wanders_and_no_other():
    rng = np.random.default_rng(1)
    wandering = np.cumsum(rng.standard_normal((40, 100, 2)), axis=1) * 1e3
    wandering[..., 1] = rng.standard_normal((40, 100))
    genomes = PooledClassifier().draw(90, wandering, rng)
    weights = genomes[:, 3:].reshape(90, 16, 2).sum(axis=1)
    changes = np.abs(weights[:, 0]) < 1e-9
    assert 0.4 < changes[genomes[:, 0] > 1].mean() < 0.6
    assert (np.abs(weights[:, 1]) > 1e-9).all()
    # however large the values are, some neurons neither always nor never fire
    outputs = PooledClassifier().judge(genomes[changes], wandering)
    assert np.median(outputs.std(axis=1)) > 0.02
