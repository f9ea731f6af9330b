"""Tables with a row for each individual and frame."""

import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from turing_learning.errors import RefusedError, Setting, Text, refuse

from .._recording import Options, Recording, YAxis, assemble, refusal, refuse_first
from ._columns import (
    APART,
    box_columns,
    centers,
    choose_individuals,
    named,
    refuse_detections,
    refuse_pair,
    refuse_several,
    refuse_size,
)
from ._layouts import CM_PER_UNIT, TIDY, UPWARDS, Layout, angles, plain_roles, unit_of
from ._places import projected, resampled
from ._sheets import Sheet, number_of
from ._times import (
    IN_UNITS,
    LARGEST_TIME,
    TIME,
    UNITS_OF_TIME,
    frames_at,
    per_second,
    rounded,
    seconds_of,
    since_start,
    stated_rate,
    uneven_seconds,
    unstated,
)

_HEADING = re.compile(
    r"(heading|theta|yaw|angle|orientation|direction)([ _(\[]*(rad(ians)?|(?P<degrees>deg(rees?)?|\N{DEGREE SIGN}))[)\]]*)?"
)
"""Names of columns in small letters that may hold headings, and are read where somebody says so, and they are in rad."""
EXTRAS = {"heading": "headings", "confidence": "confidence"}


_OF_SOMEBODY = re.compile(
    r"[xy][0-9]+|[xy][ _.:](?!min$|max$).+|(?!pos_).+[ _.:](x|y|likelihood|confidence)"
)
"""Names of columns of an individual in a wide table; x_min is of a box, and pos_x is a position by itself."""


def is_wide(names: Collection[str]) -> bool:
    """Return whether all columns but those of frames and times are of x, y and confidence of somebody."""
    return all(map(_OF_SOMEBODY.fullmatch, names))


def is_long(names: Collection[str]) -> bool:
    """Return whether a table has a row for each individual, by columns of a position or of a box."""
    wide = is_wide({*names} - {"frame", *TIME})
    return {"x", "y"} <= set(names) or (bool(box_columns(names)) and not wide)


def read_long(sheet: Sheet, options: Options, layout: Layout = TIDY) -> Recording:
    """Read a table with a row for each individual and frame; names of columns are in any case."""
    table = _LongTable(sheet, options, layout)
    moments = table.moments()
    frames = moments.frames
    seconds = moments.seconds
    fps = moments.fps
    remarks = moments.remarks
    positions, choices = table.positions()
    who, why = table.individuals(frames, positions)
    choices += why
    individuals = [table.single_name] * len(frames)
    if who:
        individuals = table.words[who]
    refuse_several(
        {name: table.words[name] for name in table.recording_columns},
        frames,
        individuals,
        sheet.origin,
    )
    extras, doubts = table.extras(positions)
    choices += doubts
    at = sheet.at
    visible, dropped = table.rows_of_somebody(who)
    choices += dropped
    if len(visible) < len(frames):
        frames, positions = frames[visible], positions[visible]
        individuals = [individuals[row] for row in visible]
        extras = {name: values[visible] for name, values in extras.items()}
        if len(seconds):
            seconds = seconds[visible]

        def at(row: int) -> str:
            return sheet.at(int(visible[row]))

    if options.resample is not None:
        rows = resampled(seconds, individuals, positions, extras, options.resample, sheet.origin)
        frames, individuals, positions, extras = rows
        fps = options.resample
        remarks.append(f"times were made even by resampling at {fps:g} per second")
        at = f"{sheet.origin}, resampled row {{}}".format
    unread = table.unread(who)
    twice: Text = ""
    if not layout.columns and "heading" not in table.extra:
        choices += _possible_headings(unread)
    if unread and not who and not layout.columns:
        listed = ", ".join(unread)
        remarks.append(
            f"without a column id all rows are of one individual; columns not read: {listed}"
        )
        example = Setting("columns", {"id": unread[-1]})
        twice = ("If a column that is not read names the individuals, say so: ", example, ".")
    elif unread:
        twice = f"Rows may differ in a column that is not read: {', '.join(unread)}."
    recording = assemble(
        frames,
        individuals,
        positions,
        at,
        extras=extras,
        fps=fps,
        unit=table.unit,
        y_axis=table.y_axis,
        remarks=tuple(remarks),
        choices=tuple(choices),
        twice=twice,
        sparse=moments.sparse,
        columns=table.read_from(who),
        unread=tuple(unread),
    )
    if who and "id" not in table.stated_columns:
        refuse_detections(recording, who, sheet.origin)
    return recording


