"""Runs whose classifiers choose stimuli, or watch: folders, resume, report, check, pool, study, the command line, and bad input."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text
from stimulated import PARAMETERS, STIMULATED, TRUTH, eye, living_eye

import turing_learning as tl
from turing_learning.config import ConfigurationError, load_configuration, to_toml
from turing_learning.errors import RefusedError
from turing_learning.figures.one_run import dialogues_figure
from turing_learning.identifiability import Effort
from turing_learning.interaction import STIMULATED as BUILT_IN
from turing_learning.interaction import describe_stimulated
from turing_learning.interaction._system import StimulatedSource
from turing_learning.runs import TIMINGS, RunFolderError
from turing_learning.systems import CustomSystemError

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "run.checkpoint_every": 3,
    "scenario.opponents": 3,
}
THIN = SMALL | {"run.history": "thin"}
STIMULUS = "scenario.stimulus.passive"


def custom(generations=6, genuine=TRUTH, simulate=eye, settings=THIN, seed=3, **options):
    return tl.infer(
        genuine=genuine, simulate=simulate, parameters=PARAMETERS, generations=generations, seed=seed, settings=settings,
        **(STIMULATED | {"name": "eye"} | options),
    )  # fmt: skip


def untimed(path):
    """Return the result of a folder, or one in memory, without its durations."""
    data = (
        path.to_json()
        if isinstance(path, tl.Result)
        else json.loads((path / "result.json").read_text())
    )
    return {name: one for name, one in data.items() if name not in TIMINGS}


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_configuration_of_a_built_in_system_is_read_back_as_it_is_written(name, tmp_path):
    configuration = load_configuration(scenario=name)
    (tmp_path / "mine.toml").write_text(to_toml(configuration))
    assert load_configuration(tmp_path / "mine.toml") == configuration
    assert configuration.scenario == BUILT_IN[name]
    assert (configuration.classifiers.initial_high, configuration.coevolution.archive) == (3.0, 20)


@pytest.mark.parametrize("name", ["light-response-stochastic", "sensor-configuration"])
def test_a_run_that_was_stopped_and_resumed_is_the_run_that_never_was(name, tmp_path):
    whole = tl.infer(name, generations=6, seed=2, settings=SMALL)
    tl.infer(
        name,
        generations=6,
        seed=2,
        settings=SMALL,
        out=tmp_path / "cut",
        should_stop=iter([0, 0, 0, 1]).__next__,
    )
    resumed = tl.resume(tmp_path / "cut")
    assert resumed.complete
    assert untimed(tmp_path / "cut") == untimed(whole)
    np.testing.assert_array_equal(resumed.history["classifier"], whole.history["classifier"])
    assert "Stimulus and answer" in (tmp_path / "cut" / "report.html").read_text()
    held = dict(np.load(tmp_path / "cut" / "dialogues.npz"))
    rows, width, own = {"light": (5, 1, 1), "senso": (6, 2, 3)}[name[:5]]
    assert held["stimuli"].shape == (rows, 2, 100, width)
    assert held["answers"].shape == (rows, 2, 100, own)
    low, high = held["ranges"].T
    assert (held["stimuli"] >= low).all()
    assert (held["stimuli"] <= high).all()


def test_interrogators_learn_to_draw_out_what_only_a_stimulus_reveals():
    settings = {"models.population": 40, "classifiers.population": 40, "run.history": "thin"}
    found = tl.infer("light-response", generations=120, seed=11, settings=settings)
    # the speed of state 1 and the time that leads there are seen in darkness alone
    assert abs(found.estimate["speed0"] - 2) < 0.6
    assert abs(found.estimate["speed1"] - 6) < 1.5
    assert abs(found.estimate["readiness"] - 0.3) < 0.12


def test_a_custom_system_has_folder_report_resume_check_and_pool(tmp_path):
    whole = custom(out=tmp_path / "whole", settings=SMALL)
    assert whole.truth == TRUTH
    assert "Stimulus and answer" in (tmp_path / "whole" / "report.html").read_text()
    custom(out=tmp_path / "cut", settings=SMALL, should_stop=iter([0, 1]).__next__)
    tl.resume(tmp_path / "cut")  # the function is found by its name
    assert untimed(tmp_path / "cut") == untimed(tmp_path / "whole")
    effort = Effort(samples=20, points=0)
    check = tl.load_run(tmp_path / "whole").check(
        effort=effort, recoveries=1, recovery_generations=3
    )
    assert set(check.recoveries[0].estimate) == set(TRUTH)
    assert set(tl.pool([whole, custom(seed=4, settings=SMALL)]).estimate) == set(TRUTH)


def test_a_system_may_be_a_function_without_parameters(tmp_path):
    found = custom(genuine=living_eye, out=tmp_path / "run", should_stop=iter([0, 1]).__next__)
    assert found.truth is None
    assert tl.resume(tmp_path / "run").complete


def test_one_of_several_levels_is_chosen_and_the_picture_says_how_often_the_classifier_was_right():
    dialogues = custom(levels=3, settings=SMALL).record.dialogues
    assert set(np.unique(dialogues["stimuli"])) <= {0.0, 0.5, 1.0}
    figure = dialogues_figure(
        dialogues, names=("speed", "light"), rows=("rate", "gain"), interval_s=0.1
    )
    assert "right; output" in " ".join(text.get_text() for text in figure.findobj(Text))


def test_studies_run_systems_with_stimuli(tmp_path):
    study = tl.study(
        "light-response", runs=2, generations=2, settings=THIN, out=tmp_path / "one", workers=1
    )
    assert study.complete
    own = tl.study(
        genuine=TRUTH, simulate=eye, parameters=PARAMETERS, runs=2, generations=2, settings=THIN, out=tmp_path / "two",
        workers=1, **STIMULATED,
    )  # fmt: skip
    assert own.complete


def test_classifiers_that_watch_see_stimuli_that_nobody_chooses(tmp_path):
    found = tl.infer(
        "light-response",
        generations=2,
        seed=1,
        settings=SMALL | {STIMULUS: "constant"},
        out=tmp_path / "run",
    )
    samples = found.configuration.system.open(tl.systems.Arguments()).genuine_samples(
        5, np.random.default_rng(1)
    )
    np.testing.assert_array_equal(np.ptp(samples[..., 1], axis=1), 0)
    assert "Classifiers only watched" in (tmp_path / "run" / "report.html").read_text()


def test_a_run_of_few_trials_can_watch_and_not_choose():
    found = tl.infer(
        "light-response",
        trials=40,
        seed=1,
        settings={STIMULUS: "random", "classifiers.population": 8},
    )
    assert found.trials == 40
    with pytest.raises(
        ConfigurationError, match=r"`run\.trials` must be 0 where classifiers choose stimuli"
    ):
        tl.infer("light-response", trials=40)


# Bad input


def wrong(**changes):
    def changed(state, parameters, stimulus, rng):
        state, seen = eye(state, parameters, stimulus, rng)
        if changes.get("shape"):
            return state, seen[:, 0]
        if changes.get("raises"):
            raise KeyError("no such light")
        seen[np.abs(parameters[:, 1] - 2) > changes.get("finite_within", np.inf)] = np.nan
        return state, seen

    return changed


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (wrong(shape=True), r"`simulate` must return the next state, and observations \(n, D\) = \(200, 1\); got shape \(200,\)"),
        (wrong(raises=True), r"it raised KeyError: 'no such light' \[step 0"),
        (wrong(finite_within=-1.0), "`genuine` must return finite observations"),
        (wrong(finite_within=0.1), r"half of the 8 .* \[generation 0\], the first with rate = .*: an answer was not finite"),
    ],
)  # fmt: skip
def test_a_step_that_fails_ends_the_run(step, message):
    with pytest.raises(CustomSystemError, match=message):
        custom(simulate=step)


def test_no_classifier_accepts_a_model_that_fails():
    system = describe_stimulated(TRUTH, eye, PARAMETERS, STIMULATED)
    source = StimulatedSource(system, wrong(finite_within=2.1))
    network = tl.config.load_configuration(scenario=system)
    source.interrogation(tl.config.classifier_of(network))
    models = np.array([[0.0, 0.0], [0.0, 0.9], [0.0, -0.5]])  # the second has a gain of 4.75
    genomes = np.random.default_rng(1).normal(size=(4, tl.config.classifier_of(network).parameters))
    met = np.tile(np.arange(3), (4, 1))
    _, outputs = source.confront(models, genomes, met, 2, np.random.default_rng(2))
    np.testing.assert_array_equal(outputs[:, 1], 0)
    assert (outputs[:, [0, 2]] > 0).all()
    assert source.failures.count == 1
    watching = StimulatedSource(
        replace(system, stimulus=replace(system.stimulus, passive="random")),
        wrong(finite_within=2.1),
    )
    assert np.isfinite(watching.collect(models, np.random.default_rng(3)).counterfeit).all()
    np.testing.assert_array_equal(watching.failed, [False, True, False])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stimulus": {"light": (1, 0)}}, "`stimulus` must have a low end below the high one"),
        ({"stimulus": {"light": (0, np.nan)}}, "`stimulus` must be finite"),
        ({"stimulus": {}}, "`stimulus` must name one stimulus or more"),
        ({"passive": "now and then"}, "`passive` must be one of random, constant, own, recorded"),
        (
            {"passive": np.full((2, 30, 1), 1.5)},
            r"`recorded` must be from 0 to 1; got 1.5 \[series 0, step 0, light\]",
        ),
        ({"passive": np.zeros((2, 7, 1))}, "`recorded` must be series of 30 steps"),
        ({"opponents": 0}, "`opponents` must be an integer of at least 1; got 0"),
        ({"workers": 2}, "`workers` must be left out for a system with stimuli"),
        ({"genuine": {"rate": 0.1}}, "`genuine` must name the parameters rate, gain"),
        ({"genuine": np.zeros((5, 30, 1))}, "`genuine` must be a function"),
        ({"simulate": 3}, "`simulate` must be a function"),
        ({"steps": 0}, "`steps` must be an integer of at least 1; got 0"),
    ],
)
def test_what_does_not_fit_is_refused(options, message):
    with pytest.raises(RefusedError, match=message):
        custom(**options)


def test_another_classifier_cannot_choose_stimuli():
    with pytest.raises(
        RefusedError, match="`classifier` must be an Elman network where classifiers choose stimuli"
    ):
        tl.infer(
            "light-response",
            generations=1,
            settings=THIN,
            classifier="turing_learning.few_trials:PooledClassifier",
        )


def test_a_run_is_resumed_with_what_it_began_with(tmp_path):
    custom(out=tmp_path / "run", should_stop=iter([0, 1]).__next__)
    with pytest.raises(
        RunFolderError, match=r"`genuine` must be what the run began with, rate = 0\.1, gain = 2"
    ):
        tl.resume(tmp_path / "run", genuine=TRUTH | {"gain": 3.0})
    assert tl.resume(tmp_path / "run", genuine=TRUTH, simulate=eye).complete


# The command line

OPTIONS = [part for key, value in THIN.items() for part in ("--set", f"{key}={value}")]


def test_the_command_line_infers_watches_shows_and_resumes(call, tmp_path):
    assert call("infer", "light-response", "--generations", 2, "--out", "one", *OPTIONS)[0] == 0
    assert "speed3" in call("show", "one")[1]
    assert call("resume", "one")[0] == 0
    rows = "\n".join(f"{k},{t % 10 / 10}" for k in (1, 2) for t in range(100))
    (tmp_path / "lights.csv").write_text(f"trial,light\n{rows}\n")
    for passive in ("random", "constant", "lights.csv"):
        code, _, err = call(
            "infer",
            "light-response",
            "--passive",
            passive,
            "--generations",
            2,
            "--out",
            passive[:5],
            *OPTIONS,
        )
        assert code == 0, err
    assert load_configuration(tmp_path / "light" / "config.toml").scenario.stimulus.recorded[1][
        3
    ] == (0.3,)
    assert "stimuli left_wheel, right_wheel" in call("scenarios")[1]


@pytest.mark.parametrize(
    ("arguments", "text", "message"),
    [
        (("aggregation", "--passive", "random"), "", "`--passive` must be given for a system with stimuli; got 'aggregation'"),
        (("light-response", "--passive", "none.csv"), "", "must be one of random, constant, own, or a file; got none.csv"),
        (("light-response", "--passive", "some.csv"), "dark\n1\n", "must have the columns light"),
        (("light-response", "--passive", "some.csv"), "light\n1\n0\n", "must hold series of 100 steps"),
        (("light-response", "--passive", "some.csv"), "light\n" + "2\n" * 100, "must be from 0 to 1; got 2.0 [series 0, step 0"),
        (("light-response", "--passive", "some.csv"), "light\n" + "x\n" * 100, "could not convert string"),
    ],
)  # fmt: skip
def test_the_command_line_refuses_in_one_line(arguments, text, message, call, tmp_path):
    (tmp_path / "some.csv").write_text(text)
    code, out, err = call("infer", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
