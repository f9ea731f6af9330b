"""Pages in Markdown: one for each experiment, and one for all claims."""

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from turing_learning._files import in_home
from turing_learning.runs import refuse_target, write_atomically

from ._claims import Claim, load_claims
from ._experiment import Experiment
from ._folder import FULL, ExperimentFolder, Results, Shown
from ._registry import EXPERIMENTS
from ._verdicts import RULES

NOT_RUN = "not run yet"
NO_EXPERIMENT = "no experiment yet"
MADE = "This page is made from the folders of the experiments:"
"""By which the page of all claims is known."""
HEAD = 2048  # bytes of a page, within which it says so
SECTIONS = ("3.2", "4.", "5-")
"""Sections of the paper whose claims the page of all claims holds."""


def write_readme(experiment: Experiment, folder: ExperimentFolder) -> Path:
    """Write the page of an experiment into its folder."""
    folder.path.mkdir(parents=True, exist_ok=True)
    write_atomically(folder.readme_path, readme(experiment, folder).encode())
    return folder.readme_path


def readme(experiment: Experiment, folder: ExperimentFolder) -> str:
    """Return the page of an experiment: what was claimed, what came out, every deviation and condition."""
    results, claims = folder.results(), load_claims()
    lines = [f"# {experiment.id} {experiment.title}", "", *_how(experiment, results), ""]
    printed = [f"{claims[claim].where}: {_printed(claims[claim])}" for claim in experiment.claims]
    lines += _list_under("What the paper prints", printed)
    lines += _list_under("Conditions", experiment.conditions)
    lines += _list_under("Deviations", experiment.deviations)
    lines += ["## Sizes", "", "```json", json.dumps(asdict(experiment.full), indent=2), "```", ""]
    if results is not None:
        lines += _list_under("What came out", results.remarks) or ["## What came out", ""]
        lines += [*_verdict_rows(experiment, results), *_pictures(results.pictures, "figures")]
        lines += [*_inline_tables(folder, results.tables), *_table_list(results.tables)]
    return "\n".join(lines).rstrip() + "\n"


def _list_under(heading: str, texts: Sequence[str]) -> list[str]:
    return [f"## {heading}", "", *(f"* {text}" for text in texts), ""] if texts else []


def _how(experiment: Experiment, results: Results | None) -> list[str]:
    command = f"    turing-learning reproduce {experiment.id}"
    if results is None:
        return [command, "", f"**Not run yet.** Expected: {experiment.cost} on two cores."]
    if results.form != FULL:
        return [f"{command} --fast", "", "**The fast form: it shows that the experiment works, and proves nothing.**"]
    return [command, "", _provenance(results)]


def _provenance(results: Results) -> str:
    found, machine = results.provenance, results.provenance["machine"]
    return (
        f"Run at full size: {found['finished'][:10]}, {_commits(found)}, version "
        f"{found['versions']['turing-learning']}, {machine['processors']} processors of {machine['processor']}; "
        f"{results.seconds / 60:.0f} minutes of computing, summed over the pieces of work."
    )


def _commits(provenance: Mapping[str, Any]) -> str:
    """Name the commits that computed, with the numbers of runs and other pieces of work, and the one that wrote the tables."""
    counts = provenance.get("commits", {})
    computed = ", ".join(f"{_digits(commit) or 'not recorded'} ({count})" for commit, count in counts.items())
    written = f"tables of commit {_digits(provenance['commit'] or '') or 'unknown'}"
    return f"{written}, runs and other pieces of work of commits {computed}" if computed else written


def _digits(commit: str) -> str:
    """Return the first ten digits of a commit, and whether its tree had changes."""
    return commit[:10] + ("-dirty" if commit.endswith("-dirty") else "")


def _printed(claim: Claim) -> str:
    if claim.kind == "figure" and claim.seen:
        return claim.seen
    numbers = (
        f"{_spoken(name)} {_shown(value)}"
        for name, value in claim.values.items()
        if name not in ("parameters", "truth")
    )
    return "; ".join(numbers) or "a figure without printed numbers"


def _spoken(name: str) -> str:
    """Return the name of a printed number in words: "share_mae_below_0_05" becomes "share MAE below 0.05"."""
    words = re.sub(r"(\d)_(\d)", r"\1.\2", name).replace("_", " ")
    return re.sub(r"\b(m?ae)\b", lambda found: found[0].upper(), words)


def _shown(value: Any) -> str:
    return ", ".join(f"{item:g}" for item in value) if isinstance(value, list) else str(value)


def _verdict_rows(experiment: Experiment, results: Results) -> list[str]:
    if not results.verdicts:
        return []
    lines = ["| claim | verdict | printed | came out |", "| --- | --- | --- | --- |"]
    for verdict in sorted(results.verdicts, key=lambda one: experiment.claims.index(one.claim)):
        name = f"{verdict.claim}, {verdict.variant}" if verdict.variant else f"**{verdict.claim}**"
        lines.append(_row(name, verdict.word, verdict.printed, verdict.outcome))
    used = dict.fromkeys(verdict.rule for verdict in results.verdicts)
    return [*lines, "", "When a claim agrees:", "", *(f"* {rule}: {RULES[rule]}." for rule in used), ""]


def _row(*cells: str) -> str:
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"


def _pictures(pictures: Iterable[Shown], folder: str) -> list[str]:
    lines: list[str] = []
    for one in pictures:
        lines += [f"![{one.name}]({folder}/{one.name}.svg)", "", f"*{one.caption}*", ""]
    return lines


def _inline_tables(folder: ExperimentFolder, tables: Iterable[Shown]) -> list[str]:
    lines: list[str] = []
    for one in (table for table in tables if table.inline):
        head, *rows = folder.table(one.name)
        lines += [
            f"{one.caption}:",
            "",
            _row(*head),
            _row(*["---"] * len(head)),
            *(_row(*map(_short, row)) for row in rows),
            "",
        ]
    return lines


