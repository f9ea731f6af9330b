"""Examiners that have learned judge samples that nobody has seen."""

from collections.abc import Sequence
from copy import copy

import numpy as np
from threadpoolctl import threadpool_limits

from ._examiners import QUICK
from ._panel import Views, right_answers


# several threads of BLAS would take five times the processor time for so small matrices
@threadpool_limits.wrap(limits=1, user_api="blas")  # type: ignore[untyped-decorator]
def answers(
    genuine: np.ndarray,
    others: np.ndarray,
    judged: np.ndarray,
    *,
    names: Sequence[str] | None = None,
    interval_s: float = 1.0,
    seed: int = 0,
) -> np.ndarray:
    """Say which samples a panel takes for genuine, after it has learned from others.

    Each examiner scores every sample to learn from by what it learns without it. The one that is
    right most often is asked. What it says of the judged samples is fixed before their labels
    count: so these may be permuted.

    Parameters
    ----------
    genuine, others : (K, T, D), (L, T, D)
        Samples of both kinds to learn from.
    judged : (J, T, D)
        Samples to judge.
    names : (D,)
        Of the signals.
    interval_s
        Duration of a step (s).
    seed
        Of the random convolutions, >= 0.

    Returns
    -------
    (J,) bool
        Whether a sample is taken for genuine.
    """
    windows = np.concatenate((genuine, others, judged))
    names = tuple(names or (f"signal {d + 1}" for d in range(windows.shape[2])))
    views = Views.of(windows, names, interval_s, QUICK, seed)
    count = len(genuine) + len(others)
    labels = np.repeat([1.0, 0.0], [len(genuine), len(others)])[:, None]
    alone = np.arange(count)
    shares = []
    for examiner in QUICK:
        features = views.standardized[examiner.sees][:count]
        right = right_answers(examiner.cross_fitted(features, labels, alone), labels, alone)
        shares.append(float(right.mean()))
    # What it learns is nobody else's
    best = copy(QUICK[int(np.argmax(shares))])
    features = views.standardized[best.sees]
    best.fit(features[:count], labels[:, 0])
    return np.asarray(best.score(features[count:]) > 0)
