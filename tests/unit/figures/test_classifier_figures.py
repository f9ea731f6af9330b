import numpy as np
import pytest

from turing_learning.figures import timeline_figure
from turing_learning.figures._one_run import (
    ParameterProfile,
    accuracy_figure,
    profiles_figure,
    quantities_figure,
)
from turing_learning.figures._picture import svg_markup

HALF = np.full(4, 0.25)
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


def test_the_best_of_the_jury_is_a_third_curve():
    axes = draw(
        accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.1, objective=OBJECTIVE, jury=OBJECTIVE + 0.005)
    ).axes[0]
    heights = [container.lines[0].get_ydata().mean() for container in axes.containers]
    assert sorted(heights) == pytest.approx([OBJECTIVE.mean() - 0.1, OBJECTIVE.mean(), OBJECTIVE.mean() + 0.005])


def test_each_quantity_has_a_panel_with_both_distributions():
    figure = quantities_figure({name: (np.arange(5), HALF, HALF) for name in ("speed", "turn", "x")})
    assert [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()] == ["speed", "turn", "x"]
    assert len(figure.axes[0].patches) == 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["genuine", "simulated at the estimate"]


def test_a_profile_shows_estimate_interval_and_what_was_recovered():
    profile = ParameterProfile("speed", np.arange(3.0), np.ones(3), HALF[:3], 1.0, (0.5, 1.5), recovered=[1.1])
    figure = profiles_figure([profile])
    labels = {text.get_text() for text in figure.legends[0].get_texts()}
    assert labels == {"interval", "estimate", "fresh classifiers", "guessing, 95 %", "recovered"}
    assert figure.axes[0].get_xscale() == "linear"


def test_an_interval_that_is_not_known_is_not_drawn():
    profile = ParameterProfile("speed", np.arange(3.0), np.ones(3), HALF[:3], 1.0, None)
    figure = profiles_figure([profile])
    assert "interval" not in {text.get_text() for text in figure.legends[0].get_texts()}
    assert not figure.axes[0].patches


def test_a_timeline_has_a_row_for_each_individual_and_marks_what_is_abnormal():
    times = np.stack((np.arange(4.0), np.arange(4.0) + 1), axis=1)
    bad = np.array([False, True, True, False])
    figure = timeline_figure(["Ada", "[Bo]"], [times] * 2, [HALF] * 2, [bad, ~bad & False], limit=4.0)
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["Ada", "[Bo]"]
    assert len(axes.patches) == 8
    colors = {patch.get_facecolor() for patch in axes.patches}
    assert len(colors) == 2
    assert axes.get_xlim() == (0, 4)


WINDOWS = np.stack((np.arange(4.0), np.arange(4.0) + 1), axis=1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"names": []}, "`names` must be one name for each of the individuals, at least one; got 0"),
        ({"windows": [WINDOWS[:, 0]]}, r"`windows` must be of shape \(W, 2\); got \(4,\)"),
        ({"scores": [HALF[:3]]}, r"`scores` must be of shape \(W,\) = \(4,\); got \(3,\)"),
        ({"scores": [HALF * np.nan]}, r"`scores` must be finite; got nan at \(0,\)"),
        ({"abnormal": [[True]]}, r"`abnormal` must be of shape \(W,\) = \(4,\); got \(1,\)"),
    ],
)
def test_a_timeline_that_does_not_fit_is_refused(given, message):
    fits = {"names": ["Ada"], "windows": [WINDOWS], "scores": [HALF], "abnormal": [HALF > 1]}
    with pytest.raises(ValueError, match=message):
        timeline_figure(**fits | given, limit=4.0)
