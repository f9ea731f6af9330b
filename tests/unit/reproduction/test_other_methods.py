"""Likelihood-free inference beside Turing Learning: what is counted, and what is said when packages are missing."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.reproduction import reproduce
from turing_learning.reproduction._experiment import Findings, Shown, Work
from turing_learning.reproduction._methods import (
    Groups,
    Inferred,
    fit_mixture,
    infer_by_abc_smc,
    infer_by_npe,
    summaries,
)
from turing_learning.reproduction._page import ExperimentFolder, page, readme
from turing_learning.reproduction._reproduce import possible_experiments, standings
from turing_learning.reproduction.experiments import EXPERIMENTS
from turing_learning.reproduction.experiments.other_methods import (
    METHODS,
    as_json,
    conduct_comparison,
    remarks,
    runs_frame,
    summary_frame,
)
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING

ID = "4.5+"
TRUTH = np.array(AGGREGATION.controller)


def outcome(method, trials, error, seconds=1.0, intervals=None):
    """What two runs have found, each off by `error` in every parameter; `intervals` (2, 2, 4) are their ends."""
    inside = [(None, None) if method == "mixture" else (TRUTH - 1, TRUTH + 1)] * 2
    ends = inside if intervals is None else intervals
    found = [as_json(Inferred(TRUTH + error, low, high), seconds) for low, high in ends]
    return {(method, trials): found}


def summary_of(*outcomes):
    found = {key: pieces for one in outcomes for key, pieces in one.items()}
    return summary_frame(AGGREGATION, runs_frame(AGGREGATION, found, range(2)))


@pytest.fixture
def without_packages(monkeypatch):
    monkeypatch.setattr("turing_learning.reproduction._experiment.find_spec", lambda name: None)


@pytest.fixture
def folder(tmp_path):
    """An experiment that has left a table and a remark."""
    from matplotlib.figure import Figure

    folder, findings = ExperimentFolder(tmp_path / ID), Findings(ID, remarks=["Who wins."])
    folder.begin(EXPERIMENTS[ID], fast=False)
    frame = pd.DataFrame({"method": ["NPE"], "trials": 1000, "MAE": 0.123456})
    findings.tables.append((0, Shown("errors", "Errors", inline=True), frame))
    findings.pictures.append((Shown("one", "A picture"), Figure()))
    folder.write(findings, fast=False, seconds=1)
    return folder


def test_errors_and_coverage_are_over_seeds_and_parameters():
    low, high = TRUTH - 0.1, TRUTH + 0.1
    inside = np.array([[low, high], [low, high]])
    inside[0, 1, :2] = -2.0
    found = summary_of(
        outcome("npe", 1000, 0.25, 2.0, inside), outcome("mixture", 10, 0.1)
    ).set_index("method")
    assert found.loc["NPE", ["MAE", "coverage", "processor_s"]].tolist() == pytest.approx(
        [0.25, 6 / 8, 2.0]
    )
    assert found.loc["mixture", ["coverage", "width"]].isna().all()


def test_an_interval_that_is_not_known_holds_nothing_and_is_counted():
    ends = np.array([[TRUTH - 0.1, TRUTH + 0.1]] * 2)
    ends[1, :, :3] = np.nan
    found = summary_of(
        outcome("turing-learning", 1000, 0.25, intervals=ends), outcome("mixture", 10, 0.1)
    )
    assert found.loc[0, ["coverage", "unknown", "width"]].tolist() == pytest.approx([5 / 8, 3, 0.2])
    assert "Turing Learning 3 with 1,000 trials" in remarks("Aggregation", found)[-1]
    nowhere = np.full((2, 2, 4), np.nan)
    assert (
        summary_of(outcome("turing-learning", 1000, 0.25, intervals=nowhere))
        .loc[0, ["width"]]
        .isna()
        .all()
    )


def test_what_is_not_known_is_null_in_a_piece_and_empty_in_the_table():
    inferred = Inferred(TRUTH, np.array([np.nan, 0.0, 0.0, 0.0]), np.array([np.nan, 1.0, 1.0, 1.0]))
    piece = json.loads(json.dumps(as_json(inferred, 2.0), allow_nan=False))
    assert (piece["low"], piece["high"]) == ([None, 0.0, 0.0, 0.0], [None, 1.0, 1.0, 1.0])
    found = runs_frame(AGGREGATION, {("turing-learning", 1000): [piece]}, (1,))
    for end in ("low", "high"):
        np.testing.assert_array_equal(
            found.filter(regex=f"^{end}_").to_numpy()[0], getattr(inferred, end)
        )
    table = found.drop(columns="processor_s").to_csv(index=False, float_format="%.6g")
    assert table.splitlines()[1].endswith(",0,,,0,1,0,1,0,1")


def test_it_is_said_who_is_more_accurate_and_where_the_others_win():
    found = summary_of(
        outcome("turing-learning", 100, 0.3, 2.0), outcome("turing-learning", 1000, 0.01, 20.0),
        outcome("npe", 100, 0.2, 5.0), outcome("npe", 1000, 0.05, 50.0), outcome("mixture", 10, 0.001, 0.5),
    )  # fmt: skip
    first, second, wins = remarks("Aggregation", found)
    assert first.index("NPE 0.2000") < first.index("Turing Learning 0.3000")
    assert second.index("Turing Learning 0.0100") < second.index("NPE 0.0500")
    assert (
        "NPE with 100 simulated trials has a smaller median error (0.2000, 0.3000) than Turing Learning"
        in wins
    )
    assert "NPE with 1,000" not in wins
    assert (
        "mixture with 10 observed trials has a smaller median error (0.0010, 0.0100) and less time (0.5 s, 20.0 s)"
        in wins
    )
    assert "than Turing Learning with 1,000" in wins


def test_a_method_that_wins_nowhere_is_not_praised():
    found = summary_of(outcome("turing-learning", 100, 0.1, 1.0), outcome("mixture", 10, 0.2, 2.0))
    assert remarks("Aggregation", found)[-1] == "**Where the others win, aggregation:** nowhere."


def test_trials_that_do_not_make_whole_groups_and_generations_are_refused(tmp_path):
    work = Work(tmp_path, EXPERIMENTS[ID].full | {"trials": [150]})
    with pytest.raises(ValueError, match=r"`trials` must be multiples of 10 and 100; got \[150\]"):
        conduct_comparison(work, Findings(ID))


@pytest.mark.usefixtures("without_packages")
def test_by_name_it_is_refused_without_its_packages_before_anything_is_done(tmp_path):
    with pytest.raises(
        ConfigurationError,
        match=r"got 4\.5\+, which needs pyabc, sbi, sklearn\. Run: pip install 'turing-lea",
    ):
        reproduce(ID, fast=True, out=tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("without_packages")
def test_of_all_it_is_left_out_without_its_packages_and_that_is_said():
    said = []
    left = possible_experiments("all", said.append)
    assert [one.id for one in left] == [
        name for name, one in EXPERIMENTS.items() if not one.packages
    ]
    assert said == [
        "4.5+: left out, it needs pyabc, sbi, sklearn. Run: pip install 'turing-learning[baselines]'",
        "5: left out, it needs cv2, serial. Run: pip install 'turing-learning[robot,vision]'",
    ]


def test_its_page_tells_conditions_and_remarks_and_shows_its_table(folder):
    text = readme(EXPERIMENTS[ID], folder)
    assert "## Conditions\n\n* A trial is the paper's" in text
    assert "## What came out\n\n* Who wins.\n\n![one](figures/one.svg)" in text
    assert "| method | trials | MAE |\n| --- | --- | --- |\n| NPE | 1000 | 0.123 |\n" in text
    assert "What the paper prints" not in text


def test_the_page_of_all_claims_has_its_picture(folder):
    text = page(folder.path.parent, "there")
    assert "![one](there/4.5+/figures/one.svg)" in text


def test_without_claims_an_experiment_is_finished(folder):
    states = {one.experiment.id: one.state for one in standings(folder.path.parent)}
    assert states[ID] == "finished"


def test_a_mixture_finds_the_levels_of_the_wheels():
    pytest.importorskip("sklearn")
    genuine = Groups(OBJECT_CLUSTERING).observe(40, np.random.default_rng(1))
    found = fit_mixture(genuine, OBJECT_CLUSTERING, seed=1)
    # wheel noise has a standard deviation of 0.03; the rarest state has about 1500 of the 16000 cycles
    np.testing.assert_allclose(found.estimate, OBJECT_CLUSTERING.controller, atol=0.02)
    assert found.low is None


STILL = replace(
    AGGREGATION,
    agents=2,
    controller=(0.4, 0.4, 0.4, 0.4),
    trial=replace(AGGREGATION.trial, duration_s=2.0),
)
"""Two agents that do the same whatever they see: only the first two parameters, nearly always, show."""


@pytest.fixture(scope="module")
def still():
    groups = Groups(STILL, size=1)
    return groups, summaries(groups.observe(50, np.random.default_rng(1)), STILL)


def test_abc_smc_comes_near_and_leaves_global_random_numbers_alone(still):
    pytest.importorskip("pyabc")
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    found = infer_by_abc_smc(*still, 600, seed=1)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002
    np.testing.assert_allclose(found.estimate[:2], 0.4, atol=0.3)
    assert (found.low[:2] < 0.4).all()
    assert (found.high[:2] > 0.4).all()


def test_abc_smc_gives_the_same_for_the_same_seed(still):
    pytest.importorskip("pyabc")
    first, second = (infer_by_abc_smc(*still, 120, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.estimate, second.estimate)


def test_abc_smc_can_be_stopped_and_refuses_too_few_models(still):
    pytest.importorskip("pyabc")
    assert infer_by_abc_smc(*still, 120, 1, should_stop=lambda: True) is None
    with pytest.raises(
        ValueError, match="`evaluations` must be an integer of at least 100; got 99"
    ):
        infer_by_abc_smc(*still, 99, 1)


@pytest.mark.parametrize("rounds", [1, 2])
def test_a_neural_posterior_comes_near_says_nothing_and_writes_nothing(
    still, rounds, tmp_path, monkeypatch, capfd
):
    pytest.importorskip("sbi")
    monkeypatch.chdir(tmp_path)
    found = infer_by_npe(*still, 400, seed=1, rounds=rounds)
    np.testing.assert_allclose(found.estimate[:2], 0.4, atol=0.3)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_a_neural_posterior_can_be_stopped_and_refuses_too_few_models(still):
    pytest.importorskip("sbi")
    assert infer_by_npe(*still, 100, 1, should_stop=lambda: True) is None
    with pytest.raises(
        ValueError,
        match="`evaluations` must be at least 20 in each of 1 or more rounds; got 30 in 2",
    ):
        infer_by_npe(*still, 30, 1, rounds=2)


@pytest.mark.skipif(bool(EXPERIMENTS[ID].missing), reason="needs the extra baselines")
def test_every_method_is_in_the_tables_of_the_fast_form(rows):
    for scenario in ("aggregation", "object-clustering"):
        assert [row["method"] for row in rows(ID, scenario)] == list(METHODS.values())
