import numpy as np
import pytest

from turing_learning.config import LARGEST_SEED, ConfigurationError
from turing_learning.studies import BEHAVIORS, plan_study, study
from turing_learning.studies._plan import random_controller


def test_seeds_follow_one_another():
    plan = plan_study("aggregation", runs=3, first_seed=7)
    assert [settings["run.seed"] for settings in plan.settings] == [7, 8, 9]
    assert [plan.configuration(number).run.seed for number in plan.numbers] == [7, 8, 9]


def test_numbers_of_numpy_are_integers_too():
    assert plan_study("aggregation", runs=np.int64(2), first_seed=np.int64(4)) == plan_study(
        "aggregation", runs=2, first_seed=4
    )


def test_the_first_seed_is_that_of_the_file_unless_it_is_given(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("scenario = 'aggregation'\n[run]\nseed = 7\n[grid]\nmodels.parents = [5, 6]\n")
    assert [one["run.seed"] for one in plan_study(config=file, runs=2).settings] == [7, 8, 7, 8]
    assert [one["run.seed"] for one in plan_study(config=file, runs=1, first_seed=3).settings] == [
        3,
        3,
    ]
    assert [one["run.seed"] for one in plan_study("aggregation", runs=2).settings] == [1, 2]


def test_runs_are_thin_and_have_one_thread_unless_asked_otherwise(tmp_path):
    assert plan_study("aggregation").base.run.history == "thin"
    assert plan_study("aggregation").base.run.threads == 1
    assert (
        plan_study(
            "aggregation", settings={"run.history": "full", "run.threads": 4}
        ).base.run.history
        == "full"
    )
    file = tmp_path / "full.toml"
    file.write_text('[run]\nhistory = "full"\nthreads = 2\n')
    base = plan_study("aggregation", config=file).base
    assert (base.run.history, base.run.threads) == ("full", 1)


def test_a_grid_stands_for_all_combinations_each_with_all_seeds():
    grid = {"models.population": [10, 20], "classifiers.hidden": [3, 5]}
    plan = plan_study("aggregation", runs=2, grid=grid)
    found = [
        (one["models.parents"], one["classifiers.hidden"], one["run.seed"]) for one in plan.settings
    ]
    assert found == [(p, h, s) for p in (5, 10) for h in (3, 5) for s in (1, 2)]
    assert plan.configuration(8).models.offspring == 10
    assert plan.group(8) == {"models.parents": 10, "models.offspring": 10, "classifiers.hidden": 5}


def test_a_file_may_hold_a_grid_or_a_list(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text("[run]\ngenerations = 9\n[grid]\nmodels.parents = [5, 6]\n")
    assert [
        one["models.parents"] for one in plan_study("aggregation", runs=1, config=file).settings
    ] == [5, 6]
    file.write_text(
        "[run]\ngenerations = 9\n[[list]]\nmodels.parents = 5\n[[list]]\n[list.classifiers]\nhidden = 2\n"
    )
    plan = plan_study("aggregation", runs=1, config=file)
    assert [plan.configuration(number).models.parents for number in plan.numbers] == [5, 50]
    assert [plan.configuration(number).classifiers.hidden for number in plan.numbers] == [5, 2]
    assert plan.base.run.generations == 9


def test_random_behaviors_draw_the_controller_from_the_seed_of_the_run():
    plan = plan_study("random-behaviors", runs=2, first_seed=3)
    assert plan.configuration(2).scenario.controller == random_controller(4)
    assert plan.configuration(1).scenario.name == BEHAVIORS.name
    assert (
        plan_study("random-behaviors", runs=1, first_seed=4).base.scenario
        == plan.configuration(2).scenario
    )
    assert plan.group(1) == plan.group(2) == {}


def test_random_controllers_are_uniform():
    values = np.array([random_controller(seed) for seed in range(1000)])
    assert values.shape == (1000, 4)
    assert np.abs(values).max() <= 1
    # 4000 values: the standard error of the mean is 0.58 / 63 = 0.009, that of the mean square 0.30 / 63 = 0.005
    assert abs(values.mean()) < 0.04
    assert abs((values**2).mean() - 1 / 3) < 0.02


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"runs": 0}, r"^`runs` must be an integer of at least 1; got 0\.$"),
        ({"runs": 2.5}, r"^`runs` must be an integer of at least 1; got 2\.5\.$"),
        (
            {"first_seed": 1.5},
            r"^`first_seed` must be an integer between 0 and \d+, so that 30 seeds follow; got 1\.5\.$",
        ),
        ({"runs": 2_000_000}, r"^`runs` must be at most 1000000 in all; got 2000000\.$"),
        (
            {"first_seed": -1},
            r"^`first_seed` must be an integer between 0 and \d+, so that 30 seeds follow; got -1\.$",
        ),
        ({"first_seed": LARGEST_SEED}, r"^`first_seed` must be an integer between 0"),
        (
            {"settings": {"run.seed": 4}},
            r"^`run.seed` must be left out of a study; got 4\. Give the seeds with",
        ),
        (
            {"grid": {"models.parents": [5, 0]}},
            r"^`models.parents` must be greater than or equal to 1; got 0 "
            r"\[configuration 2 of the study: models.parents = 0\]\.$",
        ),
        (
            {"grid": {"models.parens": [5]}},
            r"`models.parens` .*configuration 1 of the study.*Did you mean `models.parents`",
        ),
        (
            {"grid": {"models.parents": 5}},
            r"^`grid.models.parents` must be a list of one value or more; got 5",
        ),
        (
            {"grid": {"models.parents": []}},
            r"^`grid.models.parents` must be a list of one value or more; got \[\]\. Give one, or leave it out\.$",
        ),
        (
            {"grid": {}},
            r"^`grid` must name one setting or more; got an empty one\. Write models.parents = \[25, 50\], for",
        ),
        (
            {"grid": {"run.seed": [1, 2]}},
            r"^`run.seed` must be left out of a study's grid; got \[1, 2\]\. Give the seeds",
        ),
        (
            {"grid": {"run.threads": [1, 2]}},
            r"^`run.threads` must be left out of a study's grid; .*number of `workers`",
        ),
        (
            {"grid": {"models.parents": [5]}, "settings": {"models.parents": 6}},
            r"^`models.parents` must be given once; got it in the study's grid or list and as override models.parents",
        ),
        (
            {"grid": {"a.b": list(range(400)), "a.c": list(range(400))}},
            r"^`grid` must have at most 100000 combinations; got 160000\.$",
        ),
    ],
)
def test_what_is_wrong_is_named_before_anything_runs(arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        plan_study("aggregation", **arguments)


def test_a_sensor_for_objects_that_are_not_there_is_refused():
    with pytest.raises(
        ConfigurationError, match=r"`scenario.objects.count` must be at least 1 .*vl1 and vr1"
    ):
        plan_study("object-clustering", grid={"scenario.objects.count": [10, 0]})


def test_agents_of_a_study_are_known():
    with pytest.raises(
        ConfigurationError,
        match=r"^`scenario.known` must be true in a study, whose agents are simulated",
    ):
        plan_study("aggregation", settings={"scenario.known": False})


def test_the_controller_of_random_behaviors_cannot_be_given():
    with pytest.raises(
        ConfigurationError,
        match=r"^`scenario.controller` must be left out of a study of random behaviors",
    ):
        plan_study("random-behaviors", settings={"scenario.controller": [1, 1, 1, 1]})


def test_all_configurations_must_have_the_same_parameters():
    grid = {"scenario": ["aggregation", "object-clustering"]}
    with pytest.raises(
        ConfigurationError,
        match=r"^`scenario` must have the same model parameters .* got 4 in .* 6 in",
    ):
        plan_study(grid=grid)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("grid = 3\n", r"^`grid` must be a table of lists; got 3 \[.*study.toml:1\]\.$"),
        (
            "list = []\n",
            r"^`list` must be one table \[\[list\]\] for each configuration; got \[\] \[.*:1\]\.$",
        ),
        (
            "[grid]\n[[list]]\n",
            r"^`grid` must be given once, and without a list; got grid and list\.$",
        ),
        (
            "[[list]]\nrun.seed = 3\n",
            r"^`run.seed` must be left out of a study's list; got 3 \[.*study.toml:2\]\.",
        ),
    ],
)
def test_a_wrong_file_is_named(text, message, tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(text)
    with pytest.raises(ConfigurationError, match=message):
        plan_study("aggregation", config=file)


def test_a_number_of_generations_that_is_said_twice_and_not_the_same_is_refused(tmp_path):
    with pytest.raises(
        ConfigurationError,
        match=r"`run.generations` must be given once; got generations=2 and settings=",
    ):
        study("aggregation", generations=2, settings={"run.generations": 3}, out=tmp_path / "study")
    assert not (tmp_path / "study").exists()
