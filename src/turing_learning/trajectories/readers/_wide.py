"""Tables with a row for each frame and columns for each individual: idTracker, CSV of idtracker.ai, and wide `DataFrame`s."""

import json
import re
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import LARGEST, Format, Glance, Options, Place, Recording, natural, refusal

from ._columns import TIME
from ._shared import check_rate, from_array, stated_rate
from ._text import Sheet, read_sheet

COORDINATES = {"x": 0, "y": 1, "probid": 2, "likelihood": 2, "confidence": 2}


def _is_csv(glance: Glance) -> bool:
    names = glance.cells(",")
    return ["x1", "y1"] in (names[:2], names[1:3] if names[0] in ("time", "seconds") else []) if names else False


def read_idtracker(path: Path, options: Options) -> Recording:
    """Read one row for each frame, three columns for each individual, in pixels.

    ProbId, the probability of the identity, is the confidence where it is a probability; idTracker writes NaN
    where it did not compute one, and negative numbers where it estimated the position during a crossing.

    Source: Perez-Escudero et al. 2014, idTracker, Nature Methods 11.
    """
    return read_wide(read_sheet(path, "\t"), "X1, Y1, ProbId1, X2, ...", each=3)


def read_csv(path: Path, options: Options) -> Recording:
    """Read a row for each frame: time (s), then x and y (pixels) of each individual.

    The frame rate is that of attributes.json beside the file, or follows from the times.
    """
    return read_wide(read_sheet(path, ","), "x1, y1, x2, y2, ... after the time", fps=_attribute(path))


def read_wide(sheet: Sheet, rule: str, *, each: int | None = 2, fps: float | None = None) -> Recording:
    """Read x, y and perhaps a confidence of each individual; `each` is their number, None for 2 or 3.

    Columns are called x1 or fish_x; one of times (s) or frames may be among them.
    """
    found: dict[str, dict[int, int]] = {}
    when = None
    for place, name in enumerate(sheet.names):
        number, suffix = (
            re.fullmatch(r"(?i)(x|y|probid)([0-9]+)", name),
            re.fullmatch(r"(?i)(.+)[ _.:](x|y|likelihood|confidence)", name),
        )
        if number is None and suffix is None and when is None and name.lower() in ("frame", *TIME):
            when = place
            continue
        who, what = (number[2], number[1]) if number else (suffix[1], suffix[2]) if suffix else ("", "")
        kind = COORDINATES.get(what.lower())
        if kind is None or kind in found.setdefault(who, {}):
            raise refusal(f"have the columns {rule}", f"{len(sheet.names)} columns, {name!r}", sheet.place)
        found[who][kind] = place
    widths = {len(columns) for columns in found.values()}
    if (
        len(widths) != 1
        or not widths <= ({2, 3} if each is None else {each})
        or not all({0, 1} <= set(columns) for columns in found.values())
    ):
        raise refusal(f"have the columns {rule}", f"{len(sheet.names)} columns, {sheet.names[-1]!r}", sheet.place)
    individuals = sorted(found, key=natural)
    wanted = [found[who][kind] for who in individuals for kind in sorted(found[who])]
    table = sheet.read(numbers=[*([] if when is None else [when]), *wanted])
    values = table.numbers[:, when is not None :].reshape(len(table.numbers), len(individuals), -1)
    first, rate = 0, fps
    if when is not None:
        first, rate = _timed(table.numbers[:, 0], sheet.names[when].lower() == "frame", table.place, fps)
    sure = values[..., 2] if values.shape[2] > 2 else None
    known = ~np.isnan(values[..., 0])
    complete = sure is not None and bool((sure >= 0).all(where=known))
    estimated = 0 if sure is None else int((sure < 0).sum())
    return from_array(
        values[..., :2],
        tuple(individuals),
        table.place,
        confidence=sure if complete else None,
        fps=rate,
        first_frame=first,
        numbered=when is not None,
        remarks=(f"{estimated} positions were estimated by idTracker (negative ProbId)",) if estimated else (),
    )


def _timed(times: np.ndarray, frames: bool, place: Place, fps: float | None) -> tuple[int, float | None]:
    """Return first frame and frame rate of rows at times (s), or with frame numbers, that follow without a break."""

    def check(bad: np.ndarray, rule: str, got: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            raise refusal(rule, got.format(times[row], times[row] - times[row - 1]), place(row))

    check(~(np.abs(times) <= LARGEST), f"have times within +-{LARGEST:.0e} s", "{0}")
    check(np.concatenate([[False], np.diff(times) <= 0]), "have times that grow from row to row", "{0}")
    steps = np.diff(times)
    if frames:
        check(times != times[0] + np.arange(len(times)), "have frame numbers that follow without a break", "{0}")
        check(times != np.floor(times), "have frame numbers that are whole", "{0}")
        return int(times[0]), fps
    if len(steps):
        uneven = np.abs(steps / np.median(steps) - 1) > 0.5
        check(np.concatenate([[False], uneven]), "have evenly spaced times", "a step of {1:.6g} s")
    return 0, fps or stated_rate(times, np.arange(len(times)))


def _attribute(path: Path) -> float | None:
    """Return the frame rate that attributes.json beside the file states."""
    beside = path.parent / "attributes.json"
    if not beside.is_file():
        return None
    try:
        stated = json.loads(beside.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise refusal("have a whole attributes.json beside it", str(error)[:80], beside) from None
    rate = stated.get("frames_per_second") if isinstance(stated, dict) else None
    return None if rate is None else check_rate(rate, beside)


IDTRACKER_FORMAT = Format("idtracker", lambda glance: glance.cells("\t")[:3] == ["X1", "Y1", "ProbId1"], read_idtracker)
CSV_FORMAT = Format("idtracker.ai-csv", _is_csv, read_csv)
