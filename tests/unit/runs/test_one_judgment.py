"""No two sentences about whether to believe an estimate contradict each other, wherever they stand."""

import html
import json
import re
from dataclasses import asdict, replace
from itertools import combinations

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.analysis import OF_CHECKS, Verdict
from turing_learning.identifiability import Check, PinnedDown, Recovery, TwoSampleTest
from turing_learning.report._page import Report, report_page
from turing_learning.runs import RunFolder
from turing_learning.runs._report import check_listing

NAMES = ("vl0", "vr0", "vl1", "vr1")

CLAIMS = {
    "fresh classifiers tell it": r"Fresh classifiers (can )?tell (held-out samples|the model|the estimate) from",
    "it passes": r"The estimate passes|cannot tell held-out|no better than from a right|fresh ones do not",
    "the check cannot say": r"cannot say|would often miss a clearly wrong model",
    "can still tell": r"can still tell|Classifiers tell the models of this run",
    "the model is wrong": r"model rejected|however well it is fitted",
    "the search has failed": r"search failed|The search also misses",
    "nobody knows what is at fault": r"at fault is not known",
    "searches succeed": r"Searches for a known truth (end with models that pass|come near)",
    "searches miss": r"Searches for a known truth (miss it|end with models that classifiers tell)|search unreliable",
    "nothing speaks against it": r"converged|Nothing speaks against|Neither the run nor its check",
    "every parameter is pinned down": r"Every parameter is pinned down",
    "no parameter is": r"nothing pinned down|for no parameter|other values of its parameters may pass",
    "some parameter is": r"ROW pinned down",
    "some parameter is not": r"Not pinned down:|ROW (?!pinned down)",
}
"""What a sentence claims -> how it is recognized. A row of a table begins with ROW."""

EXCLUDED = [
    ("fresh classifiers tell it", "it passes"),
    ("fresh classifiers tell it", "the check cannot say"),
    ("fresh classifiers tell it", "nothing speaks against it"),
    ("fresh classifiers tell it", "some parameter is"),
    ("fresh classifiers tell it", "no parameter is"),
    ("it passes", "the check cannot say"),
    ("it passes", "can still tell"),
    ("it passes", "the model is wrong"),
    ("it passes", "the search has failed"),
    ("it passes", "nobody knows what is at fault"),
    ("the check cannot say", "the model is wrong"),
    ("the check cannot say", "the search has failed"),
    ("the check cannot say", "nothing speaks against it"),
    ("can still tell", "the model is wrong"),
    ("can still tell", "the search has failed"),
    ("the model is wrong", "the search has failed"),
    ("the model is wrong", "nobody knows what is at fault"),
    ("the search has failed", "nobody knows what is at fault"),
    ("the search has failed", "searches succeed"),
    ("searches succeed", "searches miss"),
    ("every parameter is pinned down", "some parameter is not"),
    ("every parameter is pinned down", "no parameter is"),
    ("no parameter is", "some parameter is"),
    *(
        ("nothing speaks against it", verdict)
        for verdict in Verdict
        if verdict is not Verdict.CONVERGED
    ),
]
"""Claims that no reader should meet together; words of a verdict are claims of their own."""


def claims_of(text):
    """Return what a text claims."""
    found = {claim for claim, pattern in CLAIMS.items() if re.search(pattern, text)}
    return found | {verdict for verdict in Verdict if re.search(rf"\b{verdict}\b", text)}


def claims_of_json(judgment):
    """Return what `check.json` claims by numbers and flags, without its sentences."""
    fits = {
        True: {"it passes"},
        False: {"fresh classifiers tell it"},
        None: {"the check cannot say"},
    }
    search = {True: {"searches succeed"}, False: {"searches miss"}, None: set()}
    return (
        fits[judgment["fits"]]
        | search[judgment["search_succeeds"]]
        | claims_of(", ".join(judgment["verdicts"]))
    )


def contradictions(claims):
    return [
        pair
        for pair in combinations(sorted(claims), 2)
        if pair in EXCLUDED or pair[::-1] in EXCLUDED
    ]


def text_of(markup):
    """Return what a reader sees of a page, without the list of what the words mean in general."""
    page = re.sub(
        r'<details id="reading">.*?</details>|<style>.*?</style>', " ", markup, flags=re.S
    )
    return html.unescape(re.sub(r"\s+", " ", re.sub("<[^>]*>", "", page)))


