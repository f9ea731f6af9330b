"""The folder of an experiment with its page, and the page of all claims."""

import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from turing_learning._files import SEALS, in_home, write_atomically, write_json
from turing_learning.errors import refuse, require
from turing_learning.figures import save_figure
from turing_learning.provenance import provenance
from turing_learning.report import is_page
from turing_learning.store import (
    LOCK,
    RunFolderError,
    Store,
    check_folder,
    refuse_format,
    reject_folder,
)
from turing_learning.targets import refuse_target

from ._experiment import PIECES, Experiment, Findings, Shown
from ._verdicts import RULES, Claim, ClaimVerdict, load_claims, prose
from .experiments import EXPERIMENTS, EXPERIMENTS_AS_PRINTED

FORMAT_VERSION = 1
FULL, FAST = "full", "fast"
AS_PRINTED = "as-printed"
"""Folder of the experiments with the paper's algorithm as it is, among the others."""


@dataclass(frozen=True, kw_only=True)
class Results:
    """What an experiment has left, as its folder holds it."""

    form: str  # "full" or "fast"
    verdicts: tuple[ClaimVerdict, ...]
    tables: tuple[Shown, ...]
    pictures: tuple[Shown, ...]
    remarks: tuple[str, ...] = ()  # sentences in Markdown
    seconds: float  # of computing, of all pieces of work
    provenance: dict[str, Any]  # versions, machine, time and commit of the results

    def verdict(self, claim: str) -> ClaimVerdict | None:
        """Return the verdict that counts for a claim."""
        for verdict in self.verdicts:
            if verdict.claim == claim and not verdict.variant:
                return verdict
        return None


@dataclass(frozen=True)
class ExperimentFolder:
    """The files of an experiment: ``pieces`` is large and not committed; ``results.json`` is written last."""

    path: Path

    def begin(self, experiment: Experiment, *, fast: bool) -> Store:
        """Make this the folder of one form of an experiment, if it is not; return the store of its pieces."""
        content = {
            "format_version": FORMAT_VERSION,
            "experiment": experiment.id,
            "form": FAST if fast else FULL,
            "sizes": experiment.fast if fast else experiment.full,
        }
        stored = self._read("configuration.json")
        if stored is None:
            self.path.mkdir(parents=True, exist_ok=True)
            write_json(self.path / "configuration.json", content)
            stored = content
        # Pieces of another form, or of other sizes, must not stand beside these.
        remedy = "Choose another folder with --out."
        for key in PIECES.identity:
            rule = f"be a folder of the same {key}, {content[key]!r}"
            value = stored.get(key)
            check_folder(
                value == content[key], "out", rule, repr(value), remedy, place=str(self.path)
            )
        store = Store(self.path / "pieces", PIECES)
        if not store.exists():
            store.create(content)
        return store

    def write(self, findings: Findings, *, fast: bool, seconds: float) -> None:
        """Write tables, figures, and the results, in this order; the pieces of work took so many seconds."""
        for name in ("tables", "figures"):
            (self.path / name).mkdir(exist_ok=True)
        for _, table, frame in findings.tables:
            # Six digits are more than any of the quantities has.
            text = frame.to_csv(index=False, float_format="%.6g", lineterminator="\n")
            write_atomically(self.path / "tables" / f"{table.name}.csv", text.encode())
        for picture, figure in findings.pictures:
            save_figure(figure, self.path / "figures", picture.name)
        now = provenance()
        conditions = {
            "finished": now["started"],
            "commit": now["commit"],
            "versions": now["versions"],
            "machine": {key: now["machine"][key] for key in ("processor", "processors")},
        }
        results = Results(
            form=FAST if fast else FULL,
            verdicts=tuple(findings.verdicts),
            tables=tuple(table for _, table, _ in findings.tables),
            pictures=tuple(picture for picture, _ in findings.pictures),
            remarks=tuple(findings.remarks),
            seconds=round(seconds, 1),
            provenance=conditions,
        )
        write_json(self.path / "results.json", {"format_version": FORMAT_VERSION} | asdict(results))

    def results(self) -> Results | None:
        """Return what is there; None if the experiment has not been finished here."""
        content = self._read("results.json")
        if content is None:
            return None
        try:
            return TypeAdapter(Results).validate_python(content)
        except ValidationError as error:
            wrong = {".".join(map(str, entry["loc"])): entry["msg"] for entry in error.errors()}
            remedy = "Restore it, or give the command again."
            location = str(self.path / "results.json")
            rule = "hold results"
            reject_folder("results.json", rule, f"something else: {wrong}", remedy, place=location)

    def pieces(self) -> int:
        """Return the number of pieces of work that have been begun."""
        other_files = {LOCK, SEALS, PIECES.head}
        names = [path.name for path in self.path.glob("pieces/[!.]*")]
        return sum(name not in other_files and ".damaged" not in name for name in names)

    def _read(self, name: str) -> dict[str, Any] | None:
        path = self.path / name
        about: dict[str, Any] = {"place": str(path), "error": RunFolderError}
        remedy = "Restore it, or choose another folder."
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, ValueError, RecursionError) as error:
            refuse(name, "be readable JSON", str(error), remedy, **about)
        require(isinstance(content, dict), name, "hold an object", content, remedy, **about)
        refuse_format(content.get("format_version"), FORMAT_VERSION, path, "experiment")
        return content


