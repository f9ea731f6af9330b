import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from turing_learning.cli._live import watching
from turing_learning.coevolution import Generation
from turing_learning.runs import Progress


def progress(completed=100, selection="active"):
    generation = Generation(
        number=completed - 1,
        models=np.array([[0.5, -1.0], [2.0, 1e7]]),
        model_step_sizes=np.ones((2, 2)),
        model_fitness=np.array([0.25, 0.75]),
        model_scores=np.array([0.25, 0.75]),
        classifiers=np.zeros((2, 3)),
        classifier_step_sizes=np.ones((2, 3)),
        classifier_fitness=np.array([0.5, 0.9]),
        selection=selection,
        referees=np.zeros((0, 3)),
    )
    return Progress(
        generation,
        completed,
        total=1000,
        parameter_names=("a", "b"),
        truth=(0.1, 0.2),
        seconds_per_generation=0.01,
    )


def shown(*steps, terminal):
    console = Console(file=io.StringIO(), force_terminal=terminal, width=120, color_system=None)
    with watching(console) as view:
        for step in steps:
            view(step)
    return console.file.getvalue()


def test_a_terminal_shows_generation_rate_time_left_parameters_and_fitness():
    text = shown(progress(), terminal=True)
    for part in (
        "generation 100/1000",
        "100.0 generations/s",
        "0:09 left",
        "best model",
        "2.000",
        "1.00e+07",
        "truth",
    ):
        assert part in text
    assert "0.750" in text
    assert "0.900" in text


def test_a_terminal_shows_a_flag_only_while_selection_stops():
    assert "SELECTION STOPPED" not in shown(progress(), terminal=True)
    text = shown(progress(selection="all rejected"), terminal=True)
    assert "SELECTION STOPPED in 1 of the last 1 generations (all rejected)" in text


def test_elsewhere_there_is_a_line_every_100_generations():
    steps = [progress(completed) for completed in range(1, 251)]
    lines = shown(*steps, terminal=False).splitlines()
    assert [line.split()[1] for line in lines] == ["100/1000", "200/1000"]
    assert lines[0] == (
        "generation 100/1000  100.0 generations/s  a 2.000 b 1.00e+07  fitness: models 0.500, classifiers 0.700"
    )


def test_a_run_of_trials_is_seen_in_trials():
    steps = [
        replace(progress(batch), total=41, trials=(60 + 6 * batch, 306)) for batch in range(1, 42)
    ]
    lines = shown(*steps, terminal=False).splitlines()
    assert [line.split("  ")[0] for line in lines] == [
        f"trial {spent}/306" for spent in (120, 180, 240, 300, 306)
    ]
    text = shown(steps[9], terminal=True)
    assert "trial 120/306" in text
    assert "generation" not in text


def test_a_line_says_in_how_many_generations_selection_stopped_since_the_last():
    stopped = [
        progress(completed, "all accepted" if completed in (7, 8) else "active")
        for completed in range(1, 201)
    ]
    first, second = shown(*stopped, terminal=False).splitlines()
    assert first.endswith("  SELECTION STOPPED in 2 of the last 100 generations (all accepted)")
    assert "SELECTION" not in second


@pytest.mark.parametrize(
    ("recent", "said"),
    [
        ([0.1, 0.2, 0.9, 0.8], "models so far: good"),
        ([0.1, 0.2, 0.1, 0.2], "models so far: I = 1 as I = 0"),
        ([0.9, 0.8, 0.1, 0.2], "models so far: states exchanged"),
        ([-0.9, 0.8, -0.1, 0.2], "models so far: away from the truth"),
    ],
)
@pytest.mark.parametrize("terminal", [True, False])
def test_it_is_named_how_the_recent_models_miss_the_truth(recent, said, terminal):
    step = replace(progress(), truth=(0.1, 0.2, 0.9, 0.8), recent=np.tile(recent, (50, 1)))
    assert said in shown(step, terminal=terminal)


def test_without_a_truth_nothing_is_named():
    assert "so far" not in shown(
        replace(progress(), truth=None, recent=np.zeros((50, 2))), terminal=False
    )
