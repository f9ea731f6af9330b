"""Run trials of a swarm from start to end."""

import math

import numpy as np

from .compile import compile_cached, inlined
from .motion import (
    command_wheels,
    delay_commands,
    drive,
    glide_free_robots,
    mistake,
    reach_of_robot,
    set_object_reach,
    sines_and_cosines,
)
from .sensing import open_view, sense, sense_one_trial
from .stepping import advance_involved
from .tiles import REORDER_CYCLES, Tiles, new_tiles, read_sensors, renew_boxes, renew_order
from .world import (
    LANES,
    Imperfections,
    Lanes,
    Networks,
    Pairs,
    Party,
    State,
    World,
    new_lanes,
    new_pairs,
    new_party,
    new_state,
)

SLOTS = 64
"""Trials that one thread advances side by side at most."""
MANY_BODIES = 40
"""Up to this number of bodies, plain loops over all pairs are faster, above it tiles, one trial at a time."""


def slots_of(bodies: int) -> int:
    """Return the largest number of trials that are advanced side by side.

    Those of many bodies are advanced one by one.
    """
    return 1 if bodies > MANY_BODIES else SLOTS


@inlined
def start_trial(
    poses: np.ndarray, controllers: np.ndarray, w: int, world: World, state: State
) -> None:
    """Place the bodies of a trial at rest at `poses` (bodies, 3)."""
    for i in range(world.bodies):
        state.x[i, w] = poses[i, 0]
        state.y[i, w] = poses[i, 1]
        state.heading[i, w] = poses[i, 2]
        state.vx[i, w] = state.vy[i, w] = state.turn[i, w] = 0.0
    for i in range(world.robots):
        state.reach[i, w] = reach_of_robot(controllers[i], world)


@inlined
def sense_in_tiles(
    cycle: int, sectors: np.ndarray | None, world: World, state: State, tiles: Tiles
) -> None:
    """Read the sensors of the only trial, one of many bodies, and bring its tiles up to date."""
    x, y = state.x[:, 0], state.y[:, 0]
    if cycle % REORDER_CYCLES == 0:
        renew_order(x, y, tiles)
    renew_boxes(x, y, world.sight_radius, state.reach[:, 0], tiles)
    if sectors is None:
        read_sensors(state.cosine[:, 0], state.sine[:, 0], state.reading[:, 0], world, tiles)
    else:
        sense_one_trial(world, state)
    state.crowd[0] = 1.0


@inlined
def look(cycle: int, world: World, state: State, lanes: Lanes | None, tiles: Tiles | None) -> None:
    """Bring the headings' sines, the reaches and the sensor readings up to date."""
    sines_and_cosines(state.heading.reshape(-1), state.sine.reshape(-1), state.cosine.reshape(-1))
    if world.bodies > world.robots:
        for w in range(state.crowd.shape[0]):
            set_object_reach(w, world, state)
    if lanes is not None:
        sense(world.sectors, world, state)
    if tiles is not None:
        sense_in_tiles(cycle, world.sectors, world, state, tiles)


@inlined
def write_speeds(speeds: np.ndarray, cycle: int, w: int, world: World, state: State) -> None:
    """Write each robot's signed linear speed and angular speed over the cycle that began at `start_x`, `start_y`.

    A robot's heading follows its commanded turn rate alone: a contact changes the turn rate, which
    the next command overwrites.
    """
    for i in range(world.robots):
        dx = state.x[i, w] - state.start_x[i, w]
        dy = state.y[i, w] - state.start_y[i, w]
        speed = math.sqrt(dx * dx + dy * dy) / world.interval
        speeds[i, cycle, 0] = (
            -speed if dx * state.cosine[i, w] + dy * state.sine[i, w] < 0.0 else speed
        )
        speeds[i, cycle, 1] = state.command[i, w]


@inlined
def record(poses: np.ndarray, sensors: np.ndarray, w: int, world: World, state: State) -> None:
    """Write the present poses (bodies, 3) and readings (robots,) of a trial."""
    for i in range(world.bodies):
        poses[i, 0] = state.x[i, w]
        poses[i, 1] = state.y[i, w]
        poses[i, 2] = state.heading[i, w]
    for i in range(world.robots):
        sensors[i] = state.reading[i, w]


