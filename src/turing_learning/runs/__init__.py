"""A run, from its configuration to what it has inferred and stored, and whether that can be believed.

A run goes from top to bottom: `infer` (or `start`, `resume`) resolves what is to be run and opens a
`Run`. Each turn of a loop over the run is a generation or a batch of trials, of which `Progress`
tells. What comes is stored in a `RunFolder`, or kept in memory. In the end there is a `Result`: a
`Posterior` of a run of trials, an `Evolution` of a run of generations. `check`, `report`, `Plots`
and `pool` are functions of results.

`infer`
    One run from Python or the command line, in memory or in a run folder.
`Run`, `Progress`
    A run as an iterable: begin or open it, one `Progress` for each generation; leaving the loop
    stops it.
`start`, `resume`, `load_run`, `new_run_path`
    Run a resolved configuration in a folder; resume a run; open its result; where a new one may be.
`Result`, `Posterior`, `Evolution`, `Mode`, `TIMINGS`
    What a run has inferred, with its history; what of its file differs between equal runs.
`check`, `stored_check`, `refuse_unknown_part`
    Whether its estimate can be believed. What an earlier check has found; parts that are none.
`report`, `Plots`, `save_figures`, `swarm_replay`
    The page of a run, its pictures, its figures as files, and trials of a swarm to be replayed.
`pool`, `Pooled`
    Several runs of one configuration, combined.
`RunFolder`, `FINISHED`, `RUNNING`, `resume_command`, `stored_generations`
    The files of a run: configuration, manifest, result, history, checkpoints, figures, report,
    lock; its states; how to resume it; what its last checkpoint holds, without the rest of it.
`RunFolderError`, `RunStorageError`
    A folder that is refused before anything runs, such as one of a later version; a run that cannot
    be written any further.
`start_laboratory`, `resume_laboratory`, `stored_laboratory`, `is_laboratory_run`, `awaits_robots`, `read_events`
    The same with real robots; whether they are still needed; what has happened in the laboratory.
`trust_laboratory`
    Seal an edited `laboratory.json`, which names functions that are executed.
`read_trials`, `ObservedTrials`, `read_post_evaluation`, `ModelEvaluation`
    Its trials as they were observed; what its last models are worth when they are observed again.
`simulate_laboratory`, `SimulatedRun`
    The same setup in plain simulation.
`trial_replay`, `write_trial`, `write_group`, `REPLAY_SUFFIXES`, `TABLE_SUFFIXES`
    One trial of a scenario, as page or film; how such files end.
`is_custom`
    Whether a custom system is given.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
