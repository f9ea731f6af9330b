"""Masked samples: what is masked is missing."""

import math
from typing import Any

import numpy as np


def with_gaps(given: Any) -> Any:
    """Return an array, or a list of arrays, with NaN where it is masked; anything else as it is."""
    if isinstance(given, list | tuple):
        return [with_gaps(one) for one in given]
    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        return np.ma.filled(given.astype(np.result_type(given.dtype, np.float64)), np.nan)
    return given


def shown(value: float) -> str:
    """Return a value that is refused as text; NaN may have been masked."""
    return "nan (or masked)" if math.isnan(value) else str(value)
