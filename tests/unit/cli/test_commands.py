"""What every command prints, and the exit codes."""

import errno
import json
import logging
import os
import re
import signal
import subprocess
import sys

import pytest

import turing_learning
from turing_learning.cli import main
from turing_learning.runs import RunFolder
from turing_learning.systems import CustomSystemError

SMALL = [
    "--set", "models.population=8", "--set", "classifiers.population=8", "--set", "scenario.agents=2",
    "--set", "scenario.trial.duration_s=1.0", "--threads", "1",
]  # fmt: skip


@pytest.fixture
def refused(call, tmp_path):
    """Call the command line; it must refuse with one line on stderr, and leave the folder as it was."""

    def refused(*arguments):
        before = sorted(tmp_path.rglob("*"))
        code, out, err = call(*arguments)
        assert code == 2, err
        assert out == ""
        assert err.startswith("error: ")
        assert err.count("\n") == 1
        assert sorted(tmp_path.rglob("*")) == before
        return err.removeprefix("error: ").rstrip("\n")

    return refused


@pytest.mark.parametrize(
    "command", [[], ["infer"], ["resume"], ["show"], ["simulate"], ["scenarios"], ["robots", "run"]]
)
def test_every_command_explains_itself(command, call):
    code, out, _ = call(*command, "--help")
    assert code == 0
    assert "Usage: turing-learning" in out


def test_what_is_compiled_is_said_on_standard_error(call, capsys):
    call("--version")
    logging.getLogger("turing_learning.kernels").info(
        "Compiling what is slow, once on this machine."
    )
    assert capsys.readouterr() == ("", "Compiling what is slow, once on this machine.\n")


@pytest.mark.parametrize("command", ["infer", "simulate"])
def test_a_file_in_place_of_a_scenario_is_led_to_its_option(refused, command):
    message = "`SCENARIO` must be the name of a scenario; got five.toml. Give a file with --config."
    assert refused(command, "five.toml") == message


def test_the_version_is_printed(call):
    assert call("--version")[:2] == (0, f"turing-learning {turing_learning.__version__}\n")


def test_scenarios_lists_the_presets(call):
    code, out, _ = call("scenarios")
    assert code == 0
    assert "aggregation" in out
    assert "object-clustering" in out
    assert "vl2 = 0.1" in out
    assert "4 agents, 1 replica, 10 objects; vl0" in out
    assert "aggregation-field-of-view-60" in out
    assert "field of view 1.047 rad" in out


