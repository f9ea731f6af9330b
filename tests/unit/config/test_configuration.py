import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from turing_learning.config import ConfigurationError, load_configuration, to_toml
from turing_learning.errors import nearest
from turing_learning.models import ElmanModel, MorphologyModel
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, SCENARIOS, Arena


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "my.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def refused(path=None, **arguments):
    with pytest.raises(ConfigurationError) as caught:
        load_configuration(path, **arguments)
    return str(caught.value)


def test_the_default_configuration_is_the_papers_setup_of_aggregation():
    configuration = load_configuration()
    assert configuration.scenario == AGGREGATION
    assert (configuration.models.parents, configuration.models.offspring) == (50, 50)
    assert (configuration.classifiers.parents, configuration.classifiers.offspring) == (50, 50)
    assert (
        configuration.classifiers.hidden,
        configuration.run.generations,
        configuration.run.seed,
    ) == (5, 1000, 1)


def test_the_paper_preset_has_no_floor_under_the_step_sizes():
    paper = load_configuration(preset="paper")
    assert paper.models.minimum_step_size == paper.classifiers.minimum_step_size == 0


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_written_configuration_reads_back_equal(name, written):
    configuration = load_configuration(
        scenario=name,
        preset="paper",
        overrides={
            "run.threads": 3,
            "classifiers.input_scale": [12.5, 1e-3],
            "scenario.title": 'quote " backslash \\ tab \t umlaut \u00fc del \x7f',
            "scenario.arena.width_cm": 300.0,
            "scenario.arena.height_cm": 200,
        },
    )
    assert load_configuration(written(to_toml(configuration))) == configuration


@given(low=st.floats(-1e6, 0), step=st.floats(0.02, 1e6), seed=st.integers(0, 2**63 - 1))
def test_numbers_survive_writing_bit_by_bit(low, step, seed, tmp_path_factory):
    overrides = {"models.initial_low": low, "models.initial_step_size": step, "run.seed": seed}
    configuration = load_configuration(overrides=overrides)
    path = tmp_path_factory.mktemp("round") / "a.toml"
    path.write_text(to_toml(configuration), encoding="utf-8")
    again = load_configuration(path)
    assert (again.models.initial_low, again.models.initial_step_size, again.run.seed) == (
        low,
        step,
        seed,
    )


def test_a_written_configuration_has_every_field():
    text = to_toml(load_configuration())
    for key in (
        "wheel_noise",
        "start_side_cm",
        "readings",
        'width_cm = "unbounded"',
        "input_scale",
        "checkpoint_every",
    ):
        assert key in text


def test_a_scenario_table_changes_a_preset(written):
    path = written(
        '[scenario]\npreset = "object-clustering"\n[scenario.robot]\nwheel_noise = 0.1\n'
    )
    scenario = load_configuration(path).scenario
    assert scenario.robot.wheel_noise == 0.1
    assert scenario.objects == OBJECT_CLUSTERING.objects


def test_a_scenario_table_with_a_known_name_changes_that_scenario(written):
    path = written(
        '[scenario]\nname = "object-clustering"\nagents = 7\n[scenario.arena]\nwidth_cm = 150\nheight_cm = 120\n'
    )
    changed = replace(OBJECT_CLUSTERING, agents=7, arena=Arena(150.0, 120.0))
    assert load_configuration(path).scenario == changed
    assert load_configuration(path, scenario="object-clustering").scenario == changed


def test_a_scenario_table_may_give_a_known_scenario_another_name(written):
    path = written('[scenario]\npreset = "aggregation"\nname = "mine"\nagents = 7\n')
    assert load_configuration(path).scenario == replace(AGGREGATION, name="mine", agents=7)


