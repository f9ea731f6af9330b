"""Which column of a table is what: positions or boxes around individuals, and who is who."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from turing_learning.errors import Setting, Text, brief, require

from .._recording import JUMP_FACTOR, Recording, refusal
from ._sheets import Sheet

WHO = (
    "id", "individual", "individuals", "animal", "fish", "identity", "track", "track_id", "trackid",
    "tracker_id", "object_id", "animal_id", "particle", "tracking_id", "trajectory", "trajectory_id", "trajectoryid",
    "mouse", "mouse_id", "fish_id", "fly", "fly_id", "ant_id", "bee_id", "bird_id", "agent_id", "agent", "robot",
    "robot_id", "target_id", "pedestrian", "person_id", "persid", "person", "ped_id", "pedestrian_id",
    "track_n\N{DEGREE SIGN}", "individu", "individuo", "tier",
)  # fmt: skip
"""Names of columns of individuals; without one all rows are of one individual."""
APART = (
    "trial", "video", "recording", "session", "experiment", "replicate", "arena", "tank", "cage",
    "dish", "well", "clip", "file",
)  # fmt: skip
"""Names of columns of recordings, which have nothing to do with each other."""
_SIDES = {
    "left": ("left", "xmin", "x_min", "x1", "xtl"), "top": ("top", "ymin", "y_min", "y1", "ytl"),
    "right": ("right", "xmax", "x_max", "x2", "xbr"), "bottom": ("bottom", "ymax", "y_max", "y2", "ybr"),
    "width": ("width", "w"), "height": ("height", "h"),
}  # fmt: skip
"""Names of the columns of a box, perhaps with a prefix."""
_BODY = re.compile(
    r"(left|right|front|rear|back|top|bottom|mid|middle|upper|lower|min|max|corner|head|nose|snout|neck|"
    r"body|center|centre|centroid|thorax|abdomen|spine|tail|tailbase|base|tip|ear|eye|paw|leg|hand|foot|"
    r"wing|raw|smooth(ed)?|filter(ed)?|interp(olated)?|pred(icted)?|corrected|true|truth|gt|est(imated)?|mean|median|"
    r"[0-9]+|[ _.-])+"
)
"""Names of points of one body, of corners of a box around it, or of one point in several ways."""
_MOTION = re.compile(
    r"vel|velocity|speed|acc|accel|acceleration|delta|displacement|std|sd|sem|var|variance|err|error|rms|"
    r"prob|conf|confidence|score|likelihood"
)
"""Names of what is no position."""
CONTINUOUS = 0.01
"""Share of jumps among steps up to which paths are continuous; twice that of the best column is, too."""
BROKEN = 0.2
"""Share of jumps from which on nothing is a path."""
FEWEST_ROWS = 10
FEWEST_STEPS = 50
"""Rows, and steps, from which on they are evidence."""
CHANCE = 0.7
NEARER = 3.0
"""Steps of individuals, in steps to where another is next and in those to whoever is nearest then,
from which on nobody follows a path."""


def named(names: Sequence[str], columns: Mapping[str, str] | None, file: object) -> list[str]:
    """Return the names of columns, those of which `columns` says what they are by that."""
    stated = columns or {}
    renamed = list(names)
    for k, name in enumerate(names):
        # another column of that name is not meant
        if name.lower() in stated:
            renamed[k] = ""
    for role, column in stated.items():
        spelled = [k for k, name in enumerate(names) if name == column]
        in_any_case = [k for k, name in enumerate(names) if name.lower() == column.lower()]
        fitting = spelled or in_any_case
        if len(fitting) != 1:
            raise refusal(f"have the column {column!r} once", ", ".join(names), file)
        renamed[fitting[0]] = role
    return renamed


def choose(keypoint: str | None, names: Sequence[str], where: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    remedy = "Say which point of the body stands for the animal."
    rule = f"be one of {', '.join(names)}"
    require(keypoint in names, "keypoint", rule, brief(keypoint), remedy, place=str(where))
    return str(keypoint)


POINTS = ("node", "keypoint", "key_point", "bodypart", "body_part")
"""Names of columns that say of which point of the body a row is."""


def of_key_point(sheet: Sheet, keypoint: str | None) -> Sheet:
    """Return the rows of the key point asked for, or of the only one there is, of a table that has a row for each."""
    columns = [k for k, name in enumerate(sheet.names) if name.lower() in POINTS]
    if not columns:
        rule = "be left out for a table without a column of key points"
        require(keypoint is None, "keypoint", rule, brief(keypoint), place=sheet.origin)
        return sheet
    _, (points,) = sheet.read([], columns[:1])
    point = choose(keypoint, list(dict.fromkeys(points)), sheet.origin)
    rows = np.flatnonzero([name == point for name in points])

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        values, words = sheet.read(numbers, texts)
        chosen = []
        for column in words:
            chosen.append([column[row] for row in rows])
        return values[rows], chosen

    names = list(sheet.names)
    names[columns[0]] = ""
    return replace(sheet, names=names, read=read, at=lambda row: sheet.at(int(rows[row])))


def box_columns(names: Collection[str]) -> dict[str, str]:
    """Return the columns of a box by its sides, if they are enough to say where it is."""
    plain = {re.sub(r"^(bbox|bb|box)[ _.]*", "", name): name for name in names}
    sides: dict[str, str] = {}
    for side, words in _SIDES.items():
        for word in words:
            if word in plain:
                sides.setdefault(side, plain[word])
    for opposite in (("right", "bottom"), ("width", "height")):
        wanted = ("left", "top", *opposite)
        if sides.keys() >= set(wanted):
            return {side: sides[side] for side in wanted}
    return {}


def centers(sides: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the centers (rows, 2) of boxes by the coordinates of their sides (rows,), or sizes."""
    if "width" in sides:
        x = sides["left"] + sides["width"] / 2
        y = sides["top"] + sides["height"] / 2
    else:
        x = (sides["left"] + sides["right"]) / 2
        y = (sides["top"] + sides["bottom"]) / 2
    return np.column_stack([x, y])


