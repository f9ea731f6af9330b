"""Tanks as networks see them: where individuals may be, and how far the walls are in every direction."""

import math
from collections.abc import Sequence

import numpy as np
import scipy  # its parts come when they are used

from turing_learning.kernels.imitation import DIRECTIONS, Tanks

CELLS = 80
"""Cells along the longer side of a tank: half a centimeter of 40."""
EMPTY_CELLS = 2
"""Empty cells around a tank."""
WIDEST_HOLE = 0.1
"""Share of the shorter side up to whose diameter unvisited places count as tank, and corners as round."""
OUTLIERS = 0.0005
"""Share of the positions at either end of x and y that may lie beyond the walls: mistakes of trackers."""
EXIT_CELLS = 3
"""Cells around a last place that belong to an exit."""
LEAST_PART = 0.01
"""Share of the positions that a separate part of a tank has at least, or of last places an exit; one with fewer is
mistakes of trackers."""
OUTSIDE_SHARE = 0.002
"""Share of the positions that may lie outside of the tank that they are of: its own outliers at four ends."""
TANK_SHORTFALL = 0.1
"""Share of its sides by which the places that are reached may fall short of a tank."""


def recorded_grid(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return lower corner (cm), cells inside (X, Y) and side of a cell (cm) of the tank in which positions (N, 2) are."""
    low, high = np.quantile(positions, (OUTLIERS, 1 - OUTLIERS), axis=0)
    cell = float(max(high - low)) / CELLS
    corner = low - EMPTY_CELLS * cell
    shape = np.ceil((high - low) / cell).astype(int) + 2 * EMPTY_CELLS
    cells = np.floor((positions - corner) / cell).astype(int)
    visited = np.zeros(shape, dtype=bool)
    likely = ((positions >= low) & (positions <= high)).all(axis=1)
    visited[tuple(cells[likely].T)] = True
    # closing with a disk: grow by its radius, then shrink as much; holes that it does not fit into are filled
    radius = WIDEST_HOLE / 2 * float(min(high - low)) / cell
    padding = math.ceil(radius) + 1
    grown = scipy.ndimage.distance_transform_edt(~np.pad(visited, padding)) <= radius
    closed = scipy.ndimage.distance_transform_edt(grown) > radius
    inside = closed[padding:-padding, padding:-padding] | visited
    # a reflection is seen now and then where no individual can be, as in the hole of a ring
    regions, count = scipy.ndimage.label(inside)
    visits = np.bincount(regions[tuple(cells[likely].T)], minlength=count + 1)
    return corner, inside & (visits >= LEAST_PART * likely.sum())[regions], cell


def same_tank(
    positions: np.ndarray, grid: tuple[np.ndarray, np.ndarray, float], tanks: Tanks
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the grid of the tank in which positions (N, 2) are, if that is known, else `grid`, that of where they are.

    Fewer positions, or animals that keep off its walls, show less of a tank.
    """
    sides = _sides(grid)
    for corner, inside, cell, walls in zip(
        tanks.corner, tanks.inside, tanks.cell, tanks.walls, strict=True
    ):
        cells = np.floor((positions - corner) / cell).astype(int)
        on_grid = ((cells >= 0) & (cells < inside.shape)).all(axis=1)
        within = inside[tuple(cells[on_grid].T)].sum()
        known = corner, inside, float(cell)
        reaches = (np.abs(sides / _sides(known) - 1) <= TANK_SHORTFALL).all()
        if walls and reaches and within >= (1 - OUTSIDE_SHARE) * len(positions):
            return known
    return grid


def _sides(grid: tuple[np.ndarray, np.ndarray, float]) -> np.ndarray:
    """Return width and height (cm) of the tank on a grid."""
    _, inside, cell = grid
    return (np.ptp(np.argwhere(inside), axis=0) + 1) * cell


def rectangle_grid(
    center: np.ndarray, sides: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the same of a rectangle with these sides (cm) around a place."""
    cell = max(sides) / CELLS
    inner = np.maximum(np.round(np.array(sides) / cell).astype(int), 1)
    inside = np.pad(np.ones(inner, dtype=bool), EMPTY_CELLS)
    return center - np.array(inside.shape) * cell / 2, inside, cell


def open_grid() -> tuple[np.ndarray, np.ndarray, float]:
    """Return the same of the plane without walls."""
    return np.zeros(2), np.ones((1, 1), dtype=bool), 1.0


def wall_distances(inside: np.ndarray, cell: float) -> np.ndarray:
    """Return how far (cm) the wall is from the center of each cell in `DIRECTIONS` directions, (X, Y, DIRECTIONS).

    Rays go on by the distance of the nearest wall, as long as there is some.
    """
    angles = np.arange(DIRECTIONS) * (2 * math.pi / DIRECTIONS)
    free = scipy.ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    columns, rows = np.indices(inside.shape)
    distances = np.zeros((*inside.shape, DIRECTIONS), dtype=np.float32)
    for k, angle in enumerate(angles):
        reach = np.where(inside, 0.5, 0.0)
        for _ in range(4 * max(inside.shape)):
            x = np.floor(columns + 0.5 + reach * math.cos(angle)).astype(int)
            y = np.floor(rows + 0.5 + reach * math.sin(angle)).astype(int)
            on_grid = (x >= 0) & (y >= 0) & (x < inside.shape[0]) & (y < inside.shape[1])
            room = np.zeros(inside.shape)
            room[on_grid] = free[x[on_grid], y[on_grid]]
            going = (room > 0) & inside
            if not going.any():
                break
            # a wall may be half a cell nearer than centers of cells say
            reach += np.where(going, np.maximum(room - 1.0, 0.25), 0.0)
        distances[:, :, k] = reach * cell
    return distances


def exit_cells(places: np.ndarray, grid: tuple[np.ndarray, np.ndarray, float]) -> np.ndarray:
    """Return the cells (X, Y) of a grid near which individuals left, by their last places (N, 2)."""
    corner, inside, cell = grid
    left = np.zeros(inside.shape)
    cells = np.floor((places - corner) / cell).astype(int)
    cells = np.clip(cells, 0, np.array(inside.shape) - 1)
    np.add.at(left, tuple(cells.T), 1.0)
    near = scipy.ndimage.convolve(left, np.ones((2 * EXIT_CELLS + 1,) * 2), mode="constant")
    return near >= max(LEAST_PART * len(places), 1.0)


def tanks_of(
    grids: Sequence[tuple[np.ndarray, np.ndarray, float]],
    walls: Sequence[bool],
    left: Sequence[np.ndarray] = (),
) -> Tanks:
    """Return tanks, ready for kernels, on grids of a common size; `left` are last places of whoever left them."""
    shape = np.max([inside.shape for _, inside, _ in grids], axis=0)
    inside = np.zeros((len(grids), *shape), dtype=bool)
    distance = np.zeros((len(grids), *shape, DIRECTIONS), dtype=np.float32)
    exits = np.zeros_like(inside)
    for k, (_, cells, cell) in enumerate(grids):
        columns, rows = cells.shape
        inside[k, :columns, :rows] = cells
        if walls[k]:
            distance[k, :columns, :rows] = wall_distances(cells, cell)
    for k, places in enumerate(left):
        columns, rows = grids[k][1].shape
        exits[k, :columns, :rows] = exit_cells(places, grids[k])
    return Tanks(
        walls=np.array(walls, dtype=bool),
        corner=np.array([corner for corner, _, _ in grids], dtype=float),
        cell=np.array([cell for _, _, cell in grids], dtype=float),
        inside=inside,
        distance=distance,
        exits=exits,
    )
