import numpy as np
import pytest

from turing_learning import figures

NAMES = ("vl0", "vr0", "vl1")
RNG = np.random.default_rng(0)


def draw(figure):
    """Draw everything: warnings are errors."""
    figures.svg_markup(figure, "f", "")
    return figure


def medians(axes):
    """Return the heights of the lines inside the boxes."""
    lines = [line.get_ydata() for line in axes.lines if line.get_color() == "#d55e00"]
    return [y[0] for y in lines]


def test_a_box_per_parameter_with_median_quartiles_and_whiskers_of_one_and_a_half_ranges():
    values = np.concatenate([np.arange(1.0, 12.0), [100.0]])[:, None] * np.ones(3)
    axes = draw(figures.box_figure(values, names=NAMES)).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == list(NAMES)
    assert medians(axes) == [6.5] * 3
    box = axes.patches[0].get_path().vertices[:, 1]
    assert (box.min(), box.max()) == tuple(np.quantile(values[:, 0], (0.25, 0.75)))
    ends = {float(y) for line in axes.lines if len(line.get_ydata()) == 2 for y in line.get_ydata()}
    assert max(ends) == 11.0


def test_the_truth_is_dashed_at_its_place():
    axes = draw(figures.box_figure(RNG.normal(size=(9, 3)), names=NAMES, truth=[0.1, 0.2, 0.3])).axes[0]
    dashes = next(c for c in axes.collections if c.get_label() == "true value")
    assert [segment[0, 1] for segment in dashes.get_segments()] == [0.1, 0.2, 0.3]


def test_far_outliers_are_counted_and_do_not_flatten_the_boxes():
    values = RNG.normal(size=(30, 3))
    values[0, 1] = 1e6
    axes = draw(figures.box_figure(values, names=NAMES)).axes[0]
    assert axes.get_ylim()[1] < 50
    assert [text.get_text() for text in axes.texts] == ["1 outliers beyond"]


@pytest.mark.parametrize("runs", [1, 2])
def test_few_runs_can_be_drawn(runs):
    draw(figures.box_figure(np.ones((runs, 3)), names=NAMES, truth=[1, 1, 1]))
    draw(figures.error_box_figure([np.zeros(runs)], names=["a"]))
    draw(figures.error_histogram_figure(np.zeros(runs)))
    draw(figures.convergence_figure(np.ones((runs, 3)), names=NAMES))


def test_groups_of_errors_may_differ_in_size_and_the_axis_is_logarithmic():
    axes = draw(figures.error_box_figure([np.array([0.01, 0.1, 1.0]), np.array([0.5])], names=["a", "b"])).axes[0]
    assert axes.get_yscale() == "log"
    assert medians(axes) == [0.1, 0.5]


def test_convergence_has_a_line_and_a_thin_truth_per_parameter():
    values = RNG.normal(size=(20, 3))
    axes = draw(figures.convergence_figure(values, names=NAMES, truth=[1, 2, 3])).axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.lines if not line.get_label().startswith("_")}
    assert list(lines) == list(NAMES)
    np.testing.assert_array_equal(lines["vr0"], values[:, 1])
    assert [line.get_ydata()[0] for line in axes.lines if line.get_label().startswith("_")] == [1, 2, 3]


def test_the_histogram_counts_every_run_and_names_those_beyond():
    axes = draw(figures.error_histogram_figure(np.array([0.001, 0.005, 0.012, 0.2, 0.9, 70.0]))).axes[0]
    heights = [patch.get_height() for patch in axes.patches]
    assert heights[:2] == [2, 1]
    assert sum(heights) == 6
    assert heights[-1] == 2
    assert axes.texts[0].get_text() == "2 beyond 0.3"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: figures.box_figure(np.ones(3), names=NAMES), r"^`values` must have the shape \(R, P\)"),
        (lambda: figures.box_figure(np.ones((2, 3)), names=NAMES[:2]), "^`names` must hold one name per parameter, 3"),
        (lambda: figures.box_figure(np.ones((2, 3)), names=NAMES, truth=[1]), r"^`truth` must have the shape \(3,\)"),
        (lambda: figures.error_box_figure([[np.nan]], names=["a"]), "^`errors` must be finite"),
        (lambda: figures.convergence_figure(np.ones((0, 3)), names=NAMES), r"^`medians` must have the shape \(G, P\)"),
        (lambda: figures.error_histogram_figure(np.ones((2, 2))), r"^`maes` must have the shape \(R,\)"),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
