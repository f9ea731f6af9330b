"""The history of a run: every generation's populations, step sizes and fitness values; and the
traces that a result is made of."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.coevolution import Generation
from turing_learning.errors import Refusal, require
from turing_learning.store import DamagedError, RunFolderError

from ._loops import TrialBatch

if TYPE_CHECKING:
    import xarray

GENERATION = "generation"
SELECTION_CODES = {"active": 0, "all accepted": 1, "all rejected": 2}
QUANTILES = (0.0, 0.25, 0.5, 0.75, 1.0)
# Of one byte for each generation, which are written before the first
MOST_FILES = 100
NOT_RUN = -1  # the code of generations that have not been run

Variables = dict[str, tuple[tuple[str, ...], str, str]]
"""Name -> dimensions after the generation, type, and what it is."""

FULL: Variables = {
    "model": (("individual", "parameter"), "<f8", "parameter of a model"),
    "model_step_size": (
        ("individual", "parameter"),
        "<f8",
        "step size of a model, in numbers of the search",
    ),
    "model_fitness": (("individual",), "<f8", "fitness of a model"),
    "classifier": (("classifier_individual", "weight"), "<f4", "weight of a classifier"),
    "classifier_step_size": (
        ("classifier_individual", "weight"),
        "<f4",
        "step size of a classifier",
    ),
    "classifier_fitness": (("classifier_individual",), "<f8", "fitness of a classifier"),
    "best_model": (("parameter",), "<f8", "parameter of the best model"),
    "typical_model": (("parameter",), "<f8", "parameter of the typical model"),
    "selection": ((), "<i1", "state of selection"),
}
THIN: Variables = {
    "model_fitness_quantiles": (("quantile",), "<f8", "fitness of models"),
    "classifier_fitness_quantiles": (("quantile",), "<f8", "fitness of classifiers"),
    **{name: FULL[name] for name in ("best_model", "typical_model", "selection")},
}
POPULATIONS = ("model", "classifier")
"""The half of a full history that no report shows."""
# A generation has them in the plural
PLURAL = ("model", "model_step_size", "classifier", "classifier_step_size")
IN_UNITS = ("model", "best_model", "typical_model")  # of the parameters
ATTRIBUTES: dict[str, dict[str, Any]] = {
    "selection": {
        "flag_values": [NOT_RUN, *SELECTION_CODES.values()],
        "flag_meanings": " ".join(
            ["not_run", *(word.replace(" ", "_") for word in SELECTION_CODES)]
        ),
    }
}


@dataclass(frozen=True)
class Layout:
    """The sizes of a full history."""

    generations: int
    models: int
    parameters: tuple[str, ...]  # names
    classifiers: int
    weights: int
    chunk: int  # generations that share a file

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the sizes of a variable in one generation."""
        sizes = {"individual": self.models, "parameter": len(self.parameters)}
        sizes |= {"classifier_individual": self.classifiers, "weight": self.weights}
        return tuple(sizes[dimension] for dimension in FULL[name][0])


