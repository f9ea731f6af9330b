"""Robots that do not move although they should."""

import numpy as np

from turing_learning.robots.tracking._tracker import Fault, Track

STUCK = "stuck"
"""Kind of fault."""
TURN_RAD = 0.1
SURE_TURN_RAD = 0.5
"""A model that must turn a robot so far in the time of the track, in every sensor state, cannot stand."""
FULL_TURN_RAD_S = 12.8 / 5.1
"""Angular speed for a difference of 1 between the wheel speeds. Source: paper, section 4.1."""


def stuck_robots(track: Track, models: np.ndarray, least_cm: float) -> tuple[Fault, ...]:
    """Return a fault for each robot that neither moved `least_cm` nor turned 0.1 rad in a track.

    Replicas are the last R individuals; those whose model may make them stand, or push against a wall, are not meant:
    all but those that turn wherever they are.

    Parameters
    ----------
    track
        Of a trial.
    models : (R, 2 n)
        What the replicas executed.
    least_cm
        0: nobody is stuck.
    """
    moved = np.ptp(track.poses[..., :2], axis=0).max(axis=-1)
    turned = np.ptp(np.unwrap(track.poses[..., 2], axis=0), axis=0)
    pairs = models.reshape(len(models), -1, 2)
    turns = np.abs(pairs[..., 0] - pairs[..., 1]) * FULL_TURN_RAD_S * track.interval_s * (len(track.poses) - 1)
    must = np.ones(len(track.labels), bool)
    must[len(must) - len(models) :] = (turns >= SURE_TURN_RAD).all(axis=1)
    still = must & (moved < least_cm) & (turned < TURN_RAD)
    return tuple(_fault(track, individual) for individual in np.nonzero(still)[0].tolist())


def _fault(track: Track, individual: int) -> Fault:
    x, y, _ = track.poses[-1, individual]
    text = f"individual {individual} ({track.labels[individual]}) has not moved from x, y = {x:.1f}, {y:.1f} cm: it is stuck"
    return Fault(0, STUCK, text + ", or its battery is empty. Free it.")
