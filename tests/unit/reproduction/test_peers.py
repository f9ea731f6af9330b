"""Other methods of experiments/few-trials/peers.py, on a system of two parameters: a level and how much motion varies about it."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[3]
TRUTH, LOW, HIGH = np.array([3.0, 1.0]), np.array([0.0, 0.2]), np.array([10.0, 4.0])


def move(models, rng):
    """Return motion (M, 1, 20, 1) of models (M, 2)."""
    level, spread = models.T[:, :, None, None, None]
    return level + spread * rng.standard_normal((len(models), 1, 20, 1))


@pytest.fixture
def peers(monkeypatch):
    for folder in ("experiments/few-trials", "examples"):
        monkeypatch.syspath_prepend(ROOT / folder)
    before = set(sys.modules)
    import peers

    yield peers
    for name in (
        set(sys.modules) - before
    ):  # scripts of these folders, which others have by the same names
        if str(ROOT / "ex") in str(getattr(sys.modules[name], "__file__", "")):
            del sys.modules[name]


@pytest.fixture
def given(peers):
    recorded = move(np.tile(TRUTH, (40, 1)), np.random.default_rng(1))[:, 0]

    def condense(motion):
        return peers.summaries(motion).mean(axis=1)

    return peers.Problem(
        ("level", "spread"), TRUTH, LOW, HIGH, move, recorded, condense, peers.summaries(recorded)
    )


@pytest.mark.filterwarnings("ignore")  # as the script does
@pytest.mark.parametrize(
    ("method", "package", "trials", "most"),
    [
        ("bolfi", "sklearn", 1500, 0.1),
        ("abc-smc", "pyabc", 1500, 0.1),
        ("avo", "torch", 3000, 0.15),
        ("npe", "sbi", 1500, 0.1),
        ("npe-raw", "sbi", 1500, 0.1),
    ],
)
def test_a_peer_finds_level_and_spread(peers, given, method, package, trials, most):
    pytest.importorskip(package)
    found = peers.METHODS[method](given, trials, seed=1)
    assert (np.abs(found.estimate - TRUTH) < most * (HIGH - LOW)).all()
    assert (found.low is None) == (method == "avo")
    if found.low is not None:
        assert (found.low < TRUTH).all()
        assert (found.high > TRUTH).all()


def test_raw_motion_of_a_case_has_the_summaries_of_its_groups(peers):
    walk = peers.problem("walker-25", seed=1)
    models = walk.prior(3, np.random.default_rng(2))
    groups = walk.group(models, np.random.default_rng(3))
    assert groups.shape == (3, peers.GROUP, 100, 2)
    np.testing.assert_array_equal(
        walk.condense(groups), walk.simulate(models, np.random.default_rng(3))
    )
