"""Individuals that a learned network moves: what they perceive, what it answers, and where they go.

Perception does not depend on the number or the order of the others. All that is seen is turned into the frame of the
individual, whose axis is its course: the direction of its last displacement, or where individuals come and go, that of
its goal.
"""

import math
from typing import NamedTuple

import numpy as np

from .compile import compile_cached, inlined
from .motion import uniform

LAG_EDGES = np.array((0, 1, 2, 3, 4, 5, 6, 8, 10, 13, 17, 22, 28, 36))
"""Steps back between which displacements are seen: the last ones one by one, earlier ones together."""
LAGS = len(LAG_EDGES) - 1
HISTORY = int(LAG_EDGES[-1])
"""Steps back that are seen, where an individual was there."""
PAST = 4
"""Steps that an individual has to have moved before a network can move it."""
MEMORY_S = np.array((1.0, 5.0, np.inf))
"""Time constants (s) of the leaky averages of the speed and of its square; the last one is over all that was recorded."""
MEMORIES = 2 * len(MEMORY_S)
RAYS = 8
"""Directions around an individual in which it sees the distance of the wall."""
DIRECTIONS = 64
"""Directions, fixed in space, for which distances of the walls are tabulated."""
MOST_OTHERS = 8
"""Others that are seen, the nearest ones."""
TRAITS = 8
"""Numbers that describe another individual: direction 2, nearness 2, distance, velocity 2, whether it has one."""
OWN = 2 * LAGS + MEMORIES + 2 * RAYS + 1
"""Numbers that an individual perceives without the others: displacements, memory, walls, whether there are walls."""

# What a network is asked with, from nothing but the own motion to everything
OWN_MOTION, WITH_WALLS, WITH_PLACES, WITH_ALL = range(4)
VIEWS = 4

TRIES = 4
"""Choices of a step where all recorded ones lead out of the tank: they become shorter."""
NEAREST_CONTEXTS = 16
"""Recorded contexts, the nearest, among which one is chosen."""
PROBES = 4
"""Cells, the nearest, in which they are sought."""
FOLLOWED = 2.0
"""A recorded piece is followed as long as its context is as near as this many times the `reach` (squared)."""
FOLLOWED_BRISK = 8.0
"""The same of a piece of somebody who goes somewhere and is not held up."""
AHEAD = 3
"""Moments in the future for which it is known where a recorded step led."""
FOLLOWED_AHEAD = 2
"""Of them, those at which a piece that is followed already must not lead out of the tank."""
BEND = math.pi / 36
"""Angle (rad) by which a piece of somebody who stays is turned to either side, if it would lead out of the tank."""
BENDS = 12
"""Largest number of such turns to one side."""
FOLLOWED_DISTANCE = 0.9
"""A piece that is followed is given up where it leads nearer to another than this many times the distance to which
individuals hardly ever come; one that is chosen does not lead nearer than that distance."""


class Units(NamedTuple):
    """What perception is measured in."""

    step: float  # median displacement in a step (cm)
    wall: float  # distance (cm) at which a wall is near
    other: float  # median distance (cm) of the nearest other
    memory_rates: np.ndarray  # (3,): share by which each leaky average moves in a step
    fastest: float  # displacement (cm) beyond which a step counts as so long in the memory
    closest: float  # distance (cm) to which others hardly ever come


class Tanks(NamedTuple):
    """Where individuals may be: tanks on grids of square cells."""

    walls: np.ndarray  # (N,) bool: whether the tank has walls
    corner: np.ndarray  # (N, 2): x, y of the grid's lower corner (cm)
    cell: np.ndarray  # (N,): side of a cell (cm)
    inside: np.ndarray  # (N, X, Y) bool
    distance: (
        np.ndarray
    )  # (N, X, Y, DIRECTIONS) float32: from the center of a cell to the wall (cm)
    exits: np.ndarray  # (N, X, Y) bool: near where individuals left


class Layers(NamedTuple):
    """Weights of the network, float32, each matrix as (inputs, outputs)."""

    other_first: np.ndarray
    other_first_bias: np.ndarray
    other_second: np.ndarray
    other_second_bias: np.ndarray
    attention: np.ndarray
    attention_bias: np.ndarray
    trunk_first: np.ndarray
    trunk_first_bias: np.ndarray
    trunk_second: np.ndarray
    trunk_second_bias: np.ndarray
    metric: np.ndarray  # (hidden, D): from the hidden state to a place among contexts


