from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.analysis import UNKNOWN, WHY_UNKNOWN, Verdict
from turing_learning.runs._plots import replay
from turing_learning.runs._report import run_table, summary


@pytest.fixture(scope="module")
def result(small):
    return tl.infer(config=small(generations=2))


def test_the_replay_shows_agents_beside_replicas_from_common_initial_poses(small):
    shown = replay(small(), np.array([0.0, 0.0, 0.0, 0.0]))
    agents, replicas = shown.swarms
    assert agents.robots == replicas.robots == small().swarm.individuals
    assert not agents.is_replica.any()
    assert replicas.is_replica.all()
    np.testing.assert_array_equal(agents.poses[0], replicas.poses[0])
    assert (shown.duration_s, shown.interval_s) == (pytest.approx(180.0), pytest.approx(0.2))
    moved = np.linalg.norm(np.diff(replicas.poses[:, :, :2], axis=0), axis=2)
    assert np.count_nonzero(moved) < np.count_nonzero(np.diff(agents.poses[:, :, :2], axis=0))


def test_a_replay_where_nobody_knows_the_agents_shows_replicas_alone(small):
    known = small()
    unknown = known.model_copy(update={"scenario": replace(known.scenario, known=False)})
    shown = replay(unknown, np.array([0.5, 0.5, 0.5, 0.5]))
    assert [swarm.label for swarm in shown.swarms] == ["Replicas of the inferred model"]
    assert shown.swarms[0].replica_mask.all()
    beside = replay(known, np.array([0.5, 0.5, 0.5, 0.5]))
    np.testing.assert_array_equal(shown.swarms[0].poses[0], beside.swarms[1].poses[0])
    assert np.linalg.norm(shown.swarms[0].poses[-1] - shown.swarms[0].poses[0], axis=1).max() > 1


def test_a_replay_of_a_model_that_has_run_away_is_still_finite(small):
    shown = replay(small(), np.full(4, 1e12))
    assert np.isfinite(shown.swarms[1].poses).all()


def test_the_summary_names_the_mean_error_and_whether_the_run_is_complete(result):
    assert summary(result) == (
        f"After 2 generations the estimate differs from the truth by {result.estimate_mae:.4f} "
        "in the mean over all parameters."
    )


def test_an_interval_that_is_not_known_is_explained_below_the_table(result):
    known = {key: [0.25, 0.75] for key in result.interval}
    assert "unknown" not in run_table(replace(result, interval=known)).note
    half = known | {"vr0": [UNKNOWN, UNKNOWN]}
    table = run_table(replace(result, interval=half, found=(Verdict.CONVERGED,)))
    assert table.note == f"The 90 % interval is unknown for vr0: {WHY_UNKNOWN}."
    of_trials = SimpleNamespace(
        interval=half,
        found=(Verdict.DIFFERENT,),
        configuration=SimpleNamespace(run=SimpleNamespace(trials=60)),
    )
    why = type(result).unknown.fget(of_trials)
    assert "run more trials" in why
    assert "generations" not in why
    assert column(table, "90 % interval") == [
        "0.2500 to 0.7500",
        None,
        "0.2500 to 0.7500",
        "0.2500 to 0.7500",
    ]


def column(table, heading):
    return [row[table.columns.index(heading)] for row in table.rows]


def test_the_table_holds_the_papers_figures_and_their_source(result):
    assert "Paper\u2019s error" not in run_table(result).columns  # not the paper's number of agents
    papers = dict(zip(result.estimate, [0.01, 0.01, 0.07, 0.06], strict=True))
    table = run_table(replace(result, paper_absolute_error=papers))
    assert table.columns == [
        "Parameter", "Inferred", "90 % interval", "True", "Absolute error", "Paper\u2019s error", "Best model",
        "Absolute error",
    ]  # fmt: skip
    assert column(table, "Paper\u2019s error") == ["0.01", "0.01", "0.07", "0.06"]
    assert column(table, "True") == [-0.7, -1.0, 1.0, -1.0]
    assert table.foot == ["Mean", "", "", "", result.estimate_mae, "", "", result.mae]
    assert "sections 4.3, 4.6.1, 5.4" in table.note


def test_without_truth_the_table_shows_what_was_inferred(result):
    unknown = dict.fromkeys(
        ("truth", "absolute_error", "estimate_absolute_error", "mae", "estimate_mae")
    )
    table = run_table(replace(result, **unknown))
    assert table.columns == ["Parameter", "Inferred", "90 % interval", "Best model"]
    assert not table.foot


def test_a_run_whose_selection_stopped_says_when(result, tmp_path, monkeypatch):
    history = result.history.load()
    history["selection"][:] = [0, 2]
    monkeypatch.setattr(type(result), "history", history)
    page = result.report(tmp_path / "page.html").read_text()
    assert "health warning" in page
    assert (
        "Selection stopped in 1 of 2 generations: 1 (all rejected). Many of them near the end"
        in page
    )