@pytest.mark.parametrize(
    "text",
    ["", "[run]\nseed = 3\n", "[scenario]\nagents = 5\n", "[scenario.robot]\nradius_cm = 3\n"],
)
def test_a_file_with_which_nothing_says_what_is_to_run_is_refused(text, written):
    path = written(text)
    assert refused(path) == (
        f"`scenario` must be named, in the file or as an argument; got neither [{path}]. Write "
        'scenario = "aggregation", or [scenario] and name = "aggregation" below it. Choose from: aggregation, '
        "aggregation-field-of-view-0, aggregation-field-of-view-60, infrared-sensors, light-response, "
        "light-response-stochastic, object-clustering, rangefinder-response, sensor-configuration."
    )
    assert (
        load_configuration(path, scenario="object-clustering").scenario.name == "object-clustering"
    )


def test_a_scenario_table_without_preset_changes_the_scenario_of_the_argument(written):
    path = written("[scenario.robot]\nwheel_noise = 0.1\n")
    assert (
        load_configuration(path, scenario="object-clustering").scenario.name == "object-clustering"
    )


@pytest.mark.parametrize(
    "text",
    ['[scenario]\nname = "object-clustering"\nworld = "paper"\n', "scenario.world = 'paper'"],
)
def test_a_scenario_can_be_put_into_a_named_world(text, written):
    found = load_configuration(written(text), scenario="object-clustering").scenario
    assert found == OBJECT_CLUSTERING.in_world("paper")
    assert found.world == "paper"


def test_a_setting_beside_a_world_comes_before_it():
    overrides = {"scenario.world": "paper", "scenario.robot.actuation_lag_cycles": 2}
    scenario = load_configuration(overrides=overrides).scenario
    assert (scenario.objects.gravity_cm_s2, scenario.robot.actuation_lag_cycles) == (981.0, 2)
    assert scenario.world == "own"


def test_a_scenario_given_as_an_object_can_be_put_into_a_world_too():
    found = load_configuration(
        scenario=replace(AGGREGATION, agents=7), overrides={"scenario.world": "paper"}
    ).scenario
    assert found == replace(AGGREGATION, agents=7).in_world("paper")


def test_a_world_is_stored_as_its_settings(written):
    text = to_toml(load_configuration(overrides={"scenario.world": "paper"}))
    assert "world" not in text
    assert load_configuration(written(text)).scenario == AGGREGATION.in_world("paper")


def test_a_configuration_that_was_stored_before_worlds_came_is_in_enkis(written):
    lines = to_toml(load_configuration()).splitlines()
    later = (
        "gravity",
        "actuation_lag",
        "wheel_scale",
        "slip",
        "mistakes",
        "position_noise",
        "heading_noise",
        "delay_s",
    )
    old = [line for line in lines if not line.startswith((*later, "[scenario.tracker]"))]
    assert len(old) == len(lines) - 9
    assert load_configuration(written("\n".join(old))).scenario == AGGREGATION.in_world("enki")


def test_only_swarms_are_in_worlds():
    said = refused(scenario="light-response", overrides={"scenario.world": "paper"})
    assert "`scenario.world` must be a known setting" in said
    assert "Did you mean `scenario.world`" not in said


def test_a_scenario_can_be_given_as_an_object():
    assert load_configuration(scenario=OBJECT_CLUSTERING).scenario == OBJECT_CLUSTERING


def test_options_come_before_the_file_and_the_file_before_the_preset(written):
    path = written("[run]\nseed = 4\ngenerations = 7\n[models]\nminimum_step_size = 0.5\n")
    configuration = load_configuration(path, "paper", {"run.seed": 9}, scenario="aggregation")
    assert (configuration.run.seed, configuration.run.generations) == (9, 7)
    assert (
        configuration.models.minimum_step_size,
        configuration.classifiers.minimum_step_size,
    ) == (0.5, 0.0)


def test_an_even_population_is_split_into_halves(written):
    models = load_configuration(
        written("[models]\npopulation = 60\n"), scenario="aggregation"
    ).models
    assert (models.parents, models.offspring) == (30, 30)


def test_the_robots_input_scale_is_its_largest_speeds():
    assert load_configuration().input_scale == AGGREGATION.input_scale
    assert load_configuration(overrides={"classifiers.input_scale": [1.0, 2]}).input_scale == (
        1.0,
        2.0,
    )


