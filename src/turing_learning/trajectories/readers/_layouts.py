"""What programs call the columns of their tables, and units that stand in names of columns."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from .._recording import Recording, YAxis
from ._columns import WHO
from ._times import TIME

CM_PER_UNIT = {
    "cm": 1.0, "mm": 0.1, "m": 100.0, "um": 1e-4, "\N{MICRO SIGN}m": 1e-4, "\N{GREEK SMALL LETTER MU}m": 1e-4,
    "micron": 1e-4, "microns": 1e-4, "micrometer": 1e-4, "micrometers": 1e-4, "micrometre": 1e-4, "micrometres": 1e-4,
    "millimeter": 0.1, "millimeters": 0.1, "millimetre": 0.1, "millimetres": 0.1,
    "centimeter": 1.0, "centimeters": 1.0, "centimetre": 1.0, "centimetres": 1.0,
    "meter": 100.0, "meters": 100.0, "metre": 100.0, "metres": 100.0,
}  # fmt: skip
"""Units of length that names of columns, or header lines, state, in cm."""
_LENGTHS = "|".join(CM_PER_UNIT)
_UNIT = re.compile(rf"(.*?)(?:[ _]*[\[(]({_LENGTHS}|px|pixels?)[\])]|[ _/](mm|cm|m|um|px))")
"""A name with a unit at its end: x (cm), x [mm], x_cm, x/m."""
_POSITION = re.compile(
    r"(?:value\.)?(?:(?:pos(?:ition)?|cent(?:er|re|roid))[. _-]*|c)?([xyz])(?:[ _-]?(?:cent(?:er|re|roid)|pos(?:ition)?|up))?"
)
"""A name of a coordinate without its unit: x, pos. x, position_x, centroid_x, cx, x center, value.centroid.x of Bonsai,
y up of tables of virtual animals."""
UPWARDS = re.compile(r"y up .*")
"""A name of y that states its direction: y up (cm)."""
_ANGLES = {
    "x": re.compile(r"lon|lng|long|longitude|location[-_]long"),
    "y": re.compile(r"lat|latitude|location[-_]lat"),
}
"""Names of degrees of longitude and latitude."""


@dataclass(frozen=True)
class Layout:
    """How a program calls the columns of a table with a row for each individual and frame."""

    name: str = "tidy"
    #: Role -> patterns of names in small letters, the first that fits counts
    columns: Mapping[str, Sequence[str]] = field(default_factory=dict)
    who: Sequence[str] = WHO  #: Names of columns that may name the individuals
    y_axis: YAxis | None = None  #: Direction of y, None where programs differ
    unit: str = ""  #: Of positions, where names do not state it
    extras: bool = True  #: Whether there are headings and confidences
    against_y: bool = False  #: Whether headings are counted from x against y of the file
    absent: Sequence[str] = ()  #: What cells say besides the usual words where there is no position
    untracked: bool = (
        False  #: Whether rows without an individual are detections that belong to nobody
    )
    #: Names that it needs besides, where a table of one's own may call positions alike
    needs: Sequence[str] = ()
    single: bool = False  #: Whether a second column that fits a pattern of x is of another body

    def roles(self, names: Sequence[str]) -> dict[str, str]:
        """Return role -> name of the columns that this layout has among names in small letters."""
        columns = {}
        for role, patterns in self.columns.items():
            for pattern in patterns:
                fitting = [name for name in names if re.fullmatch(pattern, name)]
                if fitting:
                    columns[role] = fitting[0]
                    break
        return columns

    def fits(self, names: Collection[str]) -> bool:
        """Return whether a table has the columns that this layout needs: of time or frames, and of positions."""
        roles = self.roles(sorted(names))
        return (
            {*self.needs} <= {*names}
            and {"x", "y"} <= roles.keys()
            and not roles.keys().isdisjoint(("frame", "time"))
        )


TIDY = Layout()
# Sridhar, Roche and Gingins 2019, Methods in Ecology and Evolution 10; in pixels
TRACKTOR = Layout(
    "tracktor",
    {"frame": ["frame"], "x": ["pos_x"], "y": ["pos_y"], "z": ["pos_z"]},
    y_axis="down",
    extras=False,
)
# Ershov et al. 2022, TrackMate 7, Nature Methods 19; a table of spots, y of images
TRACKMATE = Layout(
    "trackmate",
    {
        "frame": ["frame"],
        "time": ["position_t"],
        "x": ["position_x"],
        "y": ["position_y"],
        "z": ["position_z"],
    },
    who=("track_id",),
    needs=("track_id",),
    y_axis="down",
    untracked=True,
)
_PLAIN = {"frame": ["frame"], "time": ["time"], "x": ["x"], "y": ["y"]}
# Chiara and Kim 2023, AnimalTA, Methods in Ecology and Evolution 14
ANIMALTA_ROWS = Layout("animalta", _PLAIN, who=("ind",), y_axis="down", extras=False)
# Romero-Ferrero et al. 2019, idtracker.ai, Nature Methods 16; trajectories_tidy.csv
IDTRACKER_ROWS = Layout(
    "idtracker.ai-csv", _PLAIN, who=("individual",), y_axis="down", extras=False
)
# Gallois and Candelier 2021, FastTrack, PLoS Computational Biology 17; y of images
FASTTRACK = Layout(
    "fasttrack",
    {"frame": ["imagenumber"], "x": ["xbody"], "y": ["ybody"], "heading": ["tbody"]},
    who=("id",),
    y_axis="down",
    against_y=True,
)
# Walter and Couzin 2021, TRex, eLife 10; a file for each individual
TREX = Layout(
    "trex-csv",
    {
        "frame": ["frame"],
        "x": [r"x#wcentroid( \((cm|px)\))?", r"x#p?centroid( \((cm|px)\))?"],
        "y": [r"y#wcentroid( \((cm|px)\))?", r"y#p?centroid( \((cm|px)\))?"],
    },
    y_axis="down",
    unit="cm",
    extras=False,
    absent=("inf", "-inf", "infinity", "-infinity"),
)
# Rodriguez et al. 2018, ToxTrac, Methods in Ecology and Evolution 9; with a header line
TOXTRAC = Layout(
    "toxtrac-csv",
    {"time": [r"time \(sec\)"], "x": [r"pos\. x \(.*\)"], "y": [r"pos\. y \(.*\)"]},
    who=("track",),
    y_axis="down",
)
# `rostopic echo -p`, bagpy and PlotJuggler; REP 103: m, y to the left
ROS = Layout(
    "ros-csv",
    {
        "time": ["%time", "__time", "time"],
        # the last ones are those of poses in a plane, as of turtlesim
        "x": [r".*position[./]x", r"(.*pose|field)[./]x"],
        "y": [r".*position[./]y", r"(.*pose|field)[./]y"],
        "z": [r".*position[./]z"],
        "heading": [r"(.*pose|field)[./]theta"],
        "qx": [r".*orientation[./]x"],
        "qy": [r".*orientation[./]y"],
        "qz": [r".*orientation[./]z"],
        "qw": [r".*orientation[./]w"],
    },
    who=(),
    y_axis="up",
    unit="m",
    single=True,
)
# Kays et al. 2022, The Movebank system, Methods in Ecology and Evolution 13; degrees, UTC
MOVEBANK = Layout(
    "movebank",
    {"time": ["timestamp"], "x": [r"location[-_]long"], "y": [r"location[-_]lat"]},
    who=(
        "individual-local-identifier",
        "individual_local_identifier",
        "tag-local-identifier",
        "tag_local_identifier",
    ),
    y_axis="up",
    extras=False,
)
LAYOUTS = (TRACKTOR, TRACKMATE, FASTTRACK, TREX, TOXTRAC, ROS, MOVEBANK)
"""Those of programs, which are no tables of one's own."""


