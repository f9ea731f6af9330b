"""Turing Learning: infer the rules that individuals follow from nothing but their motion, without a metric.

The three nouns at the top are the boxes of the method's picture: a sample source (for example a simulated swarm,
`swarm`), classifiers that judge motion samples (`classifiers`), and the coevolution that pits models against
classifiers (`coevolution`, on top of `evolution`). `infer` runs all of it; `load_run` opens what a run left behind;
`study` does many runs, and `load_study` opens them.

Rooms are imported on first use, so that ``import turing_learning`` stays fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from . import analysis, classifiers, coevolution, config, evolution, figures, models, report, runs, studies, swarm
    from .runs import Result, infer, load_run
    from .studies import StudyResult, load_study, study

__all__ = [
    "Result",
    "StudyResult",
    "analysis",
    "classifiers",
    "coevolution",
    "config",
    "evolution",
    "figures",
    "infer",
    "load_run",
    "load_study",
    "models",
    "report",
    "runs",
    "studies",
    "study",
    "swarm",
]

_FROM_RUNS = ("Result", "infer", "load_run")
_FROM_STUDIES = ("StudyResult", "load_study", "study")


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name in _FROM_RUNS:
        return getattr(import_module(".runs", __name__), name)
    if name in _FROM_STUDIES:
        return getattr(import_module(".studies", __name__), name)
    return import_module(f".{name}", __name__)


def __dir__() -> list[str]:
    return ["__version__", *__all__]