NOT_RUN = "not run yet"
MARK = "This page is made from the folders of the experiments:"
"""Words by which a page of all claims is recognized: it may be replaced."""
SECTIONS = ("3.2", "4.", "5-")
"""Beginnings of the ids of the claims that the page of all claims holds."""


def write_readme(experiment: Experiment, folder: ExperimentFolder) -> None:
    """Write the page of an experiment into its folder."""
    folder.path.mkdir(parents=True, exist_ok=True)
    write_atomically(folder.path / "README.md", readme(experiment, folder).encode())


def readme(experiment: Experiment, folder: ExperimentFolder) -> str:
    """Return the page of an experiment: what was claimed, what came out, every deviation and condition."""
    results = folder.results()
    # Four spaces make it a block of code in Markdown.
    command = f"    turing-learning reproduce {experiment.id}"
    title = f"# {experiment.id} {experiment.title}"
    if experiment.as_printed:
        command += " --as-printed"
        title += ", with the paper's algorithm as it is"
    if results is None:
        state = f"**Not run yet.** Expected: {experiment.cost} on two cores."
    elif results.form == FULL:
        state = _provenance(results)
    else:
        command += " --fast"
        state = "**The fast form: it shows that the experiment works, and proves nothing.**"
    blocks = [title, command, state]
    claims = load_claims()
    sections = {
        "What the paper prints": [
            f"{claims[id].where}: {_printed(claims[id])}" for id in experiment.claims
        ],
        "Conditions": experiment.conditions,
        "Deviations": experiment.deviations,
    }
    for heading, texts in sections.items():
        if texts:
            blocks += [f"## {heading}", _bullets(texts)]
    blocks += ["## Sizes", f"```json\n{json.dumps(experiment.full, indent=2)}\n```"]
    if results is not None:
        blocks += _what_came_out(experiment, folder, results)
    return "\n\n".join(blocks) + "\n"


def _what_came_out(experiment: Experiment, folder: ExperimentFolder, results: Results) -> list[str]:
    blocks = ["## What came out"]
    if results.remarks:
        blocks.append(_bullets(results.remarks))
    if results.verdicts:
        # In the order of the paper, variants after what counts
        rows = [("claim", "verdict", "printed", "came out")]
        for verdict in sorted(
            results.verdicts, key=lambda verdict: experiment.claims.index(verdict.claim)
        ):
            if verdict.variant:
                name = f"{verdict.claim}, {verdict.variant}"
            else:
                name = f"**{verdict.claim}**"
            rows.append((name, verdict.word, verdict.printed, verdict.outcome))
        rules = dict.fromkeys(verdict.rule for verdict in results.verdicts)
        blocks += [
            _table(rows),
            "When a claim agrees:",
            _bullets(f"{rule}: {RULES[rule]}." for rule in rules),
        ]
    blocks += _pictures(results.pictures, "figures")
    for table in results.tables:
        if table.inline:
            path = folder.path / "tables" / f"{table.name}.csv"
            frame = pd.read_csv(path, dtype=str, keep_default_na=False)
            blocks += [f"{table.caption}:", _table([frame.columns, *frame.map(_short).to_numpy()])]
    links = [
        f"[{table.name}](tables/{table.name}.csv): {table.caption}." for table in results.tables
    ]
    return [*blocks, "Tables:", _bullets(links)]