class Pieces(NamedTuple):
    """Recorded steps that can be done again, each also in a mirror: R of them, sorted by cell.

    A context is a place in D dimensions: those are near each other after which the same is likely to happen.
    """

    context: np.ndarray  # (D, R) float32: where each was done
    centers: (
        np.ndarray
    )  # (D, C) float32: of cells, into which contexts are sorted to find near ones
    begin: np.ndarray  # (C + 1,): first step of each cell, and R
    reach: np.ndarray  # (R,) float32: squared distance of the farthest of the nearest contexts
    brisk: np.ndarray  # (R,) bool: whether somebody who goes somewhere was not held up before it
    then: np.ndarray  # (R,): which step was done next, -1 if none was recorded
    last: np.ndarray  # (R,) bool: whether the individual was gone after it
    length: np.ndarray  # (R,): of the step (cm)
    turn: np.ndarray  # (R,): from the last displacement to it (rad)
    ahead: (
        np.ndarray
    )  # (R, AHEAD, 2) float32: where it led (cm), forward and left; NaN where that was not recorded


@inlined
def compressed(value: float) -> float:
    """Return a number with its sign, large ones by their logarithm."""
    return math.copysign(math.log1p(abs(value)), value)


@inlined
def course(path: np.ndarray, frame: int, i: int, goal: np.ndarray) -> float:
    """Return the direction (rad) to the goal (2,), or where that is NaN, of the last displacement."""
    if not math.isnan(goal[0]):
        return math.atan2(goal[1] - path[frame, i, 1], goal[0] - path[frame, i, 0])
    x = 0.0
    y = 0.0
    for back in range(2):
        x = path[frame - back, i, 0] - path[frame - back - 1, i, 0]
        y = path[frame - back, i, 1] - path[frame - back - 1, i, 1]
        # who has just stood still keeps the course of the step before
        if x != 0.0 or y != 0.0:
            break
    return math.atan2(y, x)


@inlined
def cell_of(tanks: Tanks, tank: int, axis: int, value: float) -> int:
    """Return the row or column of the cell with this x or y, -1 beyond the grid."""
    cell = math.floor((value - tanks.corner[tank, axis]) / tanks.cell[tank])
    size = tanks.inside.shape[1 + axis]
    return int(cell) if 0 <= cell < size else -1


@inlined
def may_be_at(tanks: Tanks, tank: int, x: float, y: float) -> bool:
    """Whether a place is inside of a tank; everywhere, where the tank has no walls."""
    if not tanks.walls[tank]:
        return True
    column = cell_of(tanks, tank, 0, x)
    row = cell_of(tanks, tank, 1, y)
    return column >= 0 and row >= 0 and tanks.inside[tank, column, row]


@inlined
def may_leave_at(tanks: Tanks, tank: int, x: float, y: float) -> bool:
    """Whether a place outside of a tank is at an exit; beyond the grid its nearest cell counts."""
    size = tanks.cell[tank]
    column = min(max(math.floor((x - tanks.corner[tank, 0]) / size), 0), tanks.inside.shape[1] - 1)
    row = min(max(math.floor((y - tanks.corner[tank, 1]) / size), 0), tanks.inside.shape[2] - 1)
    return tanks.exits[tank, column, row]


@inlined
def may_go_to(tanks: Tanks, tank: int, x: float, y: float, leaving: bool) -> bool:
    """Whether a place is inside of a tank, or where `leaving`, at an exit."""
    return may_be_at(tanks, tank, x, y) or (leaving and may_leave_at(tanks, tank, x, y))


@inlined
def see_walls(
    tanks: Tanks, tank: int, x: float, y: float, angle: float, units: Units, own_inputs: np.ndarray
) -> None:
    """Write how near the walls are, at two scales, and that there are some."""
    offset = 2 * LAGS + MEMORIES
    if not tanks.walls[tank]:
        own_inputs[offset : offset + 2 * RAYS + 1] = 0.0
        return
    size = tanks.cell[tank]
    column = min(max(math.floor((x - tanks.corner[tank, 0]) / size), 0), tanks.inside.shape[1] - 1)
    row = min(max(math.floor((y - tanks.corner[tank, 1]) / size), 0), tanks.inside.shape[2] - 1)
    off_x = x - tanks.corner[tank, 0] - (column + 0.5) * size
    off_y = y - tanks.corner[tank, 1] - (row + 0.5) * size
    for ray in range(RAYS):
        direction = angle + ray * (2.0 * math.pi / RAYS)
        turns = direction / (2.0 * math.pi)
        entry = math.floor((turns - math.floor(turns)) * DIRECTIONS + 0.5) % DIRECTIONS
        # the table is for the center of the cell
        distance = tanks.distance[tank, column, row, entry]
        distance -= off_x * math.cos(direction) + off_y * math.sin(direction)
        distance = max(distance, 0.0)
        own_inputs[offset + ray] = math.exp(-distance / units.wall)
        own_inputs[offset + RAYS + ray] = math.exp(-distance / (4.0 * units.wall))
    own_inputs[offset + 2 * RAYS] = 1.0


