"""A laboratory with a budget in trials: what is stored, kills, more trials, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from program_laboratory import CALIBRATION, FILE, ScriptedLaboratory

from turing_learning.config import ConfigurationError
from turing_learning.robots import LaboratoryError, LaboratorySource, load_laboratory
from turing_learning.robots.emulation import SimulatedLaboratory
from turing_learning.runs import (
    RunFolderError,
    awaits_robots,
    load_run,
    read_post_evaluation,
    read_trials,
    resume_laboratory,
    simulate_laboratory,
    start_laboratory,
)

TRIALS = 20
SHORT = FILE.replace("duration_s = 1.0", "duration_s = 0.5")
PLAIN = "\n".join(
    line for line in SHORT.splitlines() if "generations" not in line and "population" not in line
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    CALIBRATION.save(folder / "camera.json")
    (folder / "lab.toml").write_text(SHORT.replace("repeats = 0", "repeats = 2"))
    return folder


def laboratory(folder, **run):
    return load_laboratory(
        folder / "lab.toml",
        {f"run.{name}": value for name, value in ({"trials": TRIALS} | run).items()},
    )


def begin(folder, out, on_event=lambda event: None, **options):
    return start_laboratory(
        laboratory(folder),
        out,
        equipment=ScriptedLaboratory().equipment(),
        on_event=on_event,
        **options,
    )


def again(out, **options):
    return resume_laboratory(out, equipment=ScriptedLaboratory().equipment(), **options)


@pytest.fixture(scope="module")
def finished(folder):
    begin(folder, folder / "finished")
    return folder / "finished"


def require_same(path, expected):
    for name in ("estimate", "interval", "best_model", "verdicts", "trials"):
        found, wanted = (getattr(load_run(each), name) for each in (path, expected))
        np.testing.assert_equal(found, wanted, err_msg=name)
    for piece in (expected / "buffer").iterdir():
        with np.load(piece) as wanted, np.load(path / "buffer" / piece.name) as found:
            for name in wanted.files:
                np.testing.assert_array_equal(
                    found[name], wanted[name], err_msg=f"{piece.name} {name}"
                )


class Counting:
    """Counts executed trials; raises at the last one, as a kill would."""

    def __init__(self, last=None, error=KeyboardInterrupt):
        self.executed, self.last, self.error = [], last, error

    def __call__(self, event):
        if event.trial is not None:
            self.executed.append((event.stage, event.trial.number))
            if len(self.executed) == self.last:
                raise self.error


def test_a_trial_is_one_execution_whatever_the_number_of_replicas(finished):
    result = load_run(finished)
    assert (result.trials, result.complete) == (TRIALS, True)
    stored = sorted(
        str(path.relative_to(finished / "trials"))
        for path in (finished / "trials").rglob("trial-*.npz")
    )
    assert len(stored) == TRIALS
    assert stored[0].startswith(
        "batch-0000/attempt-2/trial-0"
    )  # nobody had pressed the remote control before the first
    pieces = [np.load(path) for path in sorted((finished / "buffer").iterdir())]
    assert (
        sum(len(piece["parameters"]) for piece in pieces) == 2 * TRIALS
    )  # two replicas, each with its own model
    observed = read_trials(finished, "batch-0000")
    np.testing.assert_allclose(pieces[0]["parameters"], observed.models.reshape(-1, 4), atol=5e-5)
    np.testing.assert_array_equal(
        pieces[0]["genuine"], observed.samples().genuine.astype(np.float32)
    )
    assert all(-1 <= value <= 1 for value in result.estimate.values())
    assert "report.html" in {path.name for path in finished.iterdir()}


def test_its_last_models_are_not_observed_again(finished):
    assert read_post_evaluation(finished) is None
    assert not awaits_robots(finished)
    assert again(finished).complete


@pytest.mark.parametrize(
    ("killed", "error"), [(4, KeyboardInterrupt), (13, KeyboardInterrupt), (13, LaboratoryError)]
)
def test_trials_that_were_executed_are_not_executed_again(folder, finished, killed, error):
    first, second, path = Counting(killed, error), Counting(), folder / f"{error.__name__}-{killed}"
    with pytest.raises(error):
        begin(folder, path, first)
    assert awaits_robots(path)
    assert again(path, on_event=second).complete
    both = first.executed + second.executed
    assert len(both) == len(set(both)) == TRIALS
    require_same(path, finished)


def test_stored_trials_count_as_long_as_they_are_of_the_models_that_are_wanted(folder):
    setup, swarm, speeds = (
        laboratory(folder).setup,
        laboratory(folder).configuration.swarm,
        np.full((6, 4), 0.5),
    )
    trials, events = [], Counting()
    with LaboratorySource(
        setup,
        swarm,
        ScriptedLaboratory().equipment(),
        watch=lambda event: trials.append(event.trial),
    ) as source:
        samples = source.observe(speeds, "batch-0003")
    first, second, third = (trial for trial in trials if trial is not None)
    known = [first, replace(second, models=-second.models), third]
    with LaboratorySource(
        setup,
        swarm,
        ScriptedLaboratory().equipment(),
        watch=events,
        stored=lambda stage: (1, known),
    ) as source:
        again = source.observe(speeds, "batch-0003")
    assert events.executed == [("batch-0003", 1), ("batch-0003", 2)]
    np.testing.assert_array_equal(again.counterfeit[:2], samples.counterfeit[:2])
    assert again.counterfeit.shape == samples.counterfeit.shape


def test_a_finished_run_gets_more_trials(folder, finished):
    path, settings = folder / "more", {"trials": TRIALS + 4, "extended": [[TRIALS, TRIALS]]}
    begin(folder, path)
    with pytest.raises(
        RunFolderError, match=r"`trials` must be more than the 20 that the run has spent; got 20"
    ):
        again(path, trials=TRIALS)
    counted = Counting()
    assert again(path, trials=TRIALS + 4, on_event=counted).trials == TRIALS + 4
    assert len(counted.executed) == 4
    start_laboratory(
        laboratory(folder, **settings),
        folder / "at-once",
        equipment=ScriptedLaboratory().equipment(),
    )
    require_same(path, folder / "at-once")


def test_a_laboratory_has_300_trials_unless_its_file_says_how_generations_are(folder):
    (folder / "plain.toml").write_text(PLAIN)
    assert load_laboratory(folder / "plain.toml").configuration.run.trials == 300
    assert load_laboratory(folder / "plain.toml", {"run.trials": 50}).configuration.run.trials == 50
    for setting in (
        {"run.generations": 3},
        {"models.parents": 10},
        {"models.redraw": 0.1},
        {"coevolution.archive": 5},
    ):
        assert load_laboratory(folder / "plain.toml", setting).configuration.run.trials == 0
    (folder / "paper.toml").write_text(f'preset = "paper"\n{PLAIN}')
    assert load_laboratory(folder / "paper.toml").configuration.run.trials == 0


def test_generations_of_the_command_come_before_the_trials_of_a_laboratory_s_file(folder):
    (folder / "few.toml").write_text(PLAIN.replace("[run]", "[run]\ntrials = 50"))
    assert load_laboratory(folder / "few.toml").configuration.run.trials == 50
    run = load_laboratory(folder / "few.toml", {"run.generations": 3}).configuration.run
    assert (run.trials, run.generations) == (0, 3)


def test_step_sizes_adapt_faster_in_a_laboratory_by_generations_that_says_nothing_else(folder):
    def rates(name, settings):
        configuration = load_laboratory(folder / name, settings).configuration
        return configuration.models.adaptation, configuration.classifiers.adaptation

    (folder / "plain.toml").write_text(PLAIN)
    (folder / "paper.toml").write_text(f'preset = "paper"\n{PLAIN}')
    assert rates("plain.toml", {}) == (0.5, 0.5)
    assert rates("plain.toml", {"run.trials": 50, "models.redraw": 0.1}) == (0.5, 0.5)
    assert rates("plain.toml", {"run.generations": 3}) == (1.0, 2.0)
    assert rates("plain.toml", {"models.adaptation": 0.7}) == (0.7, 2.0)
    both = {"run.generations": 3, "classifiers.adaptation": 0.5}
    assert rates("plain.toml", both) == (1.0, 0.5)
    assert rates("paper.toml", {}) == (0.5, 0.5)


def test_first_models_of_a_run_of_trials_have_all_wheel_speeds(folder):
    with pytest.raises(
        ConfigurationError, match=r"`models.initial_low` must be -1 and 1 with run.trials"
    ):
        load_laboratory(folder / "lab.toml", {"run.trials": 50, "models.initial_low": -0.5})


def test_batteries_are_replaced_after_ten_times_as_many_trials_as_generations(folder):
    setup = laboratory(folder).setup
    interventions = setup.interventions.model_copy(update={"batteries_every": 1})
    lab, spent = ScriptedLaboratory(), (0, 6, 9, 12, 18, 21)
    equipment = lab.equipment()
    source = LaboratorySource(
        setup.model_copy(update={"interventions": interventions}),
        laboratory(folder).configuration.swarm,
        equipment,
        spent=lambda batch: spent[max(batch, 0)],
    )
    asked = []
    source.observe = lambda models, stage: asked.append((stage, len(lab.asked)))
    for number in range(len(spent)):
        source.generation = number
        source.collect(np.zeros((2, 4)), np.random.default_rng(1))
    assert [count for _, count in asked] == [0, 0, 0, 1, 1, 2]
    assert lab.asked[0].startswith("Replace the batteries")


def test_the_search_of_a_run_of_trials_ends_at_the_largest_speeds(folder):
    scenario = laboratory(folder).configuration.swarm
    bounded, free = SimulatedLaboratory(scenario, of_trials=True), SimulatedLaboratory(scenario)
    assert (bounded.ends, free.ends, bounded.together) == ((-1, 1), None, 2)
    np.testing.assert_array_equal(bounded.to_units(np.array([[0.5, 1.0]])), [[0.5, 1.0]])
    np.testing.assert_array_equal(free.to_units(np.array([[0.5, 1.0]])), np.tanh([[0.5, 1.0]]))


def test_the_same_setup_in_plain_simulation(folder):
    found = simulate_laboratory(laboratory(folder).configuration)
    assert (found.result.trials, found.fitness.size) == (TRIALS, 0)
    assert found.best_model.tolist() == list(found.result.estimate.values())
