"""Section 4.4: its verdicts, and that its pieces are what the whole would be."""

import numpy as np
import pytest

from turing_learning.config import classifier_of
from turing_learning.reproduction import Stopped
from turing_learning.reproduction._experiment import Work
from turing_learning.reproduction._post_evaluation import (
    count_agents,
    decision_accuracies,
    grid_models,
)
from turing_learning.reproduction.experiments import EXPERIMENTS
from turing_learning.reproduction.experiments.classifiers import (
    BestAccuracies,
    accuracy_verdicts,
    configuration_of,
    run_populations,
)
from turing_learning.runs import infer
from turing_learning.swarm import AGGREGATION

GENERATIONS = np.array([0, 1, 5, 50, 500, 999])
SUBJECTIVE = np.array([0.6, 0.85, 0.84, 0.7, 0.65, 0.78])
OBJECTIVE = np.array([0.8, 0.85, 0.9, 0.93, 0.95, 0.97])
ALL, ALONE = "objective best", "objective best without the archive"
SETTINGS = {"models.population": 8, "classifiers.population": 8}
SMALL = {"runs": 2, "generations": 3, "first_seed": 7, "settings": SETTINGS}


def best_of(subjective=SUBJECTIVE, objective=OBJECTIVE, variant="", jury=None):
    """Return the accuracies of two runs that differ by 0.002; without an archive, the jury is the population."""
    curves = (subjective, objective, objective if jury is None else jury)
    return BestAccuracies(
        variant, GENERATIONS, *(np.stack([one - 0.001, one + 0.001]) for one in curves)
    )


def words(**curves):
    """Return variant -> verdict."""
    return {verdict.variant: verdict.word for verdict in accuracy_verdicts(best_of(**curves))}


def changed(values, generation, value):
    return np.where(generation == GENERATIONS, value, values)


def test_the_picture_of_the_paper_agrees():
    assert words() == {"": "agree", "subjective best": "agree", ALL: "agree", ALONE: "agree"}


@pytest.mark.parametrize(
    ("generation", "value"),
    [(0, 0.9), (50, 0.87), (500, 0.60), (999, 0.82)],
    ids=["no rise", "no drop", "below the range", "above the range"],
)
def test_a_subjectively_best_that_does_something_else_differs(generation, value):
    found = words(subjective=changed(SUBJECTIVE, generation, value))
    assert found == {"": "differ", "subjective best": "differ", ALL: "agree", ALONE: "agree"}


@pytest.mark.parametrize(
    ("generation", "value"),
    [(999, 0.95), (500, 0.90), (0, 0.971)],
    ids=["not above 0.95", "a step back", "no rise"],
)
def test_an_objectively_best_that_does_something_else_differs(generation, value):
    found = words(objective=changed(OBJECTIVE, generation, value))
    assert found == {"": "differ", "subjective best": "agree", ALL: "differ", ALONE: "differ"}


def test_a_population_may_forget_what_its_archive_has_kept():
    found = words(objective=changed(OBJECTIVE, 999, 0.8), jury=OBJECTIVE)
    assert found == {"": "agree", "subjective best": "agree", ALL: "agree", ALONE: "differ"}


def reasons(objective=OBJECTIVE, **curves):
    best = best_of(objective=objective, **curves)
    return {verdict.variant: verdict.reason for verdict in accuracy_verdicts(best)}


def test_a_reason_is_given_only_where_it_was_found():
    assert not any(reasons().values())
    assert not any(reasons(subjective=changed(SUBJECTIVE, 50, 0.60)).values())  # below the range
    assert not any(reasons(objective=OBJECTIVE - 0.05).values())  # never above 0.95
    higher = reasons(subjective=changed(SUBJECTIVE, 500, 0.84))
    assert "jump" in higher[""]
    assert "jump" in higher["subjective best"]
    assert not higher[ALL] + higher[ALONE]
    assert not reasons(subjective=changed(SUBJECTIVE, 500, 0.84), variant="preset paper")[
        "preset paper"
    ]
    forgotten = reasons(objective=changed(changed(OBJECTIVE, 500, 0.96), 999, 0.8), jury=OBJECTIVE)
    assert "forgets" in forgotten[ALONE]
    assert not forgotten[""] + forgotten[ALL]


