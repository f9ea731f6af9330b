"""How far a swarm, or the objects that it moves, lies from one compact cluster."""

import numpy as np

from ._positions import check_positions, check_radius

CENTERS = 24  # tried along each edge of the lattice's cell; a finer grid finds nothing smaller for 2 to 100 disks


def dispersion(positions: np.typing.ArrayLike, radius_cm: float) -> np.ndarray:
    """Compute the dispersion of disks: the sum of their squared distances from their centroid, over 4 r^2.

    Parameters
    ----------
    positions : (..., S, 2)
        Centers of S disks (cm); trials, time steps and so on come first.
    radius_cm
        Radius r of a disk (cm), > 0.

    Returns
    -------
    (...)
        Without unit.

    Raises
    ------
    ValueError
        If the positions are not of that shape or not finite, or the radius is not positive.

    Source
    ------
    Gauci et al. 2014, Int. J. Robotics Research 33, equation 5, which the paper cites in section 4.3; a sum over the
    disks, not a mean.
    """
    array = check_positions(positions)
    check_radius(radius_cm)
    offsets = array - array.mean(axis=-2, keepdims=True)
    return np.square(offsets).sum(axis=(-2, -1)) / (4 * radius_cm**2)


def least_dispersion(disks: int) -> float:
    """Return the smallest dispersion of disks that do not overlap, as far as it is known.

    The best packings that are known lie on a hexagonal lattice. A set of lattice points with the smallest second moment
    consists of the points that are nearest to its own centroid, so that it is enough to try centers in one cell.

    Parameters
    ----------
    disks
        Number of disks S, >= 1.

    Returns
    -------
    float
        For example 0.5 for 2 disks, 6.0 for 7, 343.5 for 50.

    Raises
    ------
    ValueError
        If there is no disk.

    Source
    ------
    Graham and Sloane 1990, Penny-packing and two-dimensional codes, Discrete and Computational Geometry 5.
    """
    if disks < 1:
        raise ValueError(f"`disks` must be at least 1; got {disks}.")
    points = _hexagonal_lattice(disks)
    steps = np.arange(CENTERS) / CENTERS
    centers = _skewed(*np.meshgrid(steps, steps))
    return min(_second_moment(_nearest(points, center, disks)) for center in centers)


def _hexagonal_lattice(disks: int) -> np.ndarray:
    """Return lattice points (L, 2) with a spacing of one diameter around one cell; any compact set of disks fits in."""
    reach = int(np.ceil(np.sqrt(disks))) + 2
    span = np.arange(-reach, reach + 1)
    return _skewed(*np.meshgrid(span, span))


def _skewed(along: np.ndarray, across: np.ndarray) -> np.ndarray:
    return np.stack([along + across / 2, across * np.sqrt(3) / 2], axis=-1).reshape(-1, 2)


def _nearest(points: np.ndarray, center: np.ndarray, count: int) -> np.ndarray:
    distances = np.square(points - center).sum(axis=1)
    return points[np.argsort(distances, kind="stable")[:count]]


def _second_moment(points: np.ndarray) -> float:
    return float(np.square(points - points.mean(axis=0)).sum())
