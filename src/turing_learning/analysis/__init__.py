"""Arrays to numbers: how good are the inferred models?

========================  ============================================================================
`absolute_error`          AE of each parameter, equation 9 of the paper.
`mean_absolute_error`     MAE over all parameters, equation 10.
`estimate`                One model from the last generations of a run, better than any of them.
`name_failure`            How a run misses a known truth: states exchanged, I = 2 as I = 1, runaway.
========================  ============================================================================
"""

from ._errors import absolute_error, mean_absolute_error
from ._estimate import estimate
from ._failure import name_failure

__all__ = ["absolute_error", "estimate", "mean_absolute_error", "name_failure"]
