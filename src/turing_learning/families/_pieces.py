"""Recorded steps as pieces that can be done again: what they led to, and how those of like contexts are found."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.kernels.imitation import (
    AHEAD,
    HISTORY,
    MOST_OTHERS,
    OWN,
    PAST,
    TRAITS,
    Layers,
    Pieces,
    Tanks,
    Units,
    contexts,
    measure_reach,
    perceive,
)
from turing_learning.trajectories import nearest_others

HORIZONS_S = (0.0, 0.2, 0.4, 0.8, 1.6)
"""Times (s) after which is looked where a step led; at least one step more than the one before."""
OTHERS_AFTER = (3, 4)
"""Which of these times are those after which is looked where the nearest other is."""
WALL_AFTER = 3
"""And where the nearest wall is."""
CELL_POINTS = 40
"""Contexts for each cell, by which its center is found."""
ROUNDS = 8
"""Of the search for centers."""
BLOCK_STEPS = 200
"""Steps that are kept together where too many were recorded: pieces are followed from step to step."""


@dataclass(frozen=True)
class Recorded:
    """What individuals perceived and did: N steps of recordings."""

    own: np.ndarray  #: (N, OWN)
    traits: np.ndarray  #: (N, MOST_OTHERS, TRAITS)
    seen: np.ndarray  #: (N,): others that were seen
    #: (N, 2): length (cm) and turn (rad) of the step that followed
    answers: np.ndarray
    #: (N, Q, 2): distances (cm) and directions (rad, from the course) of outcomes; NaN where they were not recorded
    outcomes: np.ndarray
    ahead: np.ndarray  #: (N, AHEAD, 2): where the step led (cm), forward and left
    #: (N,): number of the step of the same individual that came next, -1 if there is none
    then: np.ndarray
    last: np.ndarray  #: (N,) bool: whether the individual was gone after the step
    brisk: np.ndarray  #: (N,) bool: whether somebody who goes somewhere was not held up before it
    #: (N,): where in a recording; steps of one stretch follow each other
    stretch: np.ndarray


BRISK = 0.5
"""Share of its usual speed from which on somebody is not held up."""
BORROWED_STEPS = 20
"""Times that the first steps of two individuals are prolonged to see whether they go to the same place."""
TURNOVER = 2
"""Individuals for each that is there at once, from which on they come and go."""
OUTCOMES = len(HORIZONS_S) + len(OTHERS_AFTER) + 1
"""Q: own motion, the nearest other, the nearest wall."""


def rows_of(path: np.ndarray, learned: np.ndarray) -> np.ndarray:
    """Return frames and individuals (N, 2) whose past is there and whose next step may be learned, `learned` (F, A).

    The steps of an individual follow each other.
    """
    usable = np.isfinite(path).all(axis=-1) & learned
    unusable = np.cumsum(~usable, axis=0)
    frames = np.arange(HISTORY, len(path) - 1)
    before = frames - PAST
    at, individual = np.nonzero(usable[before] & (unusable[frames + 1] == unusable[before]))
    rows = np.stack([frames[at], individual], axis=1)
    return rows[np.lexsort((rows[:, 0], rows[:, 1]))]


def some_blocks(rows: np.ndarray, share: float, rng: np.random.Generator) -> np.ndarray:
    """Return a share of the rows, in blocks that were recorded one after the other."""
    if share >= 1:
        return rows
    blocks = np.arange(len(rows)) // BLOCK_STEPS
    count = math.ceil(share * (blocks[-1] + 1))
    chosen = rng.choice(blocks[-1] + 1, size=count, replace=False)
    return rows[np.isin(blocks, chosen)]


def recorded(
    path: np.ndarray, learned_path: np.ndarray, memories: np.ndarray, rows: np.ndarray, tanks: Tanks, tank: int,
    units: Units, interval_s: float, gone: np.ndarray, goals: np.ndarray,
) -> Recorded:  # fmt: skip
    """Return what was perceived and done at these frames and individuals of a recording.

    `gone` (A,) are the frames from which on individuals are gone for good, and `goals` (A, 2) where they go.

    What came of it is taken from `learned_path`, which is NaN where nothing may be learned.
    """
    count = len(rows)
    own_inputs = np.zeros((count, OWN))
    traits = np.zeros((count, MOST_OTHERS, TRAITS), dtype=np.float32)
    others_seen = np.zeros(count, dtype=np.int64)
    answers = np.zeros((count, 2))
    perceive(
        path, memories, goals, rows, tanks, tank, units, own_inputs, traits, others_seen, answers
    )  # fmt: skip
    follows = np.zeros(count, dtype=bool)
    follows[:-1] = (np.diff(rows, axis=0) == (1, 0)).all(axis=1)
    then = np.where(follows, np.arange(1, count + 1), -1)
    outcomes, ahead = _outcomes(learned_path, rows, answers, tanks, tank, interval_s)
    frame, individual = rows.T
    moved = np.linalg.norm(path[frame, individual] - path[frame - PAST, individual], axis=1) / PAST
    # of those who have a goal, memories are how fast they are when they are fast
    brisk = np.isfinite(goals[individual, 0]) & (moved >= BRISK * memories[frame, individual, 0])
    return Recorded(
        own_inputs.astype(np.float32),
        traits,
        others_seen,
        answers,
        outcomes,
        ahead,
        then,
        frame + 2 == gone[individual],
        brisk,
        frame,
    )


def comings_and_goings(present: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first frame of individuals (A,), and the frame from which on they are gone; -1 where one was there always.

    `present` (F, A) tells where they are. None comes or goes unless there are many more individuals than ever at once:
    else it is the tracker who has lost them.
    """
    frames, individuals = present.shape
    nobody = np.full(individuals, -1)
    begin = present.argmax(axis=0)
    stop = frames - present[::-1].argmax(axis=0)
    at = np.arange(frames)[:, None]
    at_once = ((at >= begin) & (at < stop) & present.any(axis=0)).sum(axis=1).max()
    if individuals < TURNOVER * at_once:
        return nobody, nobody
    was_present = present.any(axis=0)
    comes = np.where(was_present & (begin > 0), begin, -1)
    goes = np.where(was_present & (stop < frames), stop, -1)
    return comes, goes


