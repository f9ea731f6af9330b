"""Times in a file: the frame rate that they state, and the unit that they are in."""

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from turing_learning.errors import Setting, Text, refuse

from .._implausible import LEAST_RATE, MOST_RATE
from .._recording import LARGEST_COORDINATE, refusal, refuse_first

if TYPE_CHECKING:
    import pandas as pd

_UNITS = {
    "s": 1.0, "sec": 1.0, "secs": 1.0, "seconds": 1.0, "ms": 1e3, "msec": 1e3, "milliseconds": 1e3, "us": 1e6,
    "\N{MICRO SIGN}s": 1e6, "ns": 1e9, "min": 1 / 60, "minutes": 1 / 60, "h": 1 / 3600, "hours": 1 / 3600,
}  # fmt: skip
_CLOCKS = ("time", "timestamp", "t", "elapsed", "elapsed time", "elapsed_time")


def _clocks_with_units() -> dict[str, float]:
    """Return names such as "time (ms)", and how many of the unit are a second."""
    names = {}
    for clock, (unit, per_s) in product(_CLOCKS, _UNITS.items()):
        for form in ("{}_{}", "{} ({})", "{} [{}]", "{}({})", "{}[{}]"):
            names[form.format(clock, unit)] = per_s
    return names


IN_UNITS = {
    "seconds": 1.0, "sec": 1.0, "milliseconds": 1e3, "minutes": 1 / 60, "hours": 1 / 3600, "%time": 1e9, "__time": 1.0,
    **_clocks_with_units(),
}  # fmt: skip
"""Names of columns of times that say the unit, and how many of it are a second."""
TIME = ("time", *IN_UNITS, "t", "timestamp", "datetime", "date_time", "date")
"""Names of columns of times."""
UNITS_OF_TIME = {
    "s": "seconds", "sec": "seconds", "second": "seconds", "seconds": "seconds", "ms": "milliseconds",
    "msec": "milliseconds", "millisecond": "milliseconds", "min": "minutes", "minute": "minutes", "h": "hours",
    "hour": "hours", "frame": "", "frames": "",
}  # fmt: skip
"""Units of times in header lines -> names of `IN_UNITS`; empty where times count frames."""
UNSTATED = "no rate is stated by times in the column "
"""How `unstated` begins."""
LARGEST_START_S = 1e8
"""First time (s) from which on times count since another age, as those of computers since 1970."""
PER_SECOND = {"ms": 1e3, "us": 1e6, "ns": 1e9, "min": 1 / 60, "h": 1 / 3600, "days": 1 / 86400}
"""Units in which times may be, and frames per second where there is one in such a unit."""
VIDEO_RATES = (24.0, 25.0, 29.97, 30.0)
"""Frequent frame rates (1/s), which in minutes are rates of fast cameras."""
USUAL_RATE = 30.0
PLAIN_RATES = (24.0, 25.0, 30.0, 50.0, 60.0, 100.0, 120.0, 240.0)
"""Frame rates (1/s) that are named first where rounded times leave open which it is."""
LATE_FRAMES = 0.25
"""Frames by which a time may be beside that of its frame."""
OPEN_RATE_SHARE = 2e-3
"""Share of a rate by which the ends of a file may leave it open: rounded times state none otherwise."""
TINY = 1e-300
"""Smallest rate of which a logarithm is taken."""
MOST_TRIED = 20
"""Rates to either side that are tried with each number of digits."""
ENOUGH = 10
"""Times from which on a rate at which they are frames is no chance."""
MOST_DECIMALS = 6
"""Decimals to which programs round times (s)."""
DAY_S = 86400.0
MIDNIGHT_S = 23 * 3600.0
"""Fall of a clock (s) from one row to the next from which on it has passed midnight."""
LARGEST_TIME = 1e19
"""Largest time in any unit: ten times `LARGEST_COORDINATE` s, some 300 years, in ns."""


def rounded(rate: float) -> float:
    """Return a frame rate that times state with five digits: 29.97, or 0.0016667 with a frame every ten minutes."""
    return float(f"{rate:.5g}")