@inlined
def see_own(
    path: np.ndarray,
    frame: int,
    i: int,
    goal: np.ndarray,
    memory: np.ndarray,
    units: Units,
    own_inputs: np.ndarray,
) -> float:
    """Write the own displacements and the memory; return the course."""
    angle = course(path, frame, i, goal)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    for lag in range(LAGS):
        newer = frame - LAG_EDGES[lag]
        older = frame - LAG_EDGES[lag + 1]
        scale = units.step * (newer - older)
        dx = (path[newer, i, 0] - path[older, i, 0]) / scale
        dy = (path[newer, i, 1] - path[older, i, 1]) / scale
        if math.isnan(dx):
            # whoever has come later than that: as if it had moved on as in the first steps that are known
            own_inputs[2 * lag] = own_inputs[2 * lag - 2]
            own_inputs[2 * lag + 1] = own_inputs[2 * lag - 1]
            continue
        own_inputs[2 * lag] = compressed(dx * cosine + dy * sine)
        own_inputs[2 * lag + 1] = compressed(dy * cosine - dx * sine)
    half = MEMORIES // 2
    for k in range(half):
        own_inputs[2 * LAGS + k] = memory[k] / units.step - 1.0
        own_inputs[2 * LAGS + half + k] = math.sqrt(max(memory[half + k], 0.0)) / units.step - 1.0
    return angle


@inlined
def see_others(
    path: np.ndarray,
    frame: int,
    i: int,
    angle: float,
    units: Units,
    nearest: np.ndarray,
    traits: np.ndarray,
) -> int:
    """Write the traits of the nearest others, and return how many there are; `nearest` is room to sort them in.

    An other is seen if it is present now and has been two steps ago, which tells its velocity.
    """
    others_seen = 0
    x = path[frame, i, 0]
    y = path[frame, i, 1]
    for j in range(path.shape[1]):
        if j == i or math.isnan(path[frame, j, 0]) or math.isnan(path[frame - 2, j, 0]):
            continue
        square = (path[frame, j, 0] - x) ** 2 + (path[frame, j, 1] - y) ** 2
        # insertion into the list of the nearest so far
        at = min(others_seen, MOST_OTHERS)
        while at > 0 and square < nearest[at - 1, 0]:
            if at < MOST_OTHERS:
                nearest[at, 0] = nearest[at - 1, 0]
                nearest[at, 1] = nearest[at - 1, 1]
            at -= 1
        if at < MOST_OTHERS:
            nearest[at, 0] = square
            nearest[at, 1] = j
            others_seen = min(others_seen + 1, MOST_OTHERS)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    for k in range(others_seen):
        j = int(nearest[k, 1])
        dx = path[frame, j, 0] - x
        dy = path[frame, j, 1] - y
        distance = math.sqrt(nearest[k, 0])
        # beside each other directions are noise: they fade below a tenth of the usual distance
        scale = distance + 0.1 * units.other
        vx = (path[frame, j, 0] - path[frame - 2, j, 0]) / (2.0 * units.step)
        vy = (path[frame, j, 1] - path[frame - 2, j, 1]) / (2.0 * units.step)
        traits[k, 0] = (dx * cosine + dy * sine) / scale
        traits[k, 1] = (dy * cosine - dx * sine) / scale
        traits[k, 2] = math.exp(-distance / units.other)
        traits[k, 3] = math.exp(-distance / (4.0 * units.other))
        traits[k, 4] = compressed(distance / units.other)
        traits[k, 5] = compressed(vx * cosine + vy * sine)
        traits[k, 6] = compressed(vy * cosine - vx * sine)
        traits[k, 7] = 1.0
    return others_seen


@inlined
def apply(inputs: np.ndarray, weights: np.ndarray, bias: np.ndarray, outputs: np.ndarray) -> None:
    """Write what a layer answers; always summed in the same order, whoever else is asked."""
    for o in range(outputs.shape[0]):
        outputs[o] = bias[o]
    for k in range(weights.shape[0]):
        value = inputs[k]
        if value != 0.0:
            row = weights[k]
            for o in range(outputs.shape[0]):
                outputs[o] += value * row[o]


@inlined
def bend(values: np.ndarray) -> None:
    """Apply the function x / (1 + exp(-x)) to each number."""
    for o in range(values.shape[0]):
        values[o] = values[o] / (np.float32(1.0) + np.float32(math.exp(-values[o])))


@inlined
def look_at_others(
    traits: np.ndarray,
    others_seen: int,
    layers: Layers,
    first_layer: np.ndarray,
    second: np.ndarray,
    inputs: np.ndarray,
) -> None:
    """Write what the others come to at the end of `inputs`: a mean weighted by attention, nothing among the options."""
    size = second.shape[0]
    start = OWN
    inputs[start : start + size] = np.float32(0.0)
    # softmax against an option of zero, shifted by the largest exponent so far
    largest = 0.0
    total = 1.0
    for k in range(others_seen):
        apply(traits[k], layers.other_first, layers.other_first_bias, first_layer)
        bend(first_layer)
        apply(first_layer, layers.other_second, layers.other_second_bias, second)
        bend(second)
        exponent = float(layers.attention_bias[0])
        for o in range(size):
            exponent += second[o] * layers.attention[o, 0]
        if exponent > largest:
            factor = math.exp(largest - exponent)
            total *= factor
            for o in range(size):
                inputs[start + o] *= np.float32(factor)
            largest = exponent
        weight = math.exp(exponent - largest)
        total += weight
        for o in range(size):
            inputs[start + o] += np.float32(weight) * second[o]
    for o in range(size):
        inputs[start + o] /= np.float32(total)