def last_places(path: np.ndarray, gone: np.ndarray) -> np.ndarray:
    """Return where individuals left (A, 2), by paths (F, A, 2) and the frames from which on they are gone, or NaN."""
    places = np.full(path.shape[1:], np.nan)
    leaving = np.flatnonzero(gone > 0)
    places[leaving] = path[gone[leaving] - 1, leaving]
    return places


def goals_of(path: np.ndarray, gone: np.ndarray, places: np.ndarray, beyond: float) -> np.ndarray:
    """Return where individuals go (A, 2): so far (cm) beyond their last places, as they went in the end; NaN if unknown."""
    goals = places.copy()
    for individual in np.flatnonzero(np.isfinite(goals[:, 0])):
        before = path[max(gone[individual] - 1 - HISTORY, 0) : gone[individual], individual]
        before = before[np.isfinite(before[:, 0])]
        way = before[-1] - before[0]
        length = np.hypot(*way)
        if length > 0:
            goals[individual] += way * (beyond / length)
    return goals


def with_borrowed(goals: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Return goals (A, 2) where whoever has none has that of another, whose first steps led to a place near by."""
    ahead = np.full_like(goals, np.nan)
    for newcomer, there in enumerate(np.isfinite(path[..., 0]).T):
        if there.any():
            first_places = path[there.argmax() : there.argmax() + PAST + 1, newcomer]
            first_places = first_places[np.isfinite(first_places[:, 0])]
            ahead[newcomer] = first_places[0] + BORROWED_STEPS * (
                first_places[-1] - first_places[0]
            )
    lenders = np.flatnonzero(np.isfinite(goals[:, 0]) & np.isfinite(ahead[:, 0]))
    if not len(lenders):
        return goals
    goals = goals.copy()
    for individual in np.flatnonzero(np.isnan(goals[:, 0]) & np.isfinite(ahead[:, 0])):
        distances = np.hypot(*(ahead[lenders] - ahead[individual]).T)
        goals[individual] = goals[lenders[distances.argmin()]]
    return goals


def joined(batches: Sequence[Recorded], frames: Sequence[int]) -> Recorded:
    """Return steps of several recordings, of so many frames, as one."""
    columns = {}
    for name in ("own", "traits", "seen", "answers", "outcomes", "ahead", "last", "brisk"):
        columns[name] = np.concatenate([getattr(batch, name) for batch in batches])
    first_row = np.cumsum([0, *(len(batch.then) for batch in batches)])
    first_frame = np.cumsum([0, *frames])
    then = [
        np.where(batch.then < 0, -1, batch.then + first_row[k]) for k, batch in enumerate(batches)
    ]
    stretch = [batch.stretch + first_frame[k] for k, batch in enumerate(batches)]
    return Recorded(**columns, then=np.concatenate(then), stretch=np.concatenate(stretch))


def horizon_steps(interval_s: float) -> np.ndarray:
    """Return after how many steps the times of `HORIZONS_S` are, each later than the one before."""
    steps = [0]
    for horizon in HORIZONS_S:
        steps.append(max(steps[-1] + 1, round(horizon / interval_s)))
    return np.array(steps[1:])


def _outcomes(
    path: np.ndarray, rows: np.ndarray, answers: np.ndarray, tanks: Tanks, tank: int, interval_s: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the outcomes (N, Q, 2) of steps, and where they led (N, AHEAD, 2)."""
    frame, individual = rows.T
    position = path[frame, individual]
    step = path[frame + 1, individual] - position
    course = np.arctan2(step[:, 1], step[:, 0]) - answers[:, 1]
    offset, has_neighbor = nearest_others(np.nan_to_num(path), np.isfinite(path).all(axis=-1))
    offset = np.where(has_neighbor[..., None], offset, np.nan)
    vectors = []
    neighbors = []
    wall = np.full_like(position, np.nan)
    for k, steps in enumerate(horizon_steps(interval_s)):
        later = frame + steps
        next_position = np.full_like(position, np.nan)
        inside = later < len(path)
        next_position[inside] = path[later[inside], individual[inside]]
        vectors.append(next_position - position)
        if k in OTHERS_AFTER:
            neighbor = np.full_like(position, np.nan)
            neighbor[inside] = offset[later[inside], individual[inside]]
            neighbors.append(neighbor)
        if k == WALL_AFTER and tanks.walls[tank]:
            wall = _to_wall(next_position, tanks, tank)
    turned = np.stack([*vectors, *neighbors, wall], axis=1)
    directions = np.arctan2(turned[..., 1], turned[..., 0]) - course[:, None]
    directions -= 2 * np.pi * np.floor((directions + np.pi) / (2 * np.pi))
    outcomes = np.stack([np.hypot(turned[..., 0], turned[..., 1]), directions], axis=-1)
    lengths, angles = outcomes[:, 1 : 1 + AHEAD, 0], outcomes[:, 1 : 1 + AHEAD, 1]
    ahead = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)], axis=-1)
    return outcomes, ahead