def test_all_threads_are_none():
    assert load_configuration().threads is None
    assert load_configuration(overrides={"run.threads": 2}).threads == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[run]\ngeneratons = 3",
            "`run.generatons` must be a known setting; got 3 [{path}:2]. Did you mean `run.generations`?",
        ),
        ("seed = 3", "`seed` must be a known setting; got 3 [{path}:1]. Did you mean `run.seed`?"),
        (
            "[modles]\nx = 1",
            "`modles` must be a known setting; got a table [{path}:1]. Did you mean `models`?",
        ),
        (
            "\n[scenario.robot]\nwheel_nose = 0.1",
            "`scenario.robot.wheel_nose` must be a known setting; got 0.1 [{path}:3]. "
            "Did you mean `scenario.robot.wheel_noise`?",
        ),
        (
            "run.generations = 0",
            "`run.generations` must be greater than or equal to 1; got 0 [{path}:1].",
        ),
        ("[run]\nseed = -1", "`run.seed` must be greater than or equal to 0; got -1 [{path}:2]."),
        ("[run]\nseed = 1.5", "`run.seed` must be an integer; got 1.5 [{path}:2]."),
        ("[run]\nseed = true", "`run.seed` must be an integer; got True [{path}:2]."),
        (
            "[run]\nthreads = 0",
            '`run.threads` must be "all" or an integer of at least 1; got 0 [{path}:2].',
        ),
        (
            "[models]\nparents = 0",
            "`models.parents` must be greater than or equal to 1; got 0 [{path}:2].",
        ),
        (
            "[models]\noffspring = -2",
            "`models.offspring` must be greater than or equal to 1; got -2 [{path}:2].",
        ),
        (
            "[models]\npopulation = 101",
            "`models.population` must be an even number of at least 2, as it is split into as many parents as "
            "offspring; got 101 [{path}:2]. For an uneven split give parents and offspring.",
        ),
        (
            "[models]\npopulation = 20\nparents = 3",
            "`models.population` must be given without parents and offspring; got 20 beside them [{path}:2]. "
            "Remove one or the other.",
        ),
        (
            "[models]\ninitial_low = nan",
            "`models.initial_low` must be a finite number; got nan [{path}:2].",
        ),
        (
            "[models]\ninitial_high = inf",
            "`models.initial_high` must be a finite number; got inf [{path}:2].",
        ),
        (
            "[models]\ninitial_low = 2.0",
            "`models.initial_low` must be below initial_high; got 2.0 and 1.0 [{path}:2].",
        ),
        (
            "[classifiers]\ninitial_step_size = 1e7",
            "`classifiers.initial_step_size` must be between minimum_step_size (0.01) and 1e+06; "
            "got 10000000.0 [{path}:2].",
        ),
        (
            "[scenario.robot]\nwheel_noise = nan",
            "`scenario.robot.wheel_noise` must be a finite number of at least 0 and below 1; got nan [{path}:2].",
        ),
        (
            '[scenario]\nworld = "papr"',
            "`scenario.world` must be a known world; got 'papr' [{path}:2]. Did you mean `paper`?",
        ),
        (
            "[scenario.robot]\nactuation_lag_cycles = 1.5",
            "`scenario.robot.actuation_lag_cycles` must be an integer; got 1.5 [{path}:2].",
        ),
        (
            "[scenario.tracker]\ndelay_s = -0.1",
            "`scenario.tracker.delay_s` must be a finite number of at least 0; got -0.1 [{path}:2].",
        ),
        (
            "[scenario]\nagents = 0",
            "`scenario.agents` must be an integer of at least 1; got 0 [{path}:2].",
        ),
        (
            "[scenario.trial]\nduration_s = inf",
            "`scenario.trial.duration_s` must be a finite number above 0; got inf [{path}:2].",
        ),
        (
            "[scenario]\ncontroller = [1.0, inf, 1, 1]",
            "`scenario.controller` must be finite wheel speeds; got (1.0, inf, 1.0, 1.0) [{path}:2].",
        ),
        (
            'scenario = "agregation"',
            "`scenario` must be a known scenario; got 'agregation' [{path}:1]. Did you mean `aggregation`?",
        ),
        (
            "scenario = 3",
            '`scenario` must be a name or a table; got 3 [{path}:1]. Write scenario = "aggregation", for example.',
        ),
        (
            '[scenario]\nname = "mine"',
            "`scenario.title` must be given, as 'mine' is no known scenario; got nothing [{path}:1]. Set it, or begin with a known "
            "scenario by scenario.preset. Choose from: aggregation, aggregation-field-of-view-0, aggregation-field-of-view-60, "
            "infrared-sensors, light-response, light-response-stochastic, object-clustering, rangefinder-response, "
            "sensor-configuration.",
        ),
        (
            '[scenario]\nname = "agregation"',
            "`scenario.title` must be given, as 'agregation' is no known scenario; got nothing [{path}:1]. Set it, or begin with a "
            "known scenario by scenario.preset. Did you mean `aggregation`?",
        ),
        (
            '[scenario]\npreset = "aggregation"\nname = "object-clustering"',
            "`scenario.name` must be that of the preset, 'aggregation', or one of your own; got 'object-clustering' [{path}:3]. "
            "Leave one of them out.",
        ),
        (
            "models = 3",
            "`models` must be a table; got 3 [{path}:1]. Write [models] and its settings below it.",
        ),
        (
            "[models]\ninitial_low = -1e7",
            "`models.initial_low` must be greater than or equal to -1000000; got -10000000.0 [{path}:2].",
        ),
        (
            "[classifiers]\ninput_scale = [1.0]",
            '`classifiers.input_scale` must be "robot" or 2 positive numbers, one for each signal; '
            "got [1.0] [{path}:2].",
        ),
        (
            "[classifiers]\ninput_scale = [1.0, nan]",
            '`classifiers.input_scale` must be "robot" or a list of positive numbers; got [1.0, nan] [{path}:2].',
        ),
        (
            "[run]\nseed = 3\n[other\n",
            "`config` must be valid TOML; got '[other' [{path}:3]. "
            "The reader says: Expected ']' at the end of a table declaration.",
        ),
    ],
)
def test_what_is_wrong_in_a_file_is_said_in_one_message(text, message, written):
    path = written(text)
    asked = (
        None
        if text.startswith(("scenario =", "[scenario]\nname =", "[scenario]\npreset ="))
        else "aggregation"
    )
    assert refused(path, scenario=asked) == message.format(path=path)


