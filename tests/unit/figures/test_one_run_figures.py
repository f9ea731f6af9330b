import subprocess
import sys

import numpy as np
import pytest

from turing_learning.figures._one_run import (
    MOST_POINTS,
    error_figure,
    fitness_figure,
    parameters_figure,
    step_sizes_figure,
)
from turing_learning.figures._picture import svg_markup

NAMES = ("vl0", "vr0", "vl1", "vr1")
G = 40
RNG = np.random.default_rng(0)
BEST = RNG.normal(size=(G, 4))
TYPICAL = RNG.normal(size=(G, 4))


def panels(figure):
    return [axes for axes in figure.axes if axes.get_visible()]


def curve(axes, label):
    return next(line.get_ydata() for line in axes.lines if line.get_label() == label)


def patches(axes, label):
    return [patch for patch in axes.patches if patch.get_label() == label]


def draw(figure):
    """Draw everything: warnings are errors."""
    svg_markup(figure, "f", "")


@pytest.mark.parametrize(
    ("code", "module"),
    [
        ("import turing_learning.figures, turing_learning.report", "matplotlib"),
        ("import turing_learning.figures, turing_learning.report", "PIL"),
        (
            "import numpy as np; from turing_learning.figures._one_run import error_figure as f; f(np.ones(1), np.ones(1))",
            "matplotlib.pyplot",
        ),
    ],
)
def test_heavy_modules_are_left_alone(code, module):
    check = f"import sys; {code}; sys.exit({module!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0


@pytest.mark.parametrize("parameters", [1, 2, 4, 5, 6])
def test_every_parameter_has_a_panel_with_its_name(parameters):
    values = np.zeros((3, parameters))
    names = [f"p{k}" for k in range(parameters)]
    figure = parameters_figure(values, values, names=names)
    assert [axes.get_title(loc="left") for axes in panels(figure)] == names
    draw(figure)


def test_a_panel_shows_both_histories_and_the_truth():
    axes = panels(parameters_figure(BEST, TYPICAL, names=NAMES, truth=[0.1, 0.2, 0.3, 0.4]))[2]
    np.testing.assert_array_equal(curve(axes, "best model"), BEST[:, 2])
    np.testing.assert_array_equal(curve(axes, "median of the better half"), TYPICAL[:, 2])
    assert list(curve(axes, "true value")) == [0.3, 0.3]


def test_the_truth_is_dashed():
    axes = panels(parameters_figure(BEST, TYPICAL, names=NAMES, truth=np.zeros(4)))[0]
    assert next(line for line in axes.lines if line.get_label() == "true value").is_dashed()


def test_without_truth_there_is_no_truth_line():
    axes = panels(parameters_figure(BEST, TYPICAL, names=NAMES))[0]
    assert [line.get_label() for line in axes.lines] == ["best model", "median of the better half"]


def test_a_distant_truth_is_in_view():
    axes = panels(parameters_figure(BEST, TYPICAL, names=NAMES, truth=[50, 0, 0, 0]))[0]
    assert axes.get_ylim()[1] > 50


def test_one_excursion_does_not_flatten_the_panel_but_is_named():
    best = np.zeros((1000, 1))
    best[500:] = 1
    best[3] = -1000
    axes = panels(parameters_figure(best, best * 0, names=["a"]))[0]
    assert axes.get_ylim()[0] > -1
    assert [text.get_text() for text in axes.texts] == ["whole range \N{MINUS SIGN}1e+03 to 1"]


def test_constant_parameters_can_be_drawn():
    figure = parameters_figure(np.ones((5, 1)), np.ones((5, 1)), names=["a"])
    low, high = panels(figure)[0].get_ylim()
    assert low < 1 < high
    draw(figure)


def test_dollar_signs_and_underscores_in_names_are_drawn_as_they_are():
    names = ("$a_", "_b$$", r"\frac", "^{")
    draw(parameters_figure(BEST, TYPICAL, names=names))
    text = svg_markup(step_sizes_figure(np.ones((3, 4)), np.ones(3), names=names), "f", "")
    assert ">$a_<" in text
    assert "_b$$<" in text


def test_errors_are_on_a_logarithmic_axis():
    axes = panels(error_figure(np.geomspace(1, 0.01, G), np.geomspace(1, 0.001, G)))[0]
    assert axes.get_yscale() == "log"
    np.testing.assert_array_equal(curve(axes, "best model"), np.geomspace(1, 0.01, G))


def test_errors_of_zero_can_be_drawn():
    draw(error_figure(np.zeros(2), np.zeros(2)))
    draw(error_figure(np.array([0.1, 0.0]), np.array([0.0, 0.2])))


def test_fitness_is_drawn_as_median():
    models, classifiers = RNG.random((G, 11)), RNG.random((G, 7))
    axes = panels(fitness_figure(models, classifiers, stopped=np.zeros(G)))[0]
    np.testing.assert_allclose(curve(axes, "models"), np.median(models, axis=1))
    np.testing.assert_allclose(curve(axes, "classifiers"), np.median(classifiers, axis=1))


def test_the_band_of_a_long_run_holds_every_quartile():
    models = RNG.random((5 * MOST_POINTS + 3, 5))
    axes = panels(fitness_figure(models, models, stopped=np.zeros(len(models))))[0]
    band = axes.collections[0].get_paths()[0].vertices
    assert len(band) < 3 * MOST_POINTS
    assert band[:, 1].max() == np.quantile(models, 0.75, axis=1).max()
    assert band[:, 1].min() == np.quantile(models, 0.25, axis=1).min()


def test_each_span_without_selection_is_shaded_once():
    stopped = np.zeros(G, bool)
    stopped[[0, 1, 2, 10, G - 1]] = True
    axes = panels(fitness_figure(np.ones((G, 2)), np.ones((G, 2)), stopped=stopped))[0]
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
    assert spans == [(-0.5, 2.5), (9.5, 10.5), (G - 1.5, G - 0.5)]
    assert len(patches(axes, "selection stopped")) == 1


def test_step_sizes_have_a_curve_each_that_differs_without_color():
    axes = panels(step_sizes_figure(np.ones((G, 4)), np.ones(G), names=NAMES))[0]
    assert [line.get_label() for line in axes.lines] == [*NAMES, "classifiers"]
    looks = {(str(line._unscaled_dash_pattern), line.get_linewidth()) for line in axes.lines}
    assert len(looks) == 5


def test_one_generation_is_drawn_as_dots():
    figure = error_figure(np.array([0.3]), np.array([0.2]))
    assert [line.get_marker() for line in panels(figure)[0].lines] == ["o", "o"]
    draw(figure)
    draw(parameters_figure(BEST[:1], TYPICAL[:1], names=NAMES))
    draw(fitness_figure(BEST[:1], TYPICAL[:1], stopped=[True]))
    draw(step_sizes_figure(np.ones((1, 4)), np.ones(1), names=NAMES))
