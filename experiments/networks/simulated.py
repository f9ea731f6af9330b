"""Networks of simulated animals whose truth is known, put to the test: ``python simulated.py [SEED ...]``.

A network learns from ten minutes of six animals in a tank, with the usual settings. Two other recordings of the same
animals, that nothing was learned from, are examined, in windows of 5 s. Rows go to simulated.csv, and networks to files
beside it; what is there is not done again. The variants:

* *recorded*: the panel compares a fourth recording with the two.
* *network*: groups that run free, in place of that recording.
* *form of 0066*, *form of 0075*: the same before decisions 0075 and 0077. The first was examined by the panel before
  decision 0073.

The extra `networks` has to be installed.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.families import BurstAndCoast, Couzin, Family, Network, virtual_group
from turing_learning.trajectories import Trajectories, pooled_windows

HERE = Path(__file__).parent
PATH = HERE / "simulated.csv"
RECORDED_S = 600.0
WINDOW_S = 5.0
SIGNALS = ("speed", "turn", "neighbor_distance", "neighbor_bearing")
TESTED = 240
"""Windows of either side of a test."""
BLOCK_S = 20.0
"""Windows of a recording that begin within so long (s) are of one group."""
SETTLED = {"individuals": 6, "interval_s": 0.1, "tank_cm": (40.0, 30.0), "settling_steps": 6000}
"""A group has moved for ten minutes before it is recorded."""
SYSTEMS: dict[str, tuple[Family, dict[str, float]]] = {
    "couzin": (
        Couzin(**SETTLED),
        {
            "speed": 8.0, "turning_rate": 2.0, "repulsion_radius": 1.5,
            "orientation_width": 3.0, "attraction_width": 10.0, "noise": 0.2,
        },
    ),
    "burst and coast": (
        BurstAndCoast(**SETTLED),
        {"speed": 15.0, "kick_interval": 0.6, "glide_time": 0.5, "turn": 0.6},
    ),
}  # fmt: skip
"""Each system: its family, and its truth."""
FIELDS = (
    "system",
    "seed",
    "variant",
    "accuracy",
    "low",
    "high",
    "p_value",
    "power_accuracy",
    "told_by",
)


def recorded(system: str, seed: int) -> Trajectories:
    """Return ten minutes of a group that has settled."""
    family, truth = SYSTEMS[system]
    return virtual_group(family, truth, duration_s=RECORDED_S, seed=seed)


def network_of(system: str, seed: int) -> Network:
    """Return a network that has learned from a recording, from its file where there is one."""
    path = HERE / f"simulated-{system.replace(' ', '-')}-{seed}.safetensors"
    if not path.exists():
        recording = recorded(system, 10 * seed)
        windows = recording.windows(length_s=WINDOW_S, signals=SIGNALS)
        Network.learned(recording, windows, seed=seed).save(path)
    return Network.load(path)


def some_windows(recordings: list[Trajectories], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return windows of recordings, drawn by chance, and the groups that they are of."""
    windows = pooled_windows(recordings, hold_out=0.0, length_s=WINDOW_S, signals=SIGNALS)
    chosen = np.random.default_rng([seed, 3]).permutation(len(windows.learning))[:TESTED]
    block = windows.learning_index[chosen, 1] // round(BLOCK_S / windows.interval_s)
    return windows.learning[chosen], windows.learning_recording[chosen] * 1000 + block


def row(system: str, seed: int, variant: str) -> dict[str, object]:
    """Return how well a variant is told, and by what."""
    examined = [recorded(system, 10 * seed + k) for k in (1, 2)]
    if variant == "recorded":
        windows, owners = some_windows([recorded(system, 10 * seed + 3)], seed + 1)
    else:
        network = network_of(system, seed)
        as_recorded = np.ones((TESTED, len(network.parameters)))
        windows = network(as_recorded, np.random.default_rng([seed, 5]))[:, 0]
        owners = np.arange(TESTED)
    real, real_owners = some_windows(examined, seed)
    test = tl.test(real, windows, groups=(real_owners, owners), names=SIGNALS, seed=seed)
    low, high = test.examined.interval
    power = test.examined.power_accuracy
    statistic = next((cue for cue in test.telling if cue.kind == "statistic"), None)
    return {
        "system": system, "seed": seed, "variant": variant,
        "accuracy": f"{test.accuracy:.3f}", "low": f"{low:.3f}", "high": f"{high:.3f}",
        "p_value": f"{test.p_value:.3f}",
        "power_accuracy": "" if power is None else f"{power:.3f}",
        "told_by": "" if statistic is None else f"{statistic.what}: {statistic.words}",
    }  # fmt: skip


def main() -> None:
    """Write the rows that are missing."""
    done = keys_done(PATH, ("system", "seed", "variant"))
    seeds = list(map(int, sys.argv[1:] or ["1"]))
    for seed, system, variant in product(seeds, SYSTEMS, ("recorded", "network")):
        if (system, str(seed), variant) in done:
            continue
        added = row(system, seed, variant)
        print(added, flush=True)
        append_rows(PATH, FIELDS, [added])


if __name__ == "__main__":
    main()
