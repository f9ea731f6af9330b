"""A run folder: its files, its checkpoints, and what ran there."""

import io
import logging
import re
import shlex
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import digest_of, remove_partial, write_atomically
from turing_learning.config import Configuration, load_configuration, to_toml
from turing_learning.errors import Call, Setting, refusing_as
from turing_learning.evolution import state_part
from turing_learning.families import Network, RecordedSystem, is_model
from turing_learning.provenance import now, provenance, this_process, versions
from turing_learning.store import (
    FolderKind,
    Store,
    StoredPath,
    check_folder,
    reject_folder,
    storage,
)
from turing_learning.store import RunFolderError as RunFolderError
from turing_learning.systems import Arguments, System, imported

FORMAT_VERSION = 1
BLOCK_GENERATIONS = 5000
"""Generations whose traces, what a result is made of, have a file of their own; those since the last
such block are in every checkpoint."""
RUNNING = "running"
"""State of a run that continues, or was killed."""
STOPPED = "stopped"
"""State of a run that was asked to stop."""
FINISHED = "finished"
"""State of a run of which everything is there, figures and report too."""

# In the manifest: file and options of the recording that the command line began a run with
RECORDING = "recording"
LABORATORY, CAMERA, CALIBRATION = "laboratory.json", "camera.json", "calibration.npz"
NETWORK = "network.safetensors"
"""File of a run folder that holds the network that was learned for it."""
# Positions of recorded individuals and of replicas, for the report
MOTION = "motion.npz"
DIALOGUES = "dialogues.npz"  # what the best interrogators do, for the report
_RESULTS = (
    "result.json", "report.html", "checkpoints", "traces", "buffer", "history.zarr", "figures", "check", CALIBRATION, MOTION,
    DIALOGUES,
    "trials", "pool.json", "events.jsonl", "post_evaluation.json", LABORATORY, CAMERA,
    NETWORK,
)  # fmt: skip
_KIND = FolderKind(
    "run",
    "manifest.json",
    identity=("started", "configuration_sha256"),
    newest=FORMAT_VERSION,
    beside=("config.toml",),
)
_CHECKPOINT = re.compile(r"^generation-(\d{6,})-([0-9a-f]{16})\.npz$")
CHECKPOINTS_KEPT = 2
CONFIGURATION = "configuration_sha256"
"""Among the arrays of a checkpoint: to which configuration it belongs."""
_LOGGER = logging.getLogger("turing_learning")


def resume_command(path: Path) -> str:
    """Return the command that resumes a run, to be pasted into a shell."""
    return f"turing-learning resume {shlex.quote(str(path))}"


def how_to_resume(path: Path, configuration: Configuration) -> Call | str:
    """Return how to resume a run.

    By a command, or by a call where something has to be given that the folder does not name.
    """
    settings = (*configuration.system.resuming, *configuration.given)
    remembered = RunFolder(path).known_parts()
    needed = tuple(setting for setting in settings if setting.name not in remembered)
    if needed:
        return Call("resume", str(path), needed)
    return f"`{resume_command(path)}`"


