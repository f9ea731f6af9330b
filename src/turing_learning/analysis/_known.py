"""What is not known: NaN in Python, null in files."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

UNKNOWN = math.nan
"""Stands for a number that is not known."""

WHY_UNKNOWN = (
    "the typical model has not moved, or hardly, in the generations that make the estimate: run more generations"
)
"""Why an interval is not known, see `interval`."""


def is_known(*values: float | None) -> bool:
    """Return whether there are all of these numbers: none of them is None or NaN."""
    return not any(value is None or math.isnan(value) for value in values)


def known_or(instead: float | None, interval: Mapping[str, Sequence[float | None]]) -> dict[str, list[Any]]:
    """Return an interval, name -> two ends, in which each end that is not known is something else.

    Parameters
    ----------
    instead
        None for a file. `UNKNOWN` in Python: as one and the same object, so that lists of it are equal.
    interval
        As in Python or in a file.
    """
    return {name: [end if is_known(end) else instead for end in ends] for name, ends in interval.items()}
