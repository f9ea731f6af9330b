"""Solutions apart from each other: regions of likely parameters with unlikely ones between them.
Decision 0037."""

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

NEIGHBOR_DRAWS = 6
"""Draws that each draw is joined with, where no valley lies between."""

VALLEY_DEPTH = 3.0
"""Logarithm of the likelihood by which a valley lies below both its sides: a twentieth of their
likelihood."""

LEAST_SHARE = 0.04
"""Share of the draws below which a region is no solution of its own."""

BRIDGES = 12
"""Pairs of draws of two regions, the nearest ones, between which a path is sought."""

PATH_POINTS = 9
"""Points of such a path."""


def modes(draws: np.ndarray, log_likelihood: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Say to which solution each of the draws (D, P) belongs.

    Numbers (D,) from 0, the solution of most draws first.

    Two draws are of one solution if a path leads from one to the other along which models are about
    as likely. A bent ridge is one solution. Two parts of a model that may be exchanged make two.
    """
    scale = draws.std(axis=0) + 1e-12
    points = draws / scale
    values = log_likelihood(draws)
    _, nearest = cKDTree(points).query(points, k=min(NEIGHBOR_DRAWS + 1, len(points)))
    origin = np.repeat(np.arange(len(points)), nearest.shape[1] - 1)
    second = nearest[:, 1:].ravel()
    middle = log_likelihood((draws[origin] + draws[second]) / 2)
    joined = middle >= np.minimum(values[origin], values[second]) - VALLEY_DEPTH
    edges = coo_matrix(
        (np.ones(joined.sum()), (origin[joined], second[joined])), shape=(len(points), len(points))
    )
    _, region = connected_components(edges, directed=False)
    region = _bridged(region, draws, points, values, log_likelihood)
    region = _without_small(region, points)
    order = np.argsort(-np.bincount(region), kind="stable")
    return np.argsort(order)[region]


def _bridged(
    region: np.ndarray,
    draws: np.ndarray,
    points: np.ndarray,
    values: np.ndarray,
    log_likelihood: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """Join regions (D,) that a path without a valley connects, the largest first."""
    region = region.copy()
    shares = np.linspace(0, 1, PATH_POINTS + 2)[1:-1, None]
    order = np.argsort(-np.bincount(region), kind="stable")
    large = [
        number for number in order if (region == number).sum() >= LEAST_SHARE / 4 * len(points)
    ]
    for index, number in enumerate(large):
        for target in large[index + 1 :]:
            origins = np.flatnonzero(region == number)
            targets = np.flatnonzero(region == target)
            if not len(origins) or not len(targets):
                continue
            distance, partner = cKDTree(points[origins]).query(points[targets])
            for k in np.argsort(distance, kind="stable")[:BRIDGES]:
                begin = origins[partner[k]]
                stop = targets[k]
                path = draws[begin] + shares * (draws[stop] - draws[begin])
                if log_likelihood(path).min() >= min(values[begin], values[stop]) - VALLEY_DEPTH:
                    region[region == target] = number
                    break
    return region


def _without_small(region: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Give the draws of small regions to the region of the nearest draw of a large one.

    Number the regions from 0.
    """
    counts = np.bincount(region)
    large = np.flatnonzero(counts >= LEAST_SHARE * len(points))
    large_enough = np.isin(region, large)
    if not large_enough.any():
        return np.zeros(len(points), dtype=np.int64)
    region = region.copy()
    if not large_enough.all():
        _, nearest = cKDTree(points[large_enough]).query(points[~large_enough])
        region[~large_enough] = region[large_enough][nearest]
    return np.searchsorted(large, region)
