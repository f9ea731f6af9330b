"""Where a swarm starts, and whether there is room for it."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Start:
    """Robots and objects, and the rectangle in which their centers are placed.

    Attributes
    ----------
    disks
        (number, radius in cm) of the robots, then of the objects; objects only where there are some.
    corner_cm
        x and y of the corner of the rectangle.
    sides_cm
        Its width and height.
    """

    disks: tuple[tuple[int, float], ...]
    corner_cm: float
    sides_cm: tuple[float, float]

    @property
    def bodies(self) -> int:
        """Number of robots and objects."""
        return sum(number for number, _ in self.disks)

    @property
    def crowd(self) -> str:
        """Which bodies have no room side by side, in words; empty if nothing speaks against it."""
        for _, radius in self.disks:
            larger = [disk for disk in self.disks if disk[1] >= radius]
            count, most = sum(number for number, _ in larger), most_disks(self.sides_cm, radius)
            if count > most:
                size = f"radius {radius:g} cm{' or more' if len(larger) > 1 else ''}"
                return f"at most {math.floor(most)} of {count} bodies of {size} have room"
        return ""


def most_disks(sides_cm: tuple[float, float], radius_cm: float) -> float:
    """Return a number that disks cannot exceed whose centers lie in a rectangle, and no two of which overlap.

    Fewer may be as many as fit; never more.

    Parameters
    ----------
    sides_cm
        Of the rectangle, 0 or more.
    radius_cm
        Of the disks, above 0.

    Source
    ------
    N. Oler, An inequality in the geometry of numbers, Acta Mathematica 105 (1961) 19: points of a convex region of area A and
    perimeter P, no two closer than 1, are at most 2 A / sqrt(3) + P / 2 + 1.
    """
    width, height = (side / (2 * radius_cm) for side in sides_cm)
    return (2 / math.sqrt(3) * width * height + width + height + 1) * (1 + 1e-9)  # rounding never refuses a body
