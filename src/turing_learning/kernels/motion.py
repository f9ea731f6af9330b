"""How robots that touch nothing move: angles, noise of the wheels, networks that drive some, commands and reaches, a closed form.

The noise of the wheels is counter-based: every draw is a function of (key, counter), so threads
cannot change it.

In each control cycle the network that drives a robot writes its outputs where a reactive robot has
the wheel speeds of the present reading. All that follows, from the noise of the wheels to the
contacts, is the same for both kinds.
"""

import math

import numpy as np

from .compile import contracted, inlined
from .world import Imperfections, Networks, State, World

TWO_PI = 2 * math.pi
_BELOW_PI = math.nextafter(math.pi, 0)

# pi / 2 in three parts of 33 bits, so that multiples up to 2**20 are exact (Cody and Waite 1980).
_QUARTERS = 2 / math.pi
_QUARTER_HIGH = float.fromhex("0x1.921fb544p+0")
_QUARTER_MIDDLE = float.fromhex("0x1.0b4611a6p-34")
_QUARTER_LOW = float.fromhex("0x1.3198a2e037073p-69")
LARGEST_ANGLE = 1.0e6
"""Angles up to this (rad) are reduced exactly; larger ones take the C library's functions."""


@contracted
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sin and cos of |angle| <= LARGEST_ANGLE to about one unit in the last place, without a branch.

    Taylor polynomials on [-pi/4, pi/4]: the first term left out is below 1e-16 of the result.
    """
    quadrant = np.floor(angle * _QUARTERS + 0.5)
    r = ((angle - quadrant * _QUARTER_HIGH) - quadrant * _QUARTER_MIDDLE) - quadrant * _QUARTER_LOW
    r2 = r * r
    p = -1 / 1307674368000.0
    p = p * r2 + 1 / 6227020800.0
    p = p * r2 - 1 / 39916800.0
    p = p * r2 + 1 / 362880.0
    p = p * r2 - 1 / 5040.0
    p = p * r2 + 1 / 120.0
    p = p * r2 - 1 / 6.0
    sine = r + r * r2 * p
    q = 1 / 20922789888000.0
    q = q * r2 - 1 / 87178291200.0
    q = q * r2 + 1 / 479001600.0
    q = q * r2 - 1 / 3628800.0
    q = q * r2 + 1 / 40320.0
    q = q * r2 - 1 / 720.0
    q = q * r2 + 1 / 24.0
    cosine = 1.0 - (0.5 * r2 - r2 * r2 * q)
    odd = quadrant - 2.0 * np.floor(quadrant * 0.5)
    half = quadrant - 4.0 * np.floor(quadrant * 0.25)
    swapped_sine = cosine if odd == 1.0 else sine
    swapped_cosine = sine if odd == 1.0 else cosine
    return (
        -swapped_sine if half >= 2.0 else swapped_sine,
        -swapped_cosine if half == 1.0 or half == 2.0 else swapped_cosine,
    )


@inlined
def sines_and_cosines(angles: np.ndarray, sines: np.ndarray, cosines: np.ndarray) -> None:
    """Fill `sines` and `cosines` of angles of any size."""
    for i in range(angles.shape[0]):
        sines[i], cosines[i] = sine_and_cosine(angles[i])
    large = 0
    for i in range(angles.shape[0]):
        large += abs(angles[i]) > LARGEST_ANGLE
    if large > 0:
        replace_large(angles, sines, cosines)


@inlined
def replace_large(angles: np.ndarray, sines: np.ndarray, cosines: np.ndarray) -> None:
    """Take the C library's functions where an angle is too large for the fast ones."""
    for i in range(angles.shape[0]):
        if abs(angles[i]) > LARGEST_ANGLE:
            sines[i] = math.sin(angles[i])
            cosines[i] = math.cos(angles[i])


@inlined
def wrapped(angle: float) -> float:
    """Return the angle in [-pi, pi)."""
    turns = np.floor((angle + math.pi) * (1 / TWO_PI))
    return min(max(angle - TWO_PI * turns, -math.pi), _BELOW_PI)


_INCREMENT = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_STEP = 2.0**-53


