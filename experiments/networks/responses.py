"""Maps of how networks of simulated animals respond, beside the true ones: ``python responses.py [SEED ...]``.

The systems, recordings and networks are those of simulated.py. The truth is an hour of the system itself. Maps of a
group that runs free for an hour are compared with it, and so are those of the ten minutes that the network has learned
from, which say how much can be expected; an hour that begins elsewhere says how well the truth is known. Rows go to
responses.csv; what is there is not done again. The extra `networks` has to be installed.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
import simulated
from table import append_rows, keys_done

from turing_learning.families import virtual_group
from turing_learning.trajectories import Trajectories, response_maps

PATH = Path(__file__).parent / "responses.csv"
LONG_S = 3600.0
FEWEST = 20
"""Moments in a cell from which on it counts, as in `ResponseMaps.agreement`."""
COMPARED = ("network", "recorded", "another hour")
MAPS = ("turning", "acceleration", "wall_turning")
FIELDS = ("system", "seed", "compared", "map", "cells", "correlation")


def moved(system: str, seed: int, compared: str) -> Trajectories:
    """Return what is compared with the truth."""
    family, truth = simulated.SYSTEMS[system]
    if compared == "recorded":
        return simulated.recorded(system, 10 * seed)
    if compared == "another hour":
        return virtual_group(family, truth, duration_s=LONG_S, seed=10 * seed + 8)
    network = simulated.network_of(system, seed)
    as_recorded = dict.fromkeys(network.parameters, 1.0)
    return virtual_group(network, as_recorded, duration_s=LONG_S, seed=10 * seed + 7)


def rows(system: str, seed: int) -> list[dict[str, object]]:
    """Return the correlations of all maps with the true ones."""
    family, truth = simulated.SYSTEMS[system]
    tank_cm = simulated.SETTLED["tank_cm"]
    hour = virtual_group(family, truth, duration_s=LONG_S, seed=10 * seed + 9)
    true_maps = response_maps(hour, tank_cm=tank_cm)
    table = []
    for compared in COMPARED:
        maps = response_maps(moved(system, seed, compared), tank_cm=tank_cm, like=true_maps)
        agreement = true_maps.agreement(maps)
        for name in MAPS:
            moments = "wall_moments" if name == "wall_turning" else "moments"
            fewest = np.minimum(getattr(true_maps, moments), getattr(maps, moments))
            table.append({
                "system": system, "seed": seed, "compared": compared, "map": name,
                "cells": int((fewest >= FEWEST).sum()), "correlation": f"{agreement[name]:.3f}",
            })  # fmt: skip
    return table


def main() -> None:
    """Write the rows that are missing."""
    done = keys_done(PATH, ("system", "seed"))
    seeds = list(map(int, sys.argv[1:] or ["1"]))
    for seed, system in product(seeds, simulated.SYSTEMS):
        if (system, str(seed)) in done:
            continue
        added = rows(system, seed)
        append_rows(PATH, FIELDS, added)


if __name__ == "__main__":
    main()
