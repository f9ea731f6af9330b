import html
import json
import pickle
import re
from dataclasses import replace

import numpy as np
import own_models
import pytest
import xarray as xr
from own_models import RANGES, Breaking, recorded, stumbling, walk, walk_of_one

import turing_learning as tl
from turing_learning.config import ConfigurationError, load_configuration, to_toml
from turing_learning.config.settings import load_variants
from turing_learning.errors import RefusedError
from turing_learning.families import BurstAndCoast
from turing_learning.identifiability import Effort
from turing_learning.runs import TIMINGS, RunFolder, RunFolderError, RunStorageError, start
from turing_learning.systems import CustomSystem, CustomSystemError

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "run.threads": 1,
    "run.checkpoint_every": 3,
    "run.history": "thin",
}
FULL = {"run.history": "full"}  # with figures and a report, which take a second
FISH = {
    "name": "fish",
    "title": "Fish in a tank",
    "parameters": RANGES | {"speed": tl.Parameter(0, 20, unit="cm/s")},
}


def infer(genuine=None, simulate=walk, parameters=RANGES, generations=7, settings=None, **options):
    return tl.infer(
        genuine=recorded() if genuine is None else genuine,
        simulate=simulate,
        parameters=parameters,
        generations=generations,
        settings=SMALL | (settings or {}),
        **options,
    )


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "run"
    infer(out=path, settings=FULL, **FISH)
    return path