@inlined
def uniform(key: np.uint64, counter: np.uint64) -> float:
    """Return the draw number `counter` of the stream `key`, uniform in (0, 1).

    Source: SplitMix64, Steele, Lea and Flood, Fast splittable pseudorandom number generators
    (2014).
    """
    z = key + (counter + np.uint64(1)) * _INCREMENT
    z = (z ^ (z >> _S30)) * _FIRST
    z = (z ^ (z >> _S27)) * _SECOND
    z = z ^ (z >> _S31)
    return (np.float64(z >> _S11) + 0.5) * _STEP


@inlined
def noise_factor(key: np.uint64, counter: np.uint64, noise: float) -> float:
    """Return a factor uniform in (1 - noise, 1 + noise)."""
    return 1.0 + noise * (2.0 * uniform(key, counter) - 1.0)


@inlined
def logistic(z: float) -> float:
    """Return the logistic sigmoid."""
    return 1.0 / (1.0 + math.exp(-z))


@inlined
def respond(reading: float, weights: np.ndarray, memory: np.ndarray, outputs: np.ndarray) -> None:
    """Advance a network by a time step: memory (2 H) and, from -1 to 1, the outputs (2,)."""
    hidden = memory.shape[0] // 2
    recurrent, biases = hidden, hidden + hidden * hidden
    output = biases + hidden
    for j in range(hidden):
        z = weights[biases + j] + weights[j] * reading
        for k in range(hidden):
            z += weights[recurrent + j * hidden + k] * memory[k]
        memory[hidden + j] = logistic(z)
    for j in range(hidden):
        memory[j] = memory[hidden + j]
    for side in range(2):
        z = weights[output + 2 * hidden + side]
        for j in range(hidden):
            z += weights[output + side * hidden + j] * memory[j]
        outputs[side] = 2.0 * logistic(z) - 1.0


@inlined
def drive(block: int, controllers: np.ndarray, state: State, networks: Networks) -> None:
    """Let the networks write the wheel speeds of the present readings into the controllers of the robots that they drive."""
    for w in range(state.crowd.shape[0]):
        for i in range(networks.driver.shape[1]):
            network = networks.driver[block + w, i]
            if network >= 0:
                reading = state.reading[i, w]
                outputs = controllers[block + w, i, 2 * reading : 2 * reading + 2]
                respond(float(reading), networks.weights[network], networks.memory[w, i], outputs)


SKIN = 0.5
"""Travel beyond its own motion that a body may be pushed in a cycle before the near pairs are given up (cm)."""


# Each imperfection draws from a stream of its own, so that one changes no number of another.
# Random 64-bit constants.
_SCALES = np.uint64(0x6A09E667F3BCC909)
_SLIPS = np.uint64(0xBB67AE8584CAA73B)
_MISTAKES = np.uint64(0x3C6EF372FE94F82B)


@inlined
def command_wheels(
    controllers: np.ndarray, key: np.uint64, cycle: int, w: int, world: World, state: State,
    imperfections: Imperfections | None,
) -> None:  # fmt: skip
    """Set the robots' forward speeds and turn rates from the wheel speeds (robots, 2 n) of their readings, with noise."""
    for i in range(world.robots):
        counter = np.uint64(2 * (cycle * world.robots + i))
        reading = state.reading[i, w]
        left = controllers[i, 2 * reading] * world.maximum_speed
        right = controllers[i, 2 * reading + 1] * world.maximum_speed
        left *= noise_factor(key, counter, world.wheel_noise)
        right *= noise_factor(key, counter + np.uint64(1), world.wheel_noise)
        if imperfections is not None:
            left *= noise_factor(key ^ _SCALES, np.uint64(2 * i), world.wheel_scale_spread)
            right *= noise_factor(key ^ _SCALES, np.uint64(2 * i + 1), world.wheel_scale_spread)
        if world.clamp:
            left = min(max(left, -world.maximum_speed), world.maximum_speed)
            right = min(max(right, -world.maximum_speed), world.maximum_speed)
        if imperfections is not None:
            left *= 1.0 - imperfections.slip * uniform(key ^ _SLIPS, counter)
            right *= 1.0 - imperfections.slip * uniform(key ^ _SLIPS, counter + np.uint64(1))
        state.forward[i, w] = 0.5 * (left + right)
        state.command[i, w] = (right - left) / world.wheel_distance


