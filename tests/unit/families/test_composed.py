"""Families that are put together from parts."""

import numpy as np
import pytest

from turing_learning.errors import RefusedError
from turing_learning.families import BurstAndCoast, Composed, model_named

FISH = {"speed": 12, "kick_interval": 0.5, "glide_time": 0.8, "turn": 0.5}
WALLS = {"wall_turning": 8, "wall_distance": 4}
PACK = {"attraction": 3, "alignment": 1, "balance_distance": 2, "social_range": 10}


def shares(samples: np.ndarray) -> np.ndarray:
    """Return percentiles of speed and of turns in either direction (5, 2)."""
    return np.percentile(np.abs(samples), (5, 25, 50, 75, 95), axis=(0, 1))


def test_kicks_alone_are_burst_and_coast() -> None:
    shape = {"individuals": 1, "steps": 100}
    walk = BurstAndCoast(**shape).observe(FISH, groups=1500, rng=np.random.default_rng(1))
    kicks = Composed(**shape, parts=("kicks",))
    motion = kicks.observe(FISH | {"bend": 0}, groups=1500, rng=np.random.default_rng(2))
    np.testing.assert_allclose(shares(motion), shares(walk), rtol=0.04, atol=1e-9)


def test_persistent_motion_has_the_moments_of_its_processes() -> None:
    walk = Composed(individuals=1, steps=200, parts=("persistent",), settling_steps=0)
    truth = {"speed": 10, "speed_variation": 0.5, "turning": 1.0, "memory": 1.0}
    speed, turn = walk.observe(truth, groups=1000, rng=np.random.default_rng(3)).T
    assert speed.mean() == pytest.approx(10, rel=0.02)
    assert np.log(speed).std() == pytest.approx(0.5, rel=0.03)
    assert turn.std() == pytest.approx(1.0, rel=0.03)
    wandering = turn - turn.mean()
    # ten steps are one second, after which 1 / e is left
    kept = (wandering[10:] * wandering[:-10]).mean() / wandering.var()
    assert kept == pytest.approx(np.exp(-1), abs=0.02)


def test_walls_are_avoided_and_others_approached() -> None:
    parts = ("kicks", "walls", "social")
    fish = Composed(individuals=5, tank_cm=(40, 30), steps=20, parts=parts)
    near = FISH | {"bend": 1.0} | WALLS | PACK
    alone = near | {"wall_turning": 0, "attraction": 0, "alignment": 0}
    distances = []
    for truth in (near, alone):
        models = np.tile(list(truth.values()), (100, 1))
        positions = fish.simulate(models, np.random.default_rng(4))
        assert (positions >= 0).all()
        assert (positions <= (40, 30)).all()
        wall = np.minimum(positions, (40, 30) - positions).min(axis=-1).mean()
        center = positions.mean(axis=2, keepdims=True)
        distances.append((wall, np.linalg.norm(positions - center, axis=-1).mean()))
    (wall, spread), (wall_alone, spread_alone) = distances
    assert wall > 1.3 * wall_alone
    assert spread < 0.8 * spread_alone


def test_lasting_differences_and_the_tracker_are_as_large_as_they_say() -> None:
    shape = {"individuals": 1, "steps": 50, "signals": ("speed",)}
    still = {"speed": 0, "speed_variation": 0, "turning": 0, "memory": 1}
    moving = still | {"speed": 10}
    apart = Composed(**shape, parts=("persistent", "differences"))
    speeds = apart.observe(
        moving | {"speed_differences": 0.3}, groups=2000, rng=np.random.default_rng(5)
    )
    np.testing.assert_allclose(speeds, np.broadcast_to(speeds[:, :1], speeds.shape))
    assert np.log(speeds[:, 0]).std() == pytest.approx(0.3, rel=0.06)
    tracked = Composed(**shape, parts=("persistent", "tracker"))
    models = np.tile([*still.values(), 0.05], (500, 1))
    positions = tracked.simulate(models, np.random.default_rng(6))
    errors = positions - positions.mean(axis=1, keepdims=True)
    assert errors.std() == pytest.approx(0.05, rel=0.03)


@pytest.mark.parametrize(
    ("name", "mistake"),
    [
        ("kicks+wall", "wall"),
        ("kicks+persistent", "one of"),
        ("walls", "one of"),
        ("kicks+kicks", "once"),
    ],
)
def test_parts_that_make_no_family_are_refused(name: str, mistake: str) -> None:
    with pytest.raises(RefusedError, match=mistake):
        model_named(name)


def test_walls_need_a_tank() -> None:
    with pytest.raises(ValueError, match="tank"):
        Composed(parts=("kicks", "walls"))


def test_an_unknown_model_is_refused_in_one_place_and_a_name_states_its_parts() -> None:
    for name, own, message in (
        ("kikcs", True, r"`--model` must be one of .*, or parts as kicks\+walls, or module:name"),
        ("mine:walk", False, r"`--model` must be one of .*as kicks\+walls; got 'mine:walk'. A sim"),
    ):
        with pytest.raises(RefusedError, match=message):
            model_named(name, "--model", own=own)
    settings = model_named("kicks+walls").settings_of("kicks+walls")
    assert Composed(**settings, tank_cm=(30, 20)).name == "kicks+walls"
    assert Composed.needs_tank(**settings)
    assert not BurstAndCoast.needs_tank(**BurstAndCoast.settings_of("burst-and-coast"))
