"""Networks of simulated pedestrians, put to the test: ``python pedestrians.py [SITUATION] [SEED ...]``.

People of a social-force model are recorded ten times in each of two situations: a corridor, and a bottleneck. Networks
learn from eight recordings. The other two have the same widths, but other people. Rows go to pedestrians.csv, and
networks to files beside it; what is there is not done again. The variants:

* *recorded*: the recordings themselves. The panel compares windows that were learned from with windows of the other two.
* *replay*: recorded people walk their way again, but begin at another moment, and mind nobody.
* *network*: what a network does that has learned with the usual settings.
* *one limit*: the same, but nobody follows a recorded piece for longer than those who are held up (decision 0051).
* *longer*: the same, but everybody follows pieces for as long as those who are not held up.
* *form of 0053*: what a network did before decision 0066, as in the rows *one limit* and *longer* of the bottleneck.
* *form of 0066*: what it did before decision 0075, as in the row *network* of the corridor, which is older still.

The extra `networks` has to be installed. A seed of both situations takes some twelve minutes of one processor.
"""

import sys
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.families import Network, virtual_group
from turing_learning.trajectories import Trajectories, pooled_windows

HERE = Path(__file__).parent
PATH = HERE / "pedestrians.csv"
RECORDINGS = 10
LEARNED = 8
"""Of them; the last two are held out."""
RECORDED_S = 100.0
WINDOW_S = 4.0
SIGNALS = ("speed", "turn", "neighbor_distance", "neighbor_bearing")
WINDOWS = {"length_s": WINDOW_S, "signals": SIGNALS}
TESTED = 160
"""Windows of either side of a test."""
BLOCK_S = 10.0
"""Windows of a recording that begin within so long (s) are of one group: they show the same people."""
FREE_S = 60.0
"""For so long (s) groups move from a recorded moment on."""
SPEED_S = 0.4
"""Time (s) over which speeds are measured, longer than a tracker's noise."""
VARIANTS = ("network", "one limit", "longer", "recorded", "replay")
NUMBERS = ("at_once", "at_once_last_third", "median_speed", "slowest_tenth", "leave_per_s")
"""People, in the last third of the time too; speeds in cm/s."""
FIELDS = ("situation", "seed", "variant", *NUMBERS, "accuracy", "p_value", "told_by")


class Situation(NamedTuple):
    """Where people walk, lengths in m."""

    fps: float  # of the recordings
    arrivals: float  # people per second
    both_ways: bool
    spread: float  # half of the width in which people arrive
    widths: tuple[float, ...]  # of each recording
    wide: float | None  # width before a bottleneck; None for a corridor


SITUATIONS = {
    "corridor": Situation(25.0, 1.5, True, 1.0, (3.0,) * RECORDINGS, None),
    "bottleneck": Situation(16.0, 1.6, False, 2.0, (0.9, 1.0, 1.1, 1.2, 1.3) * 2, 5.0),
}
SEEN = 4.5
"""Half of the length that the camera sees."""
FROM = 6.0
"""People arrive so far before its middle."""
UNTIL = 5.0
"""And have gone so far behind it."""
SUBSTEPS = 4
"""Steps of the forces for each frame."""
# D. Helbing, P. Molnar, Social force model for pedestrian dynamics, Physical Review E 51 (1995) 4282: form, desired
# speeds and relaxation. The forces are shorter than theirs, and of the strength with which the recorded density flows.
DESIRED = (1.34, 0.22)
"""Mean and standard deviation of the desired speeds (m/s)."""
LEAST_DESIRED = 0.8
FASTEST = 2.2
RELAXATION_S = 0.5
REPULSION = (3.0, 0.45, 0.28)
"""Of others: acceleration (m/s2) at a distance, that distance, and the distance over which it fades (m)."""
BEHIND = 0.2
"""Share of it that is felt of somebody behind."""
SIDESTEP = 0.6
"""Share of it with which whoever comes towards somebody steps to one side."""
WALL = (5.0, 0.2, 0.1)
"""The same of walls."""
MOST_FORCE = 20.0
"""m/s2"""
RESTLESS = 0.06
"""Standard deviation of the noise of the velocity (m/s) in a second."""
SWAY = (0.03, 0.9)
"""Of a head: amplitude (m) and frequency (1/s)."""
TRACKER = 0.006
"""Standard deviation of a tracker's mistakes (m)."""


