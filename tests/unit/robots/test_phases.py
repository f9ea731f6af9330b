"""Agents and replicas that act at different phases of a control cycle are told by them, others are not."""

import numpy as np
import pytest
from program_laboratory import FILE, ScriptedLaboratory

from turing_learning.robots import LABORATORY, LaboratorySource, load_laboratory
from turing_learning.robots.program._phases import told_by_phase

TRUTH = (0.8, 0.5, -0.4, 0.6)
ROBOT = LABORATORY.robot
STEPS, TRIALS, AGENTS, REPLICAS = 50, 40, 8, 2


def samples(rng, models, phases, wheels=1.0):
    """Return speeds (S, T, 2) of robots that see something now and then, of models (S, 4) and phases (S,)."""
    sights = rng.random((len(models), STEPS + 1)) < 0.2
    states = models.reshape(-1, 2, 2)
    held = states[np.arange(len(models))[:, None], sights.astype(int)] * wheels
    # an image comes when so much of a cycle has passed
    left, right = np.moveaxis(
        held[:, :-1] * phases[:, None, None] + held[:, 1:] * (1 - phases[:, None, None]), -1, 0
    )
    left, right = (speed + rng.normal(0, 0.02, speed.shape) for speed in (left, right))
    linear = ROBOT.maximum_speed_cm_s * (left + right) / 2
    angular = ROBOT.maximum_speed_cm_s * (right - left) / ROBOT.wheel_distance_cm
    return np.stack([linear, angular], axis=-1)


def observed(agents, replicas, *, trials=TRIALS, wheels=1.0, seed=1):
    """Return samples of agents and of replicas, and the replicas' models.

    Their phases are those given, (robots,), or drawn anew in each trial if None.
    """
    rng = np.random.default_rng(seed)
    models = np.tile(TRUTH, (trials * AGENTS, 1)), rng.uniform(-1, 1, (trials * REPLICAS, 4))
    seen = []
    for executed, phases in zip(models, (agents, replicas), strict=True):
        drawn = rng.uniform(0, 1, len(executed))
        if phases is not None:
            drawn = np.resize(phases, len(executed))
        seen.append(samples(rng, executed, drawn, wheels))
    return *seen, models[1]


def told(agents, replicas, *, estimate=TRUTH, **options):
    """Say whether robots with these phases are told, see `observed`."""
    genuine, counterfeit, models = observed(agents, replicas, **options)
    return told_by_phase(genuine, np.tile(estimate, (len(genuine), 1)), counterfeit, models, ROBOT)


SPREAD = np.arange(AGENTS) / AGENTS


@pytest.mark.parametrize("agents", [SPREAD, [0.3], None], ids=["spread", "one", "redrawn"])
def test_replicas_with_a_phase_of_their_own_are_told(agents):
    assert told(agents, [0.8, 0.9])


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5, None])
@pytest.mark.parametrize(
    "options",
    [{}, {"wheels": np.array([1.1, 0.9])}, {"estimate": (0.8, 0.5, -0.3, 0.65)}],
    ids=["right", "wheels are wrong", "estimate is off"],
)
def test_robots_are_not_told_that_act_together_or_at_any_phase(phase, options):
    phases = None if phase is None else [phase]
    assert not any(told(phases, phases, seed=seed, **options) for seed in range(5))


def test_replicas_at_any_phase_are_told_from_agents_at_one_but_not_from_agents_at_many():
    assert told([0.3], None)
    assert not told(SPREAD**1.5, None, trials=200)


def test_nothing_is_said_of_few_trials_or_of_robots_that_never_change():
    assert not told(SPREAD, [0.8, 0.9], trials=8)
    rng = np.random.default_rng(1)
    models = np.full((200, 4), 0.5)
    first, second = (samples(rng, models, np.full(200, phase)) for phase in (0.2, 0.7))
    assert not told_by_phase(first, models, second, models, ROBOT)


@pytest.mark.parametrize("of_trials", [True, False])
def test_a_laboratory_tells_phases_by_the_wheel_speeds_of_its_models(tmp_path, of_trials):
    path = tmp_path / "lab.toml"
    path.write_text(FILE)
    laboratory = load_laboratory(path)
    source = LaboratorySource(
        laboratory.setup,
        laboratory.configuration.scenario,
        ScriptedLaboratory().equipment(),
        spent=(lambda batch: batch) if of_trials else None,
    )

    def says(agents, replicas):
        genuine, counterfeit, models = observed(agents, replicas)
        estimate = np.array(TRUTH)
        if not of_trials:
            # the optimizer of a run by generations has any numbers
            estimate, models = np.arctanh(estimate), np.arctanh(models)
        return source.told_by_phases(genuine, estimate, counterfeit, models)

    assert says(SPREAD, [0.8, 0.9])
    assert not says([0.3], [0.3])
