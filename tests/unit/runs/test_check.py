"""A check of a run: what it finds, what it keeps, and how it goes on."""

import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from own_models import RANGES, recorded, walk

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.identifiability import Effort
from turing_learning.purposes import CHECK, INTERROGATION
from turing_learning.runs import Run, RunFolder, RunFolderError, RunStorageError, _check
from turing_learning.runs._report import check_listing, draw_check
from turing_learning.systems import CustomSystemError

pytestmark = pytest.mark.usefixtures("few_kernels")

SETTINGS = {
    "models.population": 8,
    "classifiers.population": 8,
    "run.threads": 1,
    "run.history": "thin",
}
SWARM = {"models.population": 4, "classifiers.population": 4, "scenario.trial.duration_s": 1.0}
QUICK = Effort(samples=20, points=6)
BRIEF = replace(QUICK, points=0)


def infer(generations=6, **options):
    return tl.infer(
        genuine=recorded(),
        simulate=walk,
        parameters=RANGES,
        generations=generations,
        settings=SETTINGS,
        seed=1,
        **options,
    )


def live(rng):
    return walk(np.tile([6.0, 0.6], (40, 1)), rng)


@pytest.fixture
def recoveries(monkeypatch):
    """What the recoveries of a check are run on."""
    systems = []
    recover = _check.begin_or_resume

    def spied(configuration, path, given):
        systems.append(given.genuine)
        return recover(configuration, path, given)

    monkeypatch.setattr(_check, "begin_or_resume", spied)
    return systems


def content(path):
    return json.loads((path / "check" / "check.json").read_text())


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    path = tmp_path_factory.mktemp("checked") / "run"
    result = infer(out=path)
    return result, result.check(effort=QUICK)


def test_a_check_says_something_of_everything(stored):
    _, found = stored
    assert [each.parameter for each in found.parameters] == ["speed", "turn_noise"]
    assert [each.parameter for each in found.profiles] == ["speed", "turn_noise"]
    assert [each.name for each in found.quantities] == ["signal0", "signal1"]
    assert found.recoveries[0].truth == stored[0].estimate
    assert found.recoveries[0].generations == 6
    assert found.test.genuine_samples == 8
    assert 0 < found.test.p_value <= 1


def test_a_run_in_memory_finds_the_same_as_one_in_a_folder(stored):
    result = infer()
    assert result.check(effort=QUICK) == stored[1] == result.checked
    assert result.verdicts == tl.load_run(stored[0].path).verdicts == stored[1].verdicts
    assert content(stored[0].path)["judgment"] == stored[1].judgment.to_json()


def test_a_recovery_of_a_live_system_learns_from_as_many_samples_as_are_observed(recoveries):
    given = {"simulate": walk, "parameters": RANGES, "settings": SETTINGS, "seed": 1}
    result = tl.infer(genuine=live, generations=3, **given)
    (recovery,) = result.check(effort=QUICK).recoveries
    assert recovery.truth == result.estimate
    assert (
        recoveries[0].live(np.random.default_rng(0)).shape == live(np.random.default_rng(0)).shape
    )


def test_a_check_observes_a_live_system_only_to_train_classifiers_and_to_test_them():
    calls = []

    def observed(rng):
        calls.append(rng)
        return live(rng)

    result = tl.infer(
        genuine=live, simulate=walk, parameters=RANGES, generations=3, settings=SETTINGS, seed=1
    )
    result.check(genuine=observed, effort=BRIEF, recoveries=0)
    assert len(calls) == 2


def test_the_random_numbers_of_a_check_are_those_of_its_purpose_and_of_the_run_in_it():
    purposes = set()

    def noted(parameters, rng):
        purposes.add(rng.bit_generator.seed_seq.entropy[0])
        return walk(parameters, rng)

    infer().check(simulate=noted, effort=BRIEF, recovery_generations=1)
    assert purposes == {CHECK, INTERROGATION}


def test_a_loaded_run_is_told_its_system_again_and_finds_what_is_kept(stored):
    loaded = tl.load_run(stored[0].path)
    with pytest.raises(ConfigurationError, match="`genuine` must be given for a custom system"):
        loaded.check(effort=QUICK)
    calls = []
    assert (
        loaded.check(genuine=recorded(), simulate=walk, effort=QUICK, stage=calls.append)
        == stored[1]
    )
    assert calls == []