def _possible_headings(unread: Sequence[str]) -> list[str]:
    """Say of columns that are not read, and may hold headings, how to have them read."""
    choices = []
    for name in unread:
        match = _HEADING.fullmatch(name.lower())
        if match and match["degrees"]:
            said = "columns={'heading': ...} or --column heading=..."
            convert = "multiply it by pi / 180, and name the new column by"
            choices.append(
                f"{name} is not read: headings have to be in rad. If it is the heading, {convert} {said}"
            )
        elif match:
            said = f"columns={{'heading': {name!r}}} or --column heading={name}"
            choices.append(f"{name} is not read: if it is the heading in rad, say so by {said}")
    return choices


@dataclass(frozen=True)
class _Moments:
    """When each row of a table is."""

    frames: np.ndarray  #: (rows,): Frame numbers, or numbers in order of time
    fps: float | None  #: The rate that the file states, None if it states none
    remarks: list[str]  #: What is to be said of the times
    #: (rows,): Times (s) where positions are to be resampled, else none
    seconds: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sparse: Text = ""  #: What to do where hardly any frame has a row


class _LongTable:
    """The columns of a table with a row for each individual and frame, by their roles."""

    def __init__(self, sheet: Sheet, options: Options, layout: Layout) -> None:
        self.sheet = sheet
        self.options = options
        self.layout = layout
        self.stated_columns = options.columns or {}
        #: Names by roles where that is said, else in small letters
        names = [name.lower() for name in named(sheet.names, self.stated_columns, sheet.origin)]
        self.units: dict[str, str] = {}
        for role, name in zip(names, sheet.names, strict=True):
            self.units[role] = sheet.units.get(name.lower(), "")
        if layout.columns and not layout.fits(names):
            needed = []
            for role in ("frame", "time", "x", "y"):
                if role in layout.columns:
                    needed.append(layout.columns[role][0].replace("\\", ""))
            raise refusal(f"have the columns {', '.join(needed)}", sheet.names, sheet.origin)
        roles = layout.roles(names) or plain_roles(names, project=options.project)
        if layout.single:
            _refuse_bodies(names, roles, layout, sheet)
        roles = {role: name for role, name in roles.items() if role not in self.stated_columns}
        self.names_by_role = dict(roles)
        for role, name in self.stated_columns.items():
            self.names_by_role[role] = name.lower()
        role_of = {name: role for role, name in roles.items()}
        self.names = []
        for name in names:
            # another column that is called as a role is not meant
            own_name = "" if name in roles else name
            self.names.append(role_of.get(name, own_name))
        self._choose_times()
        self._choose_positions()
        self._choose_individuals()
        self._choose_others()
        self._read()

    def _present(self, names: Sequence[str]) -> list[str]:
        """Return those of some names that the table has."""
        return [name for name in names if name in self.names]

    def _choose_times(self) -> None:
        """Find the column that says when a row is, and the times beside frame numbers."""
        times = self._present(TIME)
        self.when = "frame"
        if times and ("frame" not in self.names or self.options.resample is not None):
            self.when = times[0]
        self.clock: list[str] = []
        if self.when == "frame":
            self.clock = times[:1]

    def _choose_positions(self) -> None:
        """Find the columns of positions or boxes; refuse a table without, and sizes without corners."""
        names = self.names
        stated = not {"x", "y"}.isdisjoint(self.stated_columns)
        self.box: dict[str, str] = {}
        # A layout that names its columns has no boxes unless the user says so
        guessed = not self.layout.columns and is_long(names) and not stated
        if guessed or "left" in self.stated_columns:
            self.box = box_columns(names)
        self.plain = ["x", "y"]
        # One of them alone is no position
        if self.box and not {"x", "y"} <= set(names):
            self.plain = []
        if not {self.when, *self.plain} <= set(names):
            self._refuse_missing()
        central = re.match("c|.*cent", self.names_by_role.get("x", ""))
        if not (self.box or stated or central):
            refuse_size(names, self.sheet.origin)

    def _refuse_missing(self) -> None:
        """Say which columns a table needs, and what to do with what it has."""
        x, y = (self.layout.columns.get(axis, [axis])[0] for axis in ("x", "y"))
        remedy: Text = ""
        if self.when not in self.names:
            remedy = "Number the frames in a column frame."
        if angles(self.names):
            remedy = ("To bring degrees into a plane, add ", Setting("project", True), ".")
        rule = f"have the columns frame, {x}, {y}"
        raise refusal(rule, self.sheet.names, self.sheet.origin, remedy)

    def _choose_individuals(self) -> None:
        """Find the columns that may name individuals, and those that tell recordings apart."""
        candidates = self.layout.who
        if "id" in self.stated_columns:
            candidates = ("id",)
        # "Object ID" is object_id
        alike = {name.replace(" ", "_"): name for name in reversed(self.names)}
        self.who = [alike[name] for name in candidates if name in alike]
        self.recording_columns = [name for name in self._present(APART) if name not in self.who]
        #: The name of everybody where no column says one
        self.single_name = "1"
        # This program writes a file for each individual
        if self.layout.name == "trex-csv":
            self.single_name = _name_by_file(self.sheet.origin)

    def _choose_others(self) -> None:
        """Find the columns of headings, confidence, depth, visibility and units."""
        self.extra: list[str] = []
        if self.layout.extras:
            self.extra = self._present([*EXTRAS])
        self.turned = self._present(QUATERNION)
        # Some parts of a quaternion alone say nothing
        if len(self.turned) < len(QUATERNION):
            self.turned = []
        self.depth = self._present(("z",))
        self.hidden = self._present((MISSING, VISIBLE))
        # of other tables it may be a place
        if CORNER in self.box.values():
            self.hidden += self._present((OUTSIDE,))
        #: Columns that are read as numbers, and as texts
        self.wanted = [*self.plain, *self.box.values(), *self.extra, *self.turned]
        self.texts = [*self.who, *self.recording_columns, *self.depth, *self.hidden]
        self.texts += [*self._present((UNIT,)), *self.clock]
        if self.when == "frame":
            self.wanted.append("frame")
        else:
            self.texts.append(self.when)

    def _read(self) -> None:
        """Read the columns that were chosen; refuse one that is there twice, unless its cells are the same."""
        for name in {*self.wanted, *self.texts}:
            again = [k for k, other in enumerate(self.names) if other == name]
            # TRex writes frames once for itself, and again for who chose them
            if len(again) > 1 and len(set(map(tuple, self.sheet.read([], again)[1]))) > 1:
                raise refusal("name each column once", f"{name!r} twice", self.sheet.origin)
        columns = list(map(self.names.index, self.wanted))
        texts = list(map(self.names.index, self.texts))
        values, words = self.sheet.read(columns, texts)
        self.numbers = dict(zip(self.wanted, values.T, strict=True))
        self.words = dict(zip(self.texts, words, strict=True))

    @property
    def y_axis(self) -> YAxis | None:
        """Direction of y in the file, None if it is not known."""
        upwards = UPWARDS.fullmatch(self.names_by_role.get("y", ""))
        return "up" if self.options.project or upwards else self.layout.y_axis

    @property
    def unit(self) -> str | None:
        """Unit of the positions, "cm" where it is known."""
        return "cm" if self.options.project or self._stated_unit() in CM_PER_UNIT else None

    def _units_in_cells(self) -> set[str]:
        """Return units of length in the column that says one in each row; empty where it says something else."""
        units = {word.lower() for word in self.words.get(UNIT, ())} - {""}
        return units if units <= CM_PER_UNIT.keys() else set()

    def _stated_unit(self) -> str:
        units = set()
        for axis in self.plain:
            name = self.names_by_role.get(axis, axis)
            # a unit that is not known, as inch of what ImageJ took for one, is not stated
            unit = unit_of(name)
            below = self.units.get(name, "")
            if not unit and below in CM_PER_UNIT:
                unit = below
            units.add(unit)
        if self._units_in_cells():
            units = (units | self._units_in_cells()) - {""}
        if len(units) > 1:
            rule = "have x and y in the same unit"
            raise refusal(rule, " and ".join(sorted(units)), self.sheet.origin)
        return next(iter(units), "") or self.layout.unit

    def moments(self) -> _Moments:
        """Return when each row is, by frame numbers or by times."""
        if self.when == "frame":
            return self._by_frames()
        return self._by_times()

    def _by_frames(self) -> _Moments:
        """Return frame numbers, and the rate that the file or its times state."""
        sheet = self.sheet
        frames = self.numbers["frame"]
        resample = self.options.resample
        if resample is not None:
            remedy = "Frames at an even rate need no resampling."
            rule = "be left out for a table without times"
            refuse("resample", rule, f"{resample:g}", remedy)
        fps = sheet.fps
        if self.clock:
            clock = self.clock[0]
            unit = self.units.get(self.names_by_role.get(clock, clock), "")
            name = UNITS_OF_TIME.get(unit, clock)
            if name:
                beside = self.words[clock]
                if sheet.decimal_comma:
                    beside = [time.replace(",", ".") for time in beside]
                fps = _rate_beside(beside, frames, self.options.fps, sheet.origin, name)
        remarks = [sheet.remark] if sheet.remark else []
        if self.clock and fps is None:
            spelled = sheet.names[self.names.index(self.clock[0])]
            remarks.append(unstated(spelled))
        return _Moments(frames, fps, remarks)

    def _by_times(self) -> _Moments:
        """Return frames at the times of the rows; with resampling their order, and the times (s)."""
        sheet, options = self.sheet, self.options
        times, in_seconds = seconds_of(
            self.words[self.when], sheet.at, decimal_comma=sheet.decimal_comma
        )
        name = self.names_by_role.get("time", self.when)
        if in_seconds:
            name = "seconds"
        times, notes = since_start(times, IN_UNITS.get(name, 1.0))
        remarks = [*([sheet.remark] if sheet.remark else []), *notes]
        if options.resample is not None:
            seconds = uneven_seconds(times, options.fps, name, sheet.origin, sheet.at)
            _, order = np.unique(times, return_inverse=True)
            return _Moments(order.astype(float), None, remarks, seconds, _even(times, name))
        frames = None
        # What a name or a date says of the unit states a rate, whatever the user's is
        if name in IN_UNITS and options.fps is not None:
            with suppress(RefusedError):
                frames, fps = frames_at(times, None, name, sheet.origin, sheet.at)
        if frames is None:
            frames, fps = frames_at(times, options.fps, name, sheet.origin, sheet.at)
        return _Moments(frames, fps, remarks, sparse=_even(times, name))

    def positions(self) -> tuple[np.ndarray, list[str]]:
        """Return positions (rows, 2), in cm where the unit is known, and in words what was chosen."""
        unnamed = not self.who and "left" not in self.stated_columns and not self.plain
        if unnamed and "x2" in self.box.values():
            sides = {side: self.numbers[name] for side, name in self.box.items()}
            refuse_pair(sides, self.sheet.origin)
        positions, choices = _positions(
            self.numbers, self.plain, self.box, "left" in self.stated_columns
        )
        if self.plain and not choices:
            # what was read to see that x and y are neither corners nor fixed
            self.wanted = [name for name in self.wanted if name not in self.box.values()]
            self.box = {}
        for name in self.depth:
            if len({*self.words[name]} - {""}) > 1:
                x, y, z = (self.names_by_role.get(axis, axis) for axis in ("x", "y", name))
                choices.append(
                    f"positions are those in {x} and {y} alone, as if all {z} were the same"
                )
        if MISSING in self.words:
            unseen = np.array([not _says_no(word) for word in self.words[MISSING]])
            positions = np.where(unseen[:, None], np.nan, positions)
        invisible = np.ones(len(positions), dtype=bool)
        invisible[self.visible()] = False
        positions = np.where(invisible[:, None], np.nan, positions)
        if self.options.project:
            if not angles([self.names_by_role.get(axis, axis) for axis in self.plain]):
                got = f"{self.names_by_role.get('x', 'x')} and {self.names_by_role.get('y', 'y')}"
                rule = "be given for longitude and latitude"
                refuse("project", rule, got, place=self.sheet.origin)
            positions, doubts = projected(positions, self.sheet.origin)
            return positions, choices + doubts
        if angles([self.names_by_role.get(axis, axis) for axis in self.plain]):
            remedy: Text = ("To bring degrees into a plane, add ", Setting("project", True), ".")
            rule = "have positions in a plane"
            raise refusal(rule, "degrees of longitude and latitude", self.sheet.origin, remedy)
        return positions * CM_PER_UNIT.get(self._stated_unit(), 1.0), choices

    def rows_of_somebody(self, who: str) -> tuple[np.ndarray, list[str]]:
        """Return the numbers of the rows that are of somebody in the column `who`, and in words what is left out."""
        rows = self.visible()
        words = []
        hidden = self._rows() - len(rows)
        if hidden:
            words.append(f"{hidden} rows are left out as not visible")
        if self.layout.untracked and who:
            named_rows = [row for row in rows if self.words[who][row].lower() not in UNTRACKED]
            if not named_rows:
                rule = f"name the track of a row in the column {self.names_by_role.get(who, who)}"
                raise refusal(rule, "none", self.sheet.origin, "Link what was detected to tracks.")
            if len(named_rows) < len(rows):
                words.append(
                    f"{len(rows) - len(named_rows)} rows are left out: they are of no track"
                )
            rows = np.array(named_rows)
        return rows, words

    def _rows(self) -> int:
        if self.when in self.words:
            return len(self.words[self.when])
        return len(self.numbers["frame"])

    def visible(self) -> np.ndarray:
        """Return the numbers of the rows that a column does not call invisible, as outliers in tables of Movebank."""
        if OUTSIDE in self.words:
            return np.flatnonzero([not word or _says_no(word) for word in self.words[OUTSIDE]])
        if VISIBLE not in self.words:
            return np.arange(self._rows())
        return np.flatnonzero([not _says_no(word) for word in self.words[VISIBLE]])

    def individuals(self, frames: np.ndarray, positions: np.ndarray) -> tuple[str, list[str]]:
        """Return the column that names the individuals, empty if there is none, and in words why it does."""
        if len(self.who) < 2:
            return "".join(self.who), []
        columns = {name: self.words[name] for name in self.who}
        name, why = choose_individuals(columns, frames, positions, self.sheet.origin)
        return name, [why] if why else []

    def extras(self, positions: np.ndarray) -> tuple[dict[str, np.ndarray], list[str]]:
        """Return headings (rad) and confidence (rows,) by the names of `Recording`, and in words what is left out."""
        extras = {}
        doubts = []
        for name in self.extra:
            values = self.numbers[name]
            unknown = np.isnan(values) & ~np.isnan(positions[:, 0])
            refuse_first(unknown, self.sheet.at, f"give `{name}` wherever it gives x and y", "none")
            extras[EXTRAS[name]] = values
        if self.layout.against_y and "headings" in extras:
            extras["headings"] = -extras["headings"]
        if self.turned:
            quaternion = np.column_stack([self.numbers[name] for name in QUATERNION])
            # far beyond 1, so that no square is too large
            x, y, z, w = np.clip(quaternion, -10, 10).T
            wrong = ~(np.abs(x**2 + y**2 + z**2 + w**2 - 1) < QUATERNION_ERROR) & ~np.isnan(
                positions[:, 0]
            )
            if wrong.any():
                doubts.append(
                    f"headings are left out: {wrong.sum()} orientations are no unit quaternions"
                )
            else:
                extras["headings"] = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2))
        return extras, doubts

    def read_from(self, who: str) -> dict[str, str]:
        """Return role -> name of the column, as the file spells it."""
        spelled = dict(zip(self.names, self.sheet.names, strict=True))
        clock = "frame" if self.when == "frame" else "time"
        roles = {clock: self.when}
        if who:
            roles["id"] = who
        roles |= self.box or dict(zip(self.plain, self.plain, strict=True))
        roles |= dict(zip(self.extra, self.extra, strict=True))
        return {role: spelled[name] for role, name in roles.items()}

    def unread(self, who: str) -> list[str]:
        """Return the columns that are not used, as the file spells them."""
        read = {*self.wanted, self.when, who, *self.clock, *self.recording_columns, *self.hidden}
        if self._units_in_cells():
            read.add(UNIT)
        pairs = zip(self.names, self.sheet.names, strict=True)
        return [spelled for name, spelled in pairs if spelled and name not in read]


