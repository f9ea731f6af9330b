"""A game of a run: held-out genuine motion, and new motion of the estimate."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from turing_learning.config import Configuration
from turing_learning.errors import number, refuse
from turing_learning.examination import (
    QUICK,
    examine,
    paths_of,
    scene_size,
    scenes_of,
    test_held_out,
)
from turing_learning.identifiability import Effort
from turing_learning.identifiability.evidence import evidence_of
from turing_learning.report import Game
from turing_learning.runs import Result, RunFolder, swarm_replay
from turing_learning.swarm import execution_of, initial_poses
from turing_learning.systems import Source
from turing_learning.trajectories import LONGEST_REST_S, Trajectories, Windows

from ._samples import require_windows, samples_of

PAIRS = 6
"""Pairs of a game."""
LENGTH_S = 8.0
"""Duration of a scene of recorded motion (s)."""
SWARM_LENGTH_S = 60.0
"""The same of robots, which are slow."""
SWARM_SPEED = 10.0
"""Seconds of a swarm's time in one second of the game."""
SCENE_ATTEMPTS = 20
"""Groups that are simulated for each scene, until one has as many individuals as are shown."""


def game_of_run(
    result: Result, *, genuine: Any = None, simulate: Any = None, recording: Sequence[Trajectories] = (),
    longest_rest_s: float | None = None, pairs: int = PAIRS, length_s: float | None = None, seed: int = 0,
    title: str = "Which one is real?",
) -> Game:  # fmt: skip
    """Make a Turing test for people of a run: which motion is genuine, and which one that of the estimate?

    Genuine motion is what the run has not learned from: frames and individuals of its recordings that are held out, or new
    trials of a simulated swarm.

    Parameters
    ----------
    result
        Of the run.
    genuine, simulate
        Of a custom system, as when the run began; needed where the run was loaded from a folder.
    recording
        The recordings that the samples are from. Without them, or where the simulator does not say where everybody is,
        single individuals are shown, whose paths follow from the samples.
    longest_rest_s
        Rest (s) at exactly one point beyond which positions stand for missing ones. None takes that with which the run
        has cut its windows, as its folder remembers it, else 10.
    pairs, seed, title
        As in `examination.game`.
    length_s
        Duration of a scene (s). None takes 8, or 60 of robots, ten times as fast.

    Raises
    ------
    ValueError
        If the run is neither on recorded motion nor on simulated robots.
    """
    record = result.stored()
    if length_s is not None:
        number("length_s", length_s, above=0)
    with record.opened(genuine, simulate) as source:
        # a failed simulation is left out
        source.generation = None
        model = result.simulated_model
        options: dict[str, Any] = {"title": title, "seed": seed}
        if record.configuration.system.simulated is not None:
            if length_s is None:
                length_s = SWARM_LENGTH_S
            return _of_swarm(record.configuration, source, model, pairs, length_s, options)
        custom = record.samples_and_simulator(genuine, simulate)
        windows = require_windows(custom.genuine, str(result.path))
        rng = np.random.default_rng((seed, 6))
        simulated = samples_of(source.simulate, model, len(windows.held_out), rng)
        panel = test_held_out(windows, simulated, examiners=QUICK, seed=seed).examined.auc
        options |= {"interval_s": windows.interval_s, "panel": panel}
        # Recordings of groups of several sizes have a model for each size
        groups = getattr(custom.simulate, "groups", (custom.simulate,))
        shares = getattr(custom.simulate, "shares", (1.0,))
        if recording and hasattr(groups[0], "simulate"):
            if length_s is None:
                length_s = LENGTH_S
            if longest_rest_s is None:
                longest_rest_s = _longest_rest_s(result)
            held_out = _held_out(recording, windows, longest_rest_s)
            frames, individuals = scene_size([held_out], pairs, length_s)
            individuals = min(individuals, *(group.individuals for group in groups))
            smooth = windows.smooth_frames
            real = scenes_of(held_out, frames, individuals, pairs, smooth, rng)
            scenes = []
            for index in rng.choice(len(groups), size=pairs, p=shares):
                scenes.append(_simulated(groups[index], model, frames, individuals, rng))
            return Game(real=real, simulated=np.stack(scenes), **options)
        # Without places only single paths can be shown, put together from speed and turn
        sides = []
        for samples in (windows.held_out, simulated):
            paths = paths_of(samples, windows.names, windows.interval_s)
            if paths is None:
                refuse("run", "have the signals speed and turn", ", ".join(windows.names))
            chosen = rng.permutation(len(paths))[:pairs]
            sides.append(paths[chosen][:, :, None])
        return Game(real=sides[0], simulated=sides[1], **options)


