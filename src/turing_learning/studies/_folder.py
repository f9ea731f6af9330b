"""A study folder: its files, and whether it holds this study or another one."""

from functools import partial
from pathlib import Path
from typing import Any

from turing_learning._files import digest_of, file_digest
from turing_learning.config import ConfigurationError, flat_settings, load_configuration, to_toml
from turing_learning.config._sections import PROSE
from turing_learning.errors import is_integer, require
from turing_learning.results import resume_command
from turing_learning.store import SEALS, Kind, Place, RunFolderError, Store, reject_folder

from ._plan import Plan

SAMPLES = "genuine.npy"  # of a custom system
FAILURE = "failure.json"  # in a run's folder: why it failed
_IDENTITY = ("scenario", "configuration_sha256", "runs", "simulate")
STUDY = Kind("study", "study.json", identity=_IDENTITY, pieces=("config.toml", SAMPLES))
_TABLES = ("runs.csv", "summary.csv", "convergence.csv")
_RESULTS = ("runs", "figures", "report.html", *_TABLES, SAMPLES, SEALS, STUDY.head)


class ExecutorError(RuntimeError):
    """The workers cannot go on; what the runs have saved stays, and the study can be resumed."""


def is_study(path: str | Path) -> bool:
    """Return whether a folder holds a study of any version."""
    return StudyFolder(path).exists()


class StudyFolder(Store):
    """Where a study keeps its files.

    Parameters
    ----------
    path
        The folder; a leading ~ is the home folder.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, STUDY)

    configuration_path = Place("config.toml", "The resolved configuration of the first run (TOML).")
    study_path = Place(STUDY.head, "The settings in which each run differs (JSON).")
    figures_path = Place("figures", "PNG and SVG pictures.")
    report_path = Place("report.html", "The page that shows it all.")

    def run_path(self, number: int) -> Path:
        """The folder of a run, whose number counts from 1."""
        return self.path / "runs" / f"{number:04d}"

    def plan(self) -> Plan:
        """Return what the study runs.

        Raises
        ------
        RunFolderError
            If this is not a study folder, it has been changed, or a later version of the package has written
            it.
        """
        content, file, new = self.head(), self.configuration_path, "or start a new study."
        check = partial(require, error=RunFolderError)
        try:
            same, rule = content["configuration_sha256"] == file_digest(file), "be as it was when the study began"
            check(same, file.name, rule, "a changed one", f"Restore it, {new}", place=str(file))
            if not content["runs"] or any(not is_integer(run["run.seed"]) for run in content["runs"]):
                raise TypeError("no run, or one without a seed")  # noqa: TRY301
            return Plan(load_configuration(file), tuple(content["runs"]), str(content.get("simulate", "")))
        except (OSError, KeyError, TypeError, ConfigurationError) as error:
            got = f"{self.path}, whose files cannot be read ({error})"
            reject_folder("study", "be as it was when it began", got, f"Restore them, {new}")

    def refuse_if_taken(self, plan: Plan, *, force: bool) -> None:
        """Raise RunFolderError if something else is here, or a study of other settings that may not be replaced."""
        if self.exists():
            if not force and (difference := _difference(self.plan(), plan)):
                ahead = f"go on with the old study by `{resume_command(self.path)}`, or replace it with force=True."
                raise RunFolderError(f"{difference} [{self.path}]. Choose another folder, {ahead}")
            return
        others = [name for name in self.foreign_names() if name != "config.toml" or not (self.path / "lock").exists()]
        if others:
            rule, got = "be a new or empty folder, or hold this study", f"{self.path}, which holds {others[0]!r}"
            reject_folder("out", rule, f"{got} and is not a study", "Choose another folder.")

    def begin(self, plan: Plan, *, force: bool) -> None:
        """Make this the folder of a study, or leave it if it holds the same one; the caller holds the lock."""
        self.refuse_if_taken(plan, force=force)
        if self.exists():
            if not force:
                return
            self.clear(_RESULTS)  # study.json last: until then it is a study that may be replaced
        configuration = to_toml(plan.base).encode()
        head: dict[str, Any] = {"scenario": plan.base.scenario.name, "configuration_sha256": digest_of(configuration)}
        head |= {"runs": list(plan.settings)} | ({"simulate": plan.simulate} if plan.simulate else {})
        samples = {} if plan.samples is None else {SAMPLES: plan.samples}
        self.create(head, {self.configuration_path.name: configuration, **samples})


def _difference(old: Plan, new: Plan) -> str:
    """Name the first setting in which two plans differ, nothing if there is none."""
    before, after = flat_settings(old.base), flat_settings(new.base)
    pairs = [(key, before.get(key), after.get(key), "") for key in [*after, *before] if key not in PROSE]
    pairs += [("runs", len(old), len(new), ""), ("simulate", old.simulate, new.simulate, "")]
    for number, (one, other) in enumerate(zip(old.settings, new.settings, strict=False), start=1):
        pairs += [(key, one.get(key), other.get(key), f" in run {number}") for key in [*other, *one]]
    for key, was, wanted, where in pairs:
        if was != wanted:
            return f"`{key}` must be {was!r}{where}, as in the study that is in the folder; got {wanted!r}"
    return ""