def _recorded(manifest: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return what `RecordedSystem.entry` wrote into a manifest; None of a run on no recording."""
    entry = manifest.get(RECORDING)
    return entry if isinstance(entry, Mapping) else None


def _recorded_options(manifest: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return how the recording was read, and by what it is imitated, see `RecordedSystem`; nothing without."""
    options = (_recorded(manifest) or {}).get("options")
    return options if isinstance(options, Mapping) else {}


@dataclass(frozen=True)
class Checkpoint:
    """The state of a run after so many completed generations, or batches: name -> array."""

    generation: int
    arrays: dict[str, np.ndarray]

    def part(self, prefix: str) -> dict[str, np.ndarray]:
        """Return the arrays whose names start with a prefix, without it."""
        return state_part(self.arrays, prefix)


class RunFolder(Store):
    """Where a run keeps its files.

    Parameters
    ----------
    path
        The folder; a leading ~ is the home folder.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, _KIND)

    configuration_path = StoredPath("config.toml", "The resolved configuration (TOML).")
    manifest_path = StoredPath("manifest.json", "What ran where (JSON).")
    result_path = StoredPath("result.json", "What was inferred (JSON).")
    history_path = StoredPath("history.zarr", "Every generation's populations (Zarr).")
    checkpoints_path = StoredPath("checkpoints", "From where a run is resumed.")
    figures_path = StoredPath("figures", "PNG and SVG pictures.")
    report_path = StoredPath("report.html", "The page that shows it all.")
    laboratory_path = StoredPath(
        LABORATORY, "The laboratory in which the run takes place (JSON); only such a run has one."
    )
    calibration_path = StoredPath(CALIBRATION, "Motion to calibrate detectors with (NumPy).")
    trials_path = StoredPath("trials", "Every trial that was observed in a laboratory.")
    events_path = StoredPath(
        "events.jsonl", "What happened in the laboratory (a JSON object in each line)."
    )
    post_evaluation_path = StoredPath(
        "post_evaluation.json", "What the last models are worth when observed again (JSON)."
    )
    lock_path = StoredPath("lock", "Held by the process that writes.")

    def is_run(self) -> bool:
        """Return whether this is a run folder of any version."""
        return self.exists()

    def is_spent(self) -> bool:
        """Return whether all batches or generations of a run are stored; it may have no result yet."""
        with suppress(RunFolderError):
            return stored_generations(self.checkpoints_path) >= self.configuration().length
        return False

    def manifest(self) -> dict[str, Any]:
        """Return the manifest; reject a folder that is no run, or one of a later version, with a RunFolderError."""
        if not self.exists():
            got = f"{self.path} without a readable manifest.json"
            remedy = "Give the folder that `infer` has made."
            reject_folder("run", "be a run folder", got, remedy)
        manifest = self.head()
        if not isinstance(manifest.get("state"), str):
            got = f"{self.path}, whose manifest has no state"
            rule = "be a run folder"
            reject_folder("run", rule, got, "Restore the file.", place=str(self.manifest_path))
        return manifest

    def begun(self) -> tuple[Any, Any]:
        """Return when the run in this folder began, and with which configuration.

        Together they are its own.
        """
        manifest = self.manifest()
        return manifest.get("started"), manifest.get("configuration_sha256")

    def require_there(self, begun: tuple[Any, Any]) -> None:
        """Reject a folder in which a run, see `begun`, is not any more, before anything is read or written."""
        remedy = "Open it from where it is now: turing_learning.load_run(...)."
        rule = "be in its folder"
        check_folder(self.is_run(), "run", rule, f"{self.path}, where it is not any more", remedy)
        got = f"{self.path}, where another run has taken its place"
        remedy = "Make it again, with an `out` of its own."
        check_folder(self.begun() == begun, "run", "be in its folder", got, remedy)

    def configuration(self) -> Configuration:
        """Return the stored configuration.

        Reject one that is missing or has been changed with a RunFolderError.
        """
        manifest = self.manifest()
        try:
            text = self.configuration_path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError):
            got = f"{self.path} without a readable config.toml"
            reject_folder("run", "hold its configuration", got, "Restore the file.")
        unchanged = digest_of(text.encode()) == manifest.get("configuration_sha256")
        rule = "be as it was when the run began"
        remedy = "Restore it, or start a new run with `infer --config`."
        path = str(self.configuration_path)
        check_folder(unchanged, "config.toml", rule, "a changed one", remedy, place=path)
        with refusing_as(RunFolderError):
            return load_configuration(self.configuration_path, overrides=manifest.get("extension"))

    def extend(self, trials: int, tolerance: float | None) -> None:
        """Give a finished run more trials.

        The caller holds the lock. One write does it: config.toml says how the run began.

        A run that has been given them and is not finished again stays as it is, so that the same
        call resumes it.
        """
        manifest = self.manifest()
        configuration = self.configuration()
        run = configuration.run
        if tolerance is None:
            tolerance = run.tolerance
        if manifest["state"] != FINISHED and (trials, tolerance) == (run.trials, run.tolerance):
            return
        rule = "be one of trials, to get more of them"
        check_folder(run.trials > 0, "run", rule, f"{self.path}, one of generations")
        remedy = "Resume it without more trials first."
        rule = "be finished, to get more trials"
        check_folder(manifest["state"] == FINISHED, "run", rule, f"{self.path}", remedy)
        rule = "have its samples, to get more trials"
        got = f"{self.path}, without them"
        remedy = "A run with the setting run.history = 'thin' does not keep them: "
        remedy += "run again with 'full'."
        check_folder(run.history == "full", "run", rule, got, remedy)
        # A run may have ended before all its trials, by its tolerance
        spent = configuration.trials_after(self.read("result.json")["generations"])
        rule = f"be more than the {spent} that the run has spent"
        check_folder(trials > spent, "trials", rule, trials)
        extended = [*map(list, run.extended), [run.trials, spent]]
        extension = {"run.trials": trials, "run.tolerance": tolerance, "run.extended": extended}
        # Refuse a number that no run can have before anything is written
        with refusing_as(RunFolderError):
            load_configuration(self.configuration_path, overrides=extension)
        self.update_manifest(state=STOPPED, finished=None, extension=extension)

    def checkpoints(self) -> Iterator[tuple[Path, Checkpoint | None]]:
        """Yield the files of this run's checkpoints, see `stored_checkpoints`."""
        return stored_checkpoints(
            self.checkpoints_path, self.manifest().get("configuration_sha256")
        )

    def checkpoint(self) -> Checkpoint | None:
        """Return the newest usable checkpoint, None if there is none."""
        usable = (checkpoint for _, checkpoint in self.checkpoints() if checkpoint is not None)
        return next(usable, None)

    def traces(self, checkpoint: Checkpoint | None = None) -> dict[str, np.ndarray] | None:
        """Return the traces up to a checkpoint, by default the newest usable one.

        None if there is none.
        """
        if checkpoint is None:
            checkpoint = self.checkpoint()
        if checkpoint is None or "traces/seconds" not in checkpoint.arrays:
            return None
        numbers = range(1, blocks_before(checkpoint) + 1)
        blocks = [self.read(piece("traces", number)) for number in numbers]
        blocks.append(checkpoint.part("traces/"))
        names = list(blocks[-1])
        return {name: np.concatenate([block[name] for block in blocks]) for name in names}

    def recording(self) -> Mapping[str, Any] | None:
        """Return what a run on recordings remembers of them, see `RecordedSystem.entry`; None of another run."""
        return _recorded(self.manifest())

    def known_parts(self) -> set[str]:
        """Return which of "genuine" and "simulate" can be found by what the manifest says."""
        manifest = self._unverified_head() or {}
        parts = {"genuine", "simulate"}
        names = {*manifest}
        options = _recorded_options(manifest)
        if "trajectories" in options:
            names.add("genuine")
            if "model" in options:
                names.add("simulate")
        return parts & names

    def needs_python(self, system: System) -> bool:
        """Return whether samples or simulator of its system were given in Python, so that no command has them."""
        # A run on a program says how it is called; one on a family needs no more than a recording.
        program = (self._unverified_head() or {}).get("command")
        if isinstance(program, Mapping) or is_model(system.name):
            return False
        return not {setting.name for setting in system.resuming} <= self.known_parts()

    def remembered(self, arguments: Arguments) -> Arguments:
        """Return what is given of a custom system.

        What is not is imported, or read from a recording that must not have changed.
        """
        manifest = self.manifest()
        sources: dict[str, Any] = {}
        if arguments.genuine is None and "trajectories" in _recorded_options(manifest):
            system = self.configuration().system
            motion = RecordedSystem.remembered(
                manifest[RECORDING], "Put it back, or give `genuine` and `simulate`."
            )
            genuine, simulate, _ = motion.opened(
                system.steps, system.signals, network=self.network()
            )
            sources["genuine"] = genuine
            if arguments.simulate is None and simulate is not None:
                sources["simulate"] = simulate
        elif arguments.simulate is None and (network := self.network()) is not None:
            sources["simulate"] = network
        for name in ("genuine", "simulate"):
            stored = manifest.get(name)
            if getattr(arguments, name) is None and isinstance(stored, str):
                sources[name] = imported(stored, name) if ":" in stored else stored
        return replace(arguments, **sources)

    def network(self) -> Network | None:
        """Return the network that was learned for this run, if there is one."""
        if not (self.path / NETWORK).exists():
            return None
        return Network.from_bytes(self.read_bytes(NETWORK))

    def update_manifest(self, **changes: Any) -> None:
        """Change entries of the manifest."""
        self.write("manifest.json", self.manifest() | changes)

    def begin(
        self,
        configuration: Configuration,
        *,
        force: bool,
        files: Mapping[str, bytes] | None = None,
        **entries: Any,
    ) -> None:
        """Make this the folder of a new run; the caller holds the lock. See `Run.begin`.

        `entries` are those of the manifest.
        """
        self.refuse_if_taken(force=force)
        if self.is_run():
            # If it is killed from here on, the folder is still a run that may be replaced
            self.create({"state": RUNNING, "replaced": True})
            self.clear(_RESULTS)
        remove_partial(self.path)
        text = to_toml(configuration)
        write_atomically(self.configuration_path, text.encode())
        self.create(new_manifest(text, configuration.run.seed) | entries, files)

    def refuse_if_taken(self, *, force: bool) -> None:
        """Reject a folder into which a new run may not be written."""
        if self.is_run():
            try:
                resuming = how_to_resume(self.path, self.configuration())
            except RunFolderError:
                # Which says more once it is tried
                resuming = f"`{resume_command(self.path)}`"
            alternative = ", choose another folder, or replace it with "
            remedy = ("Resume it with ", resuming, alternative, Setting("force", True), ".")
            rule = "be a new or empty folder"
            check_folder(force, "out", rule, f"{self.path}, which holds a run", remedy)
        elif foreign := self.foreign_names():
            got = f"{self.path}, which holds {foreign[0]!r} and is not a run"
            reject_folder("out", "be a new or empty folder", got, "Choose another folder.")

    def foreign_names(self) -> list[str]:
        """Return the names in the folder that are not of a run that has only been begun."""
        names = super().foreign_names()
        if self.lock_path.exists():
            begun = {self.configuration_path.name, LABORATORY, CAMERA, NETWORK}
            names = [name for name in names if name not in begun]
        return names

    def storage(self) -> AbstractContextManager[None]:
        """Say of a folder that cannot be written any further how to resume its run, which needs nothing else."""
        return storage(self.path, f"resume with `{resume_command(self.path)}`.")


def piece(folder: str, number: int) -> str:
    """Return the name of one of many files in a folder."""
    return f"{folder}/{number:05d}.npz"


def blocks_before(checkpoint: Checkpoint) -> int:
    """Return the number of blocks of traces that have files of their own."""
    return (checkpoint.generation - len(checkpoint.arrays["traces/seconds"])) // BLOCK_GENERATIONS


def new_manifest(configuration_text: str, seed: int) -> dict[str, Any]:
    """Return the manifest of a run that is about to begin, from its resolved configuration as it is stored, and its seed."""
    identity = {"seed": seed, "configuration_sha256": digest_of(configuration_text.encode())}
    begun = {"finished": None, "seconds": 0.0, "process": this_process()}
    return {"format_version": FORMAT_VERSION, "state": RUNNING} | identity | provenance() | begun


def resumed(manifest: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return what a manifest gets when its run is resumed.

    Who runs it now, and with what, where that has changed.
    """
    before = (manifest.get("resumed") or [manifest])[-1].get("versions") or {}
    now_versions = versions()
    changed = []
    for name, version in before.items():
        if version != now_versions.get(name):
            changed.append(f"{name} {version}, now {now_versions.get(name)}")
    entries: dict[str, Any] = {"process": this_process()}
    if changed:
        text = "%s was run with %s: the result may not be that of a run that never stopped."
        _LOGGER.warning(text, path, "; ".join(changed))
        entries["resumed"] = [*manifest.get("resumed", []), {"at": now(), "versions": now_versions}]
    return entries


# Checkpoints: plain arrays in a file whose name holds the digest of its bytes


def save_checkpoint(folder: Path, checkpoint: Checkpoint, alone: bool = False) -> Path:
    """Write a checkpoint, atomically, in a folder that may be missing.

    Keep the newest two, or it `alone`.
    """
    folder.mkdir(exist_ok=True)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in checkpoint.arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)
    content = buffer.getvalue()
    path = folder / f"generation-{checkpoint.generation:06d}-{digest_of(content)[:16]}.npz"
    write_atomically(path, content)
    spared = 0 if alone else CHECKPOINTS_KEPT - 1
    for generation, file in _newest_first(folder):
        if file == path:
            continue
        # of the same generation it takes the place, as where an estimate was examined since
        if generation != checkpoint.generation and spared > 0:
            spared -= 1
        else:
            file.unlink(missing_ok=True)
    return path


def stored_checkpoints(
    folder: Path, configuration: str | None = None
) -> Iterator[tuple[Path, Checkpoint | None]]:
    """Yield each file, the newest first, with what it holds.

    None if it is damaged, or not of the `configuration` (SHA-256).
    """
    for generation, path in _newest_first(folder):
        checkpoint = None
        with suppress(OSError, ValueError, zipfile.BadZipFile):
            content = path.read_bytes()
            if digest_of(content)[:16] == path.stem.rpartition("-")[2]:
                with np.load(io.BytesIO(content), allow_pickle=False) as archive:
                    arrays = {name: archive[name] for name in archive.files}
                if not configuration or str(arrays.get(CONFIGURATION)) == configuration:
                    checkpoint = Checkpoint(generation, arrays)
        yield path, checkpoint


def stored_generations(folder: Path) -> int:
    """Return the number of generations in the newest checkpoint of a folder, 0 if there is none; nothing is read."""
    return max((generation for generation, _ in _newest_first(folder)), default=0)


def discard_checkpoints(folder: Path, above: int) -> None:
    for path in [path for generation, path in _newest_first(folder) if generation > above]:
        path.unlink(missing_ok=True)


def _newest_first(folder: Path) -> list[tuple[int, Path]]:
    """Return generation and path of every checkpoint; the folder may be missing."""
    checkpoints = []
    for path in folder.glob("generation-*.npz"):
        match = _CHECKPOINT.match(path.name)
        if match:
            checkpoints.append((int(match[1]), _written_at(path), path))
    checkpoints.sort(key=lambda checkpoint: checkpoint[:2], reverse=True)
    return [(generation, path) for generation, _, path in checkpoints]


def _written_at(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        # The run that a reader looks at goes on, and has removed it
        return 0
