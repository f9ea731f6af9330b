import numpy as np
import pytest

from turing_learning import figures
from turing_learning.figures import budget_figure

ERRORS = {100: np.array([0.3, 0.2, 0.4]), 1000: np.array([0.05, 0.02, 0.03])}


def test_medians_are_a_line_over_the_numbers_of_trials_and_runs_are_dots():
    figure = budget_figure({"One": {"NPE": ERRORS, "mixture": {10: np.array([0.001])}}, "Two": {"NPE": ERRORS}})
    figures.svg_markup(figure, "f", "")
    assert [axes.get_title() for axes in figure.axes] == ["One", "Two"]
    line = next(one for one in figure.axes[0].lines if one.get_label() == "NPE")
    np.testing.assert_allclose([line.get_xdata(), line.get_ydata()], [[100, 1000], [0.3, 0.03]])
    dots = [one.get_ydata() for one in figure.axes[1].lines if one.get_label() != "NPE"]
    np.testing.assert_array_equal(dots, list(ERRORS.values()))


def test_both_axes_are_logarithmic_with_plain_numbers():
    axes = budget_figure({"One": {"NPE": ERRORS}}).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert axes.xaxis.get_major_formatter()(1000) == "1,000"


def test_nothing_to_draw_is_refused():
    with pytest.raises(ValueError, match="`panels` must hold at least one panel; got none"):
        budget_figure({})


def test_an_error_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="`errors of NPE` must be finite; got nan"):
        budget_figure({"One": {"NPE": {10: np.array([np.nan])}}})
