"""One control cycle of a swarm, as ten physics steps or, for robots that cannot touch anything, in closed form.

The cycle is first advanced for the bodies that may come into contact only, with the pairs that are near. This is exact as long as
no body moves farther in the cycle than its reach allows: a pair left out has a distance of at least the two reaches, each a
radius and a largest travel. Every movement is checked against this; where one exceeds it, the cycle is taken back and
repeated with all bodies and all pairs.
"""

import math

import numpy as np

from .compile import contracted, inlined
from .contacts import keep_inside, push_apart
from .geometry import LARGEST_ANGLE, sine_and_cosine, sines_and_cosines, wrapped
from .noise import noise_factor
from .world import State, World

SKIN = 0.5
"""Travel beyond its own motion that a body may be pushed in a cycle before the near pairs are given up (cm)."""


@inlined
def command_wheels(controllers: np.ndarray, key: np.uint64, cycle: int, w: int, world: World, state: State) -> None:
    """Set the robots' forward speeds and turn rates from the wheel speeds (robots, 2 n) of their readings, with noise."""
    for i in range(world.robots):
        counter = np.uint64(2 * (cycle * world.robots + i))
        reading = state.reading[i, w]
        left = controllers[i, 2 * reading] * world.maximum_speed
        right = controllers[i, 2 * reading + 1] * world.maximum_speed
        left *= noise_factor(key, counter, world.wheel_noise)
        right *= noise_factor(key, counter + np.uint64(1), world.wheel_noise)
        if world.clamp:
            left = min(max(left, -world.maximum_speed), world.maximum_speed)
            right = min(max(right, -world.maximum_speed), world.maximum_speed)
        state.forward[i, w] = 0.5 * (left + right)
        state.command[i, w] = (right - left) / world.wheel_distance


