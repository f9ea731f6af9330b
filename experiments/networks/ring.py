"""Networks of simulated fish in a ring-shaped tank, put to the test: ``python ring.py [SEED ...]``.

Ten groups of five fish are recorded for some minutes each between two round walls. Networks learn from eight
recordings with the usual settings; the other two are examined. Rows go to ring.csv, and networks to files beside it;
what is there is not done again. The variants:

* *recorded*: the panel compares the eight recordings with the other two.
* *network*: what a network does that has learned from the eight.
* *form of 0053*, *form of 0054*, *form of 0066*: the same before decisions 0054, 0057 and 0075. The code of these forms
  is not there any more. They were examined by the panel before decision 0073.

The extra `networks` has to be installed.
"""

import sys
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from table import append_rows, keys_done

import turing_learning as tl
from turing_learning.families import Network, virtual_group
from turing_learning.trajectories import Trajectories, pooled_windows

HERE = Path(__file__).parent
PATH = HERE / "ring.csv"
RECORDINGS = 10
LEARNED = 8
"""Of them; the last two are examined."""
RECORDED_S = 200.0
FPS = 15.0
FISH = 5
RADII = (19.0, 29.0)
"""Of the inner and the outer wall (cm)."""
WINDOW_S = 4.0
"""As of the command."""
SIGNALS = ("speed", "turn", "neighbor_distance", "neighbor_bearing")
TESTED = 240
"""Windows of either side of a test."""
BLOCK_S = 20.0
"""Windows of a recording that begin within so long (s) are of one group."""
FREE_S = 60.0
"""For so long (s) groups move whose numbers are in the table."""
NUMBERS = ("median_speed", "radius", "at_walls", "nearest", "around")
"""cm/s; median distance from the center (cm); share of the time within 1 cm of a wall; median distance of the nearest
other (cm); share of the time in which most swim the same way around."""
FIELDS = ("seed", "variant", *NUMBERS, "accuracy", "low", "high", "p_value", "told_by")
STEP_S = 1 / 120
# P. P. Klamser, P. Romanczuk, Collective predator evasion: Putting the criticality hypothesis to the test, PLoS
# Computational Biology 17 (2021) e1008832: bursts of a force that begin at random moments, friction, turning by the
# force across, three zones of others, and a burst that does not lead out of the tank. Values and the ring are our own.
FRICTION = 1.6
"""1/s"""
FORCE = 90.0
"""Of a burst (cm/s2)."""
BURST_S = 0.12
BURSTS = 2.2
"""A second."""
TURNING = 3.0
"""How much more easily a fish turns than it becomes faster."""
SOCIAL = 0.6
"""Share of the bursts that answer others; the others are to somewhere ahead."""
ZONES = (1.0, 8.0, 25.0)
"""Of repulsion, alignment and attraction (cm)."""
SPREAD = 0.45
"""Standard deviation of the direction of other bursts (rad)."""
MARGIN = 0.8
"""Distance that a burst keeps from the walls (cm)."""
DIFFERENCES = {"force": 0.2, "bursts": 0.2, "social": 0.25, "spread": 0.25}
"""Standard deviation, among fish, of the logarithm of each."""
TRACKER = 0.04
"""Standard deviation of a tracker's mistakes (cm)."""
LOST = 0.001
"""Chance of a fish that the tracker loses it in a frame, for one to four frames."""


def direction_to_others(places: np.ndarray, headings: np.ndarray, fish: int) -> np.ndarray:
    """Return the sum (2,) of what those of the nearest occupied zones ask of a fish; zero if nobody is near."""
    way = np.delete(places - places[fish], fish, axis=0)
    distance = np.linalg.norm(way, axis=1)
    way /= distance[:, None] + 1e-9
    others = np.delete(headings, fish)
    near, middle, far = ZONES
    if (distance < near).any():
        return -way[distance < near].sum(axis=0)
    aligned = others[distance < middle]
    asked = np.array([np.cos(aligned).sum(), np.sin(aligned).sum()])
    return asked + way[(distance >= middle) & (distance < far)].sum(axis=0)


def inside(place: np.ndarray) -> bool:
    """Whether a place keeps the margin from both walls."""
    inner, outer = RADII
    return bool(inner + MARGIN < np.hypot(*place) < outer - MARGIN)


