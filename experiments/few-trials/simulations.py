"""How many samples runs simulate besides their trials: ``python simulations.py TRIALS``.

They examine the estimate, and other solutions that symmetry may give, at the end and meanwhile. Of each system 60
recordings of one truth are given; a line for each says how many samples came to the trials.
"""

import sys

import numpy as np
from awkward import SYSTEMS

import turing_learning as tl

SEED = 5
NAMES = (
    "plain_polymer",
    "long_gene_expression",
    "short_star",
    "regime_volatility",
    "product_enzyme",
    "irrelevant_neuron",
    "exchangeable_two_chambers",
    "mirrored_flip_flop",
    "wide_pumping",
    "many_competitors",
)
RECORDINGS = 60


def main() -> None:
    """Print the numbers."""
    trials = int(sys.argv[1])
    for name in NAMES:
        system = SYSTEMS[name]
        rng = np.random.default_rng([SEED, 100, *name.encode()])
        truth = [rng.uniform(*ends) for ends in system.truths]
        genuine = system.simulate(np.tile(truth, (RECORDINGS, 1)), rng)
        simulated = []

        def simulate(parameters, rng, system=system, simulated=simulated):
            simulated.append(len(parameters))
            return system.simulate(parameters, rng)

        tl.infer(
            genuine=genuine, simulate=simulate, parameters=system.ranges, trials=trials, seed=SEED, vectorized=True,
            progress=False, settings={"run.threads": 1},
        )  # fmt: skip
        print(name, sum(simulated) - trials, flush=True)


if __name__ == "__main__":
    main()