def test_a_disk_that_is_full_says_how_python_goes_on(tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    path = tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr("turing_learning.runs._folder.save_checkpoint", full)
        with pytest.raises(RunStorageError) as refused:
            infer(out=path)
    call = f"turing_learning.resume({str(path)!r}, genuine=...)"
    assert str(refused.value).endswith(
        f"(No space left on device). Make room, then resume with `{call}`."
    )
    with pytest.raises(RunFolderError) as taken:
        infer(out=path)
    assert f"which holds a run. Resume it with `{call}`, choose" in str(taken.value)
    with pytest.raises(RunFolderError) as unsaved:
        tl.load_run(path)
    assert str(unsaved.value).endswith(f"Begin it with `{call}`.")
    assert tl.resume(path, genuine=recorded()).complete


def test_the_result_names_the_parameters_in_their_units(whole):
    result = tl.load_run(whole)
    assert list(result.estimate) == list(result.best_model) == ["speed", "turn_noise"]
    assert 0 <= result.estimate["speed"] <= 20
    assert (result.scenario, result.truth, result.mae, result.absolute_error) == (
        "fish",
        None,
        None,
        None,
    )


def test_a_result_in_another_process_has_its_history_and_no_simulator(tmp_path):
    result = infer(out=tmp_path / "run", simulate=lambda parameters, rng: walk(parameters, rng))
    there = pickle.loads(pickle.dumps(result))  # noqa: S301 - our own
    assert there.history.equals(result.history)
    with pytest.raises(ConfigurationError, match="`genuine` must be given for a custom system"):
        there.check()


def test_the_run_folder_is_that_of_any_run_without_what_needs_a_truth(whole):
    names = {path.name for path in whole.iterdir()}
    assert {
        "config.toml",
        "manifest.json",
        "result.json",
        "history.zarr",
        "figures",
        "report.html",
    } <= names
    assert {path.stem for path in (whole / "figures").iterdir()} == {
        "parameters",
        "fitness",
        "step-sizes",
    }


def test_the_report_shows_units_and_no_replay(whole):
    page = (whole / "report.html").read_text(encoding="utf-8")
    assert "Fish in a tank: what Turing Learning inferred" in page
    assert "speed (cm/s)" in page
    assert '<section id="replay"' not in page


def test_the_report_says_how_python_checks_what_no_command_can_open(whole, tmp_path):
    call = f"turing_learning.load_run({str(whole)!r}).check(genuine=..., simulate=...)"
    page = (whole / "report.html").read_text(encoding="utf-8")
    assert html.escape(call) in page
    assert "turing-learning check" not in page
    named = tmp_path / "named"
    infer("own_models:herd", "own_models:walk", out=named, settings=FULL)
    assert f"turing-learning check {named}<" in (named / "report.html").read_text(encoding="utf-8")


def test_the_history_holds_models_in_the_users_units(whole):
    models = tl.load_run(whole).history["model"].to_numpy()
    assert (models[..., 0].max(), models[..., 1].max()) > (3, 1)
    assert ((models >= 0) & (models <= [20, 3])).all()


def test_the_stored_configuration_reads_back_and_holds_scales_and_held_out_samples(whole):
    configuration = RunFolder(whole).configuration()
    assert isinstance(configuration.scenario, CustomSystem)
    assert configuration.input_scale == configuration.scenario.input_scale
    assert len(configuration.scenario.held_out) == 8
    assert configuration.scenario.parameters["speed"].unit == "cm/s"


def test_a_configuration_with_open_sides_reads_back_equal(tmp_path):
    ranges = {
        "a": (None, None),
        "b": (0, None),
        "c": tl.Parameter(None, 5, scale="log", initial=(0.1, 3)),
    }
    simulate = lambda parameters, rng: walk(np.abs(parameters[:, :2]), rng)  # noqa: E731
    infer(out=tmp_path / "run", simulate=simulate, parameters=ranges, generations=1)
    configuration = RunFolder(tmp_path / "run").configuration()
    sides = {name: (one.low, one.high) for name, one in configuration.scenario.parameters.items()}
    assert sides == {"a": (None, None), "b": (0, None), "c": (None, 5)}
    assert to_toml(configuration) == (tmp_path / "run" / "config.toml").read_text()


def test_a_run_in_memory_infers_the_same_as_one_on_disk(whole):
    result = infer(name="fish", settings=FULL)
    assert (result.estimate, result.best_model) == (
        tl.load_run(whole).estimate,
        tl.load_run(whole).best_model,
    )
    assert result.failed_simulations == {"count": 0, "listed": []}


def test_the_default_preset_counts_for_own_systems_too(whole):
    configuration = RunFolder(whole).configuration()
    assert (configuration.coevolution.archive, configuration.classifiers.renewal) == (100, 100)


def test_a_result_without_truth_prints_small_parameters():
    result = infer(generations=1, parameters={"a": (1e-6, 2e-6), "b": (0, 1)})
    assert re.search(r"\b1\.\d+e-06\b", str(result))


def test_intervals_stay_within_the_bounds_on_any_scale():
    limits = {"a": tl.Parameter(1e-6, 1e-2, scale="log"), "b": tl.Parameter(0, None)}
    result = infer(generations=12, parameters=limits)  # so few that the interval is wide
    (low, high), (least, most) = result.wandering["a"], result.wandering["b"]
    assert 1e-6 <= low <= result.estimate["a"] <= high <= 1e-2
    assert 0 <= least <= result.estimate["b"] <= most


def test_bounds_may_be_an_array():
    ranges = {name: np.array(bounds) for name, bounds in RANGES.items()}
    assert infer(parameters=ranges, generations=1).estimate == infer(generations=1).estimate


def test_a_stopped_run_goes_on_bit_by_bit(whole, tmp_path, stop_after):
    path = tmp_path / "run"
    infer(out=path, should_stop=stop_after(4), settings=FULL, **FISH)
    tl.resume(path, genuine=recorded(), simulate=walk)
    assert untimed(path) == untimed(whole)
    histories = [xr.open_zarr(folder / "history.zarr").load() for folder in (path, whole)]
    xr.testing.assert_identical(*histories)


def test_failures_are_listed_and_survive_a_resumed_run(tmp_path, stop_after):
    for name, stop in (("whole", None), ("run", stop_after(4))):
        infer(out=tmp_path / name, simulate=stumbling, should_stop=stop, seed=2, settings=FULL)
    tl.resume(tmp_path / "run", genuine=recorded(), simulate=stumbling)
    failed = untimed(tmp_path / "whole")["failed_simulations"]
    assert failed["count"] == len(failed["listed"]) > 4
    assert {entry["generation"] for entry in failed["listed"]} >= {0, 1}
    assert all(entry["parameters"]["speed"] > 12 for entry in failed["listed"])
    assert failed["listed"][0]["reason"] == "it returned nan (or masked) [step 7, signal signal0]"
    assert untimed(tmp_path / "run") == untimed(tmp_path / "whole")
    assert f"{failed['count']} simulations failed" in (tmp_path / "run" / "report.html").read_text(
        encoding="utf-8"
    )


@pytest.mark.parametrize("length", [{"trials": 20}, {"generations": 1, "settings": SMALL}])
def test_a_failure_in_the_first_batch_ends_the_run_unless_it_is_a_number(length):
    def simulate(parameters, rng):
        if answer is None and (parameters[:, 0] > 12).any():
            raise ValueError("too fast")
        return np.where(parameters[:, :1, None] > 12, answer, walk(parameters, rng))

    options = {"genuine": recorded(), "simulate": simulate, "parameters": RANGES, "seed": 2}
    answer = None
    with pytest.raises(
        CustomSystemError,
        match=r"it raised ValueError: too fast \[.*\] \[generation 0, speed = 1\d",
    ):
        tl.infer(**options, **length)
    answer = np.inf
    assert tl.infer(**options, **length).failed_simulations["count"] > 0
    answer = np.nan
    assert tl.infer(**options, **length).failed_simulations["count"] > 0


@pytest.mark.parametrize(
    ("genuine", "options"),
    [
        (recorded()[:1], {}),
        (recorded()[:2], {"held_out": [1]}),
        (type("Windows", (), {"learning": recorded()[:1], "held_out": recorded()[1:]})(), {}),
    ],
)
def test_a_single_sample_is_refused_before_any_trial_is_spent(genuine, options):
    called = []

    def simulate(parameters, rng):
        called.append(parameters)
        return walk(parameters, rng)

    message = (
        r"`genuine` must be 2 samples or more to learn from, with a budget in trials; got 1 of 50 steps\. Cut it into several "
        r"that are shorter, or give `generations` instead of trials\."
    )
    with pytest.raises(ConfigurationError, match=message):
        tl.infer(genuine=genuine, simulate=simulate, parameters=RANGES, **options)
    with pytest.raises(ConfigurationError, match=message):
        tl.study(genuine=genuine, simulate=own_models.walk, parameters=RANGES, **options)
    assert not called
    assert infer(genuine, generations=1, **options).generations == 1


def test_a_model_that_fails_has_the_worst_fitness():
    history = infer(simulate=stumbling, seed=2, settings=FULL).history
    fast = history["model"].to_numpy()[..., 0] > 12
    assert fast.any()
    assert not history["model_fitness"].to_numpy()[fast].any()


def test_workers_infer_what_this_process_infers():
    here = infer(batches=2)
    assert infer(batches=2, workers=2).estimate == here.estimate
    alone = infer(simulate=walk_of_one, vectorized=False)
    assert infer(simulate=walk_of_one, vectorized=False, workers=2).estimate == alone.estimate


def test_a_simulator_that_breaks_ends_the_run_which_can_be_resumed(whole, tmp_path):
    path = tmp_path / "run"
    with pytest.raises(
        CustomSystemError,
        match=r"\[generation 5\], the first with speed = .* cm/s, turn_noise = .*license expired",
    ) as caught:
        infer(out=path, simulate=Breaking(5), settings=FULL, **FISH)
    ahead = f"5 generations are stored; resume with `turing_learning.resume({str(path)!r}, genuine=..., simulate=...)`."
    assert str(caught.value).endswith(f"or repair the simulator. {ahead}")
    assert tl.load_run(path).generations == 5
    assert RunFolder(path).manifest()["state"] == "stopped"
    tl.resume(path, genuine=recorded(), simulate=walk)
    assert untimed(path) == untimed(whole)


def test_a_run_without_a_folder_that_breaks_is_not_said_to_go_on():
    with pytest.raises(CustomSystemError) as caught:
        infer(simulate=Breaking(5))
    assert str(caught.value).endswith(
        "Nothing is stored of a run without `out`; give one, to be able to resume."
    )
    assert "turing_learning.resume" not in str(caught.value)


def test_a_run_that_breaks_in_the_first_generation_can_begin_again(whole, tmp_path):
    path = tmp_path / "run"
    with pytest.raises(
        CustomSystemError, match=r"`simulate` must return samples of every model; it raised OSError"
    ):
        infer(out=path, simulate=Breaking(0))
    assert tl.resume(path, genuine=recorded(), simulate=walk).complete


def test_a_run_whose_functions_are_those_of_a_module_needs_nothing_but_its_folder(
    whole, tmp_path, stop_after
):
    path, given = tmp_path / "run", {"genuine": own_models.herd, "simulate": "own_models:walk"}
    infer(**given, out=path, should_stop=stop_after(4), settings=FULL)
    assert {name: RunFolder(path).manifest()[name] for name in given} == given | {
        "genuine": "own_models:herd"
    }
    here = infer(genuine=own_models.herd)
    assert tl.resume(path).estimate == here.estimate
    quick = Effort(samples=10, points=0)
    assert tl.load_run(path).check(effort=quick, recoveries=0).test.genuine_samples >= 10
    infer(genuine="own_models:herd", generations=1, out=tmp_path / "gone")
    RunFolder(tmp_path / "gone").update_manifest(state="running", genuine="own_models:nothing")
    (tmp_path / "gone" / "result.json").unlink()
    for checkpoint in (tmp_path / "gone" / "checkpoints").iterdir():
        checkpoint.unlink()
    with pytest.raises(
        RunFolderError, match=r'`genuine` must be "module:function", .*own_models:nothing'
    ):
        tl.resume(tmp_path / "gone")


def test_own_systems_go_on_from_python_only(tmp_path, stop_after):
    path = tmp_path / "run"
    infer(
        out=path, simulate=lambda parameters, rng: walk(parameters, rng), should_stop=stop_after(4)
    )
    with pytest.raises(
        RunFolderError,
        match=r"`genuine` must be given .* Give `genuine` and `simulate` as the run began with",
    ):
        tl.resume(path)
    with pytest.raises(
        RunFolderError, match="`simulate` must be given for a custom system, which no folder holds"
    ):
        tl.resume(path, genuine=recorded())
    with pytest.raises(
        RunFolderError,
        match=r"`genuine` must be the samples that the run began with, of SHA-256 \w{12}\.\.\.; got",
    ):
        tl.resume(path, genuine=recorded(seed=4), simulate=walk)
    with pytest.raises(
        RunFolderError, match=r"`length` must be at most that of the shortest sample, 20; got 50"
    ):
        tl.resume(path, genuine=recorded()[:, :20], simulate=walk)
    with pytest.raises(
        RunFolderError,
        match="`genuine` must be an array of samples, as when the run began; got a function",
    ):
        tl.resume(path, genuine=lambda rng: recorded(), simulate=walk)
    with pytest.raises(RunFolderError, match="`timeout_s` must be given together with `workers`"):
        tl.resume(path, genuine=recorded(), simulate=walk, timeout_s=3.0)


def test_a_finished_run_needs_no_simulator(whole):
    assert tl.resume(whole).complete


def test_a_finished_run_is_compared_with_what_is_given(whole, tmp_path):
    assert tl.resume(whole, genuine=recorded()).complete
    assert tl.resume(whole, genuine=recorded(), simulate=walk).complete
    with pytest.raises(
        RunFolderError, match=r"`genuine` must be the samples that the run began with, of SHA-256"
    ):
        tl.resume(whole, genuine=recorded(seed=4), simulate=walk)
    small = {
        "models.population": 8,
        "classifiers.population": 8,
        "scenario.agents": 2,
        "scenario.trial.duration_s": 1.0,
    }
    tl.infer("aggregation", generations=1, settings=small, out=tmp_path / "swarm")
    with pytest.raises(
        RunFolderError, match="`genuine` must be left out for simulated robots; got ndarray"
    ):
        tl.resume(tmp_path / "swarm", genuine=recorded())


def test_a_live_source_is_observed_while_the_run_goes_on(tmp_path, stop_after):
    live = lambda rng: recorded(seed=int(rng.integers(1000)))  # noqa: E731
    whole = infer(genuine=live)
    infer(genuine=live, out=tmp_path / "run", should_stop=stop_after(4))
    assert tl.resume(tmp_path / "run", genuine=live, simulate=walk).estimate == whole.estimate


def test_split_samples_keep_their_names(tmp_path):
    class Windows:
        learning, held_out, names = recorded(), recorded(count=5), ("speed", "turn")

    infer(genuine=Windows(), generations=1, out=tmp_path / "run")
    system = RunFolder(tmp_path / "run").configuration().scenario
    assert (system.signals, system.held_out) == (("speed", "turn"), tuple(range(40, 45)))


RECORDING = tl.Trajectories(
    np.zeros((9, 1, 2)), np.ones((9, 1), dtype=bool), fps=30.0, individuals=("a",)
)
WALK = BurstAndCoast(individuals=1, steps=12, interval_s=0.04)


class Windows:
    """Samples as `Trajectories.windows` cuts them."""

    learning, held_out = (
        WALK(np.full((count, 4), 0.5), np.random.default_rng(count))[:, 0] for count in (20, 5)
    )
    names, interval_s = ("speed", "turn"), 0.04


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"interval_s": 0.1},
            "`simulate` must have the time step of the samples, 0.04 s; got 0.1 s. Give the family of models interval_s=0.04,",
        ),
        (
            {"signals": ("turn", "speed")},
            "`simulate` must have the signals of the samples, speed, turn, in this order; got turn, speed. Give the family of "
            "models signals=('speed', 'turn').",
        ),
        (
            {"signals": ("speed",)},
            "the signals of the samples, speed, turn, in this order; got speed.",
        ),
        (
            {"steps": 13},
            "`simulate` must have as many steps as the samples, 12; got 13. Give the family of models steps=12.",
        ),
    ],
)
def test_a_family_that_simulates_other_samples_is_refused_wherever_it_is_given(
    tmp_path, stop_after, change, message
):
    other, path = replace(WALK, **change), tmp_path / "run"
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        infer(Windows(), other, WALK.parameters, out=path)
    assert not path.exists()
    stopped = infer(Windows(), WALK, WALK.parameters, out=path, should_stop=stop_after(2))
    for again in (stopped.check, lambda **system: tl.resume(path, **system)):
        with pytest.raises(RefusedError, match=re.escape(message)):
            again(genuine=Windows(), simulate=other)
    assert tl.resume(path, genuine=Windows(), simulate=replace(WALK, interval_s=0.0400001)).complete


