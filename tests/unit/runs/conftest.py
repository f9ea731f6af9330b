import pytest

from turing_learning.config import load_configuration

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.generations": 7,
    "run.checkpoint_every": 3,
    "run.threads": 1,
}


@pytest.fixture(scope="session")
def small():
    """A configuration whose generations take about a millisecond."""

    def configure(**changes):
        return load_configuration(overrides=SMALL | {f"run.{name}": value for name, value in changes.items()})

    return configure


@pytest.fixture
def stop_after():
    """Return a should_stop that stops a run after some generations."""

    def make(generations):
        asked = iter([False] * (generations - 1))
        return lambda: next(asked, True)

    return make