def within_tank(
    place: np.ndarray, velocity: np.ndarray, angle: float, force: float, until_s: float
) -> float:
    """Return the direction nearest to `angle` (rad) in which a burst does not lead out of the tank."""
    drift = (1 - np.exp(-FRICTION * until_s)) / FRICTION
    for off in np.linspace(0, np.pi, 25):
        for sign in (1, -1):
            tried = angle + sign * off
            push = force * BURST_S * np.array([np.cos(tried), np.sin(tried)])
            if inside(place + (velocity + push) * drift):
                return tried
    return angle + np.pi


@cache
def recorded(number: int) -> Trajectories:
    """Return what a camera and a tracker make of a group, in cm."""
    rng = np.random.default_rng([600, number])
    inner, outer = RADII
    own = {name: np.exp(rng.normal(0, spread, FISH)) for name, spread in DIFFERENCES.items()}
    force, rate = FORCE * own["force"], BURSTS * own["bursts"]
    social, spread = np.minimum(SOCIAL * own["social"], 0.95), SPREAD * own["spread"]
    around = rng.uniform(0, 2 * np.pi) + rng.uniform(0, 0.5, FISH)
    radius = rng.uniform(inner + 2, outer - 2, FISH)
    places = radius[:, None] * np.stack([np.cos(around), np.sin(around)], axis=1)
    headings = around + np.pi / 2 * rng.choice([-1, 1])
    speeds = np.full(FISH, 8.0)
    next_s = rng.exponential(1 / BURSTS, FISH)
    stops_s = np.zeros(FISH)
    pushed = np.zeros((FISH, 2))
    frames = round(RECORDED_S * FPS)
    every = round(1 / (FPS * STEP_S))
    settled = round(20 / STEP_S)
    seen = np.empty((frames, FISH, 2))
    for step in range(-settled, frames * every):
        if step >= 0 and step % every == 0:
            seen[step // every] = places
        now_s = (step + settled) * STEP_S
        for fish in np.flatnonzero(now_s >= next_s):
            waits = BURST_S + rng.exponential(1 / rate[fish])
            next_s[fish] = now_s + waits
            stops_s[fish] = now_s + BURST_S
            angle = headings[fish] + rng.normal(0, spread[fish])
            if rng.random() < social[fish]:
                asked = direction_to_others(places, headings, fish)
                if asked.any():
                    angle = np.arctan2(asked[1], asked[0])
            velocity = speeds[fish] * np.array([np.cos(headings[fish]), np.sin(headings[fish])])
            angle = within_tank(places[fish], velocity, angle, force[fish], waits)
            pushed[fish] = force[fish] * np.array([np.cos(angle), np.sin(angle)])
        acting = np.where((now_s < stops_s)[:, None], pushed, 0.0)
        cosine, sine = np.cos(headings), np.sin(headings)
        along = acting[:, 0] * cosine + acting[:, 1] * sine
        across = acting[:, 1] * cosine - acting[:, 0] * sine
        speeds = np.maximum(speeds + (along - FRICTION * speeds) * STEP_S, 0.3)
        wanted = np.arctan2(across, along)
        turn = TURNING * across * STEP_S / speeds
        headings = headings + np.sign(turn) * np.minimum(np.abs(turn), np.abs(wanted))
        places = places + speeds[:, None] * STEP_S * np.stack(
            [np.cos(headings), np.sin(headings)], axis=1
        )
        distance = np.hypot(*places.T)
        for fish in np.flatnonzero((distance < inner) | (distance > outer)):
            # what leads into the wall is lost, and the fish goes on along it
            outward = places[fish] / distance[fish]
            along_wall = np.array([-outward[1], outward[0]])
            share = np.cos(headings[fish]) * along_wall[0] + np.sin(headings[fish]) * along_wall[1]
            along_wall *= np.sign(share)
            places[fish] = outward * np.clip(distance[fish], inner, outer)
            headings[fish] = np.arctan2(along_wall[1], along_wall[0])
            speeds[fish] *= abs(share)
    seen += rng.normal(0, TRACKER, seen.shape)
    present = np.ones((frames, FISH), dtype=bool)
    for frame, fish in np.argwhere(rng.random((frames, FISH)) < LOST):
        present[frame : frame + int(rng.integers(1, 5)), fish] = False
    names = tuple(f"{k + 1}" for k in range(FISH))
    return Trajectories(
        np.where(present[..., None], seen, 0.0), present, fps=FPS, individuals=names
    )


def described(recordings: list[Trajectories]) -> list[float]:
    """Return `NUMBERS` of recordings."""
    speeds, radii, nearest, same_way = [], [], [], []
    for recording in recordings:
        path = np.where(recording.present[..., None], recording.positions, np.nan)
        speeds.append(np.linalg.norm(np.diff(path, axis=0), axis=-1).ravel() * FPS)
        radii.append(np.hypot(path[..., 0], path[..., 1]).ravel())
        apart = np.linalg.norm(path[:, :, None] - path[:, None], axis=-1)
        apart[:, range(FISH), range(FISH)] = np.nan
        nearest.append(np.nanmin(apart, axis=2).ravel())
        second = round(FPS)
        angle = np.arctan2(path[..., 1], path[..., 0])
        around = np.sin(angle[second:] - angle[:-second])
        same_way.append(np.abs(np.nanmean(np.sign(around), axis=1)))
    speed, radius, near, same = (
        np.concatenate(values) for values in (speeds, radii, nearest, same_way)
    )
    radius = radius[np.isfinite(radius)]
    at_walls = (radius < RADII[0] + 1) | (radius > RADII[1] - 1)
    return [
        float(np.nanmedian(speed)), float(np.median(radius)), float(at_walls.mean()),
        float(np.nanmedian(near)), float(np.nanmean(same)),
    ]  # fmt: skip


def some_windows(recordings: list[Trajectories], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return windows of recordings, drawn by chance, and the groups that they are of."""
    windows = pooled_windows(recordings, hold_out=0.0, length_s=WINDOW_S, signals=SIGNALS)
    chosen = np.random.default_rng([seed, 3]).permutation(len(windows.learning))[:TESTED]
    block = windows.learning_index[chosen, 1] // round(BLOCK_S * FPS)
    return windows.learning[chosen], windows.learning_recording[chosen] * 1000 + block


def network_of(seed: int) -> Network:
    """Return a network that has learned from eight recordings, from its file where there is one."""
    path = HERE / f"ring-{seed}.safetensors"
    if not path.exists():
        recordings = [recorded(number) for number in range(LEARNED)]
        windows = pooled_windows(recordings, hold_out=0.0, length_s=WINDOW_S, signals=SIGNALS)
        Network.learned(recordings, windows, seed=seed).save(path)
    return Network.load(path)


def row(variant: str, seed: int) -> dict[str, object]:
    """Return what a variant does, and by what it is told."""
    examined = [recorded(number) for number in range(LEARNED, RECORDINGS)]
    if variant == "recorded":
        groups = [recorded(number) for number in range(LEARNED)]
        windows, owners = some_windows(groups, seed)
    else:
        network = network_of(seed)
        gains = dict.fromkeys(network.parameters, 1.0)
        groups = [
            virtual_group(network, gains, duration_s=FREE_S, seed=10 * seed + k)
            for k in range(LEARNED)
        ]
        values = np.ones((TESTED, len(gains)))
        windows = network(values, np.random.default_rng([seed, 5]))[:, 0]
        owners = np.arange(TESTED)
    real, real_owners = some_windows(examined, seed)
    test = tl.test(real, windows, groups=(real_owners, owners), names=SIGNALS, seed=seed)
    low, high = test.examined.interval
    statistic = next(cue for cue in test.telling if cue.kind == "statistic")
    return {
        "seed": seed, "variant": variant,
        **{name: f"{value:.3g}" for name, value in zip(NUMBERS, described(groups), strict=True)},
        "accuracy": f"{test.accuracy:.3f}", "low": f"{low:.3f}", "high": f"{high:.3f}",
        "p_value": f"{test.p_value:.3f}", "told_by": f"{statistic.what}: {statistic.words}",
    }  # fmt: skip


def main() -> None:
    """Write the rows that are missing."""
    done = keys_done(PATH, ("seed", "variant"))
    for seed, variant in product(map(int, sys.argv[1:] or ["1"]), ("recorded", "network")):
        if (str(seed), variant) in done:
            continue
        added = row(variant, seed)
        append_rows(PATH, FIELDS, [added])


if __name__ == "__main__":
    main()
