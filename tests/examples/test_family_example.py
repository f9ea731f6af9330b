"""The examples of docs/families.md, as they stand there, the first in a fast form."""

import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.families import FAMILIES, BurstAndCoast

PAGE = (Path(__file__).parents[2] / "docs" / "families.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def run(block, names=None):
    names = {"np": np} | (names or {})
    exec(block, names)  # noqa: S102 - our own page
    return names


def test_the_speed_of_a_walk_is_recovered_from_its_own_recordings():
    slow = "seed=1)"
    fast = 'trials=300, seed=1, settings={"run.threads": 1})'
    assert slow in BLOCKS[0]
    result = run(BLOCKS[0].replace(slow, fast))["result"]
    # in three runs of this size the largest error was 0.08
    assert result.estimate["speed"] == pytest.approx(12, abs=0.5)


def test_a_recording_sets_steps_interval_and_signals_of_a_family(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    positions = BurstAndCoast(individuals=2, steps=600, interval_s=0.04).simulate(
        np.array([[12, 0.5, 0.8, 0.5]]), np.random.default_rng(1)
    )[0]
    pixels = 12.3 * positions + 4000
    rows = np.insert(pixels.reshape(len(pixels), 4), [2, 4], 1.0, axis=1)
    header = "X1\tY1\tProbId1\tX2\tY2\tProbId2"
    np.savetxt("fish.txt", rows, fmt="%.3f", delimiter="\t", header=header, comments="")
    few = ', generations=2, settings={"models.population": 8, "classifiers.population": 8, "run.threads": 1})'
    assert BLOCKS[1].endswith("parameters=walk.parameters)\n")
    names = run(
        BLOCKS[1].replace("parameters=walk.parameters)", f"parameters=walk.parameters{few}"),
        {"tl": tl, "BurstAndCoast": BurstAndCoast},
    )
    assert names["walk"].steps == 50
    assert names["walk"].interval_s == pytest.approx(0.04)
    assert list(names["result"].estimate) == list(names["walk"].parameters)


def test_the_family_of_ones_own_goes_round_in_circles():
    samples = run(BLOCKS[2])["circling"]
    np.testing.assert_allclose(samples, np.broadcast_to([5.0, 1.0], samples.shape), rtol=1e-9)


@pytest.mark.parametrize("name", FAMILIES)
def test_the_page_shows_each_family(name):
    assert f"images/families-{name}.png" in PAGE
    assert (Path(__file__).parents[2] / "docs" / "images" / f"families-{name}.png").exists()


@pytest.mark.parametrize("make", FAMILIES.values(), ids=FAMILIES)
def test_the_page_names_each_parameter_with_its_unit_and_range(make):
    part = PAGE[PAGE.index(f"| `{make.__name__}` |") :]
    for name, parameter in make().parameters.items():
        if name != "vr1":
            assert f"`{name}`" in part
        assert (
            f"| {parameter.unit} | {parameter.low:.4g} to {parameter.high:.4g}".replace(
                "|  |", "| |"
            )
            in part
        )


@pytest.mark.parametrize("make", FAMILIES.values(), ids=FAMILIES)
def test_the_page_names_each_setting(make):
    settings = PAGE[PAGE.index("## Settings") : PAGE.index("## Sources")]
    assert [field.name for field in fields(make) if f"`{field.name}`" not in settings] == []
