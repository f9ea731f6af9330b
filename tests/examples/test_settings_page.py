"""The page of settings says what the code does."""

import runpy
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_what_the_code_makes_of_it():
    written = (DOCS / "settings.md").read_text(encoding="utf-8")
    assert runpy.run_path(str(DOCS / "settings.py"))["page"]() == written


def test_the_population_is_on_it_by_its_key():
    assert "| `population` | 100 |" in (DOCS / "settings.md").read_text(encoding="utf-8")
