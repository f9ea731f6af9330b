import numpy as np
import pytest

from turing_learning.figures import box_figure
from turing_learning.figures._picture import svg_markup
from turing_learning.figures.many_runs import (
    box_panels_figure,
    budget_figure,
    convergence_figure,
    dispersion_figure,
    dynamic_outputs_figure,
    error_box_figure,
    error_histogram_figure,
    error_panels_figure,
    prediction_figure,
)

NAMES = ("vl0", "vr0", "vl1")
FOUR, TRUTH = ("vl0", "vr0", "vl1", "vr1"), np.array([-0.7, -1.0, 1.0, -1.0])
LIMITS = (0.05, 0.1)
RNG = np.random.default_rng(0)
READINGS = np.repeat((0, 1, 0), 10)
CURVES = {name: RNG.random(20) for name in ("average", "subjective", "objective")}
ERRORS = {100: np.array([0.3, 0.2, 0.4]), 1000: np.array([0.05, 0.02, 0.03])}


def draw(figure):
    """Draw everything: warnings are errors."""
    svg_markup(figure, "f", "")
    return figure


def medians(axes):
    """Return the heights of the lines inside the boxes."""
    lines = [line.get_ydata() for line in axes.lines if line.get_color() == "#d55e00"]
    return [y[0] for y in lines]


def test_a_box_per_parameter_with_median_quartiles_and_whiskers_of_one_and_a_half_ranges():
    values = np.concatenate([np.arange(1.0, 12.0), [100.0]])[:, None] * np.ones(3)
    axes = draw(box_figure(values, names=NAMES)).axes[0]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == list(NAMES)
    assert medians(axes) == [6.5] * 3
    box = axes.patches[0].get_path().vertices[:, 1]
    assert (box.min(), box.max()) == tuple(np.quantile(values[:, 0], (0.25, 0.75)))
    ends = {float(y) for line in axes.lines if len(line.get_ydata()) == 2 for y in line.get_ydata()}
    assert max(ends) == 11.0


def test_the_truth_is_dashed_at_its_place():
    axes = draw(box_figure(RNG.normal(size=(9, 3)), names=NAMES, truth=[0.1, 0.2, 0.3])).axes[0]
    dashes = next(c for c in axes.collections if c.get_label() == "true value")
    assert [segment[0, 1] for segment in dashes.get_segments()] == [0.1, 0.2, 0.3]


def test_far_outliers_are_counted_and_do_not_flatten_the_boxes():
    values = RNG.normal(size=(30, 3))
    values[0, 1] = 1e6
    axes = draw(box_figure(values, names=NAMES)).axes[0]
    assert axes.get_ylim()[1] < 50
    assert [text.get_text() for text in axes.texts] == ["1 outliers beyond"]


@pytest.mark.parametrize("runs", [1, 2])
def test_few_runs_can_be_drawn(runs):
    draw(box_figure(np.ones((runs, 3)), names=NAMES, truth=[1, 1, 1]))
    draw(error_box_figure({"a": np.zeros(runs)}))
    draw(error_histogram_figure(np.zeros(runs), limits=LIMITS))
    draw(convergence_figure({"": np.ones((runs, 3))}, names=NAMES))


def test_groups_of_errors_may_differ_in_size_and_the_axis_is_logarithmic():
    axes = draw(error_box_figure({"a": np.array([0.01, 0.1, 1.0]), "b": np.array([0.5])})).axes[0]
    assert axes.get_yscale() == "log"
    assert medians(axes) == [0.1, 0.5]


def test_convergence_has_a_line_and_a_thin_truth_per_parameter():
    values = RNG.normal(size=(20, 3))
    axes = draw(convergence_figure({"": values}, names=NAMES, truth=[1, 2, 3])).axes[0]
    lines = {
        line.get_label(): line.get_ydata()
        for line in axes.lines
        if not line.get_label().startswith("_")
    }
    assert list(lines) == list(NAMES)
    np.testing.assert_array_equal(lines["vr0"], values[:, 1])
    assert [line.get_ydata()[0] for line in axes.lines if line.get_label().startswith("_")] == [
        1,
        2,
        3,
    ]


def test_the_histogram_counts_every_run_and_names_those_beyond():
    axes = draw(
        error_histogram_figure(np.array([0.001, 0.005, 0.012, 0.2, 0.9, 70.0]), limits=LIMITS)
    ).axes[0]
    heights = [patch.get_height() for patch in axes.patches]
    assert heights[:2] == [2, 1]
    assert sum(heights) == 6
    assert heights[-1] == 2
    assert axes.texts[0].get_text() == "2 beyond 0.3"


def box_panels(*groups, titles=("mixed", "separated"), truth=TRUTH):
    return box_panels_figure(dict(zip(titles, groups, strict=False)), names=FOUR, truth=truth)


def test_a_panel_for_each_group_at_the_same_scale_with_the_truth_dashed():
    wide = TRUTH + RNG.normal(0, 0.5, (30, 4))
    figure = draw(box_panels(TRUTH + RNG.normal(0, 0.05, (20, 4)), wide))
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["mixed", "separated"]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    for axes in figure.axes:
        dashes = next(c for c in axes.collections if c.get_label() == "true value")
        assert [segment[0, 1] for segment in dashes.get_segments()] == TRUTH.tolist()
    assert len(figure.axes[0].patches) == 4