def test_a_check_that_was_stopped_goes_on_with_the_same_result(stored, tmp_path):
    result = infer(out=tmp_path / "run")

    def stop(text):
        if "turn_noise" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        result.check(effort=QUICK, stage=stop)
    assert list(content(result.path)["profiles"]) == ["speed"]
    calls = []
    assert result.check(effort=QUICK, stage=calls.append) == stored[1]
    assert calls[0].startswith("ahead: 1 profile of")
    assert calls[1] == "fresh classifiers where turn_noise is moved"


def no_room(*arguments, **options):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize(
    "writer",
    ["store.write_atomically", "runs._check.save_figures", "runs._folder.write_atomically"],
)
def test_a_check_without_room_says_so_and_goes_on_with_the_same_result(
    stored, tmp_path, monkeypatch, writer
):
    result = infer(out=tmp_path / "run")
    with monkeypatch.context() as patch:
        patch.setattr(f"turing_learning.{writer}", no_room)
        with pytest.raises(RunStorageError) as refused:
            result.check(effort=QUICK)
    assert str(refused.value) == (
        f"`run` must be a folder with space left; could not write to {result.path} (No space left on device). "
        "Make room, then check again: it goes on."
    )
    assert result.check(effort=QUICK) == stored[1]


def test_a_check_of_a_run_that_cannot_be_written_is_refused(stored, monkeypatch):
    def read_only(self):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(RunFolder, "locked", read_only)
    with pytest.raises(
        RunFolderError,
        match=r"`run` must be a folder that can be written; got .* \(Read-only file sys",
    ):
        stored[0].check(effort=QUICK)


def test_what_is_not_known_of_a_run_that_has_not_moved_is_said_in_file_figure_and_tables(tmp_path):
    result = infer(out=tmp_path / "run", generations=2)
    result.report()
    found = result.check(effort=QUICK)
    assert [each.interval_share for each in found.parameters] == [None, None]
    assert found.not_pinned_down == ("speed", "turn_noise")
    kept = content(result.path)
    assert [each["interval_share"] for each in kept["parameters"]] == [None, None]
    assert kept["recoveries"][0]["interval"] == {"speed": [None, None], "turn_noise": [None, None]}
    assert result.check(effort=QUICK) == found
    assert [line.split()[:2] for line in str(found).splitlines() if line.startswith("speed")] == [
        ["speed", "-"]
    ]
    assert check_listing(found).rows[0][1] is None
    drawing = draw_check(found, result)[0]
    assert not drawing.figure.axes[0].patches
    page = (result.path / "report.html").read_text(encoding="utf-8")
    assert result.verdict == kept["verdicts"][0] == found.verdict
    assert f"<b>{result.verdict}</b>" in page
    assert "turing-learning check" not in page  # it is done
    assert ">nan" not in page


def test_other_settings_are_refused_unless_forced(tmp_path):
    result = infer(out=tmp_path / "run")
    result.check(effort=replace(BRIEF, references=4), recoveries=0)
    with pytest.raises(
        RunFolderError, match="`run` must be checked with the settings that its check began with"
    ):
        result.check(effort=BRIEF, recoveries=0, seed=1)
    assert result.check(effort=BRIEF, recoveries=0, seed=1, force=True).recoveries == ()
    assert content(result.path)["settings"]["seed"] == 1


def test_a_check_of_unfinished_trials_speaks_of_trials(stop_after):
    options = {"genuine": recorded(), "simulate": walk, "parameters": RANGES, "seed": 1}
    stopped = tl.infer(**options, trials=40, should_stop=stop_after(3))
    found = stopped.check(effort=replace(BRIEF, references=4), recoveries=0)
    assert found.unfinished == (stopped.trials, 40)
    assert f"that after {stopped.trials} of 40 trials." in str(found)


def test_a_check_of_a_run_that_goes_on_says_so(tmp_path, stop_after):
    stopped = infer(out=tmp_path / "run", should_stop=stop_after(3))
    found = stopped.check(effort=replace(BRIEF, references=4), recoveries=0)
    assert found.unfinished == (3, 6)
    assert "The run was not finished: the estimate is that after 3 of 6 generations." in str(found)
    assert stopped.check(effort=replace(BRIEF, references=4), recoveries=0) == found
    tl.resume(stopped.path, genuine=recorded(), simulate=walk)
    given = {"genuine": recorded(), "simulate": walk, "effort": BRIEF, "recoveries": 0}
    with pytest.raises(
        RunFolderError,
        match=r"got another, after 6 generations \[.*\]\. The run has gone on since: replace",
    ):
        tl.load_run(stopped.path).check(**given)
    assert tl.load_run(stopped.path).check(**given, force=True).unfinished is None


