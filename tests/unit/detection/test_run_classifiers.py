from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import (
    Detector,
    _run,
    detect,
    plant_abnormal,
    random_controllers,
    run_classifiers,
    simulate_behaviors,
)
from turing_learning.runs import infer, load_run, resume
from turing_learning.store import DamagedError


def test_the_classifiers_of_the_last_generation_are_those_of_the_history(run):
    np.testing.assert_array_equal(
        run_classifiers(run).last, run.history["classifier"].to_numpy()[-1]
    )


@pytest.mark.parametrize(("most", "chosen"), [(100, range(7)), (3, [0, 3, 6])])
def test_the_best_classifiers_of_all_generations_or_of_a_part_spread_evenly_are_kept(
    run, monkeypatch, most, chosen
):
    monkeypatch.setattr(_run, "ARCHIVED_GENERATIONS", most)
    populations, fitness = (
        run.history[name].to_numpy()[chosen] for name in ("classifier", "classifier_fitness")
    )
    expected = populations[np.arange(len(chosen)), fitness.argmax(axis=1)]
    np.testing.assert_array_equal(run_classifiers(run).best, expected)


def test_jurors_are_among_the_fittest_of_the_whole_run(run):
    populations = run.history["classifier"].to_numpy()
    jurors = run_classifiers(run).jurors
    assert jurors.shape == (
        7,
        populations.shape[2],
    )  # one of each generation, as there are fewer than 300
    for juror, population in zip(jurors, populations, strict=True):
        assert (population == juror).all(axis=1).any()
    np.testing.assert_array_equal(jurors, run_classifiers(run).jurors)


def test_all_who_judged_at_the_end_of_a_run_of_trials_are_its_jurors(run_of_trials):
    learned = run_classifiers(run_of_trials)
    (_, evolved), (random, drawn) = run_of_trials.jury
    assert learned.complete
    assert len(drawn) == 200
    np.testing.assert_array_equal(learned.jurors, evolved)
    np.testing.assert_array_equal(learned.best[-1], learned.last[-1])
    windows = np.random.default_rng(0).normal(5, 3, (3, learned.steps, 2))
    outputs = learned.outputs(windows)
    assert outputs.shape == (3, len(evolved) + 200)
    np.testing.assert_allclose(
        outputs[:, len(evolved) :], random.judge(drawn, windows).T, atol=1e-6
    )
    found = detect(
        learned, plant_abnormal(learned.scenario, 1, samples=3, seed=1, threads=1), threads=1
    )
    assert len(found.individuals) == 3


def test_a_run_of_trials_with_a_thin_history_is_refused(thin_run_of_trials):
    assert thin_run_of_trials.jury == ()
    with pytest.raises(ConfigurationError, match=r"^`run` must have a full history"):
        run_classifiers(thin_run_of_trials)


def test_the_network_is_that_of_the_run(run):
    parts = run_classifiers(run)
    assert parts.classifier.scale == pytest.approx(parts.scenario.input_scale)
    assert parts.classifier.parameters == parts.last.shape[1]
    assert parts.scenario.agents == 2


@pytest.mark.parametrize(
    ("rule", "count"), [("fittest", 1), ("unanimous", 8), ("discriminant", 15)]
)
def test_each_rule_chooses_among_its_classifiers(run, rule, count):
    assert len(run_classifiers(run).voters(rule)) == count


