"""How individuals respond to the nearest other and to the wall: maps, as the field draws them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.arrays import check_tank
from turing_learning.errors import integer, number, refuse, require

from ._signals import nearest_others, wrap
from ._trajectories import Trajectories

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LAG_S = 0.2
"""Time (s) over which a course is measured: shorter ones show the tracker's noise. Katz and others used 0.2 s."""
SLOWEST = 0.1
"""Share of the median speed below which an individual has no course."""
USUAL_CELLS = 15
"""Cells along each side of a map."""
WIDEST = 3.0
"""Median distances of the nearest other that a map reaches to each side."""
FEWEST_MOMENTS = 20
"""Moments in a cell from which on its mean is compared."""


@dataclass(frozen=True, eq=False)
class ResponseMaps:
    """Mean responses, cell by cell: to where the nearest other is, and to where the wall is.

    In the maps of the nearest other the individual is in the middle and moves upwards; rows go from behind to ahead
    of it, columns from its left to its right. In that of the wall rows go from near to far, and columns are the
    direction of the wall: 0 is ahead, positive ones are on the left. Turns are positive to the left.

    Source
    ------
    Y. Katz and others, PNAS 108 (2011) 18720; D. S. Calovi and others, PLoS Computational Biology 14 (2018) e1005933.
    """

    edges_cm: np.ndarray  #: (B + 1,): Edges of the cells, ahead and to the right (cm)
    turning: np.ndarray  #: (B, B): Rate of turning (rad/s); NaN where nobody was
    acceleration: np.ndarray  #: (B, B): Change of speed (cm/s^2); NaN where nobody was
    moments: np.ndarray  #: (B, B): How many moments there were
    wall_edges_cm: np.ndarray  #: (W + 1,): Edges of the distances of the wall (cm)
    wall_angles: np.ndarray  #: (V + 1,): Edges of the directions of the wall (rad)
    wall_turning: np.ndarray  #: (W, V): Rate of turning (rad/s); NaN where nobody was
    wall_moments: np.ndarray  #: (W, V): How many moments there were

    def agreement(self, other: "ResponseMaps") -> dict[str, float]:
        """Return for each map the correlation with another's over cells, weighted by moments.

        Only cells with 20 moments or more in both count; NaN where there are fewer than three.
        """
        for name in ("edges_cm", "wall_edges_cm", "wall_angles"):
            same = np.array_equal(getattr(self, name), getattr(other, name))
            require(same, "other", "have the same cells (`like`)", "others")
        neighbor = np.minimum(self.moments, other.moments)
        wall = np.minimum(self.wall_moments, other.wall_moments)
        return {
            "turning": _correlation(self.turning, other.turning, neighbor),
            "acceleration": _correlation(self.acceleration, other.acceleration, neighbor),
            "wall_turning": _correlation(self.wall_turning, other.wall_turning, wall),
        }


def response_maps(
    recordings: Trajectories | Sequence[Trajectories],
    *,
    tank_cm: tuple[float, float] | None = None,
    lag_s: float = LAG_S,
    cells: int = USUAL_CELLS,
    like: ResponseMaps | None = None,
) -> ResponseMaps:
    """Return how individuals respond to the nearest other, and to the walls of a rectangular tank.

    Parameters
    ----------
    recordings
        What was recorded or simulated, in cm, of two individuals or more.
    tank_cm
        Width and height (cm) of the tank, one corner of which is the origin; by default it is as large as the places
        where individuals have been.
    lag_s
        Time (s) over which courses and speeds are measured, before and after each moment.
    cells
        Cells along each side, >= 3.
    like
        Other maps, whose cells are taken: these can be compared.

    Returns
    -------
    ResponseMaps
        Of all recordings together.

    Raises
    ------
    ValueError
        If a recording is in pixels, or nobody is beside another.
    """
    recordings = [recordings] if isinstance(recordings, Trajectories) else list(recordings)
    in_cm = all(recording.unit == "cm" for recording in recordings)
    remedy = "Give their scale, pixels_per_cm."
    require(recordings, "recordings", "be one or several", "none")
    require(in_cm, "recordings", "be in cm", "pixels", remedy)
    check_tank(tank_cm)
    number("lag_s", lag_s, above=0)
    integer("cells", cells, 3)
    per_recording = [_moments(recording, lag_s, tank_cm) for recording in recordings]
    joined = map(np.concatenate, zip(*per_recording, strict=True))
    offset, turning, acceleration, distance, direction, wall_turning = joined
    if not len(offset):
        refuse("recordings", "hold two individuals beside each other", "none")
    # Few moments are far away: they would leave most cells empty.
    if like is None:
        reach = WIDEST * float(np.median(np.hypot(offset[:, 0], offset[:, 1])))
        edges = np.linspace(-reach, reach, cells + 1)
        wall_edges = np.linspace(0, float(np.quantile(distance, 0.95)), cells + 1)
        angles = np.linspace(-np.pi, np.pi, cells + 1)
    else:
        edges = like.edges_cm
        wall_edges = like.wall_edges_cm
        angles = like.wall_angles
    neighbor = _Cells(offset[:, 0], -offset[:, 1], edges, edges)
    wall = _Cells(distance, direction, wall_edges, angles)
    return ResponseMaps(
        edges_cm=edges,
        turning=neighbor.mean(turning),
        acceleration=neighbor.mean(acceleration),
        moments=neighbor.moments,
        wall_edges_cm=wall_edges,
        wall_angles=angles,
        wall_turning=wall.mean(wall_turning),
        wall_moments=wall.moments,
    )


