"""The recovery of known parameters, in a fast form, and its table."""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from turing_learning.families import BurstAndCoast

ROOT = Path(__file__).parents[2]
TABLES = ROOT / "docs" / "results"


@pytest.fixture
def recovery(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    import recovery

    fast = replace(recovery.CASES["burst-and-coast"], generations=4, population=8)
    monkeypatch.setattr(recovery, "CASES", {"burst-and-coast": fast})
    monkeypatch.setattr(sys.modules["identifiability"], "GROUPS", 90)
    return recovery


def run(recovery, monkeypatch, folder, runs):
    for part in ("results", "images"):
        (folder / part).mkdir(exist_ok=True)
    monkeypatch.setattr("sys.argv", ["recovery.py", "--runs", str(runs), "--docs", str(folder)])
    recovery.main()
    assert (folder / "images" / "recovery.png").exists()
    return recovery.read(folder / "results" / "recovery-runs.csv")


def test_a_second_call_does_only_what_is_missing(recovery, monkeypatch, tmp_path):
    first = run(recovery, monkeypatch, tmp_path, 1)
    done = []
    recover = recovery.recover
    monkeypatch.setattr(recovery, "recover", lambda *case: done.append(case[1]) or recover(*case))
    second = run(recovery, monkeypatch, tmp_path, 2)
    assert done == [2]
    assert second[: len(first)] == first
    assert {row.run for row in second} == {1, 2}


def test_the_summary_counts_the_intervals_that_hold_the_truth(recovery, monkeypatch, tmp_path):
    rows = run(recovery, monkeypatch, tmp_path, 2)
    for summary in recovery.summarize(rows):
        own = [row for row in rows if row.parameter == summary.parameter]
        assert summary.held == sum(row.low <= row.truth <= row.high for row in own)
        assert summary.runs == 2


def test_a_parameter_without_a_trace_is_not_identifiable(recovery):
    walk = BurstAndCoast(individuals=1, steps=30)
    truth = {"speed": 12, "kick_interval": 1, "glide_time": 0.4, "turn": 0.5}
    errors = sys.modules["identifiability"].least_errors(walk, truth, 100)
    blind = sys.modules["identifiability"].least_errors(replace(walk, signals=("speed",)), truth, 100)
    assert errors["turn"] < 0.02
    assert blind["turn"] == pytest.approx(
        np.sqrt(1 / 12), rel=0.1
    )  # the straightened chords of turns within a step show a little


def test_the_committed_summary_is_that_of_the_committed_runs():
    rows = list(csv.DictReader((TABLES / "recovery-runs.csv").read_text(encoding="utf-8").splitlines()))
    summaries = list(csv.DictReader((TABLES / "recovery-summary.csv").read_text(encoding="utf-8").splitlines()))
    for summary in summaries:
        own = [row for row in rows if (row["family"], row["parameter"]) == (summary["family"], summary["parameter"])]
        held = sum(float(row["low"]) <= float(row["truth"]) <= float(row["high"]) for row in own)
        assert (len(own), held) == (int(summary["runs"]), int(summary["held"]))
    assert {row["family"] for row in rows} == {summary["family"] for summary in summaries}