@inlined
def reach_of_robot(wheel_speeds: np.ndarray, world: World) -> float:
    """Return the radius and the farthest that a robot with these wheel speeds (2 n) travels in a cycle, with the skin (cm)."""
    fastest = 0.0
    for k in range(wheel_speeds.shape[0] // 2):
        fastest = max(fastest, abs(wheel_speeds[2 * k]) + abs(wheel_speeds[2 * k + 1]))
    speed = 0.5 * fastest * world.maximum_speed * (1.0 + world.wheel_noise)
    return world.radius[0] + speed * world.interval + SKIN


@inlined
def set_object_reach(w: int, world: World, state: State) -> None:
    """Set the reach of the objects, which only slow down unless something pushes them."""
    for j in range(world.robots, world.bodies):
        speed = math.sqrt(state.vx[j, w] ** 2 + state.vy[j, w] ** 2)
        state.reach[j, w] = world.radius[j] + speed * world.interval + SKIN


@inlined
def find_near_pairs(w: int, world: World, state: State) -> int:
    """List the pairs within reach of each other in the order of the physics and mark their bodies; return their number."""
    count = 0
    for i in range(world.bodies):
        for j in range(i + 1, world.bodies):
            dx = state.x[j, w] - state.x[i, w]
            dy = state.y[j, w] - state.y[i, w]
            limit = state.reach[i, w] + state.reach[j, w]
            if dx * dx + dy * dy < limit * limit:
                state.pairs[count, 0] = i
                state.pairs[count, 1] = j
                state.near[i, w] = 1
                state.near[j, w] = 1
                count += 1
    return count


@inlined
def list_all_pairs(w: int, world: World, state: State) -> int:
    """List every pair and mark every body: the plain physics."""
    count = 0
    for i in range(world.bodies):
        state.near[i, w] = 1
        for j in range(i + 1, world.bodies):
            state.pairs[count, 0] = i
            state.pairs[count, 1] = j
            count += 1
    return count


@inlined
def mark_moving_objects(w: int, world: World, state: State) -> None:
    """Mark the objects that move."""
    for i in range(world.robots, world.bodies):
        if state.vx[i, w] != 0.0 or state.vy[i, w] != 0.0 or state.turn[i, w] != 0.0:
            state.near[i, w] = 1


@inlined
def mark_near_walls(w: int, world: World, state: State) -> None:
    """Mark the bodies that may reach a wall."""
    for i in range(world.bodies):
        x, y, reach = state.x[i, w], state.y[i, w], state.reach[i, w]
        if x < reach or y < reach or x > world.width - reach or y > world.height - reach:
            state.near[i, w] = 1


@inlined
def list_involved(w: int, world: World, state: State) -> int:
    """List the marked bodies; return their number."""
    count = 0
    for i in range(world.bodies):
        if state.near[i, w] == 1:
            state.involved[count] = i
            count += 1
    return count


@inlined
def slowed(speed_x: float, speed_y: float, friction: float, dt: float) -> tuple[float, float]:
    """Return a gliding velocity after one step of dry and viscous friction."""
    speed = math.sqrt(speed_x * speed_x + speed_y * speed_y)
    if speed < friction * dt or speed == 0.0:
        return 0.0, 0.0
    ax = -friction * speed_x / speed - 0.01 * speed_x
    ay = -friction * speed_y / speed - 0.01 * speed_y
    return speed_x + ax * dt, speed_y + ay * dt


@inlined
def move_one_step(i: int, w: int, dt: float, world: World, state: State) -> None:
    """Update velocity, then position and heading, of one body by one physics step."""
    if i < world.robots:
        direction = state.heading[i, w] + state.turn[i, w] * dt * 0.5
        if abs(direction) <= LARGEST_ANGLE:
            sine, cosine = sine_and_cosine(direction)
        else:
            sine, cosine = math.sin(direction), math.cos(direction)
        state.vx[i, w] = state.forward[i, w] * cosine
        state.vy[i, w] = state.forward[i, w] * sine
        state.turn[i, w] = state.command[i, w]
    else:
        state.vx[i, w], state.vy[i, w] = slowed(state.vx[i, w], state.vy[i, w], world.deceleration, dt)
        state.turn[i, w], _ = slowed(state.turn[i, w], 0.0, world.deceleration, dt)
    state.x[i, w] += state.vx[i, w] * dt
    state.y[i, w] += state.vy[i, w] * dt
    state.heading[i, w] = state.heading[i, w] + state.turn[i, w] * dt


@inlined
def within_reach(i: int, w: int, world: World, state: State) -> bool:
    """Return whether a body has stayed within its reach since the start of the cycle."""
    dx = state.x[i, w] - state.saved[0, i]
    dy = state.y[i, w] - state.saved[1, i]
    travel = state.reach[i, w] - world.radius[i]
    return dx * dx + dy * dy <= travel * travel


@inlined
def step_involved(w: int, involved: int, pairs: int, checked: bool, world: World, state: State) -> bool:
    """Advance the involved bodies by one physics step; return False as soon as one leaves its reach, if checked."""
    dt = world.interval / world.substeps
    for k in range(involved):
        i = state.involved[k]
        move_one_step(i, w, dt, world, state)
        if checked and not within_reach(i, w, world, state):
            return False
    for k in range(pairs):
        i, j = state.pairs[k, 0], state.pairs[k, 1]
        if push_apart(i, j, w, world, state) and checked:  # noqa: SIM102
            if not (within_reach(i, w, world, state) and within_reach(j, w, world, state)):
                return False
    for k in range(involved):
        i = state.involved[k]
        if world.width > 0.0:
            keep_inside(i, w, world, state)
            if checked and not within_reach(i, w, world, state):
                return False
        state.heading[i, w] = wrapped(state.heading[i, w])
    return True


@inlined
def save(w: int, involved: int, state: State) -> None:
    """Keep the involved bodies' motion at the start of the cycle."""
    for k in range(involved):
        i = state.involved[k]
        state.saved[0, i], state.saved[1, i], state.saved[2, i] = state.x[i, w], state.y[i, w], state.heading[i, w]
        state.saved[3, i], state.saved[4, i], state.saved[5, i] = state.vx[i, w], state.vy[i, w], state.turn[i, w]


@inlined
def take_back(w: int, involved: int, state: State) -> None:
    """Return the involved bodies to the start of the cycle."""
    for k in range(involved):
        i = state.involved[k]
        state.x[i, w], state.y[i, w], state.heading[i, w] = state.saved[0, i], state.saved[1, i], state.saved[2, i]
        state.vx[i, w], state.vy[i, w], state.turn[i, w] = state.saved[3, i], state.saved[4, i], state.saved[5, i]


@inlined
def step_cycle(w: int, involved: int, pairs: int, checked: bool, world: World, state: State) -> bool:
    """Advance the involved bodies by one control cycle; if one leaves its reach, take the cycle back and return False."""
    save(w, involved, state)
    for _ in range(world.substeps):
        if not step_involved(w, involved, pairs, checked, world, state):
            take_back(w, involved, state)
            return False
    return True


@inlined
def clear_marks(state: State) -> None:
    """Mark no body."""
    for i in range(state.near.shape[0]):
        for w in range(state.near.shape[1]):
            state.near[i, w] = 0


@inlined
def may_touch(w: int, world: World, state: State) -> bool:
    """Return whether anything but free motion is possible in a trial."""
    return state.crowd[w] > 0.0 or world.bodies > world.robots or world.width > 0.0


@inlined
def advance_involved(w: int, world: World, state: State) -> None:
    """Advance by one control cycle the bodies of a trial that may touch something or move by themselves.

    All other robots are left for `glide_free_robots`.
    """
    pairs = 0
    if state.crowd[w] > 0.0 or world.bodies > world.robots:
        pairs = find_near_pairs(w, world, state)
        mark_moving_objects(w, world, state)
    if world.width > 0.0:
        mark_near_walls(w, world, state)
    involved = list_involved(w, world, state)
    if involved > 0 and not step_cycle(w, involved, pairs, True, world, state):
        pairs = list_all_pairs(w, world, state)
        step_cycle(w, list_involved(w, world, state), pairs, False, world, state)


@inlined
def closed_form_angles(dt: float, steps: int, state: State, angles: np.ndarray) -> None:
    """Fill the three angles (3, bodies, slots) that the closed form needs; see `glide_free_robots`."""
    for i in range(angles.shape[1]):
        heading, turn, command = state.heading[i], state.turn[i], state.command[i]
        first, half, middle = angles[0, i], angles[1, i], angles[2, i]
        for w in range(angles.shape[2]):
            first[w] = heading[w] + 0.5 * turn[w] * dt
            half[w] = 0.5 * command[w] * dt
            middle[w] = heading[w] + (steps + 1) * (0.5 * command[w] * dt)


@contracted
def chebyshev(degree: int, cosine: float) -> float:
    """Return the Chebyshev polynomial of the second kind, U_n(cos a) = sin((n + 1) a) / sin(a); 0 for n = -1."""
    before, value = 0.0, 1.0 if degree >= 0 else 0.0
    for _ in range(degree):
        before, value = value, 2.0 * cosine * value - before
    return value


@inlined
def glide(i: int, dt: float, steps: int, sines: np.ndarray, cosines: np.ndarray, state: State) -> None:
    """Advance robot `i` in the slots where it touches nothing; sines and cosines (3, slots) of its three angles."""
    x, y, heading, turn = state.x[i], state.y[i], state.heading[i], state.turn[i]
    forward, command, near = state.forward[i], state.command[i], state.near[i]
    for w in range(near.shape[0]):
        cosines[1, w] = chebyshev(steps - 2, cosines[1, w])
    for w in range(near.shape[0]):
        free = near[w] == 0
        scale = forward[w] * dt if free else 0.0
        x[w] += scale * (cosines[0, w] + cosines[1, w] * cosines[2, w])
        y[w] += scale * (sines[0, w] + cosines[1, w] * sines[2, w])
        turn[w] = command[w] if free else turn[w]
        heading[w] = wrapped(heading[w] + steps * command[w] * dt) if free else heading[w]


@inlined
def glide_free_robots(world: World, state: State) -> None:
    """Advance by one control cycle, in closed form, the robots of all slots that touch nothing (near = 0).

    The first physics step goes along heading + (turn rate before) dt / 2; step k = 1 ... S - 1 along h + (k + 1/2) d, with
    d = (commanded turn rate) dt, and the sum of the S - 1 unit vectors is U_{S-2}(cos(d / 2)) times the one along
    h + (S + 1) d / 2.
    """
    dt = world.interval / world.substeps
    angles, sines, cosines = state.work[:3], state.work[3:6], state.work[6:9]
    closed_form_angles(dt, world.substeps, state, angles)
    sines_and_cosines(angles.reshape(-1), sines.reshape(-1), cosines.reshape(-1))
    for i in range(world.robots):
        glide(i, dt, world.substeps, sines[:, i], cosines[:, i], state)