def test_a_detector_of_a_run_is_the_same_every_time(run):
    one, two = (Detector.from_run(run, behaviors=6, trials=3, seed=2, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.weights, two.weights)
    np.testing.assert_array_equal(one.genuine_scores, two.genuine_scores)
    assert (one.steps, one.signals) == (10, 2)


def test_a_detector_can_be_calibrated_with_motion_of_ones_own(run):
    rng, scenario = np.random.default_rng(0), run_classifiers(run).scenario
    own = simulate_behaviors(scenario, random_controllers(scenario, 5, rng), trials=4, rng=rng)
    found = Detector.from_run(run, genuine=own.genuine, abnormal=own.abnormal)
    assert found.genuine_scores.shape == (5 * 4,)  # of half of two agents in each of five swarms
    assert found.abnormal_scores.shape == (5 * 4,)
    found = Detector.from_run(run, genuine=own.genuine, behaviors=3, trials=2)
    assert found.abnormal_scores.shape == (3 * 2,)


def test_a_run_with_a_thin_history_is_refused(thin_run):
    message = r'^`run` must have a full history; got .* with run.history = "thin", .* --set run.history=full'
    with pytest.raises(ConfigurationError, match=message):
        run_classifiers(thin_run)


def test_a_run_in_memory_is_refused(run):
    with pytest.raises(
        ConfigurationError,
        match=r"^`run` must be stored in a folder; got one that is kept in memory",
    ):
        Detector.from_run(replace(run, path=None))


def test_an_unknown_rule_is_refused_first(run):
    with pytest.raises(
        ConfigurationError,
        match=r"^`rule` must be one of the rules; got 'best'. Choose from: discriminant",
    ):
        Detector.from_run(replace(run, path=None), rule="best")


def walks(parameters, rng):
    """Walk with a speed of about the first parameter; twelve steps."""
    return (parameters[:, :1] + rng.normal(size=(len(parameters), 12)))[..., None]


@pytest.fixture(scope="module")
def own_run(tmp_path_factory):
    """A small run on a custom system, whose speed is about 30."""
    folder = tmp_path_factory.mktemp("own") / "run"
    genuine = walks(np.full((20, 1), 30.0), np.random.default_rng(0))
    small = {"models.population": 8, "classifiers.population": 20}
    infer(
        genuine=genuine, simulate=walks, parameters={"speed": (20, 40)}, generations=3, seed=1, settings=small,
        threads=1, out=folder,
    )  # fmt: skip
    return load_run(folder)


def test_the_classifiers_of_a_run_on_an_own_system_see_samples_as_in_the_run(own_run):
    parts = run_classifiers(own_run)
    assert (parts.steps, parts.signals, parts.scenario) == (12, 1, None)
    center = parts.classifier.system.center[0]
    assert center == pytest.approx(30, abs=1)
    samples = np.full((1, 12, 1), center)
    blank = parts.classifier.classifier.judge(parts.last, np.zeros((1, 12, 1)))
    np.testing.assert_array_equal(parts.classifier.judge(parts.last, samples), blank)


def test_a_detector_of_a_run_on_an_own_system_takes_its_motion(own_run):
    rng = np.random.default_rng(1)
    genuine, abnormal = (
        walks(np.full((24, 1), speed), rng).reshape(8, 3, 12, 1) for speed in (30.0, 60.0)
    )
    found = Detector.from_run(own_run, genuine=genuine, abnormal=abnormal)
    assert (found.steps, found.signals) == (12, 1)
    assert Detector.from_run(
        own_run
    ).genuine_scores.size  # the run has kept motion to calibrate with
    (own_run.path / "calibration.npz").write_bytes(b"PK")
    with pytest.raises(DamagedError, match=r"must hold calibration.npz as it was written"):
        Detector.from_run(own_run, genuine=genuine)
    (own_run.path / "calibration.npz").unlink()
    with pytest.raises(
        ConfigurationError,
        match=r"^`genuine` must be given for a run on a custom system; got one without. Give motion",
    ):
        Detector.from_run(own_run, genuine=genuine)


def test_an_own_run_that_was_stopped_has_to_be_finished_before_it_calibrates(tmp_path):
    given = {"genuine": walks(np.full((30, 1), 30.0), np.random.default_rng(1)), "simulate": walks}
    small = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}
    more = {
        "parameters": {"speed": (0, 80)},
        "generations": 4,
        "settings": small,
        "out": tmp_path / "run",
    }
    stopped = infer(**given, **more, should_stop=lambda: True)
    with pytest.raises(
        ConfigurationError,
        match=r"^`run` must have stored motion .*before its end\. Resume it first, or give `gen",
    ):
        Detector.from_run(stopped)
    assert run_classifiers(resume(stopped.path, **given)).complete


def test_without_a_scenario_nobody_can_be_simulated(run):
    parts = replace(run_classifiers(run), scenario=None)
    with pytest.raises(
        ConfigurationError,
        match=r"^`run` must be on simulated robots for individuals to be simulated",
    ):
        parts.simulated_scenario()