def test_outliers_of_a_panel_are_counted_and_do_not_flatten_the_boxes():
    values = TRUTH + RNG.normal(0, 0.05, (30, 4))
    values[:2, 0] = 1e4
    figure = draw(box_panels(values, TRUTH + RNG.normal(0, 0.05, (30, 4))))
    assert [text.get_text() for text in figure.axes[0].texts] == ["2 outliers beyond"]
    assert figure.axes[0].get_ylim()[1] < 10


def test_the_outputs_of_both_wheels_are_drawn_over_time_where_something_is_seen_shaded():
    outputs = RNG.uniform(-1, 1, (30, 2))
    truth = TRUTH.reshape(-1, 2)[READINGS]
    figure = draw(
        dynamic_outputs_figure({"One": outputs, "Three": outputs}, readings=READINGS, truth=truth)
    )
    axes = figure.axes[0]
    left = next(line for line in axes.lines if line.get_label() == "left wheel")
    np.testing.assert_array_equal(left.get_ydata(), outputs[:, 0])
    np.testing.assert_array_equal(left.get_xdata(), np.arange(1, 31))
    shaded = [patch.get_x() for patch in axes.patches if patch.get_width() == 1.0]
    assert shaded == [step + 0.5 for step in range(10, 20)]


def test_medians_are_a_line_over_the_numbers_of_trials_and_runs_are_dots():
    figure = budget_figure(
        {"One": {"NPE": ERRORS, "mixture": {10: np.array([0.001])}}, "Two": {"NPE": ERRORS}}
    )
    svg_markup(figure, "f", "")
    assert [axes.get_title() for axes in figure.axes] == ["One", "Two"]
    line = next(one for one in figure.axes[0].lines if one.get_label() == "NPE")
    np.testing.assert_allclose([line.get_xdata(), line.get_ydata()], [[100, 1000], [0.3, 0.03]])
    dots = [one.get_ydata() for one in figure.axes[1].lines if one.get_label() != "NPE"]
    np.testing.assert_array_equal(dots, list(ERRORS.values()))


def test_both_axes_are_logarithmic_with_plain_numbers():
    axes = budget_figure({"One": {"NPE": ERRORS}}).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert axes.xaxis.get_major_formatter()(1000) == "1,000"


def test_parameters_of_both_kinds_of_runs_share_a_scale_and_a_legend():
    medians = {name: RNG.uniform(-1, 1, (20, 2)) for name in "AB"}
    figure = draw(convergence_figure(medians, names=("x", "y"), truth=(0.5, -0.5)))
    assert [axes.get_title() for axes in figure.axes] == ["A", "B"]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["x", "y"]


def test_curves_differ_in_their_dashes():
    figure = draw(error_panels_figure({"A": CURVES, "B": CURVES}))
    dashes = {str(line.get_linestyle()) + str(line._dash_pattern) for line in figure.axes[0].lines}
    assert len(dashes) == 3


def test_agents_are_hatched_and_the_least_dispersion_is_dashed():
    figure = draw(
        dispersion_figure(
            np.arange(360.0, 390.0),
            RNG.uniform(360, 390, (30, 30)),
            least_possible=343.5,
            gathered="robots",
        )
    )
    axes = figure.axes[0]
    assert [bool(patch.get_hatch()) for patch in axes.patches] == [True] + [False] * 30
    dashed = next(line for line in axes.lines if line.get_label() == "least possible")
    assert list(dashed.get_ydata()) == [343.5, 343.5]
    assert axes.get_ylabel() == "Dispersion of the robots"
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [
        "agents",
        "5",
        "10",
        "15",
        "20",
        "25",
        "30",
    ]


def test_models_that_do_not_gather_are_counted_and_do_not_flatten_the_boxes():
    models = np.full((3, 4), 400.0)
    models[1] = 1e7
    axes = draw(
        dispersion_figure(np.array([380.0, 390.0]), models, least_possible=343.5, gathered="robots")
    ).axes[0]
    assert axes.get_ylim()[1] < 2000
    assert [text.get_text() for text in axes.texts] == ["4 trials beyond"]


def test_predictions_stand_beside_medians_and_quartiles():
    values = np.arange(9.0)[:, None] * np.ones(2)
    figure = draw(
        prediction_figure(
            values, predicted=np.array([0.1, 0.2]), truth=np.array([1.0, 2.0]), names=("vl0", "vr0")
        )
    )
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines["predicted"], [0.1, 0.2])
    assert any(np.array_equal(line.get_ydata(), [4.0, 4.0]) for line in figure.axes[0].lines)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"values": np.ones(3)}, r"^`values` must be of shape \(R, P\); got \(3,\)"),
        (
            {"values": np.ones((0, 3))},
            r"^`values` must be of shape \(R, P\) and not empty; got \(0, 3\)",
        ),
        ({"values": [[1, 2, np.nan]]}, r"^`values` must be finite; got nan at \(0, 2\)"),
        ({"names": NAMES[:2]}, "^`names` must hold one name per parameter, 3; got 2"),
        ({"truth": [1]}, r"^`truth` must be of shape \(P,\) = \(3,\); got \(1,\)"),
    ],
)
def test_what_does_not_fit_is_refused(given, message):
    with pytest.raises(ValueError, match=message):
        box_figure(**{"values": np.ones((2, 3)), "names": NAMES} | given)