def test_a_small_step_back_is_still_almost_monotonic():
    assert words(objective=changed(OBJECTIVE, 500, 0.915))["objective best"] == "agree"


def test_the_range_is_held_against_twice_the_standard_error():
    # the standard error of two runs that differ by 0.002 is 0.001: the limits are 0.618 and 0.802
    assert words(subjective=changed(SUBJECTIVE, 999, 0.8019))[""] == "agree"
    assert words(subjective=changed(SUBJECTIVE, 999, 0.8021))[""] == "differ"


def test_verdicts_of_another_preset_stand_beside():
    assert list(words(variant="preset paper")) == [
        "preset paper",
        "preset paper, subjective best",
        "preset paper, objective best",
        "preset paper, objective best without the archive",
    ]


def test_populations_are_those_of_the_runs(tmp_path):
    found = run_populations(Work(tmp_path, None), SMALL, "paper", (0, 2))
    for run, seed in enumerate((7, 8)):
        history = infer(
            "aggregation", preset="paper", generations=3, seed=seed, settings=SETTINGS
        ).history.isel(generation=[0, 2])
        np.testing.assert_array_equal(found[run]["classifiers"], history["classifier"])
        np.testing.assert_array_equal(found[run]["fitness"], history["classifier_fitness"])
        assert found[run]["archived"].shape == (0, history.sizes["weight"])
        assert found[run]["judging"].shape == (2, 0)


def test_the_archive_holds_the_best_of_the_generations_before(tmp_path):
    found = run_populations(Work(tmp_path, None), SMALL, "default", (0, 1, 2))
    for run in range(2):
        best = [found[run]["classifiers"][k][found[run]["fitness"][k].argmax()] for k in range(2)]
        for generation in range(3):
            archived = found[run]["archived"][found[run]["judging"][generation]]
            assert {one.tobytes() for one in archived} == {
                one.tobytes() for one in best[:generation]
            }


def test_a_run_that_is_stopped_leaves_nothing(tmp_path):
    asked = []

    def should_stop():
        asked.append(True)
        return len(asked) > 2

    with pytest.raises(Stopped, match="run-default-seed7"):
        run_populations(Work(tmp_path, None, should_stop=should_stop), SMALL, "default", (0,))
    assert list(tmp_path.iterdir()) == []


def test_accuracies_are_those_of_each_run_on_its_own(rows, tmp_path):
    sizes = EXPERIMENTS["4.4"].fast
    found = [
        row
        for row in rows("4.4", "accuracy-runs")
        if (row["preset"], row["seed"]) == ("paper", "2002")
    ]
    configuration = configuration_of(Work(tmp_path, sizes), sizes["runs"], "paper", 2002)
    history = infer(
        "aggregation", preset="paper", generations=12, seed=2002, settings=sizes["runs"]["settings"]
    ).history
    classifier, models = classifier_of(configuration), grid_models(4, sizes["points"])
    for row, generation in zip(found, sizes["generations"], strict=True):
        genomes = history["classifier"].to_numpy()[generation]
        counts = count_agents(
            classifier, genomes, AGGREGATION, models, trials=sizes["trials"], seed=sizes["seed"]
        )
        alone = decision_accuracies(counts, AGGREGATION, len(models))
        fittest = history["classifier_fitness"].to_numpy()[generation].argmax()
        assert float(row["subjective"]) == pytest.approx(alone[fittest], rel=1e-5)
        assert float(row["objective"]) == pytest.approx(alone.max(), rel=1e-5)


def test_no_generation_that_is_judged_follows_a_renewal():
    sizes = EXPERIMENTS["4.4"].full
    assert {0, 1, 5, 99, sizes["runs"]["generations"] - 1} <= set(sizes["generations"])
    assert sizes["generations"] == sorted(set(sizes["generations"]))
    assert not {100, 200, 300, 400, 500} & set(sizes["generations"])