def stated_rate(seconds: np.ndarray, frames: np.ndarray) -> float | None:
    """Return the frame rate that times (s) of frames state, or None if they do not to a tenth of a frame."""
    plausible = (np.abs(seconds) <= LARGEST_TIME) & (np.abs(frames) <= LARGEST_COORDINATE)
    if plausible.sum() < 2:
        return None
    seconds, frames = seconds[plausible], frames[plausible]
    span = seconds[-1] - seconds[0]
    if span <= 0:
        return None
    fps = float((frames[-1] - frames[0]) / span)
    late = (seconds - seconds[0]) * fps - (frames - frames[0])
    # Stored runs were begun with this rate, which has to stay as it is
    if np.abs(late).max() < 0.1:
        return rounded(fps)
    return _plain_rate(seconds, frames, fps) if fps > 0 else None


def unstated(column: str) -> str:
    """Return the remark on a column of times beside frame numbers that states no rate."""
    return f"{UNSTATED}{column}: they are uneven, rounded too far, or count frames"


def _rounding(seconds: np.ndarray) -> float:
    """Return to how many s times are rounded, as 0.01 for those with two decimals; 0 where they are not."""
    for decimals in range(MOST_DECIMALS + 1):
        scaled = seconds * 10.0**decimals
        if np.ptp(scaled) >= 1 and np.abs(scaled - np.round(scaled)).max() <= 1e-3:
            return 0.1**decimals
    return 0.0


def _plain_rate(
    seconds: np.ndarray, frames: np.ndarray, fps: float, *, certain: bool = True
) -> float | None:
    """Return the rate with the fewest digits, from 2 on, that gives all times as they are rounded; None if none does.

    Times with two decimals, as AnimalTA writes them, are up to a third of a frame beside those of 30
    frames per second, and the first and last of a few hundred state 30.015. `fps` is about the rate.
    In short files more than one may fit: then none is `certain`.
    """
    step = _rounding(seconds)
    exact = np.ptp(seconds - frames / fps) <= 1e-3 * step
    # frames at the same rounded time state no rate
    if not step or exact or step * fps > 1:
        return None
    # both ends may be off by a step
    uncertain = fps * 2 * step / float(np.ptp(seconds))
    if certain and uncertain > OPEN_RATE_SHARE * fps:
        return None
    for digits in range(2, 6):
        unit = 10.0 ** (math.floor(math.log10(fps)) + 1 - digits)
        nearest = round(fps / unit)
        reach = min(MOST_TRIED, math.floor(uncertain / unit) + 1)
        for shift in sorted(range(-reach, reach + 1), key=abs):
            rate = rounded((nearest + shift) * unit)
            if rate > 0 and _fits(seconds, frames, rate, step):
                return rate
    return None


def _fits(seconds: np.ndarray, frames: np.ndarray, rate: float, step: float) -> bool:
    """Return whether frames at a rate give times that are rounded to a step, or truncated."""
    return bool(np.ptp(seconds - frames / rate) <= 1.001 * step)


def _counted(moments: np.ndarray) -> np.ndarray:
    """Return numbers of frames (N,) at times in order, by the mean of the steps that are single."""
    steps = np.diff(moments)
    single = steps[steps < 1.5 * np.median(steps)].mean()
    return np.concatenate(([0.0], np.cumsum(np.round(steps / single))))


def _even(moments: np.ndarray, rounding: float) -> tuple[float, np.ndarray] | None:
    """Return the rate at which moments (N,) in order are whole frames apart, and their frames; None if none is found."""
    span = float(moments[-1] - moments[0])
    steps = np.diff(moments)
    # every frame has somebody, or gaps are whole frames
    for between in (span / len(steps), np.median(steps), steps.min()):
        rate = max(1, round(span / between)) / span
        if _late(moments, rate).max() <= LATE_FRAMES:
            return rate, np.round((moments - moments[0]) * rate)
    numbers = _counted(moments)
    plain = _plain_rate(moments, numbers, numbers[-1] / span)
    if plain is not None and _fits(moments, numbers, plain, rounding):
        return plain, numbers
    return None


def _late(moments: np.ndarray, rate: float) -> np.ndarray:
    """Return by how many frames times (N,) are beside whole frames after the first."""
    since = (moments - moments.min()) * rate
    return np.abs(since - np.round(since))


def _frames_of(moments: np.ndarray, rate: float, rounding: float) -> np.ndarray | None:
    """Return the frames (N,) of moments in order at a rate, or None if they are not whole frames apart.

    Rounded times may be further than `LATE_FRAMES` beside their frames, all within one step of the rounding.
    """
    since = (moments - moments[0]) * rate
    numbers = np.round(since)
    if np.abs(since - numbers).max() <= LATE_FRAMES:
        return numbers
    # the first is late, too: by the mean, round the circle of a frame
    offset = np.angle(np.exp(2j * np.pi * since).mean()) / (2 * np.pi)
    numbers = np.round(since - offset)
    apart = rounding * rate < 1 and (np.diff(numbers) > 0).all()
    if apart and np.ptp(since - numbers) <= 1.001 * rounding * rate:
        return numbers - numbers[0]
    return None


