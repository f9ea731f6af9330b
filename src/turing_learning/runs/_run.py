"""A run: begin or open it, iterate over its generations, leave the loop to stop.

What is said of generations here holds of the batches of a run of trials, too.
"""

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from turing_learning._files import remove_partial
from turing_learning.coevolution import Generation
from turing_learning.config import Configuration, ConfigurationError, to_toml
from turing_learning.config.settings import resolved
from turing_learning.detection import RANDOM_MODELS, simulated_calibration
from turing_learning.errors import in_words, refusing_as
from turing_learning.identifiability import Check
from turing_learning.provenance import now
from turing_learning.purposes import DIALOGUE, REPLAY
from turing_learning.store import RunFolderError, check_folder, reject_folder, storage, writable
from turing_learning.systems import Arguments, Source, SystemFailedError

from . import _folder as folders
from . import _history as histories
from ._folder import FINISHED, RUNNING, STOPPED, Checkpoint, RunFolder, how_to_resume, piece
from ._loops import Loop, TrialBatch, loop_of
from ._progress import Observer, Progress
from ._record import READOUT, Record, layout_of, traces_of
from ._report import write_report
from ._result import Result
from ._summary import COMPLETE, FAILURES, Ending, remade_result, stored_result, summarize

if TYPE_CHECKING:
    import xarray

_LOGGER = logging.getLogger("turing_learning")
_STAGES = logging.getLogger("turing_learning.runs")
GIVEN = "given"  # in the manifest: the source of samples came from the caller
_SHOWN = 50  # generations, spread over the run, whose fittest classifiers may be shown
_RECENT = 50  # generations that rate and outlook are taken from