@inlined
def think(inputs: np.ndarray, layers: Layers, first_layer: np.ndarray, hidden: np.ndarray) -> None:
    """Write the hidden state of the trunk."""
    apply(inputs, layers.trunk_first, layers.trunk_first_bias, first_layer)
    bend(first_layer)
    apply(first_layer, layers.trunk_second, layers.trunk_second_bias, hidden)
    bend(hidden)


@inlined
def locate(hidden: np.ndarray, metric: np.ndarray, context: np.ndarray) -> None:
    """Write the place of a hidden state among contexts."""
    context[:] = np.float32(0.0)
    for h in range(metric.shape[0]):
        for d in range(metric.shape[1]):
            context[d] += hidden[h] * metric[h, d]


@inlined
def keep_nearest(distance: float, which: int, distances: np.ndarray, nearest: np.ndarray) -> None:
    """Insert something at a distance into a sorted list of the nearest."""
    at = distances.shape[0] - 1
    if distance >= distances[at]:
        return
    while at > 0 and distance < distances[at - 1]:
        distances[at] = distances[at - 1]
        nearest[at] = nearest[at - 1]
        at -= 1
    distances[at] = distance
    nearest[at] = which


@inlined
def square_distances(
    context: np.ndarray, others: np.ndarray, start: int, stop: int, squares: np.ndarray
) -> None:
    """Write how far others (D, N) from `start` to `stop` are, squared; always summed in the same order."""
    squares[start:stop] = np.float32(0.0)
    for d in range(context.shape[0]):
        own = context[d]
        row = others[d]
        for n in range(start, stop):
            difference = row[n] - own
            squares[n] += difference * difference


@inlined
def find_alike(
    context: np.ndarray, pieces: Pieces, cells: np.ndarray, cell_distances: np.ndarray,
    squares: np.ndarray, alike: np.ndarray, distances: np.ndarray,
) -> None:  # fmt: skip
    """Write which recorded steps were done in the nearest contexts, and how far these are, squared.

    They are sought in the nearest cells alone. `squares` is room for as many as there are steps.
    """
    cell_distances[:] = np.float32(np.inf)
    square_distances(context, pieces.centers, 0, pieces.centers.shape[1], squares)
    for c in range(pieces.centers.shape[1]):
        keep_nearest(squares[c], c, cell_distances, cells)
    distances[:] = np.float32(np.inf)
    alike[:] = -1
    for p in range(min(cells.shape[0], pieces.centers.shape[1])):
        start = pieces.begin[cells[p]]
        stop = pieces.begin[cells[p] + 1]
        square_distances(context, pieces.context, start, stop, squares)
        for r in range(start, stop):
            keep_nearest(squares[r], r, distances, alike)


@inlined
def weigh(
    alike: np.ndarray, count: int, pieces: Pieces, units: Units, noises: np.ndarray, weights: np.ndarray
) -> None:  # fmt: skip
    """Write how often each of the first `count` steps is chosen: as often, where noises are 1.

    Noises of length and of turn raise the chance of each, as of a normal distribution with their mean and spread, to
    the power 1 / noise, which multiplies the variance.
    """
    weights[:count] = 1.0
    for which in range(2):
        if noises[which] == 1.0:
            continue
        mean = 0.0
        square = 0.0
        for k in range(count):
            value = outcome(alike[k], pieces, units, which)
            mean += value / count
            square += value * value / count
        spread = max(square - mean * mean, 1e-12)
        power = 1.0 / noises[which] - 1.0
        for k in range(count):
            off = outcome(alike[k], pieces, units, which) - mean
            # no step becomes more than e^4 times as likely: those far away are few
            weights[k] *= math.exp(min(-0.5 * power * off * off / spread, 4.0))


@inlined
def outcome(r: int, pieces: Pieces, units: Units, which: int) -> float:
    """Return how far a recorded step led (0) or where (1), soon after if that was recorded."""
    forward = pieces.ahead[r, 1, 0]
    leftward = pieces.ahead[r, 1, 1]
    if math.isnan(forward):
        return math.log1p(pieces.length[r] / units.step) if which == 0 else pieces.turn[r]
    if which == 0:
        return math.log1p(math.hypot(forward, leftward) / units.step)
    return math.atan2(leftward, forward)


