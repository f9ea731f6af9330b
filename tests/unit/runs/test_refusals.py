"""One rule for all doors: what is refused is a ValueError; what ends a run that has begun is none."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.detection import load_motion
from turing_learning.families import Couzin
from turing_learning.identifiability import Effort
from turing_learning.robots import LaboratoryError
from turing_learning.runs import RunFolderError, RunStorageError
from turing_learning.studies import ExecutorError
from turing_learning.systems import CustomSystemError

SAMPLES = np.zeros((10, 5, 1))


def infer(**changes):
    given = {
        "genuine": SAMPLES,
        "simulate": lambda parameters, rng: SAMPLES,
        "parameters": {"speed": (0, 1)},
    }
    return tl.infer(**given | changes)


@pytest.mark.parametrize("kind", [ConfigurationError, RunFolderError])
def test_a_refusal_is_a_value_error(kind):
    assert issubclass(kind, ValueError)


@pytest.mark.parametrize(
    "kind", [CustomSystemError, RunStorageError, LaboratoryError, ExecutorError]
)
def test_what_ends_a_run_is_none(kind):
    assert not issubclass(kind, ValueError)


@pytest.mark.parametrize(
    "door",
    [
        lambda: tl.Parameter(5, 1),
        lambda: tl.Parameter("low", 1),
        lambda: infer(parameters={"speed": (5, 1)}),
        lambda: infer(generations=0),
        lambda: tl.infer("aggregatoin"),
        lambda: tl.load_run("nowhere"),
        lambda: tl.resume("nowhere"),
        lambda: tl.pool([]),
        lambda: tl.study("aggregatoin"),
        lambda: tl.load_study("nowhere"),
        lambda: tl.load_trajectories(__file__, fps=-1),
        lambda: tl.load_trajectories(__file__),
        lambda: Couzin(individuals=0, steps=5),
        lambda: Effort(samples=1),
        lambda: load_motion("nowhere.npy", steps=5, signals=2),
    ],
)
def test_every_door_refuses_by_one(door):
    with pytest.raises(ValueError, match=r"^`.*` must .*; got "):
        door()