class Run:
    """A run of Turing Learning, one generation for each turn of a loop over it.

    Leaving the loop, also by an error in it, stops the run: what is done is saved, and a run in a
    folder can be opened again. As a context manager it gives back its lock wherever it is left.
    `Run.begin` and `Run.open` make one.

    Attributes
    ----------
    configuration
        What runs.
    folder
        Where it is stored, locked; None for a run in memory.

    Examples
    --------
    >>> import turing_learning as tl
    >>> run = tl.runs.Run.begin(tl.config.load_configuration(scenario="aggregation"))  # doctest: +SKIP
    >>> for progress in run:  # doctest: +SKIP
    ...     if progress.completed == 100:
    ...         break
    >>> run.result.estimate  # doctest: +SKIP
    """

    def __init__(
        self,
        configuration: Configuration,
        source: Source,
        loop: Loop,
        folder: RunFolder | None,
        arguments: Arguments | None = None,
    ) -> None:
        self.configuration = configuration
        self.folder = folder
        self._arguments = arguments or Arguments()
        self._source = source
        self._loop = loop
        self._opened = ExitStack()
        self._closed = False
        self._result: Result | None = None
        self._layout = layout_of(configuration)
        self._traces = histories.Traces(configuration.length, len(self._layout.parameters))
        self._seconds = self._seconds_before = 0.0
        # Generations, and blocks of traces, that are stored
        self._saved = self._blocks = 0
        self._readout = dict[str, np.ndarray]()
        # Whether what is read off at the end is known
        self._read = False
        self._dialogues = dict[str, np.ndarray]()
        self._begun = time.perf_counter()
        if folder is None:
            self._manifest = folders.new_manifest(to_toml(configuration), configuration.run.seed)
        else:
            self._manifest = {}
        seals = None if folder is None else self._resume_from_checkpoint(folder)
        self._recorder: histories.HistoryRecorder | None = None
        if configuration.run.keeps_populations:
            if folder is None:
                arrays: Mapping[str, Any] = histories.memory_arrays(self._layout)
            elif seals is None:
                arrays = histories.create_store(folder.history_path, self._layout)
            else:
                arrays = histories.open_store(folder.history_path)
            self._recorder = histories.HistoryRecorder(self._layout, arrays, seals)

    @classmethod
    def begin(
        cls,
        configuration: Configuration,
        out: str | Path | None = None,
        *,
        source: Source | None = None,
        force: bool = False,
        files: Mapping[str, bytes] | None = None,
        entries: Mapping[str, Any] | None = None,
        arguments: Arguments | None = None,
    ) -> Self:
        """Begin a run.

        Parameters
        ----------
        configuration
            Of the run.
        out
            A new or empty folder; None keeps the run in memory.
        source
            Samples of its system, which the caller closes; None opens those of a system that needs
            nothing else.
        force
            Whether a run that is in the folder already may be replaced.
        files
            Name -> content of what else the folder holds.
        entries
            What else the manifest holds.
        arguments
            Samples and simulator of a custom system, by which the result can be checked in this
            process.
        """
        entries = dict(entries or {})
        if source is None:
            with refusing_as(ConfigurationError):
                source = configuration.system.open(Arguments())
        elif not configuration.system.resuming:
            # `resume` cannot open this source by the folder alone, and has to say so
            entries["source"] = GIVEN
        loop = loop_of(configuration, source)
        if out is None:
            return cls(configuration, source, loop, None, arguments)
        folder = RunFolder(out)
        with ExitStack() as opened, writable("out", folder.path):
            folder.refuse_if_taken(force=force)
            folder.path.mkdir(parents=True, exist_ok=True)
            opened.enter_context(folder.locked())
            folder.begin(configuration, force=force, files=files, **entries)
            run = cls(configuration, source, loop, folder, arguments)
            run._opened = opened.pop_all()
        return run

    @classmethod
    def open(
        cls,
        path: str | Path,
        reopen: Callable[[Configuration], Source] | None = None,
        *,
        threads: int | None = None,
        trials: int | None = None,
        tolerance: float | None = None,
    ) -> "Run | FinishedRun":
        """Open a run that was stopped or killed, to resume it.

        A finished one has its result, and no further generations.

        A finished run of trials that is given more of them is the run whose configuration has all of them as
        `run.trials`, and what it had before in `run.extended`: to the same bits, wherever either is stopped.

        Parameters
        ----------
        path
            The run folder.
        reopen
            Opens the samples of the run's system, while the folder is locked; None opens those of a
            system that needs nothing else.
        threads
            Number of threads; None takes that of the configuration.
        trials
            For a finished run of trials: how many it shall have in all, more than it has spent.
        tolerance
            Beside `trials`: as in `infer`; None leaves it as it was.
        """
        folder = RunFolder(path)
        if trials is not None:
            with writable("run", folder.path), folder.locked():
                folder.extend(trials, tolerance)
        elif tolerance is not None:
            reject_folder("tolerance", "be given beside `trials`", f"{tolerance} alone")
        configuration = folder.configuration()
        result = stored_result(folder, configuration)
        if result is not None:
            return FinishedRun(result)
        adjusted = configuration
        if threads is not None:
            adjusted = resolved(None, "default", configuration, {"run.threads": threads})
        with ExitStack() as opened, writable("run", folder.path):
            opened.enter_context(folder.locked())
            # another process may have finished it before the lock was free
            result = stored_result(folder, configuration) or remade_result(folder, configuration)
            if result is not None:
                return FinishedRun(result)
            with refusing_as(RunFolderError):
                if reopen is None:
                    refuse_given_source(folder)
                    source = adjusted.system.open(Arguments())
                else:
                    source = reopen(adjusted)
            # From here on an error closes the source, too
            opened.enter_context(source)
            with refusing_as(RunFolderError, place=str(folder.path)):
                loop = loop_of(adjusted, source)
            remove_partial(folder.path)
            resumed = folders.resumed(folder.manifest(), folder.path)
            folder.update_manifest(state=RUNNING, **resumed)
            run = cls(adjusted, source, loop, folder)
            run._opened = opened.pop_all()
        return run

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *stop: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back the lock and what else was opened; the run can be opened again."""
        self._closed = True
        self._opened.close()

    @property
    def completed(self) -> int:
        """Number of completed generations, or batches."""
        return self._traces.completed

    @property
    def complete(self) -> bool:
        """Whether nothing is left to do: all generations or batches are completed, or the tolerance is reached.

        The estimate of a run of trials is examined, too.
        """
        return self._spent and self._read

    @property
    def _spent(self) -> bool:
        """Whether no generation or batch is left to do."""
        return self._loop.tolerated or self._traces.completed == self.configuration.length

    def __iter__(self) -> Iterator[Progress]:
        """Run generations; after the last one, or where the loop is left, save everything.

        Raises
        ------
        SystemFailedError
            If the system or its simulator fails; the generations before are saved.
        """
        if self._closed:
            remedy = "Open it again: turing_learning.runs.Run.open(path)."
            raise RuntimeError(f"`run` must be open; got one that was closed. {remedy}")
        configuration = self.configuration
        spent = self.configuration.trials_after
        try:
            while not self._spent:
                step = self._step()
                if self.completed % configuration.run.save_every == 0 or self._spent:
                    self._save()
                stepped: dict[str, Any] = {"generation": step, "batch": None}
                if isinstance(step, TrialBatch):
                    trials = (spent(self.completed), spent(configuration.length))
                    stepped = {"generation": None, "batch": step, "trials": trials}
                yield Progress(
                    **stepped,
                    completed=self.completed,
                    total=configuration.length,
                    parameter_names=configuration.scenario.parameter_names,
                    truth=configuration.scenario.truth,
                    seconds_per_generation=float(self._traces["seconds"][-_RECENT:].mean()),
                    recent=self._traces["typical_model"][-_RECENT:],
                    described=configuration.described,
                    last=self._spent,
                )
            if not self._read:
                self._read_off()
        except GeneratorExit:
            # Python closes a generator that a loop has left: all is saved as at the end. Where it has
            # a name, as in `conduct`, an error reaches `__exit__` first: the last checkpoint stays.
            if self._closed:
                return
        self._finish()

    @property
    def result(self) -> Result:
        """What the completed generations have inferred; at least one must be completed."""
        if self._result is None or self._result.generations != self.completed:
            failures = self._source.failures
            ending = Ending(
                seconds=self._seconds or time.perf_counter() - self._begun,
                complete=self.complete,
                spent=self._spent,
                readout=self._readout,
                failed_simulations=None if failures is None else failures.summary(),
            )
            self._result = summarize(self._traces, ending, self._record())
        return self._result

    def _record(self) -> Record:
        """Return where what the run has stored is."""
        if self.folder is not None:
            return Record.of(self.folder, self.configuration, self.completed, self._arguments)
        return Record(
            self.configuration,
            self.completed,
            arrays=self._traces if self._recorder is None else self._recorder.arrays,
            manifest=self._manifest,
            readout=self._readout,
            dialogues=self._dialogues,
            arguments=self._arguments,
        )

    @property
    def history(self) -> "xarray.Dataset":
        """Every generation's populations, see `Result.history`."""
        return self.result.history

    def report(self, path: str | Path | None = None, *, force: bool = False) -> Path:
        """Write the report, see `Result.report`."""
        return self.result.report(path, force=force)

    def check(self, **options: Any) -> Check:
        """Check whether the estimate can be believed, see `Result.check`."""
        return self.result.check(**options)

    def storage(self) -> AbstractContextManager[None]:
        """Say of a folder that cannot be written any further how to resume the run."""
        if self.folder is None:
            return nullcontext()
        return storage(
            self.folder.path,
            f"resume with {in_words(how_to_resume(self.folder.path, self.configuration))}.",
        )

    # Generations

    def _step(self) -> Generation | TrialBatch:
        """Run a generation."""
        folder = self.folder
        if self._source.fallible:
            self._source.generation = self._loop.completed
        begun = time.perf_counter()
        with self._failing():
            step = self._loop.step()
        # The history first: a checkpoint must never be ahead of it
        values = histories.values_of(step)
        with self.storage():
            if folder is not None:
                folder.require_here()
            if self._recorder is not None:
                self._recorder.record(values)
        self._traces.record(values, time.perf_counter() - begun)
        return step

    @contextmanager
    def _failing(self) -> Iterator[None]:
        """Where the system fails, save the generations before, and say where they are."""
        # Only a fallible source raises what is caught below, so no other needs the state before.
        before = self._loop.state() if self._source.fallible else {}
        try:
            yield
        except SystemFailedError as error:
            self._loop.restore(before)
            if self._saved != self.completed:
                self._save()
            where = "Nothing is stored of a run without `out`; give one, to be able to resume."
            if self.folder is not None:
                with self.storage():
                    self.folder.update_manifest(state=STOPPED, seconds=self._seconds)
                resuming = in_words(how_to_resume(self.folder.path, self.configuration))
                done = f"{self.completed} generations"
                if self.configuration.run.trials:
                    done = f"{self.configuration.trials_after(self.completed)} trials"
                where = f"{done} are stored; resume with {resuming}."
            if error.explained or not self.completed:
                raise
            raise type(error)(f"{error} {where}") from error.__cause__

    # What is stored

    def _save(self) -> None:
        """Write the history and a checkpoint; a run in memory has its history flushed."""
        if self._spent and not self._loop.stores_rows:
            self._read = True
        with self.storage():
            if self._recorder is not None:
                self._recorder.flush()
            self._seconds = self._seconds_before + time.perf_counter() - self._begun
            if self.folder is not None:
                rows = {} if self._saved == self.completed else self._loop.take_rows()
                if rows:
                    self.folder.write(piece("buffer", self.completed), rows)
                self._save_checkpoint(self.folder, with_state=True)
            self._saved = self.completed

    def _read_off(self) -> None:
        """Examine the estimate of a run of trials, which is stored, and save what is read off."""
        simulations = self._loop.examined_by
        if simulations:
            text = "All trials are spent. At least %d simulations follow, for %.0f s: they examine the estimate"
            if self.folder is not None and self.configuration.run.history == "full":
                simulations += RANDOM_MODELS
                text += ", and calibrate detectors"
            batch = self.configuration.trials_in_step(self.completed)
            seconds = simulations * float(self._traces["seconds"][-1]) / batch
            _STAGES.info(f"{text}.", simulations, seconds)
        if self._source.fallible:
            self._source.generation = self.completed - 1
        self._source.examining = True
        with self._failing():
            self._readout = self._loop.readout()
        self._source.examining = False
        self._read = True
        self._result = None
        self._save()

    def _save_checkpoint(self, folder: RunFolder, *, with_state: bool) -> None:
        """Write a checkpoint, with all that is needed to resume.

        Without the state it holds only what a result is made of, and is the only one that stays.
        """
        while (self._blocks + 1) * folders.BLOCK_GENERATIONS <= self.completed:
            block = slice(
                self._blocks * folders.BLOCK_GENERATIONS,
                (self._blocks + 1) * folders.BLOCK_GENERATIONS,
            )
            folder.write(piece("traces", self._blocks + 1), self._traces.state(block))
            self._blocks += 1
        groups = {
            "traces/": self._traces.state(slice(self._blocks * folders.BLOCK_GENERATIONS, None))
        }
        if self._source.failures is not None:
            groups[FAILURES] = self._source.failures.state()
        if self.complete:
            groups[READOUT] = self._readout
        if with_state:
            groups["coevolution/"] = self._loop.state()
            groups["history/"] = {} if self._recorder is None else self._recorder.seals()
        arrays = {}
        for prefix, group in groups.items():
            for name, array in group.items():
                arrays[f"{prefix}{name}"] = array
        arrays[COMPLETE] = np.array(self.complete)
        arrays["seconds"] = np.array(self._seconds)
        arrays[folders.CONFIGURATION] = np.array(str(folder.manifest().get("configuration_sha256")))
        folders.save_checkpoint(
            folder.checkpoints_path, Checkpoint(self.completed, arrays), not with_state
        )

    def _finish(self) -> None:
        """Save, write the result, and close what is stored in a folder.

        A complete run with a full history gets report and figures before its state, so that a run
        killed here does it again. One with a thin history drops its buffer.
        """
        if self._saved != self.completed:
            self._save()
        folder = self.folder
        full = self.complete and self.configuration.run.history == "full"
        self._dialogues = self._seen_dialogues() if full else {}
        if folder is None:
            state = FINISHED if self.complete else STOPPED
            self._manifest |= {"state": state, "finished": now(), "seconds": self._seconds}
            # A result of before has no dialogues
            self._result = None
            return
        result = self.result
        with self.storage():
            folder.write("result.json", result.to_json())
            folder.update_manifest(
                state=RUNNING if self.complete else STOPPED, seconds=self._seconds
            )
            closed = {"state": FINISHED, "finished": now()}
            # The report before the state: a finished run has its report
            if full:
                motion = self._keep_motion(folder, result)
                if self._dialogues:
                    folder.write(folders.DIALOGUES, self._dialogues)
                write_report(
                    result,
                    folder.report_path,
                    folder.manifest() | closed,
                    figures=folder.figures_path,
                    motion=motion,
                    dialogues=self._dialogues,
                )
            if self.complete:
                folder.update_manifest(**closed)
            # One with a thin history needs no state any more
            if self.complete and not full:
                self._save_checkpoint(folder, with_state=False)
                for path in folder.path.glob("buffer/*.npz"):
                    folder.remove(f"buffer/{path.name}")
        self.close()

    def _seen_dialogues(self) -> dict[str, np.ndarray]:
        """Return what the fittest classifiers of some generations do, where there are stimuli."""
        if self._recorder is None or not self.configuration.system.stimulated:
            return {}
        # No generation is collected
        self._source.generation = None
        model = np.array(list(self.result.estimate.values()))
        rows = np.unique(np.linspace(0, self.completed - 1, _SHOWN).astype(int))
        history = self.result.history[["classifier", "classifier_fitness"]]
        chosen = history.isel(generation=rows).load()
        best = chosen["classifier_fitness"].to_numpy().argmax(axis=1)
        classifiers = chosen["classifier"].to_numpy()[np.arange(len(rows)), best]
        rng = np.random.default_rng((DIALOGUE, self.configuration.run.seed))
        return self._source.dialogues(classifiers, model, rng)

    def _keep_motion(self, folder: RunFolder, result: Result) -> dict[str, np.ndarray]:
        """Store what detectors of a custom system are calibrated with, and return what its report shows."""
        if self._source.genuine is None:
            return {}
        parameters = self.configuration.system.parameters
        seed = self.configuration.run.seed
        estimate = np.array(list(result.estimate.values()))
        # Detectors need normal and abnormal motion without the system
        calibration = simulated_calibration(self._source, parameters, estimate, seed)
        if calibration:
            folder.write(folders.CALIBRATION, calibration)
        motion = self._source.positions(estimate, np.random.default_rng((REPLAY, seed)))
        if motion:
            folder.write(folders.MOTION, motion)
        return motion

    def _resume_from_checkpoint(self, folder: RunFolder) -> Mapping[str, np.ndarray] | None:
        """Take over the newest usable checkpoint whose history is there; delete newer ones.

        Return the checksums of the history at that checkpoint, None without one.
        """
        checkpoint: Checkpoint | None = None
        damaged: list[str] = []
        lost = False
        for path, stored in folder.checkpoints():
            if stored is None:
                damaged.append(path.name)
            elif self._has_history(stored, folder):
                checkpoint = stored
                break
            else:
                lost = True
        done = 0 if checkpoint is None else checkpoint.generation
        if lost:
            _LOGGER.warning(
                "The history in %s is damaged; the run is resumed from generation %d.",
                folder.path,
                done,
            )
        for name in damaged:
            _LOGGER.warning(
                "Checkpoint %s is damaged; the run is resumed from generation %d.", name, done
            )
        folders.discard_checkpoints(folder.checkpoints_path, above=done)
        if checkpoint is None:
            return None
        self._traces = traces_of(checkpoint, folder, self.configuration)
        self._blocks = folders.blocks_before(checkpoint)
        state = checkpoint.part("coevolution/")
        if self._loop.stores_rows:
            # Runs by trials save after each batch (`RunSection.save_every`): there is a piece of
            # the buffer for every one.
            batches = [folder.read(piece("buffer", number)) for number in range(1, done + 1)]
            for name in batches[0]:
                state[f"buffer/{name}"] = np.concatenate([batch[name] for batch in batches])
        self._loop.restore(state)
        # Checkpoints of before say nothing of it
        self._read = self._spent and bool(checkpoint.arrays.get(COMPLETE, True))
        self._readout = checkpoint.part(READOUT) if self.complete else {}
        if self._source.failures is not None:
            self._source.failures.restore(checkpoint.part(FAILURES))
        self._seconds = float(checkpoint.arrays["seconds"])
        self._seconds_before = self._seconds
        self._saved = done
        return checkpoint.part("history/")

    def _has_history(self, checkpoint: Checkpoint, folder: RunFolder) -> bool:
        """Return whether the history up to a checkpoint is there; without populations it is in the checkpoint."""
        if not self.configuration.run.keeps_populations:
            return True
        seals = checkpoint.part("history/")
        path = folder.history_path
        return histories.intact(path, self._layout, checkpoint.generation, seals)


