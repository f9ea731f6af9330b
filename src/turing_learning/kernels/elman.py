"""Compile the Elman judge for a network size, once per process and cached between processes.

The generated source (see `elman_source`) is written to the user's cache folder, because Numba keeps
compiled code only for functions that come from a file. `TURING_LEARNING_CACHE_DIR` names another
folder. What runs is the text generated here, never what a file says; where the folder cannot be
used, the judge is compiled in memory, a second per process.
"""

import os
import sys
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import ModuleType

from platformdirs import user_cache_path

from .._files import write_atomically
from .elman_source import elman_source

CACHE_VARIABLE = "TURING_LEARNING_CACHE_DIR"


def cache_folder() -> Path:
    """Return the folder of the generated modules; it need not exist."""
    chosen = os.environ.get(CACHE_VARIABLE)
    return (Path(chosen) if chosen else user_cache_path("turing-learning")) / "kernels"


@lru_cache(maxsize=64)
def load_elman(inputs: int, hidden: int) -> ModuleType:
    """Return a module with ``pack`` and ``judge``, compiled for so many inputs and hidden neurons."""
    name = f"elman_{inputs}_{hidden}"
    source = elman_source(inputs, hidden, cache=True)
    cached = f"{name}_{sha256(source.encode()).hexdigest()[:16]}"
    path = cache_folder() / f"{cached}.py"
    try:
        if not path.is_file() or path.read_bytes() != source.encode():
            path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            write_atomically(path, source.encode())
        return _run(cached, source, str(path))
    except Exception:
        # Whatever is wrong with the cache (full, damaged, not writable), the judge works without it.
        return _run(name, elman_source(inputs, hidden, cache=False), f"<{name}>")


def _run(name: str, text: str, path: str) -> ModuleType:
    """Return a module of a text in memory that claims to come from a file."""
    module = ModuleType(f"{__package__}.{name}")
    module.__file__ = path
    sys.modules[module.__name__] = module  # Numba looks the module up when it loads cached code
    try:
        exec(compile(text, path, "exec", dont_inherit=True), vars(module))  # noqa: S102 - the text is generated above
    except BaseException:
        del sys.modules[module.__name__]
        raise
    return module