@inlined
def stays_inside(
    tanks: Tanks, tank: int, x: float, y: float, angle: float, speed: float, ahead: np.ndarray, moments: int,
    leaving: bool,
) -> bool:  # fmt: skip
    """Whether what was recorded after a step would stay in the tank, as far as it was, or where `leaving`, by an exit."""
    cosine = speed * math.cos(angle)
    sine = speed * math.sin(angle)
    for k in range(moments):
        forward = ahead[k, 0]
        leftward = ahead[k, 1]
        if math.isnan(forward):
            break
        new_x = x + forward * cosine - leftward * sine
        new_y = y + forward * sine + leftward * cosine
        if not may_be_at(tanks, tank, new_x, new_y):
            return leaving and may_leave_at(tanks, tank, new_x, new_y)
    return True


@inlined
def bend_inside(
    tanks: Tanks, tank: int, x: float, y: float, angle: float, speed: float, pieces: Pieces, row: int, moments: int,
    leaving: bool,
) -> float:  # fmt: skip
    """Return the least angle (rad) by which the piece of a row has to be turned to stay in the tank; NaN if none is small enough.

    Pieces of those who go somewhere are not turned: their axis is where they go.
    """
    ahead = pieces.ahead[row]
    if stays_inside(tanks, tank, x, y, angle, speed, ahead, moments, leaving):
        return 0.0
    if leaving:
        return math.nan
    # To the side of the piece's own turn first, so that all is the same in a mirror
    first_side = -1.0 if pieces.turn[row] < 0 else 1.0
    for k in range(1, BENDS + 1):
        for side in (first_side, -first_side):
            off = side * k * BEND
            if stays_inside(tanks, tank, x, y, angle + off, speed, ahead, moments, leaving):
                return off
    return math.nan


@inlined
def along_wall(
    tanks: Tanks, tank: int, x: float, y: float, angle: float, turn: float, length: float
) -> float:
    """Return the least angle (rad) by which a step has to be turned to stay in the tank, up to a quarter turn; 0 if none is.

    `turn` (rad) is its own turn from the axis `angle` (rad), to whose side it is turned first.
    """
    first_side = -1.0 if turn < 0 else 1.0
    for k in range(round(math.pi / 2 / BEND) + 1):
        for side in (first_side, -first_side):
            turned = angle + turn + side * k * BEND
            if may_be_at(tanks, tank, x + length * math.cos(turned), y + length * math.sin(turned)):
                return side * k * BEND
    return 0.0


@inlined
def look_ahead(
    path: np.ndarray, frame: int, i: int, angle: float, speed: float, pieces: Pieces, row: int, ahead_steps: np.ndarray,
    future: np.ndarray,
) -> None:  # fmt: skip
    """Write where a piece leads (1 + AHEAD, 2): in a step, and in `ahead_steps` (AHEAD,); straight on after its end."""
    x = path[frame, i, 0]
    y = path[frame, i, 1]
    cosine = speed * math.cos(angle)
    sine = speed * math.sin(angle)
    length = speed * pieces.length[row]
    future[0, 0] = x + length * math.cos(angle + pieces.turn[row])
    future[0, 1] = y + length * math.sin(angle + pieces.turn[row])
    steps_before = 1.0
    for k in range(AHEAD):
        forward = pieces.ahead[row, k, 0]
        leftward = pieces.ahead[row, k, 1]
        if math.isnan(forward):
            ratio = ahead_steps[k] / steps_before
            future[k + 1, 0] = x + ratio * (future[k, 0] - x)
            future[k + 1, 1] = y + ratio * (future[k, 1] - y)
        else:
            future[k + 1, 0] = x + forward * cosine - leftward * sine
            future[k + 1, 1] = y + forward * sine + leftward * cosine
        steps_before = ahead_steps[k]


@inlined
def go_straight(
    path: np.ndarray, frame: int, i: int, ahead_steps: np.ndarray, future: np.ndarray
) -> None:
    """Write where an individual will be (1 + AHEAD, 2) if it goes on as in its last steps."""
    back = PAST
    while back > 1 and math.isnan(path[frame - back, i, 0]):
        back -= 1
    for axis in range(2):
        coordinate = path[frame, i, axis]
        velocity = (coordinate - path[frame - back, i, axis]) / back
        if math.isnan(velocity):
            # whoever has just come
            velocity = 0.0
        future[0, axis] = coordinate + velocity
        for k in range(AHEAD):
            future[k + 1, axis] = coordinate + ahead_steps[k] * velocity


@inlined
def clearance(path: np.ndarray, frame: int, i: int, futures: np.ndarray, closest: float) -> float:
    """Return how near an individual comes to another, squared, in units of `closest`; 1 if not nearer than that.

    `futures` (A, 1 + AHEAD, 2) tell where everybody will be. Who is that near already may go away.
    """
    nearest = 1.0
    for j in range(path.shape[1]):
        if j == i or math.isnan(path[frame, j, 0]):
            continue
        dx = path[frame, j, 0] - path[frame, i, 0]
        dy = path[frame, j, 1] - path[frame, i, 1]
        now = (dx * dx + dy * dy) / (closest * closest)
        for k in range(1 + AHEAD):
            dx = futures[j, k, 0] - futures[i, k, 0]
            dy = futures[j, k, 1] - futures[i, k, 1]
            square = (dx * dx + dy * dy) / (closest * closest)
            if square < now:
                nearest = min(nearest, square)
    return nearest


