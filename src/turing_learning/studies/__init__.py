"""Studies: many runs, executed by workers, read as one table.

`study`
    Run a scenario with many seeds, with a grid or list of configurations, or with random behaviors (`BEHAVIORS`).
`resume_study`, `load_study`
    Go on with a study; open one.
`plan_study`, `Plan`
    What will run, resolved and validated before anything does.
`StudyResult`, `StudyRun`, `ParameterSummary`
    The table: one entry per run, and statistics of the errors per parameter; `paired` and `describe` help to print it.
`convergences`, `Convergence`
    Medians over the runs, generation by generation.
`StudyProgress`
    What an observer is told while the runs go on.
`Hands`, `create_study`, `execute_study`
    The steps of a study: who executes the runs; the folder; the runs.
`run_one`, `collect_study`, `write_slurm`, `refuse_script`
    The steps of a study on a Slurm cluster: one run by its number, the table at the end, the job script.
`StudyFolder`, `is_study`, `new_study_path`
    The files of a study; whether a folder is one; where a new one may be.
`ExecutorError`
    Workers that cannot go on; the study can be resumed.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._errors import ExecutorError
from ._folder import StudyFolder, is_study

if TYPE_CHECKING:
    from ._convergence import Convergence, convergences
    from ._plan import BEHAVIORS, Plan, plan_study
    from ._progress import StudyProgress
    from ._slurm import refuse_script, write_slurm
    from ._study import (
        Hands,
        collect_study,
        create_study,
        execute_study,
        load_study,
        new_study_path,
        resume_study,
        run_one,
        study,
    )
    from ._table import ParameterSummary, StudyResult, StudyRun, describe, paired

__all__ = [
    "BEHAVIORS",
    "Convergence",
    "ExecutorError",
    "Hands",
    "ParameterSummary",
    "Plan",
    "StudyFolder",
    "StudyProgress",
    "StudyResult",
    "StudyRun",
    "collect_study",
    "convergences",
    "create_study",
    "describe",
    "execute_study",
    "is_study",
    "load_study",
    "new_study_path",
    "paired",
    "plan_study",
    "refuse_script",
    "resume_study",
    "run_one",
    "study",
    "write_slurm",
]

_LAZY = {
    "BEHAVIORS": "_plan",
    "Convergence": "_convergence",
    "Hands": "_study",
    "ParameterSummary": "_table",
    "Plan": "_plan",
    "StudyProgress": "_progress",
    "StudyResult": "_table",
    "StudyRun": "_table",
    "collect_study": "_study",
    "convergences": "_convergence",
    "create_study": "_study",
    "describe": "_table",
    "execute_study": "_study",
    "load_study": "_study",
    "new_study_path": "_study",
    "paired": "_table",
    "plan_study": "_plan",
    "refuse_script": "_slurm",
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


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
