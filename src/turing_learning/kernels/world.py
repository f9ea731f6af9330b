"""What is constant during a trial (`World`) and what changes (`State`).

A thread advances several trials side by side: ``state.x[i, w]`` belongs to body i of the trial in slot w, robots first, and
loops over the slots are the inner ones, because they vectorize.
"""

from typing import NamedTuple

import numpy as np


class World(NamedTuple):
    """Constants of a trial; arrays have one entry for each body."""

    robots: int
    bodies: int
    radius: np.ndarray  # cm
    inverse_mass: np.ndarray  # 1/g
    inverse_inertia: np.ndarray  # 1/(g cm^2)
    sight_radius: np.ndarray  # cm; negative: the ray passes through
    reading: np.ndarray  # int64, sensor state that the body gives
    sectors: np.ndarray | None  # (2, trials, robots) cosine and sine of half the field of view; None: lines of sight
    deceleration: float  # of objects by dry friction, cm/s^2
    wheel_distance: float  # cm
    maximum_speed: float  # cm/s
    wheel_noise: float
    clamp: bool
    interval: float  # of control, s
    substeps: int  # physics steps in a control interval
    width: float  # of the arena, cm; 0: unbounded
    height: float


class State(NamedTuple):
    """Bodies in motion and room to work in, one for each thread; arrays are (bodies, slots) unless said otherwise."""

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
    seen: np.ndarray  # float, number of items in the line of sight; in a sector, distance of the nearest (cm)
    view_cosine: np.ndarray  # of half the field of view; written only where there is one
    view_sine: np.ndarray
    crowd: np.ndarray  # (slots,) float, number of (robot, body) pairs within reach of each other
    reading: np.ndarray  # int64, sensor state
    near: np.ndarray  # int64: 1 where a contact is possible in this cycle, or the body moves by itself
    work: np.ndarray  # (9, bodies, slots) angles, sines and cosines


def new_state(slots: int, bodies: int) -> State:
    """Allocate the state of `slots` trials of `bodies` bodies."""
    floats, marks = np.zeros((16, bodies, slots)), np.zeros((2, bodies, slots), np.int64)
    return State._make((*floats, np.zeros(slots), *marks, np.zeros((9, bodies, slots))))
