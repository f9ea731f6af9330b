"""The example of docs/detection.md on recordings, as it stands there, in a fast form."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "detection.md").read_text(encoding="utf-8")
BLOCK = next(
    block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "def record" in block
)
FAST = {
    "frames=3000": "frames=1500",
    'out="runs/fish")': 'out="runs/fish", trials=300, settings={"run.threads": 1})',
}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    block, names = BLOCK, {}
    for old, new in FAST.items():
        assert old in block
        block = block.replace(old, new)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("planted"))
        exec(block, names)  # noqa: S102 - our own page
    return names["found"]


def test_the_planted_fish_come_first_and_are_called_abnormal(found):
    assert {each.individual for each in found.individuals if each.rank <= 2} == {
        "fish 9",
        "fish 10",
    }
    assert all(each.abnormal for each in found.individuals[-2:])


def test_few_normal_fish_are_called_abnormal(found):
    assert sum(each.abnormal for each in found.individuals[:-2]) <= 1


def test_most_of_what_is_flagged_of_them_is_in_the_second_half(found):
    for each in found.individuals[-2:]:
        half = len(each.flagged) // 2
        assert each.flagged[half:].mean() > each.flagged[:half].mean() + 0.3
