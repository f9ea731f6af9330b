"""Compile kernels, and keep the machine code until any kernel of this room changes."""

import contextlib
import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache


@cache
def _room_digest() -> str:
    """Return a digest of the source of every kernel."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _KernelCache(FunctionCache):
    """Numba's cache, keyed to the source of the whole room.

    Numba looks at the file of the compiled function alone, and would go on using machine code into which an older
    version of a kernel from another file was inlined.
    """

    def _index_key(self, sig: Any, codegen: Any) -> tuple:
        return (*super()._index_key(sig, codegen), _room_digest())

    def save_overload(self, sig: Any, data: Any) -> None:
        with contextlib.suppress(OSError):  # a full disk costs the next start a compilation, nothing else
            super().save_overload(sig, data)


def compile_cached(function: Callable, **options: Any) -> Any:
    """Compile `function` without the interpreter lock and keep the machine code on disk where that is possible."""
    dispatcher = njit(nogil=True, error_model="numpy", **options)(function)
    with contextlib.suppress(RuntimeError):  # no folder can be written: compile anew in each process
        dispatcher._cache = _KernelCache(function)
    return dispatcher


# Without Numba's reference counting, see docs/decisions/0001. Force-inlined functions never run on their own.
_INLINED: dict[str, Any] = {"nogil": True, "error_model": "numpy", "forceinline": True, "_nrt": False}


def inlined(function: Callable) -> Any:
    """Mark a function that becomes part of the kernels that call it. It cannot allocate."""
    return njit(**_INLINED)(function)


def contracted(function: Callable) -> Any:
    """Mark an inlined function whose products and sums may be fused: the order of its rounding is nobody's fact."""
    return njit(fastmath={"contract"}, **_INLINED)(function)