UNTRACKED = ("", "none", "nan", "na")
"""What cells say in small letters where a detection is of no track."""


def _refuse_bodies(
    names: Sequence[str], roles: Mapping[str, str], layout: Layout, sheet: Sheet
) -> None:
    """Refuse positions of several bodies in the same row, as if all but the first were no positions."""
    for pattern in layout.columns["x"]:
        fitting = [name for name in names if re.fullmatch(pattern, name)]
        if roles["x"] in fitting and len(fitting) > 1:
            x, y = (roles[axis] for axis in ("x", "y"))
            remedy: Text = ("Say which, for example ", Setting("columns", {"x": x, "y": y}), ".")
            raise refusal("have one position in a row", ", ".join(fitting), sheet.origin, remedy)


QUATERNION = ("qx", "qy", "qz", "qw")
QUATERNION_ERROR = 0.1
"""By how much the squares of a unit quaternion may differ from 1 in sum."""
CORNER, OUTSIDE = "xtl", "outside"
"""Columns of CVAT: a corner of a box, and whether the individual is out of the image and the box that of before."""
MISSING, VISIBLE = "missing", "visible"
"""Columns that say which rows hold no position: 1 where it is missing, false where it is not visible."""
UNIT = "unit"
"""Column that says in which unit positions are, as Imaris writes it."""
NO = ("false", "f", "no", "")