def test_a_file_that_is_missing_is_refused(tmp_path):
    assert refused(tmp_path / "no.toml") == (
        f"`config` must be a readable TOML file; got {tmp_path / 'no.toml'} (No such file or directory)."
    )


def test_a_file_that_is_not_text_is_refused(tmp_path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    assert "(it is not UTF-8 text)" in refused(path)


def test_an_unknown_preset_names_the_nearest():
    assert (
        refused(preset="papr")
        == "`preset` must be a known preset; got 'papr'. Did you mean `paper`?"
    )


def test_two_scenarios_that_disagree_are_refused(written):
    path = written('scenario = "aggregation"')
    assert refused(path, scenario="object-clustering") == (
        "`scenario` must be the same everywhere; got 'object-clustering' as an argument and 'aggregation' "
        f"[{path}:1]. Leave one of them out."
    )


def test_a_refused_option_is_named_as_the_user_gave_it():
    message = refused(overrides={"run.generations": 0}, labels={"run.generations": "--generations"})
    assert message == "`run.generations` must be greater than or equal to 1; got 0 [--generations]."


def test_a_table_and_a_value_under_one_name_are_refused():
    assert refused(overrides={"run": 1, "run.seed": 2}) == (
        "`run.seed` must be a setting of its own; got 'run' both as a table and as a value. Leave one out."
    )


@pytest.mark.parametrize(
    ("text", "overrides"),
    [
        ("run = 3", {"run.seed": 1}),
        ("[[run]]\nseed = 2", {"run.seed": 1}),
        ("[scenario]\nrobot = 3", {"scenario.robot.radius_cm": 3.0}),
    ],
)
def test_a_value_in_the_place_of_a_table_is_refused_and_not_hidden_by_a_setting(
    text, overrides, written
):
    path = written(text)
    assert re.search(
        rf" must be a table; got .* \[{path}:[12]\]\. Write \[", refused(path, overrides=overrides)
    )


def test_numbers_of_numpy_are_numbers():
    configuration = load_configuration(
        overrides={"run.seed": np.int64(5), "models.initial_low": np.float64(-0.5)}
    )
    assert (configuration.run.seed, configuration.models.initial_low) == (5, -0.5)


def test_the_authors_start_from_zero_with_a_floor_under_the_step_sizes():
    paper, authors = (load_configuration(preset=name) for name in ("paper", "authors"))
    for section in ("models", "classifiers"):
        changed = getattr(paper, section).model_copy(
            update={"minimum_step_size": 0.01, "start": "middle"}
        )
        assert getattr(authors, section) == changed
    assert authors.coevolution == paper.coevolution


def test_a_preset_that_is_no_text_is_refused():
    assert (
        refused(preset=None)
        == "`preset` must be a known preset; got None. Choose from: authors, default, paper."
    )


def test_a_scenario_of_another_name_is_refused_with_its_place():
    assert refused(scenario="aggregation", overrides={"scenario.name": "mine"}) == (
        "`scenario` must be the same everywhere; got 'aggregation' as an argument and 'mine' [override scenario.name]. "
        "Leave one of them out."
    )


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        (
            "scenario.robot.maximum_speed_cm_s",
            1e300,
            "must be 0 or of a size between 1e-09 and 1e+09; got 1e+300",
        ),
        (
            "scenario.robot.mass_g",
            1e-300,
            "must be 0 or of a size between 1e-09 and 1e+09; got 1e-300",
        ),
        (
            "scenario.robot.wheel_distance_cm",
            1e-9,
            "must make the largest speeds between 1e-13 and 1e+09; got 2.56e+10",
        ),
        ("classifiers.input_scale", [1.0, 1e300], "must be between 1e-13 and 1e+09; got 1e+300"),
        (
            "classifiers.hidden",
            254,
            "must be at most 253, as a network has at most 255 inputs and hidden neurons; got 254",
        ),
        (
            "models.parents",
            10**9,
            "must be smaller, as keeping the history between two checkpoints needs 2.98e+03 GiB",
        ),
        (
            "scenario.agents",
            100_000,
            "must be smaller, as searching the bodies of a trial for near pairs needs 149 GiB",
        ),
        (
            "scenario.trial.duration_s",
            1e9,
            "must be smaller, as a generation's motion needs 6.56e+05 GiB, and 64 are",
        ),
        ("models.hidden", 256, "must be less than or equal to 255; got 256"),
        ("models.hidden", -1, "must be greater than or equal to 0; got -1"),
        ("scenario.grouping", "apart", "must be 'mixed' or 'separated'; got 'apart'"),
        (
            "scenario.trial.physics_steps",
            10**9,
            "must be smaller, as a generation has 1.1e+14 physics steps of a robot",
        ),
    ],
)
def test_what_no_machine_can_do_is_refused_before_anything_runs(key, value, message):
    roomy = {"scenario.trial.start_side_cm": 1e5}  # so that it is not the room that is wanting
    said = refused(overrides=roomy | {key: value})
    assert said.startswith(f"`{key}` {message}")
    assert f" [override {key}]" in said