def _advance_trials(
    block: int, initial: np.ndarray, controllers: np.ndarray, keys: np.ndarray, speeds: np.ndarray, poses: np.ndarray,
    sensors: np.ndarray, world: World, state: State, pairs: Pairs, party: Party, lanes: Lanes | None,
    tiles: Tiles | None, networks: Networks | None, imperfections: Imperfections | None,
) -> None:  # fmt: skip
    """Run the trials from `block` on, one in each slot of the state.

    initial (R, B, 3), controllers (R, A, 2 n), keys (R,) -> speeds (R, A, T, 2); unless they are
    empty also poses (R, T + 1, B, 3) and sensors (R, T + 1, A). Trials of many bodies come one at a
    time, with `tiles`, others with `lanes`; the other is None and not compiled. Networks write to
    the controllers.
    """
    recorded = poses.shape[0] > 0
    slots = state.crowd.shape[0]
    for w in range(slots):
        start_trial(initial[block + w], controllers[block + w], w, world, state)
        open_view(world.sectors, block + w, w, state)
    # Slots are used again: nothing of the trials before may be left
    if networks is not None:
        networks.memory[:] = 0.0
    if imperfections is not None:
        imperfections.waiting[:] = 0.0
    for cycle in range(speeds.shape[2] + recorded):
        # Read, record, then act: a record of cycle T holds the places where all ends
        look(cycle, world, state, lanes, tiles)
        if imperfections is not None:
            for w in range(slots):
                mistake(keys[block + w], cycle, w, world, state, imperfections)
        if recorded:
            for w in range(slots):
                record(poses[block + w, cycle], sensors[block + w, cycle], w, world, state)
        if cycle < speeds.shape[2]:
            if networks is not None:
                drive(block, controllers, state, networks)
            # Speeds are measured from here to the end of the cycle
            for i in range(world.robots):
                for w in range(slots):
                    state.start_x[i, w] = state.x[i, w]
                    state.start_y[i, w] = state.y[i, w]
            for w in range(slots):
                command_wheels(
                    controllers[block + w], keys[block + w], cycle, w, world, state, imperfections
                )
            if imperfections is not None:
                delay_commands(cycle, world, state, imperfections)
            state.near[:] = 0
            for start in range(0, slots, LANES):
                stop = min(start + LANES, slots)
                advance_involved(start, stop, world, state, pairs, party, lanes, tiles)
            glide_free_robots(world, state)
            for w in range(slots):
                write_speeds(speeds[block + w], cycle, w, world, state)


_advance = compile_cached(
    _advance_trials, notice="the simulator for {} kind of trials (10 to 20 s)"
)


def record_trials(
    start: int, stop: int, *arrays: np.ndarray, world: World, networks: Networks | None = None,
    imperfections: Imperfections | None = None,
) -> None:  # fmt: skip
    """Fill speeds, poses (R, T + 1, B, 3) and sensor readings (R, T + 1, A) of trials start ... stop - 1.

    The other arrays are initial poses, controllers, to which networks write, and keys.
    """
    side_by_side = slots_of(world.bodies)
    state = new_state(min(side_by_side, stop - start), world.bodies)
    together = min(LANES, side_by_side)
    pairs, party = new_pairs(together, world.bodies), new_party(together * world.bodies)
    lanes = new_lanes() if world.bodies <= MANY_BODIES else None
    tiles = new_tiles(world.bodies, pairs.near.shape[1]) if world.bodies > MANY_BODIES else None
    if networks is not None:
        networks = networks._replace(
            memory=np.zeros((len(state.crowd), *networks.memory.shape[1:]))
        )
    if imperfections is not None:
        room = (*imperfections.waiting.shape[:-1], len(state.crowd))
        imperfections = imperfections._replace(waiting=np.zeros(room))
    for block in range(start, stop, side_by_side):
        if stop - block < len(state.crowd):
            state = new_state(stop - block, world.bodies)
        _advance(block, *arrays, world, state, pairs, party, lanes, tiles, networks, imperfections)


def observe_trials(
    start: int, stop: int, *arrays: np.ndarray, world: World, networks: Networks | None = None,
    imperfections: Imperfections | None = None,
) -> None:  # fmt: skip
    """Fill the speeds (R, A, T, 2) alone."""
    nothing = np.empty((0, 0, 0, 0)), np.empty((0, 0, 0), np.int8)
    record_trials(
        start, stop, *arrays, *nothing, world=world, networks=networks, imperfections=imperfections
    )