def walls_of(situation: Situation, width: float) -> np.ndarray:
    """Return walls (W, 2, 2) from point to point."""
    side = width / 2
    if situation.wide is None:
        return np.array([[(-8, y), (8, y)] for y in (side, -side)])
    wide = situation.wide / 2
    walls = []
    for sign in (1, -1):
        walls.append([(-7, sign * wide), (0, sign * wide)])
        walls.append([(0, sign * wide), (0, sign * side)])
        walls.append([(0, sign * side), (6, sign * side)])
    return np.array(walls)


def to_walls(places: np.ndarray, walls: np.ndarray) -> np.ndarray:
    """Return the way (N, W, 2) from places (N, 2) to the nearest point of each wall."""
    begin = walls[:, 0]
    along = walls[:, 1] - begin
    share = ((places[:, None] - begin) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    return begin + np.clip(share, 0, 1)[..., None] * along - places[:, None]


def forces(
    places: np.ndarray,
    velocities: np.ndarray,
    directions: np.ndarray,
    desired: np.ndarray,
    walls: np.ndarray,
    width: float,
    bottleneck: bool,
) -> np.ndarray:
    """Return accelerations (N, 2) in m/s2 of people at places, with velocities (N, 2), who want to go so fast (N,)."""
    target = np.stack([8.0 * directions, places[:, 1]], axis=1)
    if bottleneck:
        before = places[:, 0] < -0.1
        door = width / 2 - 0.25
        target[before, 0] = 0.3
        target[before, 1] = np.clip(places[before, 1], -door, door)
    way = target - places
    way /= np.linalg.norm(way, axis=1, keepdims=True) + 1e-9
    total = (desired[:, None] * way - velocities) / RELAXATION_S
    # of others
    apart = places[:, None] - places
    distance = np.linalg.norm(apart, axis=-1) + 1e-6
    away = apart / distance[..., None]
    speed = np.linalg.norm(velocities, axis=1) + 1e-6
    ahead = -(away * velocities[:, None]).sum(axis=-1) / speed[:, None]
    strength, range_m, fading = REPULSION
    force = strength * np.exp((range_m - distance) / fading)
    force *= BEHIND + (1 - BEHIND) * (1 + ahead) / 2
    force[distance > 3.0] = 0.0
    np.fill_diagonal(force, 0.0)
    total += (force[..., None] * away).sum(axis=1)
    meeting = force * (directions[:, None] != directions) * (ahead > 0.7) * SIDESTEP
    aside = np.stack([away[..., 1], -away[..., 0]], axis=-1)
    total += (meeting[..., None] * aside).sum(axis=1)
    # of walls
    to_wall = to_walls(places, walls)
    distance = np.linalg.norm(to_wall, axis=-1) + 1e-6
    strength, range_m, fading = WALL
    force = strength * np.exp((range_m - distance) / fading)
    total -= (force[..., None] * to_wall / distance[..., None]).sum(axis=1)
    return total


def shortened(vectors: np.ndarray, longest: float) -> np.ndarray:
    """Return vectors (N, 2), those that are longer at this length."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(lengths, 1e-9))


@cache
def recorded(name: str, number: int) -> Trajectories:
    """Return what a camera and a tracker make of people who walk, in cm."""
    situation = SITUATIONS[name]
    rng = np.random.default_rng([500, number, *name.encode()])
    width = situation.widths[number]
    walls = walls_of(situation, width)
    frames = round(RECORDED_S * situation.fps)
    step_s = 1 / (situation.fps * SUBSTEPS)
    places = np.zeros((0, 2))
    velocities = np.zeros((0, 2))
    directions = np.zeros(0)
    desired = np.zeros(0)
    who = np.zeros(0, dtype=int)
    phases = rng.uniform(0, 2 * np.pi, 1000)
    seen: list[dict[int, np.ndarray]] = []
    arrived = 0
    next_arrival_s = 0.0
    for step in range(frames * SUBSTEPS):
        now_s = step * step_s
        if now_s >= next_arrival_s:
            direction = -1.0 if situation.both_ways and rng.random() < 0.5 else 1.0
            begin = np.array([-FROM * direction, rng.uniform(-situation.spread, situation.spread)])
            if (np.linalg.norm(places - begin, axis=1) > 0.6).all():
                wish = max(LEAST_DESIRED, rng.normal(*DESIRED))
                places = np.append(places, [begin], axis=0)
                velocities = np.append(velocities, [[direction * wish, 0.0]], axis=0)
                directions = np.append(directions, direction)
                desired = np.append(desired, wish)
                who = np.append(who, arrived)
                arrived += 1
                next_arrival_s = now_s + rng.exponential(1 / situation.arrivals)
        bottleneck = situation.wide is not None
        force = forces(places, velocities, directions, desired, walls, width, bottleneck)
        force += rng.normal(0, RESTLESS, force.shape) / np.sqrt(step_s)
        velocities = shortened(velocities + shortened(force, MOST_FORCE) * step_s, FASTEST)
        places = places + velocities * step_s
        still_there = places[:, 0] * directions <= UNTIL
        places, velocities = places[still_there], velocities[still_there]
        directions, desired, who = (values[still_there] for values in (directions, desired, who))
        if step % SUBSTEPS == 0:
            amplitude, frequency = SWAY
            sway = amplitude * np.sin(2 * np.pi * frequency * now_s + phases[who])
            side = np.stack([-velocities[:, 1], velocities[:, 0]], axis=1)
            side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-6
            heads = places + sway[:, None] * side
            visible = np.abs(places[:, 0]) < SEEN
            seen.append(dict(zip(who[visible].tolist(), heads[visible], strict=True)))
    positions = np.zeros((frames, arrived, 2))
    present = np.zeros((frames, arrived), dtype=bool)
    for frame, heads_seen in enumerate(seen):
        for person, head in heads_seen.items():
            positions[frame, person] = head
            present[frame, person] = True
    positions += rng.normal(0, TRACKER, positions.shape)
    # of two frames nobody can say how somebody moves
    kept = present.sum(axis=0) > 2
    positions, present = positions[:, kept] * 100, present[:, kept]
    names = tuple(f"{k + 1:03}" for k in range(kept.sum()))
    return Trajectories(
        np.where(present[..., None], positions, 0.0), present, fps=situation.fps, individuals=names
    )


def described(paths: np.ndarray, fps: float) -> np.ndarray:
    """Return `NUMBERS` of groups that move (F, A, 2), NaN where nobody is."""
    present = np.isfinite(paths[..., 0])
    steps = round(SPEED_S * fps)
    speeds = np.linalg.norm(paths[steps:] - paths[:-steps], axis=-1) / SPEED_S
    speeds = speeds[np.isfinite(speeds)]
    at_once = present.sum(axis=1)
    left = (present[:-1] & ~present[1:]).sum()
    return np.array([
        at_once.mean(), at_once[-len(at_once) // 3 :].mean(), np.median(speeds), np.quantile(speeds, 0.1),
        left * fps / len(paths),
    ])  # fmt: skip


def absent_as_nan(recording: Trajectories) -> np.ndarray:
    """Return where everybody is (F, A, 2), NaN where nobody is."""
    return np.where(recording.present[..., None], recording.positions, np.nan)


def replayed(recording: Trajectories, rng: np.random.Generator) -> Trajectories:
    """Return a recording whose people walk the same ways, but begin at other moments; its end comes before its begin."""
    frames = len(recording.positions)
    positions = np.zeros_like(recording.positions)
    present = np.zeros_like(recording.present)
    for person in range(recording.positions.shape[1]):
        at = np.flatnonzero(recording.present[:, person])
        later = at + int(rng.integers(frames))
        # whoever would walk across the end does not walk: it would leave and come in the middle
        if later[0] // frames == later[-1] // frames:
            positions[later % frames, person] = recording.positions[at, person]
            present[later % frames, person] = True
    some = present.any(axis=0)
    names = tuple(name for name, kept in zip(recording.individuals, some, strict=True) if kept)
    return replace(
        recording, positions=positions[:, some], present=present[:, some], individuals=names
    )


def late_start(network: Network, tank: int, frames: int) -> tuple[Network, int]:
    """Return a network whose groups start in one recording, at the last moment with so many frames behind it."""
    starts = network.brain.starts
    possible = (starts.tank == tank) & (starts.at < round(RECORDED_S * network.fps) - frames)
    moment = int(np.where(possible, starts.at, -1).argmax())
    one = {name: values[moment : moment + 1] for name, values in starts._asdict().items()}
    brain = network.brain._replace(starts=starts._replace(**one))
    return replace(network, brain=brain, settling_steps=0), int(starts.at[moment])


class Shown(NamedTuple):
    """Windows that are tested against others, and their groups."""

    windows: np.ndarray
    groups: np.ndarray


def some_windows(recordings: list[Trajectories], seed: int) -> Shown:
    """Return windows of recordings, drawn by chance."""
    windows = pooled_windows(recordings, hold_out=0.0, **WINDOWS)
    chosen = np.random.default_rng([seed, 3]).permutation(len(windows.learning))[:TESTED]
    block = windows.learning_index[chosen, 1] // round(BLOCK_S * recordings[0].fps)
    return Shown(windows.learning[chosen], windows.learning_recording[chosen] * 1000 + block)


def network_of(name: str, seed: int) -> Network:
    """Return a network that has learned from eight recordings, from its file where there is one."""
    path = HERE / f"{name}-{seed}.safetensors"
    if not path.exists():
        recordings = [recorded(name, number) for number in range(LEARNED)]
        windows = pooled_windows(recordings, hold_out=0.0, **WINDOWS)
        Network.learned(recordings, windows, seed=seed).save(path)
    return Network.load(path)


def moved(network: Network, name: str, seed: int) -> tuple[list[np.ndarray], Shown]:
    """Return how groups go on from a late moment of each recording, and samples to test."""
    fps = SITUATIONS[name].fps
    gains = dict.fromkeys(network.parameters, 1.0)
    groups = []
    for number in range(LEARNED):
        started, _ = late_start(network, number, round(FREE_S * fps))
        group = virtual_group(started, gains, duration_s=FREE_S, seed=10 * seed + number)
        groups.append(absent_as_nan(group))
    values = np.ones((TESTED, len(gains)))
    samples = network(values, np.random.default_rng([seed, 5]))[:, 0]
    return groups, Shown(samples, np.arange(TESTED))


def shown(variant: str, name: str, seed: int) -> tuple[list[np.ndarray], Shown]:
    """Return groups (F, A, 2) of a variant, and windows to test."""
    network = network_of(name, seed)
    pieces = network.brain.pieces
    if variant == "network":
        return moved(network, name, seed)
    if variant in ("one limit", "longer"):
        all_alike = pieces._replace(brisk=np.full_like(pieces.brisk, variant == "longer"))
        other = replace(network, brain=network.brain._replace(pieces=all_alike))
        return moved(other, name, seed)
    recordings = [recorded(name, number) for number in range(LEARNED)]
    frames = round(FREE_S * recordings[0].fps)
    if variant == "replay":
        rng = np.random.default_rng([seed, 4])
        recordings = [replayed(recording, rng) for recording in recordings]
    groups = []
    for number, recording in enumerate(recordings):
        _, at = late_start(network, number, frames)
        groups.append(absent_as_nan(recording)[at : at + frames])
    return groups, some_windows(recordings, seed)


def row(variant: str, name: str, seed: int) -> dict[str, object]:
    """Return what a variant does from the same moments on as the others, and by what it is told."""
    groups, windows = shown(variant, name, seed)
    numbers = np.mean([described(group, SITUATIONS[name].fps) for group in groups], axis=0)
    held_out = some_windows([recorded(name, number) for number in range(LEARNED, RECORDINGS)], seed)
    test = tl.test(
        held_out.windows,
        windows.windows,
        groups=(held_out.groups, windows.groups),
        names=SIGNALS,
        seed=seed,
    )
    statistic = next(cue for cue in test.telling if cue.kind == "statistic")
    return {
        "situation": name, "seed": seed, "variant": variant,
        **{field: f"{value:.3g}" for field, value in zip(NUMBERS, numbers, strict=True)},
        "accuracy": f"{test.accuracy:.3f}", "p_value": f"{test.p_value:.3f}",
        "told_by": f"{statistic.what}: {statistic.words}",
    }  # fmt: skip


def main() -> None:
    """Write the rows that are missing."""
    arguments = sys.argv[1:]
    names = [word for word in arguments if word in SITUATIONS] or list(SITUATIONS)
    seeds = [int(word) for word in arguments if word not in SITUATIONS] or [1, 2]
    done = keys_done(PATH, ("situation", "seed", "variant"))
    for seed, name, variant in product(seeds, names, VARIANTS):
        if (name, str(seed), variant) in done:
            continue
        added = row(variant, name, seed)
        append_rows(PATH, FIELDS, [added])


if __name__ == "__main__":
    main()