OWN_WORDS = [each for each in Verdict if each not in OF_CHECKS]


def draw_word(rng):
    """Return what a run says of itself: it has converged, or one or two words."""
    places = rng.choice(len(OWN_WORDS), rng.integers(3), replace=False)
    return tuple(OWN_WORDS[place] for place in places) or (Verdict.CONVERGED,)


def draw_accuracy(rng):
    return float(rng.choice([rng.random(), rng.normal(0.5, 0.03), rng.uniform(0.6, 0.8)]))


def draw_test(rng):
    p_value, critical = (
        rng.choice([0.001, 0.03, 0.05, 0.051, 0.4, 1.0]),
        rng.choice([0.5, 0.53, 0.56, 0.6, 0.65]),
    )
    level, spread = rng.choice([0.5, 0.7, 0.97]), rng.choice([0.01, 0.05])
    plausible = np.clip(rng.normal(level, spread, rng.choice([0, 12])), 0, 1)
    return TwoSampleTest(
        accuracy=draw_accuracy(rng),
        p_value=float(p_value),
        critical=float(critical),
        genuine_samples=40,
        genuine_groups=8,
        counterfeit_samples=200,
        counterfeit_groups=40,
        grouping="samples",
        plausible=tuple(plausible.tolist()),
    )


def draw_recoveries(rng):
    """Return recoveries of a run of generations, or of trials, whose searches succeed, miss, or scatter."""
    found, of_trials, level = [], rng.random() < 0.7, rng.choice([0.5, 0.5, 0.7])
    for seed in range(rng.integers(6)):
        accuracy = rng.normal(level, 0.03) if of_trials else None
        attainable = tuple(rng.normal(0.5, 0.03, 3).tolist()) if of_trials else ()
        errors = {name: float(rng.choice([0.01, 0.1, 0.6], p=[0.6, 0.3, 0.1])) for name in NAMES}
        found.append(Recovery(seed, 9, {}, {}, {}, errors, accuracy, attainable))
    return tuple(found)


def draw_parameters(rng):
    found, of_trials, profiled, tight = (
        [],
        rng.random() < 0.7,
        rng.random() < 0.8,
        rng.choice([0, 0.5, 1]),
    )
    for name in NAMES:
        width, open_share = rng.choice([None, 0.01, 0.1, 0.7]), 0.2 if profiled else None
        sides = tuple((rng.random(2) < tight).tolist()) if of_trials else None
        bound = "6 rad/s" if rng.random() < 0.05 else ""
        found.append(PinnedDown(name, width, open_share, 0.01, bound, sides=sides))
    return tuple(found)


def draw_check(rng):
    found = Check(
        draw_test(rng), draw_parameters(rng), (), draw_recoveries(rng), (), said=draw_word(rng)
    )
    return replace(found, unfinished=(3, 10)) if rng.random() < 0.1 else found


def claims_of_check(check):
    """Return all claims of what is printed and stored of a check, by where they stand."""
    listing = check_listing(check)
    lines = [line for line in str(check).splitlines() if not line.startswith(NAMES)]
    rows = [f"ROW {'; '.join(each.reasons) or 'pinned down'}" for each in check.parameters]
    stored = json.loads(json.dumps(check.judgment.to_json()))
    return {
        "lines": claims_of("\n".join(lines)),
        "rows": claims_of("\n".join(rows)),
        "page": claims_of(
            "\n".join([listing.note, *(f"ROW {cells[-1]}" for cells in listing.rows)])
        ),
        "sentences in JSON": claims_of(" ".join(stored["sentences"])),
        "flags in JSON": claims_of_json(stored),
    }


def test_no_two_sentences_of_a_check_contradict_each_other():
    met = set()
    for seed in range(250):
        check = draw_check(np.random.default_rng(seed))
        found = claims_of_check(check)
        everything = set().union(*found.values())
        assert contradictions(everything) == [], (seed, found)
        assert check.verdict in str(check).splitlines()[0]
        numbers = re.search(r"accuracy (\d\.\d+).*up to (\d\.\d+)", check.text)
        if numbers:
            beyond = float(numbers[1]) > float(numbers[2])
            assert beyond == (check.judgment.fits is False), (seed, check.text)
        assert {"it passes", "fresh classifiers tell it", "the check cannot say"} & everything
        met |= {check.verdict}
    assert met == {*Verdict}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    small = {"models.population": 4, "classifiers.population": 4, "scenario.trial.duration_s": 1.0}
    path = tmp_path_factory.mktemp("judged") / "run"
    return tl.infer("aggregation", generations=1, seed=1, settings=small, out=path)


