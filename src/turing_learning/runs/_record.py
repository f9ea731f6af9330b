"""The record of a run: where what it has stored is, in its folder or in memory, and how it is
read."""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import Configuration, ConfigurationError, classifier_of
from turing_learning.config.parts import observers_of
from turing_learning.errors import refusing_as
from turing_learning.purposes import REPLAY
from turing_learning.store import reject_folder
from turing_learning.systems import Arguments, Source, System

from . import _folder as folders
from . import _history as histories
from ._folder import Checkpoint, RunFolder, how_to_resume

if TYPE_CHECKING:
    import xarray

READOUT = "readout/"
"""Begin of the names of what a run of trials has read off at its end, among the arrays of a
checkpoint."""

Jury = tuple[tuple[Classifier, np.ndarray], ...]
"""Classifiers of a kind, and their genomes (J, Q)."""

_LOGGER = logging.getLogger("turing_learning")


@dataclass(frozen=True, eq=False)
class Record:
    """All that a run has stored, in its folder or in memory.

    A result carries the record of its run. Another process gets the record of a run in a folder,
    and none of a run in memory.

    Attributes
    ----------
    configuration
        What ran.
    completed
        Number of generations, or of batches of trials.
    path
        The folder, absolute; None in memory.
    begun
        Which run was in the folder, see `RunFolder.begun`.
    arrays
        The history of a run in memory.
    manifest, readout, dialogues
        What a run in memory would have written.
    beside
        What a check and a pool say of a run in memory, by the names of their files.
    given
        Samples and simulator of a custom system, in the process that had them.
    """

    configuration: Configuration
    completed: int
    path: Path | None = None
    begun: tuple[Any, Any] = (None, None)
    arrays: "Mapping[str, np.ndarray] | histories.Traces | None" = None
    manifest: Mapping[str, Any] = field(default_factory=dict)
    readout: Mapping[str, np.ndarray] = field(default_factory=dict)
    dialogues: Mapping[str, np.ndarray] = field(default_factory=dict)
    beside: dict[str, Any] = field(default_factory=dict)
    arguments: Arguments = field(default_factory=Arguments)

    @classmethod
    def of(
        cls,
        folder: RunFolder,
        configuration: Configuration,
        completed: int,
        arguments: Arguments | None = None,
    ) -> Self:
        """Return the record in a folder, which can be opened from wherever the process is by then."""
        path = folder.path.absolute()
        return cls(
            configuration, completed, path, folder.begun(), arguments=arguments or Arguments()
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave a run in memory and a caller's simulator behind, which another process does not have."""
        if self.path is None:
            return type(None), ()
        return type(self), (self.configuration, self.completed, self.path, self.begun)

    @property
    def folder(self) -> RunFolder | None:
        """Its folder, as it is now."""
        if self.path is None:
            return None
        return RunFolder(self.path)

    def require_there(self) -> None:
        """Reject a folder that holds this run no more."""
        if self.path is not None:
            RunFolder(self.path).require_there(self.begun)

    def said_by(self, name: str) -> dict[str, Any]:
        """Return what a check or a pool has left, by the name of its file.

        Raise a KeyError or a RunFolderError without.
        """
        if self.path is None:
            return dict(self.beside[name])
        return dict(RunFolder(self.path).read(name))

    def history(self) -> "xarray.Dataset":
        """Return the history, with names and units, and trials spent where they are the budget; one on disk is verified."""
        configuration = self.configuration
        arrays = self._in_memory()
        if arrays is not None:
            history = histories.dataset_in_memory(
                arrays, configuration.parameter_names, self.completed
            )
        else:
            assert self.path is not None
            history = self._verified_history(RunFolder(self.path))
        units = units_of(configuration.system, configuration.parameter_names)
        history = histories.with_units(history, list(units.values()))
        spent = configuration.spent(self.completed)
        if spent is None:
            return history
        return history.assign_coords(trials=("generation", spent))

    def series(self) -> dict[str, np.ndarray]:
        """Return the arrays of the history by name, without the populations.

        What a report needs: the packages of named arrays take as long to import as small runs do.
        """
        arrays = self._in_memory()
        if arrays is None:
            history = self.history().drop_vars(histories.POPULATIONS)
            return {str(name): history[name].to_numpy() for name in history.data_vars}
        return histories.completed_arrays(arrays, self.completed)

    def _in_memory(self) -> "Mapping[str, np.ndarray] | histories.Traces | None":
        """Return the history of a run in memory, or the traces of one in a folder; None where it is on disk."""
        if self.path is not None and not self.configuration.run.keeps_populations:
            return self._stored_traces(RunFolder(self.path))
        return self.arrays

    def _stored_traces(self, folder: RunFolder) -> histories.Traces:
        traces = traces_of(
            stored_checkpoint(folder, self.configuration), folder, self.configuration
        )
        if traces.completed < self.completed:
            why = f"one of {traces.completed} generations is left, the result has {self.completed}"
            raise folder.damaged("its last checkpoint", why)
        return traces

    def _verified_history(self, folder: RunFolder) -> "xarray.Dataset":
        path = folder.history_path
        checkpoint = folder.checkpoint()
        seals = {} if checkpoint is None else checkpoint.part("history/")
        if seals:
            # the network may be a function that the folder names, and reading executes nothing
            layout = layout_of(self.configuration, weights=histories.stored_weights(path))
            histories.require_sound(path, layout, self.completed, seals)
        else:
            _LOGGER.warning("%s: not verified, no checkpoint is left.", path)
        return histories.dataset_on_disk(path, self.completed)

    def draws(self) -> np.ndarray | None:
        """Return draws (D, P) of the matched estimate; None where there are none."""
        if self.path is None:
            return self.readout.get("draws")
        checkpoint = stored_checkpoint(RunFolder(self.path), self.configuration)
        return checkpoint.arrays.get(f"{READOUT}draws")

    def jury(self) -> Jury:
        """Return who judges in a run of trials, see `Result.jury`.

        Nobody where its last state is not stored.
        """
        if self.path is None:
            return ()
        state = stored_checkpoint(RunFolder(self.path), self.configuration).part("coevolution/")
        if "drawn" not in state:
            return ()
        evolved = np.concatenate((state["archive/genomes"], state["present"][::-1]))
        observers = observers_of(self.configuration)
        return (classifier_of(self.configuration), evolved), (observers, state["drawn"])

    def motion(self, model: np.ndarray) -> Mapping[str, np.ndarray]:
        """Return recorded motion beside that of replicas of a model (P,), see `Source.positions`; nothing if it is not known."""
        if self.path is not None:
            return RunFolder(self.path).find(folders.MOTION) or {}
        if self.arguments.simulate is None:
            return {}
        with self.configuration.system.open(self.arguments) as source:
            rng = np.random.default_rng((REPLAY, self.configuration.run.seed))
            return source.positions(model, rng)

    def samples_and_simulator(self, genuine: Any = None, simulate: Any = None) -> Arguments:
        """Return samples and simulator.

        Those given, else those of this process, else functions that the folder names.
        """
        arguments = self.arguments
        if genuine is not None:
            arguments = replace(arguments, genuine=genuine)
        if simulate is not None:
            arguments = replace(arguments, simulate=simulate)
        if self.path is None:
            return arguments
        with refusing_as(ConfigurationError):
            return RunFolder(self.path).remembered(arguments)

    def opened(self, genuine: Any, simulate: Any) -> Source:
        """Return the samples of the run, opened again, see `samples_and_simulator`."""
        arguments = self.samples_and_simulator(genuine, simulate)
        with refusing_as(ConfigurationError):
            return self.configuration.system.open(arguments)


def layout_of(configuration: Configuration, weights: int | None = None) -> histories.Layout:
    """Return the sizes of a run's history.

    `weights` of a classifier are those of its network by default.
    """
    run = configuration.run
    models = configuration.models
    classifiers = configuration.classifiers
    if weights is None:
        weights = classifier_of(configuration).parameters
    return histories.Layout(
        generations=configuration.length,
        models=models.parents + models.offspring,
        parameters=configuration.parameter_names,
        classifiers=classifiers.parents + classifiers.offspring,
        weights=weights,
        chunk=min(run.checkpoint_every, run.generations),
    )


def stored_checkpoint(folder: RunFolder, configuration: Configuration) -> Checkpoint:
    """Return the newest usable checkpoint; reject a run without."""
    checkpoint = folder.checkpoint()
    if checkpoint is None:
        got = f"{folder.path} without a usable checkpoint"
        remedy = how_to_resume(folder.path, configuration)
        reject_folder("run", "have been saved at least once", got, ("Begin it with ", remedy, "."))
    return checkpoint


def traces_of(
    checkpoint: Checkpoint, folder: RunFolder, configuration: Configuration
) -> histories.Traces:
    traces = histories.Traces(configuration.length, len(configuration.parameter_names))
    traces.restore(folder.traces(checkpoint) or {})
    return traces


def units_of(system: System, names: Iterable[str]) -> dict[str, str]:
    """Return the units of parameters by name, empty where they have none, as the weights of networks."""
    units = dict.fromkeys(names, "")
    for name in units:
        if name in system.parameters:
            units[name] = system.parameters[name].unit
    return units
