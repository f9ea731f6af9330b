"""How the trials of a run are divided into batches."""

from collections.abc import Sequence

import numpy as np

BATCHES = 40
"""Batches after the first one, where their size is not given."""

FEWEST_BATCHES = 10
"""A batch has at most one of so many parts of the trials: classifiers evolve, and maps are made, after each."""

FIRST_SHARE = 0.1
"""Share of the trials that the first batch spends, within the two bounds below."""

FIRST_LEAST = 10
"""Fewest trials of the first batch, for each parameter."""

FIRST_MOST = 40
"""Most trials of the first batch, for each parameter."""


def batch_schedule(
    trials: int, dimension: int, extended: Sequence[tuple[int, int]] = (), batch: int = 0
) -> list[int]:
    """Return how many trials are spent after each batch of a run with so many parameters.

    For `extended` and `batch` see `FewTrials`.
    """
    spent: list[int] = []
    for budget, stage_end in (*extended, (trials, trials)):
        wanted = np.clip(FIRST_SHARE * budget, FIRST_LEAST * dimension, FIRST_MOST * dimension)
        first_batch = min(round(wanted), budget // 2)
        size = batch or max(2, -(-(budget - first_batch) // BATCHES))
        if not spent:
            # what is left over is spent at first, so that no batch is a small one
            left_over = (budget - first_batch) % batch if batch else 0
            spent.append(first_batch + left_over)
        while spent[-1] < stage_end:
            spent.append(min(spent[-1] + size, stage_end))
    return spent
