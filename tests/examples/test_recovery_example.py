"""The recovery of known parameters, in a fast form, and its table."""

import csv
import re
import shutil
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
    monkeypatch.setattr(recovery, "SEEDS", 2)
    monkeypatch.setattr(sys.modules["identifiability"], "GROUPS", 90)
    return recovery


def run(recovery, monkeypatch, folder, recordings):
    for part in ("results", "images"):
        (folder / part).mkdir(exist_ok=True)
    monkeypatch.setattr(
        "sys.argv",
        [
            "recovery.py",
            "--recordings",
            str(recordings),
            "--docs",
            str(folder),
            "--work",
            str(folder / "work"),
        ],
    )
    recovery.main()
    assert (folder / "images" / "recovery-pools.png").exists()
    return recovery.read(folder / "results" / "recovery-pools.csv")


def test_a_second_call_does_only_what_is_missing(recovery, monkeypatch, tmp_path):
    first = run(recovery, monkeypatch, tmp_path, 1)
    done = []
    recover = recovery.recover
    monkeypatch.setattr(recovery, "recover", lambda *case: done.append(case[1]) or recover(*case))
    second = run(recovery, monkeypatch, tmp_path, 2)
    assert done == [2]
    assert second[: len(first)] == first
    assert {row.recording for row in second} == {1, 2}


def test_what_was_stopped_goes_on_with_the_run_that_is_missing(recovery, monkeypatch, tmp_path):
    case = recovery.CASES["burst-and-coast"]
    whole = recovery.recover("burst-and-coast", 1, case, tmp_path)
    shutil.rmtree(tmp_path / "burst-and-coast-1-seed102")
    done = []
    infer = recovery.tl.infer
    monkeypatch.setattr(
        recovery.tl, "infer", lambda **given: done.append(given["seed"]) or infer(**given)
    )
    again = recovery.recover("burst-and-coast", 1, case, tmp_path)
    assert done == [102]
    assert [replace(row, seconds=0) for row in again] == [replace(row, seconds=0) for row in whole]


def test_a_row_is_the_pool_of_the_runs_on_one_recording(recovery, tmp_path):
    rows = recovery.recover("burst-and-coast", 1, recovery.CASES["burst-and-coast"], tmp_path)
    runs = [recovery.tl.load_run(tmp_path / f"burst-and-coast-1-seed{seed}") for seed in (101, 102)]
    pooled = recovery.tl.pool(runs)
    for row in rows:
        assert (row.low, row.high) == pytest.approx(pooled.interval[row.parameter], rel=1e-4)
        assert list(map(float, row.estimates.split())) == pytest.approx(
            pooled.estimates[row.parameter], rel=1e-4
        )
        held = [
            low <= row.truth <= high for low, high in (run.wandering[row.parameter] for run in runs)
        ]
        assert (row.runs, row.held_alone) == (2, sum(held))


def test_the_summary_counts_the_intervals_that_hold_the_truth(recovery, monkeypatch, tmp_path):
    rows = run(recovery, monkeypatch, tmp_path, 2)
    for summary in recovery.summarize(rows):
        own = [row for row in rows if row.parameter == summary.parameter]
        assert summary.held == sum(row.low <= row.truth <= row.high for row in own)
        assert (summary.recordings, summary.runs) == (2, 4)


def test_intervals_that_are_not_known_hold_nothing_and_are_counted(recovery, tmp_path):
    nan = float("nan")
    known = recovery.Row(
        "burst-and-coast", 1, "speed", "cm/s", 12.0, 12.5, 11.0, 14.0, 1.5, "12 13", 1, 1.0
    )
    lost = replace(known, recording=2, low=nan, high=nan, r_hat=nan, held_alone=0, unknown_alone=2)
    assert (known.held, known.unknown, lost.held, lost.unknown) == (True, False, False, True)
    recovery.write(tmp_path / "rows.csv", [known, lost])
    assert "nan" not in (tmp_path / "rows.csv").read_text()
    read = recovery.read(tmp_path / "rows.csv")
    assert read[0] == known
    assert (read[1].unknown, read[1].unknown_alone, np.isnan(read[1].r_hat)) == (True, 2, True)
    all_parameters = [
        replace(row, parameter=key)
        for row in read
        for key in recovery.CASES["burst-and-coast"].truth
    ]
    summary = next(recovery.summarize(all_parameters))
    assert (summary.held, summary.unknown, summary.held_alone, summary.unknown_alone) == (
        1,
        1,
        1,
        2,
    )
    assert (summary.median_r_hat, summary.runs, summary.recordings) == (1.5, 4, 2)
    assert summary.median_half_width == 1.5 / 40  # of the known one


def test_a_table_from_before_unknown_intervals_were_counted_is_read(recovery):
    rows = recovery.read(TABLES / "recovery-pools.csv")
    assert {row.unknown_alone for row in rows} == {0}
    assert not any(row.unknown for row in rows)


def test_a_parameter_without_a_trace_is_not_identifiable(recovery):
    walk = BurstAndCoast(individuals=1, steps=30)
    truth = {"speed": 12, "kick_interval": 1, "glide_time": 0.4, "turn": 0.5}
    errors = sys.modules["identifiability"].least_errors(walk, truth, 100)
    blind = sys.modules["identifiability"].least_errors(
        replace(walk, signals=("speed",)), truth, 100
    )
    assert errors["turn"] < 0.02
    assert blind["turn"] == pytest.approx(
        np.sqrt(1 / 12), rel=0.1
    )  # the straightened chords of turns within a step show a little


def test_the_table_on_the_page_is_a_part_of_the_summary(recovery):
    summary, page = (
        list(
            csv.DictReader(
                (TABLES / f"recovery-pools-{name}.csv").read_text(encoding="utf-8").splitlines()
            )
        )
        for name in ("summary", "page")
    )
    assert page == [
        {heading: row[name] for heading, name in recovery.SHOWN.items()} for row in summary
    ]


def test_the_committed_summary_is_that_of_the_committed_table():
    rows, summaries = (
        list(csv.DictReader((TABLES / name).read_text(encoding="utf-8").splitlines()))
        for name in ("recovery-pools.csv", "recovery-pools-summary.csv")
    )
    for summary in summaries:
        own = [
            row
            for row in rows
            if (row["family"], row["parameter"]) == (summary["family"], summary["parameter"])
        ]
        held = sum(float(row["low"]) <= float(row["truth"]) <= float(row["high"]) for row in own)
        assert (len(own), held) == (int(summary["recordings"]), int(summary["held"]))
    assert {row["family"] for row in rows} == {summary["family"] for summary in summaries}


def test_what_limits_says_of_a_walk_before_any_run_is_printed(recovery, capsys):
    page = (TABLES.parent / "limits.md").read_text(encoding="utf-8")
    ((block, shown),) = re.findall(r"```python\n(.*?)```\n\n```text\n(.*?)```", page, re.DOTALL)
    sys.modules[
        "identifiability"
    ].GROUPS = 400  # as it is in the file; the fixture has set it lower
    exec(block, {})  # noqa: S102 - our own page
    assert capsys.readouterr().out == shown