class HistoryRecorder:
    """Collect generations and write them in chunks, to anything that takes ``arrays[name][start:stop] = block``."""

    def __init__(
        self,
        layout: Layout,
        arrays: Mapping[str, Any],
        seals: Mapping[str, np.ndarray] | None = None,
    ) -> None:  # the seals of when the arrays had been flushed the last time
        self.arrays = arrays
        self._chunk = layout.chunk
        self._generations = layout.generations
        self._count = 0
        self._stops: list[int] = [] if seals is None else seals["stops"].tolist()
        self._checksums: list[int] = [] if seals is None else seals["checksums"].tolist()
        self._start = self._stops[-1] if self._stops else 0
        self._buffers = memory_arrays(layout, layout.chunk)

    def record(self, values: Mapping[str, np.ndarray]) -> None:
        """Append the `values_of` of a generation; a full chunk is written."""
        for name, buffer in self._buffers.items():
            buffer[self._count] = values[name]
        self._count += 1
        if (self._start + self._count) % self._chunk == 0:
            self.flush()

    def flush(self) -> None:
        """Write what has been collected since the last chunk.

        A chunk that begins is written whole, over whatever is there.
        """
        if not self._count:
            return
        begins = self._start % self._chunk == 0
        size = self._count
        if begins:
            size = min(self._chunk, self._generations - self._start)
        for name, buffer in self._buffers.items():
            unrun = NOT_RUN if buffer.dtype.kind == "i" else np.nan
            buffer[self._count : size] = unrun
            self.arrays[name][self._start : self._start + size] = buffer[:size]
        self._start += self._count
        self._stops.append(self._start)
        self._checksums.append(
            _checksum({name: buffer[: self._count] for name, buffer in self._buffers.items()})
        )
        self._count = 0

    def seals(self) -> dict[str, np.ndarray]:
        """Return where each block that was flushed ends, and its checksum; see `intact`."""
        return {
            "stops": np.array(self._stops, dtype=np.int64),
            "checksums": np.array(self._checksums, dtype=np.uint32),
        }


def memory_arrays(layout: Layout, generations: int | None = None) -> dict[str, np.ndarray]:
    """Return arrays for a history that is kept in memory, or for so many of its generations."""
    count = layout.generations if generations is None else generations
    arrays = {}
    for name, (_, dtype, _) in FULL.items():
        arrays[name] = np.empty((count, *layout.shape(name)), dtype=dtype)
    return arrays


