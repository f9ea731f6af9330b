import re
from types import SimpleNamespace

import numpy as np
import pytest

from turing_learning.systems._genuine import read_genuine
from turing_learning.trajectories import Trajectories


def read(genuine, **options):
    return read_genuine(genuine, rng=np.random.default_rng(0), **options)


def samples(count=10, steps=4, signals=2):
    return np.random.default_rng(1).normal(size=(count, steps, signals))


def test_a_fifth_is_held_out_and_the_same_one_every_time():
    data = read(samples())
    assert (len(data.held_out), len(data.learning), len(data.testing)) == (2, 8, 2)
    np.testing.assert_array_equal(data.held_out, read(samples() + 1).held_out)


def test_no_sample_is_both_learned_from_and_held_out():
    data = read(np.arange(10.0)[:, None, None] * np.ones((1, 3, 1)))
    assert set(data.learning[:, 0, 0]) | set(data.testing[:, 0, 0]) == set(range(10))
    assert not set(data.learning[:, 0, 0]) & set(data.testing[:, 0, 0])


def test_held_out_samples_can_be_named():
    np.testing.assert_array_equal(read(samples(), held_out=[7, 3]).held_out, [3, 7])


def test_one_sample_is_learned_from():
    assert len(read(samples(1), held_out=0.9).learning) == 1


def test_samples_that_are_split_stay_so():
    windows = SimpleNamespace(learning=samples(3), held_out=samples(2) + 5)
    data = read(windows)
    np.testing.assert_array_equal(data.learning, windows.learning)
    np.testing.assert_array_equal(data.testing, windows.held_out)
    with pytest.raises(
        ValueError,
        match=re.escape("`held_out` must be left out for samples that are split already; got 0.5."),
    ):
        read(windows, held_out=0.5)


def test_unequal_lengths_are_cut_to_the_shortest_when_asked():
    assert read([np.ones((5, 1)), np.ones((3, 1))], length="shortest").samples.shape == (2, 3, 1)


def test_samples_are_cut_at_the_end_to_a_number_of_steps():
    data = read(samples(), length=3)
    np.testing.assert_array_equal(data.samples, samples()[:, :3])


def test_a_live_source_is_observed_and_holds_nothing_out():
    data = read(lambda rng: rng.normal(size=(6, 3, 1)))
    assert (data.samples.shape, len(data.held_out), data.digest) == ((6, 3, 1), 0, "")


def test_a_live_source_has_no_samples_that_could_be_held_out():
    with pytest.raises(
        ValueError, match=r"^`held_out` must be left out for a live source, .*; got 0\.3\.$"
    ):
        read(lambda rng: rng.normal(size=(6, 3, 1)), held_out=0.3)


def test_the_digest_tells_other_values_and_other_shapes():
    base = samples()
    changed = base.copy()
    changed[0, 0, 0] += 1e-12
    digests = {
        read(data).digest
        for data in (base, changed, base.reshape(5, 8, 2), base.astype(np.float64))
    }
    assert len(digests) == 3


def test_inputs_are_centered_on_the_median_and_scaled_by_the_99th_percentile_of_the_distance():
    values = np.linspace(100, 300, 201)[:, None, None] * np.ones((1, 2, 1))
    center, scale = read(values, held_out=0.0).scales()
    assert center == (200.0,)
    assert scale[0] == pytest.approx(99)


def test_outliers_do_not_change_the_scale():
    values = samples(500)
    spoiled = values.copy()
    spoiled[0, 0] = 1e8
    np.testing.assert_allclose(read(values).scales()[1], read(spoiled).scales()[1], rtol=0.05)


def test_a_signal_that_does_not_vary_is_not_divided():
    assert read(np.full((4, 3, 1), 7.0)).scales() == ((7.0,), (1.0,))


def test_held_out_samples_do_not_enter_the_scale():
    values = samples()
    changed = values.copy()
    changed[3] *= 50
    assert read(values, held_out=[3]).scales() == read(changed, held_out=[3]).scales()


@pytest.mark.parametrize("value", [np.nan, np.inf, 2e9])
def test_a_value_that_is_not_finite_is_refused_with_its_place(value):
    data = samples()
    data[4, 2, 1] = value
    shown = "nan (or masked)" if np.isnan(value) else value
    message = f"`genuine` must be finite and at most 1e+09 in size; got {shown} [sample 4, step 2, signal 1]. Cut the gap out"
    with pytest.raises(ValueError, match=re.escape(message)):
        read(data)


