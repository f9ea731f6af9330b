"""What can hardly be true of a recording as a whole: its rate, its speeds, its extent, who is there for a moment."""

import numpy as np

LEAST_RATE, MOST_RATE = 1.0, 2000.0
"""Frame rates (1/s) of most videos; beyond them times are often in another unit than s."""
FASTEST_CM_S = 1e4
"""Typical speed (cm/s) that no animal has: a falcon dives at 100 m/s."""
USUAL_SHARE = 0.999
"""Share of the positions that says where individuals usually are."""
LARGER = 2.0
"""A tank is doubted whose side is so many times as long as where individuals usually are."""
SHORTEST = 5
"""Frames up to which an individual is there for a moment."""
LONG = 100
"""Frames of a recording from which on moments are short."""


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
    visited = positions[likely]
    if len(visited) >= LONG:
        extent = np.ptp(visited, axis=0)
        usual = np.diff(np.quantile(visited, [1 - USUAL_SHARE, USUAL_SHARE], axis=0), axis=0)[0]
        if (extent > LARGER * usual).any() and (usual > 0).all():
            tank = f"positions reach over {extent[0]:.4g} x {extent[1]:.4g} {unit}"
            doubts.append(
                f"{tank}, and 99.9 % of them over {usual[0]:.4g} x {usual[1]:.4g}: give the tank"
            )
    gaps = _gaps_between(likely)
    if likely.sum() >= LONG and gaps > likely.sum():
        share = gaps / (gaps + likely.sum())
        doubts.append(
            f"{share:.0%} of the positions are missing between first and last ones: if times are uneven, resample them"
        )
    lives = likely.sum(axis=0)
    moments = [name for name, count in zip(names, lives, strict=True) if 0 < count <= SHORTEST]
    if moments and len(positions) >= LONG:
        listed = ", ".join(moments[:SHORTEST]) + (", ..." if len(moments) > SHORTEST else "")
        doubts.append(
            f"{len(moments)} of {len(names)} individuals are there for {SHORTEST} frames or fewer: {listed}"
        )
    return doubts


def _gaps_between(present: np.ndarray) -> int:
    """Return how many positions (F, A) are missing between the first and the last one of individuals."""
    begun = np.maximum.accumulate(present, axis=0)
    ending = np.maximum.accumulate(present[::-1], axis=0)[::-1]
    return int((begun & ending & ~present).sum())