def stored(check, estimate):
    """Return what `check.json` holds of a check."""
    return {
        "settings": {"estimate": estimate},
        "test": check.test.to_json(),
        "recoveries": [each.to_json() for each in check.recoveries],
        "parameters": [asdict(each) for each in check.parameters],
        "profiles": {},
        "quantities": [],
    }


def test_run_check_page_and_notebook_say_the_same(run):
    folder = RunFolder(run.path)
    for seed in range(1000, 1030):
        rng = np.random.default_rng(seed)
        check = draw_check(rng)
        apart = rng.random() < 0.3
        folder.write(
            "pool.json", {"estimate": run.estimate, "verdicts": ["runs disagree"] if apart else []}
        )
        folder.write("check/check.json", stored(check, run.estimate))
        result = replace(run, found=check.said)
        check = result.checked
        page = report_page(
            Report("Run", "Done.", [], judgment=result.judgment, check=check_listing(check))
        )
        head, *_, last = str(result).splitlines()
        found = claims_of_check(check) | {
            "run": claims_of(f"{head}\n{last}"),
            "page": claims_of(text_of(page)),
            "notebook": claims_of(text_of(check._repr_html_())),
        }
        assert contradictions(set().union(*found.values())) == [], (seed, found)
        assert result.verdicts == check.verdicts
        assert (Verdict.DISAGREE in result.verdicts) == (apart or Verdict.DISAGREE in result.found)
        assert f"<b>{check.verdict}</b>" in page


def test_a_pool_does_not_say_that_nothing_speaks_against_it_where_some_of_its_runs_do():
    end = {"speed": [0.0, 1.0]}
    for seed in range(200):
        rng = np.random.default_rng(seed)
        said = tuple(
            tuple(rng.choice([*Verdict], rng.integers(1, 3), replace=False))
            if rng.random() < 0.5
            else ("converged",)
            for _ in range(rng.integers(2, 5))
        )
        apart = bool(rng.random() < 0.3)
        numbers = (
            {"speed": 0.5},
            end,
            {"speed": 3.0 if apart else 1.0},
            {"speed": [0.5] * len(said)},
            None,
            None,
            None,
        )
        pooled = tl.runs.Pooled("walk", 3, tuple(range(len(said))), *numbers, found=said, checked=1)
        head, *remarks, last = str(pooled).splitlines()
        assert contradictions(claims_of(last)) == [], seed
        against = {verdict for each in said for verdict in each} - {Verdict.CONVERGED}
        assert ("Nothing speaks against" in last) == (not against and not apart), seed
        for verdict in against - set.intersection(*map(set, said)):
            assert any(
                re.fullmatch(rf"\d of {len(said)} runs: {verdict}", remark) for remark in remarks
            ), seed
        assert pooled.verdict in head


def test_a_model_that_the_check_of_one_run_rejects_is_rejected_for_all():
    end, said = {"speed": [0.0, 1.0]}, ((Verdict.REJECTED,), (Verdict.TOLD,), (Verdict.TOLD,))
    numbers = {"speed": 0.5}, end, {"speed": 1.0}, {"speed": [0.5] * 3}, None, None, None
    pooled = tl.runs.Pooled("walk", 3, (1, 2, 3), *numbers, found=said, checked=1)
    assert pooled.verdicts == (Verdict.REJECTED,)
    assert replace(pooled, checked=3).verdicts == (Verdict.TOLD,)


def test_contradictions_are_found():
    said = "The search has failed. Fresh classifiers cannot tell held-out samples from the model. Verdict: "
    assert ("can still tell", "it passes") in contradictions(
        claims_of(said + "classifiers can still tell.")
    )
    fine = "The estimate passes. Verdict: converged. The check shows for no parameter that"
    assert contradictions(claims_of(fine + "\nROW pinned down")) == [
        ("no parameter is", "some parameter is")
    ]
