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
from turing_learning.store import LOCK, RunFolderError, Store, check_folder, refuse_format, reject_folder
from turing_learning.targets import refuse_target

from ._experiment import PIECES, Experiment, Findings, Shown
from ._verdicts import RULES, Claim, ClaimVerdict, load_claims, prose
from .experiments import EXPERIMENTS

FORMAT_VERSION = 1
FULL, FAST = "full", "fast"


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
        return next((one for one in self.verdicts if one.claim == claim and not one.variant), None)


@dataclass(frozen=True)
class ExperimentFolder:
    """The files of an experiment: ``pieces`` is large and not committed; ``results.json`` is written last."""

    path: Path

    def begin(self, experiment: Experiment, *, fast: bool) -> Store:
        """Make this the folder of one form of an experiment, if it is not; return the store of its pieces."""
        form, sizes = (FAST, experiment.fast) if fast else (FULL, experiment.full)
        content = {"format_version": FORMAT_VERSION, "experiment": experiment.id, "form": form, "sizes": sizes}
        held = self._read("configuration.json")
        if held is None:
            self.path.mkdir(parents=True, exist_ok=True)
            write_json(self.path / "configuration.json", content)
            held = content
        for key in PIECES.identity:
            check_folder(held.get(key) == content[key], "out", f"be a folder of the same {key}, {content[key]!r}",
                    repr(held.get(key)), "Choose another folder with --out.", place=str(self.path))  # fmt: skip
        store = Store(self.path / "pieces", PIECES)
        if not store.exists():
            store.create(content)
        return store

    def write(self, findings: Findings, *, fast: bool, seconds: float) -> None:
        """Write tables, figures, and the results, in this order; the pieces of work took so many seconds."""
        for name in ("tables", "figures"):
            (self.path / name).mkdir(exist_ok=True)
        for _, shown, frame in findings.tables:  # six digits are more than any of the quantities has
            text = frame.to_csv(index=False, float_format="%.6g", lineterminator="\n")
            write_atomically(self.path / "tables" / f"{shown.name}.csv", text.encode())
        for shown, figure in findings.pictures:
            save_figure(figure, self.path / "figures", shown.name)
        known = provenance()
        conditions = {"finished": known["started"], "commit": known["commit"], "versions": known["versions"]}
        conditions["machine"] = {key: known["machine"][key] for key in ("processor", "processors")}
        results = Results(
            form=FAST if fast else FULL,
            verdicts=tuple(findings.verdicts),
            tables=tuple(shown for _, shown, _ in findings.tables),
            pictures=tuple(shown for shown, _ in findings.pictures),
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
            wrong = {".".join(map(str, one["loc"])): one["msg"] for one in error.errors()}
            reject_folder("results.json", "hold results", f"something else: {wrong}", "Restore it, or give the command again.",
                   place=str(self.path / "results.json"))  # fmt: skip

    def pieces(self) -> int:
        """Return the number of pieces of work that have been begun."""
        own = {LOCK, SEALS, PIECES.head}
        return sum(path.name not in own and ".damaged" not in path.name for path in self.path.glob("pieces/[!.]*"))

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
MADE = "This page is made from the folders of the experiments:"  # by which the page of all claims is known
SECTIONS = ("3.2", "4.", "5-")  # of the paper, whose claims the page of all claims holds


def write_readme(experiment: Experiment, folder: ExperimentFolder) -> None:
    """Write the page of an experiment into its folder."""
    folder.path.mkdir(parents=True, exist_ok=True)
    write_atomically(folder.path / "README.md", readme(experiment, folder).encode())


def readme(experiment: Experiment, folder: ExperimentFolder) -> str:
    """Return the page of an experiment: what was claimed, what came out, every deviation and condition."""
    results, claims = folder.results(), load_claims()
    command = f"    turing-learning reproduce {experiment.id}"
    if results is None:
        state = f"**Not run yet.** Expected: {experiment.cost} on two cores."
    elif results.form == FULL:
        state = _provenance(results)
    else:
        command += " --fast"
        state = "**The fast form: it shows that the experiment works, and proves nothing.**"
    blocks = [f"# {experiment.id} {experiment.title}", command, state]
    printed = [f"{claims[claim].where}: {_printed(claims[claim])}" for claim in experiment.claims]
    for heading, texts in (
        ("What the paper prints", printed), ("Conditions", experiment.conditions), ("Deviations", experiment.deviations),
    ):  # fmt: skip
        blocks += [f"## {heading}", _bullets(texts)] if texts else []
    blocks += ["## Sizes", f"```json\n{json.dumps(experiment.full, indent=2)}\n```"]
    if results is not None:
        blocks += ["## What came out", *([_bullets(results.remarks)] if results.remarks else [])]
        if results.verdicts:
            rows = [("claim", "verdict", "printed", "came out")]
            for verdict in sorted(results.verdicts, key=lambda one: experiment.claims.index(one.claim)):
                name = f"{verdict.claim}, {verdict.variant}" if verdict.variant else f"**{verdict.claim}**"
                rows.append((name, verdict.word, verdict.printed, verdict.outcome))
            used = dict.fromkeys(one.rule for one in results.verdicts)
            rules = [f"{rule}: {RULES[rule]}." for rule in used]
            blocks += [_table(rows), "When a claim agrees:", _bullets(rules)]
        blocks += _pictures(results.pictures, "figures")
        for table in (one for one in results.tables if one.inline):
            frame = pd.read_csv(folder.path / "tables" / f"{table.name}.csv", dtype=str, keep_default_na=False)
            blocks += [f"{table.caption}:", _table([frame.columns, *frame.map(_short).to_numpy()])]
        blocks += [
            "Tables:",
            _bullets(f"[{one.name}](tables/{one.name}.csv): {one.caption}." for one in results.tables),
        ]
    return "\n\n".join(blocks) + "\n"


def page(experiments: str | Path, link: str = "../experiments") -> str:
    """Return the page of all claims of sections 3.2, 4 and 5 (Markdown), from the folders of the experiments.

    Only full-size results count; fast forms are as if they had not been run. `link` is the folder of the
    experiments as the page sees it.
    """
    claims = {name: claim for name, claim in load_claims().items() if name.startswith(SECTIONS)}
    stored = {id: ExperimentFolder(in_home(experiments) / id).results() for id in EXPERIMENTS}
    found = {id: results for id, results in stored.items() if results is not None and results.form == FULL}
    pages = {claim: f"[{claim}]({link}/{one.id}/README.md)" for one in EXPERIMENTS.values() for claim in one.claims}
    counted = {one.claim: one for results in found.values() for one in results.verdicts if not one.variant}
    rows: list[tuple[str, ...]] = [("claim", "verdict", "printed", "came out")]
    for claim in claims.values():
        own = counted.get(claim.id)
        fate = (f"**{own.word}**", own.printed, own.observed) if own else (NOT_RUN, _printed(claim), "")
        rows.append((pages[claim.id], *fate))
    blocks = ["# Reproduction", *_score(claims, found, pages), prose()["introduction"].rstrip()]
    blocks += ["## All claims", _table(rows)]
    for experiment in EXPERIMENTS.values():
        blocks.append(f"## {experiment.id} {experiment.title}")
        if experiment.id not in found:
            blocks.append(f"{NOT_RUN.capitalize()}. Expected: {experiment.cost} on two cores.")
            continue
        results = found[experiment.id]
        blocks.append(
            f"Full size, {results.provenance['finished'][:10]}: {results.seconds / 60:.0f} minutes. "
            f"[Details]({link}/{experiment.id}/README.md)."
        )
        first = {one.claim: one for one in reversed(results.pictures) if "paper" not in one.name}  # of each claim
        blocks += _pictures(reversed(first.values()), f"{link}/{experiment.id}/figures")
    return "\n\n".join(blocks) + "\n"


def refuse_page_path(path: Path, *, force: bool, name: str = "path") -> None:
    """Raise ConfigurationError unless the page of all claims may be written to a path, by the name of what says so."""
    refuse_target(path, name=name, suffixes=(".md",), force=force, replaceable=partial(is_page, mark=MADE))


def write_page(experiments: str | Path, path: str | Path, *, force: bool = False) -> Path:
    """Write the page of all claims, and the page of every experiment into its folder.

    Parameters
    ----------
    experiments
        The folder that holds a folder for each experiment.
    path
        The page, a name that ends with .md; links are made relative to it. One that was made so before is
        replaced.
    force
        Whether any other file is replaced, too; otherwise `ConfigurationError` is raised.
    """
    target, experiments = Path(path), in_home(experiments)
    refuse_page_path(target, force=force)
    for experiment in EXPERIMENTS.values():
        write_readme(experiment, ExperimentFolder(experiments / experiment.id))
    link = Path(os.path.relpath(experiments, target.parent)).as_posix()
    write_atomically(target, page(experiments, link).encode())
    return target


def _score(claims: Mapping[str, Claim], found: Mapping[str, Results], pages: Mapping[str, str]) -> list[str]:
    """Say how many claims agree, and of each that differs, how; then what the other variants have."""
    verdicts = [one for results in found.values() for one in results.verdicts if one.claim in claims]
    counted = {one.claim: one.agrees for one in verdicts if not one.variant}
    agree, left = sum(counted.values()), len(claims) - len(counted)
    blocks = [
        f"{MADE} what the paper (W. Li, M. Gauci and R. Gross, *Turing learning*, Swarm Intelligence 10, 2016) claims in "
        "sections 3.2, 4 and 5, and what this implementation gives with its default preset. "
        f"Of {len(claims)} claims **{agree} agree** and **{len(counted) - agree} differ**"
        + (f"; {left} have not been run." if left else ".")
    ]
    differ = [f"{pages[claim]}: {prose()['differences'][claim]}" for claim in claims if not counted.get(claim, True)]
    beside = []
    for variant, words in prose()["variants"].items():
        of = [one.agrees for one in verdicts if one.variant == variant]
        beside += [f"{words} {sum(of)} of {len(of)} claims agree"] if of else []
    blocks += [_bullets(differ)] if differ else []
    return blocks + ([f"Other variants were held against some claims: {'; '.join(beside)}."] if beside else [])


def _provenance(results: Results) -> str:
    """Say when and where an experiment ran, and which commit wrote the tables."""

    def digits(commit: str, none: str) -> str:
        return commit[:10] + ("-dirty" if commit.endswith("-dirty") else "") or none

    found, machine = results.provenance, results.provenance["machine"]
    commits = f"tables of commit {digits(found['commit'] or '', 'unknown')}"
    if counts := found.get("commits"):  # of results that were stored when pieces of work were counted by commit
        computed = ", ".join(f"{digits(commit, 'not recorded')} ({count})" for commit, count in counts.items())
        commits += f", runs and other pieces of work of commits {computed}"
    return (
        f"Run at full size: {found['finished'][:10]}, {commits}, version "
        f"{found['versions']['turing-learning']}, {machine['processors']} processors of {machine['processor']}; "
        f"{results.seconds / 60:.0f} minutes of computing, summed over the pieces of work."
    )


def _printed(claim: Claim) -> str:
    """Return what a claim prints; the name of a number in words: "share_mae_below_0_05" becomes "share MAE below 0.05"."""
    if claim.kind == "figure" and claim.seen:
        return claim.seen
    texts = []
    for name, value in claim.values.items():
        if name not in ("parameters", "truth"):
            words = re.sub(r"(\d)_(\d)", r"\1.\2", name).replace("_", " ")
            words = re.sub(r"\b(m?ae)\b", lambda found: found[0].upper(), words)
            texts.append(f"{words} {', '.join(f'{item:g}' for item in value) if isinstance(value, list) else value}")
    return "; ".join(texts) or "a figure without printed numbers"


def _bullets(texts: Iterable[str]) -> str:
    return "\n".join(f"* {text}" for text in texts)


def _table(rows: Sequence[Iterable[str]]) -> str:
    """Return a table, the first row of which are its headings."""
    head, *lines = [f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows]
    return "\n".join([head, f"| {' | '.join('---' for _ in rows[0])} |", *lines])


def _pictures(pictures: Iterable[Shown], folder: str) -> list[str]:
    return [f"![{one.name}]({folder}/{one.name}.svg)\n\n*{one.caption}*" for one in pictures]


def _short(cell: str) -> str:
    """Return a fraction with three digits, anything else as it is."""
    try:
        return f"{float(cell):.3g}" if "." in cell or "e" in cell else cell
    except ValueError:
        return cell
