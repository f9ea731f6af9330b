"""Arrays to numbers: how good are the inferred models, and what do swarms of them do?

========================  ============================================================================
`absolute_error`          AE of each parameter, equation 9 of the paper.
`mean_absolute_error`     MAE over all parameters, equation 10.
`estimate`                One model from the last generations of a run, better than any of them.
`interval`                The uncertainty of that estimate, for each parameter.
`match`                   The parameters with which classifiers judge a model as they judge the agents; a `Matched`.
`pooled_estimate`         One model from several runs; `pooled_interval`: its uncertainty, if runs settle in different regions.
`r_hat`                   Whether runs agree, for each parameter, as of Markov chains.
`is_known`                Whether there is a number: an interval or R-hat of models that have not moved is `UNKNOWN`, which is NaN.
`name_failure`            How a run misses a known truth: states exchanged, I = 2 as I = 1, runaway.
`dispersion`              How far disks lie from their centroid, section 4.3.
`least_dispersion`        The smallest dispersion that disks can have.
`largest_cluster`         The number of disks in the largest cluster, section 5.4.
`decision_accuracy`       How often a classifier decides rightly after several trials, section 4.4.
`polarization`            How aligned a group moves.
`dynamic_outputs`         What networks put out for sensor readings that change, section 4.6.2.
`response_error`          How far networks are from the agents' parameters at constant readings.
`Judgment`                Whether to believe a run, all that is said of it; `Verdict`: in a word, `Examination`: by what test, at
                          what `LEVEL`;
                          `OF_CHECKS`: what only checks say.
`settled`, `told`         Whether the models of a run have settled, and whether its classifiers still tell them from the agents.
`Jury`                    Classifiers with votes; `competence`: Youden's J of each.
`area_under_curve`        How well scores separate two kinds.
`compare`                 Mann-Whitney tests against a reference, with Bonferroni's correction; a `Comparison`.
========================  ============================================================================
"""

from ._disks import dispersion, largest_cluster, least_dispersion
from ._errors import absolute_error, dynamic_outputs, mean_absolute_error, name_failure, response_error
from ._estimate import (
    UNKNOWN,
    estimate,
    interval,
    is_known,
    pooled_estimate,
    pooled_interval,
    r_hat,
    settled,
    told,
)
from ._judgment import LEVEL, OF_CHECKS, Examination, Judgment, Verdict
from ._matching import Matched, match
from ._tests import Comparison, Jury, area_under_curve, compare, competence, decision_accuracy, polarization

__all__ = [
    "LEVEL", "OF_CHECKS", "UNKNOWN", "Comparison", "Examination", "Judgment", "Jury", "Matched", "Verdict", "absolute_error",
    "area_under_curve", "compare", "competence", "decision_accuracy", "dispersion", "dynamic_outputs", "estimate",
    "interval", "is_known", "largest_cluster", "least_dispersion", "match", "mean_absolute_error", "name_failure",
    "polarization", "pooled_estimate", "pooled_interval", "r_hat", "response_error", "settled", "told",
]  # fmt: skip