def _gap_is_open(numbers: np.ndarray, step: float) -> bool:
    """Return whether times that are rounded to a step (frames) may have another number of frames in the largest gap.

    `numbers` (N,) are those of the frames in order. The longest stretch without a gap says how long a frame is.
    """
    between = np.diff(numbers)
    if between.max() <= 1 or not step:
        return False
    if len(numbers) < ENOUGH:
        return True
    breaks = np.flatnonzero(np.concatenate(([True], between > 1, [True])))
    longest = max(np.diff(breaks).max() - 1, 1)
    return bool(step * (1 + between.max() / longest) >= 0.5)


def _rates_before_rounding(moments: np.ndarray, rate: float, rounding: float) -> list[float] | None:
    """Return rates of moments (N,) in order that look like a higher one with gaps, or None if they do not.

    Times of 60 frames per second with two decimals are 0, 0.02, 0.03, 0.05: all are times of 100
    frames per second. None where `rate`, which they state, is not that of the last decimal. Empty
    where a few times leave it open, and no plain rate fits.
    """
    if len(moments) < 3 or not rounding or not math.isclose(rounding * rate, 1, rel_tol=1e-6):
        return None
    steps = np.diff(moments)
    # two frames are at most two steps apart where none is missing
    single = steps < 2.5 * rounding
    if not single.any():
        return None
    mean = steps[single].mean()
    numbers = np.cumsum(np.concatenate(([0], np.where(single, 1, np.round(steps / mean)))))
    lower = numbers[-1] / float(np.ptp(moments))
    plain = _plain_rate(moments, numbers, lower, certain=False)
    if plain is None or plain > 0.99 * rate:
        return None
    fitting = []
    for usual in PLAIN_RATES:
        if usual <= 0.99 * rate and _fits(moments, numbers, usual, rounding):
            fitting.append(usual)
    # both ends may be off by a step
    if not fitting and 2 * rounding <= OPEN_RATE_SHARE * float(np.ptp(moments)):
        fitting = [plain]
    return fitting


def check_rate(value: object, path: object) -> float:
    """Return a frame rate that a file states, if it can be one."""
    stated = np.asarray(value)
    fps = float(stated.ravel()[0]) if stated.size == 1 and stated.dtype.kind in "fiu" else np.nan
    if not (np.isfinite(fps) and fps > 0):
        raise refusal("state a frame rate above 0", repr(value), path)
    return fps


def per_second(
    rate: float, fps: float | None, file: object, name: str = "time", *, counts: bool = False
) -> float:
    """Return by what to multiply frames in a unit of time to have frames per second: 1 for times in s.

    The user's `fps` decides, or else whether the `rate` is that of a video by times in s. What stays
    open is refused. `name` is that of the column; `counts` says that its values are whole and 1 apart,
    as if they counted frames.
    """
    if name in IN_UNITS:
        return IN_UNITS[name]
    if fps is None:
        minutes = any(math.isclose(rate, 60 * video, rel_tol=1e-3) for video in VIDEO_RATES)
        if counts or minutes or not LEAST_RATE <= rate <= MOST_RATE:
            _ask(rate, file, name, counts)
        return 1.0
    for factor in (1.0, *PER_SECOND.values()):
        # some frames may have nobody; a rate that is wrong looks as if times were in minutes
        fewest = fps / 100 if factor >= 1 else fps / 2
        if counts:
            fewest = fps / 1.02
        if fewest <= rate * factor <= 1.02 * fps:
            return factor
    if counts:
        remedy: Text = (
            "If they count frames, give ",
            Setting("columns", {"frame": name}),
            ", too.",
        )
        rule = f"be 1 where values of `{name}` are whole and 1 apart, if they are in s"
        refuse("fps", rule, f"{fps:g}", remedy, place=str(file))
    return 1.0