def test_ctrl_c_in_python_says_how_a_run_goes_on(tmp_path):
    def interrupt(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        infer(out=tmp_path / "run", observer=interrupt)
    (note,) = caught.value.__notes__
    assert f"The run is in {tmp_path / 'run'}. Resume it with " in note
    assert "resume(" in note
    assert "genuine=" in note


def test_a_resumed_run_is_checked_with_what_it_was_resumed_with(tmp_path, stop_after):
    stopped = infer(out=tmp_path / "run", should_stop=stop_after(3))
    for _ in ("goes on", "is finished"):
        resumed = tl.resume(stopped.path, genuine=recorded(), simulate=walk)
        found = resumed.check(effort=replace(BRIEF, references=4), recoveries=0)
        assert found.unfinished is None


def test_a_run_that_cannot_be_checked_keeps_nothing_of_it(tmp_path):
    result = infer(out=tmp_path / "run")
    calls = []
    with pytest.raises(
        ConfigurationError,
        match="`groups` must tell at least 2 groups of held-out samples apart; got 1",
    ):
        result.check(effort=QUICK, groups=np.zeros(40), stage=calls.append)
    few = infer(out=tmp_path / "few", held_out=[3])
    with pytest.raises(ConfigurationError, match="`held_out` must keep at least 4"):
        few.check(effort=QUICK, stage=calls.append)
    assert calls == []
    assert not any((path / "check").exists() for path in (result.path, few.path))


def test_agents_that_nobody_knows_are_compared_with_nothing(tmp_path):
    result = tl.infer(
        "aggregation",
        generations=3,
        seed=1,
        settings=SWARM | {"scenario.known": False},
        out=tmp_path / "run",
    )
    assert (result.truth, result.absolute_error, result.estimate_mae) == (None, None, None)
    assert "there is no truth to compare it with" in (tmp_path / "run/report.html").read_text()
    (recovery,) = result.check(
        effort=BRIEF, recovery_generations=3
    ).recoveries  # whose truth is the estimate
    assert recovery.truth == result.estimate
    assert np.isfinite(list(recovery.error_share.values())).all()


def test_a_report_whose_history_is_gone_is_left_as_it_was(tmp_path):
    full = SETTINGS | {"run.history": "full"}
    tl.infer(
        genuine=recorded(),
        simulate=walk,
        parameters=RANGES,
        generations=3,
        settings=full,
        out=tmp_path / "run",
    )
    shutil.rmtree(tmp_path / "run/history.zarr")
    (tmp_path / "run/report.html").write_text("as it was")
    calls = []
    given = {"genuine": recorded(), "simulate": walk, "effort": BRIEF, "recoveries": 0}
    found = tl.load_run(tmp_path / "run").check(**given, stage=calls.append)
    assert calls[-1].startswith("the report is left as it was: `run` must have its history")
    assert (tmp_path / "run/report.html").read_text() == "as it was"
    assert tl.load_run(tmp_path / "run").check(**given) == found


def test_a_forced_check_looks_again(tmp_path):
    result = infer(out=tmp_path / "run")
    result.check(effort=BRIEF, recoveries=0)
    calls = []
    result.check(effort=BRIEF, recoveries=0, stage=calls.append)
    assert calls == []
    result.check(effort=BRIEF, recoveries=0, stage=calls.append, force=True)
    assert calls[0].startswith("ahead: fresh classifiers against the estimate")
    assert calls[1] == "fresh classifiers against the estimate"


def test_other_samples_are_refused(stored):
    with pytest.raises(
        ConfigurationError, match="`genuine` must be the samples that the run began with"
    ):
        stored[0].check(genuine=recorded(seed=9), effort=QUICK)


def test_labels_group_the_held_out_samples():
    found = infer().check(effort=QUICK, groups=np.arange(40) % 3, recoveries=0)
    assert (found.test.genuine_groups, found.test.grouping) == (3, "groups")
    with pytest.raises(
        ConfigurationError, match="`groups` must be one label for each of the 40 samples; got shape"
    ):
        infer().check(effort=QUICK, groups=np.arange(8))


def test_windows_are_grouped_by_individual_or_also_by_time_where_there_are_few():
    from turing_learning.systems import held_out_groups
    from turing_learning.trajectories import Trajectories

    for count, word in ((6, "individuals"), (3, "individuals in blocks of time")):
        positions = np.cumsum(np.random.default_rng(0).normal(0.5, 0.1, (600, count, 2)), axis=0)
        names = tuple(map(str, range(count)))
        windows = Trajectories(positions, np.ones((600, count), dtype=bool), 10.0, names).windows(
            10
        )
        groups, grouping = held_out_groups(windows)
        assert grouping == word
        blocks = sum(side == "held out" for _, _, side in windows.blocks)
        assert len(np.unique(groups)) == (count if count == 6 else count * blocks)


def test_held_out_individuals_are_groups_however_few_they_are():
    from turing_learning.systems import held_out_groups
    from turing_learning.trajectories import Trajectories

    positions = np.cumsum(np.random.default_rng(0).normal(0.5, 0.1, (600, 4, 2)), axis=0)
    whole = Trajectories(positions, np.ones((600, 4), dtype=bool), 10.0, tuple("abcd"))
    for share in (0.0, 0.2):
        windows = whole.windows(10, hold_out=share, hold_out_individuals=["b", "d"])
        groups, grouping = held_out_groups(windows)
        assert grouping == "individuals"
        assert sorted(set(groups)) == [1, 3]


def test_a_run_on_robots_is_checked_without_being_told_anything(tmp_path):
    small = SETTINGS | {"scenario.agents": 2, "scenario.trial.duration_s": 1.0}
    result = tl.infer("aggregation", generations=5, settings=small, seed=1, out=tmp_path / "run")
    found = tl.load_run(result.path).check(effort=QUICK)
    assert found.test.grouping == "trials"
    assert [each.name for each in found.quantities] == [
        "speed",
        "turn",
        "neighbor_distance",
        "polarization",
    ]
    recovery = tl.load_run(result.path / "check" / "recovery-1")
    assert recovery.truth == pytest.approx(result.estimate)
    assert {path.stem for path in (result.path / "figures").iterdir()} == {
        "check-profiles",
        "check-quantities",
    }
    with pytest.raises(
        ConfigurationError, match="`simulate` must be left out for simulated robots"
    ):
        result.check(simulate=walk)


def test_networks_are_checked_as_what_they_do_and_no_weight_is_profiled():
    small = SETTINGS | SWARM | {"scenario.agents": 2, "models.hidden": 2}
    result = tl.infer("aggregation", generations=3, settings=small, seed=1)
    found = result.check(effort=QUICK)
    assert found.profiles == ()
    assert [each.parameter for each in found.parameters] == ["vl0", "vr0", "vl1", "vr1"]
    assert found.recoveries[0].truth == result.estimate
    still = dict.fromkeys(result.networks["estimate"], 0.0)  # both outputs are 0
    standing = replace(result, networks={"best_model": still, "estimate": still}).check(
        effort=QUICK, recoveries=0
    )
    simulated = {
        each.name: np.average(each.edges[1:], weights=each.simulated)
        for each in standing.quantities
    }
    assert abs(simulated["speed"]) < 1  # cm/s, the width of a bin
    assert {each.name: each.simulated for each in found.quantities} != {
        each.name: each.simulated for each in standing.quantities
    }


def test_a_field_of_view_is_checked_over_its_whole_range_and_recovered_as_that_of_the_agents(
    monkeypatch,
):
    recovered, begin = [], Run.begin
    monkeypatch.setattr(
        Run,
        "begin",
        lambda found, *rest, **more: recovered.append(found) or begin(found, *rest, **more),
    )
    small = SETTINGS | SWARM | {"scenario.agents": 2}
    result = tl.infer("aggregation-field-of-view-60", generations=3, settings=small, seed=1)
    recovered.clear()
    found = result.check(effort=QUICK)
    theta = {each.parameter: each for each in found.profiles}["theta"]
    assert (theta.values[0], theta.values[-1]) == pytest.approx((0, 2 * np.pi))
    assert recovered[0].scenario.sensor.field_of_view == result.estimate["theta"]
    assert recovered[0].scenario.truth == pytest.approx(tuple(result.estimate.values()))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"recoveries": -1}, "`recoveries` must be an integer of at least 0; got -1"),
        (
            {"recovery_generations": 0},
            "`recovery_generations` must be an integer of at least 1; got 0",
        ),
        ({"seed": -1}, "`seed` must be an integer of at least 0; got -1"),
    ],
)
def test_what_is_no_setting_is_refused(stored, options, message):
    with pytest.raises(ConfigurationError, match=message):
        stored[0].check(**options)


