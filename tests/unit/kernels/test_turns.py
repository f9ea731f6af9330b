"""Trials whose contacts are resolved in turns, against the same trials one at a time: the same to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.kernels.involved import new_pairs, take_turns
from turing_learning.kernels.stepping import ALL_PAIRS
from turing_learning.kernels.trials import TOGETHER
from turing_learning.swarm import AGGREGATION, AGGREGATION_VIEW_60, OBJECT_CLUSTERING, Arena, initial_poses, observe

SCENARIOS = {
    "a crowd": AGGREGATION,
    "objects": OBJECT_CLUSTERING,
    "walls": replace(AGGREGATION, arena=Arena(width_cm=70.0, height_cm=50.0)),
    "fields of view": AGGREGATION_VIEW_60,
}
TRIALS = 2 * TOGETHER + 5


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
    field = np.full(controllers.shape[:2], scenario.sensor.field_of_view) if scenario.sensor.field_of_view else None

    def observed(of):
        return observe(scenario, controllers[of], poses[of], keys[of], 1, None if field is None else field[of])

    together = observed(slice(None))
    for trial in range(TRIALS):
        np.testing.assert_array_equal(together[trial], observed(slice(trial, trial + 1))[0])


def test_pairs_of_a_trial_stay_in_order_between_those_of_the_others():
    bodies, pairs = 4, new_pairs(3, 4)
    pairs.near[0, :3] = [[0, 1], [0, 2], [2, 3]]
    pairs.near[2, :1] = [[1, 3]]
    pairs.number[:] = 3, 0, 1
    place = np.arange(100, 100 + 3 * bodies)
    assert take_turns(3, bodies, pairs, place) == 4
    expected = [[100, 101], [109, 111], [100, 102], [102, 103]]
    np.testing.assert_array_equal(pairs.turn[:4], expected)


def test_where_every_pair_of_a_trial_counts_there_is_no_list():
    pairs = new_pairs(2, 4)
    pairs.number[:] = 1, ALL_PAIRS
    assert take_turns(2, 4, pairs, np.arange(8)) == ALL_PAIRS
