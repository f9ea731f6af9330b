"""A Turing test: can anybody tell two sets of recorded or simulated motion apart, and by what?

`test`, `TuringTest`
    Two sets of recordings or of arrays to an accuracy, a p-value, the power of the test, and what gives one away.
`test_held_out`
    The same of a simulator against the windows that were held out from learning.
`game`, `scene_size`, `scenes_of`
    A Turing test for people: pairs of replays of two sets of recordings, and the scenes that they consist of.
`pool_answers`, `Answers`
    What several people answered.
`paths_of`
    Paths of samples, by their speed and turn.
`examine`, `Examined`, `Member`
    The same of samples that are cut and grouped already, without what gives them away.
`answers`
    What such a panel says of further samples, after it has learned.
`Examiner`, `Ridge`, `Kernel`, `Trees`, `PANEL`, `QUICK`
    Who judges: anything that has `fit` and `score`. The panel of a test, and that of a quick look.
`Telling`
    Signals, statistics and time scales by which one set is told from the other.
`telling_statistics`, `told_by`
    The statistics alone, of samples that are told already; and the sentence that names them.

The module `present` has the page of a test.

A sample has T steps of D signals. Samples belong to groups: recordings, individuals or blocks of time. Only groups
are left out, and only groups exchange their labels. Source: docs/decisions/0039-examination.md.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
