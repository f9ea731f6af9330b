"""Studies: many runs, executed by workers, read as one table.

`study`
    Run a scenario with many seeds, with a grid or list of configurations, or with random behaviors.
`resume_study`, `load_study`
    Go on with a study; open one.
`plan_study`, `Plan`
    What will run, resolved and validated before anything does.
`StudyResult`, `StudyRun`, `ParameterSummary`
    The table: one entry per run, and statistics of the errors per parameter; `paired` and `describe` help to print it.
`StudyProgress`
    What an observer is told while the runs go on.
`run_one`, `collect_study`, `write_slurm`
    The steps of a study on a Slurm cluster: one run by its number, the table at the end, the job script.
`StudyFolder`
    The files of a study.
`ExecutorError`
    Workers that cannot go on; the study can be resumed.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._errors import ExecutorError
from ._folder import StudyFolder, is_study

if TYPE_CHECKING:
    from ._plan import BEHAVIORS, Plan, plan_study
    from ._progress import StudyProgress
    from ._slurm import write_slurm
    from ._study import collect_study, load_study, new_study_path, resume_study, run_one, study
    from ._table import ParameterSummary, StudyResult, StudyRun, describe, paired

__all__ = [
    "BEHAVIORS",
    "ExecutorError",
    "ParameterSummary",
    "Plan",
    "StudyFolder",
    "StudyProgress",
    "StudyResult",
    "StudyRun",
    "collect_study",
    "describe",
    "is_study",
    "load_study",
    "new_study_path",
    "paired",
    "plan_study",
    "resume_study",
    "run_one",
    "study",
    "write_slurm",
]

_LAZY = {
    "BEHAVIORS": "_plan",
    "ParameterSummary": "_table",
    "Plan": "_plan",
    "StudyProgress": "_progress",
    "StudyResult": "_table",
    "StudyRun": "_table",
    "collect_study": "_study",
    "describe": "_table",
    "load_study": "_study",
    "new_study_path": "_study",
    "paired": "_table",
    "plan_study": "_plan",
    "resume_study": "_study",
    "run_one": "_study",
    "study": "_study",
    "write_slurm": "_slurm",
}


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)