class Facing(BurstAndCoast):
    """A walk that is said to be measured with headings."""

    headings = True


FACING = Facing(individuals=1, steps=12, interval_s=0.04)


@pytest.mark.parametrize(
    ("headings", "simulate", "other", "message"),
    [
        (
            False,
            WALK,
            FACING,
            "`simulate` must have no headings, as the samples have none; got Facing, whose speeds are negative",
        ),
        (
            True,
            FACING,
            WALK,
            "`simulate` must have headings, as the samples do; got BurstAndCoast, whose speeds are never",
        ),
    ],
)
def test_headings_on_one_side_only_are_refused_wherever_a_simulator_is_given(
    tmp_path, stop_after, headings, simulate, other, message
):
    windows, path = Windows(), tmp_path / "run"
    windows.headings = headings
    with pytest.raises(ConfigurationError, match=message):
        infer(windows, other, WALK.parameters, out=path)
    assert not path.exists()
    stopped = infer(windows, simulate, WALK.parameters, out=path, should_stop=stop_after(2))
    for again in (stopped.check, lambda **system: tl.resume(path, **system)):
        with pytest.raises(RefusedError, match=message):
            again(genuine=windows, simulate=other)
    assert tl.resume(path, genuine=windows, simulate=simulate).complete


def test_headings_do_not_matter_where_they_change_no_signal_or_nothing_is_known_of_them():
    near, windows = replace(FACING, individuals=2, signals=("neighbor_distance",)), Windows()
    assert (
        infer(windows, FACING, WALK.parameters, generations=1).configuration.scenario.headings == ""
    )
    windows.headings, windows.names = False, near.signals
    windows.learning = windows.held_out = near(np.full((20, 4), 0.5), np.random.default_rng(1))[
        :, 0
    ]
    assert (
        infer(windows, near, near.parameters, generations=1).configuration.scenario.headings == ""
    )


