"""What is constant during a trial (`World`), what changes (`State`), and the bodies that may touch something (`Party`).

A thread advances several trials side by side: ``state.x[i, w]`` belongs to body i of the trial in
slot w, robots first, and loops over the slots are the inner ones, because they vectorize.

A party has the bodies of one trial or several that may touch something in a control cycle, side by
side in memory: robots first, then objects, of each trial in its order. A cycle is advanced in
copies and written back when it is complete, so that it can be begun anew.
"""

from typing import NamedTuple

import numpy as np

from .compile import inlined


class World(NamedTuple):
    """Constants of a trial; arrays have one entry for each body."""

    robots: int
    bodies: int
    # cm; NaN: nothing touches it, as every comparison with it is false
    radius: np.ndarray
    inverse_mass: np.ndarray  # 1/g; 0: it stays where it is
    inverse_inertia: np.ndarray  # 1/(g cm^2)
    sight_radius: np.ndarray  # cm; negative: the ray passes through
    reading: np.ndarray  # int64, sensor state that the body gives
    # (2, trials, robots) cosine and sine of half the field of view; None: lines of sight
    sectors: np.ndarray | None
    deceleration: np.ndarray  # by dry friction on the ground, cm/s^2; 0 for robots
    wheel_distance: float  # cm
    maximum_speed: float  # cm/s
    wheel_noise: float
    wheel_scale_spread: float
    clamp: bool
    interval: float  # of control, s
    substeps: int  # physics steps in a control interval
    width: float  # of the arena, cm; 0: unbounded
    height: float


class State(NamedTuple):
    """Bodies in motion and room to work in, one for each thread.

    Arrays are (bodies, slots) unless said otherwise.
    """

    x: np.ndarray  # cm
    y: np.ndarray
    heading: np.ndarray  # rad, in [-pi, pi)
    vx: np.ndarray  # cm/s
    vy: np.ndarray
    turn: np.ndarray  # rad/s
    forward: np.ndarray  # commanded forward speed, cm/s; 0 for objects
    command: np.ndarray  # commanded turn rate, rad/s; 0 for objects
    sine: np.ndarray  # of the heading
    cosine: np.ndarray
    reach: np.ndarray  # radius and the farthest a body is expected to move in a control cycle, cm
    start_x: np.ndarray  # at the start of the cycle, cm
    start_y: np.ndarray
    # float, number of items in the line of sight; in a sector, distance of the nearest (cm)
    seen: np.ndarray
    view_cosine: np.ndarray  # of half the field of view; written only where there is one
    view_sine: np.ndarray
    crowd: np.ndarray  # (slots,) float, number of (robot, body) pairs within reach of each other
    reading: np.ndarray  # int64, sensor state
    # int64: 1 where a contact is possible in this cycle, or the body moves by itself
    near: np.ndarray
    work: np.ndarray  # (9, bodies, slots) angles, sines and cosines


def new_state(slots: int, bodies: int) -> State:
    """Allocate the state of `slots` trials of `bodies` bodies."""
    floats, marks = np.zeros((16, bodies, slots)), np.zeros((2, bodies, slots), np.int64)
    return State._make((*floats, np.zeros(slots), *marks, np.zeros((9, bodies, slots))))


class Networks(NamedTuple):
    """K networks of H hidden neurons, the robots that they drive, and what those remember."""

    weights: np.ndarray  # (K, Q), laid out as in `models.ElmanModel`
    driver: np.ndarray  # (R, A) int64, the network that drives each robot; -1 for a reactive one
    # (slots, A, 2 H) activations of the hidden neurons, and room for the next ones
    memory: np.ndarray


def new_networks(weights: np.ndarray, driver: np.ndarray, hidden: int) -> Networks:
    """Return networks without memory, which each thread has for itself."""
    return Networks(weights, driver, np.zeros((0, driver.shape[1], 2 * hidden)))


class Imperfections(NamedTuple):
    """What a robot does otherwise than its controller says, beside the noise and scales of its wheels, and commands that wait."""

    slip: float
    mistakes: float
    states: int  # of the sensor
    # (lag, 2, robots, slots) forward speeds (cm/s) and turn rates (rad/s) that act later
    waiting: np.ndarray


def new_imperfections(
    slip: float, mistakes: float, states: int, lag: int, robots: int
) -> Imperfections:
    """Return imperfections without commands that wait, which each thread has for itself."""
    return Imperfections(float(slip), float(mistakes), states, np.zeros((lag, 2, robots, 0)))


SAFE = 1.0 - 1e-12
"""Share of its reach that a body may use: the rest is for the rounding of distances."""

ALL_PAIRS = -1
"""Number of listed pairs that stands for every pair."""
PAIRS_PER_BODY = 64
"""Near pairs for which there is room.

Where there are more, all pairs are looked at, without a list.
"""


