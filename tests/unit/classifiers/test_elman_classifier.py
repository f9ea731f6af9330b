"""The door of the Elman judge: what it accepts, refuses and promises."""

import numpy as np
import pytest

from turing_learning.classifiers import ElmanClassifier, _elman
from turing_learning.errors import RefusedError
from turing_learning.kernels.parallel import run_range


def genomes(count=2):
    return np.random.default_rng(1).uniform(-1, 1, (count, 46))


def samples(count=3):
    return np.random.default_rng(2).normal(size=(count, 4, 2))


@pytest.mark.parametrize(("inputs", "hidden", "parameters"), [(2, 5, 46), (1, 1, 5), (4, 8, 113)])
def test_the_number_of_parameters_is_the_one_of_the_paper(inputs, hidden, parameters):
    assert ElmanClassifier(inputs, hidden).parameters == parameters


def test_outputs_have_one_row_per_genome_and_one_column_per_sample():
    outputs = ElmanClassifier().judge(genomes(2), samples(3))
    assert outputs.shape == (2, 3)
    assert outputs.dtype == np.float32


def test_the_genome_layout_is_the_documented_one():
    # One step, two inputs, one hidden neuron: W = (2, -1), U = 7 (silent, h_0 = 0), b = 0.5, v = 3, c = -1.
    outputs = ElmanClassifier(2, 1).judge(
        np.array([[2, -1, 7, 0.5, 3, -1]]), np.array([[[0.25, 1.5]]])
    )
    hidden = 1 / (1 + np.exp(-(2 * 0.25 - 1.5 + 0.5)))
    assert outputs[0, 0] == pytest.approx(1 / (1 + np.exp(-(3 * hidden - 1))), abs=6e-6)


def test_recurrent_weights_are_read_row_by_row():
    # Step 1 has silent hidden neurons apart from the bias; U[0, 1] = 4 feeds neuron 1 into neuron 0 in step 2.
    weights, recurrent, biases, output = [0, 0], [0, 4, 0, 0], [0, 1], [1, 0, 0]
    result = ElmanClassifier(1, 2).judge(
        np.array([[*weights, *recurrent, *biases, *output]]), np.zeros((1, 2, 1))
    )
    first = 1 / (1 + np.exp(-1))
    second = 1 / (1 + np.exp(-4 * first))
    assert result[0, 0] == pytest.approx(1 / (1 + np.exp(-second)), abs=6e-6)


@pytest.mark.parametrize(
    ("bias", "genuine"), [(0.0, True), (-0.0, True), (1e-30, True), (-1e-30, False)]
)
def test_the_sign_of_the_weighted_sum_alone_decides(bias, genuine):
    genome = np.zeros((1, 46))
    genome[0, -1] = bias
    assert (ElmanClassifier().judge(genome, samples(1))[0, 0] >= 0.5) == genuine


@pytest.mark.parametrize("bias", [-1e300, 1e300])
def test_outputs_stay_strictly_between_zero_and_one(bias):
    genome = np.zeros((1, 46))
    genome[0, -1] = bias
    assert 0 < ElmanClassifier().judge(genome, samples(1))[0, 0] < 1


def test_judging_leaves_its_input_as_it_was():
    given_genomes, given_samples = genomes() * 1e200, samples() * 1e200
    copies = given_genomes.copy(), given_samples.copy()
    ElmanClassifier(scale=(2, 3)).judge(given_genomes, given_samples)
    np.testing.assert_array_equal(given_genomes, copies[0])
    np.testing.assert_array_equal(given_samples, copies[1])


@pytest.mark.parametrize(
    "change", [np.float32, np.asfortranarray, lambda a: a[::-1][::-1], lambda a: a.astype(">f8")]
)
def test_any_memory_layout_and_precision_is_judged_alike(change):
    exact = np.float32(samples()).astype(np.float64)
    reference = ElmanClassifier().judge(genomes(), exact)
    np.testing.assert_array_equal(ElmanClassifier().judge(genomes(), change(exact)), reference)


def test_read_only_samples_are_judged():
    frozen = samples()
    frozen.flags.writeable = False
    np.testing.assert_array_equal(
        ElmanClassifier().judge(genomes(), frozen), ElmanClassifier().judge(genomes(), samples())
    )