def test_a_stored_run_of_before_headings_were_known_opens(tmp_path):
    stored = to_toml(infer(Windows(), WALK, WALK.parameters, generations=1).configuration)
    assert stored.count('headings = ""\n') == 1
    (tmp_path / "old.toml").write_text(stored.replace('headings = ""\n', ""))
    assert load_configuration(tmp_path / "old.toml").scenario.headings == ""


def test_a_recording_of_another_frame_rate_is_refused_in_a_check():
    result = infer(Windows(), WALK, WALK.parameters, generations=1)
    with pytest.raises(
        ConfigurationError,
        match="`recording` must have the frame rate of the samples, 25 per second; got 30",
    ):
        result.check(recording=RECORDING)


def test_what_samples_do_not_say_is_not_held_against_a_family():
    other = replace(WALK, interval_s=0.1, signals=("turn", "speed"))
    assert infer(Windows.learning, other, WALK.parameters, generations=1).generations == 1


def test_a_configuration_gives_everything_but_the_system():
    base = load_configuration(overrides=SMALL | {"run.generations": 2})
    assert (
        tl.infer(genuine=recorded(), simulate=walk, parameters=RANGES, config=base).generations == 2
    )


def test_a_file_may_give_the_settings_and_no_scenario(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text("[models]\npopulation = 6\n[run]\ngenerations = 2\n")
    assert infer(config=path, generations=None).generations == 2
    path.write_text('scenario = "aggregation"\n')
    with pytest.raises(
        ConfigurationError,
        match=r"`scenario` must be left out for a custom system; got 'aggregation' \[",
    ):
        infer(config=path)


def test_an_input_scale_of_ones_own_comes_before_that_of_the_data(tmp_path):
    infer(out=tmp_path / "run", generations=1, settings={"classifiers.input_scale": [2.0, 3.0]})
    assert RunFolder(tmp_path / "run").configuration().input_scale == (2.0, 3.0)


def test_a_stored_configuration_alone_does_not_run(whole, tmp_path):
    with pytest.raises(
        ConfigurationError,
        match="`genuine` must be given for a custom system, which no folder holds completely",
    ):
        start(RunFolder(whole).configuration(), tmp_path / "new")
    assert not (tmp_path / "new").exists()
    with pytest.raises(
        ConfigurationError,
        match="`scenario` must be one of simulated robots where nothing else is given; got 'fish'",
    ):
        load_variants(whole / "config.toml")


def test_settings_reach_runs_of_robots_too():
    result = tl.infer(
        "aggregation",
        generations=1,
        settings=SMALL | {"scenario.agents": 2, "scenario.trial.duration_s": 1.0},
    )
    assert result.generations == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"parameters": None}, "`parameters` must be given for a custom system; got nothing."),
        (
            {"scenario": "aggregation"},
            "`scenario` must be left out for a custom system; got 'aggregation'.",
        ),
        (
            {"parameters": {"a": (1, 2, 3)}},
            "`parameters` must have two bounds (low, high) or a `Parameter` for each name; got (1, 2, 3) ['a'].",
        ),
        (
            {"parameters": {"a": (3, 1)}},
            "`low` must be below `high`; got 3.0 and 1.0. [parameter 'a']",
        ),
        ({"parameters": {"a b": (0, 1)}}, "`parameters` must have names of 1 to 60 letters"),
        ({"worker": 2}, "`worker` must be a known option; got 2. Did you mean `workers`?"),
        (
            {"generation": 3},
            "`generation` must be a known option; got 3. Did you mean `generations`?",
        ),
        ({"workers": "2"}, "`workers` must be an integer of at least 1; got '2'."),
        ({"workers": -1}, "`workers` must be an integer of at least 1; got -1."),
        (
            {"genuine": RECORDING},
            "`genuine` must be samples, into which a recording is cut; got Trajectories. Give windows of it, for example of 4 s: "
            "genuine=recording.windows(length_s=4.0), where recording is what `load_trajectories` returned; "
            "of several: genuine=pooled_windows(recordings, length_s=4.0).",
        ),
        (
            {"genuine": RECORDING.speeds()},
            "`genuine` must be samples, into which a recording is cut; got Signals.",
        ),
        (
            {"genuine": recorded() + 0j},
            "`genuine` must be samples (K, T, D) of real numbers; got shape (50, 2) of complex128",
        ),
        (
            {"batches": 2, "vectorized": False},
            "`batches` must be left out where vectorized is False; got 2.",
        ),
        ({"batches": 0}, "`batches` must be an integer of at least 1; got 0."),
        ({"signals": "x"}, "`signals` must be a tuple of names; got 'x'. For one signal: ('x',)."),
        ({"genuine": "fish.csv"}, "A file is read with `load_trajectories`."),
        (
            {"genuine": recorded()[0]},
            "`genuine` must be samples (K, T, D), or a list of K tables (T, D); got one table of",
        ),
        ({"signals": ("x",)}, "`signals` must be as many names as the data has signals"),
        ({"simulate": 3}, "`simulate` must be a function of (parameters, rng); got int."),
        (
            {"genuine": np.full((3, 4, 2), np.nan)},
            "got nan (or masked) [sample 0, step 0, signal 0]",
        ),
        ({"settings": {"models.parnts": 3}}, "Did you mean `models.parents`?"),
    ],
)
def test_what_breaks_a_rule_is_refused_before_anything_runs(arguments, message):
    given = {"genuine": recorded(), "simulate": walk, "parameters": RANGES} | arguments
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        tl.infer(**given)


