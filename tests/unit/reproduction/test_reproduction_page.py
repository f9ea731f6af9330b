"""Pages made from the folders of the experiments, and that the committed ones are current."""

import json
import re
import shutil
from pathlib import Path

import pytest

from turing_learning.config import ConfigurationError
from turing_learning.reproduction import refuse_page_path, write_page
from turing_learning.reproduction._page import ExperimentFolder, page, readme
from turing_learning.reproduction._verdicts import RULES, load_claims, prose
from turing_learning.reproduction.experiments import EXPERIMENTS, EXPERIMENTS_AS_PRINTED

ROOT = Path(__file__).parents[3]
HOW = "make it current with: turing-learning reproduce --page docs/reproduction.md"


@pytest.fixture
def as_if_full(conducted, tmp_path):
    """Results of section 3.2 that say that they are of full size."""
    folder = tmp_path / "experiments"
    shutil.copytree(conducted / "3.2", folder / "3.2")
    path = folder / "3.2" / "results.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"form": "full"}))
    return folder


def test_the_committed_page_is_current():
    assert (ROOT / "docs" / "reproduction.md").read_text() == page(ROOT / "experiments"), HOW


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_committed_page_of_an_experiment_is_current(name):
    folder = ExperimentFolder(ROOT / "experiments" / name)
    assert (folder.path / "README.md").read_text() == readme(EXPERIMENTS[name], folder), HOW


def test_every_claim_of_sections_3_2_and_4_has_a_row(tmp_path):
    text = page(tmp_path)
    names = [name for name in load_claims() if name.startswith(("3.2", "4."))]
    assert len(names) == 16
    assert all(re.search(rf"^\| \[?{re.escape(name)}\b", text, re.MULTILINE) for name in names)


def test_every_rule_is_stated_on_the_page_of_its_experiment():
    folders = [ExperimentFolder(ROOT / "experiments" / name) for name in EXPERIMENTS]
    stated = {
        one.rule: RULES[one.rule] in (folder.path / "README.md").read_text()
        for folder in folders
        for one in folder.results().verdicts
    }
    assert stated == dict.fromkeys(RULES, True)


def test_the_page_begins_with_the_score_and_a_sentence_for_each_claim_that_differs(as_if_full):
    path = as_if_full / "3.2" / "results.json"
    results = json.loads(path.read_text())
    for agrees in (True, False):
        path.write_text(
            json.dumps(
                results | {"verdicts": [one | {"agrees": agrees} for one in results["verdicts"]]}
            )
        )
        start = page(as_if_full, "there").partition("## All claims")[0]
        assert f"**{int(agrees)} agree** and **{int(not agrees)} differ**" in start
        assert (
            "[3.2-snapshots](there/3.2/README.md): Robots gather as printed" in start
        ) is not agrees


def test_what_the_papers_algorithm_gives_has_a_table_of_its_own(as_if_full):
    shutil.copytree(as_if_full / "3.2", as_if_full / "as-printed" / "3.2")
    text = page(as_if_full, "there")
    assert "Held against it so far: 1 of" in text
    assert "[3.2-snapshots](there/as-printed/3.2/README.md)" in text


def test_what_differs_with_the_papers_algorithm_has_its_reason(as_if_full, monkeypatch):
    shutil.copytree(as_if_full / "3.2", as_if_full / "as-printed" / "3.2")
    path = as_if_full / "as-printed" / "3.2" / "results.json"
    results = json.loads(path.read_text())
    monkeypatch.setitem(prose()["as_printed"]["differences"], "3.2-snapshots", "Objects roll.")
    for agrees in (True, False):
        verdicts = [one | {"agrees": agrees} for one in results["verdicts"]]
        path.write_text(json.dumps(results | {"verdicts": verdicts}))
        reason = "* [3.2-snapshots](there/as-printed/3.2/README.md): Objects roll."
        assert (reason in page(as_if_full, "there")) is not agrees


def test_reasons_are_of_claims_that_differ_with_the_papers_algorithm():
    root = ROOT / "experiments" / "as-printed"
    found = [ExperimentFolder(root / name).results() for name in EXPERIMENTS_AS_PRINTED]
    verdicts = {}
    for results in filter(None, found):
        verdicts |= {one.claim: one.agrees for one in results.verdicts if not one.variant}
    assert not any(verdicts[claim] for claim in prose()["as_printed"]["differences"])


def test_every_claim_that_differs_has_a_sentence():
    found = [ExperimentFolder(ROOT / "experiments" / name).results() for name in EXPERIMENTS]
    differ = {
        one.claim
        for results in found
        for one in results.verdicts
        if not one.agrees and not one.variant
    }
    assert differ == set(prose()["differences"])


def test_results_of_the_fast_form_are_not_results(conducted, tmp_path):
    link = "../experiments"
    assert page(conducted, link) == page(tmp_path, link)


def test_full_results_are_shown_with_verdict_figures_and_where_they_are_from(as_if_full):
    text = page(as_if_full, "there")
    row = next(line for line in text.splitlines() if line.startswith("| [3.2-snapshots]"))
    assert re.search(r"\*\*(agree|differ)\*\*.*robots in one cluster after", row)
    assert "![aggregation](there/3.2/figures/aggregation.svg)" in text
    assert "Full size, 20" in text
    assert text.count("Not run yet.") == len(EXPERIMENTS) - 1


def test_the_page_of_the_fast_form_says_that_it_proves_nothing(conducted):
    text = (conducted / "4.5" / "README.md").read_text()
    assert "proves nothing" in text
    assert "| **4.5-theorem** | agree |" in text


def test_printed_numbers_have_names_in_words(tmp_path):
    assert "share MAE below 0.05 0.89; count MAE above 0.1 43" in page(tmp_path)


def test_links_are_relative_to_the_page(as_if_full, tmp_path):
    (tmp_path / "docs" / "more").mkdir(parents=True)
    path = write_page(as_if_full, tmp_path / "docs" / "more" / "page.md")
    assert "(../../experiments/3.2/README.md)" in path.read_text()
    assert (as_if_full / "4.3" / "README.md").exists()


def test_the_committed_page_is_one_that_is_replaced():
    refuse_page_path(ROOT / "docs" / "reproduction.md", force=False)


def test_a_page_from_python_replaces_no_other_file(tmp_path):
    path = tmp_path / "page.md"
    path.write_text("my notes")
    with pytest.raises(
        ConfigurationError, match=r"`path` must be a file that does not exist; got .*page\.md"
    ):
        write_page(tmp_path / "experiments", path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "my notes"
    assert "# Reproduction" in write_page(tmp_path / "experiments", path, force=True).read_text()
    write_page(tmp_path / "experiments", path)