def _ask(rate: float, file: object, name: str, counts: bool) -> NoReturn:
    """Refuse times of which nobody says in which unit they are."""
    in_seconds = Setting("fps", rounded(rate))
    if counts:
        got = "none, and they are whole and 1 apart"
        remedy: Text = (
            "If they count frames, give ", Setting("columns", {"frame": name}),
            " and the frame rate; if they are in s, give ", in_seconds, ".",
        )  # fmt: skip
    else:
        distances = {}
        for unit, factor in PER_SECOND.items():
            distances[unit] = abs(math.log(max(rate * factor, TINY) / USUAL_RATE))
        unit = min(distances, key=distances.__getitem__)
        likely = Setting("fps", rounded(rate * PER_SECOND[unit]))
        got = f"none, and in s they state {rounded(rate):g} frames per second"
        remedy = (f"If they are in {unit}, give ", likely, "; if in s, give ", in_seconds, ".")
    rule = f"be given where values of `{name}` may not be in s"
    refuse("fps", rule, got, remedy, place=str(file))


def frames_at(
    times: np.ndarray, fps: float | None, name: str, file: object, at: Callable[[int], str]
) -> tuple[np.ndarray, float | None]:
    """Return frame numbers (rows,) at times in the column `name`, and the frame rate that they state.

    There is no such rate where it is given as `fps`.
    """
    check_times(times, at, LARGEST_TIME)
    moments = np.unique(times)
    if len(moments) < 2:
        check_times(times, at)
        return np.full(len(times), max(0.0, round(float(moments[0]) * (fps or 1.0)))), None
    typical = float(np.median(np.diff(moments)))
    counts = typical == 1 and bool((moments == np.floor(moments)).all())
    rounding = _rounding(moments)
    even = _even(moments, rounding)
    # Times may be in s, ms or frames
    if fps is None:
        rate = even[0] if even else 1 / typical
        factor = per_second(rate, None, file, name, counts=counts)
        lower = _rates_before_rounding(moments, rate, rounding)
        if lower is not None:
            _ask_which(
                [rounded(each * factor) for each in lower], rounded(rate * factor), name, file
            )
    else:
        slowest = 1 / typical if counts else 1 / (typical + rounding)
        factor = per_second(slowest, fps, file, name, counts=counts)
        rate = fps / factor
    check_times(times / factor, at)
    numbers = even[1] if even and fps is None else _frames_of(moments, rate, rounding)
    if fps is None and not even and numbers is not None and _gap_is_open(numbers, rounding * rate):
        rule = f"be given where rounded times in `{name}` leave open how many frames a gap has"
        refuse("fps", rule, "none", place=str(file))
    if numbers is None:
        rule = f"have times (s) that are whole frames apart, at {rate * factor:.6g} per second"
        resample = Setting("resample", rounded(factor / typical))
        uneven = ("If they are uneven, make them even by ", resample, "; or number the frames.")
        remedy: Text = uneven
        if even and len(moments) >= ENOUGH:
            remedy = ("They are, at ", Setting("fps", rounded(even[0] * factor)), ".")
        elif fps is not None:
            remedy = ("If the rate is another, correct ", Setting("fps"), ". ", *uneven)
        refuse_first(_late(times, rate) > LATE_FRAMES, at, rule, times / factor, remedy)
        numbers = np.round((moments - moments[0]) * rate)
    start = max(0, round(float(moments[0]) * rate))
    stated = rounded(rate * factor) if fps is None else None
    return numbers[np.searchsorted(moments, times)] + start, stated


def _ask_which(lower: Sequence[float], rate: float, name: str, file: object) -> NoReturn:
    """Refuse rounded times that are those of two rates; the lower one is one of those, or any."""
    rule = f"be given where rounded times in `{name}` are those of two rates"
    words = "a lower rate"
    remedy: Text = (
        "Give that of the camera, ",
        Setting("fps", rate),
        " only if frames are missing.",
    )
    if lower:
        words = " or ".join(f"{each:g}" for each in lower) + " per second"
        choices: list[str | Setting] = []
        for each in lower:
            choices += [Setting("fps", each), ", or "]
        remedy = ("Give ", *choices, Setting("fps", rate), ".")
    got = f"none, and they are those of {words}, or of {rate:g} with gaps"
    refuse("fps", rule, got, remedy, place=str(file))