def test_a_check_names_what_gives_a_model_away_as_a_test_does():
    def too_fast(parameters, rng):
        return walk(parameters * [10, 1], rng)

    checked = tl.infer(
        genuine=recorded(), simulate=too_fast, parameters=RANGES, generations=1, settings=SETTINGS
    ).check(effort=replace(BRIEF, references=4), recoveries=0)
    assert checked.judgment.fits is False
    said = re.search(r"Told by \(simulated against real\): (.*?) \(", checked.text)[1]
    fast = too_fast(np.tile([5.0, 0.6], (40, 1)), np.random.default_rng(1))
    names = ["signal0", "signal1"]
    tested = tl.test(recorded(), fast, names=names, examiners=tl.examination.QUICK)
    assert said == tested.telling[0].what


def test_too_few_held_out_samples_are_refused():
    with pytest.raises(
        ConfigurationError, match="`held_out` must keep at least 4 samples for testing; got 1"
    ):
        infer(held_out=[3]).check(effort=QUICK)


def test_a_scenario_is_genuine_motion_for_any_simulator():
    def still(parameters, rng):
        return parameters[:, :1, None] * np.ones((1, 100, 2))

    given = {
        "simulate": still,
        "parameters": {"speed": (-20, 20)},
        "generations": 2,
        "settings": SETTINGS,
        "seed": 3,
    }
    named, scenario = (
        tl.infer(genuine=genuine, **given) for genuine in ("aggregation", tl.swarm.AGGREGATION)
    )
    assert named.estimate == scenario.estimate
    samples = tl.swarm.ObservedSwarm(tl.swarm.AGGREGATION)(np.random.default_rng(1))
    assert samples.shape == (110, 100, 2)
    with pytest.raises(ConfigurationError, match=r"got 'agregation'. Did you mean `aggregation`"):
        tl.infer(genuine="agregation", **given)


