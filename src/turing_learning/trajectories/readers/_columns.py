"""Which column of a table is what: positions or boxes around individuals, and who is an individual."""

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from turing_learning.errors import Setting, Text

from .._recording import JUMP_FACTOR, Recording, refusal

WHO = (
    "id", "individual", "individuals", "animal", "fish", "identity", "track", "track_id", "trackid", "tracker_id",
    "object_id", "animal_id", "particle",
)  # fmt: skip
"""Names of columns of individuals; without one all rows are of one individual."""
APART = (
    "trial", "video", "recording", "session", "experiment", "replicate", "arena", "tank", "cage", "dish", "well",
    "clip", "file",
)  # fmt: skip
"""Names of columns of recordings, which have nothing to do with each other."""
_BOX = {
    "left": ("left", "xmin", "x_min", "x1"), "top": ("top", "ymin", "y_min", "y1"),
    "right": ("right", "xmax", "x_max", "x2"), "bottom": ("bottom", "ymax", "y_max", "y2"),
    "width": ("width", "w"), "height": ("height", "h"),
}  # fmt: skip
_PARTS = re.compile(
    r"(left|right|front|rear|back|top|bottom|mid|middle|upper|lower|min|max|corner|head|nose|snout|neck|body|center|centre|centroid|"
    r"thorax|abdomen|spine|tail|tailbase|base|tip|ear|eye|paw|leg|hand|foot|wing|[0-9]+|[ _.-])+"
)
"""Names of points of one body, or of corners of a box around it."""
CONTINUOUS = 0.01
"""Share of jumps up to which paths are continuous, and by twice which the best ones may exceed it."""
BROKEN = 0.2
"""Share of jumps from which on nothing is a path."""
FEWEST, FEWEST_STEPS = 10, 50
"""Rows, and steps, from which on they are evidence."""
CHANCE = 0.7
NEARER = 3.0
"""Steps of individuals, by those to others and to whoever is nearest next, from which on nobody follows a path."""


def named(names: Sequence[str], columns: Mapping[str, str] | None, place: object, **others: str) -> list[str]:
    """Return names of columns, in which those of `columns` are called by what they are; `others` are other names for that."""
    said = {others.get(role, role): column for role, column in (columns or {}).items()}
    lower = [name.lower() for name in names]
    # another column of that name is not meant
    found = ["" if name.lower() in said else name for name in names]
    for role, column in said.items():
        where = [k for k, name in enumerate(names) if name == column] or [
            k for k, name in enumerate(lower) if name == column.lower()
        ]
        if len(where) != 1:
            raise refusal(f"have the column {column!r} once", ", ".join(names), place)
        angle = role in others.values() and re.match("lat|lon|lng", column.lower())
        if angle:
            remedy = "Project them onto a plane."
            raise refusal("have positions in a plane", f"angles in {column!r}", place, remedy)
        found[where[0]] = role
    return found


def box_columns(names: Collection[str]) -> dict[str, str]:
    """Return what of a box a table has, left -> name of the column, if that is enough to say where the box is."""
    plain = {re.sub(r"^(bbox|bb|box)[ _.]*", "", name): name for name in names}
    found = {what: plain[name] for what, known in _BOX.items() for name in known if name in plain}
    for ends in (("right", "bottom"), ("width", "height")):
        if {"left", "top", *ends} <= found.keys():
            return {what: found[what] for what in ("left", "top", *ends)}
    return {}


