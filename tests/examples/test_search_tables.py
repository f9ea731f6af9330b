"""The search for controllers: its tables, what the scenarios took from them, and the script that repeats them."""

import csv
import json
import runpy
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from turing_learning.swarm import AGGREGATION, AGGREGATION_VIEW_60, initial_poses

FOLDER = Path(__file__).parents[2] / "experiments" / "4.6.1" / "search"


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(FOLDER / "search.py"))


def ranked(name):
    with (FOLDER / name / "controllers.csv").open(newline="") as file:
        return [
            tuple(float(row[key]) for key in ("vl0", "vr0", "vl1", "vr1"))
            for row in csv.DictReader(file)
        ]


def test_the_controller_of_the_wide_view_is_the_best_that_was_found():
    assert AGGREGATION_VIEW_60.controller == ranked("60-degrees")[0]


def test_the_longer_search_with_a_line_of_sight_finds_the_neighbor_of_the_controller_of_the_paper():
    assert ranked("0-degrees-600-s")[0] == (-0.6, -1.0, 1.0, -1.0)


@pytest.mark.parametrize("name", ["0-degrees", "0-degrees-600-s", "60-degrees"])
def test_the_script_repeats_the_searches_that_made_the_tables(script, name):
    stored = json.loads((FOLDER / name / "search.json").read_text())
    settings = script["SEARCHES"][name]._asdict()
    scenario = asdict(settings.pop("scenario"))
    assert settings.items() <= stored["settings"].items()
    assert scenario["sensor"]["field_of_view"] == stored["scenario"]["sensor"]["field_of_view"]


def test_a_grid_and_its_mirror_image_are_the_whole_grid(script):
    half = script["grid_controllers"](4)
    assert len({tuple(row) for row in np.concatenate((half, half[:, [1, 0, 3, 2]]))}) == 4**4
    symmetric = (half[:, 0] == half[:, 1]) & (half[:, 2] == half[:, 3])
    assert 2 * len(half) - symmetric.sum() == 4**4


def test_the_controller_of_the_paper_gathers_and_its_opposite_does_not(script):
    search = script["Search"](AGGREGATION)
    controllers = np.array([search.scenario.controller, np.negative(search.scenario.controller)])
    starts = initial_poses(AGGREGATION, 4, np.random.default_rng(1))
    costs = script["costs_of"](search, controllers, starts, seed=1)[..., 0]
    assert costs[0].max() < costs[1].min()


def test_finalists_are_sorted_by_their_cost(script):
    table = script["ranked"](
        script["Search"](AGGREGATION, steps=2, finalists=3, final_trials=4, duration_s=2)
    )
    assert len(table) == 3
    assert table["cost"].is_monotonic_increasing
