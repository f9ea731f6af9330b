import numpy as np
import pytest

from turing_learning.examination import Kernel, Ridge, Trees, _examiners
from turing_learning.examination._convolution import convolution_features

RNG = np.random.default_rng(3)


def shifted(count=60, features=5, shift=1.5):
    """Return samples (K, F) of two kinds, one of them shifted along the first feature, and their labels."""
    labels = np.arange(count) % 2 == 0
    samples = RNG.standard_normal((count, features))
    samples[labels, 0] += shift
    return samples, labels


@pytest.mark.parametrize(
    "examiner", [Ridge(), Kernel(), Trees()], ids=lambda examiner: examiner.name
)
def test_an_examiner_tells_new_samples_apart(examiner):
    examiner.fit(*shifted(200, shift=3.0))
    samples, labels = shifted(200, shift=3.0)
    assert ((examiner.score(samples) > 0) == labels).mean() > 0.85


@pytest.mark.parametrize("size", [1, 4])
def test_left_out_groups_are_scored_as_by_a_regression_without_them(monkeypatch, size):
    monkeypatch.setattr(_examiners, "PENALTIES", (0.5,))
    samples, labels = shifted(40)
    labels = labels.astype(float)
    groups = np.arange(40) // size
    found = Ridge().cross_fitted(samples, labels[:, None], groups)[:, 0]
    centered = samples - samples.mean(axis=0)
    penalty = 0.5 * np.eye(6) * (centered**2).sum() / len(samples)
    penalty[0, 0] = 0
    table = np.column_stack((np.ones(40), centered))
    for group in range(40 // size):
        out = groups == group
        seen = table[~out]
        weights = np.linalg.solve(seen.T @ seen + penalty, seen.T @ labels[~out])
        np.testing.assert_allclose(
            found[out], table[out] @ weights - labels[~out].mean(), atol=1e-6
        )


def test_many_labellings_are_scored_as_one_by_one():
    samples, labels = shifted(30)
    groups = np.arange(30) // 3
    many = np.stack([RNG.permutation(labels) for _ in range(4)], axis=1).astype(float)
    together = Kernel().cross_fitted(samples, many, groups)
    for place in range(4):
        np.testing.assert_allclose(
            together[:, [place]], Kernel().cross_fitted(samples, many[:, [place]], groups)
        )


def test_convolutions_see_a_rhythm_and_neither_level_nor_scale():
    time = np.arange(60)
    phases = RNG.uniform(0, 2 * np.pi, (40, 1))
    slow = np.sin(time / 6 + phases)[..., None]
    fast = np.sin(time / 2 + phases)[..., None]
    windows = np.concatenate((slow, fast))
    features = convolution_features(windows, np.random.default_rng(1))
    difference = features[:40].mean(axis=0) - features[40:].mean(axis=0)
    assert np.abs(difference).max() > 0.3
    again = convolution_features(5 + 100 * windows, np.random.default_rng(1))
    np.testing.assert_allclose(again, features, atol=0.05)


def test_windows_shorter_than_a_kernel_have_features():
    assert np.isfinite(convolution_features(RNG.standard_normal((6, 4, 2)), RNG)).all()
