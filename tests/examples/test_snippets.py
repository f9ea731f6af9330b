"""Python of pages that no other test runs, as it stands there: runs, studies and checks are made short."""

import re
import sys
import types
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.families import Couzin
from turing_learning.identifiability import Effort
from turing_learning.runs import Result

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")
DOCS = Path(__file__).parents[2] / "docs"
FEW = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


def blocks(page):
    return re.findall(r"```python\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture(autouse=True)
def short(tmp_path, monkeypatch):
    """Make what is called short, whatever the page asks for; and work in an empty folder."""
    infer, study, check = tl.infer, tl.study, Result.check
    quick = {"effort": Effort(samples=12, points=0), "recoveries": 0}

    def shortened(options):
        shorter = {"trials": 20} if "trials" in options else {"generations": 2}
        return options | shorter | {"settings": options.get("settings", {}) | FEW}

    monkeypatch.setattr(tl, "infer", lambda *given, **options: infer(*given, **shortened(options)))

    def study_here(*given, **options):
        options.pop("workers", None)
        with ThreadPoolExecutor(1) as executor:
            return study(*given, **shortened(options) | {"runs": 2, "executor": executor})

    monkeypatch.setattr(tl, "study", study_here)
    monkeypatch.setattr(Result, "check", lambda self, **options: check(self, **options | quick))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)


def run(block, names=None):
    names = {"tl": tl, "np": np} | (names or {})
    exec(block, names)  # noqa: S102 - our own pages
    return names


def test_a_budget_in_trials():
    (block,) = blocks("few-trials.md")
    block = block.replace("seed=1", 'seed=1, settings={"scenario.trial.duration_s": 1.0}')
    assert run(block)["result"].trials >= 20


def test_a_check():
    result = tl.infer("aggregation", seed=1)
    found = run(blocks("identifiability.md")[0], {"result": result})["found"]
    assert found.not_pinned_down == ("vl0", "vr0", "vl1", "vr1")


def test_a_custom_system_is_resumed_and_pooled(monkeypatch):
    first, resumed, pooled = blocks("own-system.md")
    module = types.ModuleType("walkers")
    monkeypatch.setitem(sys.modules, "walkers", module)
    exec(first, module.__dict__)  # noqa: S102 - our own page
    names = dict(module.__dict__)
    options = {
        "genuine": names["recorded"],
        "simulate": module.walk,
        "parameters": {"speed": (0, 20), "turn_noise": (0, 3)},
    }
    tl.infer(**options, out="runs/walk", should_stop=lambda: True)
    assert not tl.load_run("runs/walk").complete
    run(resumed, names)
    assert tl.load_run("runs/walk").complete
    assert len(run(pooled, names)["runs"]) == 4


def test_settings():
    (block,) = blocks("settings.md")
    run(block)


def test_studies(tmp_path):
    custom, grid = blocks("studies.md")
    (tmp_path / "my_fish.py").write_text(
        "def walk(parameters, rng):\n    return parameters[:, :1, None] + rng.random((len(parameters), 20, 1))\n"
    )
    samples = 6 + np.random.default_rng(1).random((20, 20, 1))
    run(custom, {"samples": samples})
    result = run(grid)["result"]
    assert len(result.groups) == 2


def test_recordings(tmp_path):
    one, several = blocks("trajectories.md")
    tank = Couzin(individuals=5, steps=1500, interval_s=0.04, tank_cm=(40, 30))
    middle = {name: (each.low + each.high) / 2 for name, each in tank.parameters.items()}
    for day in (".", "monday", "tuesday", "friday"):
        positions = tank.simulate(
            np.array([list(middle.values())]), np.random.default_rng(len(day))
        )[0]
        rows = np.insert(
            12.3 * positions.reshape(len(positions), 10) + 4000, [2, 4, 6, 8, 10], 1.0, axis=1
        )
        header = "\t".join(f"X{k}\tY{k}\tProbId{k}" for k in range(1, 6))
        (tmp_path / day).mkdir(exist_ok=True)
        np.savetxt(f"{day}/fish.txt", rows, fmt="%.3f", delimiter="\t", header=header, comments="")
    names = run(one)
    assert names["windows"].learning.shape[1:] == (50, 2)
    assert set(run(several, names)["result"].estimate) == set(tank.parameters)


def test_the_emulated_arena():
    (block,) = blocks("robots/arena.md")
    assert run(block)["track"].speeds().shape[1:] == (50, 2)
