import numpy as np
import pytest

from turing_learning.identifiability import Effort, Evidence
from turing_learning.models import Parameter

STEPS = 20


def drift(values, rng):
    """Samples whose mean is the first value; the second has no effect."""
    return (values[:, :1] + rng.normal(size=(len(values), STEPS)))[:, None, :, None]


@pytest.fixture(scope="session")
def small():
    return Effort(samples=40, points=6)


@pytest.fixture(scope="session")
def evidence():
    """Make evidence of a system with the true values (0, anything)."""

    def make(seed=0, groups=None, simulate=drift):
        rng = np.random.default_rng((seed, 77))
        genuine = drift(np.zeros((80, 2)), rng)[:, 0]
        return Evidence(
            learning=genuine[:40],
            testing=genuine[40:],
            groups=np.arange(40) if groups is None else groups,
            grouping="samples",
            simulate=simulate,
            parameters={"mean": Parameter(-3, 3), "nothing": Parameter(-1, 1)},
        )

    return make