def test_a_run_in_the_home_folder_is_found_there_by_every_command(call, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    code, out, err = call("infer", "aggregation", *SMALL, "--generations", 3, "--out=~/a run")
    assert (code, err) == (0, "")
    assert f"report: {tmp_path / 'a run' / 'report.html'}" in out
    assert not (tmp_path / "~").exists()
    for command in ("show", "resume"):
        assert call(command, "~/a run")[0] == 0
    assert call("detect", "~/a run", "--simulate", "1", "--samples", "1")[0] == 0


def test_infer_prints_the_table_and_leaves_a_run(call, tmp_path):
    code, out, _ = call(
        "infer", "aggregation", *SMALL, "--generations", 3, "--seed", 4, "--out", "run"
    )
    assert code == 0
    assert "generation 3/3" in out
    for word in ("estimate", "true", "error", "best model", "vl0", "report: run/report.html"):
        assert word in out
    assert "paper" not in out  # which has no errors for swarms of other sizes
    assert json.loads((tmp_path / "run" / "result.json").read_text())["seed"] == 4
    code, out, _ = call("show", "run")
    assert code == 0
    assert "aggregation, seed 4" in out
    assert call("resume", "run")[0] == 0


def test_infer_without_out_makes_a_folder_under_runs(call, tmp_path):
    assert call("infer", "aggregation", *SMALL, "--generations", 1)[0] == 0
    (folder,) = (tmp_path / "runs").iterdir()
    assert folder.name.startswith("aggregation-")
    assert folder.name.endswith("-seed1")


def test_a_sensor_for_objects_that_are_not_there_is_refused(call, tmp_path):
    code, _, err = call(
        "infer", "object-clustering", "--set", "scenario.objects.count=0", "--out", "run"
    )
    assert code == 2
    assert err == (
        "error: `scenario.objects.count` must be at least 1 where the sensor tells objects apart, without which the parameters vl1 "
        "and vr1 cannot be inferred; got 0. Set it, or leave 'object' out of scenario.sensor.readings and these two speeds out of "
        "scenario.controller.\n"
    )
    assert not (tmp_path / "run").exists()


def test_infer_takes_the_scenario_from_a_file(call, tmp_path):
    (tmp_path / "my.toml").write_text('scenario = "object-clustering"\n[run]\ngenerations = 1\n')
    assert call("infer", "--config", "my.toml", *SMALL, "--out", "run")[0] == 0
    content = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (content["scenario"], content["generations"]) == ("object-clustering", 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "infer agregation",
            "`scenario` must be a known scenario; got 'agregation'. Did you mean `aggregation`?",
        ),
        ("simulate agregation", "got 'agregation'. Did you mean `aggregation`?"),
        ("infer", "`SCENARIO` must be given, or a file with --config; got neither."),
        (
            "infer aggregation --generatons 3",
            "Unknown option: --generatons. Did you mean --generations?",
        ),
        (
            "infer aggregation --generations 0",
            "`run.generations` must be greater than or equal to 1; got 0 [--gen",
        ),
        (
            "infer aggregation --generations=-5",
            "`run.generations` must be greater than or equal to 1; got -5",
        ),
        (
            "infer aggregation --generations x",
            "`run.generations` must be an integer; got 'x' [--generations].",
        ),
        (
            "infer aggregation --seed=-1",
            "`run.seed` must be greater than or equal to 0; got -1 [--seed].",
        ),
        (
            "infer aggregation --threads 0",
            '`run.threads` must be "all" or an integer of at least 1; got 0',
        ),
        ("infer aggregation --preset papr", "Did you mean `paper`?"),
        (
            "infer aggregation --set models.parents=0",
            "must be greater than or equal to 1; got 0 [--set models.par",
        ),
        (
            "infer aggregation --set models.population=7",
            "`models.population` must be an even number",
        ),
        (
            "infer aggregation --set models.initial_low=nan",
            "must be a finite number; got nan [--set",
        ),
        ("infer aggregation --set models", "`--set` must be KEY=VALUE; got 'models'."),
        ("infer aggregation --set models.parnts=3", "Did you mean `models.parents`?"),
        (
            "infer aggregation --seed 3 --set run.seed=4",
            "`run.seed` must be given once; got --seed 3 and --set run.seed=4. Leave one of them out.",
        ),
        (
            "infer aggregation --set run.seed=3 --set run={seed=4}",
            "`run.seed` must be given once; got --set run.seed=3 and --set run={'seed': 4}. Leave one of them out.",
        ),
        (
            "infer --config no.toml",
            "`config` must be a readable TOML file; got no.toml (No such file",
        ),
        (
            "infer aggregation --out /dev/null/run",
            "`out` must be a folder that can be written; got /dev/null/run",
        ),
        (
            "resume nothing",
            "`run` must be a run folder; got nothing without a readable manifest.json.",
        ),
        ("resume . --threads 0", "`threads` must be an integer of at least 1; got 0 [--threads]."),
        ("show .", "`run` must be a run folder; got ."),
        ("simulate aggregation --controller 1,2", "`controller` must be 4 finite numbers"),
        (
            "simulate aggregation --controller a,b",
            "`controller` must be numbers with commas between them; got 'a,b'",
        ),
        ("simulate aggregation --robots 0", "`robots` must be an integer from 1 to 1000; got 0."),
        ("simulate aggregation --duration nan", "`duration` must be a finite number above 0"),
        ("simulate aggregation --set scenario.agent=3", "Did you mean `scenario.agents`?"),
        ("simulate", "`SCENARIO` must be given, or a file with --config; got neither."),
        ("docs scenario", "`page` must be one of "),
        ("sample birds", "`sample` must be one of fish, swarm; got 'birds'."),
        (
            "simulate aggregation --out a.txt",
            "`out` must end with one of .html, .gif, .mp4; got a.txt.",
        ),
        (
            "simulate aggregation --robots 2.5",
            "Invalid value for --robots: must be an integer; got '2.5'.",
        ),
        (
            "simulate aggregation --duration x",
            "Invalid value for --duration: must be a number; got 'x'.",
        ),
        ("simulate aggregation --threads 0", "`threads` must be an integer of at least 1; got 0."),
        ("simulate aggregation --out no/a.gif", "got no/a.gif (there is no folder no)."),
        (
            "infer aggregation --set models.parents=1000000000 --out run",
            "`models.parents` must be smaller, as keeping the history between two checkpoints needs",
        ),
        ("nonsense", 'Unknown command "nonsense".'),
    ],
)
def test_what_is_wrong_is_said_in_one_line_with_exit_code_2(arguments, message, refused):
    assert message in refused(*arguments.split())


