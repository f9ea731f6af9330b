"""The zebrafish, in a fast form, and the tutorial on the same recording."""

import contextlib
import csv
import io
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from turing_learning.identifiability import Effort

ROOT = Path(__file__).parents[2]
TUTORIAL = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


@pytest.fixture
def zebrafish(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    import zebrafish

    return zebrafish


def test_both_families_try_to_pass_for_the_fish(zebrafish, tmp_path, monkeypatch):
    for folder in ("results", "images"):
        (tmp_path / folder).mkdir()
    least = zebrafish.Effort(samples=10, points=0)
    monkeypatch.setattr(zebrafish, "EFFORT", least)
    small = ["--generations", "4", "--population", "8"]
    zebrafish.main(["--out", str(tmp_path / "runs"), "--docs", str(tmp_path), *small])
    rows = list(
        csv.DictReader(
            (tmp_path / "results" / "zebrafish.csv").read_text(encoding="utf-8").splitlines()
        )
    )
    assert {row["family"] for row in rows} == {"burst-and-coast", "couzin"}
    assert all(
        0 <= float(row[name]) <= 1
        for row in rows
        for name in ("area", "control", "told", "accuracy", "p_value")
    )
    assert len(list((tmp_path / "images").glob("*.png"))) == 2


def test_a_stretch_with_everybody_is_found_or_its_lack_is_told(zebrafish):
    present = np.ones((10, 2), dtype=bool)
    present[3, 1] = False
    assert zebrafish.complete_stretch(present, 3) == 0
    assert zebrafish.complete_stretch(present, 6) == 4
    with pytest.raises(ValueError, match=r"`frames` must leave a stretch with everybody; got 7\."):
        zebrafish.complete_stretch(present, 7)


def test_the_tutorial_prints_what_it_shows(tmp_path, monkeypatch):
    shutil.copy(
        ROOT / "tests" / "reference" / "data" / "tracktor" / "zebrafish_video_idtracked.txt",
        tmp_path,
    )
    monkeypatch.chdir(tmp_path)
    parts = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", TUTORIAL, re.DOTALL)
    assert len(parts) == 6
    names = {}
    for block, shown in parts[:3]:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(block, names)  # noqa: S102 - our own page
        assert printed.getvalue() == shown
    least = "result.check(effort=Effort(samples=10, points=0), recoveries=0)"
    names["Effort"] = Effort
    for block, _ in parts[3:]:
        small = (
            block.replace("seed=1)", "seed=1, trials=20)")
            .replace("seed=seed)", "seed=seed, trials=20)")
            .replace("result.check()", least)
        )
        assert small != block
        with contextlib.redirect_stdout(io.StringIO()):
            exec(small, names)  # noqa: S102 - our own page
    assert len(names["runs"]) == 4
