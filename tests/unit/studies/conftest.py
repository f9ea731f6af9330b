from concurrent.futures import ThreadPoolExecutor

import pytest

from turing_learning.studies import study

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.checkpoint_every": 3,
}


@pytest.fixture
def small():
    """Settings whose generations take about a millisecond."""
    return dict(SMALL)


@pytest.fixture
def executor():
    """An executor in this process."""
    with ThreadPoolExecutor(1) as executor:
        yield executor


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A study of three runs that is complete; not to be changed."""
    with ThreadPoolExecutor(1) as executor:
        return study(
            "aggregation",
            runs=3,
            first_seed=5,
            generations=7,
            settings=SMALL,
            executor=executor,
            out=tmp_path_factory.mktemp("finished") / "study",
        )