def test_nothing_is_overwritten_without_force(call, refused, tmp_path):
    arguments = ["infer", "aggregation", *SMALL, "--generations", 1, "--out", "run"]
    assert call(*arguments)[0] == 0
    assert "which holds a run. Resume it with `turing-learning resume run`" in refused(*arguments)
    assert call(*arguments, "--seed", 2, "--force")[0] == 0
    assert json.loads((tmp_path / "run" / "result.json").read_text())["seed"] == 2


def test_a_trial_is_written_and_not_overwritten(call, refused, tmp_path):
    arguments = ["simulate", "aggregation", "--robots", 3, "--duration", 2]
    assert call(*arguments)[:2] == (0, "aggregation.html\n")
    assert (tmp_path / "aggregation.html").stat().st_size > 1000
    assert "`out` must be a file that does not exist; got aggregation.html." in refused(*arguments)


def test_without_a_command_there_is_help_and_nothing_else(call):
    code, out, err = call()
    assert (code, err) == (2, "")
    assert "Usage: turing-learning" in out


@pytest.mark.parametrize(
    ("trouble", "said"),
    [
        (
            OSError(errno.ENOSPC, "No space left on device"),
            "error: what the command prints could not be written (No space left on device). Print elsewhere.",
        ),
        (
            OSError(errno.ENOSPC, "No space left on device", "mine.csv"),
            "error: no room is left for mine.csv (No space left on device). Make room, then ",
        ),
        (
            PermissionError(errno.EACCES, "Permission denied", "mine.csv"),
            "error: mine.csv cannot be used (Permission denied). Check that it is there, and that it may be read and ",
        ),
        (
            FileNotFoundError(errno.ENOENT, "No such file or directory", "mine.csv"),
            "error: mine.csv cannot be used (No such file or directory). Check that it is there",
        ),
        (
            MemoryError("Unable to allocate 9 GiB"),
            "error: this machine has not enough memory (Unable to allocate 9 GiB); ",
        ),
        (CustomSystemError("`simulate` must not fail"), "error: `simulate` must not fail\n"),
    ],
)
def test_what_the_machine_lacks_is_said_in_one_line_with_exit_code_1(
    trouble, said, call, monkeypatch
):
    import turing_learning.runs

    def broken(path):
        raise trouble

    monkeypatch.setattr(turing_learning.runs, "load_run", broken, raising=False)
    code, _, err = call("show", ".")
    assert code == 1
    assert err.startswith(said)
    assert err.count("\n") == 1


def test_the_papers_errors_have_a_column_where_there_are_some(call):
    from dataclasses import replace

    from turing_learning import load_run

    assert call("infer", "aggregation", *SMALL, "--generations", 1, "--out", "run")[0] == 0
    result = load_run("run")
    for errors, last in ((None, "error"), (dict.fromkeys(result.estimate, 0.01), "paper")):
        heading = str(replace(result, paper_absolute_error=errors)).splitlines()[1]
        assert heading.split()[-1] == last


