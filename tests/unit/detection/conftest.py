from dataclasses import dataclass, replace

import numpy as np
import pytest

from turing_learning.config import load_configuration
from turing_learning.runs import infer, load_run
from turing_learning.swarm import AGGREGATION, Trial

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.generations": 7,
    "run.threads": 1,
}


@dataclass
class SpeedLimits:
    """Classifiers of one number: a sample is genuine if the mean of its first signal is at least that."""

    def judge(self, genomes, samples):
        return (samples[..., 0].mean(axis=1) >= genomes).astype(np.float32)


@pytest.fixture
def speed_limits():
    return SpeedLimits()


@pytest.fixture(scope="session")
def scenario():
    """Three robots for one second."""
    return replace(AGGREGATION, agents=2, trial=Trial(duration_s=1.0, start_side_cm=100.0))


def _stored_run(folder, **settings):
    infer(config=load_configuration(overrides=SMALL | settings), out=folder)
    return load_run(folder)


@pytest.fixture(scope="session")
def run(tmp_path_factory):
    """A small run in a folder, with its full history; not to be changed."""
    return _stored_run(tmp_path_factory.mktemp("full") / "run")


@pytest.fixture(scope="session")
def thin_run(tmp_path_factory):
    """A small run in a folder, with a thin history; not to be changed."""
    return _stored_run(tmp_path_factory.mktemp("thin") / "run", **{"run.history": "thin"})


@pytest.fixture(scope="session")
def run_of_trials(tmp_path_factory):
    """A small run of 40 trials in a folder; not to be changed."""
    return _stored_run(tmp_path_factory.mktemp("trials") / "run", **{"run.trials": 40})


@pytest.fixture(scope="session")
def thin_run_of_trials(tmp_path_factory):
    """The same with a thin history."""
    return _stored_run(
        tmp_path_factory.mktemp("thin") / "trials", **{"run.trials": 20, "run.history": "thin"}
    )


@pytest.fixture
def motion_at():
    """Make motion (individuals, samples, 4, 2) whose first signal is given by sample (individuals, samples)."""

    def make(values):
        values = np.asarray(values, dtype=float)
        motion = np.zeros((*values.shape, 4, 2))
        motion[..., 0] = values[..., None]
        return motion

    return make
