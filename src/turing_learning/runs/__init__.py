"""Runs: execute a configuration, and open what was stored again; what they have inferred is in `results`.

`infer`
    One run from Python or the command line, in memory or in a run folder.
`Run`, `Progress`
    A run as an iterable: begin or open it, one `Progress` for each generation; leaving the loop stops it.
`start`, `resume`, `load_run`, `new_run_path`
    Run a resolved configuration in a folder; resume a run; open its result; where a new one may be.
`start_laboratory`, `resume_laboratory`, `stored_laboratory`, `is_laboratory_run`, `awaits_robots`, `read_events`
    The same with real robots; whether they are still needed; what has happened in the laboratory.
`trust_laboratory`
    Seal an edited `laboratory.json`, which names functions that are executed.
`read_trials`, `ObservedTrials`, `read_post_evaluation`, `ModelEvaluation`
    Its trials as they were observed; what its last models are worth when they are observed again.
`simulate_laboratory`, `SimulatedRun`
    The same setup in plain simulation.
`trial_replay`, `write_trial`, `REPLAY_SUFFIXES`
    One trial of a scenario, as page or film; how such files end.
`is_custom`
    Whether a custom system is given.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
