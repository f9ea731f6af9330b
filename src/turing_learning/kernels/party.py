"""The bodies of one trial that may touch something in a control cycle, side by side in memory, in the order of the trial.

A cycle is advanced in copies and written back when it is complete, so that it can be begun anew.
"""

from typing import NamedTuple

import numpy as np

from .compile import inlined
from .world import State, World

SAFE = 1.0 - 1e-12
"""Share of its reach that a body may use: the rest is for the rounding of distances."""


class Party(NamedTuple):
    """Members of the party; arrays are (bodies,) and filled up to the number of members."""

    body: np.ndarray  # int64, in the trial
    place: np.ndarray  # int64, the member that each body of the trial is
    x: np.ndarray  # cm
    y: np.ndarray
    heading: np.ndarray  # rad
    vx: np.ndarray  # cm/s
    vy: np.ndarray
    turn: np.ndarray  # rad/s
    forward: np.ndarray  # commanded, cm/s
    command: np.ndarray  # commanded, rad/s
    radius: np.ndarray  # cm
    inverse_mass: np.ndarray  # 1/g
    inverse_inertia: np.ndarray  # 1/(g cm^2)
    start_x: np.ndarray  # at the start of the cycle, cm
    start_y: np.ndarray
    travel: np.ndarray  # square of the distance from the start that is allowed, cm^2
    work: np.ndarray  # (3, bodies) angles, sines and cosines


def new_party(bodies: int) -> Party:
    """Allocate a party of up to `bodies` members."""
    row = iter(np.zeros((14, bodies)))
    return Party(
        body=np.zeros(bodies, np.int64),
        place=np.zeros(bodies, np.int64),
        x=next(row),
        y=next(row),
        heading=next(row),
        vx=next(row),
        vy=next(row),
        turn=next(row),
        forward=next(row),
        command=next(row),
        radius=next(row),
        inverse_mass=next(row),
        inverse_inertia=next(row),
        start_x=next(row),
        start_y=next(row),
        travel=next(row),
        work=np.zeros((3, bodies)),
    )


@inlined
def gather_party(w: int, margin: float, world: World, state: State, party: Party) -> int:
    """Copy the marked bodies of the trial in slot `w`; their travel may be half of `margin` (cm) beyond their reach.

    Returns the number of members.
    """
    count = 0
    for i in range(world.bodies):
        if state.near[i, w] == 1:
            party.body[count], party.place[i] = i, count
            party.x[count], party.y[count], party.heading[count] = state.x[i, w], state.y[i, w], state.heading[i, w]
            party.vx[count], party.vy[count], party.turn[count] = state.vx[i, w], state.vy[i, w], state.turn[i, w]
            party.forward[count], party.command[count] = state.forward[i, w], state.command[i, w]
            party.radius[count] = world.radius[i]
            party.inverse_mass[count], party.inverse_inertia[count] = world.inverse_mass[i], world.inverse_inertia[i]
            party.start_x[count], party.start_y[count] = state.x[i, w], state.y[i, w]
            travel = (state.reach[i, w] - world.radius[i] + 0.5 * margin) * SAFE
            party.travel[count] = travel * travel
            count += 1
    return count


@inlined
def scatter_party(w: int, count: int, state: State, party: Party) -> None:
    """Write the motion of the members back to the trial in slot `w`."""
    for k in range(count):
        i = party.body[k]
        state.x[i, w], state.y[i, w], state.heading[i, w] = party.x[k], party.y[k], party.heading[k]
        state.vx[i, w], state.vy[i, w], state.turn[i, w] = party.vx[k], party.vy[k], party.turn[k]
