"""Which key point stands for the animal."""

from collections.abc import Sequence

from turing_learning.errors import brief, refuse


def choose(keypoint: str | None, names: Sequence[str], place: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    if keypoint is None or keypoint not in names:
        refuse(
            "keypoint",
            f"be one of {', '.join(names)}",
            brief(keypoint),
            "Say which point of the body stands for the animal.",
            place=str(place),
        )
    return keypoint
