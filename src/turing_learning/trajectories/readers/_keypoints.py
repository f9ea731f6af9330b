"""Which key point stands for the animal."""

from collections.abc import Sequence


def choose(keypoint: str | None, names: Sequence[str], place: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    if keypoint is None or keypoint not in names:
        raise ValueError(
            f"`keypoint` must be one of {', '.join(names)}; got {keypoint!r} [{place}]. "
            "Say which point of the body stands for the animal."
        )
    return keypoint
