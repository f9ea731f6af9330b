"""SLEAP: analysis HDF5."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.trajectories._recording import Format, Options, Recording, refusal

from ._shared import choose, dataset, from_array, member, open_hdf5, texts

DIMENSIONS = ["track", "xy", "node", "frame"]


def read(path: Path, options: Options) -> Recording:
    """Read `tracks` (tracks, 2, nodes, frames) in pixels, one node of each track, with `point_scores` as confidence.

    Where the attribute `dims` of `tracks` names the dimensions in another order, that order holds.

    Source: Pereira et al. 2022, SLEAP, Nature Methods 19; its documentation of the analysis format.
    """
    with open_hdf5(path) as file:
        tracks = _ordered(file, path)
        nodes, names = texts(file, "node_names", path), texts(file, "track_names", path)
        names = names or [str(k + 1) for k in range(tracks.shape[0])]
        if tracks.shape[:3] != (len(names), 2, len(nodes)):
            rule = f"have `tracks` of (tracks, 2, nodes, frames) = ({len(names)}, 2, {len(nodes)}, F)"
            raise refusal(rule, tracks.shape, f"{path}, dataset tracks")
        node = nodes.index(choose(options.keypoint, nodes, path))
        scores = _scores(file, tracks, node, path)
    if len(set(names)) < len(names):
        raise refusal("name each track once", names, f"{path}, dataset track_names")
    return from_array(tracks[:, :, node].transpose(2, 0, 1), tuple(names), f"{path}, dataset tracks", confidence=scores)


def _ordered(file: Any, path: Path) -> np.ndarray:
    tracks = dataset(file, "tracks", 4, path)
    stated = file["tracks"].attrs.get("dims")
    if stated is None:
        return tracks
    try:
        order = [str(name).rstrip("s") for name in json.loads(stated)]
        return tracks.transpose([order.index(name) for name in DIMENSIONS])
    except ValueError:
        raise refusal(f"name the dimensions {DIMENSIONS}", stated, f"{path}, dataset tracks, dims") from None


def _scores(file: Any, tracks: np.ndarray, node: int, path: Path) -> np.ndarray | None:
    if getattr(member(file, "point_scores", path), "shape", None) != (tracks.shape[0], *tracks.shape[2:]):
        return None
    return dataset(file, "point_scores", 3, path)[:, node].T


FORMAT = Format("sleap", lambda glance: glance.holds("tracks", "node_names"), read, has_keypoints=True)
