"""Whether headings can be what they are taken for: rad, of the head."""

import math

import numpy as np

from ._stretches import wrap

BACKWARDS = 0.25
"""Share of steps against the heading from which on headings are doubted: where they are right it is close to 0, where they are
in other units or another sense of rotation a half, and of the tail 1. Some robots and animals do drive backwards."""
BEYOND = 0.75
"""Share of headings beyond 2 pi from which on they may be in degrees, of which 97 % are where all directions are as frequent."""
LEAPS = 0.01
"""Share of changes of more than pi from which on headings beyond 2 pi may be in degrees; those in rad are beyond 2 pi where they
are counted on from turn to turn, and then never change by so much."""


def doubt_headings(positions: np.ndarray, present: np.ndarray, headings: np.ndarray) -> tuple[str, ...]:
    """Return in words why headings (F, A) of positions (F, A, 2) may not be in rad or not of the head."""
    both = present[1:] & present[:-1]
    if not both.any():
        return ()
    changes = np.abs(np.diff(headings, axis=0))[both]
    beyond, leaps = (np.abs(headings[present]) > 2 * math.pi).mean(), (changes > math.pi).mean()
    if beyond > BEYOND and leaps > LEAPS:
        return (
            f"headings may be in degrees: {beyond:.0%} are beyond 2 pi, and {leaps:.0%} of their changes between frames are of "
            "more than pi; they are taken as rad",
        )
    step = np.diff(positions, axis=0)[both]
    length = np.hypot(step[:, 0], step[:, 1])
    if not length.any():
        return ()
    long = length >= np.median(length[length > 0])
    away = np.abs(wrap(np.arctan2(step[:, 1], step[:, 0]) - headings[:-1][both]))[long]
    backwards = (away > math.pi / 2).mean()
    if backwards <= BACKWARDS:
        return ()
    return (
        f"{backwards:.0%} of the longer steps go backwards by the headings: if that is not how they move, see whether headings "
        "are in rad, counted from x towards y in the file, and of the head",
    )