def page(experiments: str | Path, link: str = "../experiments") -> str:
    """Return the page of all claims of sections 3.2, 4 and 5 (Markdown), from the folders of the experiments.

    Only full-size results count; fast forms are as if they had not been run. `link` is the folder
    of the experiments as the page sees it.
    """
    claims = {id: claim for id, claim in load_claims().items() if id.startswith(SECTIONS)}
    finished: dict[str, Results] = {}
    links: dict[str, str] = {}
    for experiment in EXPERIMENTS.values():
        results = ExperimentFolder(in_home(experiments) / experiment.id).results()
        if results is not None and results.form == FULL:
            finished[experiment.id] = results
        links |= {
            claim: f"[{claim}]({link}/{experiment.id}/README.md)" for claim in experiment.claims
        }
    printed: dict[str, Results] = {}
    for id in EXPERIMENTS_AS_PRINTED:
        results = ExperimentFolder(in_home(experiments) / AS_PRINTED / id).results()
        if results is not None and results.form == FULL:
            printed[id] = results
    blocks = ["# Reproduction", *_score(claims, finished, links), prose()["introduction"].rstrip()]
    if printed:
        blocks += [
            "## The paper's algorithm in the paper's world",
            *_as_printed(printed, len(claims), link),
        ]
    blocks += ["## All claims", _table(_claim_rows(claims, finished, links))]
    for experiment in EXPERIMENTS.values():
        blocks.append(f"## {experiment.id} {experiment.title}")
        if experiment.id not in finished:
            blocks.append(f"{NOT_RUN.capitalize()}. Expected: {experiment.cost} on two cores.")
            continue
        results = finished[experiment.id]
        blocks.append(
            f"Full size, {results.provenance['finished'][:10]}: {results.seconds / 60:.0f} minutes. "
            f"[Details]({link}/{experiment.id}/README.md)."
        )
        # Of each claim the first picture is shown, where its last one stands.
        pictures: dict[str, Shown] = {}
        for picture in reversed(results.pictures):
            if "paper" not in picture.name:
                pictures[picture.claim] = picture
        blocks += _pictures(reversed(pictures.values()), f"{link}/{experiment.id}/figures")
    return "\n\n".join(blocks) + "\n"


def _as_printed(printed: Mapping[str, Results], claims: int, link: str) -> list[str]:
    """Say how claims fare with the paper's algorithm as it is, and list them."""
    verdicts = _verdicts_that_count(printed)
    agree = sum(verdict.agrees for verdict in verdicts.values())
    count = (
        f"Held against it so far: {len(verdicts)} of {claims} claims; **{agree}** of them agree."
    )
    rows: list[tuple[str, ...]] = [("claim", "verdict", "printed", "came out")]
    reasons = []
    differences = prose()["as_printed"]["differences"]
    for id, results in printed.items():
        for verdict in results.verdicts:
            if not verdict.variant:
                name = f"[{verdict.claim}]({link}/{AS_PRINTED}/{id}/README.md)"
                word = f"**{verdict.word}**"
                rows.append((name, word, verdict.printed, verdict.observed))
                if not verdict.agrees and verdict.claim in differences:
                    reasons.append(f"{name}: {differences[verdict.claim]}")
    blocks = [f"{prose()['as_printed']['introduction'].strip()} {count}", _table(rows)]
    if reasons:
        blocks.append(_bullets(reasons))
    return blocks


def _claim_rows(
    claims: Mapping[str, Claim], finished: Mapping[str, Results], links: Mapping[str, str]
) -> list[tuple[str, ...]]:
    """Return a heading, and a row for each claim with the verdict that counts."""
    verdicts = _verdicts_that_count(finished)
    rows: list[tuple[str, ...]] = [("claim", "verdict", "printed", "came out")]
    for id, claim in claims.items():
        if id in verdicts:
            verdict = verdicts[id]
            rows.append((links[id], f"**{verdict.word}**", verdict.printed, verdict.observed))
        else:
            rows.append((links[id], NOT_RUN, _printed(claim), ""))
    return rows


def _verdicts_that_count(finished: Mapping[str, Results]) -> dict[str, ClaimVerdict]:
    verdicts: dict[str, ClaimVerdict] = {}
    for results in finished.values():
        verdicts |= {verdict.claim: verdict for verdict in results.verdicts if not verdict.variant}
    return verdicts


def refuse_page_path(path: Path, *, force: bool, name: str = "path") -> None:
    """Raise ConfigurationError unless the page of all claims may be written to a path, by the name of what says so."""
    refuse_target(
        path, name=name, suffixes=(".md",), force=force, replaceable=partial(is_page, mark=MARK)
    )


def write_page(experiments: str | Path, path: str | Path, *, force: bool = False) -> Path:
    """Write the page of all claims, and the page of every experiment into its folder.

    Parameters
    ----------
    experiments
        The folder that holds a folder for each experiment.
    path
        The page, a name that ends with .md; links are made relative to it. One that was made so
        before is replaced.
    force
        Whether any other file is replaced, too; otherwise `ConfigurationError` is raised.
    """
    target = Path(path)
    experiments = in_home(experiments)
    refuse_page_path(target, force=force)
    for experiment in EXPERIMENTS.values():
        write_readme(experiment, ExperimentFolder(experiments / experiment.id))
    for experiment in EXPERIMENTS_AS_PRINTED.values():
        folder = ExperimentFolder(experiments / AS_PRINTED / experiment.id)
        if folder.results() is not None:
            write_readme(experiment, folder)
    link = Path(os.path.relpath(experiments, target.parent)).as_posix()
    write_atomically(target, page(experiments, link).encode())
    return target


