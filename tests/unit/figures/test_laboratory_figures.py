import numpy as np
import pytest

from turing_learning import figures
from turing_learning.figures import convergence_panels_figure, error_panels_figure, gathering_figure
from turing_learning.figures._reproduction import snapshots_figure

RNG = np.random.default_rng(0)
CURVES = {name: RNG.random(20) for name in ("average of all models", "subjectively best", "objectively best")}


def draw(figure):
    """Draw everything: warnings are errors."""
    figures.svg_markup(figure, "f", "")
    return figure


def test_parameters_of_both_kinds_of_runs_share_a_scale_and_a_legend():
    medians = [RNG.uniform(-1, 1, (20, 2)), RNG.uniform(-1, 1, (20, 2))]
    figure = draw(convergence_panels_figure(medians, titles=("A", "B"), names=("x", "y"), truth=(0.5, -0.5)))
    assert [axes.get_title() for axes in figure.axes] == ["A", "B"]
    assert figure.axes[0].get_ylim() == figure.axes[1].get_ylim()
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["x", "y"]


def test_curves_differ_in_their_dashes():
    figure = draw(error_panels_figure([CURVES, CURVES], titles=("A", "B")))
    dashes = {str(line.get_linestyle()) + str(line._dash_pattern) for line in figure.axes[0].lines}
    assert len(dashes) == 3


def test_an_unknown_error_curve_is_refused():
    with pytest.raises(ValueError, match=r"`errors` must hold average of all models, .*; got mean"):
        error_panels_figure([{"mean": np.ones(3)}], titles=("A",))


def test_swarms_are_drawn_as_means_with_bands_and_the_best_possible():
    swarms = {"agents": RNG.random((4, 6)), "model": RNG.random((4, 6))}
    figure = draw(
        gathering_figure(np.arange(6.0), {"Share": swarms, "Spread": swarms}, limits={"Share": 1, "Spread": 0})
    )
    for axes in figure.axes:
        np.testing.assert_allclose(axes.lines[0].get_ydata(), swarms["agents"].mean(axis=0))
        assert len(axes.collections) == 2
    assert figure.axes[0].lines[2].get_ydata()[0] == 1


def test_swarms_at_other_moments_are_refused():
    swarms = {"agents": np.ones((4, 5)), "model": np.ones((4, 6))}
    with pytest.raises(ValueError, match=r"`agents` must have the shape \(R, 6\)"):
        gathering_figure(np.arange(6.0), {"Share": swarms}, limits={"Share": 1})


def test_moments_can_stand_in_rows():
    poses = RNG.uniform(0, 100, (5, 4, 3))
    figure = draw(snapshots_figure(poses, times_s=(0, 1, 2, 3, 4), robots=4, columns=3))
    rows = {round(axes.get_position().y0, 1) for axes in figure.axes[:5]}
    assert (len(figure.axes), len(rows)) == (6, 2)