def test_bodies_that_have_no_room_are_refused():
    said = refused(overrides={"scenario.arena": {"width_cm": 10.0, "height_cm": 10.0}})
    assert said == (
        "`scenario.arena` must have room for the bodies that start in it; got 10 x 10 cm, where at most 2 of 11 bodies of radius "
        "3.5 cm have room [override scenario.arena]. Enlarge it, or take fewer or smaller bodies (scenario.agents, "
        "scenario.robot.radius_cm)."
    )


def test_models_are_reactive_unless_they_have_hidden_neurons():
    assert load_configuration().parameter_names == AGGREGATION.parameter_names
    networks = load_configuration(scenario="object-clustering", overrides={"models.hidden": 5})
    assert networks.representation == ElmanModel(states=3, hidden=5)
    assert len(networks.parameter_names) == 47


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_networks_begin_with_smaller_steps_unless_they_are_given(preset):
    def step_size(**overrides):
        return load_configuration(preset=preset, overrides=overrides).models.initial_step_size

    assert step_size() == 1.0
    assert step_size(**{"models.hidden": 3}) == 0.3
    assert step_size(**{"models.hidden": 3, "models.initial_step_size": 1.0}) == 1.0


def test_a_run_that_has_begun_with_other_steps_keeps_them():
    begun = load_configuration(overrides={"models.hidden": 3, "models.initial_step_size": 1.0})
    assert type(begun).model_validate(begun.model_dump()).models.initial_step_size == 1.0


