"""A run folder: its files, its lock, and whether it is one."""

import shlex
import shutil
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from turing_learning._files import PARTIAL, in_home
from turing_learning.config import Configuration, ConfigurationError, load_configuration, to_toml

from ._errors import RunFolderError, refuse_future_format, storage
from ._files import remove_partial, write_atomically, write_json
from ._manifest import FORMAT_VERSION, RUNNING, digest, new_manifest, parse_manifest

LABORATORY, CAMERA = "laboratory.json", "camera.json"
_RESULTS = (
    "result.json", "report.html", "checkpoints", "history.zarr", "figures", "check", "calibration.npz", "trials",
    "events.jsonl", "post_evaluation.json", LABORATORY, CAMERA,
)  # fmt: skip


def resume_command(path: Path) -> str:
    """Return the command that goes on with a run, to be pasted into a shell."""
    return f"turing-learning resume {shlex.quote(str(path))}"


def going_on(path: Path, configuration: Configuration) -> str:
    """Return how to go on with a run, in code: by a command, or by a call where a custom system has to be given."""
    own = bool(configuration.system.resuming)
    return f"`turing_learning.resume({str(path)!r}, genuine=..., simulate=...)`" if own else f"`{resume_command(path)}`"


@dataclass(frozen=True)
class RunFolder:
    """Where a run keeps its files.

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
        """The resolved configuration (TOML)."""
        return self.path / "config.toml"

    @property
    def manifest_path(self) -> Path:
        """What ran where (JSON)."""
        return self.path / "manifest.json"

    @property
    def result_path(self) -> Path:
        """What was inferred (JSON)."""
        return self.path / "result.json"

    @property
    def history_path(self) -> Path:
        """Every generation's populations (Zarr)."""
        return self.path / "history.zarr"

    @property
    def checkpoints_path(self) -> Path:
        """From where a run goes on."""
        return self.path / "checkpoints"

    @property
    def figures_path(self) -> Path:
        """PNG and SVG pictures."""
        return self.path / "figures"

    @property
    def report_path(self) -> Path:
        """The page that shows it all."""
        return self.path / "report.html"

    @property
    def laboratory_path(self) -> Path:
        """The laboratory in which the run takes place (JSON); only such a run has one."""
        return self.path / LABORATORY

    @property
    def motion_path(self) -> Path:
        """Motion to calibrate detectors with (NumPy)."""
        return self.path / "calibration.npz"

    @property
    def trials_path(self) -> Path:
        """Every trial that was observed in a laboratory."""
        return self.path / "trials"

    @property
    def events_path(self) -> Path:
        """What happened in the laboratory (a JSON object in each line)."""
        return self.path / "events.jsonl"

    @property
    def post_evaluation_path(self) -> Path:
        """What the last models are worth when they are observed again in the laboratory (JSON)."""
        return self.path / "post_evaluation.json"

    @property
    def lock_path(self) -> Path:
        """Held by the process that writes."""
        return self.path / "lock"

    def manifest(self) -> dict[str, Any]:
        """Return the manifest.

        Raises
        ------
        RunFolderError
            If this is not a run folder, or one that a later version of the package has written.
        """
        try:
            manifest = parse_manifest(self.manifest_path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError):
            manifest = None
        if manifest is None:
            raise RunFolderError(
                f"`run` must be a run folder; got {self.path} without a readable manifest.json. "
                "Give the folder that `infer` has made."
            )
        refuse_future_format(manifest["format_version"], FORMAT_VERSION, self.manifest_path, "run")
        if not isinstance(manifest.get("state"), str):
            raise RunFolderError(
                f"`run` must be a run folder; got {self.path}, whose manifest has no state [{self.manifest_path}]. "
                "Restore the file."
            )
        return manifest

    def is_run(self) -> bool:
        """Return whether this is a run folder of any version."""
        try:
            return parse_manifest(self.manifest_path.read_text(encoding="utf-8")) is not None
        except (OSError, UnicodeDecodeError):
            return False

    def begun(self) -> tuple[Any, Any]:
        """Return when the run in this folder began, and with which configuration: it keeps both for good, and no other has both."""
        manifest = self.manifest()
        return manifest.get("started"), manifest.get("configuration_sha256")

    def require_there(self, begun: tuple[Any, Any]) -> None:
        """Raise RunFolderError if a run that was here, see `begun`, is not any more, before anything is read or written."""
        if not self.is_run():
            raise RunFolderError(
                f"`run` must be in its folder; got {self.path}, where it is not any more. Open it from where it is now: "
                "turing_learning.load_run(...)."
            )
        if self.begun() != begun:
            raise RunFolderError(
                f"`run` must be in its folder; got {self.path}, where another run has taken its place. Make it again, with an "
                "`out` of its own."
            )

    def configuration(self) -> Configuration:
        """Return the stored configuration.

        Raises
        ------
        RunFolderError
            If it is missing or has been changed since the run began.
        """
        manifest = self.manifest()
        try:
            text = self.configuration_path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise RunFolderError(
                f"`run` must hold its configuration; got {self.path} without a readable config.toml. Restore the file."
            ) from error
        if digest(text) != manifest.get("configuration_sha256"):
            raise RunFolderError(
                f"`config.toml` must be as it was when the run began; got a changed one [{self.configuration_path}]. "
                "Restore it, or start a new run with `infer --config`."
            )
        try:
            return load_configuration(self.configuration_path)
        except ConfigurationError as error:
            raise RunFolderError(str(error)) from error

    def update_manifest(self, **changes: Any) -> None:
        """Change entries of the manifest."""
        write_json(self.manifest_path, self.manifest() | changes)

    def create(self, configuration: Configuration, *, force: bool, files: Mapping[str, bytes] | None = None) -> None:
        """Make this the folder of a new run; the caller holds the lock.

        Parameters
        ----------
        configuration
            What will run.
        force
            Whether a run that is here already may be replaced.
        files
            Name -> content of what else the run needs.

        Raises
        ------
        RunFolderError
            If something else is here, or a run that may not be replaced.
        """
        self.refuse_if_taken(force=force)
        if self.is_run():
            write_json(self.manifest_path, {"format_version": FORMAT_VERSION, "state": RUNNING, "replaced": True})
            self.clear()
        remove_partial(self.path)
        for name, content in (files or {}).items():
            write_atomically(self.path / name, content)
        text = to_toml(configuration)
        write_atomically(self.configuration_path, text.encode())
        write_json(self.manifest_path, new_manifest(text, configuration.run.seed))

    def refuse_if_taken(self, *, force: bool) -> None:
        """Raise RunFolderError if a new run may not be written here."""
        if self.is_run():
            if not force:
                raise RunFolderError(
                    f"`out` must be a new or empty folder; got {self.path}, which holds a run. "
                    f"Go on with {self._ahead()}, choose another folder, or replace it with force=True."
                )
        elif others := self._foreign_names():
            raise RunFolderError(
                f"`out` must be a new or empty folder; got {self.path}, which holds {others[0]!r} and is not a run. "
                "Choose another folder."
            )

    def _ahead(self) -> str:
        try:
            return going_on(self.path, self.configuration())
        except RunFolderError:  # which says more once it is tried
            return f"`{resume_command(self.path)}`"

    def _foreign_names(self) -> list[str]:
        if not self.path.exists():
            return []
        begun = {self.lock_path.name, self.configuration_path.name, LABORATORY, CAMERA}
        started = begun if self.lock_path.exists() else set()
        names = (path.name for path in self.path.iterdir())
        return sorted(name for name in names if name not in started and not name.endswith(PARTIAL))

    def clear(self) -> None:
        """Remove all results, and leave configuration and manifest."""
        for name in _RESULTS:
            path = self.path / name
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)

    def storage(self) -> AbstractContextManager[None]:
        """Say of a folder that cannot be written any further how to go on with its run, which needs nothing else."""
        return storage(self.path, f"go on with `{resume_command(self.path)}`.")

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the folder for this process; the lock dies with it.

        Raises
        ------
        RunFolderError
            If another process holds it.
        """
        from filelock import FileLock, Timeout

        lock = FileLock(self.lock_path, timeout=0)
        try:
            lock.acquire()
        except Timeout as error:
            raise RunFolderError(
                f"`run` must not be in use; got {self.path}, to which {self._holder()} is writing. "
                "Wait until it ends, or stop it."
            ) from error
        try:
            yield
        finally:
            lock.release()

    def _holder(self) -> str:
        try:
            process = (parse_manifest(self.manifest_path.read_text(encoding="utf-8")) or {}).get("process") or {}
        except (OSError, UnicodeDecodeError):
            process = {}
        return (
            f"process {process['pid']} on {process['host']}" if {"pid", "host"} <= set(process) else "another process"
        )