FRAME = re.compile(
    r"(video[ _])?frames?[ _]?(id|idx|index|number|num|no\.?|nr\.?|#)?|fr|slice( n\N{DEGREE SIGN})?|"
    r"image|imagen|fotograma|bild"
)
"""Names of columns of frame numbers, in small letters, those of ImageJ and in other languages among them."""


def frame_column(names: Collection[str]) -> str:
    """Return the one column of frame numbers of a table that has neither "frame" nor times; empty if there is none."""
    lower = [name.lower() for name in names]
    if not {"frame", *TIME}.isdisjoint(lower):
        return ""
    fitting = [name for name in names if FRAME.fullmatch(name.lower())]
    return fitting[0] if len(fitting) == 1 else ""


def unit_of(name: str) -> str:
    """Return the unit of length that the name of a column ends with, as "cm" of "x (cm)"; empty if there is none."""
    match = _UNIT.fullmatch(name)
    unit = (match[2] or match[3]) if match else ""
    return "px" if unit.startswith("p") else unit


def in_unit(recording: Recording, unit: str) -> Recording:
    """Return a recording whose positions are in a unit, in cm where it is a length."""
    if unit not in CM_PER_UNIT:
        return replace(recording, unit=None)
    return replace(recording, positions=recording.positions * CM_PER_UNIT[unit], unit="cm")


def plain_roles(names: Sequence[str], *, project: bool) -> dict[str, str]:
    """Return role -> name of the columns of positions that a table of one's own may call otherwise than x and y.

    Names are in small letters. Degrees of longitude and latitude are positions where they are to be projected.
    """
    if {"x", "y"} <= set(names):
        return {}
    roles: dict[str, str] = {}
    several = len([name for name in names if re.fullmatch(r".+[ _.:]x", name)]) > 1
    for name in names:
        if several and name.startswith("cent"):
            continue  # center_x beside tail_x is a point of several, or an individual
        unit = unit_of(name)
        match = _UNIT.fullmatch(name) if unit else None
        bare = match[1].strip() if match else name
        axis = _POSITION.fullmatch(bare)
        if axis and (unit or bare != axis[1]):
            roles.setdefault(axis[1], name)
    if {"x", "y"} <= roles.keys():
        return roles
    return angles(names) if project else {}


def angles(names: Sequence[str]) -> dict[str, str]:
    """Return role -> name of columns of longitude and latitude; nothing unless there are both."""
    columns: dict[str, str] = {}
    for role, pattern in _ANGLES.items():
        for name in names:
            if pattern.fullmatch(name):
                columns.setdefault(role, name)
    return columns if len(columns) == len(_ANGLES) else {}