def test_a_run_on_a_scenario_as_genuine_is_resumed_to_the_same_result(tmp_path, stop_after):
    def still(parameters, rng):
        return parameters[:, :1, None] + rng.normal(size=(len(parameters), 100, 2))

    given = {"genuine": tl.swarm.AGGREGATION, "simulate": still}
    more = {"parameters": {"speed": (-20, 20)}, "generations": 4, "settings": SETTINGS, "seed": 3}
    whole = tl.infer(**given, **more)
    tl.infer(**given, **more, out=tmp_path / "run", should_stop=stop_after(2))
    assert tl.resume(tmp_path / "run", **given).estimate == whole.estimate


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (
            {"samples": 10},
            "`samples` must be a part of the effort; got 10 beside it. Give "
            "effort=turing_learning.identifiability.Effort(samples=10).",
        ),
        ({"recovery": 0}, "`recovery` must be a known option; got 0. Did you mean `recoveries`?"),
        ({"result": 3}, "`result` must be a known option; got 3."),
    ],
)
def test_an_option_that_no_check_has_is_refused_by_its_name(stored, option, message):
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        stored[0].check(**option)


@pytest.mark.parametrize("history", ["full", "thin"])
@pytest.mark.parametrize("there", [False, True])
def test_a_run_whose_folder_is_elsewhere_writes_nothing_where_it_was(tmp_path, history, there):
    path = tmp_path / "run"
    result = tl.infer(
        "aggregation", generations=1, settings=SWARM | {"run.history": history}, out=path
    )
    path.rename(tmp_path / "elsewhere")
    if there:
        path.mkdir()
    for use in (lambda: result.check(effort=QUICK), result.report, lambda: result.history):
        with pytest.raises(
            RunFolderError,
            match=r"`run` must be in its folder; got .*run, where it is not any more. Open it from where it is now: .*load_run",
        ):
            use()
    assert (list(path.iterdir()) == []) if there else not path.exists()
    assert tl.load_run(tmp_path / "elsewhere").report().exists()


def test_a_simulator_that_fails_in_a_check_is_told_without_generations_and_bounds():
    def broken(parameters, rng):
        raise ZeroDivisionError("too fast")

    with pytest.raises(CustomSystemError) as caught:
        infer().check(simulate=broken, effort=QUICK)
    assert re.fullmatch(
        r"`simulate` must not fail for more than half of the \d+ models; got \d+ failures or more, the first with speed = .*: it "
        r"raised ZeroDivisionError: too fast \[.*\]\. Repair the simulator\.",
        str(caught.value),
    )


def test_a_simulator_that_fails_in_a_profile_may_be_checked_without():
    result = infer()
    estimate = np.array(list(result.estimate.values()))

    def narrow(parameters, rng):
        if not np.allclose(parameters, estimate):
            raise ZeroDivisionError("too far")
        return walk(parameters, rng)

    with pytest.raises(
        CustomSystemError, match=r"Repair the simulator\. Or check without profiles, with points=0"
    ):
        result.check(simulate=narrow, effort=QUICK, recoveries=0)
    found = result.check(simulate=narrow, effort=BRIEF, recoveries=0)
    assert found.profiles == ()
