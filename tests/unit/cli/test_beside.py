"""Commands beside runs: samples to try, pages of the documentation, compiling ahead; `simulate` with files and settings."""

import re

import pytest


@pytest.mark.parametrize("what", ["fish", "swarm"])
def test_a_sample_can_be_inferred_with_the_command_that_it_prints(
    call, tmp_path, monkeypatch, what
):
    monkeypatch.chdir(tmp_path)
    code, out, err = call("sample", what)
    assert code == 0, err
    command = re.search("Now: turing-learning (.*)", out)[1].split()
    few = [
        "--set",
        "models.population=8",
        "--set",
        "classifiers.population=8",
        "--generations",
        "1",
        "--threads",
        "1",
    ]
    code, out, err = call(*command, *few, "--out", "run")
    assert code == 0, err
    assert "report: run/report.html" in out
    assert call("sample", what)[0] == 2  # replaces nothing
    assert call("sample", what, "--force")[0] == 0


def test_the_swarm_of_the_sample_is_that_of_the_scenario(call, tmp_path, monkeypatch):
    import turing_learning as tl

    monkeypatch.chdir(tmp_path)
    call("sample", "swarm")
    recording = tl.load_trajectories("swarm.csv", fps=10, pixels_per_cm=1, y_axis="up")
    assert len(recording.individuals) == 11
    assert recording.headings is not None
    spread = recording.positions.std(axis=1).mean(axis=-1)
    assert spread[-1] < spread[0]  # it gathers


def test_pages_of_the_documentation_are_listed_and_printed(call):
    code, out, _ = call("docs")
    assert code == 0
    names = [line.split()[0] for line in out.splitlines()]
    assert {"scenarios", "own-system", "robots/laboratory", "examples/zebrafish"} <= set(names)
    assert call("docs", "scenarios")[1] == call("docs", "docs/scenarios.md")[1]
    assert call("docs", "scenarios")[1].startswith("# ")


def test_help_names_pages_that_there_are(call):
    listed = {line.split()[0] for line in call("docs")[1].splitlines()}
    commands = ["infer", "simulate", "check", "detect", "study", "resume", "arena", "reproduce"]
    texts = [call(name, "--help")[1] for name in commands] + [call("robots", "run", "--help")[1]]
    named = {
        page
        for text in texts
        for page in re.findall(r"turing-learning docs ([\w/-]+)", " ".join(text.split()))
    }
    assert len(named) > 3
    assert named <= listed
    assert not [text for text in texts if re.search(r"docs/[\w/-]+\.md", text)]


def test_simulate_takes_a_file_and_settings(call, tmp_path):
    file, page = tmp_path / "mine.toml", tmp_path / "page.html"
    file.write_text(
        '[scenario]\nname = "aggregation"\nagents = 3\nreplicas = 1\ntitle = "Three of mine"\n'
    )
    options = ["--duration", "1", "--out", page, "--force"]
    assert call("simulate", "--config", file, *options)[0] == 0
    assert "Three of mine" in page.read_text()
    assert call("simulate", "--config", file, "--set", "scenario.title=Others", *options)[0] == 0
    assert "Others" in page.read_text()


def test_warming_up_runs_each_kind_once_and_leaves_nothing(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = ["a swarm", "a field of view", "networks", "a crowd", "a budget in trials", "ready"]
    code, out, _ = call("warm-up")
    assert (code, out.splitlines()) == (0, said)
    assert not list(tmp_path.iterdir())
