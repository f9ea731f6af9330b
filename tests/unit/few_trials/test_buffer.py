import numpy as np
import pytest

from turing_learning.few_trials import SampleBuffer


def trials(count, start=0, genuine=5):
    """Return parameters, samples and genuine samples that hold their own numbers."""
    numbers = np.arange(start, start + count, dtype=float)
    samples = np.broadcast_to(numbers[:, None, None, None], (count, 2, 3, 1)).copy()
    system = np.broadcast_to(
        np.arange(start, start + genuine, dtype=float)[:, None, None], (genuine, 3, 1)
    ).copy()
    return numbers[:, None], samples, system


def filled(batches, *, pool=100, share=1.0, size=4, genuine=5):
    buffer, rng = SampleBuffer(pool, share), np.random.default_rng(1)
    for k in range(batches):
        buffer.append(*trials(size, size * k, genuine), rng)
    return buffer


def test_nothing_is_thrown_away():
    buffer = filled(50)
    assert len(buffer) == 200
    np.testing.assert_array_equal(buffer.parameters[:, 0], np.arange(200))
    np.testing.assert_array_equal(buffer.samples[:, 1, 2, 0], np.arange(200))
    assert buffer.samples.dtype == np.float32


def test_the_latest_genuine_samples_are_judged():
    buffer = filled(10, pool=8)
    np.testing.assert_array_equal(
        buffer.genuine[:, 0, 0], [33, 34, 35, 36, 36, 37, 38, 39, 40][-8:]
    )


def test_a_batch_fills_a_share_of_the_pool_only():
    buffer = filled(2, pool=10, share=0.2, genuine=30)
    assert buffer.counts == (8, 10 + 2)
    assert len(buffer.genuine) == 10


def test_trials_that_failed_count_and_are_marked():
    buffer, rng = SampleBuffer(), np.random.default_rng(1)
    buffer.append(*trials(3), rng, np.array([True, False, True]))
    assert len(buffer) == 3
    assert buffer.usable.tolist() == [True, False, True]


def test_rows_written_as_they_come_are_all_rows():
    buffer, rng, written, seen = SampleBuffer(6, 0.5), np.random.default_rng(1), [], (0, 0)
    for k in range(7):
        buffer.append(*trials(4, 4 * k), rng)
        written.append(buffer.since(*seen))
        seen = buffer.counts
    for name, rows in buffer.state().items():
        np.testing.assert_array_equal(np.concatenate([part[name] for part in written]), rows)


def test_a_restored_buffer_grows_on():
    whole, part = filled(6, pool=7), SampleBuffer(7, 1.0)
    part.restore(whole.state())
    for buffer in (whole, part):
        buffer.append(*trials(4, 24), np.random.default_rng(3))
    np.testing.assert_array_equal(whole.parameters, part.parameters)
    np.testing.assert_array_equal(whole.genuine, part.genuine)


@pytest.mark.parametrize(
    ("do", "message"),
    [
        (
            lambda b: b.append(np.zeros((2, 1)), *trials(3)[1:], np.random.default_rng()),
            "`samples` must be of shape",
        ),
        (
            lambda b: b.append(*trials(3)[:2], np.zeros((1, 9, 1)), np.random.default_rng()),
            "`genuine` must be of shape",
        ),
        (lambda b: b.restore({"parameters": np.zeros((1, 1))}), "`state` must hold"),
        (
            lambda b: b.append(np.zeros((2, 9)), *trials(2)[1:], np.random.default_rng()),
            r"`parameters` must have rows of shape \(1,\); got \(9,\)",
        ),
    ],
)
def test_what_does_not_fit_is_rejected(do, message):
    with pytest.raises(ValueError, match=message):
        do(filled(1))
