"""The folder of an experiment: configuration, pieces of work, tables, figures, results."""

import csv
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from turing_learning._files import write_atomically, write_json
from turing_learning.errors import require
from turing_learning.store import LOCK, SEALS, RunFolderError, Store, refuse_format

from ._verdicts import Verdict
from ._work import PIECES

if TYPE_CHECKING:
    from ._experiment import Experiment, Findings

FORMAT_VERSION = 1
FULL, FAST = "full", "fast"


@dataclass(frozen=True)
class Shown:
    """A table or figure that an experiment has left: its name, what it shows, the claim that it belongs to, and if it is inline."""

    name: str
    caption: str
    claim: str = ""
    inline: bool = False


@dataclass(frozen=True)
class Results:
    """What an experiment has left, as its folder holds it."""

    form: str  # "full" or "fast"
    verdicts: tuple[Verdict, ...]
    tables: tuple[Shown, ...]
    pictures: tuple[Shown, ...]
    seconds: float  # of computing, of all pieces of work
    provenance: dict[str, Any]  # versions, machine and time; the commits of the results, and of how many pieces of work
    remarks: tuple[str, ...] = ()  # sentences in Markdown

    def verdict(self, claim: str) -> Verdict | None:
        """Return the verdict that counts for a claim."""
        return next((one for one in self.verdicts if one.claim == claim and not one.variant), None)


@dataclass(frozen=True)
class ExperimentFolder:
    """Where an experiment keeps its files."""

    path: Path

    @property
    def pieces_path(self) -> Path:
        """Pieces of work; large, and not to be committed."""
        return self.path / "pieces"

    @property
    def results_path(self) -> Path:
        """Verdicts and what belongs to them (JSON), written last."""
        return self.path / "results.json"

    @property
    def readme_path(self) -> Path:
        """The page of the experiment."""
        return self.path / "README.md"

    def begin(self, experiment: "Experiment", *, fast: bool) -> Store:
        """Make this the folder of one form of an experiment, or leave it if it is; return the store of its pieces."""
        sizes = json.loads(json.dumps(asdict(experiment.fast if fast else experiment.full)))
        content = {
            "format_version": FORMAT_VERSION,
            "experiment": experiment.id,
            "form": FAST if fast else FULL,
            "sizes": sizes,
        }
        held = self._read(self.path / "configuration.json")
        if held is None:
            self.path.mkdir(parents=True, exist_ok=True)
            write_json(self.path / "configuration.json", content)
            held = content
        for key in PIECES.identity:
            if held.get(key) != content[key]:
                raise RunFolderError(
                    f"`out` must be a folder of the same {key}, {content[key]!r}; got {held.get(key)!r} [{self.path}]. "
                    "Choose another folder with --out."
                )
        store = Store(self.pieces_path, PIECES)
        if not store.exists():
            store.create(content)
        return store

    def write(self, findings: "Findings", *, fast: bool, seconds: float, commits: Mapping[str, int]) -> None:
        """Write tables, figures, and the results, in this order; see `Work` for seconds and commits."""
        from turing_learning.runs import new_manifest

        for name in ("tables", "figures"):
            (self.path / name).mkdir(exist_ok=True)
        for table in findings.tables:
            write_atomically(self.path / "tables" / f"{table.name}.csv", table.csv())
        for picture in findings.pictures:
            picture.save(self.path / "figures")
        manifest = new_manifest("", 0)
        provenance = {
            "finished": manifest["started"],
            "commit": manifest["commit"],
            "machine": {key: manifest["machine"][key] for key in ("processor", "processors")},
            "versions": manifest["versions"],
            "commits": dict(sorted(commits.items())),
        }
        write_json(
            self.results_path,
            {
                "format_version": FORMAT_VERSION,
                "form": FAST if fast else FULL,
                "verdicts": [asdict(verdict) for verdict in findings.verdicts],
                "tables": [asdict(Shown(table.name, table.caption, inline=table.inline)) for table in findings.tables],
                "pictures": [asdict(Shown(one.name, one.caption, one.title)) for one in findings.pictures],
                "remarks": list(findings.remarks),
                "seconds": round(seconds, 1),
                "provenance": provenance,
            },
        )

    def results(self) -> Results | None:
        """Return what is there; None if the experiment has not been finished here."""
        content = self._read(self.results_path)
        if content is None:
            return None
        try:
            return Results(
                form=content["form"],
                verdicts=tuple(Verdict(**one) for one in content["verdicts"]),
                tables=tuple(Shown(**one) for one in content["tables"]),
                pictures=tuple(Shown(**one) for one in content["pictures"]),
                seconds=content["seconds"],
                provenance=content["provenance"],
                remarks=tuple(content.get("remarks", ())),
            )
        except (KeyError, TypeError) as error:
            raise RunFolderError(
                f"`{self.results_path.name}` must hold results; got something else, without {error} [{self.results_path}]. "
                "Restore it, or give the command again."
            ) from error

    def table(self, name: str) -> list[list[str]]:
        """Return the rows of a table, its headings first."""
        with (self.path / "tables" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            return list(csv.reader(file))

    def pieces(self) -> int:
        """Return the number of pieces of work that have been begun."""
        own = {LOCK, SEALS, PIECES.head}
        return sum(path.name not in own and ".damaged" not in path.name for path in self.pieces_path.glob("[!.]*"))

    def _read(self, path: Path) -> dict[str, Any] | None:
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except (OSError, ValueError, RecursionError) as error:
            raise RunFolderError(
                f"`{path.name}` must be readable JSON; got {error} [{path}]. Restore it, or choose another folder."
            ) from error
        require(isinstance(content, dict), path.name, "hold an object", content, "Restore it, or choose another folder.",
                place=str(path), error=RunFolderError)  # fmt: skip
        refuse_format(content.get("format_version"), FORMAT_VERSION, path, "experiment")
        return content
