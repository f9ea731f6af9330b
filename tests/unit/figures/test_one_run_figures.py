import subprocess
import sys

import numpy as np
import pytest

from turing_learning.figures import timeline_figure
from turing_learning.figures._picture import svg_markup
from turing_learning.figures.one_run import (
    BAND_POINTS,
    ParameterProfile,
    accuracy_figure,
    dialogues_figure,
    error_figure,
    fitness_figure,
    parameters_figure,
    profiles_figure,
    quantities_figure,
    step_sizes_figure,
)

NAMES = ("vl0", "vr0", "vl1", "vr1")
G = 40
RNG = np.random.default_rng(0)
BEST = RNG.normal(size=(G, 4))
TYPICAL = RNG.normal(size=(G, 4))
HALF = np.full(4, 0.25)
GENERATIONS = np.array([0, 1, 10, 999])
OBJECTIVE = np.array([[0.6, 0.7, 0.9, 0.97], [0.7, 0.8, 0.92, 0.99]])
WINDOWS = np.stack((np.arange(4.0), np.arange(4.0) + 1), axis=1)


def panels(figure):
    return [axes for axes in figure.axes if axes.get_visible()]


def curve(axes, label):
    return next(line.get_ydata() for line in axes.lines if line.get_label() == label)


def patches(axes, label):
    return [patch for patch in axes.patches if patch.get_label() == label]


def draw(figure):
    """Draw everything: warnings are errors."""
    svg_markup(figure, "f", "")
    return figure


@pytest.mark.parametrize(
    ("code", "module"),
    [
        ("import turing_learning.figures, turing_learning.report", "matplotlib"),
        ("import turing_learning.figures, turing_learning.report", "PIL"),
        (
            "import numpy as np; from turing_learning.figures.one_run import error_figure as f; f(np.ones(1), np.ones(1))",
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


def test_every_panel_without_another_below_it_has_labels():
    values = RNG.normal(size=(G, 5))
    figure = draw(parameters_figure(values, values, names=list("abcde")))
    labelled = [axes.get_xlabel() != "" for axes in panels(figure)]
    assert labelled == [axes.xaxis.get_tick_params()["labelbottom"] for axes in panels(figure)]
    assert labelled == [False, False, True, True, True]


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
    models = RNG.random((5 * BAND_POINTS + 3, 5))
    axes = panels(fitness_figure(models, models, stopped=np.zeros(len(models))))[0]
    band = axes.collections[0].get_paths()[0].vertices
    assert len(band) < 3 * BAND_POINTS
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


def test_the_accuracy_of_both_best_classifiers_is_a_mean_over_the_runs():
    axes = draw(accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.1, objective=OBJECTIVE)).axes[
        0
    ]
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
    axes = draw(accuracy_figure(GENERATIONS, subjective=OBJECTIVE - 0.3, objective=OBJECTIVE)).axes[
        0
    ]
    assert axes.get_ylim()[0] <= 0.3


def test_the_best_of_the_jury_is_a_third_curve():
    axes = draw(
        accuracy_figure(
            GENERATIONS, subjective=OBJECTIVE - 0.1, objective=OBJECTIVE, jury=OBJECTIVE + 0.005
        )
    ).axes[0]
    heights = [container.lines[0].get_ydata().mean() for container in axes.containers]
    assert sorted(heights) == pytest.approx(
        [OBJECTIVE.mean() - 0.1, OBJECTIVE.mean(), OBJECTIVE.mean() + 0.005]
    )


def test_each_quantity_has_a_panel_with_both_distributions():
    figure = quantities_figure(
        {name: (np.arange(5), HALF, HALF) for name in ("speed", "turn", "x")}
    )
    assert [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()] == [
        "speed",
        "turn",
        "x",
    ]
    assert len(figure.axes[0].patches) == 2
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "genuine",
        "simulated at the estimate",
    ]


def test_a_profile_shows_estimate_interval_and_what_was_recovered():
    profile = ParameterProfile(
        "speed", np.arange(3.0), np.ones(3), HALF[:3], 1.0, (0.5, 1.5), recovered=[1.1]
    )
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
    bad = np.array([False, True, True, False])
    figure = timeline_figure(
        ["Ada", "[Bo]"], [WINDOWS] * 2, [HALF] * 2, [bad, ~bad & False], limit=4.0
    )
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["Ada", "[Bo]"]
    assert len(axes.patches) == 8
    colors = {patch.get_facecolor() for patch in axes.patches}
    assert len(colors) == 2
    assert axes.get_xlim() == (0, 4)
    nobody = [bad & False] * 2
    short = timeline_figure(
        ["Ada", "Bo"], [WINDOWS] * 2, [HALF] * 2, nobody, limit=4.0, unjudged={"Bo"}
    )
    names = {text.get_text() for text in short.legends[0].get_texts()}
    assert names == {"normal", "too short to judge"}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"names": []},
            "`names` must be one name for each of the individuals, at least one; got 0",
        ),
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


def test_stimuli_stand_beside_answers_with_what_the_classifier_says_of_them():
    shown = {
        "stimuli": RNG.random((2, 2, 9, 1)),
        "answers": RNG.random((2, 2, 9, 2)),
        "ranges": np.array([[0, 1]]),
    }
    chosen = {"outputs": np.array([[0.9, 0.1], [0.8, 0.3]]), "accuracy": np.array([0.75, 0.5])}
    figure = draw(
        dialogues_figure(
            shown | chosen, names=("speed", "turn", "light"), rows=("gain", "bias"), interval_s=0.1
        )
    )
    assert [axes.get_ylabel() for axes in figure.axes] == ["light", "speed", "turn"] * 2
    titles = [axes.get_title(loc="left") for axes in figure.axes[::3]]
    assert titles[0] == "gain: 75% right; output 0.90 for the system, 0.10 for the estimate"
    assert [line.get_label() for line in figure.axes[0].lines] == ["system", "estimate"]