def seconds_of(
    texts: Sequence[str], at: Callable[[int], str], *, decimal_comma: bool = False
) -> tuple[np.ndarray, bool]:
    """Return times (rows,) as numbers, and whether they are in s since the first because they were dates or clocks.

    They may be numbers, with a `decimal_comma` where no time has a point,
    dates with times in ISO 8601 or as 31.12.2024, or times of day as 12:30:01.5.
    """
    import pandas as pd

    if decimal_comma and not any("." in text for text in texts):
        texts = [text.replace(",", ".") for text in texts]
    numbers = pd.to_numeric(pd.Series(texts, dtype=object), errors="coerce").to_numpy(dtype=float)
    if not np.isnan(numbers).any():
        return numbers, False
    words = pd.Series(texts, dtype=object)
    # dates with points are of day, month and year; those with strokes may be of month and day
    words = words.str.replace(r"^([0-9]{2})\.([0-9]{2})\.([0-9]{4})", r"\3-\2-\1", regex=True)
    words = words.str.replace(r" ?(UTC|GMT)$", "Z", regex=True)
    strokes = words.str.extract(r"^([0-9]{1,2})[/-]([0-9]{1,2})[/-]([0-9]{4})( .*)?$")
    form = "ISO8601"
    if strokes[2].notna().all():
        day, month = _day_and_month(strokes, at, texts)
        words = strokes[2] + "-" + strokes[month] + "-" + strokes[day] + strokes[3].fillna("")
        form = "mixed"
    dates = pd.to_datetime(words, format=form, utc=True, errors="coerce")
    clocks = bool(dates.isna().any())
    if clocks:
        dates = pd.Timestamp(0, tz="UTC") + pd.to_timedelta(
            words.where(words.str.contains(":")), errors="coerce"
        )
    unread = dates.isna().to_numpy()
    # one that is no number among numbers, rather than all numbers because they are no dates
    if np.isnan(numbers).mean() < 0.5:
        unread = np.isnan(numbers)
    quoted = np.array(list(map(repr, texts)), dtype=object)
    refuse_first(unread, at, "have times that are numbers, dates (ISO 8601) or h:min:s", quoted)
    seconds = (dates - dates.min()).dt.total_seconds().to_numpy(copy=True)
    # A clock that falls by almost a day has passed midnight
    if clocks and np.diff(seconds).min(initial=0) < -MIDNIGHT_S:
        start = seconds[0]
        # Rows of individuals may stand one after the other, and a later one begin earlier
        moments = np.unique(seconds)
        pause = int(np.argmax(np.diff(moments)))
        if moments[pause + 1] - moments[pause] > DAY_S / 2:
            start = moments[pause + 1]
        seconds[seconds < start] += DAY_S
        seconds -= start
    return seconds, True


def _day_and_month(
    strokes: "pd.DataFrame", at: Callable[[int], str], texts: Sequence[str]
) -> tuple[int, int]:
    """Return which of the first two parts of dates such as 31/12/2024 is the day, and which the month.

    Only one that is above 12 tells, or one date alone, of which it does not matter.
    """
    first, second = (strokes[part].astype(int) for part in (0, 1))
    if (first > 12).any() or len(strokes.drop_duplicates([0, 1, 2])) == 1:
        return (1, 0) if (second > 12).any() else (0, 1)
    if (second > 12).any():
        return 1, 0
    rule = "have dates of which it is clear what is the day, as 2024-12-31"
    raise refusal(rule, repr(texts[0]), at(0), "Write the year first, or day.month.year.")


def uneven_seconds(
    times: np.ndarray, fps: float | None, name: str, file: object, at: Callable[[int], str]
) -> np.ndarray:
    """Return times (rows,) in s, of two moments or more, that are to be resampled."""
    check_times(times, at, LARGEST_TIME)
    moments = np.unique(times)
    if len(moments) < 2:
        raise refusal("have two times or more", len(moments), file)
    rate = 1 / float(np.median(np.diff(moments)))
    return times / per_second(rate, fps, file, name)


def since_start(times: np.ndarray, per_s: float) -> tuple[np.ndarray, list[str]]:
    """Return times (rows,) from their start, with a remark, if they count since another age: those of computers."""
    first_time = float(np.nanmin(times))
    if not LARGEST_START_S <= first_time / per_s <= LARGEST_TIME:
        return times, []
    return times - first_time, [f"times count from the first, {first_time:.17g} in the file"]


def check_times(
    times: np.ndarray, at: Callable[[int], str], most_s: float = LARGEST_COORDINATE
) -> None:
    """Refuse absurd times (rows,) of a table."""
    refuse_first(
        ~(np.abs(times) <= most_s), at, f"have times within +-{LARGEST_COORDINATE:.0e} s", times
    )
