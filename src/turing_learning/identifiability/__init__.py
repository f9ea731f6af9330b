"""Whether an estimate can be believed: can the genuine motion be told from that of the model, and what do the samples pin down?

`Evidence`, `evidence_of`
    Genuine samples for training and kept out, a simulator of models, and the network of the classifiers.
`Effort`
    How much is simulated and trained.
`two_sample_test`, `TwoSampleTest`
    Fresh classifiers are trained on genuine and simulated samples, and tested on kept-out ones.
`permutation_test`, `Permutation`
    Whether the scores of two kinds of samples differ, where samples of a group are alike.
`profile`, `Profile`
    The same test where a single parameter is moved across its range.
`Recovery`, `PinnedDown`, `Check`
    What a run finds whose truth is the estimate; what is said of each parameter; all of it together.
`sides_rejected`, `fault`, `FINE`, `FAILED_SEARCH`, `WRONG_MODEL`
    What may be claimed: that both sides of an estimate are told apart; that the model, or the search, is at fault.
`Quantity`, `compare_quantities`, `signal_quantities`, `swarm_quantities`, `recorded_quantities`
    Distributions of speed, turning, neighbor distance and polarization, genuine beside simulated.

docs/identifiability.md says how to read them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._check import Check, PinnedDown, Recovery
    from ._claims import FAILED_SEARCH, FINE, WRONG_MODEL, fault, sides_rejected
    from ._evidence import Effort, Evidence, evidence_of
    from ._permutation import Permutation, permutation_test
    from ._profile import Profile, profile
    from ._quantities import Quantity, compare_quantities, recorded_quantities, signal_quantities, swarm_quantities
    from ._two_sample import TwoSampleTest, two_sample_test

__all__ = [
    "FAILED_SEARCH",
    "FINE",
    "WRONG_MODEL",
    "Check",
    "Effort",
    "Evidence",
    "Permutation",
    "PinnedDown",
    "Profile",
    "Quantity",
    "Recovery",
    "TwoSampleTest",
    "compare_quantities",
    "evidence_of",
    "fault",
    "permutation_test",
    "profile",
    "recorded_quantities",
    "sides_rejected",
    "signal_quantities",
    "swarm_quantities",
    "two_sample_test",
]

_HOMES = {
    "_check": ("Check", "PinnedDown", "Recovery"),
    "_claims": ("FAILED_SEARCH", "FINE", "WRONG_MODEL", "fault", "sides_rejected"),
    "_evidence": ("Effort", "Evidence", "evidence_of"),
    "_permutation": ("Permutation", "permutation_test"),
    "_profile": ("Profile", "profile"),
    "_quantities": (
        "Quantity",
        "compare_quantities",
        "recorded_quantities",
        "signal_quantities",
        "swarm_quantities",
    ),
    "_two_sample": ("TwoSampleTest", "two_sample_test"),
}
_LAZY = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