def centers(box: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the centers (rows, 2) of boxes, whose parts (rows,) are called left, top, and right and bottom, or width and height."""
    if "width" in box:
        return np.column_stack([box["left"] + box["width"] / 2, box["top"] + box["height"] / 2])
    return np.column_stack([(box["left"] + box["right"]) / 2, (box["top"] + box["bottom"]) / 2])


def refuse_size(names: Sequence[str], place: object) -> None:
    """Refuse positions beside the size of a box whose corner or center they may be."""
    known = [next((name for name in _BOX[what] if name in names), "") for what in ("width", "height")]
    if all(known):
        corner: Text = Setting("columns", {"left": "x", "top": "y", "width": known[0], "height": known[1]})
        remedy = (
            "If x and y are its corner, give ",
            corner,
            "; if its center, give ",
            Setting("columns", {"x": "x", "y": "y"}),
            ".",
        )
        raise refusal("say what of a box x and y are", f"x and y beside {' and '.join(known)}", place, remedy)


def refuse_points(individuals: Mapping[str, Sequence[str]], place: object) -> None:
    """Refuse a wide table of several points of one body, or corners of a box, as if they were individuals: name -> columns."""
    names = [name.lower() for name in individuals]
    if len(names) < 2 or not all(_PARTS.fullmatch(name) and re.search("[a-z]", name) for name in names):
        return
    x, y, *_ = next(iter(individuals.values()))
    got = f"{', '.join(individuals)}, which may be points of one body, or corners of a box"
    remedy = (
        "Say which columns are the animal's, for example ",
        Setting("columns", {"x": x, "y": y}),
        ", or rename them.",
    )
    raise refusal("name individuals where several columns are of x and y", got, place, remedy)


def refuse_corners(values: np.ndarray, place: object) -> None:
    """Refuse columns x1, y1, x2, y2 as two individuals (F, 2, 2) where they go side by side as corners of a box do."""
    first, second = values[~np.isnan(values).any(axis=(1, 2))].transpose(1, 0, 2)
    sides, middles = second - first, (first + second) / 2
    if len(sides) < FEWEST or not ((sides > 0).all(axis=0) | (sides < 0).all(axis=0)).all():
        return
    if (sides.std(axis=0) < 0.5 * middles.std(axis=0)).all():
        corners: Text = Setting("columns", {"left": "x1", "top": "y1", "right": "x2", "bottom": "y2"})
        remedy = ("If they are corners, give ", corners, "; if not, name the columns a_x, a_y, b_x, b_y.")
        raise refusal(
            "not hold corners of boxes as individuals", "x1, y1 and x2, y2 always side by side", place, remedy
        )


def choose_individuals(
    candidates: Mapping[str, Sequence[str]], frames: np.ndarray, positions: np.ndarray, place: object
) -> tuple[str, str]:
    """Return the column by which paths are continuous, and in words why it is taken; refuse where that is not clear.

    `candidates` are the columns (rows,) that may name the individuals in rows of `frames` (rows,) and `positions`
    (rows, 2). Where whoever is one by a column is one by another, too, that one is taken.
    """
    codes = {name: numbered(texts) for name, texts in candidates.items()}
    first = next(iter(codes))
    if all(_within(codes[first], other) and _within(other, codes[first]) for other in codes.values()):
        return first, ""
    steps = {name: _steps(frames, numbers, positions) for name, numbers in codes.items()}
    paces = [np.median(found[found > 0]) for found in steps.values() if (found > 0).any() and np.isfinite(found).all()]
    jump = JUMP_FACTOR * min(paces, default=np.inf)
    jumps = {name: (found > jump) | np.isinf(found) for name, found in steps.items()}
    shares = {name: float(found.mean()) if len(found) else 1.0 for name, found in jumps.items()}
    best = min(shares.values())
    likely = [name for name in shares if best <= BROKEN and shares[name] <= max(CONTINUOUS, 2 * best)]
    for name in likely:
        if all(_within(codes[other], codes[name]) for other in likely):
            others = " and ".join(f"{shares[other]:.0%} by {other}" for other in candidates if other != name)
            if name == "id":
                return name, ""
            return (
                name,
                f"the column {name} names the individuals: {shares[name]:.0%} of the steps are jumps by it, {others}",
            )
    remedy = ("Say which, for example ", Setting("columns", {"id": list(candidates)[-1]}), ".")
    got = f"{' and '.join(candidates)}, by {'several' if likely else 'none'} of which paths are continuous"
    raise refusal("have one column that names the individuals", got, place, remedy)


def numbered(texts: Sequence[str]) -> np.ndarray:
    """Return numbers from 0 for texts (rows,), the same for the same one."""
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(text, len(numbers)) for text in texts])


def _pairs(one: np.ndarray, other: np.ndarray) -> int:
    """Return how many different pairs there are of numbers (rows,) and others."""
    return len(np.unique(one * (other.max() + 1) + other))


def _within(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether rows that are the same by one column of numbers (rows,) are so by another."""
    return _pairs(one, other) == one.max() + 1


def _steps(frames: np.ndarray, who: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return distances from row to row of an individual in neighboring frames, infinite where rows contradict each other."""
    known = ~np.isnan(positions).any(axis=1)
    frames, who, positions = frames[known], who[known], positions[known]
    order = np.lexsort((frames, who))
    later, same = np.diff(frames[order]), np.diff(who[order]) == 0
    lengths = np.hypot(*np.diff(positions[order], axis=0).T)
    contradicting = same & (later == 0) & (lengths > 0)
    between = np.diff(np.unique(frames))
    neighboring = same & (later == (between.min() if len(between) else 0))
    return np.where(contradicting, np.inf, lengths)[neighboring | contradicting]


def refuse_detections(recording: Recording, name: str, place: object) -> None:
    """Refuse numbers of detections as if they named individuals: nobody is there twice, or all go where others are."""
    positions, present, found = recording.positions, recording.present, ""
    count = present.shape[1]
    if count >= FEWEST and len(present) > 1 and present.sum(axis=0).max() == 1:
        found = f"{count} individuals, each in one frame only"
    own, other = _median_step(positions, 0), _median_step(positions, 1)
    if own > CHANCE * other:
        some = positions[: 2 * FEWEST_STEPS]
        nearest = np.fmin.reduce([_steps_to(some, shift) for shift in range(count)])
        nearest = nearest[~np.isnan(nearest)]
        if len(nearest) and own > NEARER * np.median(nearest):
            found = f"steps of {own:.3g}, where the next position of another is {other:.3g} away"
    if found:
        remedy: Text = ("If it names them all the same, give ", Setting("columns", {"id": name}), ".")
        raise refusal(f"name the individuals in the column {name}, not what was detected", found, place, remedy)


def _steps_to(positions: np.ndarray, shift: int) -> np.ndarray:
    """Return distances (F - 1, A) to where the individual so many columns before is in the next frame."""
    return np.hypot(*np.moveaxis(np.roll(positions[1:], shift, axis=1) - positions[:-1], -1, 0))


def _median_step(positions: np.ndarray, shift: int) -> float:
    """Return the median of these distances, not a number if they are few."""
    known = _steps_to(positions, shift)
    known = known[~np.isnan(known)]
    return float(np.median(known)) if len(known) >= FEWEST_STEPS else np.nan


def refuse_several(apart: Mapping[str, Sequence[str]], frames: np.ndarray, who: Sequence[str], place: object) -> None:
    """Refuse rows of several recordings at the same frames, by columns whose names say so, as if they were of one."""
    frame, whose = np.unique(frames, return_inverse=True)[1], numbered(who)
    for name, texts in apart.items():
        of = numbered(texts)
        twice = _pairs(of, frame) > frame.max() + 1
        alone = _within(whose, of)
        again = _pairs(of, whose * (frame.max() + 1) + frame) > _pairs(whose, frame)
        if twice and (alone or again):  # somebody may go from one arena to another
            got, remedy = f"{of.max() + 1} by the column {name}, with the same frames", "Write a file for each of them."
            raise refusal("hold one recording", got, place, remedy)
