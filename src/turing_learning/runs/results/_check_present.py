"""Figures and table of a check: hand the numbers to the rooms that draw."""

from typing import TYPE_CHECKING

import numpy as np

from turing_learning import report
from turing_learning.analysis import is_known
from turing_learning.config import Configuration
from turing_learning.figures import Picture
from turing_learning.figures._classifiers import Distribution, ParameterProfile, profiles_figure, quantities_figure
from turing_learning.report._content import Listing

from ._result import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from turing_learning.identifiability import Check, PinnedDown


def draw_check(check: "Check", result: Result, configuration: Configuration) -> list[Picture]:
    """Draw the figures of a check.

    Parameters
    ----------
    check
        What was found.
    result, configuration
        Of the run.
    """
    drawings = []
    if check.profiles:
        drawings.append(
            Picture(
                "check-profiles",
                "What each parameter leaves open",
                "Accuracy on kept-out samples of fresh classifiers, trained against models in which one parameter is moved "
                "across its initial range; below the dashed line they may be guessing. "
                f"{report.describe_unknown(result.interval)}".strip(),
                _profiles(check, result, configuration),
                wide=True,
            )
        )
    if check.quantities:
        drawings.append(
            Picture(
                "check-quantities",
                "Genuine motion and motion simulated at the estimate",
                "Shares of the values in each bin; the outermost bins hold what is beyond them.",
                quantities_figure(
                    [
                        Distribution(
                            name=f"{each.name.replace('_', ' ')} ({each.unit})" if each.unit else each.name,
                            edges=np.array(each.edges),
                            genuine=np.array(each.genuine),
                            simulated=np.array(each.simulated),
                        )
                        for each in check.quantities
                    ]
                ),
                wide=True,
            )
        )
    return drawings


def _profiles(check: "Check", result: Result, configuration: Configuration) -> "Figure":
    system = configuration.system
    labels = dict(zip(system.parameters, system.parameter_labels, strict=True))
    return profiles_figure(
        [
            ParameterProfile(
                name=labels[each.parameter],
                values=np.array(each.values),
                accuracies=np.array(each.accuracies),
                criticals=np.array(each.criticals),
                estimate=result.estimate[each.parameter],
                interval=_known_ends(result.interval[each.parameter]),
                recovered=[recovery.estimate[each.parameter] for recovery in check.recoveries],
                logarithmic=system.parameters[each.parameter].scale == "log",
            )
            for each in check.profiles
        ]
    )


def _known_ends(ends: list[float]) -> tuple[float, float] | None:
    return (ends[0], ends[1]) if is_known(*ends) else None


def check_listing(check: "Check") -> Listing:
    """Return what is said of each parameter, as a table."""
    test = check.test
    return Listing(
        name="check",
        heading="Can it be believed?",
        columns=("parameter", "interval", "left open", "missed by", ""),
        rows=[_row(each) for each in check.parameters],
        note=f"{check.verdict} Tested on {test.genuine_samples} kept-out samples in {test.genuine_groups} groups "
        f"({test.grouping}) and {test.counterfeit_samples} simulated ones. Shares of the initial range: width of the interval of "
        "the estimate, what fresh classifiers leave open where this parameter alone is moved, and by how much a run missed "
        "the estimate when it was the truth.",
    )


def _row(each: "PinnedDown") -> tuple[str | None, ...]:
    return (
        each.parameter,
        None if each.interval_share is None else f"{each.interval_share:.0%}",
        None if each.open_share is None else f"at most {each.open_share:.0%}",
        None if each.recovery_error is None else f"{each.recovery_error:.1%}",
        "pinned down" if each.pinned_down else "not pinned down",
    )
