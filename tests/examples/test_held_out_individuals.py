"""The examples of docs/identifiability.md that keep individuals for testing alone, as they stand there, in a fast form."""

import re
from pathlib import Path

import numpy as np

import turing_learning as tl
from turing_learning.families import BurstAndCoast
from turing_learning.identifiability import Effort

PAGE = (Path(__file__).parents[2] / "docs" / "identifiability.md").read_text(encoding="utf-8")
BLOCKS = [
    block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "fish 10" in block
]
FAST = {
    "tl.infer(": 'tl.infer(generations=2, settings={"models.population": 8, "classifiers.population": 8, "run.threads": 1}, ',
    "result.check(": "result.check(effort=QUICK, recoveries=0, ",
}


def test_individuals_are_kept_for_testing_alone(capsys):
    quick = Effort(samples=10, points=0)
    fish = tuple(f"fish {k + 1}" for k in range(10))
    positions = BurstAndCoast(individuals=10, steps=1500, interval_s=0.1).simulate(
        np.array([[12.0, 0.5, 0.8, 0.3]]), np.random.default_rng(1)
    )[0]
    recording = tl.Trajectories(
        positions, np.ones(positions.shape[:2], dtype=bool), fps=10.0, individuals=fish
    )
    names = {
        "tl": tl,
        "np": np,
        "BurstAndCoast": BurstAndCoast,
        "QUICK": quick,
        "recording": recording,
    }
    all_times = recording.windows(length_s=4.0, hold_out=0.0)
    names |= {"samples": all_times.learning, "fish": np.array(fish)[all_times.learning_index[:, 0]]}
    assert len(BLOCKS) == 2
    for block, grouping in zip(BLOCKS, ("individuals", "groups"), strict=True):
        for old, new in FAST.items():
            assert old in block
            block = block.replace(old, new)
        exec(block, names)  # noqa: S102 - our own page
        printed = capsys.readouterr().out
        assert "genuine_groups=4" in printed
        assert f"grouping='{grouping}'" in printed
    assert set(names["windows"].learning_index[:, 0]) == set(range(6))
    assert set(names["windows"].held_out_index[:, 0]) == {6, 7, 8, 9}
