"""Turing Learning: infer the rules that individuals follow from nothing but their motion, without a metric.

The three nouns at the top are the boxes of the method's picture: a sample source (for example a simulated swarm,
`swarm`), classifiers that judge motion samples (`classifiers`), and the coevolution that pits models against
classifiers (`coevolution`, on top of `evolution`). `infer` runs all of it; `load_run` opens what a run left behind.

Rooms are imported on first use, so that ``import turing_learning`` stays fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_ROOMS = ("analysis", "classifiers", "coevolution", "config", "evolution", "figures", "models", "report", "runs", "swarm")
_NAMES = {"infer": "runs", "load_run": "runs", "Result": "runs"}

__all__ = ["Result", "__version__", "infer", "load_run", *_ROOMS]  # noqa: PLE0604

if TYPE_CHECKING:
    from . import analysis, classifiers, coevolution, config, evolution, figures, models, report, runs, swarm
    from .runs import Result, infer, load_run


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f".{name}", __name__)
    if name in _NAMES:
        return getattr(import_module(f".{_NAMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
