"""The files of docs/scenarios.md, as they stand there."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

import turing_learning as tl
from turing_learning.config import dotted, load_configuration
from turing_learning.swarm import AGGREGATION, Arena

PAGE = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
FILES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture
def written(tmp_path):
    def write(number):
        path = tmp_path / "five.toml"
        path.write_text(FILES[number], encoding="utf-8")
        return path

    return write


def test_the_file_changes_what_it_says_and_nothing_else(written):
    configuration = load_configuration(written(0))
    trial = replace(AGGREGATION.trial, duration_s=20.0)
    assert configuration.scenario == replace(
        AGGREGATION,
        agents=5,
        controller=(-0.6, -0.9, 0.9, -0.9),
        arena=Arena(200.0, 150.0),
        trial=trial,
    )
    assert (
        configuration.models.parents,
        configuration.run.generations,
        configuration.run.seed,
    ) == (30, 300, 7)
    assert configuration.classifiers == load_configuration().classifiers


def test_the_file_runs(written):
    quick = {"run.threads": 1, "models.population": 8, "classifiers.population": 8}
    result = tl.infer(config=written(0), generations=1, settings=quick)
    assert (result.scenario, list(result.truth.values())) == (
        "aggregation",
        [-0.6, -0.9, 0.9, -0.9],
    )


def test_the_other_file_gives_another_name(written):
    scenario = load_configuration(written(1)).scenario
    assert scenario == replace(
        AGGREGATION, name="five-of-them", title="Five robots gather", agents=5
    )


def test_the_page_names_every_setting_of_a_scenario():
    keys = {key.rpartition(".")[2] for key in dotted(load_configuration().model_dump()["scenario"])}
    assert [key for key in sorted(keys) if f"`{key}`" not in PAGE] == []