def refuse_size(names: Sequence[str], file: object) -> None:
    """Refuse positions beside the size of a box, whose corner or center they may be."""
    widths = [name for name in _SIDES["width"] if name in names]
    heights = [name for name in _SIDES["height"] if name in names]
    if not (widths and heights):
        return
    corner = {"left": "x", "top": "y", "width": widths[0], "height": heights[0]}
    remedy: Text = (
        "If x and y are its corner, give ", Setting("columns", corner),
        "; if its center, give ", Setting("columns", {"x": "x", "y": "y"}), ".",
    )  # fmt: skip
    got = f"x and y beside {widths[0]} and {heights[0]}"
    raise refusal("say what of a box x and y are", got, file, remedy)


def refuse_points(columns: Mapping[str, Sequence[str]], file: object) -> None:
    """Refuse a wide table of points of one body, or corners of a box, as if they were individuals.

    `columns` are those of x and y by the names of individuals.
    """
    names = [name.lower() for name in columns]
    moving = [name for name in columns if _MOTION.fullmatch(name.lower())]
    if moving:
        got = f"x and y of {', '.join(moving)}"
        raise refusal("hold positions, and individuals by their names", got, file)
    named_as_points = [bool(_BODY.fullmatch(name) and re.search("[a-z]", name)) for name in names]
    if len(names) < 2 or not all(named_as_points):
        return
    x, y = next(iter(columns.values()))
    got = f"{', '.join(columns)}, which may be points of one body, corners of a box, or one in several ways"
    remedy: Text = (
        "Say which columns are the animal's, for example ", Setting("columns", {"x": x, "y": y}),
        ", or rename them.",
    )  # fmt: skip
    raise refusal("name individuals where several columns are of x and y", got, file, remedy)


CORNERS = {"left": "x1", "top": "y1", "right": "x2", "bottom": "y2"}
"""What columns x1, y1, x2, y2 are if they are corners of a box."""


