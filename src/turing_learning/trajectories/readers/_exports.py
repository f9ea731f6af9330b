"""Exports that are no plain tables: EthoVision XT, GPX, folders of idtracker.ai and of TRex."""

import io
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from turing_learning.errors import brief, require

from .._recording import Format, Options, Recording, natural, refusal
from ._arrays import refuse_large, whole
from ._layouts import TREX, Layout, in_unit
from ._long import read_long
from ._sheets import HEAD_BYTES, MISSING, UNENDED, encoding_of, number_of, separator_of, sheet_of
from ._tables import frame_sheet, names_of
from ._times import IN_UNITS, UNITS_OF_TIME, rounded

if TYPE_CHECKING:
    from .._recording import Glance

_HEADER_LINES = re.compile(r'"?Number of header lines:"?[;,\t] ?"?([0-9]{1,4})"?', re.IGNORECASE)
"""First line of what EthoVision XT exports."""
CENTER = "center"
CUT = "The file may be cut off or damaged."
MOST_BYTES = 1 << 30
"""Size of a text that is opened as a whole."""


def _is_ethovision(glance: "Glance") -> bool:
    return bool(glance.lines) and _HEADER_LINES.match(glance.lines[0]) is not None


def _text_of(path: Path) -> str:
    """Return a text as a whole."""
    refuse_large(path, MOST_BYTES)
    raw = path.read_bytes()
    return raw.decode(encoding_of(raw[:HEAD_BYTES]), errors="replace")


def read_ethovision(path: Path, options: Options) -> Recording:
    """Read raw data of EthoVision XT: lines of facts, names and units of columns, a row for each sample.

    Positions are those of the center point unless `keypoint` says otherwise; y grows upwards. Source: Noldus,
    EthoVision XT reference manual, export of raw data.
    """
    import pandas as pd

    text = _text_of(path)
    lines = text.splitlines()
    unended = not text.endswith(("\n", "\r"))
    if unended:
        lines.pop()
    match = _HEADER_LINES.match(lines[0]) if lines else None
    count = int(match[1]) if match else 0
    if not 2 <= count < len(lines):
        raise refusal("have as many header lines as it says, and rows below", count, f"{path}:1")
    separator = separator_of(lines[0])
    header = []
    for line in lines[:count]:
        header.append([cell.strip().strip('"') for cell in line.split(separator)])
    facts = {}
    for fact, *values in header[: count - 2]:
        if values:
            facts[fact.rstrip(":").lower()] = values[0]
    names = [name.lower() for name in header[count - 2]]
    units = dict(zip(names, header[count - 1], strict=False))
    points = [name[2:] for name in names if name.startswith("x ") and f"y {name[2:]}" in names]
    time = "trial time" if "trial time" in names else "recording time"
    if time not in names or not points:
        rule = "have the columns Trial time, X center and Y center"
        raise refusal(rule, ", ".join(filter(None, names)), f"{path}:{count - 1}")
    usual = CENTER if CENTER in points else points[0]
    point = options.keypoint or usual
    rule = f"be one of {', '.join(points)}"
    require(point in points, "keypoint", rule, brief(point), place=str(path))
    x, y = f"x {point}", f"y {point}"
    fewest = len(list(filter(None, names)))
    for number, line in enumerate(lines[count:], count + 1):
        if line.strip() and line.count(separator) + 1 < fewest:
            cells = f"{line.count(separator) + 1} cells"
            raise refusal(f"have {fewest} cells in each row", cells, f"{path}:{number}", CUT)
    body = "\n".join(lines[count:]) + "\n"
    decimal = "," if separator != "," and "." not in body else "."
    with whole("EthoVision", path):
        table = pd.read_csv(
            io.StringIO(body), sep=separator, header=None, index_col=False, usecols=range(len(names)),
            na_values=[*MISSING, *map(str.upper, MISSING)], decimal=decimal, skip_blank_lines=True,
        )  # fmt: skip
    columns = [table[names.index(name)] for name in (time, x, y)]
    rows = pd.DataFrame(dict(zip(("time (s)", "x", "y"), columns, strict=True)))
    of_times = Options(fps=options.fps, resample=options.resample, project=options.project)
    recording = read_long(frame_sheet(rows, str(path)), of_times)
    who = facts.get("subject name") or "1"
    # the table has one individual because the file does, and not for want of a column
    remarks = [line for line in recording.remarks if not line.startswith("without a column id")]
    if unended:
        remarks.append(UNENDED)
    return replace(
        in_unit(recording, units.get(x, "").lower()),
        individuals=(who,),
        y_axis="up",
        columns={"time": time, "x": x, "y": y},
        unread=tuple(name for name in names if name and name not in (time, x, y)),
        remarks=tuple(remarks),
    )


