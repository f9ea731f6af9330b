"""The folder of an experiment: configuration, pieces of work, tables, figures, results."""

import csv
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from turing_learning._files import write_atomically, write_json
from turing_learning.errors import refuse, require
from turing_learning.store import LOCK, SEALS, RunFolderError, Store, refuse_format

from ._experiment import Experiment, Findings
from ._verdicts import ClaimVerdict
from ._work import PIECES

FORMAT_VERSION = 1
FULL, FAST = "full", "fast"


@dataclass(frozen=True)
class Shown:
    """A table or figure that an experiment has left."""

    name: str
    caption: str
    claim: str = ""  # that it belongs to
    inline: bool = False


@dataclass(frozen=True)
class Results:
    """What an experiment has left, as its folder holds it."""

    form: str  # "full" or "fast"
    verdicts: tuple[ClaimVerdict, ...]
    tables: tuple[Shown, ...]
    pictures: tuple[Shown, ...]
    remarks: tuple[str, ...]  # sentences in Markdown
    seconds: float  # of computing, of all pieces of work
    provenance: dict[str, Any]  # versions, machine, time and commit of the results

    def verdict(self, claim: str) -> ClaimVerdict | None:
        """Return the verdict that counts for a claim."""
        return next((one for one in self.verdicts if one.claim == claim and not one.variant), None)


@dataclass(frozen=True)
class ExperimentFolder:
    """The files of an experiment.

    ``pieces`` holds the pieces of work; it is large, and not to be committed. ``results.json`` holds the verdicts and what belongs
    to them, and is written last.
    """

    path: Path

    @property
    def readme_path(self) -> Path:
        """The page of the experiment."""
        return self.path / "README.md"

    def begin(self, experiment: Experiment, *, fast: bool) -> Store:
        """Make this the folder of one form of an experiment, or leave it if it is; return the store of its pieces."""
        form, sizes = (FAST, experiment.fast) if fast else (FULL, experiment.full)
        content = {"format_version": FORMAT_VERSION, "experiment": experiment.id, "form": form}
        content["sizes"] = json.loads(json.dumps(asdict(sizes)))
        held = self._read("configuration.json")
        if held is None:
            self.path.mkdir(parents=True, exist_ok=True)
            write_json(self.path / "configuration.json", content)
            held = content
        for key in PIECES.identity:
            require(held.get(key) == content[key], "out", f"be a folder of the same {key}, {content[key]!r}",
                    repr(held.get(key)), "Choose another folder with --out.", place=str(self.path),
                    error=RunFolderError)  # fmt: skip
        store = Store(self.path / "pieces", PIECES)
        if not store.exists():
            store.create(content)
        return store

    def write(self, findings: Findings, *, fast: bool, seconds: float) -> None:
        """Write tables, figures, and the results, in this order; the pieces of work took so many seconds."""
        from turing_learning.runs import new_manifest

        for name in ("tables", "figures"):
            (self.path / name).mkdir(exist_ok=True)
        for table in findings.tables:
            write_atomically(self.path / "tables" / f"{table.name}.csv", table.csv())
        for picture in findings.pictures:
            picture.save(self.path / "figures")
        manifest = new_manifest("", 0)
        provenance = {"finished": manifest["started"], "commit": manifest["commit"], "versions": manifest["versions"]}
        provenance["machine"] = {key: manifest["machine"][key] for key in ("processor", "processors")}
        results = Results(
            form=FAST if fast else FULL,
            verdicts=tuple(findings.verdicts),
            tables=tuple(Shown(table.name, table.caption, inline=table.inline) for table in findings.tables),
            pictures=tuple(Shown(one.name, one.caption, one.title) for one in findings.pictures),
            remarks=tuple(findings.remarks),
            seconds=round(seconds, 1),
            provenance=provenance,
        )
        write_json(self.path / "results.json", {"format_version": FORMAT_VERSION} | asdict(results))

    def results(self) -> Results | None:
        """Return what is there; None if the experiment has not been finished here."""
        content = self._read("results.json")
        if content is None:
            return None
        try:
            tables, pictures = (tuple(Shown(**one) for one in content[name]) for name in ("tables", "pictures"))
            verdicts, remarks = (
                tuple(ClaimVerdict(**one) for one in content["verdicts"]),
                tuple(content.get("remarks", ())),
            )
            about = (content[name] for name in ("seconds", "provenance"))
            return Results(content["form"], verdicts, tables, pictures, remarks, *about)
        except (KeyError, TypeError) as error:
            refuse("results.json", "hold results", f"something else, without {error}", "Restore it, or give the command again.",
                   place=str(self.path / "results.json"), error=RunFolderError)  # fmt: skip

    def table(self, name: str) -> list[list[str]]:
        """Return the rows of a table, its headings first."""
        with (self.path / "tables" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            return list(csv.reader(file))

    def pieces(self) -> int:
        """Return the number of pieces of work that have been begun."""
        own = {LOCK, SEALS, PIECES.head}
        return sum(path.name not in own and ".damaged" not in path.name for path in self.path.glob("pieces/[!.]*"))

    def _read(self, name: str) -> dict[str, Any] | None:
        path = self.path / name
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, ValueError, RecursionError) as error:
            refuse(name, "be readable JSON", str(error), "Restore it, or choose another folder.", place=str(path),
                   error=RunFolderError)  # fmt: skip
        require(isinstance(content, dict), name, "hold an object", content, "Restore it, or choose another folder.",
                place=str(path), error=RunFolderError)  # fmt: skip
        refuse_format(content.get("format_version"), FORMAT_VERSION, path, "experiment")
        return content
