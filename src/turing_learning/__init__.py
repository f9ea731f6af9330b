"""Turing Learning: infer the rules that individuals follow from nothing but their motion, without a metric.

The three nouns at the top are the boxes of the method's picture: a sample source (for example a simulated swarm,
`swarm`), classifiers that judge motion samples (`classifiers`), and the coevolution that pits models against
classifiers (`coevolution`, on top of `evolution`). `infer` runs all of it, with simulated robots or with a system and
a simulator of one's own, whose parameters may be said in detail by `Parameter`; `resume` goes on with a run; `load_run`
opens what a run left behind; `pool` tells several runs as one; `study` does many runs, and `load_study` opens them.
`load_trajectories` reads recorded motion.

What is refused, a bound as a recording, a setting or a folder, is a ValueError: `config.ConfigurationError` and
`runs.RunFolderError` are kinds of it. What ends a run that has begun is none: `sources.OwnSystemError`,
`runs.RunStorageError`, `robots.LaboratoryError`.

Modules are imported on first use, so that ``import turing_learning`` stays fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from . import (
        analysis,
        classifiers,
        coevolution,
        config,
        detection,
        evolution,
        families,
        figures,
        identifiability,
        models,
        report,
        reproduction,
        robots,
        runs,
        search,
        sources,
        studies,
        swarm,
        trajectories,
    )
    from .models import Parameter
    from .runs import Pooled, Result, infer, load_run, pool, resume
    from .studies import StudyResult, load_study, study
    from .trajectories import Trajectories, load_trajectories

__all__ = [
    "Parameter",
    "Pooled",
    "Result",
    "StudyResult",
    "Trajectories",
    "analysis",
    "classifiers",
    "coevolution",
    "config",
    "detection",
    "evolution",
    "families",
    "figures",
    "identifiability",
    "infer",
    "load_run",
    "load_study",
    "load_trajectories",
    "models",
    "pool",
    "report",
    "reproduction",
    "resume",
    "robots",
    "runs",
    "search",
    "sources",
    "studies",
    "study",
    "swarm",
    "trajectories",
]

_FROM_RUNS = ("Pooled", "Result", "infer", "load_run", "pool", "resume")
_FROM_STUDIES = ("StudyResult", "load_study", "study")
_FROM_TRAJECTORIES = ("Trajectories", "load_trajectories")


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name in _FROM_RUNS:
        return getattr(import_module(".runs", __name__), name)
    if name == "Parameter":
        return import_module(".models", __name__).Parameter
    if name in _FROM_STUDIES:
        return getattr(import_module(".studies", __name__), name)
    if name in _FROM_TRAJECTORIES:
        return getattr(import_module(".trajectories", __name__), name)
    return import_module(f".{name}", __name__)


def __dir__() -> list[str]:
    return ["__version__", *__all__]