GPX = Layout(
    "gpx", {"time": ["time"], "x": ["lon"], "y": ["lat"]}, who=("id",), y_axis="up", extras=False
)


def _is_gpx(glance: "Glance") -> bool:
    return any("<gpx" in line.lower() for line in glance.lines)


def read_gpx(path: Path, options: Options) -> Recording:
    """Read the points of tracks in GPX, by longitude, latitude and time; a track is an individual.

    Source: GPX 1.1 Schema Documentation, topografix.com.
    """
    import pandas as pd

    root = xml_root(path, "GPX")
    tracks = root.findall("{*}trk")
    rows = []
    for number, track in enumerate(tracks, 1):
        name = track.findtext("{*}name", "").strip() or str(number)
        for point in track.iterfind("{*}trkseg/{*}trkpt"):
            time = point.findtext("{*}time", "").strip()
            rows.append((name, time, point.get("lon"), point.get("lat")))
    if not rows:
        remedy = "Waypoints and routes are no recordings: export the track."
        raise refusal("hold points of tracks (trkpt)", "none", path, remedy)
    timeless = [row for row in rows if not row[1]]
    if timeless:
        got = f"{len(timeless)} points without one"
        raise refusal("give a time for each point", got, path, "Export the track with its times.")
    table = pd.DataFrame(rows, columns=["id", "time", "lon", "lat"])
    return read_long(frame_sheet(table, str(path)), options, GPX)


def _is_trackmate_xml(glance: "Glance") -> bool:
    return any(re.match(r"\s*<(Tracks|TrackMate)[ >]", line) for line in glance.lines)


def read_trackmate_xml(path: Path, options: Options) -> Recording:
    """Read what TrackMate exports by "Export tracks to XML file": a particle for each track, with its detections.

    Source: Ershov et al. 2022, TrackMate 7, Nature Methods 19; its documentation of the export.
    """
    import pandas as pd

    root = xml_root(path, "XML")
    if root.tag == "TrackMate":
        remedy = "Give what TrackMate exports: its spots as CSV, or its tracks as XML."
        raise refusal("hold tracks", "the session of TrackMate itself", path, remedy)
    rows = []
    for number, particle in enumerate(root.findall("particle")):
        for spot in particle.findall("detection"):
            rows.append((str(number), *map(spot.get, "txyz")))
    if not rows:
        raise refusal("hold detections of particles", "none", path)
    table = pd.DataFrame(rows, columns=["id", "frame", "x", "y", "z"])
    recording = read_long(frame_sheet(table, str(path)), replace(options, columns={"id": "id"}))
    recording = in_unit(recording, root.get("spaceUnits", "").lower())
    return replace(recording, y_axis="down", fps=_rate_of(root, path))


def _rate_of(root: ElementTree.Element, path: Path) -> float | None:
    """Return frames per second by the stated interval; None where it is 1, as where nobody has set it."""
    name = UNITS_OF_TIME.get(root.get("timeUnits", "").lower(), "")
    interval = number_of(root.get("frameInterval", ""))
    if not name or np.isnan(interval) or interval == 1:
        return None
    if not 0 < interval < np.inf:
        rule = "state an interval above 0"
        raise refusal(rule, root.get("frameInterval"), f"{path}, frameInterval")
    return rounded(IN_UNITS[name] / interval)


def xml_root(path: Path, format_name: str) -> ElementTree.Element:
    """Return the root of an XML file that is whole."""
    refuse_large(path, MOST_BYTES)
    with whole(format_name, path):
        return ElementTree.parse(path).getroot()


