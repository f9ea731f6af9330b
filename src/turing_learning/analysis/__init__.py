"""Arrays to numbers: how good are the inferred models, and what do swarms of them do?

========================  ============================================================================
`absolute_error`          AE of each parameter, equation 9 of the paper.
`mean_absolute_error`     MAE over all parameters, equation 10.
`estimate`                One model from the last generations of a run, better than any of them.
`interval`                The uncertainty of that estimate, for each parameter.
`name_failure`            How a run misses a known truth: states exchanged, I = 2 as I = 1, runaway.
`dispersion`              How far disks lie from their centroid, section 4.3.
`least_dispersion`        The smallest dispersion that disks can have.
`largest_cluster`         The number of disks in the largest cluster, section 5.4.
`decision_accuracy`       How often a classifier decides rightly after several trials, section 4.4.
`polarization`            How aligned a group moves.
`compare`                 Mann-Whitney tests against a reference, with Bonferroni's correction; a `Comparison`.
========================  ============================================================================
"""

from ._clusters import largest_cluster
from ._comparison import Comparison, compare
from ._decision import decision_accuracy
from ._dispersion import dispersion, least_dispersion
from ._errors import absolute_error, mean_absolute_error
from ._estimate import estimate, interval
from ._failure import name_failure
from ._polarization import polarization

__all__ = [
    "Comparison",
    "absolute_error",
    "compare",
    "decision_accuracy",
    "dispersion",
    "estimate",
    "interval",
    "largest_cluster",
    "least_dispersion",
    "mean_absolute_error",
    "name_failure",
    "polarization",
]
