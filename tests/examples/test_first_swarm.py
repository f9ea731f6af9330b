"""The tutorial "your first swarm" and the snippets of the README, as they stand there, in a fast form."""

import re
from pathlib import Path

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.cli import main
from turing_learning.identifiability import Effort

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "first-swarm.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
FEW = {"trials": 20, "threads": 1}
FAST = {
    "infer": [f"--{name}={value}" for name, value in FEW.items()],
    "check": ["--samples=12", "--points=0", "--recoveries=0"],
}


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def test_the_commands_of_the_tutorial_run_in_their_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (file,) = blocks(PAGE, "toml")
    (tmp_path / "five.toml").write_text(file, encoding="utf-8")
    commands = re.findall(r"^    turing-learning (.+)$", PAGE, re.MULTILINE)
    assert [line.split()[0] for line in commands] == [
        "infer",
        "check",
        "infer",
        "infer",
        "infer",
        "pool",
        "infer",
    ]
    for line in commands:
        verb, *rest = line.split()
        with pytest.raises(SystemExit) as ended:
            main([verb, *rest, *FAST.get(verb, [])])
        assert ended.value.code in (0, None), capsys.readouterr().err
    assert (tmp_path / "runs" / "seed-1" / "report.html").exists()
    assert list(tl.load_run("runs/five").truth.values()) == [-0.6, -0.9, 0.9, -0.9]


@pytest.fixture
def short(monkeypatch):
    """Give every run few trials, whatever the page asks for."""
    infer = tl.infer
    monkeypatch.setattr(tl, "infer", lambda *given, **options: infer(*given, **options | FEW))


def test_the_python_of_the_tutorial_runs(tmp_path, monkeypatch, short):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "five.toml").write_text(blocks(PAGE, "toml")[0], encoding="utf-8")
    (block,) = blocks(PAGE, "python")
    small = block.replace("check()", "check(effort=Effort(samples=12, points=0), recoveries=0)")
    names = {"Effort": Effort}
    exec(small, names)  # noqa: S102 - our own page
    assert set(names["five"].estimate) == {"vl0", "vr0", "vl1", "vr1"}


def test_the_snippets_of_the_readme_run(tmp_path, monkeypatch, short):
    monkeypatch.chdir(tmp_path)

    def my_model(parameters, rng):
        return parameters[:, None, :] + rng.standard_normal((len(parameters), 20, 2))

    samples = my_model(np.array([[6.0, 1.0]] * 30), np.random.default_rng(1))
    names = {"samples": samples, "my_model": my_model}
    for block in blocks(README, "python"):
        exec(block, names)  # noqa: S102 - our own page
    assert (tmp_path / "report.html").exists()
    assert names["motion"].speeds.shape == (5, 21, 100, 2)
