"""Positions as they were measured to those that are used: projected from the globe, evenly spaced in time."""

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from turing_learning.errors import Setting, refuse

from .._recording import MOST_CELLS, natural, refusal

EQUATOR_M = 6_378_137.0
"""Radius of the earth at the equator (m), World Geodetic System 1984."""
ECCENTRICITY_SQUARED = 0.00669437999
"""Square of the first eccentricity of the same ellipsoid."""
FARTHEST_CM = 5e7
"""Extent (cm) up to which the plane is close to the globe: at 500 km distances are off by less than 1 % up to a
latitude of 60 degrees."""
WIDEST_GAP = 2.0
"""Typical intervals, or those that are asked for, up to which motion between two positions is taken as straight."""


def projected(degrees: np.ndarray, file: object) -> tuple[np.ndarray, list[str]]:
    """Return positions (rows, 2) in cm, x to the east and y to the north, of longitudes and latitudes (rows, 2).

    The plane touches the ellipsoid at their median; distances are those along its two radii of curvature
    there. Also return in words what is to be doubted.

    Source: J. P. Snyder, Map projections: a working manual, US Geological Survey 1987, equations 4-18 to 4-20.
    """
    located = ~np.isnan(degrees).any(axis=1)
    if not located.any():
        return degrees, []
    if (np.abs(degrees[located, 1]) > 90).any() or (np.abs(degrees[located, 0]) > 360).any():
        bad = degrees[located][(np.abs(degrees[located]) > [360, 90]).any(axis=1)][0]
        rule = "have degrees of longitude and latitude"
        raise refusal(rule, bad.tolist(), file, "See whether they are exchanged.")
    first_longitude = degrees[located][0, 0]
    longitude = first_longitude + (degrees[:, 0] - first_longitude + 180) % 360 - 180
    middle = np.array([np.nanmedian(longitude), np.nanmedian(degrees[:, 1])])
    latitude = np.radians(middle[1])
    share = 1 - ECCENTRICITY_SQUARED * np.sin(latitude) ** 2
    east = EQUATOR_M * np.cos(latitude) / np.sqrt(share)
    north = EQUATOR_M * (1 - ECCENTRICITY_SQUARED) / share**1.5
    away = np.radians(np.column_stack([longitude, degrees[:, 1]]) - middle)
    positions = 100 * away * [east, north]
    doubts = []
    extent = float(np.ptp(positions[located], axis=0).max())
    if extent > FARTHEST_CM:
        doubts.append(
            f"positions are {extent / 1e5:.0f} km apart, on a plane around ({middle[0]:.5g}, {middle[1]:.5g})"
        )
    return positions, doubts


def resampled(
    times: np.ndarray,
    who: Sequence[str],
    positions: np.ndarray,
    extras: Mapping[str, np.ndarray],
    fps: float,
    file: object,
) -> tuple[np.ndarray, list[str], np.ndarray, dict[str, np.ndarray]]:
    """Return rows at evenly spaced times: frames, individuals, positions and extras; between rows motion is straight.

    Parameters
    ----------
    times : (rows,)
        In s.
    who, positions : (rows,), (rows, 2)
        Individuals and their positions.
    extras
        "confidence" and "headings" (rows,), the latter in rad; they turn the shorter way.
    fps
        Times per second.
    file
        Where the rows are from.
    """
    begin = float(times.min())
    count = (float(times.max()) - begin) * fps
    if count > MOST_CELLS:
        rule = f"make at most {MOST_CELLS} frames"
        refuse("resample", rule, f"{fps:g} per second, {count:.0f} frames", place=str(file))
    turned = dict(extras)
    if "headings" in turned:
        # as points of a circle, between which a heading turns the shorter way
        turned["headings"] = np.exp(1j * turned["headings"])
    tracks: list[tuple[np.ndarray, list[str], np.ndarray, dict[str, np.ndarray]]] = []
    names = np.asarray(who, dtype=object)
    for name in sorted(set(who), key=natural):
        rows = np.flatnonzero((names == name) & ~np.isnan(positions).any(axis=1))
        rows = rows[np.argsort(times[rows], kind="stable")]
        # Of several rows at one time the first counts
        own_times, first_rows = np.unique(times[rows], return_index=True)
        rows = rows[first_rows]
        if len(own_times) < 2:
            continue
        # All individuals share the moments, counted from the earliest time
        frames = np.arange(
            np.ceil((own_times[0] - begin) * fps - 1e-6),
            np.floor((own_times[-1] - begin) * fps + 1e-6) + 1,
        )
        at = begin + frames / fps
        after = np.clip(np.searchsorted(own_times, at), 1, len(own_times) - 1)
        # Nothing is made up where somebody was lost for long
        widest = WIDEST_GAP * max(float(np.median(np.diff(own_times))), 1 / fps)
        near = own_times[after] - own_times[after - 1] <= widest
        frames = frames[near]
        at = at[near]
        points = np.column_stack(
            [np.interp(at, own_times, positions[rows, axis]) for axis in range(2)]
        )
        values_at = {}
        for extra, values in turned.items():
            if extra == "headings":
                east = np.interp(at, own_times, values[rows].real)
                north = np.interp(at, own_times, values[rows].imag)
                values_at[extra] = np.arctan2(north, east)
            else:
                values_at[extra] = np.interp(at, own_times, values[rows])
        tracks.append((frames, [name] * len(frames), points, values_at))
    if not sum(len(frames) for frames, *_ in tracks):
        remedy = ("Resample at a lower rate: ", Setting("resample"), ".")
        rule = "have two positions of somebody near to each other in time"
        raise refusal(rule, "none", file, remedy)
    frames = np.concatenate([track[0] for track in tracks])
    individuals = list(chain.from_iterable(track[1] for track in tracks))
    points = np.concatenate([track[2] for track in tracks])
    joined = {}
    for extra in extras:
        joined[extra] = np.concatenate([track[3][extra] for track in tracks])
    return frames, individuals, points, joined
