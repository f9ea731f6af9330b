"""A study folder: its files, its lock, and whether it holds this study or another one."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from turing_learning._files import PARTIAL, in_home
from turing_learning.runs import RunFolderError, refuse_future_format

if TYPE_CHECKING:
    from ._plan import Plan

FORMAT_VERSION = 1
FAILURE = "failure.json"  # in a run's folder: why it failed
_RESULTS = ("runs", "figures", "report.html", "runs.csv", "summary.csv", "convergence.csv", "study.json")


def is_study(path: str | Path) -> bool:
    """Return whether a folder holds a study of any version."""
    return _parsed(StudyFolder(Path(path)).study_path) is not None


def _parsed(path: Path) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and type(content.get("format_version")) is int else None


@dataclass(frozen=True)
class StudyFolder:
    """Where a study keeps its files.

    Parameters
    ----------
    path
        The folder; a leading ~ is the home folder.
    """

    path: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", in_home(self.path))

    @property
    def configuration_path(self) -> Path:
        """The resolved configuration of the first run (TOML)."""
        return self.path / "config.toml"

    @property
    def study_path(self) -> Path:
        """The settings in which each run differs (JSON)."""
        return self.path / "study.json"

    @property
    def figures_path(self) -> Path:
        """PNG and SVG pictures."""
        return self.path / "figures"

    @property
    def report_path(self) -> Path:
        """The page that shows it all."""
        return self.path / "report.html"

    def run_path(self, number: int) -> Path:
        """The folder of a run, whose number counts from 1."""
        return self.path / "runs" / f"{number:04d}"

    def plan(self) -> "Plan":
        """Return what the study runs.

        Raises
        ------
        RunFolderError
            If this is not a study folder, it has been changed, or a later version of the package has written it.
        """
        from turing_learning.config import ConfigurationError, load_configuration

        from ._plan import Plan

        content = _parsed(self.study_path)
        if content is None:
            raise RunFolderError(
                f"`study` must be a study folder; got {self.path} without a readable study.json. "
                "Give the folder that `study` has made."
            )
        refuse_future_format(content["format_version"], FORMAT_VERSION, self.study_path, "study")
        try:
            if content["configuration_sha256"] != _digest(self.configuration_path):
                raise RunFolderError(
                    f"`config.toml` must be as it was when the study began; got a changed one "
                    f"[{self.configuration_path}]. Restore it, or start a new study."
                )
            return Plan(load_configuration(self.configuration_path), tuple(content["runs"]))
        except (OSError, KeyError, TypeError, ConfigurationError) as error:
            raise RunFolderError(
                f"`study` must be as it was when it began; got {self.path}, whose files cannot be read ({error}). "
                "Restore them, or start a new study."
            ) from error

    def refuse_if_taken(self, plan: "Plan", *, force: bool) -> None:
        """Raise RunFolderError if something else is here, or a study of other settings that may not be replaced."""
        from turing_learning.runs import resume_command

        if is_study(self.path):
            if not force and (difference := _difference(self.plan(), plan)):
                raise RunFolderError(
                    f"{difference} [{self.path}]. Choose another folder, go on with the old study by "
                    f"`{resume_command(self.path)}`, or replace it with force=True."
                )
        elif others := self._foreign_names():
            raise RunFolderError(
                f"`out` must be a new or empty folder, or hold this study; got {self.path}, which holds {others[0]!r} "
                "and is not a study. Choose another folder."
            )

    def _foreign_names(self) -> list[str]:
        if not self.path.exists():
            return []
        started = {"lock", "config.toml"} if (self.path / "lock").exists() else set()
        names = (path.name for path in self.path.iterdir())
        return sorted(name for name in names if name not in started and not name.endswith(PARTIAL))

    def create(self, plan: "Plan", *, force: bool) -> None:
        """Make this the folder of a study, or leave it if it holds the same one; the caller holds the lock.

        Raises
        ------
        RunFolderError
            As `refuse_if_taken`.
        """
        from turing_learning.config import to_toml
        from turing_learning.runs import write_atomically, write_json

        self.refuse_if_taken(plan, force=force)
        if is_study(self.path):
            if not force:
                return
            self._clear()
        write_atomically(self.configuration_path, to_toml(plan.base).encode())
        content = {
            "format_version": FORMAT_VERSION,
            "scenario": plan.base.scenario.name,
            "configuration_sha256": _digest(self.configuration_path),
            "runs": list(plan.settings),
        }
        write_json(self.study_path, content)

    def _clear(self) -> None:
        for name in _RESULTS:  # study.json last: until then it is a study that may be replaced
            path = self.path / name
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the study for this process; the lock dies with it.

        Raises
        ------
        RunFolderError
            If another process holds it.
        """
        from filelock import FileLock, Timeout

        lock = FileLock(self.path / "lock", timeout=0)
        try:
            lock.acquire()
        except Timeout as error:
            raise RunFolderError(
                f"`study` must not be in use; got {self.path}, on which another process works. "
                "Wait until it ends, or stop it."
            ) from error
        try:
            yield
        finally:
            lock.release()


def _digest(path: Path) -> str:
    import hashlib

    return hashlib.sha256(path.read_bytes()).hexdigest()


def _difference(old: "Plan", new: "Plan") -> str:
    """Name the first setting in which two plans differ, nothing if there is none."""
    from turing_learning.config import PROSE, flat_settings

    before, after = flat_settings(old.base), flat_settings(new.base)
    for key in [*after, *before]:
        if key not in PROSE and before.get(key) != after.get(key):
            return _named(key, before.get(key), after.get(key), "")
    if len(old) != len(new):
        return _named("runs", len(old), len(new), "")
    for number, (one, other) in enumerate(zip(old.settings, new.settings, strict=True), start=1):
        for key in [*other, *one]:
            if one.get(key) != other.get(key):
                return _named(key, one.get(key), other.get(key), f" in run {number}")
    return ""


def _named(key: str, old: object, new: object, where: str) -> str:
    return f"`{key}` must be {old!r}{where}, as in the study that is in the folder; got {new!r}"