def response_figure(maps: Mapping[str, ResponseMaps]) -> "Figure":
    """Draw maps of several sources, such as recorded and simulated animals, one below the other.

    Cells with fewer than 20 moments stay empty.

    Parameters
    ----------
    maps
        Name -> maps, all with the same cells (`like`).

    Returns
    -------
    matplotlib.figure.Figure
    """
    from turing_learning.figures.recordings import maps_figure

    require(maps, "maps", "be of one source or several", "none")
    leader = next(iter(maps.values()))
    neighbor = (leader.edges_cm, leader.edges_cm)
    wall = (np.degrees(leader.wall_angles), leader.wall_edges_cm)
    axis_labels = ("to its right (cm)", "ahead of it (cm)")
    rows = []
    for source_maps in maps.values():
        # Means of few moments are noise, and strong
        seen = source_maps.moments >= FEWEST_MOMENTS
        seen_walls = source_maps.wall_moments >= FEWEST_MOMENTS
        turning = np.where(seen, source_maps.turning, np.nan)
        acceleration = np.where(seen, source_maps.acceleration, np.nan)
        rows.append([turning, acceleration, np.where(seen_walls, source_maps.wall_turning, np.nan)])
    return maps_figure(
        list(maps),
        rows,
        [neighbor, neighbor, wall],
        [
            ("turn to the left (rad/s)", *axis_labels),
            ("acceleration (cm/s²)", *axis_labels),
            ("turn by the wall (rad/s)", "wall to its left (degrees)", "distance of the wall (cm)"),
        ],
    )


class _Cells:
    """Places on a grid of cells."""

    def __init__(
        self, rows: np.ndarray, columns: np.ndarray, row_edges: np.ndarray, column_edges: np.ndarray
    ) -> None:
        self._places = (rows, columns)
        self._edges = (row_edges, column_edges)
        self.moments = np.histogram2d(rows, columns, bins=self._edges)[0].astype(np.int64)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the mean of values in each cell, NaN where there is none."""
        sums = np.histogram2d(*self._places, bins=self._edges, weights=values)[0]
        empty = np.full(sums.shape, np.nan)
        return np.divide(sums, self.moments, out=empty, where=self.moments > 0)


def _moments(
    recording: Trajectories, lag_s: float, tank_cm: tuple[float, float] | None
) -> tuple[np.ndarray, ...]:
    """Return offsets of the nearest other (ahead, left), turning and acceleration; distance, direction, turning of walls."""
    lag = max(1, round(lag_s * recording.fps))
    positions = recording.positions
    present = recording.present
    before = positions[lag:-lag] - positions[: -2 * lag]
    after = positions[2 * lag :] - positions[lag:-lag]
    complete = present[2 * lag :] & present[lag:-lag] & present[: -2 * lag]
    length = np.hypot(before[..., 0], before[..., 1])
    # Three frames, a lag apart, make a course, its turn and its change of speed.
    if not complete.any():
        return tuple(np.empty((0, 2) if k == 0 else 0) for k in range(6))
    # Of who hardly moves, the tracker's noise would be the course.
    complete &= length > SLOWEST * np.median(length[complete])
    course = np.arctan2(before[..., 1], before[..., 0])
    seconds = lag / recording.fps
    turning = wrap(np.arctan2(after[..., 1], after[..., 0]) - course) / seconds
    acceleration = (np.hypot(after[..., 0], after[..., 1]) - length) / seconds**2
    offset, beside = nearest_others(positions[lag:-lag], present[lag:-lag])
    beside &= complete
    ahead = offset[..., 0] * np.cos(course) + offset[..., 1] * np.sin(course)
    left = offset[..., 1] * np.cos(course) - offset[..., 0] * np.sin(course)
    # the nearest of four walls, each as its distance and where it is from here
    low, high = recording.reach if tank_cm is None else (np.zeros(2), np.array(tank_cm))
    middle = positions[lag:-lag]
    distances = np.concatenate([middle - low, high - middle], axis=-1)
    nearest = distances.argmin(axis=-1)
    bearings = np.array([np.pi, -np.pi / 2, 0.0, np.pi / 2])[nearest]
    direction = wrap(bearings - course)
    return (
        np.stack([ahead[beside], left[beside]], axis=1),
        turning[beside],
        acceleration[beside],
        distances.min(axis=-1)[complete],
        direction[complete],
        turning[complete],
    )


def _correlation(first: np.ndarray, second: np.ndarray, moments: np.ndarray) -> float:
    """Return the weighted correlation over cells that have moments enough."""
    # Means of few moments are noise; two cells correlate perfectly.
    enough = moments >= FEWEST_MOMENTS
    if enough.sum() < 3:
        return float("nan")
    covariance = np.cov(first[enough], second[enough], aweights=moments[enough])
    spread = np.sqrt(covariance[0, 0] * covariance[1, 1])
    return float(covariance[0, 1] / spread) if spread > 0 else float("nan")