class Pairs(NamedTuple):
    """Near pairs of the trials of a party."""

    # (trials, room, 2) int64, bodies in the order of the physics, then their places in the party
    near: np.ndarray
    # (trials,) int64, how many of them there are; ALL_PAIRS if every pair counts
    number: np.ndarray


def new_pairs(trials: int, bodies: int) -> Pairs:
    """Allocate room for the near pairs of trials.

    It grows with the number of bodies, not with its square.
    """
    room = max(min(bodies * (bodies - 1) // 2, PAIRS_PER_BODY * bodies), 1)
    near = np.zeros((trials, room, 2), np.int64)
    return Pairs(near=near, number=np.zeros(trials, np.int64))


LANES = 16
"""Contacts that are resolved side by side, each of another trial."""


class Lanes(NamedTuple):
    """Room for the contacts that are resolved side by side.

    One trial of many bodies has none, but `Tiles`.
    """

    hit: np.ndarray  # (LANES + 1, 2) int64, members that overlap; the last row is never read
    number: np.ndarray  # (16 * LANES,) their motion and disks


def new_lanes() -> Lanes:
    """Allocate lanes."""
    return Lanes(hit=np.zeros((LANES + 1, 2), np.int64), number=np.ones(16 * LANES))


class Party(NamedTuple):
    """Members of the party.

    Arrays are (trials * bodies,) and filled up to the number of members.
    """

    body: np.ndarray  # int64, g * bodies + i is body i of the party's trial g
    place: np.ndarray  # int64, the member that each of these bodies is
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
    deceleration: np.ndarray  # by dry friction on the ground, cm/s^2
    start_x: np.ndarray  # at the start of the cycle, cm
    start_y: np.ndarray
    travel: np.ndarray  # square of the distance from the start that is allowed, cm^2
    work: np.ndarray  # (3, trials * bodies) angles, sines and cosines


def new_party(bodies: int) -> Party:
    """Allocate a party of up to `bodies` members, of all its trials."""
    body, member = np.zeros(bodies, np.int64), np.zeros(bodies, np.int64)
    return Party._make((body, member, *np.zeros((15, bodies)), np.zeros((3, bodies))))


@inlined
def gather_party(
    start: int, stop: int, margin: float, world: World, state: State, pairs: Pairs, party: Party
) -> tuple[int, int]:
    """Copy the marked bodies of the trials in slots start ... stop - 1, and replace the bodies of their pairs by members.

    Members may travel half of `margin` (cm) beyond their reach. Returns the number of robots and of
    members.
    """
    none = np.int64(0)  # a literal would be compiled as a kind of its own
    robots = gather_bodies(start, stop, none, world.robots, none, margin, world, state, party)
    members = gather_bodies(
        start, stop, world.robots, world.bodies, robots, margin, world, state, party
    )
    for g in range(stop - start):
        for n in range(pairs.number[g]):
            for side in range(2):
                body = g * world.bodies + pairs.near[g, n, side]
                pairs.near[g, n, side] = party.place[body]
    return robots, members


@inlined
def gather_bodies(
    start: int, stop: int, low: int, high: int, members: int, margin: float, world: World, state: State,
    party: Party,
) -> int:  # fmt: skip
    """Append the marked ones of bodies low ... high - 1 to the party; return the new number of members."""
    k = members
    for w in range(start, stop):
        for i in range(low, high):
            if state.near[i, w] == 1:
                party.body[k] = (w - start) * world.bodies + i
                party.place[party.body[k]] = k
                party.x[k] = state.x[i, w]
                party.y[k] = state.y[i, w]
                party.heading[k] = state.heading[i, w]
                party.vx[k] = state.vx[i, w]
                party.vy[k] = state.vy[i, w]
                party.turn[k] = state.turn[i, w]
                party.forward[k] = state.forward[i, w]
                party.command[k] = state.command[i, w]
                party.radius[k] = world.radius[i]
                party.inverse_mass[k] = world.inverse_mass[i]
                party.inverse_inertia[k] = world.inverse_inertia[i]
                party.deceleration[k] = world.deceleration[i]
                party.start_x[k] = state.x[i, w]
                party.start_y[k] = state.y[i, w]
                travel = (state.reach[i, w] - world.radius[i] + 0.5 * margin) * SAFE
                party.travel[k] = travel * travel
                k += 1
    return k


@inlined
def scatter_party(start: int, members: int, world: World, state: State, party: Party) -> None:
    """Write the motion of the members back to the trials in the slots from `start` on."""
    for k in range(members):
        i = party.body[k] % world.bodies
        w = start + party.body[k] // world.bodies
        state.x[i, w] = party.x[k]
        state.y[i, w] = party.y[k]
        state.heading[i, w] = party.heading[k]
        state.vx[i, w] = party.vx[k]
        state.vy[i, w] = party.vy[k]
        state.turn[i, w] = party.turn[k]