def create_store(path: Path, layout: Layout) -> Mapping[str, Any]:
    """Make an empty history on disk, in place of one that exists.

    Return its arrays, NaN in generations that have not been run.
    """
    import zarr

    group = zarr.open_group(str(path), mode="w", zarr_format=2)

    def create(name: str, dimensions: Sequence[str], **options: Any) -> Any:
        about = {"_ARRAY_DIMENSIONS": list(dimensions), **ATTRIBUTES.get(name, {})}
        return group.create_array(name, compressors=None, attributes=about, **options)

    for name, (dimensions, dtype, _) in FULL.items():
        shape = (layout.generations, *layout.shape(name))
        chunk = layout.chunk
        options: dict[str, Any] = {"dtype": dtype, "fill_value": np.nan}
        if dtype == "<i1":
            # codes: no fill value, which xarray would turn into NaN; written at once, in few files
            chunk *= max(1, layout.generations // (MOST_FILES * layout.chunk))
            options["fill_value"] = None
        create(
            name,
            (GENERATION, *dimensions),
            shape=shape,
            chunks=(min(chunk, shape[0]), *shape[1:]),
            **options,
        )
    for name, values in (
        (GENERATION, np.arange(layout.generations)),
        ("parameter", np.array(layout.parameters)),
    ):
        options = {"dtype": values.dtype, "fill_value": None}
        create(name, (name,), shape=values.shape, chunks=values.shape, **options)[:] = values
    zarr.consolidate_metadata(str(path), zarr_format=2)
    arrays = open_store(path)
    arrays["selection"][:] = NOT_RUN
    return arrays


def open_store(path: Path) -> Mapping[str, Any]:
    """Open a history on disk for reading and writing."""
    import zarr

    # a chunk of nothing but zeros is a file too, so that `holds` can tell it from one that is lost
    with zarr.config.set({"array.write_empty_chunks": True}):
        group = zarr.open_group(str(path), mode="r+", zarr_format=2)
        return {str(name): group[name] for name in group.array_keys()}


def stored_weights(path: Path) -> int:
    """Return the number of weights of a classifier in a history on disk; 0 if it cannot be read."""
    try:
        return int(open_store(path)["classifier"].shape[-1])
    except Exception:
        # Whatever Zarr says of files that it did not expect
        return 0


def damaged_generations(
    path: Path, layout: Layout, generations: int, seals: Mapping[str, np.ndarray]
) -> list[tuple[int, int]] | None:
    """Return which of so many generations are not as the seals say, as (first, behind the last); None if none can be read."""
    try:
        arrays = open_store(path)
        fits = True
        for name, (_, dtype, _) in FULL.items():
            fits &= arrays[name].shape == (layout.generations, *layout.shape(name))
            fits &= arrays[name].dtype == np.dtype(dtype)
        named = list(map(str, arrays["parameter"][:])) == list(layout.parameters)
        counted = np.array_equal(arrays[GENERATION][:], np.arange(layout.generations))
    except Exception:
        # Whatever Zarr says of files that it did not expect
        return None
    stops = seals["stops"].tolist()
    if (
        not (fits and named and counted and (path / ".zmetadata").is_file())
        or (stops[-1:] or [0])[0] < generations
    ):
        return None
    damaged = []
    for (start, stop), checksum in zip(
        pairwise([0, *stops]), seals["checksums"].tolist(), strict=True
    ):
        if start >= generations:
            break
        # Zarr takes a chunk that is lost for one that was never written
        sound = True
        for name in FULL:
            chunk = (start // arrays[name].chunks[0], *(0,) * (arrays[name].ndim - 1))
            sound &= (path / name / ".".join(map(str, chunk))).is_file()
        try:
            sound = (
                sound and _checksum({name: arrays[name][start:stop] for name in FULL}) == checksum
            )
        except Exception:
            # Whatever Zarr says of a chunk that is cut short
            sound = False
        if not sound:
            damaged.append((start, stop))
    return damaged


def intact(path: Path, layout: Layout, generations: int, seals: Mapping[str, np.ndarray]) -> bool:
    """Return whether a history on disk holds exactly so many generations, as they were flushed."""
    stops = seals["stops"].tolist()[-1:] or [0]
    return stops == [generations] and damaged_generations(path, layout, generations, seals) == []


def require_sound(
    path: Path, layout: Layout, generations: int, seals: Mapping[str, np.ndarray]
) -> None:
    """Reject a history that is not as it was flushed, naming the generations."""
    damaged = damaged_generations(path, layout, generations, seals)
    which = ", ".join(f"{start} to {stop - 1}" for start, stop in damaged or [])
    got = "files that cannot be read, or of another run"
    if damaged:
        got = f"damage in generations {which}"
    rule = "have its history as it was written"
    remedy = "Restore the files, or run again."
    require(damaged == [], "run", rule, got, remedy, place=str(path), error=DamagedError)


def _checksum(values: Mapping[str, np.ndarray]) -> int:
    return reduce(
        lambda total, array: zlib.crc32(np.ascontiguousarray(array).data, total), values.values(), 0
    )


def dataset_in_memory(
    arrays: "Mapping[str, np.ndarray] | Traces", parameters: Sequence[str], completed: int
) -> "xarray.Dataset":
    """Return the completed generations of a history in memory as named arrays.

    A full one, or what traces hold.
    """
    import xarray

    coordinates = {GENERATION: np.arange(completed), "parameter": np.array(parameters)}
    if isinstance(arrays, Traces):
        coordinates["quantile"] = np.array(QUANTILES)
    variables_of = _variables_of(arrays)
    variables = {}
    for name in variables_of:
        dimensions = (GENERATION, *variables_of[name][0])
        variables[name] = (dimensions, arrays[name][:completed], ATTRIBUTES.get(name, {}))
    return xarray.Dataset(variables, coords=coordinates)


def completed_arrays(
    arrays: "Mapping[str, np.ndarray] | Traces", completed: int
) -> dict[str, np.ndarray]:
    """Return the same as arrays by name, without the populations."""
    names = [name for name in _variables_of(arrays) if name not in POPULATIONS]
    return {name: arrays[name][:completed] for name in names}


def _variables_of(arrays: "Mapping[str, np.ndarray] | Traces") -> Variables:
    return THIN if isinstance(arrays, Traces) else FULL


def dataset_on_disk(path: Path, completed: int) -> "xarray.Dataset":
    """Return a history on disk as named arrays, read when they are used."""
    import xarray

    try:
        return xarray.open_zarr(path, chunks=None).isel({GENERATION: slice(0, completed)})
    except Exception as error:
        # Whatever Zarr says of files that it did not expect
        got = f"{path.parent} without a readable {path.name} ({type(error).__name__})"
        why = Refusal("run", "have its history", got, remedy="Restore it, or run again.")
        raise RunFolderError(why) from error


def with_units(history: "xarray.Dataset", units: Sequence[str]) -> "xarray.Dataset":
    """Give a history names and units, which its files do not have.

    Fitness is a share, of unit 1.
    """
    names = {"quantile": "share of the population below"}
    for name, (_, _, description) in (FULL | THIN).items():
        names[name] = description
    for name in map(str, history.variables):
        history[name].attrs["long_name"] = names.get(name, name)
        unit = ""
        if "fitness" in name:
            unit = "1"
        if name in IN_UNITS and len(set(units)) == 1:
            unit = units[0]
        if unit:
            history[name].attrs["units"] = unit
    history["parameter"].attrs["units"] = list(units)
    return history


def values_of(step: Generation | TrialBatch) -> dict[str, np.ndarray]:
    """Return all that is kept of a generation, or of a batch of trials, by the names of the history.

    A history is made of generations. In a run of trials the estimate after a batch stands for the
    typical model of one, and its populations are not kept.
    """
    if isinstance(step, TrialBatch):
        return {
            "model": step.models,
            "model_fitness": step.model_fitness,
            "classifier_fitness": step.classifier_fitness,
            "best_model": step.best_model,
            "typical_model": step.estimate,
            "selection": np.array(SELECTION_CODES["active"], dtype=np.int8),
        }
    values = {}
    for name in FULL:
        attribute = f"{name}s" if name in PLURAL else name
        values[name] = getattr(step, attribute)
    values["selection"] = np.array(SELECTION_CODES[step.selection], dtype=np.int8)
    return values


class Traces:
    """What a thin history keeps of up to `capacity` generations, with the spread of the models and the seconds taken."""

    def __init__(self, capacity: int, parameters: int) -> None:
        self.completed = 0
        sizes = {
            "best_model": parameters,
            "typical_model": parameters,
            "model_fitness_quantiles": len(QUANTILES),
        }
        sizes |= {"classifier_fitness_quantiles": len(QUANTILES), "model_spread": parameters}
        self._arrays: dict[str, np.ndarray] = {}
        for name, size in sizes.items():
            self._arrays[name] = np.zeros((capacity, size))
        self._arrays["selection"] = np.full(capacity, NOT_RUN, dtype=np.int8)
        self._arrays["seconds"] = np.zeros(capacity)

    def record(self, values: Mapping[str, np.ndarray], seconds: float) -> None:
        """Append the `values_of` of a generation and the time it took (s)."""
        values_now: dict[str, Any] = {**values, "seconds": seconds}
        for population in ("model", "classifier"):
            fitness = np.sort(values_now[f"{population}_fitness"])
            # As `numpy.quantile` does, for less than its overhead
            ranks = np.multiply(QUANTILES, len(fitness) - 1)
            values_now[f"{population}_fitness_quantiles"] = np.interp(
                ranks, np.arange(len(fitness)), fitness
            )
        # Of models that run away
        with np.errstate(over="ignore", invalid="ignore"):
            values_now["model_spread"] = np.std(values["model"], axis=0)
        for name, array in self._arrays.items():
            array[self.completed] = values_now[name]
        self.completed += 1

    def __getitem__(self, name: str) -> np.ndarray:
        """Return an array over the completed generations, a view."""
        return self._arrays[name][: self.completed]

    def state(self, which: slice) -> dict[str, np.ndarray]:
        """Return copies of all arrays over some of the completed generations."""
        return {name: self[name][which].copy() for name in self._arrays}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a `state` of all generations."""
        self.completed = len(state["seconds"])
        for name, array in self._arrays.items():
            array[: self.completed] = state[name]
