"""The example of docs/detection.md on a recording, as it stands there, in a fast form."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "detection.md").read_text(encoding="utf-8")
BLOCK = next(block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "def record" in block)
FAST = {
    "frames=3000": "frames=1500",
    "generations=300,": 'generations=60, settings={"models.population": 40, "classifiers.population": 40, "run.threads": 1},',
    "[[12.0, 0.5, 0.8, 0.9]]": "[[28.0, 0.5, 0.8, 0.9]]",  # planted fish that the classifiers of a short run can tell
}


@pytest.fixture(scope="module")
def verdicts(tmp_path_factory):
    block, names = BLOCK, {}
    for old, new in FAST.items():
        assert old in block
        block = block.replace(old, new)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("planted"))
        exec(block, names)  # noqa: S102 - our own page
        return names["detector"].with_false_alarms(0.01).timeline(names["trial"])


def test_the_planted_fish_are_found(verdicts):
    assert [verdict.individual for verdict in verdicts if verdict.abnormal][-2:] == ["fish 9", "fish 10"]


def test_few_normal_fish_are_called_abnormal(verdicts):
    assert sum(verdict.abnormal for verdict in verdicts[:-2]) <= 1


def test_most_of_what_is_flagged_of_them_is_after_the_change(verdicts):
    for verdict in verdicts[-2:]:
        after = verdict.times[:, 0] >= 75
        assert verdict.flagged[after].mean() > verdict.flagged[~after].mean() + 0.3
