"""Trials of laboratories that are right, each with other agents, noise and phases; and what can be wrong with their tracks."""

from dataclasses import replace

import numpy as np

from turing_learning.robots import LABORATORY, Track
from turing_learning.robots.program._plausible import TrackCheck
from turing_learning.swarm import initial_poses, simulate
from turing_learning.trajectories import wrap

IMAGES = 51
SPARE = 2  # control cycles, for phases


def trials(
    seed,
    *,
    agents=8,
    replicas=2,
    controller=None,
    lag=0,
    spread=0.0,
    noise_cm=0.03,
    noise_rad=0.005,
    near=None,
):
    """Yield poses (51, A, 3) and the models that were sent (R, 4), trial by trial; every robot has its own phase.

    Models are any, or `near` the agents', as late in a run.
    """
    rng = np.random.default_rng(seed)
    robot = replace(LABORATORY.robot, actuation_lag_cycles=lag, wheel_scale_spread=spread)
    scenario = replace(LABORATORY, agents=agents, replicas=replicas, robot=robot)
    genuine = rng.uniform(-1, 1, 4) if controller is None else np.array(controller)
    phases = rng.uniform(0, 1, agents + replicas)[None, :, None]
    while True:
        models = rng.uniform(-1, 1, (replicas, 4))
        if near is not None:
            models = np.clip(genuine + near * models, -1, 1)
        controllers = np.concatenate([np.tile(genuine, (agents, 1)), models])[None]
        start = initial_poses(scenario, 1, rng)
        steps = IMAGES - 1 + SPARE
        motion = simulate(
            scenario,
            controllers,
            start,
            control_steps=steps,
            seed=int(rng.integers(2**31)),
            threads=1,
        )
        way = np.diff(motion.poses[0], axis=0)
        way[..., 2] = wrap(way[..., 2])
        poses = (motion.poses[0, :-1] + phases * way)[:IMAGES]
        poses += rng.normal(0, 1, poses.shape) * [noise_cm, noise_cm, noise_rad]
        poses[..., 2] = wrap(poses[..., 2])
        yield poses, models


def frozen(poses, models, rng):
    poses[..., 2] = poses[0, :, 2]


def frozen_but_for_noise(poses, models, rng):
    poses[..., 2] = poses[0, :, 2] + rng.normal(0, 0.02, poses.shape[:2])


def mirrored(poses, models, rng):
    poses[..., 2] *= -1


def off_by_90(poses, models, rng):
    poses[..., 2] = wrap(poses[..., 2] + np.pi / 2)


def reversed_(poses, models, rng):
    poses[..., 2] = wrap(poses[..., 2] + np.pi)


def in_metres(poses, models, rng):
    poses[..., :2] *= 0.01


def in_degrees(poses, models, rng):
    poses[..., 2] = np.degrees(poses[..., 2])


def addresses_exchanged(poses, models, rng):
    models[:2] = models[[1, 0]]


def agent_and_replica_exchanged(poses, models, rng):
    replica = poses.shape[1] - len(models)
    agent = rng.integers(replica)  # agents with the same marker are numbered anew in each trial
    poses[:, [agent, replica]] = poses[:, [replica, agent]]


def marker_turned_round(poses, models, rng):
    poses[:, -1, 2] = wrap(poses[:, -1, 2] + np.pi)


def wheels_exchanged(poses, models, rng):
    models[-1] = models[-1, [1, 0, 3, 2]]


_before = {}


def a_trial_late(poses, models, rng):
    now = poses[:, -1].copy()
    _, poses[:, -1] = _before.get(id(rng), (rng, now))
    # with the generator, so that no other has its id
    _before[id(rng)] = (rng, now)


def another_program(poses, models, rng):
    models[-1] = rng.uniform(-1, 1, 4)


def other_programs(poses, models, rng):
    models[:] = rng.uniform(-1, 1, models.shape)


WRONG = {
    frozen: "headings look frozen",
    frozen_but_for_noise: "headings look frozen",
    mirrored: "headings look mirrored",
    off_by_90: "headings are off by about 90 degrees",
    reversed_: "headings look reversed",
    in_metres: "positions look like metres",
    in_degrees: "headings look like degrees",
    addresses_exchanged: "executes what replica",
    agent_and_replica_exchanged: "an agent executes what replica",
    marker_turned_round: "replica r2 moves backward",
    wheels_exchanged: "replica r2 turns to the wrong side",
    a_trial_late: "replica r2 executes the model before",
    another_program: "replica r2 does not execute what it was sent",
    other_programs: "no replica executes what it was sent",
}
"""What can be wrong -> how the fault begins, or what it says."""


def found_at(seed, wrong=None, count=10, **options):
    """Return the number of the trial at which something is found, 0 for none, and what."""
    rng = np.random.default_rng([seed, 1])
    replicas = options.get("replicas", 2)
    names = [f"r{number + 1}" for number in range(replicas)]
    check = TrackCheck(LABORATORY.robot, names, LABORATORY.arena)
    for number, (poses, models) in zip(range(1, count + 1), trials(seed, **options), strict=False):
        if wrong is not None:
            wrong(poses, models, rng)
        present = np.ones(poses.shape[:2], bool)
        if fault := check.fault(Track(poses, present, ("x",) * poses.shape[1], 0.1), models):
            return number, fault
    return 0, ""
