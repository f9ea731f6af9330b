"""Runs: execute a configuration, store what happens, and open it again.

`infer`
    One run from Python or the command line, in memory or in a run folder.
`Run`, `Progress`
    A run as an iterable: begin or open it, one `Progress` for each generation; leaving the loop stops it.
`start`, `resume`, `load_run`, `new_run_path`
    Run a resolved configuration in a folder; resume a run; open its result; where a new one may be.
`start_laboratory`, `resume_laboratory`, `stored_laboratory`, `is_laboratory_run`, `awaits_robots`, `read_events`
    The same with real robots; whether they are still needed; what has happened in the laboratory.
`read_trials`, `ObservedTrials`, `read_post_evaluation`, `ModelEvaluation`
    Its trials as they were observed; what its last models are worth when they are observed again.
`simulate_laboratory`, `SimulatedRun`
    The same setup in plain simulation.
`Result`, `TIMINGS`
    What a run has inferred, with its history and report; what of its file differs between equal runs.
`pool`, `Pooled`
    Several runs of one configuration, combined.
`check_run`
    Whether its estimate can be believed; `Result.check` calls it.
`trial_replay`, `write_trial`
    One trial of a scenario, as page or film.
`RunFolder`, `resume_command`
    The files of a run: configuration, manifest, result, history, checkpoints, figures, report, lock; how to resume it.
`stored_generations`
    What the last checkpoint of a run holds, without the rest of it.
`RunFolderError`, `RunStorageError`
    A folder that is refused before anything runs, such as one of a later version; a run that cannot be written any further.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
