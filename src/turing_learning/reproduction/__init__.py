"""The experiments of the paper, repeated, and held against what it prints.

`reproduce`
    Conduct an experiment, or all, at full size or in a fast form; resumable.
`standings`, `Standing`, `default_folder`
    How the experiments stand.
`EXPERIMENTS`, `Experiment`, `Findings`, `Table`, `Picture`
    What there is to conduct, and what an experiment leaves behind.
`load_claims`, `Claim`
    What the paper prints, claim by claim.
`Verdict`, `RULES`
    Whether a claim agrees, and when it does.
`page`, `write_page`, `readme`, `write_readme`
    The page of all claims, and that of an experiment; `refuse_page_path` says where the first may be written.
`LeastSquares`, `squared_errors`
    The metric-based baseline of section 4.5.
`least_squares_optimum`, `expected_squared_error`, `check_statements`
    What its error leads to: theorem 1 and its corollaries.
`Stopped`
    An experiment that was stopped, and can go on.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._errors import Stopped

if TYPE_CHECKING:
    from turing_learning.reproduction.experiments.baseline._least_squares import LeastSquares, squared_errors
    from turing_learning.reproduction.experiments.baseline._theorem import (
        check_statements,
        expected_squared_error,
        least_squares_optimum,
    )

    from ._claims import Claim, load_claims
    from ._experiment import Experiment, Findings, Picture, Table
    from ._page import page, readme, refuse_page_path, write_page, write_readme
    from ._registry import EXPERIMENTS
    from ._reproduce import Standing, default_folder, reproduce, standings
    from ._verdicts import RULES, Verdict

__all__ = [
    "EXPERIMENTS",
    "RULES",
    "Claim",
    "Experiment",
    "Findings",
    "LeastSquares",
    "Picture",
    "Standing",
    "Stopped",
    "Table",
    "Verdict",
    "check_statements",
    "default_folder",
    "expected_squared_error",
    "least_squares_optimum",
    "load_claims",
    "page",
    "readme",
    "refuse_page_path",
    "reproduce",
    "squared_errors",
    "standings",
    "write_page",
    "write_readme",
]

_LAZY = {
    "EXPERIMENTS": "_registry",
    "RULES": "_verdicts",
    "Claim": "_claims",
    "Experiment": "_experiment",
    "Findings": "_experiment",
    "LeastSquares": "experiments.baseline._least_squares",
    "Picture": "_experiment",
    "Standing": "_reproduce",
    "Table": "_experiment",
    "Verdict": "_verdicts",
    "check_statements": "experiments.baseline._theorem",
    "default_folder": "_reproduce",
    "expected_squared_error": "experiments.baseline._theorem",
    "least_squares_optimum": "experiments.baseline._theorem",
    "load_claims": "_claims",
    "page": "_page",
    "readme": "_page",
    "refuse_page_path": "_page",
    "reproduce": "_reproduce",
    "squared_errors": "experiments.baseline._least_squares",
    "standings": "_reproduce",
    "write_page": "_page",
    "write_readme": "_page",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that the room is cheap to import."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