@pytest.mark.parametrize(
    "given",
    [
        lambda data: data,
        list,
        lambda data: [list(data[0]), *data[1:]],
        lambda data: lambda rng: data,
    ],
)
def test_a_masked_value_is_refused_as_nan_is(given):
    data = np.ma.masked_array(
        np.rint(samples()).astype(int), mask=np.zeros(samples().shape, dtype=bool)
    )
    np.testing.assert_array_equal(read(given(data)).samples, data.data)
    data[0, 2, 1] = np.ma.masked
    with pytest.raises(
        ValueError, match=r"must be finite .* got nan \(or masked\) \[sample 0, step 2, signal 1\]"
    ):
        read(given(data))


@pytest.mark.parametrize(
    ("genuine", "options", "message"),
    [
        (np.ones((3, 4)), {}, "got one table of shape (3, 4). Give [table] if it is one sample of several signals"),
        (list(np.ones((3, 4))), {}, "got shape (4,) of float64 [sample 0]. Add an axis for a single signal: samples[..., None]."),
        ([], {}, "`genuine` must hold at least one sample; got none."),
        ([["a"]], {}, "`genuine` must be samples (K, T, D) of real numbers"),
        (
            np.ones((2, 3, 1)) * 1j,
            {},
            "`genuine` must be samples (K, T, D) of real numbers; got shape (3, 1) of complex128 [sample 0]. Give real and "
            "imaginary part as two signals, or what you want to compare of them",
        ),
        ([[[1.0], [2.0, 3.0]]], {}, "`genuine` must be samples (K, T, D) of real numbers"),
        ([np.ones((5, 1)), np.ones((3, 1))], {}, "got 3 steps [sample 1] and 5 [sample 0]. Cut them with length=\"shortest\""),
        ([np.ones((5, 1)), np.ones((3, 1))], {"length": 4}, "`length` must be at most that of the shortest sample, 3; got 4"),
        ([np.ones((5, 1)), np.ones((5, 2))], {}, "`genuine` must have the same signals in all samples; got [1, 2] signals."),
        (np.ones((3, 4, 1)), {"length": 0}, '`length` must be an integer of at least 1, "shortest", or None; got 0.'),
        (np.ones((3, 4, 1)), {"held_out": 1.0}, "`held_out` must be a share of at least 0 and below 1; got 1.0."),
        (
            np.ones((3, 4, 1)),
            {"held_out": [0, 3]},
            "`held_out` must be a share, or numbers of samples from 0 to 2, each once, but not all; got 3 [place 1]. Samples are",
        ),
        (np.ones((3, 4, 1)), {"held_out": [-1]}, "but not all; got -1 [place 0]. Samples are counted from 0."),
        (np.ones((3, 4, 1)), {"held_out": [1, 1]}, "each once, but not all; got 1 again [place 1]. Leave it out there."),
        (np.ones((3, 4, 1)), {"held_out": np.array([2, 1, 2])}, "got 2 again [place 2]."),
        (np.ones((2, 4, 1)), {"held_out": [0, 1]}, "but not all; got all 2. Leave some to learn from."),
        (np.ones((2, 4, 1)), {"held_out": "half"}, "`held_out` must be a share, or numbers of samples from 0 to 1"),
    ],
)  # fmt: skip
def test_what_breaks_a_rule_is_refused(genuine, options, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        read(genuine, **options)


def test_signals_that_are_the_same_throughout_are_known():
    values = samples()
    assert read(values).constant == ()
    values[..., 1] = 0.3
    assert read(values).constant == (1,)
    values[3, 0, 1] = 7.0
    assert read(values, held_out=[3]).constant == (1,)
    assert read(values, held_out=[4]).constant == ()


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e-12])
def test_signals_of_any_unit_are_divided_by_their_spread(unit):
    small = read(samples() * unit)
    assert small.constant == ()
    np.testing.assert_allclose(small.scales()[1], np.array(read(samples()).scales()[1]) * unit)


@pytest.mark.parametrize("value", [1e-6, 0.3, 1e3])
def test_what_rounding_leaves_of_a_constant_is_no_signal(value):
    values = samples()
    values[..., 1] = value * (1 + 1e-15 * values[..., 1])
    assert read(values).constant == (1,)
    assert read(values).scales()[1][1] == 1.0


def test_turns_of_straight_paths_are_no_signal():
    steps = np.arange(400)[:, None, None] * 0.01
    angles = np.linspace(0.1, 6.0, 12)
    positions = steps * np.stack((np.cos(angles), np.sin(angles)), axis=-1) + 20.0
    frames = Trajectories(
        positions, np.ones((400, 12), dtype=bool), 100.0, tuple(f"fish {k}" for k in range(12))
    )
    windows = frames.windows(length_s=0.5, signals=("speed", "turn"))
    assert np.ptp(windows.learning[..., 1]) > 0.0
    data = read(windows)
    assert 1 in data.constant
    assert data.scales()[1][1] == 1.0
