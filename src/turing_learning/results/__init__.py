"""Results: what a run has inferred and stored, whether it can be believed, and how it is shown.

`Result`, `TIMINGS`
    What a run has inferred, with its history and report; what of its file differs between equal runs.
`pool`, `Pooled`
    Several runs of one configuration, combined.
`check_run`, `stored_check`, `refuse_unknown_part`
    Whether its estimate can be believed; `Result.check` calls it. What an earlier check has found; parts that are none.
`write_report`, `save_figures`, `swarm_replay`
    The page of a run, its figures as files, and trials of a swarm to be replayed.
`RunFolder`, `resume_command`
    The files of a run: configuration, manifest, result, history, checkpoints, figures, report, lock; how to
    resume it.
`stored_generations`
    What the last checkpoint of a run holds, without the rest of it.
`folder`, `history`, `result`
    Modules for what executes runs: the files, the arrays of all generations, and how a result comes from them.
`RunFolderError`, `RunStorageError`
    A folder that is refused before anything runs, such as one of a later version; a run that cannot be written
    any further.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
