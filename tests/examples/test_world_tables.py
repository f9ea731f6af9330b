"""The tables of experiments/worlds, in a fast form."""

import csv
import importlib
from pathlib import Path

import numpy as np
import pytest

from turing_learning.swarm import SCENARIOS

HERE = Path(__file__).parents[2] / "experiments" / "worlds"


@pytest.fixture
def script(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module


def rows(name):
    with (HERE / name).open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("world", [("aggregation", 9.81, 1), ("object-clustering", 981.0, 1)])
def test_a_few_trials_give_the_shares_of_the_table(script, monkeypatch, world):
    name, gravity, lag = world
    shares = script("shares")
    monkeypatch.setattr(shares, "DURATIONS_S", (10, 20))
    monkeypatch.setattr(shares, "TRIALS", 40)
    found = shares.shares_of(shares.changed(SCENARIOS[name], gravity, lag), seed=3)
    known = {
        int(row["duration_s"]): [float(row[f"share_{state}"]) for state in range(3)]
        for row in rows("shares.csv")
        if (row["scenario"], float(row["gravity_cm_s2"]), int(row["lag_cycles"])) == world
    }
    error = found.std(axis=0, ddof=1) / np.sqrt(40)
    for place, duration in enumerate((10, 20)):
        assert (
            np.abs(found[:, place].mean(axis=0) - known[duration]) <= 5 * error[place] + 1e-3
        ).all()


def test_the_score_reads_the_tables_that_are_there(script):
    score = script("score")
    shares = [
        row
        for row in rows("shares.csv")
        if row["scenario"] == "aggregation" and row["lag_cycles"] == "0"
    ]
    length, distance, errors = score.best(shares)
    assert length in range(60, 101)
    assert distance < 0.01
    assert errors >= 0
    assert {row["lag_cycles"] for row in rows("worlds.csv")} == {"0", "1", "2"}


def test_outliers_are_those_of_the_experiment(script):
    outliers = script("outliers")
    with (HERE.parent / "as-printed/4.6.2/tables/steady-outputs.csv").open(newline="") as file:
        outputs = {
            (row["hidden"], row["seed"]): [
                float(row[name]) for name in ("vl0", "vr0", "vl1", "vr1")
            ]
            for row in csv.DictReader(file)
        }
    stored = {
        (row["hidden"], row["seed"]): float(row["last_steady"])
        for row in rows("outliers.csv")
        if row["rates"] == "group"
    }
    assert stored.keys() == outputs.keys()
    for key, error in stored.items():
        assert error == pytest.approx(np.abs(outputs[key] - outliers.TRUTH).max(), abs=1e-4)


def test_a_network_that_ignores_its_reading_is_off_where_agents_see_others(script):
    outliers = script("outliers")
    model = outliers.ElmanModel(hidden=1)
    bias = np.log(0.15 / 0.85)  # an output of -0.7
    network = np.array([0, 0, 0, 0, 0, bias, -40.0])
    readings = np.array([[0, 0, 1, 0], [0, 1, 0, 0]])
    assert outliers.error_as_seen(model, network, readings) == pytest.approx(1.7)
    assert outliers.readings().max() == 1


def test_forms_between_mixed_and_separated_change_one_thing_each(script):
    separated = script("separated")
    settings = {"scenario.world": "paper", "scenario.trial.duration_s": 2.0}
    configuration = separated.load_configuration(None, "paper", settings, scenario="aggregation")
    models = np.random.default_rng(1).uniform(-1, 1, (3, 4))

    def collected(form, values):
        return separated.FORMS[form](configuration).collect(values, np.random.default_rng(2))

    groups = separated.SeparatedSwarm(configuration.swarm, 1)
    whole = groups.collect(models, np.random.default_rng(2))
    one = collected("one of a group", models)
    np.testing.assert_array_equal(one.genuine, whole.genuine)
    np.testing.assert_array_equal(one.counterfeit, whole.counterfeit[:, :1])
    among = collected("agents alone", models)
    others = collected("agents alone", -models)
    np.testing.assert_array_equal(among.genuine, others.genuine)
    assert among.genuine.shape == whole.genuine.shape
    assert among.counterfeit.shape == one.counterfeit.shape
    assert (among.counterfeit != others.counterfeit).any()
