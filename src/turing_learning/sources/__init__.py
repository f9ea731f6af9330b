"""Everything that yields samples besides robots: any system that was observed, and any simulator of it.

`OwnSystem`
    What a run has to know of such a system, as frozen data: parameters, signals, scales of the inputs. `same_time_step`
    says which time steps are held to be the same.
`Genuine`, `read_genuine`, `cut_samples`, `SplitSamples`
    Samples of the system, checked and split into those for learning and those kept for testing; what is split already.
`OwnSource`
    The sample source: genuine samples beside those of a simulator, in this process or in workers.
`GuardedInterrogation`
    Lets classifiers judge, and has models whose simulation failed rejected by all of them.
`CenteredClassifier`
    Judges samples as they were observed, with the classifiers of a run.
`Simulator`
    What is asked of a simulator.
`FailureLog`
    Which simulations failed, and why.
`OwnSystemError`
    The system or the simulator failed in a way that ends the run.
"""

from typing import TYPE_CHECKING, Any

from ._errors import OwnSystemError
from ._failures import FailureLog
from ._genuine import Genuine, SplitSamples, cut_samples, read_genuine
from ._system import OwnSystem, same_time_step

if TYPE_CHECKING:
    from ._calls import Simulator
    from ._centered import CenteredClassifier
    from ._interrogation import GuardedInterrogation
    from ._source import OwnSource

__all__ = [
    "CenteredClassifier",
    "FailureLog",
    "Genuine",
    "GuardedInterrogation",
    "OwnSource",
    "OwnSystem",
    "OwnSystemError",
    "Simulator",
    "SplitSamples",
    "cut_samples",
    "read_genuine",
    "same_time_step",
]

_LAZY = {
    "CenteredClassifier": "_centered",
    "Simulator": "_calls",
    "GuardedInterrogation": "_interrogation",
    "OwnSource": "_source",
}


def __getattr__(name: str) -> Any:
    """Import what runs on first use, so that the description of a system stays cheap to import."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