def _go_side_by_side(first: np.ndarray, second: np.ndarray) -> bool:
    """Return whether the way from points (rows, 2) to others changes less than half as much as their middle."""
    middles = (first + second) / 2
    return bool(((second - first).std(axis=0) < 0.5 * middles.std(axis=0)).all())


def refuse_pair(sides: Mapping[str, np.ndarray], file: object) -> None:
    """Refuse columns x1, y1, x2, y2 as corners of boxes (rows,) whose size changes as much as their place does."""
    low = np.column_stack([sides["left"], sides["top"]])
    high = np.column_stack([sides["right"], sides["bottom"]])
    complete = ~np.isnan(low + high).any(axis=1)
    low = low[complete]
    high = high[complete]
    if len(low) == 0 or ((high > low).all() and _go_side_by_side(low, high)):
        return
    remedy: Text = (
        "If they are corners, give ", Setting("columns", CORNERS),
        "; if they are of two individuals, leave other columns out of the table.",
    )  # fmt: skip
    got = "x1, y1, x2, y2 that do not go side by side"
    raise refusal("have corners of boxes, or individuals alone", got, file, remedy)


def refuse_corners(positions: np.ndarray, file: object) -> None:
    """Refuse columns x1, y1, x2, y2 as two individuals (F, 2, 2) that go side by side as corners do."""
    complete = positions[~np.isnan(positions).any(axis=(1, 2))]
    sizes = complete[:, 1] - complete[:, 0]
    aside = (sizes > 0).all(axis=0) | (sizes < 0).all(axis=0)
    if len(sizes) < FEWEST_ROWS or not aside.all():
        return
    if _go_side_by_side(complete[:, 0], complete[:, 1]):
        remedy: Text = (
            "If they are corners, give ", Setting("columns", CORNERS),
            "; if not, name the columns a_x, a_y, b_x, b_y.",
        )  # fmt: skip
        got = "x1, y1 and x2, y2 always side by side"
        raise refusal("not hold corners of boxes as individuals", got, file, remedy)


def choose_individuals(
    columns: Mapping[str, Sequence[str]], frames: np.ndarray, positions: np.ndarray, file: object
) -> tuple[str, str]:
    """Return the column by which paths are continuous, and in words why; refuse what is not clear.

    `columns` (rows,) may all name the individuals at `positions` (rows, 2) in `frames` (rows,). Of
    those by which paths are continuous, it is the one that cuts none of the others' paths.
    """
    codes = {name: numbered(texts) for name, texts in columns.items()}
    names = list(codes)
    leader = codes[names[0]]
    if all(_finer(leader, rival) and _finer(rival, leader) for rival in codes.values()):
        return names[0], ""
    shares = _shares_of_jumps(codes, frames, positions)
    best = min(shares.values())
    likely = [name for name in names if shares[name] <= max(CONTINUOUS, 2 * best)]
    if best > BROKEN:
        likely = []
    for name in likely:
        if all(_finer(codes[rival], codes[name]) for rival in likely):
            if name == "id":
                return name, ""
            alternatives = [f"{shares[rival]:.0%} by {rival}" for rival in names if rival != name]
            jumps = f"{shares[name]:.0%} of the steps are jumps by it, {' and '.join(alternatives)}"
            return name, f"the column {name} names the individuals: {jumps}"
    remedy: Text = ("Say which, for example ", Setting("columns", {"id": names[-1]}), ".")
    many = "several" if likely else "none"
    got = f"{' and '.join(names)}, by {many} of which paths are continuous"
    raise refusal("have one column that names the individuals", got, file, remedy)


def numbered(texts: Sequence[str]) -> np.ndarray:
    """Return numbers from 0 for texts (rows,), the same for the same text."""
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(text, len(numbers)) for text in texts])


def _pairs(codes: np.ndarray, second_codes: np.ndarray) -> int:
    """Return how many different pairs there are of numbers (rows,) and others."""
    return len(np.unique(codes * (second_codes.max() + 1) + second_codes))


def _finer(codes: np.ndarray, second_codes: np.ndarray) -> bool:
    """Return whether rows with the same number (rows,) have the same other one, too."""
    return _pairs(codes, second_codes) == codes.max() + 1