def test_models_are_what_the_scenario_says_where_they_are_no_networks():
    assert load_configuration(
        scenario="aggregation-field-of-view-0"
    ).representation == MorphologyModel(states=2)


def test_networks_that_are_to_infer_a_field_of_view_are_refused():
    said = refused(scenario="aggregation-field-of-view-60", overrides={"models.hidden": 3})
    assert '`models.hidden` must be 0 unless scenario.representation is "reactive"' in said
    assert "got 3 with 'morphology'" in said


def test_separated_groups_count_twice_against_the_limits():
    mixed = {
        "models.population": 40_000,
        "classifiers.population": 10_000,
        "run.checkpoint_every": 1,
    }
    load_configuration(overrides=mixed)
    said = refused(overrides=mixed | {"scenario.grouping": "separated"})
    assert "as judging a generation needs 65.6 GiB" in said


def test_a_judgment_of_too_many_samples_is_refused():
    said = refused(
        overrides={
            "models.population": 200_000,
            "classifiers.population": 200_000,
            "run.checkpoint_every": 1,
        }
    )
    assert "must be smaller, as judging a generation needs" in said


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "key",
    [
        "models.initial_low",
        "models.initial_step_size",
        "models.minimum_step_size",
        "scenario.robot.radius_cm",
        "scenario.robot.wheel_noise",
        "scenario.objects.friction",
        "scenario.trial.control_interval_s",
        "run.generations",
    ],
)
def test_nothing_that_is_not_finite_is_accepted_anywhere(key, value):
    assert refused(overrides={key: value}).startswith(f"`{key}` must be ")


def test_advice_lists_all_choices_where_none_is_near():
    assert nearest("zzz", ["b", "a"]) == "Choose from: a, b."


def test_a_configuration_cannot_be_changed():
    configuration = load_configuration()
    with pytest.raises(ValueError, match="frozen"):
        configuration.run.seed = 3


@pytest.mark.parametrize(
    ("settings", "trials"),
    [
        ({}, 3000),
        ({"run.seed": 4, "scenario.agents": 5, "run.tolerance": 0.1}, 3000),
        ({"run.trials": 500}, 500),
        ({"run.generations": 20}, 0),
        ({"run.checkpoint_every": 5}, 0),
        ({"models.parents": 20}, 0),
        ({"classifiers.hidden": 3}, 0),
        ({"coevolution.archive": 10}, 0),
    ],
)
def test_a_run_of_which_nothing_is_said_has_a_budget_in_trials(settings, trials):
    assert load_configuration(scenario="aggregation", overrides=settings).run.trials == trials


def test_the_paper_and_stimulated_systems_have_generations():
    assert load_configuration(scenario="aggregation", preset="paper").run.trials == 0
    assert load_configuration(scenario="light-response").run.trials == 0


def test_generations_come_before_the_budget_of_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('scenario = "aggregation"\n[run]\ntrials = 500\n')
    assert load_configuration(path).run.trials == 500
    run = load_configuration(path, overrides={"run.generations": 30}).run
    assert (run.trials, run.generations) == (0, 30)
