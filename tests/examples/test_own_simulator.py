"""The example of docs/own-system.md, as it stands there, in a fast form."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "own-system.md"


def example(**replaced):
    first = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]
    for old, new in replaced.values():
        assert old in first
        first = first.replace(old, new)
    return first


@pytest.fixture(scope="module")
def namespace():
    fast = ("seed=1,", "seed=1, trials=300, threads=1,")
    names = {}
    exec(example(fast=fast), names)  # noqa: S102 - our own page
    return names


def test_the_example_finds_the_mean_speed(namespace):
    assert namespace["result"].estimate["speed"] == pytest.approx(6, abs=0.5)


def test_the_example_finds_the_order_of_the_turn_noise(namespace):
    assert namespace["result"].estimate["turn_noise"] == pytest.approx(0.6, abs=0.3)


def test_the_example_writes_its_report(namespace, tmp_path):
    page = namespace["result"].report(tmp_path / "walk.html").read_text(encoding="utf-8")
    assert "speed (cm/s)" in page


def test_the_page_names_every_option():
    from turing_learning.systems import CustomOptions

    text = PAGE.read_text(encoding="utf-8") + PAGE.with_name("interaction.md").read_text(
        encoding="utf-8"
    )
    assert [name for name in CustomOptions.__annotations__ if f"`{name}" not in text] == []
