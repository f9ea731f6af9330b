"""Arrays to numbers: how good are the inferred models?

========================  ============================================================================
`absolute_error`          AE of each parameter, equation 9 of the paper.
`mean_absolute_error`     MAE over all parameters, equation 10.
`estimate`                One model from the last generations of a run, better than any of them.
========================  ============================================================================
"""

from ._errors import absolute_error, mean_absolute_error
from ._estimate import estimate

__all__ = ["absolute_error", "estimate", "mean_absolute_error"]
