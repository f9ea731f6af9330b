"""Runs: execute a configuration, keep what happens, and open it again.

`infer`
    One run from Python or the command line, kept in memory or in a run folder.
`start`, `resume`, `load_run`, `new_run_path`
    Run a resolved configuration in a folder; go on with a run; open one; where a new one may be.
`start_laboratory`, `resume_laboratory`, `stored_laboratory`, `is_laboratory_run`, `awaits_robots`, `read_events`
    The same with real robots; whether they are still needed; what has happened in the laboratory.
`read_trials`, `ObservedTrials`, `read_post_evaluation`, `ModelEvaluation`
    Its trials as they were observed; what its last models are worth when they are observed again.
`simulate_laboratory`, `SimulatedRun`
    The same setup in plain simulation.
`Result`, `TIMINGS`
    What a run has inferred, with its history and report; what of its file differs between equal runs.
`pool`, `Pooled`
    Several runs of one configuration, told as one.
`check_run`
    Whether its estimate can be believed; `Result.check` calls it.
`Progress`
    What an observer is told after every generation.
`trial_replay`, `write_trial`, `scenario_named`, `refuse_film_path`
    One trial of a scenario, as page or film; a scenario by its name; where a film or page of one may be written.
`RunFolder`, `resume_command`
    The files of a run: configuration, manifest, result, history, checkpoints, figures, report, lock; how to go on with it.
`stored_generations`, `stored_traces`
    What the last checkpoint of a run holds, without the rest of it.
`new_manifest`, `RUNNING`, `FINISHED`
    When, where and with what a computation was begun; how it stands.
`write_atomically`, `write_json`
    Files that are there whole or not at all.
`RunFolderError`, `RunStorageError`, `refuse_future_format`
    A folder that is refused before anything runs, such as one of a later version; a run that cannot be written any further.
`refuse_target`
    Where a page or film may be written that somebody asks for.
`told`, `writable`, `storage`
    What the operating system says about files, as such an error, in one message.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .folder._errors import RunFolderError, RunStorageError, refuse_future_format, storage, told, writable
from .folder._files import write_atomically, write_json

if TYPE_CHECKING:
    from ._check_run import check_run
    from ._execute import start
    from ._infer import infer, new_run_path, resume
    from ._laboratory import (
        SimulatedRun,
        awaits_robots,
        is_laboratory_run,
        resume_laboratory,
        simulate_laboratory,
        start_laboratory,
        stored_laboratory,
    )
    from ._open import load_run
    from ._post_evaluation import ModelEvaluation, read_post_evaluation
    from ._session import Progress
    from ._trial import refuse_film_path, scenario_named, trial_replay, write_trial
    from .folder._checkpoints import stored_generations, stored_traces
    from .folder._folder import RunFolder, resume_command
    from .folder._manifest import FINISHED, RUNNING, new_manifest
    from .folder._target import refuse_target
    from .folder._trial_store import ObservedTrials, read_events, read_trials
    from .results._pool import Pooled, pool
    from .results._result import TIMINGS, Result

__all__ = [
    "FINISHED",
    "RUNNING",
    "TIMINGS",
    "ModelEvaluation",
    "ObservedTrials",
    "Pooled",
    "Progress",
    "Result",
    "RunFolder",
    "RunFolderError",
    "RunStorageError",
    "SimulatedRun",
    "awaits_robots",
    "check_run",
    "infer",
    "is_laboratory_run",
    "load_run",
    "new_manifest",
    "new_run_path",
    "pool",
    "read_events",
    "read_post_evaluation",
    "read_trials",
    "refuse_film_path",
    "refuse_future_format",
    "refuse_target",
    "resume",
    "resume_command",
    "resume_laboratory",
    "scenario_named",
    "simulate_laboratory",
    "start",
    "start_laboratory",
    "storage",
    "stored_generations",
    "stored_laboratory",
    "stored_traces",
    "told",
    "trial_replay",
    "writable",
    "write_atomically",
    "write_json",
    "write_trial",
]

_LAZY = {
    "FINISHED": "folder._manifest",
    "RUNNING": "folder._manifest",
    "TIMINGS": "results._result",
    "Pooled": "results._pool",
    "ModelEvaluation": "_post_evaluation",
    "ObservedTrials": "folder._trial_store",
    "Progress": "_session",
    "Result": "results._result",
    "RunFolder": "folder._folder",
    "resume_command": "folder._folder",
    "resume_laboratory": "_laboratory",
    "SimulatedRun": "_laboratory",
    "awaits_robots": "_laboratory",
    "check_run": "_check_run",
    "infer": "_infer",
    "is_laboratory_run": "_laboratory",
    "load_run": "_open",
    "new_manifest": "folder._manifest",
    "new_run_path": "_infer",
    "pool": "results._pool",
    "read_events": "folder._trial_store",
    "read_post_evaluation": "_post_evaluation",
    "read_trials": "folder._trial_store",
    "refuse_film_path": "_trial",
    "refuse_target": "folder._target",
    "resume": "_infer",
    "scenario_named": "_trial",
    "simulate_laboratory": "_laboratory",
    "start": "_execute",
    "start_laboratory": "_laboratory",
    "stored_generations": "folder._checkpoints",
    "stored_laboratory": "_laboratory",
    "stored_traces": "folder._checkpoints",
    "trial_replay": "_trial",
    "write_trial": "_trial",
}


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
