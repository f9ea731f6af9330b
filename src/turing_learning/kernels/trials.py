"""Run trials of a swarm from start to end."""

import math
from collections.abc import Callable

import numpy as np

from .compile import compile_cached, inlined
from .geometry import sines_and_cosines
from .motion import (
    advance_involved,
    clear_marks,
    command_wheels,
    glide_free_robots,
    may_touch,
    reach_of_robot,
    set_object_reach,
)
from .sensing import sense
from .world import State, World, new_state

SLOTS = 64
"""Trials that one thread advances side by side at most."""


@inlined
def start_trial(poses: np.ndarray, controllers: np.ndarray, w: int, world: World, state: State) -> None:
    """Place the bodies of a trial at rest at `poses` (bodies, 3)."""
    for i in range(world.bodies):
        state.x[i, w], state.y[i, w], state.heading[i, w] = poses[i, 0], poses[i, 1], poses[i, 2]
        state.vx[i, w] = state.vy[i, w] = state.turn[i, w] = 0.0
    for i in range(world.robots):
        state.reach[i, w] = reach_of_robot(controllers[i], world)


@inlined
def look(world: World, state: State) -> None:
    """Bring the headings' sines, the reaches and the sensor readings up to date."""
    sines_and_cosines(state.heading.reshape(-1), state.sine.reshape(-1), state.cosine.reshape(-1))
    if world.bodies > world.robots:
        for w in range(state.crowd.shape[0]):
            set_object_reach(w, world, state)
    sense(world, state)


@inlined
def act(
    block: int, slots: int, cycle: int, controllers: np.ndarray, keys: np.ndarray, world: World, state: State
) -> None:
    """Command the robots of trials block ... block + slots - 1 and advance everything by a control cycle."""
    for i in range(world.robots):
        for w in range(slots):
            state.start_x[i, w], state.start_y[i, w] = state.x[i, w], state.y[i, w]
    for w in range(slots):
        command_wheels(controllers[block + w], keys[block + w], cycle, w, world, state)
    clear_marks(state)
    for w in range(slots):
        if may_touch(w, world, state):
            advance_involved(w, world, state)
    glide_free_robots(world, state)


@inlined
def write_speeds(speeds: np.ndarray, cycle: int, w: int, world: World, state: State) -> None:
    """Write each robot's signed linear speed and angular speed over the cycle that began at `start_x`, `start_y`.

    A robot's heading follows its commanded turn rate alone: a contact changes the turn rate, which the next command overwrites.
    """
    for i in range(world.robots):
        dx = state.x[i, w] - state.start_x[i, w]
        dy = state.y[i, w] - state.start_y[i, w]
        speed = math.sqrt(dx * dx + dy * dy) / world.interval
        speeds[i, cycle, 0] = -speed if dx * state.cosine[i, w] + dy * state.sine[i, w] < 0.0 else speed
        speeds[i, cycle, 1] = state.command[i, w]


@inlined
def record(poses: np.ndarray, sensors: np.ndarray, w: int, world: World, state: State) -> None:
    """Write the present poses (bodies, 3) and readings (robots,) of a trial."""
    for i in range(world.bodies):
        poses[i, 0], poses[i, 1], poses[i, 2] = state.x[i, w], state.y[i, w], state.heading[i, w]
    for i in range(world.robots):
        sensors[i] = state.reading[i, w]


def _observe_trials(
    block: int,
    slots: int,
    initial: np.ndarray,
    controllers: np.ndarray,
    keys: np.ndarray,
    speeds: np.ndarray,
    world: World,
    state: State,
) -> None:
    """Run trials block ... block + slots - 1: initial (R, B, 3), controllers (R, A, 2 n), keys (R,) -> speeds (R, A, T, 2)."""
    for w in range(slots):
        start_trial(initial[block + w], controllers[block + w], w, world, state)
    for cycle in range(speeds.shape[2]):
        look(world, state)
        act(block, slots, cycle, controllers, keys, world, state)
        for w in range(slots):
            write_speeds(speeds[block + w], cycle, w, world, state)


def _record_trials(
    block: int,
    slots: int,
    initial: np.ndarray,
    controllers: np.ndarray,
    keys: np.ndarray,
    speeds: np.ndarray,
    poses: np.ndarray,
    sensors: np.ndarray,
    world: World,
    state: State,
) -> None:
    """Run trials as above and record poses (R, T + 1, B, 3) and sensor readings (R, T + 1, A) too."""
    for w in range(slots):
        start_trial(initial[block + w], controllers[block + w], w, world, state)
    for cycle in range(speeds.shape[2] + 1):
        look(world, state)
        for w in range(slots):
            record(poses[block + w, cycle], sensors[block + w, cycle], w, world, state)
        if cycle < speeds.shape[2]:
            act(block, slots, cycle, controllers, keys, world, state)
            for w in range(slots):
                write_speeds(speeds[block + w], cycle, w, world, state)


_observe = compile_cached(_observe_trials)
_record = compile_cached(_record_trials)


def _run_in_blocks(kernel: Callable, start: int, stop: int, *arrays: np.ndarray, world: World) -> None:
    for block in range(start, stop, SLOTS):
        slots = min(SLOTS, stop - block)
        kernel(block, slots, *arrays, world, new_state(slots, world.bodies))


def observe_trials(start: int, stop: int, *arrays: np.ndarray, world: World) -> None:
    """Fill speeds (R, A, T, 2) of trials start ... stop - 1 from initial poses, controllers and keys."""
    _run_in_blocks(_observe, start, stop, *arrays, world=world)


def record_trials(start: int, stop: int, *arrays: np.ndarray, world: World) -> None:
    """Fill speeds, poses (R, T + 1, B, 3) and sensor readings (R, T + 1, A) of trials start ... stop - 1."""
    _run_in_blocks(_record, start, stop, *arrays, world=world)