def _shares_of_jumps(
    codes: Mapping[str, np.ndarray], frames: np.ndarray, positions: np.ndarray
) -> dict[str, float]:
    """Return the share of jumps among the steps of individuals by each column; 1 if there are none."""
    steps = {name: _steps(frames, numbers, positions) for name, numbers in codes.items()}
    typical = np.inf
    for lengths in steps.values():
        moving = lengths[lengths > 0]
        if len(moving) and np.isfinite(moving).all():
            typical = min(typical, float(np.median(moving)))
    shares = {}
    for name, lengths in steps.items():
        jumps = (lengths > JUMP_FACTOR * typical) | np.isinf(lengths)
        shares[name] = float(jumps.mean()) if len(jumps) else 1.0
    return shares


def _steps(frames: np.ndarray, who: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return distances between rows of an individual in neighboring frames.

    They are infinite where rows contradict each other.
    """
    located = ~np.isnan(positions).any(axis=1)
    order = np.flatnonzero(located)[np.lexsort((frames[located], who[located]))]
    later = np.diff(frames[order])
    same = np.diff(who[order]) == 0
    lengths = np.hypot(*np.diff(positions[order], axis=0).T)
    contradicting = same & (later == 0) & (lengths > 0)
    between = np.diff(np.unique(frames[located]))
    neighboring = same & (later == between.min(initial=np.inf))
    return np.where(contradicting, np.inf, lengths)[neighboring | contradicting]


def refuse_detections(recording: Recording, name: str, file: object) -> None:
    """Refuse numbers of detections in the column `name` as if they named individuals.

    Nobody is there twice by them, or nobody is nearer to where it was than to where others were.
    """
    individuals = recording.present.shape[1]
    got = ""
    alone = recording.present.sum(axis=0).max() == 1 and len(recording.present) > 1
    if alone and individuals >= FEWEST_ROWS:
        got = f"{individuals} individuals, each in one frame only"
    step = _median_step(recording.positions, 0)
    step_to_another = _median_step(recording.positions, 1)
    if step > CHANCE * step_to_another:
        opening = recording.positions[: 2 * FEWEST_STEPS]
        nearest = np.fmin.reduce([_steps_to(opening, shift) for shift in range(individuals)])
        nearest = nearest[~np.isnan(nearest)]
        if len(nearest) and step > NEARER * np.median(nearest):
            got = f"steps of {step:.3g}, where the next position of another is {step_to_another:.3g} away"
    if got:
        remedy: Text = (
            "If it names them all the same, give ",
            Setting("columns", {"id": name}),
            ".",
        )
        rule = f"name the individuals in the column {name}, not what was detected"
        raise refusal(rule, got, file, remedy)


def _steps_to(positions: np.ndarray, shift: int) -> np.ndarray:
    """Return distances (F - 1, A) to where the individual so many columns before is in the next frame."""
    steps = np.roll(positions[1:], shift, axis=1) - positions[:-1]
    return np.hypot(steps[..., 0], steps[..., 1])


def _median_step(positions: np.ndarray, shift: int) -> float:
    """Return the median of these distances, not a number if they are few."""
    steps = _steps_to(positions, shift)
    steps = steps[~np.isnan(steps)]
    return float(np.median(steps)) if len(steps) >= FEWEST_STEPS else np.nan


def refuse_several(
    columns: Mapping[str, Sequence[str]], frames: np.ndarray, who: Sequence[str], file: object
) -> None:
    """Refuse rows of several recordings in the same frames, by columns (rows,) whose names say so."""
    _, frame = np.unique(frames, return_inverse=True)
    whose = numbered(who)
    position = whose * (frame.max() + 1) + frame
    for name, texts in columns.items():
        recordings = numbered(texts)
        together = _pairs(recordings, frame) > frame.max() + 1
        again = _pairs(recordings, position) > len(np.unique(position))
        # who goes from one arena to another is in one recording of both
        if together and (again or _finer(whose, recordings)):
            got = f"{recordings.max() + 1} by the column {name}, with the same frames"
            raise refusal("hold one recording", got, file, "Write a file for each of them.")