def test_a_signal_that_does_not_vary_is_told_in_words(caplog):
    still = recorded()
    still[..., 1] = 0.3
    infer(genuine=recorded(), generations=1)
    assert not caplog.records
    infer(genuine=still, generations=1)
    (record,) = caplog.records
    assert (
        "Constant signal of the genuine samples: signal1 is 0.3, at every step of all of them."
        in record.message
    )


def test_signals_in_so_large_a_unit_that_they_count_as_constant_are_refused():
    with pytest.raises(
        ValueError, match=re.escape("`genuine` must vary by more than rounding leaves")
    ):
        infer(genuine=recorded() * 1e-16, generations=1)


def test_a_signal_that_may_be_what_rounding_leaves_of_zero_is_named(caplog):
    small = recorded()
    small[..., 1] *= 1e-11
    infer(genuine=small, generations=1)
    (record,) = caplog.records
    assert "If that is what rounding leaves of 0, leave the signal out." in record.message


def test_models_that_all_look_alike_to_classifiers_are_refused():
    def still(parameters, rng):
        return np.full((len(parameters), 20, 1), 7.0)

    with pytest.raises(
        ValueError, match="`simulate` must return samples that classifiers can tell apart"
    ):
        tl.infer(
            genuine=still(np.empty((40, 1)), None), simulate=still, parameters={"a": (0, 10)}, trials=50,
            vectorized=True, progress=False, settings={"run.threads": 1},
        )  # fmt: skip


