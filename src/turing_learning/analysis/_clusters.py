"""Clusters of disks."""

import numpy as np

from ._positions import check_positions, check_radius


def largest_cluster(positions: np.typing.ArrayLike, radius_cm: float) -> np.ndarray:
    """Count the disks in the largest cluster.

    Two disks are neighbors if no other one fits between them, that is, if their centers are less than 4 r apart. A
    cluster is all that is connected through neighbors.

    Parameters
    ----------
    positions : (..., S, 2)
        Centers of S disks (cm); trials, time steps and so on come first.
    radius_cm
        Radius r of a disk (cm), > 0.

    Returns
    -------
    (...) int
        Between 1 and S.

    Raises
    ------
    ValueError
        If the positions are not of that shape or not finite, or the radius is not positive.

    Source
    ------
    Gauci et al. 2014, Int. J. Robotics Research 33, which the paper cites in section 5.4.
    """
    array = check_positions(positions)
    check_radius(radius_cm)
    flat = array.reshape(-1, *array.shape[-2:])
    sizes = [_largest(disks, 4 * radius_cm) for disks in flat]
    return np.array(sizes, dtype=np.int64).reshape(array.shape[:-2])


def _largest(disks: np.ndarray, reach: float) -> int:
    from scipy.sparse.csgraph import connected_components

    distances = np.hypot(*(disks[:, None] - disks[None]).transpose(2, 0, 1))
    _, labels = connected_components(distances < reach, directed=False)
    return int(np.bincount(labels).max())
