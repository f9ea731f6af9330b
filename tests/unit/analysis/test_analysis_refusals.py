"""What the room's functions reject, by message."""

import numpy as np
import pytest

from turing_learning.analysis import (
    absolute_error,
    compare,
    decision_accuracy,
    dispersion,
    estimate,
    interval,
    largest_cluster,
    least_dispersion,
    mean_absolute_error,
    name_failure,
    pooled_estimate,
    pooled_interval,
    r_hat,
    response_error,
)
from turing_learning.models import ElmanModel

SOME, NAN, TRUTH = [1.0, 2.0, 3.0], [[0.0, np.nan]], np.zeros(4)
FITS = r"`(estimate|truth)` must be of shape \("


@pytest.mark.parametrize(
    ("call", "message"),
    [
        *((lambda f=f, x=x: f(*x), FITS) for f in (absolute_error, mean_absolute_error)
          for x in (([1.0], TRUTH), (1.0, TRUTH), ([1.0], [[1.0]]), ([], []))),
        (lambda: absolute_error([np.nan, 0, 0, 0], TRUTH), r"`estimate` must be finite; got nan"),
        (lambda: mean_absolute_error([0.0], [np.inf]), "`truth` must be finite; got inf"),
        (lambda: name_failure(TRUTH, np.zeros(6)), r"`estimate` must be of shape \(P,\) = \(6,\); got \(4,\)"),
        *((lambda f=f: f(np.zeros((5, 3)), 3.5), r"`positions` must be of shape \(\.\.\., S, 2\); got \(5, 3\)")
          for f in (dispersion, largest_cluster)),
        (lambda: dispersion(np.zeros((0, 2)), 3.5), r"`positions` must be .* not empty; got \(0, 2\)"),
        (lambda: dispersion([[0.0, 0.0], [0.0, np.inf]], 3.5), r"`positions` must be finite; got inf at \(1, 1\)"),
        (lambda: largest_cluster(NAN, 3.5), r"`positions` must be finite; got nan at \(0, 1\)"),
        *((lambda f=f, r=r: f([[0.0, 0.0]], r), f"`radius_cm` must be a finite number above 0; got {r}")
          for f in (dispersion, largest_cluster) for r in (0.0, -1.0, np.nan)),
        (lambda: least_dispersion(0), "`disks` must be .* at least 1; got 0"),
        (lambda: compare(SOME, []), "`samples` must hold at least one sample; got none"),
        (lambda: compare([], [SOME]), r"`reference` must be of shape \(R,\) and not empty; got \(0,\)"),
        (lambda: compare(SOME, [SOME, [np.nan]]), r"`samples\[1\]` must be finite; got nan"),
        (lambda: compare(SOME, [SOME], level=1), "`level` must be .* above 0 and below 1; got 1"),
        (lambda: decision_accuracy([[1]], [[0.7]]), r"`models` must hold nothing but 0 and 1; got \[0\.7\]"),
        (lambda: decision_accuracy(np.zeros((3, 0)), [[1]]), r"`agents` must be of shape .*not empty; got \(3, 0\)"),
        *((lambda f=f, s=s: f(np.zeros(s)), r"`typical_models` must be of shape \(G, P\)")
          for f in (estimate, interval) for s in (3, (0, 3), (3, 0))),
        (lambda: estimate(np.array(NAN)), "`typical_models` must be finite; got nan"),
        *((lambda w=w: estimate(np.zeros((3, 1)), window=w), f"`window` must be .* at least 1; got {w}") for w in (0, -5)),
        *((lambda f=f, s=s: f(np.zeros(s)), r"`typical_models` must be of shape \(runs, W, P\)")
          for f in (pooled_estimate, pooled_interval, r_hat) for s in ((3, 4), (1, 4, 2), (2, 0, 2), (2, 4, 0))),
        *((lambda f=f: f(np.full((2, 5, 1), np.nan)), "`typical_models` must be finite; got nan")
          for f in (pooled_estimate, pooled_interval, r_hat)),
        (lambda: response_error(ElmanModel(hidden=1), np.zeros(7), np.zeros(6)), r"`truth` must be of shape .*\(4,\); got \(6,\)"),
        (lambda: absolute_error(["0.5", "0.5"], [0.0, 1.0]), "`estimate` must be an array of numbers; got an array of <U3"),
        (lambda: name_failure([0.0, 1.0], ["0", "1"]), "`truth` must be an array of numbers; got an array of <U1"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_rejected(call, message):
    with pytest.raises(ValueError, match=message):
        call()