@inlined
def remember(displacement: float, units: Units, memory: np.ndarray) -> None:
    """Move the leaky averages of one individual by a step."""
    length = min(displacement, units.fastest)
    half = MEMORIES // 2
    for k in range(half):
        memory[k] += units.memory_rates[k] * (length - memory[k])
        memory[half + k] += units.memory_rates[k] * (length * length - memory[half + k])


def _remember_path(path: np.ndarray, units: Units, start: float, memories: np.ndarray) -> None:
    """Fill `memories` (F, A, MEMORIES) along a recording (F, A, 2) with NaN where one is absent."""
    half = MEMORIES // 2
    for i in range(path.shape[1]):
        current = np.empty(MEMORIES)
        current[:half] = start
        current[half:] = start * start
        memories[0, i] = current
        for frame in range(1, path.shape[0]):
            dx = path[frame, i, 0] - path[frame - 1, i, 0]
            dy = path[frame, i, 1] - path[frame - 1, i, 1]
            if not math.isnan(dx):
                remember(math.hypot(dx, dy), units, current)
            memories[frame, i] = current


def _perceive(
    path: np.ndarray, memories: np.ndarray, goals: np.ndarray, rows: np.ndarray, tanks: Tanks, tank: int, units: Units,
    own_inputs: np.ndarray, traits: np.ndarray, others_seen: np.ndarray, answers: np.ndarray,
) -> None:  # fmt: skip
    """Fill what individuals of a recording perceive and do.

    `goals` (A, 2) are NaN where nobody comes or goes. `rows` (N, 2) are frames and individuals; `own_inputs` (N, OWN)
    and `traits` (N, MOST_OTHERS, TRAITS) what they perceive, `others_seen` (N,) how many others, `answers` (N, 2) length
    and turn of the step that follows.
    """
    nearest = np.empty((MOST_OTHERS, 2))
    for n in range(rows.shape[0]):
        frame = rows[n, 0]
        i = rows[n, 1]
        angle = see_own(path, frame, i, goals[i], memories[frame, i], units, own_inputs[n])
        see_walls(tanks, tank, path[frame, i, 0], path[frame, i, 1], angle, units, own_inputs[n])
        others_seen[n] = see_others(path, frame, i, angle, units, nearest, traits[n])
        dx = path[frame + 1, i, 0] - path[frame, i, 0]
        dy = path[frame + 1, i, 1] - path[frame, i, 1]
        answers[n, 0] = math.hypot(dx, dy)
        turn = math.atan2(dy, dx) - angle
        answers[n, 1] = turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))


def _contexts(
    own_inputs: np.ndarray, traits: np.ndarray, others_seen: np.ndarray, layers: Layers, contexts: np.ndarray
) -> None:  # fmt: skip
    """Fill the places among contexts (N, D) of what individuals perceive."""
    other_first = np.empty(layers.other_first.shape[1], np.float32)
    other_second = np.empty(layers.other_second.shape[1], np.float32)
    inputs = np.empty(layers.trunk_first.shape[0], np.float32)
    first_layer = np.empty(layers.trunk_first.shape[1], np.float32)
    hidden = np.empty(layers.trunk_second.shape[1], np.float32)
    for n in range(own_inputs.shape[0]):
        inputs[:OWN] = own_inputs[n]
        look_at_others(traits[n], others_seen[n], layers, other_first, other_second, inputs)
        think(inputs, layers, first_layer, hidden)
        locate(hidden, layers.metric, contexts[n])


def _measure_reach(pieces: Pieces) -> None:
    """Fill `pieces.reach`."""
    squares = np.empty(pieces.length.shape[0], np.float32)
    cells = np.empty(PROBES, np.int64)
    cell_distances = np.empty(PROBES, np.float32)
    alike = np.empty(NEAREST_CONTEXTS, np.int64)
    distances = np.empty(NEAREST_CONTEXTS, np.float32)
    context = np.empty(pieces.context.shape[0], np.float32)
    for r in range(pieces.length.shape[0]):
        context[:] = pieces.context[:, r]
        find_alike(context, pieces, cells, cell_distances, squares, alike, distances)
        pieces.reach[r] = distances[NEAREST_CONTEXTS - 1]


