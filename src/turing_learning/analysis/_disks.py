"""How disks, the robots of a swarm or the objects that it moves, lie together. Source: Gauci et al. 2014, which the paper cites."""

import numpy as np

from ..arrays import array
from ..errors import integer, number

# tried along each edge of the lattice's cell; a finer grid finds nothing smaller for 2 to 100 disks
CENTERS = 24


def dispersion(positions: np.typing.ArrayLike, radius_cm: float) -> np.ndarray:
    """Compute the dispersion (...) of disks: the sum of their squared distances from their centroid, over 4 r^2, without unit.

    Source: Gauci et al. 2014, Int. J. Robotics Research 33, equation 5, which the paper cites in section 4.3; a
    sum over the disks, not a mean.

    Parameters
    ----------
    positions : (..., S, 2)
        Centers of S disks (cm); trials, time steps and so on come first.
    radius_cm
        Radius r of a disk (cm), > 0.
    """
    centers = array("positions", positions, "... S 2")
    number("radius_cm", radius_cm, above=0)
    offsets = centers - centers.mean(axis=-2, keepdims=True)
    return np.square(offsets).sum(axis=(-2, -1)) / (4 * radius_cm**2)


def least_dispersion(disks: int) -> float:
    """Return the smallest dispersion known of disks that do not overlap: 0.5 for 2 disks, 6.0 for 7, 343.5 for 50.

    The best packings that are known lie on a hexagonal lattice. A set of lattice points with the smallest
    second moment consists of the points that are nearest to its own centroid, so that it is enough to try
    centers in one cell.

    Source: Graham and Sloane 1990, Penny-packing and two-dimensional codes, Discrete and Computational Geometry
    5.

    Parameters
    ----------
    disks
        Number of disks S, >= 1.
    """
    integer("disks", disks, 1)
    # Of lattice points around one cell: any compact set of disks fits in
    reach = int(np.ceil(np.sqrt(disks))) + 2
    points = _lattice(np.arange(-reach, reach + 1))

    def second_moment(center: np.ndarray) -> float:
        nearest = points[np.argsort(np.square(points - center).sum(axis=1), kind="stable")[:disks]]
        return float(np.square(nearest - nearest.mean(axis=0)).sum())

    return min(map(second_moment, _lattice(np.arange(CENTERS) / CENTERS)))


def _lattice(steps: np.ndarray) -> np.ndarray:
    """Return points (L, 2) of the hexagonal lattice with a spacing of one diameter, at these steps along both edges."""
    along, across = np.meshgrid(steps, steps)
    return np.stack([along + across / 2, across * np.sqrt(3) / 2], axis=-1).reshape(-1, 2)


def largest_cluster(positions: np.typing.ArrayLike, radius_cm: float) -> np.ndarray:
    """Count the disks in the largest cluster (...), from 1 to S.

    Two disks are neighbors if no other one fits between them, that is, if their centers are less than 4 r
    apart. A cluster is all that is connected through neighbors.

    Source: Gauci et al. 2014, Int. J. Robotics Research 33, which the paper cites in section 5.4.

    Parameters
    ----------
    positions, radius_cm
        As for `dispersion`.
    """
    from scipy.sparse.csgraph import connected_components

    centers = array("positions", positions, "... S 2")
    number("radius_cm", radius_cm, above=0)
    sizes = []
    for disks in centers.reshape(-1, *centers.shape[-2:]):
        distances = np.hypot(*(disks[:, None] - disks[None]).transpose(2, 0, 1))
        sizes.append(
            np.bincount(connected_components(distances < 4 * radius_cm, directed=False)[1]).max()
        )
    return np.array(sizes, dtype=np.int64).reshape(centers.shape[:-2])