class FinishedRun(ExitStack):
    """A run that is finished: an empty loop with a result, and nothing to close."""

    complete = True

    def __init__(self, result: Result) -> None:
        super().__init__()
        self.result = result

    def __iter__(self) -> Iterator[Progress]:
        return iter(())


def conduct(
    run: Run | FinishedRun,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Result:
    """Run to the end, or until `should_stop` returns True after a generation.

    `observer` is called after each.
    """
    with run:
        generations = iter(run)
        try:
            for progress in generations:
                if observer is not None:
                    observer(progress)
                if should_stop is not None and should_stop():
                    generations.close()  # type: ignore[attr-defined] # of a generator: saves, while the folder is locked
        except KeyboardInterrupt as error:
            if isinstance(run, Run) and run.folder is not None:
                call = in_words(how_to_resume(run.folder.path, run.configuration))
                error.add_note(f"The run is in {run.folder.path}. Resume it with {call}.")
            raise
        return run.result


def refuse_given_source(folder: RunFolder) -> None:
    """Reject a run that began with a source of its caller's.

    Without it the run would continue in plain simulation.
    """
    got = f"{folder.path}, which began with a source of its caller's"
    remedy = "Give it again: turing_learning.runs.Run.open(path, lambda configuration: source)."
    resumable = folder.manifest().get("source") != GIVEN
    check_folder(resumable, "run", "be one that can be resumed without its source", got, remedy)
