"""Trials whose contacts are resolved in turns, against the same trials one at a time: the same to the last bit."""

import re
from dataclasses import replace

import llvmlite.binding
import numpy as np
import pytest
from numba import njit

from turing_learning.kernels.stepping import push_all_apart
from turing_learning.kernels.world import LANES, new_lanes, new_party
from turing_learning.swarm import (
    AGGREGATION,
    AGGREGATION_VIEW_60,
    OBJECT_CLUSTERING,
    Arena,
    initial_poses,
    observe,
)

SCENARIOS = {
    "a crowd": AGGREGATION,
    "objects": OBJECT_CLUSTERING,
    "walls": replace(AGGREGATION, arena=Arena(width_cm=70.0, height_cm=50.0)),
    "fields of view": AGGREGATION_VIEW_60,
}
TRIALS = 2 * LANES + 5


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("fastest", [1.0, 8.0], ids=["as agents", "one fast"])
def test_trials_side_by_side_are_those_one_at_a_time(name, fastest):
    """A fast robot pushes others farther than their reach, so that its trial, and those in turns with it, are begun anew."""
    scenario = SCENARIOS[name]
    rng = np.random.default_rng(4)
    poses = initial_poses(scenario, TRIALS, rng, side_cm=None if scenario.arena.bounded else 40.0)
    controllers = np.tile(scenario.controller, (TRIALS, scenario.individuals, 1))
    controllers[::3, 0] *= fastest
    keys = np.arange(TRIALS, dtype=np.uint64)
    field = (
        np.full(controllers.shape[:2], scenario.sensor.field_of_view)
        if scenario.sensor.field_of_view
        else None
    )

    def observed(of):
        return observe(
            scenario, controllers[of], poses[of], keys[of], 1, None if field is None else field[of]
        )

    together = observed(slice(None))
    for trial in range(TRIALS):
        np.testing.assert_array_equal(together[trial], observed(slice(trial, trial + 1))[0])


def test_contacts_of_several_trials_are_resolved_by_vector_instructions():
    if not llvmlite.binding.get_host_cpu_features().get("avx"):
        pytest.skip("this processor has no AVX registers")

    @njit(error_model="numpy")
    def resolve(hits, party, lanes):
        push_all_apart(hits, party, lanes)

    resolve(2, new_party(22), new_lanes())
    assembly = "\n".join(resolve.inspect_asm().values())
    assert re.search(r"vdivpd\b.*%[yz]mm", assembly)
    assert not re.search(r"\bv?divsd\b", assembly)
