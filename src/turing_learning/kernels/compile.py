"""Compile kernels, and keep the machine code until any kernel of this room changes."""

import contextlib
import hashlib
import logging
import pickle
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

from .._files import whole

_LOGGER = logging.getLogger("turing_learning.kernels")
_SEAL_BYTES = hashlib.sha256().digest_size
_COMMON: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


@cache
def _room_digest() -> str:
    """Return a digest of the source of every kernel."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _SealedCacheFile(IndexDataCacheFile):
    """Numba's cache files, sealed by a digest and flushed to the disk: a damaged one is compiled again, not loaded."""

    def _dump(self, obj: Any) -> bytes:
        raw = super()._dump(obj)
        return hashlib.sha256(raw).digest() + raw

    def _load_index(self) -> dict[Any, Any]:
        try:
            with Path(self._index_path).open("rb") as file:
                if pickle.load(file) != self._version:  # noqa: S301 - Numba's own files, beside the code
                    return {}
                stamp, overloads = _unsealed(file.read())
        except Exception:  # empty, cut off, or not there: a damaged pickle can raise anything
            return {}
        return overloads if stamp == self._source_stamp else {}

    def _load_data(self, name: str) -> Any:
        try:
            return _unsealed(Path(self._data_path(name)).read_bytes())
        except Exception as error:
            raise OSError(str(error)) from error  # which Numba takes for a missing file

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[BinaryIO]:
        with whole(Path(filepath)) as temporary, temporary.open("wb") as file:
            yield file


def _unsealed(data: bytes) -> Any:
    seal = data[:_SEAL_BYTES]
    raw = data[_SEAL_BYTES:]
    if hashlib.sha256(raw).digest() != seal:
        raise ValueError("damaged machine code")
    return pickle.loads(raw)  # noqa: S301 - Numba's own files, beside the code


class _KernelCache(FunctionCache):
    """Numba's cache, keyed to the source of all kernels.

    Numba looks at the file of the compiled function alone, and would use machine code into which an
    older version of a kernel from another file was inlined.
    """

    def __init__(self, function: Callable[..., Any], notice: str) -> None:
        super().__init__(function)
        self._notice = notice
        self._which = "this"
        file = self._cache_file
        # Another name than Numba's own files and those of earlier versions have.
        name = f"{file._index_name.removesuffix('.nbi')}-sealed"
        self._cache_file = _SealedCacheFile(file._cache_path, name, file._source_stamp)

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (*super()._index_key(sig, codegen), _room_digest())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        overload = super().load_overload(sig, target_context)
        if overload is None and self._notice:
            _LOGGER.info("Compiling %s, once on this machine.", self._notice.format(self._which))
            self._which = "another"
        return overload

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(
            OSError
        ):  # a full disk costs the next start a compilation, nothing else
            super().save_overload(sig, data)


def compile_cached(function: Callable[..., Any], *, notice: str = "", **options: Any) -> Any:
    """Compile `function` without the interpreter lock and keep the machine code on disk where that is possible.

    With a `notice` the log says what is compiled, and how long that takes, when it is not on the
    disk yet; "{}" in it is "this" the first time, and "another" after that.
    """
    dispatcher = njit(**_COMMON, **options)(function)
    with contextlib.suppress(
        RuntimeError
    ):  # no folder can be written: compile anew in each process
        dispatcher._cache = _KernelCache(function, notice)
    return dispatcher


# Without Numba's reference counting, see docs/decisions/0001, and without the wrappers by which
# Python would call them: each would be one more copy of the function to optimize. Force-inlined
# functions are called by compiled functions only.
_INLINED = _COMMON | {"forceinline": True, "_nrt": False, "no_cpython_wrapper": True}


def inlined(function: Callable[..., Any]) -> Any:
    """Mark a function that becomes part of the kernels that call it. It cannot allocate."""
    return njit(**_INLINED)(function)


def contracted(function: Callable[..., Any]) -> Any:
    """Mark an inlined function whose products and sums may be fused: the order of its rounding is nobody's fact."""
    return njit(fastmath={"contract"}, **_INLINED)(function)
