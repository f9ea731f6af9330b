"""The example with a model of Mesa, in a short form, and the page about models of other frameworks."""

import re
import sys
from pathlib import Path

import pytest

pytest.importorskip("mesa")
ROOT = Path(__file__).parents[2]


@pytest.fixture
def segregation(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples")
    monkeypatch.delitem(sys.modules, "segregation", raising=False)
    import segregation

    return segregation


def test_what_a_model_of_mesa_reports_is_inferred_from(segregation):
    result = segregation.infer(trials=60, observed=20)
    assert result.estimate["density"] == pytest.approx(0.8, abs=0.1)
    assert result.estimate["minority_pc"] == pytest.approx(0.3, abs=0.1)


def test_the_page_shows_the_ten_lines_of_the_example(segregation):
    page = (ROOT / "docs" / "agent-based-models.md").read_text(encoding="utf-8")
    block = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
    names = {}
    exec(block.replace("trials=1000", "trials=40").replace("range(40)", "range(5)"), names)  # noqa: S102 - our own page
    assert set(names["result"].estimate) == {"density", "minority_pc", "homophily"}
