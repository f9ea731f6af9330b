import numpy as np
import pytest

from turing_learning import figures
from turing_learning.figures._reproduction import dispersion_figure, prediction_figure, snapshots_figure

RNG = np.random.default_rng(0)


def draw(figure):
    """Draw everything: warnings are errors."""
    figures.svg_markup(figure, "f", "")
    return figure


def test_moments_stand_side_by_side_at_the_same_scale():
    poses = RNG.uniform(0, 100, size=(4, 7, 3))
    figure = draw(snapshots_figure(poses, times_s=(0, 20, 40, 60), robots=5))
    assert [axes.get_title() for axes in figure.axes] == [
        "initial configuration",
        *(f"after {t} s" for t in (20, 40, 60)),
    ]
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    low, high = figure.axes[0].get_xlim()
    assert low < poses[..., 0].min()
    assert poses[..., 0].max() < high


def test_robots_in_a_wide_arena_are_enlarged_and_the_figure_says_so():
    wide = RNG.uniform(0, 2000, size=(1, 5, 3))
    assert "times as large" in draw(snapshots_figure(wide, times_s=(0,), robots=5)).get_supxlabel()
    near = wide / 20
    assert "times as large" not in draw(snapshots_figure(near, times_s=(0,), robots=5)).get_supxlabel()


def test_moments_without_times_are_refused():
    with pytest.raises(ValueError, match=r"`poses` must have the shape \(2, A \+ O, 3\)"):
        snapshots_figure(np.zeros((3, 5, 3)), times_s=(0, 1), robots=5)


def test_agents_are_hatched_and_the_least_dispersion_is_dashed():
    figure = draw(dispersion_figure(np.arange(360.0, 390.0), RNG.uniform(360, 390, (30, 30)), least=343.5))
    axes = figure.axes[0]
    assert [bool(patch.get_hatch()) for patch in axes.patches] == [True] + [False] * 30
    dashed = next(line for line in axes.lines if line.get_label() == "least possible")
    assert list(dashed.get_ydata()) == [343.5, 343.5]
    assert axes.get_ylabel() == "Dispersion of the robots"
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["agents", "5", "10", "15", "20", "25", "30"]


def test_models_that_do_not_gather_are_counted_and_do_not_flatten_the_boxes():
    models = np.full((3, 4), 400.0)
    models[1] = 1e7
    axes = draw(dispersion_figure(np.array([380.0, 390.0]), models, least=343.5)).axes[0]
    assert axes.get_ylim()[1] < 2000
    assert [text.get_text() for text in axes.texts] == ["4 trials beyond"]


def test_a_dispersion_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match=r"`models` must be finite; got nan at index \(0, 0\)"):
        dispersion_figure(np.ones(2), np.array([[np.nan]]), least=0.5)


def test_predictions_stand_beside_medians_and_quartiles():
    values = np.arange(9.0)[:, None] * np.ones(2)
    figure = draw(prediction_figure(values, predicted=[0.1, 0.2], truth=[1.0, 2.0], names=("vl0", "vr0")))
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    np.testing.assert_array_equal(lines["predicted"], [0.1, 0.2])
    assert any(np.array_equal(line.get_ydata(), [4.0, 4.0]) for line in figure.axes[0].lines)


def test_predictions_of_another_number_of_parameters_are_refused():
    with pytest.raises(ValueError, match=r"`predicted` must have the shape \(2,\)"):
        prediction_figure(np.ones((3, 2)), predicted=[0.1], truth=[1.0, 2.0], names=("vl0", "vr0"))