TRACKMATE_XML_FORMAT = Format("trackmate-xml", _is_trackmate_xml, read_trackmate_xml)
ETHOVISION_FORMAT = Format(
    "ethovision", _is_ethovision, read_ethovision, has_keypoints=True, has_times=True
)
GPX_FORMAT = Format("gpx", _is_gpx, read_gpx, has_times=True)


def _is_trex_csv(glance: "Glance") -> bool:
    return TREX.fits(names_of(glance))


def read_trex_csv(path: Path, options: Options) -> Recording:
    """Read what TRex exports as CSV, a file for each individual, or the folder of them."""
    files = csv_files(path) if path.is_dir() else [path]
    recordings = [read_long(sheet_of(file, absent=TREX.absent), options, TREX) for file in files]
    return joined(recordings, path)


def csv_files(folder: Path) -> list[Path]:
    """Return the CSV files of a folder, in natural order; nothing that is no file, such as a pipe, is opened."""
    files = filter(Path.is_file, folder.glob("*.csv"))
    return sorted(files, key=lambda file: natural(file.name))


def joined(recordings: Sequence[Recording], path: Path) -> Recording:
    """Return recordings of one individual each, in the same frames, as one."""
    earliest, *later = recordings
    if not later:
        return earliest
    names: list[str] = []
    remarks: list[str] = []
    choices: list[str] = []
    for recording in recordings:
        names += recording.individuals
        remarks += recording.remarks
        choices += recording.choices
    if len(set(names)) < len(names):
        raise refusal("have files whose names end with different numbers", ", ".join(names), path)
    begin = min(recording.first_frame for recording in recordings)
    stop = max(recording.first_frame + len(recording.positions) for recording in recordings)
    positions = np.full((stop - begin, len(names), 2), np.nan)
    for who, recording in enumerate(recordings):
        start = recording.first_frame - begin
        positions[start : start + len(recording.positions), who] = recording.positions[:, 0]
    rates = {recording.fps for recording in recordings}
    if len(rates) > 1:
        raise refusal("state one frame rate for all individuals", sorted(map(str, rates)), path)
    return replace(
        earliest,
        positions=positions,
        individuals=tuple(names),
        first_frame=begin,
        # what holds for several files is said once
        remarks=tuple(dict.fromkeys(remarks)),
        choices=tuple(dict.fromkeys(choices)),
    )


TREX_CSV_FORMAT = Format(TREX.name, _is_trex_csv, read_trex_csv, has_columns=True, has_times=True)

SESSION_FILES = ("without_gaps", "validated", "trajectories", "with_gaps")
"""Beginnings of names of files in a folder of idtracker.ai, those with most corrections first."""
SESSION_SUFFIXES = (".h5", ".csv", ".npy")


TOXTRAC_FILES = ("Tracking_RealSpace*.txt", "Tracking_*.txt", "Tracking.txt")
"""Names of the tracks among what ToxTrac writes, a file for each arena; those in mm come first."""


def toxtrac_file(folder: Path) -> Path | None:
    """Return the file of tracks in a folder of ToxTrac; None if there is none. Several arenas are refused."""
    for pattern in TOXTRAC_FILES:
        files = sorted(filter(Path.is_file, folder.glob(pattern)), key=lambda file: file.name)
        if len(files) > 1:
            # individuals of different arenas are no neighbors
            names = ", ".join(file.name for file in files)
            remedy = "Give the files, each of which is a recording."
            raise refusal("have the tracks of one arena", names, folder, remedy)
        if files:
            return files[0]
    return None


def session_file(folder: Path) -> Path | None:
    """Return the file of trajectories in a folder of idtracker.ai: HDF5 before CSV before npy; None if there is none."""
    candidates: list[tuple[int, int, str, Path]] = []
    for pattern in ("*", "*/*", "*/*/*"):
        for file in folder.glob(pattern):
            begins = [k for k, name in enumerate(SESSION_FILES) if file.stem.startswith(name)]
            if file.suffix in SESSION_SUFFIXES and begins and file.is_file():
                candidates.append((SESSION_SUFFIXES.index(file.suffix), begins[0], str(file), file))
    return min(candidates)[-1] if candidates else None
