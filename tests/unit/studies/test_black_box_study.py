"""Studies of networks: tables state what they do."""

import csv

import numpy as np

from turing_learning.models import ElmanModel
from turing_learning.studies import plan_study, study
from turing_learning.studies._backends import first_of_each_network


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_tables_of_networks_of_several_sizes_state_their_steady_outputs(small, executor, tmp_path):
    result = study(
        "aggregation", runs=1, generations=7, settings=small, grid={"models.hidden": [0, 1, 3]}, executor=executor,
        out=tmp_path / "study",
    )  # fmt: skip
    assert [
        len((run.result.get("networks") or {}).get("best_model", ())) for run in result.runs
    ] == [0, 7, 23]
    found = rows(tmp_path / "study" / "runs.csv")
    weights = np.array(list(result.runs[2].result["networks"]["best_model"].values()))
    outputs = ElmanModel(hidden=3).described(weights)
    stated = [float(found[2][f"best_model_{name}"]) for name in ("vl0", "vr0", "vl1", "vr1")]
    np.testing.assert_allclose(stated, outputs)
    last = [
        row for row in rows(tmp_path / "study" / "convergence.csv") if row["models.hidden"] == "3"
    ][-1]
    assert float(last["best_model_vl1"]) == stated[2]


def test_a_worker_that_compiles_for_the_others_runs_networks_and_reactive_models():
    plan = plan_study("aggregation", runs=2, grid={"models.hidden": [0, 1, 3]})
    assert first_of_each_network(plan, list(plan.numbers)) == [1, 3]
