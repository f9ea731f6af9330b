"""Individuals that a learned network moves: what they perceive, what it answers, and where they go.

Perception does not depend on the number or the order of the others. All that is seen is turned into the frame of the
individual, whose axis is the direction of its last displacement.
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
"""Steps that an individual has to have moved before a network can move it."""
COURSE_WEIGHTS = np.array((1.0, 0.01))
"""Weights of the last displacements in the course: that before the last decides where the last one is none."""
MEMORY_S = np.array((1.0, 5.0, 20.0))
"""Time constants (s) of the leaky averages of the speed and of its square."""
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

TRIES = 8
"""Choices after which an individual that would leave the tank makes a shorter step instead."""


class Units(NamedTuple):
    """What perception is measured in."""

    step: float  # median displacement in a step (cm)
    wall: float  # distance (cm) at which a wall is near
    other: float  # median distance (cm) of the nearest other
    memory_rates: np.ndarray  # (3,): share by which each leaky average moves in a step
    fastest: float  # displacement (cm) beyond which a step counts as so long in the memory


class Tanks(NamedTuple):
    """Where individuals may be: tanks on grids of square cells."""

    walls: np.ndarray  # (N,) bool: whether the tank has walls
    corner: np.ndarray  # (N, 2): x, y of the grid's lower corner (cm)
    cell: np.ndarray  # (N,): side of a cell (cm)
    inside: np.ndarray  # (N, X, Y) bool
    distance: (
        np.ndarray
    )  # (N, X, Y, DIRECTIONS) float32: from the center of a cell to the wall (cm)


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
    length: np.ndarray
    length_bias: np.ndarray
    turn_hidden: np.ndarray
    turn_of_length: (
        np.ndarray
    )  # (bins, hidden): what the length that was chosen adds, the bias among it
    turn: np.ndarray
    turn_bias: np.ndarray


class Choices(NamedTuple):
    """What the network chooses from: bins of lengths (cm) and turns (rad) of a step, by quantiles within each."""

    lengths: np.ndarray  # (B, Q)
    turns: np.ndarray  # (B, Q)


@inlined
def compressed(value: float) -> float:
    """Return a number with its sign, large ones by their logarithm."""
    return math.copysign(math.log1p(abs(value)), value)


@inlined
def course(path: np.ndarray, frame: int, i: int) -> float:
    """Return the direction (rad) of the last displacement."""
    x = 0.0
    y = 0.0
    for back in range(COURSE_WEIGHTS.shape[0]):
        x += COURSE_WEIGHTS[back] * (path[frame - back, i, 0] - path[frame - back - 1, i, 0])
        y += COURSE_WEIGHTS[back] * (path[frame - back, i, 1] - path[frame - back - 1, i, 1])
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
    path: np.ndarray, frame: int, i: int, memory: np.ndarray, units: Units, own_inputs: np.ndarray
) -> float:
    """Write the own displacements and the memory; return the course."""
    angle = course(path, frame, i)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    for lag in range(LAGS):
        newer = frame - LAG_EDGES[lag]
        older = frame - LAG_EDGES[lag + 1]
        scale = units.step * (newer - older)
        dx = (path[newer, i, 0] - path[older, i, 0]) / scale
        dy = (path[newer, i, 1] - path[older, i, 1]) / scale
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
def choose(logits: np.ndarray, noise: float, chance: float) -> int:
    """Return a bin drawn with probabilities that go as exp(logits / noise)."""
    largest = logits[0]
    for b in range(1, logits.shape[0]):
        largest = max(largest, logits[b])
    total = 0.0
    for b in range(logits.shape[0]):
        logits[b] = np.float32(math.exp((logits[b] - largest) / noise))
        total += logits[b]
    remaining = chance * total
    for b in range(logits.shape[0] - 1):
        remaining -= logits[b]
        if remaining < 0.0:
            return b
    return logits.shape[0] - 1


@inlined
def within(quantiles: np.ndarray, chance: float) -> float:
    """Return a value of a bin, between its quantiles."""
    position = chance * (quantiles.shape[0] - 1)
    k = min(int(position), quantiles.shape[0] - 2)
    return quantiles[k] + (position - k) * (quantiles[k + 1] - quantiles[k])


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
    path: np.ndarray, memories: np.ndarray, rows: np.ndarray, tanks: Tanks, tank: int, units: Units,
    own_inputs: np.ndarray, traits: np.ndarray, others_seen: np.ndarray, answers: np.ndarray,
) -> None:  # fmt: skip
    """Fill what individuals of a recording perceive and do.

    `rows` (N, 2) are frames and individuals; `own_inputs` (N, OWN) and `traits` (N, MOST_OTHERS, TRAITS) what they perceive,
    `others_seen` (N,) how many others, `answers` (N, 2) length and turn of the step that follows.
    """
    nearest = np.empty((MOST_OTHERS, 2))
    for n in range(rows.shape[0]):
        frame = rows[n, 0]
        i = rows[n, 1]
        angle = see_own(path, frame, i, memories[frame, i], units, own_inputs[n])
        see_walls(tanks, tank, path[frame, i, 0], path[frame, i, 1], angle, units, own_inputs[n])
        others_seen[n] = see_others(path, frame, i, angle, units, nearest, traits[n])
        dx = path[frame + 1, i, 0] - path[frame, i, 0]
        dy = path[frame + 1, i, 1] - path[frame, i, 1]
        answers[n, 0] = math.hypot(dx, dy)
        turn = math.atan2(dy, dx) - angle
        answers[n, 1] = turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))


def _move_range(
    start: int, stop: int, paths: np.ndarray, memories: np.ndarray, keys: np.ndarray, gains: np.ndarray,
    which_tank: np.ndarray, tanks: Tanks, units: Units, layers: Layers, choices: Choices,
) -> None:  # fmt: skip
    """Move the groups `start` to `stop`: fill `paths` (M, F, A, 2) after its first HISTORY + 1 frames.

    `memories` (M, A, MEMORIES) are those at the last frame that is given, and move along. `gains` (M, 7): speed,
    noise of length and of turn, walls, places and velocities of the others, memory. `keys` (M,) name streams of random
    numbers. Individuals that are NaN at the start are absent. `units.step` and the choices are for a speed of 1.
    """
    individuals = paths.shape[2]
    bins = choices.lengths.shape[0]
    own_inputs = np.empty(OWN)
    traits = np.empty((MOST_OTHERS, TRAITS), np.float32)
    nearest = np.empty((MOST_OTHERS, 2))
    other_first = np.empty(layers.other_first.shape[1], np.float32)
    other_second = np.empty(layers.other_second.shape[1], np.float32)
    inputs = np.empty(layers.trunk_first.shape[0], np.float32)
    first_layer = np.empty(layers.trunk_first.shape[1], np.float32)
    hidden = np.empty((VIEWS, layers.trunk_second.shape[1]), np.float32)
    turn_hidden = np.empty(layers.turn_hidden.shape[1], np.float32)
    answer = np.empty(bins, np.float32)
    length_logits = np.empty(bins, np.float32)
    drawn = np.empty(bins, np.float32)
    weights = np.empty(VIEWS, np.float32)
    for m in range(start, stop):
        speed, length_noise, turn_noise, walls, places, velocities, recall = gains[m]
        # lengths of a faster group are seen in longer units: it is the same group, faster
        mine = Units(
            units.step * speed, units.wall, units.other, units.memory_rates, units.fastest * speed
        )
        tank = which_tank[m]
        # telescoped: the answer to the own motion, and what walls, places and velocities each add to it
        weights[OWN_MOTION] = 1.0 - walls
        weights[WITH_WALLS] = walls - places
        weights[WITH_PLACES] = places - velocities
        weights[WITH_ALL] = velocities
        counter = np.uint64(0)
        key = keys[m]
        for frame in range(HISTORY, paths.shape[1] - 1):
            for i in range(individuals):
                if math.isnan(paths[m, frame, i, 0]):
                    paths[m, frame + 1, i] = np.nan
                    continue
                x = paths[m, frame, i, 0]
                y = paths[m, frame, i, 1]
                angle = see_own(paths[m], frame, i, memories[m, i], mine, own_inputs)
                for k in range(MEMORIES):
                    own_inputs[2 * LAGS + k] *= recall
                see_walls(tanks, tank, x, y, angle, mine, own_inputs)
                others_seen = see_others(paths[m], frame, i, angle, mine, nearest, traits)
                length_logits[:] = np.float32(0.0)
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
                    think(inputs, layers, first_layer, hidden[view])
                    apply(hidden[view], layers.length, layers.length_bias, answer)
                    for b in range(bins):
                        length_logits[b] += weights[view] * answer[b]
                for attempt in range(TRIES):
                    drawn[:] = length_logits
                    length_bin = choose(drawn, length_noise, uniform(key, counter))
                    drawn[:] = np.float32(0.0)
                    for view in range(VIEWS):
                        if weights[view] == 0.0:
                            continue
                        apply(
                            hidden[view],
                            layers.turn_hidden,
                            layers.turn_of_length[length_bin],
                            turn_hidden,
                        )
                        bend(turn_hidden)
                        apply(turn_hidden, layers.turn, layers.turn_bias, answer)
                        for b in range(bins):
                            drawn[b] += weights[view] * answer[b]
                    turn_bin = choose(drawn, turn_noise, uniform(key, counter + np.uint64(1)))
                    length = speed * within(
                        choices.lengths[length_bin], uniform(key, counter + np.uint64(2))
                    )
                    turn = within(choices.turns[turn_bin], uniform(key, counter + np.uint64(3)))
                    counter += np.uint64(4)
                    if attempt >= TRIES // 2:
                        # the wall is everywhere ahead: a shorter step, in the end none
                        length *= 1.0 - (attempt - TRIES // 2 + 1) / (TRIES // 2)
                    new_x = x + length * math.cos(angle + turn)
                    new_y = y + length * math.sin(angle + turn)
                    if may_be_at(tanks, tank, new_x, new_y):
                        break
                paths[m, frame + 1, i, 0] = new_x
                paths[m, frame + 1, i, 1] = new_y
            for i in range(individuals):
                dx = paths[m, frame + 1, i, 0] - paths[m, frame, i, 0]
                dy = paths[m, frame + 1, i, 1] - paths[m, frame, i, 1]
                if not math.isnan(dx):
                    remember(math.hypot(dx, dy), mine, memories[m, i])


def _answer(
    own_inputs: np.ndarray, traits: np.ndarray, others_seen: int, layers: Layers, length_bin: int,
    says_length: np.ndarray, says_turn: np.ndarray,
) -> None:  # fmt: skip
    """Fill the logits (B,) of the length, and of the turn after a length of this bin, for one perception, float32."""
    first_layer = np.empty(layers.trunk_first.shape[1], np.float32)
    hidden = np.empty(layers.trunk_second.shape[1], np.float32)
    other_first = np.empty(layers.other_first.shape[1], np.float32)
    other_second = np.empty(layers.other_second.shape[1], np.float32)
    inputs = np.empty(layers.trunk_first.shape[0], np.float32)
    inputs[:OWN] = own_inputs
    look_at_others(traits, others_seen, layers, other_first, other_second, inputs)
    think(inputs, layers, first_layer, hidden)
    apply(hidden, layers.length, layers.length_bias, says_length)
    turn_hidden = np.empty(layers.turn_hidden.shape[1], np.float32)
    apply(hidden, layers.turn_hidden, layers.turn_of_length[length_bin], turn_hidden)
    bend(turn_hidden)
    apply(turn_hidden, layers.turn, layers.turn_bias, says_turn)


remember_path = compile_cached(_remember_path)
answer = compile_cached(_answer)
perceive = compile_cached(_perceive)
move_range = compile_cached(_move_range, notice="{} model of animals")
