"""What a notebook shows of a result."""

from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.identifiability import Check, PinnedDown, TwoSampleTest


@pytest.fixture(scope="module")
def results():
    return [tl.infer("aggregation", generations=5, seed=seed) for seed in (1, 2)]


def test_a_result_is_one_line_and_a_table(results):
    result = results[0]
    assert repr(result).startswith("<Evolution: aggregation, seed 1, 5 generations")
    assert "\n" not in repr(result)
    table = result.to_dataframe()
    assert table.index.tolist() == ["vl0", "vr0", "vl1", "vr1"]
    assert table["estimate"].to_dict() == result.estimate
    assert (table["estimate"] - table["truth"]).abs().to_dict() == pytest.approx(
        result.estimate_absolute_error
    )
    assert table[["low", "high"]].to_numpy() == pytest.approx(
        np.array(list(result.interval.values())), nan_ok=True
    )
    html = result._repr_html_()
    assert "aggregation, seed 1" in html
    assert html.count("<tr") == 2 + 4  # pandas puts the name of the index into a row


def test_units_are_those_of_the_parameters(tmp_path):
    table = tl.infer("aggregation-field-of-view-60", generations=1, seed=1).to_dataframe()
    assert table.loc["theta", "unit"] == "rad"


def test_where_no_parameter_has_a_unit_there_is_no_such_column(results):
    assert "unit" not in results[0].to_dataframe()


def test_a_history_names_what_it_holds(tmp_path):
    parameters = {"a": tl.Parameter(0, 1, unit="cm"), "b": tl.Parameter(0, 1, unit="cm")}
    samples = np.random.default_rng(0).random((12, 5, 1))

    def simulate(models, rng):
        return models[:, :1, None] + rng.random((len(models), 5, 1))

    for thin in ("full", "thin"):
        settings = {"run.history": thin, "models.population": 8, "classifiers.population": 8}
        options = {
            "genuine": samples,
            "simulate": simulate,
            "parameters": parameters,
            "settings": settings,
        }
        found = [
            tl.infer(**options, generations=2, seed=1, **more).history
            for more in ({}, {"out": tmp_path / thin})
        ]
        for history in found:
            assert history["parameter"].attrs == {"long_name": "parameter", "units": ["cm", "cm"]}
            assert history["best_model"].attrs == {
                "long_name": "parameter of the best model",
                "units": "cm",
            }
            assert {"long_name", "flag_values", "flag_meanings"} == set(history["selection"].attrs)
            assert all(history[name].attrs["long_name"] for name in history.variables)
        assert found[0].equals(found[1])
    theta = tl.infer("aggregation-field-of-view-60", generations=1, seed=1).history
    assert theta["parameter"].attrs["units"] == ["", "", "", "", "rad"]
    assert "units" not in theta["best_model"].attrs
    assert theta["model_fitness"].attrs["units"] == "1"


def test_pooled_runs_are_a_table(results):
    pooled = tl.pool(results)
    assert repr(pooled).startswith("<Pooled: aggregation, 2 runs, seeds 1, 2")
    assert pooled.to_dataframe()["r_hat"].to_dict() == pooled.agreement
    given = replace(pooled, trials=300, units=dict.fromkeys(pooled.estimate, "cm/s")).to_dataframe()
    assert given["birge"].to_dict() == pooled.agreement
    assert set(given["unit"]) == {"cm/s"}
    assert "<table" in pooled._repr_html_()


def test_a_check_is_a_table():
    test = TwoSampleTest(0.5, 0.4, 0.6, 10, 10, 10, 10, "samples")
    check = Check(
        test,
        (PinnedDown("speed", 0.1, None, None), PinnedDown("<turn>", 0.9, None, None)),
        (),
        (),
        (),
    )
    assert check.to_dataframe()["pinned_down"].to_dict() == {"speed": True, "<turn>": False}
    assert "&lt;turn&gt;" in check._repr_html_()
