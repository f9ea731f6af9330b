import numpy as np
import pytest

from turing_learning import figures

RNG = np.random.default_rng(0)
NAMES = ("vl0", "vr0", "vl1", "vr1")
TRUTH = np.array([-0.7, -1.0, 1.0, -1.0])
READINGS = np.repeat((0, 1, 0), 10)


def draw(figure):
    """Draw everything: warnings are errors."""
    figures.svg_markup(figure, "f", "")
    return figure


def box_panels(*groups, titles=("mixed", "separated"), truth=TRUTH):
    return figures.box_panels_figure(groups, titles=titles, names=NAMES, truth=truth)


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


@pytest.mark.parametrize(
    ("groups", "titles", "message"),
    [
        ([np.zeros((3, 3))], ["a"], r"`groups` must have the shape \(R, 4\)"),
        ([np.zeros((3, 4))], ["a", "b"], "`titles` must be as many as there are groups, at least one; got 2"),
        ([], [], "`titles` must be as many as there are groups, at least one; got 0"),
    ],
)
def test_groups_that_do_not_fit_are_refused(groups, titles, message):
    with pytest.raises(ValueError, match=message):
        box_panels(*groups, titles=titles)


def test_the_outputs_of_both_wheels_are_drawn_over_time_where_something_is_seen_shaded():
    outputs = RNG.uniform(-1, 1, (30, 2))
    truth = TRUTH.reshape(-1, 2)[READINGS]
    figure = draw(
        figures.dynamic_outputs_figure([outputs, outputs], readings=READINGS, titles=("One", "Three"), truth=truth)
    )
    axes = figure.axes[0]
    left = next(line for line in axes.lines if line.get_label() == "left wheel")
    np.testing.assert_array_equal(left.get_ydata(), outputs[:, 0])
    np.testing.assert_array_equal(left.get_xdata(), np.arange(1, 31))
    shaded = [patch.get_x() for patch in axes.patches if patch.get_width() == 1.0]
    assert shaded == [step + 0.5 for step in range(10, 20)]


@pytest.mark.parametrize(
    ("outputs", "titles", "message"),
    [
        ([np.zeros((29, 2))], ["a"], r"`outputs` must have the shape \(30, 2\)"),
        ([], [], "`titles` must be as many as there are networks, at least one; got 0"),
    ],
)
def test_outputs_that_do_not_fit_are_refused(outputs, titles, message):
    with pytest.raises(ValueError, match=message):
        figures.dynamic_outputs_figure(outputs, readings=READINGS, titles=titles, truth=np.zeros((30, 2)))