def _move_range(
    start: int, stop: int, paths: np.ndarray, memories: np.ndarray, goals: np.ndarray, keys: np.ndarray,
    gains: np.ndarray, which_tank: np.ndarray, leaving: np.ndarray, ahead_steps: np.ndarray, tanks: Tanks, units: Units,
    layers: Layers, pieces: Pieces,
) -> None:  # fmt: skip
    """Move the groups `start` to `stop`: fill `paths` (M, F, A, 2) after its first HISTORY + 1 frames.

    `memories` (M, A, MEMORIES) are those at the last frame that is given, and move along, except of those who have a
    goal. `goals` (M, A, 2) are NaN where nobody comes or goes. `gains` (M, 7): speed, noise of length and of turn, walls,
    places and velocities of the others, memory. `keys` (M,) name streams of random numbers. Where a path has places
    already, as those of whoever comes later, it keeps them; other places are NaN.
    `leaving` (M,) tells in which groups an individual is gone after a last step, or through an exit, and `ahead_steps`
    (AHEAD,) after how many steps the moments of `pieces.ahead` are. Units and pieces are for a speed of 1.
    """
    individuals = paths.shape[2]
    own_inputs = np.empty(OWN)
    traits = np.empty((MOST_OTHERS, TRAITS), np.float32)
    nearest = np.empty((MOST_OTHERS, 2))
    other_first = np.empty(layers.other_first.shape[1], np.float32)
    other_second = np.empty(layers.other_second.shape[1], np.float32)
    inputs = np.empty(layers.trunk_first.shape[0], np.float32)
    first_layer = np.empty(layers.trunk_first.shape[1], np.float32)
    hidden = np.empty(layers.trunk_second.shape[1], np.float32)
    decided = np.empty(layers.trunk_second.shape[1], np.float32)
    context = np.empty(layers.metric.shape[1], np.float32)
    weights = np.empty(VIEWS, np.float32)
    squares = np.empty(pieces.length.shape[0], np.float32)
    cells = np.empty(PROBES, np.int64)
    cell_distances = np.empty(PROBES, np.float32)
    alike = np.empty(NEAREST_CONTEXTS, np.int64)
    distances = np.empty(NEAREST_CONTEXTS, np.float32)
    chances = np.empty(NEAREST_CONTEXTS)
    bends = np.empty(NEAREST_CONTEXTS)
    followed = np.empty(individuals, np.int64)
    # where everybody will be: what others have chosen already counts
    futures = np.empty((individuals, 1 + AHEAD, 2))
    closest = max(units.closest, 1e-9)
    for m in range(start, stop):
        speed, _, _, walls, places, velocities, recall = gains[m]
        # lengths of a faster group are seen in longer units: it is the same group, faster
        mine = Units(
            units.step * speed,
            units.wall,
            units.other,
            units.memory_rates,
            units.fastest * speed,
            units.closest,
        )
        tank = which_tank[m]
        # telescoped: the answer to the own motion, and what walls, places and velocities each add to it
        weights[OWN_MOTION] = 1.0 - walls
        weights[WITH_WALLS] = walls - places
        weights[WITH_PLACES] = places - velocities
        weights[WITH_ALL] = velocities
        counter = np.uint64(0)
        key = keys[m]
        followed[:] = -1
        for frame in range(HISTORY, paths.shape[1] - 1):
            for i in range(individuals):
                if math.isnan(paths[m, frame, i, 0]):
                    continue
                r = pieces.then[followed[i]] if followed[i] >= 0 else -1
                if r >= 0:
                    angle = course(paths[m], frame, i, goals[m, i])
                    look_ahead(paths[m], frame, i, angle, speed, pieces, r, ahead_steps, futures[i])
                else:
                    go_straight(paths[m], frame, i, ahead_steps, futures[i])
            for i in range(individuals):
                absent = math.isnan(paths[m, frame, i, 0])
                if absent or not math.isnan(paths[m, frame + 1, i, 0]):
                    continue
                if leaving[m] and followed[i] >= 0 and pieces.last[followed[i]]:
                    continue
                x = paths[m, frame, i, 0]
                y = paths[m, frame, i, 1]
                angle = see_own(paths[m], frame, i, goals[m, i], memories[m, i], mine, own_inputs)
                for k in range(MEMORIES):
                    own_inputs[2 * LAGS + k] *= recall
                see_walls(tanks, tank, x, y, angle, mine, own_inputs)
                others_seen = see_others(paths[m], frame, i, angle, mine, nearest, traits)
                decided[:] = np.float32(0.0)
                for view in range(VIEWS):
                    if weights[view] == 0.0:
                        continue
                    for k in range(OWN):
                        inputs[k] = np.float32(own_inputs[k])
                    if view == OWN_MOTION:
                        inputs[OWN - 2 * RAYS - 1 : OWN] = np.float32(0.0)
                    if view == WITH_PLACES:
                        for k in range(others_seen):
                            traits[k, 5:8] = np.float32(0.0)
                    elif view == WITH_ALL and weights[WITH_PLACES] != 0.0:
                        others_seen = see_others(paths[m], frame, i, angle, mine, nearest, traits)
                    visible = others_seen if view >= WITH_PLACES else 0
                    look_at_others(traits, visible, layers, other_first, other_second, inputs)
                    think(inputs, layers, first_layer, hidden)
                    for h in range(hidden.shape[0]):
                        decided[h] += weights[view] * hidden[h]
                locate(decided, layers.metric, context)
                # what was done next in the piece that is followed, if it was done in a context like this one
                r = followed[i]
                bend = 0.0
                if r >= 0:
                    r = pieces.then[r]
                if r >= 0:
                    square = np.float32(0.0)
                    for d in range(context.shape[0]):
                        difference = pieces.context[d, r] - context[d]
                        square += difference * difference
                    times = FOLLOWED_BRISK if pieces.brisk[r] else FOLLOWED
                    bend = math.nan
                    if square <= times * pieces.reach[r]:
                        bend = bend_inside(
                            tanks, tank, x, y, angle, speed, pieces, r, FOLLOWED_AHEAD, leaving[m]
                        )
                    if math.isnan(bend):
                        r = -1
                # how clear it keeps of others, -1 if it does not go on
                kept = -1.0
                if r >= 0:
                    look_ahead(
                        paths[m], frame, i, angle + bend, speed, pieces, r, ahead_steps, futures[i]
                    )
                    new_x, new_y = futures[i, 0]
                    if may_go_to(tanks, tank, new_x, new_y, leaving[m]):
                        kept = clearance(paths[m], frame, i, futures, closest)
                    else:
                        r = -1
                count = 0
                if kept < FOLLOWED_DISTANCE * FOLLOWED_DISTANCE:
                    find_alike(context, pieces, cells, cell_distances, squares, alike, distances)
                    while count < NEAREST_CONTEXTS and alike[count] >= 0:
                        count += 1
                    weigh(alike, count, pieces, units, gains[m, 1:3], chances)
                    total = 0.0
                    chosen = -1
                    for k in range(count):
                        bends[k] = bend_inside(
                            tanks, tank, x, y, angle, speed, pieces, alike[k], AHEAD, leaving[m]
                        )
                        clear = -1.0
                        if not math.isnan(bends[k]):
                            look_ahead(
                                paths[m],
                                frame,
                                i,
                                angle + bends[k],
                                speed,
                                pieces,
                                alike[k],
                                ahead_steps,
                                futures[i],
                            )
                            new_x, new_y = futures[i, 0]
                            if may_go_to(tanks, tank, new_x, new_y, leaving[m]):
                                clear = clearance(paths[m], frame, i, futures, closest)
                        if clear < 1.0:
                            chances[k] = 0.0
                        total += chances[k]
                        # where none keeps clear, that which comes least near
                        if clear > kept:
                            kept = clear
                            chosen = k
                    if total > 0.0:
                        remaining = uniform(key, counter) * total
                        counter += np.uint64(1)
                        for k in range(count):
                            if chances[k] > 0.0 and remaining >= 0.0:
                                chosen = k
                            remaining -= chances[k]
                    if chosen >= 0:
                        r = alike[chosen]
                        bend = bends[chosen]
                    # `futures` has where the last piece that was looked at leads
                    if r >= 0:
                        look_ahead(
                            paths[m],
                            frame,
                            i,
                            angle + bend,
                            speed,
                            pieces,
                            r,
                            ahead_steps,
                            futures[i],
                        )
                new_x, new_y = futures[i, 0]
                if r < 0:
                    go_straight(paths[m], frame, i, ahead_steps, futures[i])
                    # the wall is everywhere ahead: a shorter step, in the end none
                    for attempt in range(TRIES):
                        r = alike[int(uniform(key, counter) * count)]
                        counter += np.uint64(1)
                        length = speed * pieces.length[r] * (1.0 - attempt / (TRIES - 1))
                        bend = 0.0
                        if leaving[m]:
                            # whoever goes straight to a goal behind a wall would stand there for good
                            bend = along_wall(tanks, tank, x, y, angle, pieces.turn[r], length)
                        new_x = x + length * math.cos(angle + bend + pieces.turn[r])
                        new_y = y + length * math.sin(angle + bend + pieces.turn[r])
                        if may_go_to(tanks, tank, new_x, new_y, leaving[m]):
                            break
                outside = not may_be_at(tanks, tank, new_x, new_y)
                if leaving[m] and outside and may_leave_at(tanks, tank, new_x, new_y):
                    new_x = math.nan
                    new_y = math.nan
                followed[i] = r
                paths[m, frame + 1, i, 0] = new_x
                paths[m, frame + 1, i, 1] = new_y
            for i in range(individuals):
                dx = paths[m, frame + 1, i, 0] - paths[m, frame, i, 0]
                dy = paths[m, frame + 1, i, 1] - paths[m, frame, i, 1]
                if not math.isnan(dx) and math.isnan(goals[m, i, 0]):
                    remember(math.hypot(dx, dy), mine, memories[m, i])


remember_path = compile_cached(_remember_path)
contexts = compile_cached(_contexts)
measure_reach = compile_cached(_measure_reach)
perceive = compile_cached(_perceive)
move_range = compile_cached(_move_range, notice="{} model of animals")
