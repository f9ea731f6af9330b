import numpy as np
import pytest

import turing_learning as tl
from turing_learning.examination import game, pool_answers

RNG = np.random.default_rng(9)
HEADER = "game,player,pair,answer,real,right,seconds\n"


def recording(individuals, frames, fps=10.0):
    """Walkers, the first of whom is away now and then."""
    positions = np.cumsum(RNG.standard_normal((frames, individuals, 2)), axis=0)
    present = np.ones((frames, individuals), dtype=bool)
    present[::40, 0] = False
    positions[~present] = 0.0
    names = tuple(map(str, range(individuals)))
    return tl.Trajectories(positions, present, fps, names)


def test_scenes_show_as_many_individuals_on_both_sides_without_gaps():
    made = game([recording(6, 300)], [recording(4, 600, fps=20.0)], pairs=3, seed=2)
    assert made.real.shape == made.simulated.shape
    assert made.real.shape[0] == 3
    assert made.real.shape[2] <= 4
    assert made.interval_s == pytest.approx(0.1)
    assert 0 <= made.panel <= 1
    assert np.isfinite(made.real).all()
    # nobody stands where those are put who are away
    assert (np.abs(made.real).max(axis=-1) > 0).all()


def test_answers_of_several_people_are_pooled(tmp_path):
    rows = ["ab,Ann,1,left,left,1,2.0", "ab,Ann,2,left,right,0,2.0"]
    (tmp_path / "ann.csv").write_text(HEADER + "\n".join(rows) + "\n")
    (tmp_path / "none.csv").write_text(HEADER + 'ab,"",1,left,left,1,2.0\n')
    pooled = pool_answers(tmp_path.glob("*.csv"))
    assert (pooled.right, pooled.answers, pooled.people) == (2, 3, 2)
    assert pooled.p_value == pytest.approx(0.5)
    assert str(pooled).startswith("2 people: 2 of 3 right (accuracy 0.667, 0.094 to 0.992; p = 0.5")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match=r"`files` must be saved by a game"):
        pool_answers([tmp_path / "other.csv"])