def _short(cell: str) -> str:
    """Return a fraction with three digits, anything else as it is."""
    try:
        return f"{float(cell):.3g}" if "." in cell or "e" in cell else cell
    except ValueError:
        return cell


def _table_list(tables: Iterable[Shown]) -> list[str]:
    return ["Tables:", "", *(f"* [{one.name}](tables/{one.name}.csv): {one.caption}." for one in tables)]


def page(experiments: str | Path, link: str = "../experiments") -> str:
    """Return the page of all claims of sections 3.2, 4 and 5, from the folders of the experiments.

    Only full-size results count; fast forms are as if they had not been run.

    Parameters
    ----------
    experiments
        The folder that holds a folder for each experiment.
    link
        The same folder as the page sees it.

    Returns
    -------
    str
        Markdown.
    """
    claims = {name: claim for name, claim in load_claims().items() if name.startswith(SECTIONS)}
    found = {one.id: _full(ExperimentFolder(in_home(experiments) / one.id)) for one in EXPERIMENTS.values()}
    lines = [
        *_INTRODUCTION,
        "",
        "| claim | verdict | printed | came out | beside it |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [_claim_row(claim, found, link) for claim in claims.values()]
    lines += ["", "## When a claim agrees", "", *(f"* {rule}: {text}." for rule, text in RULES.items()), ""]
    for experiment in EXPERIMENTS.values():
        lines += _section(experiment, found[experiment.id], claims, link)
    return "\n".join(lines).rstrip() + "\n"


def refuse_page_path(path: Path, *, force: bool, name: str = "path") -> None:
    """Raise ConfigurationError unless the page of all claims may be written to a path, by the name of what says so."""
    refuse_target(path, name=name, suffixes=(".md",), force=force, replaceable=_is_page)


def _is_page(path: Path) -> bool:
    with path.open("rb") as file:
        return MADE.encode() in file.read(HEAD)


def write_page(experiments: str | Path, path: str | Path, *, force: bool = False) -> Path:
    """Write the page of all claims, and the page of every experiment into its folder.

    Parameters
    ----------
    experiments
        The folder that holds a folder for each experiment.
    path
        The page, a name that ends with .md; links are made relative to it. One that was made so before is replaced.
    force
        Whether any other file is replaced, too.

    Raises
    ------
    ConfigurationError
        If no page may be written there.
    """
    target, experiments = Path(path), in_home(experiments)
    refuse_page_path(target, force=force)
    for experiment in EXPERIMENTS.values():
        write_readme(experiment, ExperimentFolder(experiments / experiment.id))
    link = Path(os.path.relpath(experiments, target.parent)).as_posix()
    write_atomically(target, page(experiments, link).encode())
    return target


_INTRODUCTION = (
    "# Reproduction",
    "",
    "Every claim of sections 3.2, 4 and 5 of the paper (W. Li, M. Gauci and R. Gross, *Turing learning*, Swarm Intelligence 10, "
    f"2016), what it prints, and what this implementation gives. {MADE}",
    "",
    "    turing-learning reproduce                  # lists the experiments, their cost and state",
    "    turing-learning reproduce 4.5              # runs one, or goes on with it; --fast for a small form in seconds",
    "    turing-learning reproduce all              # all of them; ends with the table of verdicts",
    "    turing-learning reproduce --page docs/reproduction.md",
    "",
    "The verdict is about the default preset; what stands beside it is the preset `paper`, which keeps to the text of the "
    "paper, or another way to read off the result. "
    "Section 5 is about physical robots: here its laboratory is emulated, and the verdicts are about the emulation.",
)


def _full(folder: ExperimentFolder) -> Results | None:
    results = folder.results()
    return results if results is not None and results.form == FULL else None


def _claim_row(claim: Claim, found: Mapping[str, Results | None], link: str) -> str:
    experiment = next((one for one in EXPERIMENTS.values() if claim.id in one.claims), None)
    name = claim.id if experiment is None else f"[{claim.id}]({link}/{experiment.id}/README.md)"
    results = None if experiment is None else found[experiment.id]
    verdict = None if results is None else results.verdict(claim.id)
    if results is None or verdict is None:
        return _row(name, NO_EXPERIMENT if experiment is None else NOT_RUN, _printed(claim), "", "")
    beside = "; ".join(
        f"{one.variant}: {one.word}" for one in results.verdicts if one.claim == claim.id and one.variant
    )
    return _row(name, f"**{verdict.word}**", verdict.printed, verdict.outcome, beside)


def _section(experiment: Experiment, results: Results | None, claims: Mapping[str, Claim], link: str) -> list[str]:
    lines = [f"## {experiment.id} {experiment.title}", ""]
    if results is None:
        return [*lines, f"{NOT_RUN.capitalize()}. Expected: {experiment.cost} on two cores.", ""]
    lines += [_provenance(results), ""]
    if not experiment.claims:
        return [
            *lines,
            *(f"* {text}" for text in results.remarks),
            "",
            *_pictures(results.pictures, f"{link}/{experiment.id}/figures"),
        ]
    lines += [*_side_by_side(results.pictures, claims, f"{link}/{experiment.id}/figures")]
    return lines


def _side_by_side(pictures: Sequence[Shown], claims: Mapping[str, Claim], folder: str) -> list[str]:
    """Return each figure beside what the paper prints about it."""
    lines = ["| here | the paper |", "| --- | --- |"]
    for one in pictures:
        claim = claims[one.claim]
        lines.append(_row(f"![{one.name}]({folder}/{one.name}.svg) {one.caption}", f"{claim.where}: {_printed(claim)}"))
    return [*lines, ""]
