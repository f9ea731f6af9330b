"""What can hardly be true of a recording as a whole: its rate, its speeds, its extent, who is there for a moment."""

import numpy as np

from ._recording import thinning
from ._signals import lives_of

LEAST_RATE, MOST_RATE = 1.0, 2000.0
"""Frame rates (1/s) of most videos; beyond them times are often in another unit than s."""
FASTEST_CM_S = 1e4
"""Typical speed (cm/s) that no animal has: a falcon dives at 100 m/s."""
USUAL_SHARE = 0.999
"""Share of the positions that says where individuals usually are."""
LARGER = 2.0
"""A tank is doubted whose side is so many times as long as where individuals usually are."""
MOMENT_FRAMES = 5
"""Frames up to which an individual is there for a moment."""
LONG = 100
"""Frames of a recording from which on moments are short."""

WHITE = -0.5
"""Correlation of successive changes of a step, below which these are noise.

Of white noise of positions it is -0.6, of the zebrafish and termites of the tests -0.16 to -0.27.
"""
NOISY_TURN = 0.25
"""Spread (rad) of the turns that noise alone makes, from which on it is worth a word."""
FAINT_TURN = 0.12
"""The same where it hardly counts: as many frames are left out as bring it there."""
USUAL_CHANGES = 0.95
"""Share of the changes of steps that tell noise, the smaller ones."""
FADING = 0.75
"""Where every second frame is kept, turns that noise makes are smaller by this factor at least.

Those that animals make are not.
"""


def implausible(
    positions: np.ndarray,
    likely: np.ndarray,
    steps: np.ndarray,
    *,
    fps: float,
    unit: str,
    names: tuple[str, ...],
) -> list[str]:
    """Return in words what can hardly be true.

    Parameters
    ----------
    positions : (F, A, 2)
        In `unit`.
    likely : (F, A)
        Where they are there and can be true.
    steps : (S,)
        Lengths of steps between neighboring frames, without those that are not to be believed.
    fps
        Frame rate (1/s).
    unit
        Of lengths, "cm" or "px".
    names
        Of the individuals (A,).
    """
    doubts = []
    if not LEAST_RATE <= fps <= MOST_RATE:
        doubts.append(
            f"a frame rate of {fps:g} per second: see whether times are in s, and whether all frames are there"
        )
    typical = float(np.median(steps)) if len(steps) else 0.0
    if len(steps) >= LONG and typical == 0:
        doubts.append(
            "half of all steps or more are 0: individuals rest, or positions are repeated or rounded"
        )
    if unit == "cm" and typical * fps > FASTEST_CM_S:
        speed = f"a typical speed of {typical * fps:.3g} cm/s, {typical * fps / 1e5:.2g} km/s"
        doubts.append(f"{speed}: see scale and frame rate")
    # One wrong position makes a tank of kilometres, in which nobody meets a wall
    visited = positions[likely]
    if len(visited) >= LONG:
        extent = np.ptp(visited, axis=0)
        usual = np.diff(np.quantile(visited, [1 - USUAL_SHARE, USUAL_SHARE], axis=0), axis=0)[0]
        if (extent > LARGER * usual).any() and (usual > 0).all():
            tank = f"positions reach over {extent[0]:.4g} x {extent[1]:.4g} {unit}"
            doubts.append(
                f"{tank}, and 99.9 % of them over {usual[0]:.4g} x {usual[1]:.4g}: give the tank"
            )
    # Turns that are noise are large, uncorrelated, and fade at a lower frame rate
    noise, turn, correlation = _noise_of_turns(positions, likely)
    if turn > NOISY_TURN and correlation < WHITE:
        _, thinned_turn, _ = _noise_of_turns(positions[::2], likely[::2])
        if thinned_turn < FADING * turn:
            every = int(np.ceil(turn / FAINT_TURN))
            doubts.append(
                f"the tracker's noise, about {noise:.2g} {unit}, makes turns of {turn:.2g} rad from "
                f"frame to frame: keep one frame in {every} by {thinning(every)}, or smooth"
            )
    # Uneven times leave most frames without a row
    gaps = int((lives_of(likely) & ~likely).sum())
    if likely.sum() >= LONG and gaps > likely.sum():
        share = gaps / (gaps + likely.sum())
        doubts.append(
            f"{share:.0%} of the positions are missing between first and last ones: if times are uneven, resample them"
        )
    # Tracks of a few frames are rests of broken ones, or no individuals at all
    lives = likely.sum(axis=0)
    moments = [name for name, count in zip(names, lives, strict=True) if 0 < count <= MOMENT_FRAMES]
    if moments and len(positions) >= LONG:
        listed = ", ".join(moments[:MOMENT_FRAMES]) + (
            ", ..." if len(moments) > MOMENT_FRAMES else ""
        )
        doubts.append(
            f"{len(moments)} of {len(names)} individuals are there for {MOMENT_FRAMES} frames or fewer: {listed}"
        )
    return doubts


def _noise_of_turns(positions: np.ndarray, present: np.ndarray) -> tuple[float, float, float]:
    """Return the noise of positions (F, A, 2), the turns that it makes (rad), and a correlation.

    This is the correlation of successive changes of a step. It says whether these are noise at all.
    Noise of a standard deviation s in x and y gives both parts of a change a variance of 6 s^2.
    """
    changes = np.diff(positions, n=2, axis=0)
    certain = present[2:] & present[1:-1] & present[:-2]
    moved = present[1:] & present[:-1]
    in_a_row = certain[1:] & certain[:-1]
    if in_a_row.sum() < LONG:
        return 0.0, 0.0, 0.0
    sizes = np.hypot(*np.moveaxis(changes, -1, 0))
    # bounces and mistaken identities are few, and large
    usual = sizes <= np.quantile(sizes[certain], USUAL_CHANGES)
    in_a_row &= usual[1:] & usual[:-1]
    first = changes[:-1][in_a_row]
    second = changes[1:][in_a_row]
    # of a two-dimensional normal distribution the median square is 2 ln 2 variances of one part
    variance = np.median((changes[certain] ** 2).sum(axis=1)) / (2 * np.log(2))
    step = np.median(np.hypot(*np.diff(positions, axis=0)[moved].T))
    squares = np.sqrt((first**2).sum() * (second**2).sum())
    if not step or not squares:
        return 0.0, 0.0, 0.0
    return np.sqrt(variance / 6), np.sqrt(variance) / step, (first * second).sum() / squares
