"""Arrays to numbers: how good are the inferred models, and what do swarms of them do?

========================  ============================================================================
`absolute_error`          AE of each parameter, equation 9 of the paper.
`mean_absolute_error`     MAE over all parameters, equation 10.
`estimate`                One model from the last generations of a run, better than any of them.
`interval`                The uncertainty of that estimate, for each parameter.
`pooled_estimate`         One model from several runs; `pooled_interval`: its uncertainty, if runs settle in different regions.
`mixed_interval`          The same of runs of trials, from their draws.
`r_hat`                   Whether runs agree, for each parameter, as of Markov chains.
`is_known`                Whether there is a number: an interval or R-hat of models that have not moved is `UNKNOWN`, which is NaN.
`replace_unknown`         An interval with something instead of what is not known; `WHY_UNKNOWN` says why it may not be,
                          `WHY_UNKNOWN_OF_TRIALS` why in a run of trials.
`predictive_check`        Whether samples simulated at an estimate resemble the genuine ones; a `PredictiveCheck`.
`resemblance`             How often two sets of samples of one system would differ as much by chance.
`name_failure`            How a run misses a known truth: states exchanged, I = 2 as I = 1, runaway.
`dispersion`              How far disks lie from their centroid, section 4.3.
`least_dispersion`        The smallest dispersion that disks can have.
`largest_cluster`         The number of disks in the largest cluster, section 5.4.
`decision_accuracy`       How often a classifier decides rightly after several trials, section 4.4.
`polarization`            How aligned a group moves.
`dynamic_outputs`         What networks put out for sensor readings that change (`DYNAMIC_READINGS`), section 4.6.2.
`response_error`          How far networks are from the agents' parameters at constant readings.
`Judgment`                Whether to believe a run, all that is said of it; `Verdict`: in a word, `Examination`: by what test, at
                          what `LEVEL`; `SURE`: where a right model must not be called wrong;
                          `OF_CHECKS`: what only checks say.
`settled`                 Whether the models of a run have settled.
`classifiers_tell`        Whether its classifiers still tell them from the agents.
`Jury`                    Classifiers with votes; `competence`: Youden's J of each.
`area_under_curve`        How well scores separate two kinds.
`compare`                 Mann-Whitney tests against a reference, with Bonferroni's correction; a `Comparison`.
========================  ============================================================================

The module `statistics` has statistics of single windows of motion, with names.
"""

from ._disks import dispersion, largest_cluster, least_dispersion
from ._errors import (
    DYNAMIC_READINGS,
    absolute_error,
    dynamic_outputs,
    mean_absolute_error,
    name_failure,
    response_error,
)
from ._estimate import (
    UNKNOWN,
    WHY_UNKNOWN,
    WHY_UNKNOWN_OF_TRIALS,
    classifiers_tell,
    estimate,
    interval,
    is_known,
    mixed_interval,
    pooled_estimate,
    pooled_interval,
    r_hat,
    replace_unknown,
    settled,
)
from ._judgment import LEVEL, OF_CHECKS, SURE, Examination, Judgment, Verdict
from ._predictive import PredictiveCheck, predictive_check, resemblance
from ._tests import (
    Comparison,
    Jury,
    area_under_curve,
    compare,
    competence,
    decision_accuracy,
    polarization,
)

__all__ = [
    "DYNAMIC_READINGS", "LEVEL", "OF_CHECKS", "SURE", "UNKNOWN", "WHY_UNKNOWN", "WHY_UNKNOWN_OF_TRIALS",
    "Comparison", "Examination", "Judgment",
    "Jury", "PredictiveCheck", "Verdict", "absolute_error", "area_under_curve", "classifiers_tell", "compare",
    "competence", "decision_accuracy", "dispersion", "dynamic_outputs", "estimate", "interval", "is_known",
    "largest_cluster", "least_dispersion", "mean_absolute_error", "mixed_interval", "name_failure",
    "polarization", "pooled_estimate", "pooled_interval", "predictive_check", "r_hat", "replace_unknown", "resemblance",
    "response_error", "settled",
]  # fmt: skip
