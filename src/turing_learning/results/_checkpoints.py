"""Checkpoints: plain arrays in a file whose name holds the digest of its bytes."""

import hashlib
import io
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from turing_learning._files import write_atomically

KEPT = 2
CONFIGURATION = "configuration_sha256"
"""Among the arrays of a checkpoint: to which configuration it belongs. Those of version 0.1.0 have none."""
_NAME = re.compile(r"^generation-(\d{6,})-([0-9a-f]{16})\.npz$")


@dataclass(frozen=True)
class Checkpoint:
    """The state of a run after so many completed generations: name -> array."""

    generation: int
    arrays: dict[str, np.ndarray]

    def part(self, prefix: str) -> dict[str, np.ndarray]:
        """Return the arrays whose names start with a prefix, without it."""
        return {name.removeprefix(prefix): a for name, a in self.arrays.items() if name.startswith(prefix)}


@dataclass(frozen=True)
class Latest:
    """The newest usable checkpoint, None if there is none, and the files passed over: damaged ones, and refused ones."""

    checkpoint: Checkpoint | None
    damaged: tuple[Path, ...]
    refused: tuple[Path, ...] = ()


def save_checkpoint(folder: Path, checkpoint: Checkpoint, alone: bool = False) -> Path:
    """Write a checkpoint, atomically, in a folder that may be missing; keep the newest two, or it `alone`."""
    folder.mkdir(exist_ok=True)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in checkpoint.arrays.items():
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=False)
    content = buffer.getvalue()
    path = folder / f"generation-{checkpoint.generation:06d}-{_digest(content)}.npz"
    write_atomically(path, content)
    for old in [other for _, other in _newest_first(folder) if other != path][0 if alone else KEPT - 1 :]:
        old.unlink(missing_ok=True)
    return path


def latest_checkpoint(
    folder: Path, accept: Callable[[Checkpoint], bool] = lambda checkpoint: True, configuration: str | None = None
) -> Latest:
    """Read the newest checkpoint that is as it was written, of the run's `configuration` (SHA-256), and that `accept` takes."""
    damaged, refused = list[Path](), list[Path]()
    for generation, path in _newest_first(folder):
        arrays = _read(path)
        if arrays is None or (configuration and str(arrays.get(CONFIGURATION, configuration)) != configuration):
            damaged.append(path)
        elif accept(checkpoint := Checkpoint(generation, arrays)):
            return Latest(checkpoint, tuple(damaged), tuple(refused))
        else:
            refused.append(path)
    return Latest(None, tuple(damaged), tuple(refused))


def stored_generations(folder: Path) -> int:
    """Return the number of generations in the newest checkpoint of a folder, 0 if there is none; nothing is read."""
    return max((generation for generation, _ in _newest_first(folder)), default=0)


def discard_checkpoints(folder: Path, above: int) -> None:
    """Remove checkpoints of more than `above` generations."""
    for path in [path for generation, path in _newest_first(folder) if generation > above]:
        path.unlink(missing_ok=True)


def _newest_first(folder: Path) -> list[tuple[int, Path]]:
    """Return generation and path of every checkpoint; the folder may be missing."""
    named = [(int(found[1]), path) for path in folder.glob("generation-*.npz") if (found := _NAME.match(path.name))]
    return sorted(named, key=lambda each: (each[0], _written_at(each[1])), reverse=True)


def _written_at(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:  # the run that a reader looks at goes on, and has removed it
        return 0


def _read(path: Path) -> dict[str, np.ndarray] | None:
    try:
        content = path.read_bytes()
        if _digest(content) != _NAME.match(path.name)[2]:  # type: ignore[index]
            return None
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (OSError, ValueError, zipfile.BadZipFile):
        return None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]
