"""The Turing Learning loop: models and classifiers compete. It knows no robots and no networks.

In the order of the data:

=============================================  ================================================================
`SampleSource`, `Classifier`, `Interrogation`  Protocols: what systems, simulations and judges have to offer.
`InteractiveSource`                            A source that each classifier influences.
`Samples`                                      Genuine and counterfeit samples of one generation.
`PassiveInterrogation`                         Collect once, let every classifier judge the same samples.
`InteractiveInterrogation`                     Let each classifier meet the system and some models alone.
`Judgments`, `THRESHOLD`                       All classifiers' outputs for all samples, and the decisions.
`model_reward`, `classifier_reward`            Equations 1 and 2 of the paper: functions of `Judgments`.
`specificity`, `sensitivity`                   Equations 3 and 4.
`ClassifierArchive`, `jury_reward`             Past classifiers go on judging models.
`Coevolution`                                  The loop: one `step` is one generation.
`Generation`                                   What a step leaves: both populations, scored.
`FewTrials`, `Batch`                           The loop for few trials: samples are kept and judged again.
`batch_schedule`                               The trials that it has spent after each batch.
`SampleBuffer`                                 All samples of a run.
`Observers`                                    Protocol: random classifiers beside the evolved ones.
=============================================  ================================================================

Other rewards (`Reward`) are functions of `Judgments` that return an array with one number for each model or
classifier.
"""

from ._few_trials import Batch, FewTrials, Observers, batch_schedule
from ._interrogation import InteractiveInterrogation, PassiveInterrogation
from ._loop import Coevolution, Generation
from ._memory import ClassifierArchive, SampleBuffer
from ._protocols import Classifier, InteractiveSource, Interrogation, Samples, SampleSource
from ._rewards import (
    THRESHOLD,
    Judgments,
    Reward,
    classifier_reward,
    jury_reward,
    model_reward,
    sensitivity,
    specificity,
)

__all__ = [
    "THRESHOLD", "Batch", "Classifier", "ClassifierArchive", "Coevolution", "FewTrials", "Generation",
    "InteractiveInterrogation", "InteractiveSource", "Interrogation", "Judgments", "Observers",
    "PassiveInterrogation", "Reward", "SampleBuffer", "SampleSource", "Samples", "batch_schedule",
    "classifier_reward", "jury_reward", "model_reward", "sensitivity", "specificity",
]  # fmt: skip
