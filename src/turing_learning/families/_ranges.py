"""Ranges of the parameters of a family: as the recording suggests, or as they are said."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from turing_learning.errors import RefusedError, Setting, nearest, refuse, refusing_as, require

from ..models import Parameter
from ..trajectories import Trajectories, nearest_others

ABOVE_FASTEST = 2.0
"""Highest speed of models in those that 99 of 100 recorded steps do not exceed."""
FASTEST_PERCENTILE = 99
ABOVE_FARTHEST = 2.0
"""Widest zone of models in distances to the nearest that 95 of 100 positions do not exceed."""
FARTHEST_PERCENTILE = 95
LEAST_SHARE = 0.25
"""Share of a suggested range that has to be enough for the recording, from which on the range is kept."""
MEASURED_FRAMES = 2000
"""Frames in which distances are measured."""
SCALES = {"cm/s": (1, 0), "cm": (0, 1), "cm^3/s^2": (1, 2)}
"""Units of parameters -> with which powers of the scale of speeds and of lengths they grow."""
BOUND_DIGITS = 2
LARGEST_BOUND = 1e9
"""Largest bound that a parameter may have."""


def recorded_ranges(
    family: Any, recordings: Trajectories | Sequence[Trajectories]
) -> dict[str, Parameter]:
    """Return the parameters of a family with ranges that fit recordings: wider or narrower where these are faster or larger.

    Parameters
    ----------
    family
        A `Family`, or `Replicates`, with suggested ranges for animals of some cm/s in a tank of some 10 cm.
    recordings
        In cm. Ranges of speeds reach to twice the fastest steps (99th percentile), those of lengths to twice the
        distance of the nearest (95th percentile); a suggested one that is up to four times as wide as that is kept.

    Returns
    -------
    dict
        Name -> `Parameter`, ready for `turing_learning.infer`.
    """
    if isinstance(recordings, Trajectories):
        motion = [recordings]
    else:
        motion = list(recordings)
    suggested: Mapping[str, Parameter] = family.parameters
    speed = ABOVE_FASTEST * max(map(_fastest, motion))
    length = ABOVE_FARTHEST * max(map(_farthest, motion))
    speed_scale = _scale(speed, _highest(suggested, "cm/s"))
    length_scale = _scale(length, _highest(suggested, "cm"))
    ranges = dict(suggested)
    for name, parameter in suggested.items():
        of_speed, of_length = SCALES.get(parameter.unit, (0, 0))
        scale = speed_scale**of_speed * length_scale**of_length
        # a range that fits stays as it is, with all its digits
        if scale != 1:
            ranges[name] = _scaled(parameter, scale)
    return ranges


def _highest(parameters: Mapping[str, Parameter], unit: str) -> float:
    """Return the highest bound of the parameters in a unit, 0 if there is none."""
    bounds = [0.0]
    for parameter in parameters.values():
        if parameter.unit == unit:
            bounds.append(parameter.high or 0.0)
    return max(bounds)


def _scale(wanted: float, suggested: float) -> float:
    """Return by what ranges have to grow: 1 where the suggested one is wide enough, and not far too wide."""
    if not suggested or not wanted or LEAST_SHARE * suggested <= wanted <= suggested:
        return 1.0
    return wanted / suggested


def _scaled(parameter: Parameter, scale: float) -> Parameter:
    """Return a parameter whose bounds are so many times as large, with two digits."""

    def scaled(bound: float | None) -> float | None:
        if bound is None:
            return None
        # what is absurd is refused by whoever looks at the recording
        return float(f"{np.clip(bound * scale, -LARGEST_BOUND, LARGEST_BOUND):.{BOUND_DIGITS}g}")

    return replace(parameter, low=scaled(parameter.low), high=scaled(parameter.high), initial=None)


def _fastest(recording: Trajectories) -> float:
    """Return the speed (cm/s) that 99 of 100 steps do not exceed, so that a few jumps change little; 0 without steps."""
    signals = recording.signals(("speed",))
    speeds = np.abs(signals.values[..., 0][signals.valid])
    if len(speeds):
        return float(np.percentile(speeds, FASTEST_PERCENTILE))
    return 0.0


def _farthest(recording: Trajectories) -> float:
    """Return the distance (cm) of the nearest other individual that 95 of 100 positions do not exceed; 0 for one alone."""
    if recording.at_once < 2:
        return 0.0
    frames = np.linspace(0, len(recording.positions) - 1, MEASURED_FRAMES).astype(int)
    frames = np.unique(frames)[:-1]
    present = recording.present[frames]
    offset, has_neighbor = nearest_others(recording.positions[frames], present)
    distances = np.hypot(*np.moveaxis(offset, -1, 0))[has_neighbor & present]
    if len(distances):
        return float(np.percentile(distances, FARTHEST_PERCENTILE))
    return 0.0


def said_ranges(
    texts: Sequence[str], parameters: Mapping[str, Parameter] | None = None
) -> dict[str, Parameter]:
    """Return parameters with the ranges that texts say, as speed=5:300, weight=0.01:100:log or count=1:20:integer.

    Parameters
    ----------
    texts
        NAME=LOW:HIGH, and perhaps log or integer.
    parameters
        All parameters that there are, whose units stay; None takes those of the texts.
    """
    ranges = dict(parameters or {})
    named = set()
    for text in texts:
        name, _, bounds = text.partition("=")
        low, _, tail = bounds.partition(":")
        high, _, suffix = tail.partition(":")
        remedy = ("For example: ", Setting("range", "speed=5:300"))
        try:
            limits = (float(low), float(high))
        except ValueError:
            rule = "be NAME=LOW:HIGH, or NAME=LOW:HIGH:log, or NAME=LOW:HIGH:integer"
            refuse("range", rule, repr(text), remedy)
        if limits[0] >= limits[1]:
            refuse("range", "begin with its lower end", repr(text), remedy)
        rule = "end with log or integer, if with a word"
        require(suffix in ("", "log", "integer"), "range", rule, repr(text), remedy)
        require(name not in named, "range", "be given once for each parameter", repr(text))
        named.add(name)
        if parameters is not None and name not in parameters:
            got = f"{name!r} of {text!r}"
            refuse("range", f"name one of {', '.join(parameters)}", got, nearest(name, parameters))
        unit = ranges[name].unit if name in ranges else ""
        with refusing_as(RefusedError, name="range", place=text):
            scale: Any = "log" if suffix == "log" else "linear"
            ranges[name] = Parameter(*limits, scale=scale, unit=unit, integer=suffix == "integer")
    return ranges