def _says_no(word: str) -> bool:
    """Return whether a cell says no: by a word, or by 0, which TRex writes as 0.000."""
    return word.lower() in NO or number_of(word) == 0


def _name_by_file(source: object) -> str:
    """Return the name of the individual of a file, which programs number at its end, as fish3 of video_fish3.csv."""
    stem = Path(str(source).rpartition(":")[0]).stem
    return stem.rpartition("_")[2] or stem


def _positions(
    columns: Mapping[str, np.ndarray], plain: Sequence[str], box: Mapping[str, str], stated: bool
) -> tuple[np.ndarray, list[str]]:
    """Return positions (rows, 2), and in words if they are others than those in `plain` columns.

    They are the centers of boxes if that is `stated`, or if x and y are fixed, as -1, -1 in tables of
    MOT, or are the corner of the box.
    """
    sides = {side: columns[name] for side, name in box.items()}
    if plain:
        positions = np.column_stack([columns[name] for name in plain])
        if not box:
            return positions, []
        corner = np.column_stack([sides["left"], sides["top"]])
        fixed = (positions == positions[0]).all()
        if not (stated or fixed or np.array_equal(positions, corner, equal_nan=True)):
            return positions, []
    listed = ", ".join(box.values())
    return centers(sides), [f"positions are the centers of the boxes in the columns {listed}"]


