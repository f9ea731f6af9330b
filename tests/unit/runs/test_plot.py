"""`Result.plot` draws into the axes that it is given, or into new ones, and returns them."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.families import BurstAndCoast

pytestmark = pytest.mark.filterwarnings("ignore:.*non-interactive")
TANK = BurstAndCoast(individuals=3, steps=200, interval_s=0.2, tank_cm=(30.0, 20.0))
PLACES = TANK.simulate(np.array([[12.0, 0.5, 0.8, 0.3]]), np.random.default_rng(0))[0]
RECORDING = tl.Trajectories(
    PLACES, np.ones(PLACES.shape[:2], dtype=bool), fps=5.0, individuals=("a", "b", "c")
)
WALK = BurstAndCoast(individuals=3, steps=20, interval_s=0.2, tank_cm=(30.0, 20.0))
SMALL = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


def observed(simulate=WALK, **more):
    windows = RECORDING.windows(length_s=4.0)
    parameters = WALK.parameters
    return tl.infer(
        genuine=windows,
        simulate=simulate,
        parameters=parameters,
        generations=3,
        settings=SMALL,
        **more,
    )


@pytest.fixture(scope="module")
def swarm():
    return tl.infer("aggregation", generations=4, seed=1)


def lines(axes, name):
    return next(line.get_ydata() for line in axes.lines if line.get_label() == name)


def test_parameters_and_fitness_are_those_of_the_history(swarm):
    panels, drawn = Figure().subplots(1, 4), swarm.plot.parameters
    assert (drawn(panels) == panels).all()
    for axes, name in zip(panels, swarm.estimate, strict=True):
        assert axes.get_title(loc="left") == name
        np.testing.assert_array_equal(
            lines(axes, "best model"), swarm.history["best_model"].sel(parameter=name)
        )
        assert set(lines(axes, "true value")) == {swarm.truth[name]}
    axes = Figure().subplots()
    assert swarm.plot.fitness(ax=axes) is axes
    np.testing.assert_array_equal(
        lines(axes, "models"), swarm.history["model_fitness"].median("individual")
    )


def test_without_axes_there_is_a_figure_of_pyplot(swarm):
    import matplotlib.pyplot as plt

    before = set(plt.get_fignums())
    axes = swarm.plot.fitness()
    assert plt.figure(max(plt.get_fignums())) is axes.figure
    assert [text.get_text() for text in axes.figure.legends[0].get_texts()] == [
        "models",
        "classifiers",
    ]
    for number in set(plt.get_fignums()) - before:
        plt.close(number)


def test_a_swarm_moves_and_its_distributions_are_those_of_a_check(swarm):
    agents, replicas = swarm.plot.motion(Figure().subplots(1, 2))
    ways = [
        np.array([line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2])
        for axes in (agents, replicas)
    ]
    assert ways[0].shape == ways[1].shape == (11, 901, 2)  # ten agents and a replica
    np.testing.assert_array_equal(ways[0][:, 0], ways[1][:, 0])  # the same start
    assert (ways[0][:, -1] != ways[1][:, -1]).all()
    shown = swarm.plot.distributions(Figure().subplots(2, 2))
    assert [axes.get_title(loc="left") for axes in shown][:2] == ["speed (cm/s)", "turn (rad/s)"]
    for axes in shown:
        assert [patch.get_data().values.sum() for patch in axes.patches] == pytest.approx([1, 1])


def test_a_recording_is_shown_in_memory_and_from_a_folder(tmp_path):
    kept, stored = observed(), observed(out=tmp_path / "run")
    for result in (kept, stored, tl.load_run(tmp_path / "run")):
        recorded, _ = result.plot.motion(Figure().subplots(1, 2))
        ways = np.array([line.get_xydata() for line in recorded.lines if len(line.get_xdata()) > 2])
        first = PLACES[: ways.shape[1]]
        np.testing.assert_allclose(ways, (first - first.min(axis=(0, 1))).swapaxes(0, 1))
    speeds = [
        result.plot.distributions(Figure().subplots(1, 2))[0].patches[0]
        for result in (kept, stored)
    ]
    assert speeds[0].get_data().values == pytest.approx(speeds[1].get_data().values)
    windows, shown = RECORDING.windows(length_s=4.0), speeds[0].get_data()
    values = np.concatenate((windows.learning, windows.held_out))[..., 0]
    counts = np.histogram(np.clip(values, *shown.edges[[0, -1]]), shown.edges)[0]
    assert shown.values == pytest.approx(counts / counts.sum())
    loaded = tl.load_run(tmp_path / "run").plot
    with pytest.raises(ConfigurationError, match=r"`genuine` must be given .* Give .*genuine"):
        loaded.distributions()
    again = loaded.distributions(
        Figure().subplots(1, 2), genuine=RECORDING.windows(length_s=4.0), simulate=WALK
    )
    assert again[0].patches[0].get_data().values == pytest.approx(speeds[0].get_data().values)


def test_units_are_those_of_recordings_alone():
    def walk(parameters, rng):
        return parameters[:, :1, None] * rng.random((len(parameters), 20, 2))

    options = {
        "genuine": walk(np.ones((30, 1)), np.random.default_rng(0)),
        "parameters": {"a": (0, 2)},
    }
    own = tl.infer(
        simulate=walk, signals=("speed", "turn"), generations=2, settings=SMALL, **options
    )
    for result, names in ((own, ["speed", "turn"]), (observed(), ["speed (cm/s)", "turn (rad/s)"])):
        shown = result.plot.distributions(Figure().subplots(1, 2))
        assert [axes.get_title(loc="left") for axes in shown] == names


def test_what_cannot_be_drawn_is_refused(swarm):
    with pytest.raises(ConfigurationError, match="`ax` must be 4 matplotlib axes; got 1 of Axes"):
        swarm.plot.parameters(Figure().subplots())
    with pytest.raises(ConfigurationError, match="`ax` must be matplotlib axes; got 1 of str"):
        swarm.plot.fitness("axes")
    with pytest.raises(
        ConfigurationError, match="whose simulator says where everybody is; got samples alone"
    ):
        observed(lambda parameters, rng: WALK(parameters, rng)).plot.motion()
