"""The committed searches of controllers, and what the scenarios took from them."""

import csv
import json
from pathlib import Path

import pytest

from turing_learning.search import SearchSettings
from turing_learning.swarm import AGGREGATION_VIEW_60

SEARCHES = Path(__file__).parents[2] / "experiments" / "4.6.1" / "search"


def ranked(name):
    with (SEARCHES / name / "controllers.csv").open(newline="") as file:
        return [tuple(float(row[key]) for key in ("vl0", "vr0", "vl1", "vr1")) for row in csv.DictReader(file)]


def test_the_controller_of_the_wide_view_is_the_best_that_was_found():
    assert AGGREGATION_VIEW_60.controller == ranked("60-degrees")[0]


@pytest.mark.parametrize(
    ("name", "view"), [("0-degrees", 0.0), ("60-degrees", AGGREGATION_VIEW_60.sensor.field_of_view)]
)
def test_the_searches_were_of_the_default_size(name, view):
    stored = json.loads((SEARCHES / name / "search.json").read_text())
    assert SearchSettings(**stored["settings"]) == SearchSettings()
    assert stored["scenario"]["sensor"]["field_of_view"] == view


def test_the_longer_search_with_a_line_of_sight_finds_the_neighbor_of_the_controller_of_the_paper():
    assert ranked("0-degrees-600-s")[0] == (-0.6, -1.0, 1.0, -1.0)