def test_no_number_is_cut_off_on_a_narrow_terminal(call, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    code, out, _ = call("infer", "aggregation", *SMALL, "--generations", 1, "--out", "run")
    assert code == 0
    assert "…" not in out
    assert max(map(len, out.splitlines()[1:])) <= 40
    assert [heading in out for heading in ("estimate", "best model")] == [True] * 2


def test_a_terminal_of_80_columns_shows_each_estimate_beside_its_interval(call, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = call("infer", "aggregation", *SMALL, "--generations", 1, "--out", "run")
    assert code == 0
    (heading,) = (
        line
        for line in out.splitlines()
        if "estimate" in line and "90 %" in line and "true" in line
    )
    assert len(heading) <= 80
    assert "best model" in out


@pytest.mark.parametrize("columns", ["0", "-3", "1", "many", "9" * 30])
def test_a_width_that_is_none_is_not_taken_for_one(columns, call, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    assert "aggregation" in call("scenarios")[1]


def test_an_error_is_one_line_whatever_is_in_a_path(refused):
    assert refused("show", "a\nb\x1b[31m").startswith(
        r"`run` must be a run folder; got a\nb\x1b[31m without"
    )


@pytest.mark.usefixtures("wide")
def test_both_ends_of_an_interval_that_is_not_symmetric_are_in_the_table(call, tmp_path):
    assert call("infer", "aggregation", *SMALL, "--generations", 1, "--out", "run")[0] == 0
    content = json.loads((tmp_path / "run" / "result.json").read_text())
    content["interval"] = {name: [0.0, 21.46] for name in content["interval"]}
    RunFolder(tmp_path / "run").write("result.json", content)
    out = call("show", "run")[1]
    assert [re.split("  +", row)[2] for row in out.splitlines() if re.match(r"v[lr]\d ", row)] == [
        "0.000 to 21.460"
    ] * 4


@pytest.mark.parametrize("bug", [ZeroDivisionError, OSError("what no user can cause")])
def test_a_bug_is_not_hidden(bug, monkeypatch):
    import turing_learning.runs

    def broken(path):
        raise bug

    monkeypatch.setattr(turing_learning.runs, "load_run", broken, raising=False)
    with pytest.raises(type(bug) if isinstance(bug, OSError) else bug):
        main(["show", "."])


def test_help_does_not_import_what_is_slow():
    script = (
        "import sys\nfrom turing_learning.cli import main\n"
        "try: main(['infer', '--help'])\nexcept SystemExit: pass\n"
        "slow = {'numba', 'matplotlib', 'zarr', 'xarray', 'scipy', 'numpy'} & set(sys.modules)\n"
        "sys.exit(f'imported {slow}' if slow else 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_an_interruption_before_there_is_a_run_folder_names_none_to_go_on_with(
    call, tmp_path, monkeypatch
):
    def interrupt(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("turing_learning.runs.start", interrupt)
    code, _, err = call("infer", "aggregation", "--out", "run")
    assert (code, err) == (130, "interrupted before the run began\n")
    assert not (tmp_path / "run").exists()


def test_the_first_signal_ends_what_is_stored():
    from turing_learning.cli._stopping import Interrupted, stopping

    def stored():
        with stopping("resume") as should_stop:
            should_stop.at_once = True
            os.kill(os.getpid(), signal.SIGTERM)

    with pytest.raises(Interrupted, match=r"^interrupted; resume$"):
        stored()


@pytest.mark.usefixtures("few_kernels", "few_moves")
def test_the_first_signal_ends_only_what_has_no_new_trials(call, monkeypatch):
    small = ("--set", "scenario.agents=2", "--set", "scenario.trial.duration_s=1")
    assert call("infer", "aggregation", "--trials", "60", "--out", "run", *small)[0] == 0
    seen = []

    def begun(*arguments, should_stop, **options):
        seen.append(should_stop.at_once)
        raise KeyboardInterrupt

    monkeypatch.setattr("turing_learning.resume", begun)
    monkeypatch.setattr("turing_learning.runs.start", begun)
    call("resume", "run", "--trials", "80")
    call("infer", "aggregation", "--trials", "60", "--out", "run", "--force", *small)
    call("resume", "run")
    call("resume", "run", "--trials", "60")
    assert seen == [False, False, True, True]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_second_signal_stops_at_once(number):
    from turing_learning.cli._stopping import Interrupted, stopping

    def stopped_twice():
        with stopping("resume") as should_stop:
            assert not should_stop()
            os.kill(os.getpid(), number)
            assert should_stop()
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(number)
    with pytest.raises(Interrupted, match=r"^interrupted; resume$"):
        stopped_twice()
    assert signal.getsignal(number) is before