def test_a_recording_in_which_nobody_moves_is_refused(tmp_path):
    frames = tl.Trajectories(
        np.ones((400, 2, 2)), np.ones((400, 2), dtype=bool), fps=25.0, individuals=("a", "b")
    )
    with pytest.raises(
        ConfigurationError,
        match=r"must be windows of motion that varies; got the same at every step of all of them: speed is 0, turn is 0. See",
    ):
        infer(frames.windows(12, longest_rest_s=None), WALK, WALK.parameters, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_options_of_own_systems_are_refused_for_robots():
    with pytest.raises(
        ConfigurationError,
        match=re.escape("`workers` must be left out for simulated robots; got 2."),
    ):
        tl.infer("aggregation", workers=2)


def test_a_misspelt_argument_is_named_for_robots_too():
    with pytest.raises(
        ConfigurationError,
        match=r"`generation` must be a known option; got 3. Did you mean `generations`",
    ):
        tl.infer("aggregation", generation=3)


def test_samples_are_refused_when_a_run_of_robots_goes_on(small, tmp_path, stop_after):
    start(small(), tmp_path / "run", should_stop=stop_after(2))
    with pytest.raises(
        RunFolderError, match="`simulate` must be left out for simulated robots; got function"
    ):
        tl.resume(tmp_path / "run", simulate=walk)
