"""Files at the root say the same as the package, and name what is there."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGES = (
    "README.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    "CODE_OF_CONDUCT.md",
    "VISION.md",
    "CHANGELOG.md",
)
FORMS = sorted((ROOT / ".github").rglob("*.yml"))

yaml = pytest.importorskip("yaml", reason="comes with the extra docs")


def test_the_citation_is_of_this_version_and_has_the_doi_of_the_documentation():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])
    assert [author["name"] for author in citation["authors"]] == [
        author["name"] for author in PROJECT["authors"]
    ]
    paper = citation["preferred-citation"]
    bibtex = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    assert f"{{{paper['doi']}}}" in bibtex
    assert f"{{{paper['start']}--{paper['end']}}}" in bibtex


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.name)
def test_workflows_and_forms_can_be_read(path):
    assert isinstance(yaml.safe_load(path.read_text(encoding="utf-8")), dict)


def test_the_workflow_runs_the_gate_on_every_python_that_is_stated_and_tests_that_exist():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))[
        "jobs"
    ]
    stated = [
        each.rpartition(" ")[2] for each in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", each)
    ]
    assert jobs["gate"]["strategy"]["matrix"]["python"] == stated
    assert any(step.get("run") == ".ci/run" for step in jobs["gate"]["steps"])
    (suite,) = [
        step["run"]
        for step in jobs["elsewhere"]["steps"]
        if step.get("run", "").startswith("pytest")
    ]
    assert [path for path in suite.split()[1:] if not (ROOT / path).exists()] == []


@pytest.mark.parametrize("page", PAGES)
def test_links_of_pages_at_the_root_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    links = re.findall(r"\]\((?!https?:|#)([^)#]+)", text)
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_the_description_of_the_package_leads_nowhere_in_the_repository():
    tree = ast.parse((ROOT / "hatch_build.py").read_text(encoding="utf-8"))
    patterns = {
        part.targets[0].id: ast.literal_eval(part.value)
        for part in tree.body
        if isinstance(part, ast.Assign)
    }
    text = re.sub(patterns["PICTURE"], "", (ROOT / "README.md").read_text(encoding="utf-8"))
    text = re.sub(patterns["LINK"], r"\1", text)
    assert "![" not in text
    assert re.findall(r"\]\((?!https?:)", text) == []
    assert text.startswith("# Turing Learning for Python\n\nTuring Learning infers")
