import numpy as np
import pytest

from turing_learning.figures import (
    Distribution,
    ParameterProfile,
    profiles_figure,
    quantities_figure,
    timeline_figure,
)

HALF = np.full(4, 0.25)


def test_each_quantity_has_a_panel_with_both_distributions():
    figure = quantities_figure([Distribution(name, np.arange(5), HALF, HALF) for name in ("speed", "turn", "x")])
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


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda: quantities_figure([]), "`distributions` must hold at least one distribution; got none"),
        (lambda: profiles_figure([]), "`profiles` must hold at least one profile; got none"),
        (lambda: timeline_figure([], [], [], [], limit=1), "`names` must be one name for each of the individuals"),
        (
            lambda: quantities_figure([Distribution("x", np.arange(4), HALF, HALF)]),
            r"`genuine` must have the shape \(3,\)",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, message):
    with pytest.raises(ValueError, match=message):
        draw()
