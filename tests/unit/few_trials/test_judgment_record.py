import numpy as np
import pytest

from turing_learning.few_trials import SampleBuffer
from turing_learning.few_trials._buffer import JudgmentRecord


class Counting:
    """A classifier that counts what it judges; its output is the mean of a sample times a genome's only number."""

    parameters = 1

    def __init__(self):
        self.judged = 0

    def judge(self, genomes, samples):
        self.judged += len(genomes) * len(samples)
        return (genomes[:, :1] * samples.mean(axis=(1, 2))).astype(np.float32)


def filled(buffer, trials, rng):
    buffer.append(
        rng.random((trials, 2)), rng.random((trials, 3, 4, 1)), rng.random((5, 4, 1)), rng
    )


def expected(genomes, buffer):
    trials = genomes[:, 0] * buffer.samples.mean(axis=(1, 2, 3))[:, None]
    return trials, genomes[:, 0] * buffer.genuine.mean(axis=(1, 2))[:, None]


@pytest.mark.parametrize("pool", [7, 100])
def test_a_record_holds_what_classifiers_say_of_all_samples(pool):
    rng, buffer, record = (
        np.random.default_rng(1),
        SampleBuffer(pool_size=pool, share=1.0),
        JudgmentRecord(Counting()),
    )
    genomes = rng.random((4, 1))
    for _ in range(3):
        filled(buffer, 6, rng)
        genomes = np.concatenate((genomes[:3], rng.random((3, 1))))
        record.update(genomes, buffer)
        trials, genuine = expected(genomes, buffer)
        np.testing.assert_allclose(record.counterfeit, trials, rtol=1e-5)
        np.testing.assert_allclose(record.genuine, genuine, rtol=1e-5)


def test_genuine_samples_that_count_again_are_judged():
    rng, buffer, record = (
        np.random.default_rng(1),
        SampleBuffer(pool_size=4, share=1.0),
        JudgmentRecord(Counting()),
    )
    genomes = rng.random((2, 1))
    filled(buffer, 6, rng)
    filled(buffer, 6, rng)
    record.update(genomes, buffer)
    buffer.pool_size = 9
    record.update(genomes, buffer)
    np.testing.assert_allclose(record.genuine, expected(genomes, buffer)[1], rtol=1e-5)


def test_what_has_been_judged_is_not_judged_again():
    rng, buffer, record = (
        np.random.default_rng(1),
        SampleBuffer(pool_size=100, share=1.0),
        JudgmentRecord(Counting()),
    )
    genomes = rng.random((4, 1))
    filled(buffer, 6, rng)
    record.update(genomes, buffer)
    before = record.classifier.judged
    record.update(genomes, buffer)
    assert record.classifier.judged == before
    changed = genomes.copy()
    changed[1] += 1
    record.update(changed, buffer)
    assert record.classifier.judged == before + 6 * 3 + 5


def test_classifiers_that_stand_in_other_rows_are_not_judged_again():
    rng = np.random.default_rng(1)
    buffer = SampleBuffer(pool_size=100, share=1.0)
    record = JudgmentRecord(Counting())
    genomes = rng.random((4, 1))
    filled(buffer, 6, rng)
    record.update(genomes, buffer)
    before = record.classifier.judged
    moved = np.concatenate((genomes[[2, 0, 2]], rng.random((1, 1))))
    record.update(moved, buffer)
    assert record.classifier.judged == before + 6 * 3 + 5
    trials, genuine = expected(moved, buffer)
    np.testing.assert_allclose(record.counterfeit, trials, rtol=1e-5)
    np.testing.assert_allclose(record.genuine, genuine, rtol=1e-5)
