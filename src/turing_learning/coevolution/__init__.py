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
=============================================  ================================================================

Other rewards (`Reward`) are functions of `Judgments` that return an array with one number for each model or
classifier.
"""

from ._archive import ClassifierArchive
from ._interrogation import InteractiveInterrogation, PassiveInterrogation
from ._loop import Coevolution, Generation
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
    "THRESHOLD", "Classifier", "ClassifierArchive", "Coevolution", "Generation",
    "InteractiveInterrogation", "InteractiveSource", "Interrogation", "Judgments",
    "PassiveInterrogation", "Reward", "SampleSource", "Samples",
    "classifier_reward", "jury_reward", "model_reward", "sensitivity", "specificity",
]  # fmt: skip
