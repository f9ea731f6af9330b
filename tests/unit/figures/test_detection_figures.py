import numpy as np
import pytest

from turing_learning.figures import svg_markup
from turing_learning.figures._detection import accuracy_figure, roc_figure

GENERATIONS = np.array([0, 1, 10, 999])
OBJECTIVE = np.array([[0.6, 0.7, 0.9, 0.97], [0.7, 0.8, 0.92, 0.99]])


def draw(figure):
    """Draw everything: warnings are errors."""
    svg_markup(figure, "f", "")
    return figure


def test_the_accuracy_of_both_best_classifiers_is_a_mean_over_the_runs():
    axes = draw(accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.1, objective=OBJECTIVE)).axes[0]
    heights = [container.lines[0].get_ydata() for container in axes.containers]
    np.testing.assert_allclose(heights, [OBJECTIVE.mean(axis=0), OBJECTIVE.mean(axis=0) - 0.1])


def test_the_error_bars_of_the_accuracy_are_standard_deviations():
    axes = draw(accuracy_figure(GENERATIONS, subjective=OBJECTIVE, objective=OBJECTIVE)).axes[0]
    (bars,) = axes.containers[0].lines[2]
    spans = [np.ptp(segment[:, 1]) for segment in bars.get_segments()]
    np.testing.assert_allclose(spans, 2 * OBJECTIVE.std(axis=0))


@pytest.mark.parametrize("last", [0, 1, 4])
def test_short_runs_can_be_drawn(last):
    values = np.full((1, last + 1), 0.6)
    draw(accuracy_figure(np.arange(last + 1), subjective=values, objective=values))


def test_an_accuracy_below_one_half_is_in_the_picture():
    axes = draw(accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.3, objective=OBJECTIVE)).axes[0]
    assert axes.get_ylim()[0] <= 0.3


def test_a_curve_for_each_rule_is_drawn_and_named():
    curve = (np.array([0.0, 0.2, 1.0]), np.array([0.0, 0.9, 1.0]))
    axes = draw(roc_figure({"single": curve, "group": curve})).axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.lines if line.get_label() != "_"}
    assert list(lines) == ["single", "group"]
    np.testing.assert_array_equal(lines["group"], curve[1])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: accuracy_figure(GENERATIONS, subjective=OBJECTIVE[:1], objective=OBJECTIVE),
            r"^`subjective` must have the shape \(2, 4\)",
        ),
        (
            lambda: accuracy_figure(GENERATIONS[:2], subjective=OBJECTIVE, objective=OBJECTIVE),
            r"^`objective` must have the shape \(R, 2\)",
        ),
        (lambda: roc_figure({}), "^`curves` must hold at least one curve; got none"),
        (lambda: roc_figure({"a": (np.zeros(2), np.zeros(3))}), r"^`detections` must have the shape \(2,\)"),
    ],
)
def test_accuracies_and_curves_that_do_not_fit_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_the_best_of_the_jury_is_a_third_curve():
    axes = draw(
        accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.1, objective=OBJECTIVE, jury=OBJECTIVE + 0.005)
    ).axes[0]
    heights = [container.lines[0].get_ydata().mean() for container in axes.containers]
    assert sorted(heights) == pytest.approx([OBJECTIVE.mean() - 0.1, OBJECTIVE.mean(), OBJECTIVE.mean() + 0.005])
