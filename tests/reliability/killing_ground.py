"""A process that imports and compiles once, and then forks children that run in a folder and are killed.

It reads lines "start FOLDER" and "resume FOLDER", answers with the child's process id, and after the child's end with
its wait status. It makes no threads, so that forking is safe.
"""

import os
import sys
from importlib import import_module
from pathlib import Path

import turing_learning.classifiers
import turing_learning.runs
import turing_learning.swarm
from turing_learning.config import load_configuration

CONFIGURATION = load_configuration(
    overrides={
        "models.population": 8,
        "classifiers.population": 8,
        "scenario.agents": 2,
        "scenario.trial.duration_s": 1.0,
        "run.generations": 40,
        "run.checkpoint_every": 4,
        "run.threads": 1,
    }
)


IMPORTED = (
    "matplotlib.backends.backend_agg",
    "matplotlib.backends.backend_svg",
    "turing_learning.runs._report",
    "xarray.backends",
    "zarr",
)
"""What a run needs, imported before the fork: each child would do it anew, which takes longer than its run."""


def serve() -> None:
    """Answer requests until the input ends."""
    for name in IMPORTED:
        import_module(name)
    turing_learning.infer(config=CONFIGURATION, generations=1)  # compile
    tell("ready")
    for line in sys.stdin:
        verb, folder = line.split(maxsplit=1)
        child = os.fork()
        if child == 0:
            run(verb, Path(folder.strip()))
        tell(child)
        tell(os.waitpid(child, 0)[1])


def tell(answer: object) -> None:
    """Write one line."""
    sys.stdout.write(f"{answer}\n")
    sys.stdout.flush()


def run(verb: str, folder: Path) -> None:
    """Run in the child, and end it."""
    try:
        if verb == "start":
            turing_learning.runs.start(CONFIGURATION, folder)
        else:
            turing_learning.runs.resume(folder)
    except BaseException as error:
        sys.stderr.write(f"{error!r}\n")
        os._exit(3)
    os._exit(0)


if __name__ == "__main__":
    serve()
