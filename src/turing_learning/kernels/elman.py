"""Compile the Elman judge for a network size, once per process and cached between processes.

The generated source (see `elman_source`) is written to the user's cache folder, because Numba keeps compiled code only
for functions that come from a file. `TURING_LEARNING_CACHE_DIR` names another folder. What runs is the text generated
here, never what a file says; where the folder cannot be used, the judge is compiled in memory, a second per process.
"""

import os
import sys
from functools import lru_cache
from hashlib import sha256
from importlib.abc import InspectLoader
from importlib.machinery import ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path
from types import CodeType, ModuleType

from platformdirs import user_cache_path

from .._files import write_atomically
from .elman_source import elman_source

CACHE_VARIABLE = "TURING_LEARNING_CACHE_DIR"


@lru_cache(maxsize=64)
def load_elman(inputs: int, hidden: int) -> ModuleType:
    """Return a module with ``pack`` and ``judge``, compiled for ``inputs`` inputs and ``hidden`` hidden neurons."""
    return _load_cached(inputs, hidden) or _load_in_memory(inputs, hidden)


def cache_folder() -> Path:
    """Return the folder of the generated modules; it need not exist."""
    chosen = os.environ.get(CACHE_VARIABLE)
    return (Path(chosen) if chosen else user_cache_path("turing-learning")) / "kernels"


def _load_cached(inputs: int, hidden: int) -> ModuleType | None:
    source = elman_source(inputs, hidden, cache=True)
    name = f"elman_{inputs}_{hidden}_{sha256(source.encode()).hexdigest()[:16]}"
    path = cache_folder() / f"{name}.py"
    try:
        if not path.is_file() or path.read_bytes() != source.encode():
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            write_atomically(path, source.encode())
        return _run(name, source, str(path))
    except Exception:  # whatever is wrong with the cache (full, damaged, not writable), the judge works without it
        return None


def _load_in_memory(inputs: int, hidden: int) -> ModuleType:
    name = f"elman_{inputs}_{hidden}"
    return _run(name, elman_source(inputs, hidden, cache=False), f"<{name}>")


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
