"""The whole history of a run: every generation's populations, step sizes and fitness values."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._traces import NOT_RUN, QUANTILES, SELECTION_CODES, Traces

if TYPE_CHECKING:
    import xarray

GENERATION = "generation"


@dataclass(frozen=True)
class Layout:
    """The sizes of a history: G generations of M models with P named parameters and N classifiers with Q weights.

    `chunk` is the number of generations that share a file.
    """

    generations: int
    models: int
    parameters: tuple[str, ...]
    classifiers: int
    weights: int
    chunk: int

    def variables(self) -> dict[str, tuple[tuple[str, ...], str]]:
        """Return name -> dimensions after the generation, and type."""
        return {
            "model": (("individual", "parameter"), "<f8"),
            "model_step_size": (("individual", "parameter"), "<f8"),
            "model_fitness": (("individual",), "<f8"),
            "classifier": (("classifier_individual", "weight"), "<f4"),
            "classifier_step_size": (("classifier_individual", "weight"), "<f4"),
            "classifier_fitness": (("classifier_individual",), "<f8"),
            "best_model": (("parameter",), "<f8"),
            "typical_model": (("parameter",), "<f8"),
            "selection": ((), "<i1"),
        }

    def shape(self, dimensions: Sequence[str]) -> tuple[int, ...]:
        """Return the sizes of dimensions."""
        sizes = {
            "individual": self.models,
            "parameter": len(self.parameters),
            "classifier_individual": self.classifiers,
            "weight": self.weights,
        }
        return tuple(sizes[dimension] for dimension in dimensions)

    def attributes(self, name: str) -> dict[str, Any]:
        """Return what describes a variable."""
        return selection_attributes() if name == "selection" else {}


def selection_attributes() -> dict[str, Any]:
    """Return what the codes of `selection` mean."""
    return {
        "flag_values": [NOT_RUN, *SELECTION_CODES.values()],
        "flag_meanings": " ".join(["not_run", *(word.replace(" ", "_") for word in SELECTION_CODES)]),
    }


class ThinRecorder:
    """Keep nothing but what the traces keep."""

    def record(self, values: Mapping[str, np.ndarray]) -> None:
        """Do nothing."""

    def flush(self) -> None:
        """Do nothing."""

    def seals(self) -> dict[str, np.ndarray]:
        """Return nothing."""
        return {}


class HistoryRecorder:
    """Collect generations and write them chunk by chunk.

    Parameters
    ----------
    layout
        The sizes.
    arrays
        Name -> array over all generations, anything that takes ``array[start:stop] = block``.
    seals
        What `seals` returned when the arrays had been flushed the last time; None for empty arrays.
    """

    def __init__(
        self, layout: Layout, arrays: Mapping[str, Any], seals: Mapping[str, np.ndarray] | None = None
    ) -> None:
        self._arrays = arrays
        self._chunk = layout.chunk
        self._generations = layout.generations
        self._count = 0
        self._stops: list[int] = [] if seals is None else seals["stops"].tolist()
        self._checksums: list[int] = [] if seals is None else seals["checksums"].tolist()
        self._start = self._stops[-1] if self._stops else 0
        self._buffers = {
            name: np.empty((layout.chunk, *layout.shape(dimensions)), dtype=kind)
            for name, (dimensions, kind) in layout.variables().items()
        }

    def record(self, values: Mapping[str, np.ndarray]) -> None:
        """Append the `generation_values` of a generation; a full chunk is written."""
        for name, buffer in self._buffers.items():
            buffer[self._count] = values[name]
        self._count += 1
        if (self._start + self._count) % self._chunk == 0:
            self.flush()

    def flush(self) -> None:
        """Write what has been collected since the last chunk; a chunk that begins is written whole, over whatever is there."""
        if not self._count:
            return
        begins = self._start % self._chunk == 0
        size = min(self._chunk, self._generations - self._start) if begins else self._count
        for name, buffer in self._buffers.items():
            buffer[self._count : size] = _nothing(buffer.dtype)
            self._arrays[name][self._start : self._start + size] = buffer[:size]
        self._start += self._count
        self._stops.append(self._start)
        self._checksums.append(_checksum({name: buffer[: self._count] for name, buffer in self._buffers.items()}))
        self._count = 0

    def seals(self) -> dict[str, np.ndarray]:
        """Return where each block that was flushed ends, and its checksum; see `intact`."""
        return {"stops": np.array(self._stops, dtype=np.int64), "checksums": np.array(self._checksums, dtype=np.uint32)}


def memory_arrays(layout: Layout) -> dict[str, np.ndarray]:
    """Return arrays for a history that is kept in memory."""
    return {
        name: np.empty((layout.generations, *layout.shape(dimensions)), dtype=kind)
        for name, (dimensions, kind) in layout.variables().items()
    }


def create_store(path: Path, layout: Layout) -> Mapping[str, Any]:
    """Make an empty history on disk; one that exists is replaced.

    Parameters
    ----------
    path
        The folder of the store.
    layout
        The sizes.

    Returns
    -------
    Mapping[str, zarr.Array]
        The arrays, NaN in generations that have not been run.
    """
    import zarr

    group = zarr.open_group(str(path), mode="w", zarr_format=2)
    for name, (dimensions, kind) in layout.variables().items():
        _create_array(group, layout, name, dimensions, kind)
    _create_coordinate(group, GENERATION, np.arange(layout.generations))
    _create_coordinate(group, "parameter", np.array(layout.parameters))
    zarr.consolidate_metadata(str(path), zarr_format=2)
    arrays = open_store(path)
    arrays["selection"][:] = NOT_RUN
    return arrays


def _create_array(group: Any, layout: Layout, name: str, dimensions: Sequence[str], kind: str) -> None:
    shape = layout.shape(dimensions)
    codes = kind == "<i1"  # have no fill value, which xarray would turn into NaN
    group.create_array(
        name,
        shape=(layout.generations, *shape),
        chunks=(min(layout.chunk, layout.generations), *shape),
        dtype=kind,
        fill_value=None if codes else np.nan,
        compressors=None,
        attributes={"_ARRAY_DIMENSIONS": [GENERATION, *dimensions], **layout.attributes(name)},
    )


def _create_coordinate(group: Any, name: str, values: np.ndarray) -> None:
    array = group.create_array(
        name,
        shape=values.shape,
        chunks=values.shape,
        dtype=values.dtype,
        fill_value=None,
        compressors=None,
        attributes={"_ARRAY_DIMENSIONS": [name]},
    )
    array[:] = values


def open_store(path: Path) -> Mapping[str, Any]:
    """Open a history on disk for reading and writing."""
    import zarr

    # a chunk of nothing but zeros is a file too, so that `holds` can tell it from one that is lost
    with zarr.config.set({"array.write_empty_chunks": True}):
        group = zarr.open_group(str(path), mode="r+", zarr_format=2)
        return {str(name): group[name] for name in group.array_keys()}


def holds(path: Path, layout: Layout, generations: int) -> bool:
    """Return whether a history on disk fits the layout and has all chunks of its first generations."""
    if not (path / ".zmetadata").is_file():
        return False
    try:
        arrays = open_store(path)
    except (OSError, KeyError, ValueError):
        return False
    return all(_holds_array(arrays.get(name), layout, spec, generations) for name, spec in layout.variables().items())


def intact(path: Path, layout: Layout, generations: int, seals: Mapping[str, np.ndarray]) -> bool:
    """Return whether the first generations of a history on disk are as they were flushed.

    Parameters
    ----------
    path, layout, generations
        As in `holds`.
    seals
        Of the recorder that had flushed these generations.
    """
    if not holds(path, layout, generations):
        return False
    stops = seals["stops"].tolist()
    if (stops[-1] if stops else 0) != generations:
        return False
    arrays = open_store(path)
    try:
        found = [
            _checksum({name: arrays[name][start:stop] for name in layout.variables()})
            for start, stop in pairwise([0, *stops])
        ]
    except (OSError, ValueError):  # zarr's words for a chunk that is cut short
        return False
    return found == seals["checksums"].tolist()


def _nothing(kind: np.dtype[Any]) -> float:
    """Return what stands for a generation that has not been run."""
    return NOT_RUN if kind.kind == "i" else np.nan


def _checksum(values: Mapping[str, np.ndarray]) -> int:
    total = 0
    for array in values.values():
        total = zlib.crc32(np.ascontiguousarray(array).data, total)
    return total


def _holds_array(array: Any, layout: Layout, spec: tuple[tuple[str, ...], str], generations: int) -> bool:
    if array is None or array.shape != (layout.generations, *layout.shape(spec[0])):
        return False
    return array.nchunks_initialized >= -(-generations // array.chunks[0])


def dataset_in_memory(layout: Layout, arrays: Mapping[str, np.ndarray], completed: int) -> "xarray.Dataset":
    """Return a history that was kept in memory as named arrays."""
    import xarray

    return xarray.Dataset(
        {
            name: ((GENERATION, *dimensions), arrays[name][:completed], layout.attributes(name))
            for name, (dimensions, _) in layout.variables().items()
        },
        coords={GENERATION: np.arange(completed), "parameter": np.array(layout.parameters)},
    )


def dataset_on_disk(path: Path, completed: int) -> "xarray.Dataset":
    """Return a history on disk as named arrays, read when they are used."""
    import xarray

    return xarray.open_zarr(path, chunks=None).isel({GENERATION: slice(0, completed)})


def thin_dataset(traces: Traces, parameters: Sequence[str]) -> "xarray.Dataset":
    """Return what the traces keep as named arrays.

    Parameters
    ----------
    traces
        Of the completed generations.
    parameters
        Names of the P model parameters.
    """
    import xarray

    models, fitness = (GENERATION, "parameter"), (GENERATION, "quantile")
    return xarray.Dataset(
        {
            "model_fitness_quantiles": (fitness, traces["model_fitness_quantiles"]),
            "classifier_fitness_quantiles": (fitness, traces["classifier_fitness_quantiles"]),
            "best_model": (models, traces["best_model"]),
            "typical_model": (models, traces["typical_model"]),
            "selection": ((GENERATION,), traces["selection"], selection_attributes()),
        },
        coords={
            GENERATION: np.arange(traces.completed),
            "parameter": np.array(parameters),
            "quantile": np.array(QUANTILES),
        },
    )
