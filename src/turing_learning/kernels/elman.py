"""Compile the Elman judge for a network size, once per process and cached between processes.

The generated source (see `elman_source`) is written to the user's cache folder, because Numba keeps compiled code only
for functions that come from a file. `TURING_LEARNING_CACHE_DIR` names another folder. What runs is the text generated
here, never what a file says; where the folder cannot be used, the judge is compiled in memory, a second per process.
"""

import contextlib
import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, ModuleType

from platformdirs import user_cache_path

from .elman_source import elman_source

CACHE_VARIABLE = "TURING_LEARNING_CACHE_DIR"


@dataclass(frozen=True)
class ElmanKernels:
    """The compiled functions for one network size; `elman_source` says what they do."""

    pack: Callable[..., None]
    judge: Callable[..., None]


@lru_cache(maxsize=64)
def load_elman(inputs: int, hidden: int) -> ElmanKernels:
    """Return the compiled judge for ``inputs`` inputs and ``hidden`` hidden neurons."""
    module = _load_cached(inputs, hidden) or _load_in_memory(inputs, hidden)
    return ElmanKernels(module.pack, module.judge)


def cache_folder() -> Path:
    """Return the folder of the generated modules; it need not exist."""
    chosen = os.environ.get(CACHE_VARIABLE)
    return (Path(chosen) if chosen else user_cache_path("turing-learning")) / "kernels"


def _load_cached(inputs: int, hidden: int) -> ModuleType | None:
    source = elman_source(inputs, hidden, cache=True)
    name = f"elman_{inputs}_{hidden}_{sha256(source.encode()).hexdigest()[:16]}"
    path = cache_folder() / f"{name}.py"
    try:
        _keep_on_disk(path, source)
        return _run(name, source, str(path))
    except Exception:  # whatever is wrong with the cache (full, damaged, not writable), the judge works without it
        return None


def _load_in_memory(inputs: int, hidden: int) -> ModuleType:
    name = f"elman_{inputs}_{hidden}"
    return _run(name, elman_source(inputs, hidden, cache=False), f"<{name}>")


def _keep_on_disk(path: Path, text: str) -> None:
    with contextlib.suppress(OSError, UnicodeDecodeError):
        if path.read_text(encoding="utf-8") == text:
            return
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


class _TextLoader(InspectLoader):
    """Load a module from a text in memory that claims to come from a file."""

    def __init__(self, text: str, path: str) -> None:
        self._text, self._path = text, path

    def get_source(self, fullname: str) -> str:
        return self._text

    def get_code(self, fullname: str) -> CodeType:
        return self.source_to_code(self._text, self._path)


def _run(name: str, text: str, path: str) -> ModuleType:
    loader = _TextLoader(text, path)
    module = module_from_spec(ModuleSpec(f"{__package__}.{name}", loader, origin=path))
    sys.modules[module.__name__] = module  # Numba looks the module up when it loads cached code
    try:
        loader.exec_module(module)
    except BaseException:
        del sys.modules[module.__name__]
        raise
    return module