def _to_wall(positions: np.ndarray, tanks: Tanks, tank: int) -> np.ndarray:
    """Return the way to the nearest wall from places (N, 2), NaN where these are."""
    cells = np.floor((positions - tanks.corner[tank]) / tanks.cell[tank])
    shape = np.array(tanks.inside.shape[1:])
    columns, rows = np.clip(np.nan_to_num(cells).astype(int), 0, shape - 1).T
    distances = tanks.distance[tank, columns, rows]
    nearest = distances.argmin(axis=1)
    angles = nearest * (2 * np.pi / distances.shape[1])
    ways = distances.min(axis=1)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.where(np.isnan(positions), np.nan, ways)


def pieces_of(examples: Recorded, mirrored: Recorded, layers: Layers, seed: int) -> Pieces:
    """Return recorded steps, and the same in a mirror, sorted so that those of like contexts are found quickly."""
    from scipy.cluster.vq import kmeans2, vq

    count = len(examples.own)
    dimensions = layers.metric.shape[1]
    where = np.empty((2 * count, dimensions), dtype=np.float32)
    for k, side in enumerate((examples, mirrored)):
        contexts(side.own, side.traits, side.seen, layers, where[k * count : (k + 1) * count])
    rng = np.random.default_rng([seed, 47])
    cells = max(1, math.isqrt(2 * count))
    sample = where[
        rng.choice(2 * count, size=min(2 * count, CELL_POINTS * cells), replace=False)
    ].astype(float)
    with warnings.catch_warnings():
        # Of empty cells, which harm nobody
        warnings.simplefilter("ignore")
        centers, _ = kmeans2(sample, cells, iter=ROUNDS, minit="points", rng=rng)
    centers = centers[np.isfinite(centers).all(axis=1)].astype(np.float32)
    labels = vq(where, centers)[0]
    order = np.argsort(labels, kind="stable")
    place = np.argsort(order)
    then = np.concatenate([examples.then, np.where(examples.then < 0, -1, examples.then + count)])
    lengths, turns = examples.answers.T
    pieces = Pieces(
        context=np.ascontiguousarray(where[order].T),
        centers=np.ascontiguousarray(centers.T),
        begin=np.searchsorted(labels[order], np.arange(len(centers) + 1)),
        reach=np.zeros(2 * count, dtype=np.float32),
        brisk=np.concatenate([examples.brisk, examples.brisk])[order],
        then=np.where(then < 0, -1, place[then])[order].astype(np.int32),
        last=np.concatenate([examples.last, examples.last])[order],
        length=np.concatenate([lengths, lengths])[order],
        turn=np.concatenate([turns, -turns])[order],
        ahead=np.concatenate([examples.ahead, examples.ahead * (1, -1)])[order].astype(np.float32),
    )
    measure_reach(pieces)
    return pieces