@inlined
def mistake(
    key: np.uint64, cycle: int, w: int, world: World, state: State, imperfections: Imperfections
) -> None:
    """Replace the readings of robots whose sensor is mistaken in this cycle, each by any other state."""
    if imperfections.mistakes > 0.0:
        for i in range(world.robots):
            counter = np.uint64(cycle * world.robots + i)
            draw = uniform(key ^ _MISTAKES, counter) / imperfections.mistakes
            if draw < 1.0:
                shift = 1 + int(draw * (imperfections.states - 1))
                state.reading[i, w] = (state.reading[i, w] + shift) % imperfections.states


@inlined
def delay_commands(cycle: int, world: World, state: State, imperfections: Imperfections) -> None:
    """Let the present commands wait, and those act that were given as many cycles ago as the lag.

    Before, robots rest.
    """
    lag = imperfections.waiting.shape[0]
    if lag > 0:
        due = imperfections.waiting[cycle % lag]
        for i in range(world.robots):
            for w in range(state.crowd.shape[0]):
                due[0, i, w], state.forward[i, w] = state.forward[i, w], due[0, i, w]
                due[1, i, w], state.command[i, w] = state.command[i, w], due[1, i, w]


@inlined
def reach_of_robot(wheel_speeds: np.ndarray, world: World) -> float:
    """Return the radius and the farthest that a robot with these wheel speeds (2 n) travels in a cycle, with the skin (cm)."""
    fastest = 0.0
    for k in range(wheel_speeds.shape[0] // 2):
        fastest = max(fastest, abs(wheel_speeds[2 * k]) + abs(wheel_speeds[2 * k + 1]))
    speed = (
        0.5
        * fastest
        * world.maximum_speed
        * (1.0 + world.wheel_noise)
        * (1.0 + world.wheel_scale_spread)
    )
    return world.radius[0] + speed * world.interval + SKIN


@inlined
def set_object_reach(w: int, world: World, state: State) -> None:
    """Set the reach of the objects, which only slow down unless something pushes them."""
    for j in range(world.robots, world.bodies):
        speed = math.sqrt(state.vx[j, w] ** 2 + state.vy[j, w] ** 2)
        state.reach[j, w] = world.radius[j] + speed * world.interval + SKIN


@inlined
def closed_form_angles(dt: float, steps: int, state: State, angles: np.ndarray) -> None:
    """Fill the three angles (3, bodies, slots) that the closed form needs.

    See `glide_free_robots`.
    """
    for i in range(angles.shape[1]):
        heading, turn, command = state.heading[i], state.turn[i], state.command[i]
        first, half, middle = angles[0, i], angles[1, i], angles[2, i]
        for w in range(angles.shape[2]):
            first[w] = heading[w] + 0.5 * turn[w] * dt
            half[w] = 0.5 * command[w] * dt
            middle[w] = heading[w] + (steps + 1) * (0.5 * command[w] * dt)


@contracted
def chebyshev(degree: int, cosine: float) -> float:
    """Return the Chebyshev polynomial of the second kind, U_n(cos a) = sin((n + 1) a) / sin(a).

    0 for n = -1.
    """
    before = 0.0
    value = 1.0 if degree >= 0 else 0.0
    for _ in range(degree):
        before, value = value, 2.0 * cosine * value - before
    return value


@inlined
def glide(
    i: int, dt: float, steps: int, sines: np.ndarray, cosines: np.ndarray, state: State
) -> None:
    """Advance robot `i` in the slots where it touches nothing.

    Sines and cosines (3, slots) of its three angles.
    """
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

    The first physics step goes along heading + (turn rate before) dt / 2; step k = 1 ... S - 1
    along h + (k + 1/2) d, with d = (commanded turn rate) dt, and the sum of the S - 1 unit vectors
    is U_{S-2}(cos(d / 2)) times the one along h + (S + 1) d / 2.
    """
    dt = world.interval / world.substeps
    angles, sines, cosines = state.work[:3], state.work[3:6], state.work[6:9]
    closed_form_angles(dt, world.substeps, state, angles)
    sines_and_cosines(angles.reshape(-1), sines.reshape(-1), cosines.reshape(-1))
    for i in range(world.robots):
        glide(i, dt, world.substeps, sines[:, i], cosines[:, i], state)
