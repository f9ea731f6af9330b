"""A run of a custom system with worker processes, to be killed: ``python own_run.py FOLDER PIDS [resume]``."""

import os
import sys
from pathlib import Path

import numpy as np

import turing_learning as tl

PIDS = "OWN_RUN_PIDS"


def simulate(parameters, rng):
    """One sample of noise around a parameter; says which process it runs in."""
    if PIDS in os.environ:
        (Path(os.environ[PIDS]) / str(os.getpid())).touch()
    return parameters[0] + rng.standard_normal((20, 2))


def genuine():
    return 3 + np.random.default_rng(1).standard_normal((30, 20, 2))


SETTINGS = {
    "models.population": 8,
    "classifiers.population": 8,
    "run.threads": 1,
    "run.checkpoint_every": 5,
    "run.history": "thin",
}


def start(folder, **options):
    return tl.infer(
        genuine=genuine(),
        simulate=simulate,
        parameters={"mean": (0, 10)},
        vectorized=False,
        generations=300,
        settings=SETTINGS,
        out=folder,
        **options,
    )


if __name__ == "__main__":
    os.environ[PIDS] = sys.argv[2]
    start(sys.argv[1], workers=2)