def _longest_rest_s(result: Result) -> float:
    """Return the longest rest (s) that a run has believed when it cut its windows."""
    stored = None
    if result.path is not None:
        stored = RunFolder(result.path).recording()
    if stored is None:
        return LONGEST_REST_S
    return float(stored["options"].get("longest_rest", LONGEST_REST_S))


def _held_out(
    recordings: Sequence[Trajectories], windows: Windows, longest_rest_s: float
) -> list[Trajectories]:
    """Return recordings in which nobody is there but who is held out, while they are."""
    held_out = []
    for recording, testing in zip(recordings, windows.frames("held out"), strict=True):
        recording = recording.cleared(longest_rest_s=longest_rest_s)
        present = recording.present & testing
        if present.any():
            positions = np.where(present[..., None], recording.positions, 0.0)
            held_out.append(replace(recording, present=present, positions=positions))
    return held_out


def _simulated(
    group: Any, model: np.ndarray, frames: int, individuals: int, rng: np.random.Generator
) -> np.ndarray:
    """Return positions (F, A, 2) of some individuals of one group."""
    longer = replace(group, steps=max(1, frames - 2))
    for _ in range(SCENE_ATTEMPTS):
        positions = longer.simulate(model[None], rng)[0]
        present = np.flatnonzero(np.isfinite(positions).all(axis=(0, 2)))
        if len(present) >= individuals:
            # neighbors of somebody, as of the recorded ones
            start = positions[0, present]
            distances = np.linalg.norm(start - start[rng.integers(len(present))], axis=1)
            nearest = present[np.argsort(distances, kind="stable")[:individuals]]
            return np.asarray(positions[:, nearest])
    return refuse("simulate", f"move {individuals} individuals", "fewer, or places that are none")


def _of_swarm(
    configuration: Configuration, source: Source, model: np.ndarray, pairs: int, length_s: float,
    options: dict[str, Any],
) -> Game:  # fmt: skip
    """Return a game of a simulated swarm: agents alone, and replicas alone."""
    seed = options["seed"]
    evidence = evidence_of(configuration, source, Effort(), seed)
    rng = np.random.default_rng((seed, 6))
    simulated = samples_of(evidence.simulate, model, len(evidence.testing), rng)
    names = configuration.system.signals
    examined = examine(evidence.testing, simulated, names=names, examiners=QUICK, seed=seed)
    scenario = configuration.swarm
    # agents are -1, replicas execute the one model
    executed = np.repeat([-1, 0], pairs)[:, None] * np.ones(scenario.individuals, dtype=int)
    replay = swarm_replay(
        scenario,
        execution_of(scenario, configuration.representation.behavior(model[None]), executed),
        initial_poses(scenario, 2 * pairs, rng),
        {str(number): False for number in range(2 * pairs)},
        title="",
        duration_s=length_s,
        seed=seed,
        threads=configuration.threads,
    )
    # Items that stay where they are tell nothing.
    moving = scenario.individuals + scenario.objects.count
    positions = np.stack([swarm.poses[:, :moving, :2] for swarm in replay.swarms])
    return Game(
        real=positions[:pairs],
        simulated=positions[pairs:],
        interval_s=replay.interval_s,
        panel=examined.auc,
        speed=SWARM_SPEED,
        **options,
    )
