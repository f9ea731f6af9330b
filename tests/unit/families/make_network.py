"""Learn the small network of the tests from simulated fish: ``python make_network.py``, with the extra `networks`."""

from pathlib import Path

import numpy as np

from turing_learning.families import Couzin, Network, _imitation, _network
from turing_learning.trajectories import Trajectories

TRUTH = (8, 4, 1.5, 4, 6, 0.2)
"""Speed (cm/s), turning rate (rad/s), radius and widths of the zones (cm), noise (rad) of `Couzin`."""


def main() -> None:
    """Write couzin.safetensors beside this file."""
    # a small file
    _network.MOST_STARTS = 10
    _imitation.MOST_ROWS = 2500
    fish = Couzin(individuals=5, steps=6000, interval_s=0.1, settling_steps=300)
    positions = fish.simulate(np.array([TRUTH], dtype=float), np.random.default_rng(1))[0]
    present = np.ones(positions.shape[:2], dtype=bool)
    recording = Trajectories(positions, present, fps=10, individuals=tuple("abcde"))
    windows = recording.windows(length_s=3, signals=("speed", "turn", "neighbor_distance"))
    network = Network.learned(recording, windows, tanks=(None,), steps=2000, seed=1)
    network.save(Path(__file__).with_name("couzin.safetensors"))


if __name__ == "__main__":
    main()
