"""Population-based optimizers with one interface: `ask` for the population to score, `tell` its fitness.

The module knows no robots, no models and no classifiers; it imports nothing but numpy and scipy.

===========================  ===============================================================================
`Optimizer`                  The protocol: what the coevolution needs of an optimizer, and all it knows of one.
`EvolutionStrategy`          The paper's (mu + lambda) evolution strategy with self-adaptive step sizes; `STEP_SIZE_LIMIT` and
                             `FASTEST_ADAPTATION` are the largest ones, and the fastest rate.
`PhasedMating`, `Jumper`     Parts of it in the default preset: fewer parents at first and their means later, jumps,
`FitnessMemory`              and a memory of fitness.
`CMAEvolutionStrategy`       CMA-ES from the package `cma` (extra ``optimizers``), behind the same protocol.
`RenewedOptimizer`           Replaces an optimizer by a fresh one at regular intervals.
`Seed`, `check_seed`         What a seed is: a non-negative integer, or several.
`generation_rng`             The random generator of one generation.
`state_arrays`               The arrays of a stored state, checked; `join_states` and `state_part` put states together and take
                             them apart, `check_generation` reads the number of completed generations.
===========================  ===============================================================================
"""

from ._checks import (
    Seed,
    check_generation,
    check_seed,
    generation_rng,
    join_states,
    state_arrays,
    state_part,
)
from ._cma import CMAEvolutionStrategy
from ._evolution_strategy import FASTEST_ADAPTATION, STEP_SIZE_LIMIT, EvolutionStrategy
from ._optimizer import Optimizer, RenewedOptimizer
from ._parts import FitnessMemory, Jumper, PhasedMating

__all__ = [
    "FASTEST_ADAPTATION", "STEP_SIZE_LIMIT", "CMAEvolutionStrategy", "EvolutionStrategy", "FitnessMemory", "Jumper",
    "Optimizer", "PhasedMating", "RenewedOptimizer", "Seed", "check_generation", "check_seed",
    "generation_rng", "join_states", "state_arrays", "state_part",
]  # fmt: skip
