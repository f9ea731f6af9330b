"""Runs put to the test: several models of one system beside each other, and a game of a run.

`compare`, `Comparison`, `Compared`
    Infer several models of one system, and say which is hardest to tell from what none has learned from.
`Subject`, `examine_runs`, `run_subjects`, `recorded_subjects`
    What a model imitates; the same of finished runs; models of recordings by the options of commands.
`ranking`
    The cells of its table, also of what a folder has stored.
`is_comparison`, `remembered_comparison`, `new_comparison_path`
    The folder of a comparison.
`game_of_run`
    A Turing test for people: held-out genuine motion beside that of the estimate.

The module `present` has the page of a comparison.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