def test_equal_genomes_are_judged_once_and_answered_each(monkeypatch):
    given, judged = genomes(4)[[2, 0, 2, 3, 0]], []
    separate = [ElmanClassifier().judge(genome[None], samples())[0] for genome in given]

    def counted(function, count, *rest):
        judged.append(count)
        run_range(function, count, *rest)

    monkeypatch.setattr(_elman, "run_range", counted)
    assert np.array_equal(ElmanClassifier().judge(given, samples()), separate)
    assert judged[-1] == 3  # of one block of samples each


@pytest.mark.parametrize(("count", "number"), [(0, 3), (2, 0), (0, 0)])
def test_nothing_to_judge_gives_an_empty_result(count, number):
    assert ElmanClassifier().judge(genomes(count), samples(number)).shape == (count, number)


@pytest.mark.parametrize("shape", [(46,), (2, 45), (2, 1, 46)])
def test_genomes_of_another_shape_are_refused(shape):
    with pytest.raises(
        ValueError, match=r"`genomes` must be of shape \(N, Q\) = \(any, 46\); got \("
    ):
        ElmanClassifier().judge(np.zeros(shape), samples())


@pytest.mark.parametrize("shape", [(4, 2), (3, 4, 3), (3, 0, 2), (1, 3, 4, 2)])
def test_samples_of_another_shape_are_refused(shape):
    with pytest.raises(
        ValueError,
        match=r"`samples` must (be of shape \(S, T, D\)|have at least one time step).*; got \(",
    ):
        ElmanClassifier().judge(genomes(), np.zeros(shape))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_sample_that_is_not_finite_is_named(value):
    bad = np.zeros((70, 4, 2))
    bad[66, 3, 1] = value
    bad[68, 0, 0] = value
    with pytest.raises(
        ValueError, match=rf"`samples` must be finite; got {value} \[sample 66, step 3, signal 1\]"
    ):
        ElmanClassifier().judge(genomes(), bad)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_genome_that_is_not_finite_is_named(value):
    bad = genomes()
    bad[1, 7] = value
    with pytest.raises(
        ValueError, match=rf"`genomes` must be finite; got {value} \[genome 1, parameter 7\]"
    ):
        ElmanClassifier().judge(bad, samples())


def masked(values):
    return np.ma.masked_array(values, mask=np.arange(values.size).reshape(values.shape) == 0)


@pytest.mark.parametrize(
    "bad",
    [
        masked,
        *(lambda values, kind=kind: values.astype(kind) for kind in (complex, str, bytes, object)),
    ],
)
def test_values_that_are_not_real_numbers_are_refused(bad):
    for given in ((bad(genomes()), samples()), (genomes(), bad(samples()))):
        with pytest.raises(
            RefusedError, match=r"` must (be an array of numbers|have no masked values)"
        ):
            ElmanClassifier().judge(*given)


@pytest.mark.parametrize("field", ["inputs", "hidden", "threads"])
@pytest.mark.parametrize("value", [0, -1, 1.5, True, "2"])
def test_counts_must_be_positive_integers(field, value):
    with pytest.raises(ValueError, match=f"`{field}` must be an integer of at least 1; got "):
        ElmanClassifier(**{field: value})


def test_a_network_beyond_the_range_of_single_precision_is_refused():
    with pytest.raises(ValueError, match=r"`inputs \+ hidden` must be at most 255; got 200 \+ 56"):
        ElmanClassifier(200, 56)


@pytest.mark.parametrize(
    "scale", [(1.0, 0.0), (1.0, -2.0), (1.0, np.nan), (1.0, np.inf), (1.0, 1e-51)]
)
def test_a_scale_that_cannot_divide_is_refused(scale):
    with pytest.raises(
        ValueError,
        match=r"`scale` must be numbers between 1e-50 and 1e\+50, one per input; got \(1\.0, ",
    ):
        ElmanClassifier(scale=scale)


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        ((1.0,), r"be of shape \(D,\) = \(2,\); got \(1,\)"),
        ("ab", "be an array of numbers; got 'ab'"),
    ],
)
def test_a_scale_of_another_shape_or_kind_is_refused(scale, message):
    with pytest.raises(ValueError, match=f"`scale` must {message}"):
        ElmanClassifier(scale=scale)


def test_equal_classifiers_compare_equal_whatever_held_the_scale():
    assert ElmanClassifier(scale=[1, 2]) == ElmanClassifier(scale=(1.0, 2.0))