def _even(times: np.ndarray, name: str) -> Text:
    """Return how times (rows,) that are uneven become even; `name` says their unit."""
    # In the order of the file, in which times of an individual often stand together
    steps = np.abs(np.diff(times[np.abs(times) <= LARGEST_TIME]))
    steps = steps[steps > 0]
    if not len(steps):
        return ""
    rate = rounded(IN_UNITS.get(name, 1.0) / float(np.median(steps)))
    return "If times are uneven, make them even by ", Setting("resample", rate), "."


def _rate_beside(
    times: Sequence[str], frames: np.ndarray, fps: float | None, file: object, name: str
) -> float | None:
    """Return the frame rate that a column of times beside frame numbers states, if it does."""
    order = np.argsort(frames, kind="stable")
    seconds = np.array([number_of(time.strip()) for time in times])
    if not np.isfinite(seconds).any():
        # dates or clocks; what is none states no rate
        with suppress(RefusedError):
            seconds, _ = seconds_of(times, f"{file}, row {{}}".format)
            name = "seconds"
    seconds = seconds[order]
    rate = stated_rate(seconds, frames[order])
    finite = seconds[np.isfinite(seconds)]
    # they may count frames, too
    if rate is None or (rate == 1 and (finite == np.floor(finite)).all()):
        return None
    return rounded(rate * per_second(rate, fps, file, name))