def _score(
    claims: Mapping[str, Claim], finished: Mapping[str, Results], links: Mapping[str, str]
) -> list[str]:
    """Say how many claims agree, and of each that differs, how; then what the other variants have."""
    verdicts = {
        id: verdict for id, verdict in _verdicts_that_count(finished).items() if id in claims
    }
    agree = sum(verdict.agrees for verdict in verdicts.values())
    text = (
        f"{MARK} what the paper (W. Li, M. Gauci and R. Gross, *Turing learning*, Swarm Intelligence 10, 2016) "
        "claims in sections 3.2, 4 and 5, and what this implementation gives with its default preset. "
        f"Of {len(claims)} claims **{agree} agree** and **{len(verdicts) - agree} differ**"
    )
    # Nothing is left out of the score in silence
    missing = len(claims) - len(verdicts)
    blocks = [f"{text}; {missing} have not been run." if missing else f"{text}."]
    differing = [id for id in claims if id in verdicts and not verdicts[id].agrees]
    if differing:
        blocks.append(_bullets(f"{links[id]}: {prose()['differences'][id]}" for id in differing))
    comparisons = []
    for variant, words in prose()["variants"].items():
        agreements = []
        for results in finished.values():
            for verdict in results.verdicts:
                if verdict.claim in claims and verdict.variant == variant:
                    agreements.append(verdict.agrees)
        if agreements:
            comparisons.append(f"{words} {sum(agreements)} of {len(agreements)} claims agree")
    if comparisons:
        blocks.append(f"Other variants were held against some claims: {'; '.join(comparisons)}.")
    return blocks


def _provenance(results: Results) -> str:
    """Say when and where an experiment ran, and which commit wrote the tables."""

    def short(commit: str, unknown: str) -> str:
        dirty = "-dirty" if commit.endswith("-dirty") else ""
        return commit[:10] + dirty or unknown

    stored = results.provenance
    commits = f"tables of commit {short(stored['commit'] or '', 'unknown')}"
    # Results that were stored when pieces of work were counted by commit have these, too.
    if counts := stored.get("commits"):
        computed = ", ".join(
            f"{short(commit, 'not recorded')} ({count})" for commit, count in counts.items()
        )
        commits += f", runs and other pieces of work of commits {computed}"
    machine = stored["machine"]
    return (
        f"Run at full size: {stored['finished'][:10]}, {commits}, version "
        f"{stored['versions']['turing-learning']}, {machine['processors']} processors of {machine['processor']}; "
        f"{results.seconds / 60:.0f} minutes of computing, summed over the pieces of work."
    )


def _printed(claim: Claim) -> str:
    """Return what a claim prints; the name of a number in words: "share_mae_below_0_05" becomes "share MAE below 0.05"."""
    if claim.kind == "figure" and claim.seen:
        return claim.seen
    texts = []
    for name, value in claim.values.items():
        # These are of the scenario: the paper does not claim them.
        if name in ("parameters", "truth"):
            continue
        words = re.sub(r"(\d)_(\d)", r"\1.\2", name).replace("_", " ")
        words = re.sub(r"\b(m?ae)\b", lambda match: match[0].upper(), words)
        if isinstance(value, list):
            value = ", ".join(f"{number:g}" for number in value)
        texts.append(f"{words} {value}")
    return "; ".join(texts) or "a figure without printed numbers"


def _bullets(texts: Iterable[str]) -> str:
    return "\n".join(f"* {text}" for text in texts)


def _table(rows: Sequence[Iterable[str]]) -> str:
    """Return a table, the first row of which are its headings."""
    lines = [f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows]
    rule = f"| {' | '.join('---' for _ in rows[0])} |"
    return "\n".join([lines[0], rule, *lines[1:]])


def _pictures(pictures: Iterable[Shown], folder: str) -> list[str]:
    return [
        f"![{picture.name}]({folder}/{picture.name}.svg)\n\n*{picture.caption}*"
        for picture in pictures
    ]


def _short(cell: str) -> str:
    """Return a fraction with three digits, anything else as it is."""
    if "." not in cell and "e" not in cell:
        return cell
    try:
        return f"{float(cell):.3g}"
    except ValueError:
        return cell
