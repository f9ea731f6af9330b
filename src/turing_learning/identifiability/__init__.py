"""Whether an estimate can be believed: can the genuine motion be told from that of the model, and what do the samples pin down?

`Evidence`, `evidence_of`
    Genuine samples to learn from and held out, and a simulator of models; of a run's system.
`Effort`
    How much is simulated.
`two_sample_test`, `TwoSampleTest`
    A panel of examiners learns from genuine and simulated samples, and is tested on held-out ones.
`reference_accuracies`
    Accuracies of the same test of models that a run calls plausible, each as if it were the system: an iterator, so
    that one who has seen enough can stop.
`profile`, `Profile`
    The same test where a single parameter is moved across its range.
`Recovery`, `PinnedDown`, `Check`
    What a run finds whose truth is the estimate; what is said of each parameter; all of it together.
`sides_rejected`
    What may be claimed: that values on both sides of an estimate fit worse. Whether the model, or the search, is
    at fault: `turing_learning.analysis.Judgment`.
`read_check`
    A `Check` as it was stored.
`Quantity`
    Distributions of speed, turning, neighbor distance and polarization, genuine beside simulated.

The module `evidence` makes the `Evidence` of a run.

docs/identifiability.md says how to read them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
