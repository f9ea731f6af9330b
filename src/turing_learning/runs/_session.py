"""One session of a run: from a state to the end, or to where it is told to stop."""

import logging
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from turing_learning.analysis import name_failure
from turing_learning.coevolution import Generation
from turing_learning.config import Configuration, classifier_of
from turing_learning.systems import Source, SystemFailedError

from ._assemble import assemble
from .folder._checkpoints import Checkpoint, discard_checkpoints, latest_checkpoint, save_checkpoint
from .folder._errors import storage
from .folder._folder import RunFolder, going_on
from .folder._history import HistoryRecorder, Layout, ThinRecorder, create_store, intact, memory_arrays, open_store
from .folder._traces import Traces, generation_values
from .results._result import Result

_LOGGER = logging.getLogger("turing_learning")
FAILURES = "failures/"  # of simulations of a custom system, among the arrays of a checkpoint
_RECENT = 50  # generations that rate and outlook are taken from


@dataclass(frozen=True)
class Progress:
    """What an observer is told after every generation.

    Attributes
    ----------
    generation
        Both populations, scored.
    completed, total
        Numbers of generations.
    parameter_names
        Names of the parameters in which models are shown: the agents', where they are known.
    truth
        The agents' parameters, None where there is no truth.
    seconds_per_generation
        Mean over the last generations (s).
    recent : (up to 50, P)
        Typical models of the last generations; None if not recorded.
    described
        Gives models (..., P) in the parameters shown; None if these are their numbers.
    """

    generation: Generation
    completed: int
    total: int
    parameter_names: tuple[str, ...]
    truth: tuple[float, ...] | None
    seconds_per_generation: float
    recent: np.ndarray | None = None
    described: Callable[[np.ndarray], np.ndarray] | None = None

    def shown(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the parameters of `parameter_names`."""
        return models if self.described is None else self.described(models)

    @property
    def outlook(self) -> str | None:
        """How the models of the last generations compare with the truth, by name, see `analysis.name_failure`.

        None where there is no truth.
        """
        if self.truth is None or self.recent is None:
            return None
        return name_failure(np.median(self.shown(self.recent), axis=0), np.asarray(self.truth))

    @property
    def seconds_left(self) -> float:
        """Time until the last generation at the present rate (s)."""
        return (self.total - self.completed) * self.seconds_per_generation


Observer = Callable[[Progress], None]


def layout_of(configuration: Configuration) -> Layout:
    """Return the sizes of a run's history."""
    run, models, classifiers = configuration.run, configuration.models, configuration.classifiers
    return Layout(
        generations=run.generations,
        models=models.parents + models.offspring,
        parameters=configuration.parameter_names,
        classifiers=classifiers.parents + classifiers.offspring,
        weights=classifier_of(configuration).parameters,
        chunk=min(run.checkpoint_every, run.generations),
    )


class Session:
    """A run in this process.

    Parameters
    ----------
    configuration
        What runs.
    folder
        Where it is kept, locked by the caller; None keeps it in memory.
    source
        Its samples. Models are stored and stated in its parameters' units.

    Attributes
    ----------
    traces
        Of the completed generations.
    seconds
        Time in all sessions, up to the last save (s).
    """

    def __init__(
        self,
        configuration: Configuration,
        folder: RunFolder | None = None,
        *,
        source: Source,
    ) -> None:
        self.configuration = configuration
        self.layout = layout_of(configuration)
        self.traces = Traces(configuration.run.generations, len(self.layout.parameters))
        self.seconds = 0.0
        self._folder = folder
        self._source = source
        self._coevolution = assemble(configuration, source)
        self._begun = time.perf_counter()
        self._seconds_before = 0.0
        state = self._restored_state() if folder is not None else None
        self.arrays: Mapping[str, np.ndarray] = {}
        self._recorder: HistoryRecorder | ThinRecorder = ThinRecorder()
        if not self._thin:
            self.arrays = self._opened_arrays(new=state is None)
            self._recorder = HistoryRecorder(
                self.layout, self.arrays, None if state is None else part(state, "history/")
            )

    @property
    def _thin(self) -> bool:
        return self.configuration.run.history == "thin"

    @property
    def complete(self) -> bool:
        """Whether all generations are completed."""
        return self.traces.completed == self.configuration.run.generations

    def run(self, observer: Observer | None, should_stop: Callable[[], bool] | None) -> None:
        """Run generations until all are completed, or until `should_stop` says so after one of them; save.

        Raises
        ------
        RunStorageError
            If the run cannot be written.
        SystemFailedError
            If the system or its simulator fails; the generations before are saved.
        """
        every, saved = self.configuration.run.checkpoint_every, self.traces.completed
        while not self.complete:
            generation = self._guarded_step() if self._source.fallible else self._step()
            if self.traces.completed % every == 0 or self.complete:
                self.save()
                saved = self.traces.completed
            if observer is not None:
                observer(self._progress(generation))
            if should_stop is not None and should_stop():
                break
        if saved != self.traces.completed:
            self.save()

    def save(self) -> None:
        """Write the history and a checkpoint; a run in memory has its history flushed.

        Raises
        ------
        RunStorageError
            If they cannot be written.
        """
        with self.storage():
            self._recorder.flush()
            self.seconds = self._seconds_before + time.perf_counter() - self._begun
            if self._folder is not None:
                save_checkpoint(self._folder.checkpoints_path, Checkpoint(self.traces.completed, self._state()))

    def storage(self) -> AbstractContextManager[None]:
        """Say of a folder that cannot be written any further how to go on with the run."""
        if self._folder is None:
            return nullcontext()
        return storage(self._folder.path, f"go on with {going_on(self._folder.path, self.configuration)}.")

    def keep_calibration(self, result: Result) -> None:
        """Keep in the folder what detectors of a custom system are calibrated with; scenarios need nothing."""
        from turing_learning.detection import keep_calibration

        if self._folder is not None and self._source.genuine is not None:
            estimate = np.array(list(result.estimate.values()))
            parameters, seed = self.configuration.system.parameters, self.configuration.run.seed
            keep_calibration(self._folder.path, self._source, parameters, estimate, seed)

    def _step(self) -> Generation:
        begun = time.perf_counter()
        generation = self._in_units(self._coevolution.step())
        values = generation_values(generation)
        with self.storage():
            self._recorder.record(values)
        self.traces.record(values, time.perf_counter() - begun)
        return generation

    def _guarded_step(self) -> Generation:
        before, self._source.generation = self._coevolution.state(), self._coevolution.generation
        try:
            return self._step()
        except SystemFailedError as error:
            self._coevolution.restore(before)
            if self.traces.completed:
                self.save()
            if error.explained or not self.traces.completed:
                raise
            raise type(error)(f"{error} {self._kept}") from error.__cause__

    @property
    def _kept(self) -> str:
        """What became of the completed generations of a run that a custom system has ended, in words."""
        if self._folder is None:
            return "Nothing was kept of a run without `out`; give one, to be able to go on."
        ahead = going_on(self._folder.path, self.configuration)
        return f"{self.traces.completed} generations are kept; go on with {ahead}."

    def _in_units(self, generation: Generation) -> Generation:
        models = self._source.to_units(generation.models)
        return generation if models is generation.models else replace(generation, models=models)

    @property
    def failed_simulations(self) -> dict[str, Any] | None:
        """What a result says of failed simulations; None where no simulator of one's own is called."""
        return None if self._source.failures is None else self._source.failures.summary()

    def _progress(self, generation: Generation) -> Progress:
        return Progress(
            generation=generation,
            completed=self.traces.completed,
            total=self.configuration.run.generations,
            parameter_names=self.configuration.scenario.parameter_names,
            truth=self.configuration.scenario.truth,
            seconds_per_generation=float(self.traces["seconds"][-_RECENT:].mean()),
            recent=self.traces["typical_model"][-_RECENT:],
            described=self.configuration.described,
        )

    def outcome(self) -> Checkpoint:
        """Return a checkpoint without the state of the coevolution: enough for the result of a complete run."""
        return Checkpoint(self.traces.completed, self._outcome())

    def _state(self) -> dict[str, np.ndarray]:
        evolving = {f"coevolution/{name}": array for name, array in self._coevolution.state().items()}
        history = {f"history/{name}": array for name, array in self._recorder.seals().items()}
        return evolving | history | self._outcome()

    def _outcome(self) -> dict[str, np.ndarray]:
        failures = {} if self._source.failures is None else self._source.failures.state()
        return {
            **{f"traces/{name}": array for name, array in self.traces.state().items()},
            **{f"{FAILURES}{name}": array for name, array in failures.items()},
            "seconds": np.array(self.seconds),
        }

    def _restored_state(self) -> Mapping[str, np.ndarray] | None:
        """Take over the newest usable checkpoint, if there is one and the history reaches as far."""
        folder = self._folder
        assert folder is not None
        latest = latest_checkpoint(folder.checkpoints_path, self._holds_history)
        checkpoint = latest.checkpoint
        done = checkpoint.generation if checkpoint else 0
        if latest.refused:
            _LOGGER.warning("The history in %s is damaged; the run goes on from generation %d.", folder.path, done)
        for path in latest.damaged:
            _LOGGER.warning("Checkpoint %s is damaged; the run goes on from generation %d.", path.name, done)
        discard_checkpoints(folder.checkpoints_path, above=done)
        if checkpoint is None:
            return None
        self._coevolution.restore(part(checkpoint.arrays, "coevolution/"))
        self.traces.restore(part(checkpoint.arrays, "traces/"))
        if self._source.failures is not None:
            self._source.failures.restore(part(checkpoint.arrays, FAILURES))
        self.seconds = self._seconds_before = float(checkpoint.arrays["seconds"])
        return checkpoint.arrays

    def _holds_history(self, checkpoint: Checkpoint) -> bool:
        if self._thin:
            return True
        folder, seals = self._folder, part(checkpoint.arrays, "history/")
        return folder is not None and intact(folder.history_path, self.layout, checkpoint.generation, seals)

    def _opened_arrays(self, *, new: bool) -> Mapping[str, np.ndarray]:
        if self._folder is None:
            return memory_arrays(self.layout)
        path = self._folder.history_path
        return create_store(path, self.layout) if new else open_store(path)


def part(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays whose names start with a prefix, without it."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}
