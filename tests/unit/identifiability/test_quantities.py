from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import load_configuration
from turing_learning.families import Vicsek
from turing_learning.identifiability.evidence import (
    compare_quantities,
    recorded_quantities,
    swarm_quantities,
)
from turing_learning.trajectories import Trajectories


def test_equal_distributions_overlap_wholly_and_distant_ones_not_at_all():
    values = np.linspace(0, 1, 200)
    same, other = (
        compare_quantities({"speed": values}, {"speed": values + shift}, {"speed": "cm/s"})[0]
        for shift in (0, 5)
    )
    assert same.overlap == pytest.approx(1)
    assert other.overlap == 0
    assert same.unit == "cm/s"
    assert sum(same.genuine) == pytest.approx(1)


def test_what_only_one_side_has_is_left_out_and_a_constant_is_drawn():
    found = compare_quantities({"a": np.ones(3), "b": np.ones(3)}, {"a": np.ones(4)}, {})
    assert [each.name for each in found] == ["a"]
    assert found[0].edges[0] < 1 < found[0].edges[-1]


def test_swarms_that_execute_the_truth_look_like_the_agents():
    configuration = load_configuration(
        overrides={"scenario.agents": 3, "scenario.trial.duration_s": 2.0, "run.threads": 1}
    )
    truth = np.array(configuration.scenario.controller)
    found = swarm_quantities(configuration, truth, seed=1)
    assert [each.name for each in found] == ["speed", "turn", "neighbor_distance", "polarization"]
    assert min(each.overlap for each in found) == pytest.approx(1)
    away = swarm_quantities(configuration, -truth, seed=1)
    assert away[0].overlap < 0.1


def test_a_recorded_group_is_compared_with_groups_of_the_model():
    group = Vicsek(individuals=6, steps=60, settling_steps=20)
    model = {"speed": 6.0, "noise": 0.3, "radius": 4.0}
    aligned = np.array([list(model.values())])
    positions = group.simulate(aligned, np.random.default_rng(1))[0]
    recording = Trajectories(
        positions, np.ones(positions.shape[:2], dtype=bool), 10.0, tuple("abcdef")
    )
    same = recorded_quantities([recording], group, aligned[0], seed=1)
    wild = recorded_quantities([recording], group, np.array([6.0, 6.2, 4.0]), seed=1)
    assert [each.name for each in same] == ["neighbor_distance", "polarization"]
    assert same[1].overlap > wild[1].overlap + 0.3
    alone = replace(
        recording, positions=positions[:, :1], present=recording.present[:, :1], individuals=("a",)
    )
    assert recorded_quantities([alone], group, aligned[0], seed=1) == ()
