"""All that a check says of a run."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import UNKNOWN, Verdict
from turing_learning.analysis._estimate import known_or, ordered
from turing_learning.report import Tabular, shown

from ._claims import FAILED_SEARCH, FINE, WRONG_MODEL, Profile, fault
from ._evidence import Quantity
from ._two_sample import TwoSampleTest

if TYPE_CHECKING:
    import pandas as pd

WIDE = 0.5
"""Share of the initial range from which on a parameter is not pinned down."""
FAR = 0.25
"""Error of a recovery, as a share of the initial range, from which on it has failed."""


@dataclass(frozen=True)
class Recovery:
    """A run whose truth is the estimate: what it found.

    Attributes
    ----------
    seed, generations
        Of the run.
    truth, estimate
        Name -> value.
    interval
        Name -> two ends; both are NaN, in `check.json` null, where they are not known.
    error_share
        Name -> absolute error as a share of the initial range.
    accuracy, attainable
        Of fresh classifiers that tell samples of its truth from its estimate, and from its truth; None for runs of generations.
    """

    seed: int
    generations: int
    truth: Mapping[str, float]
    estimate: Mapping[str, float]
    interval: Mapping[str, list[float]]
    error_share: Mapping[str, float]
    accuracy: float | None = None
    attainable: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, as in `check.json`."""
        return asdict(self) | {"interval": known_or(None, self.interval)}


@dataclass(frozen=True)
class PinnedDown:
    """What the samples say of one parameter; shares are of its initial range.

    Attributes
    ----------
    parameter
        Its name.
    interval_share
        Width of the interval of the estimate; None where it is not known.
    open_share
        Width of what its profile may leave open, at most; None without profile.
    recovery_error
        Largest error of the recoveries; None without recovery.
    bound
        The bound that the estimate sits at, in words, such as "6 rad/s"; empty for none.
    rejected
        Whether classifiers tell the model from the samples: nothing is known of the parameters of a model that is wrong.
    sides
        Of a run of trials: whether values below the estimate, and values above it, are shown to fit worse than it. Only a
        parameter of which both are is pinned down: nothing is claimed beside an end of its range, or without profiles.
    """

    parameter: str
    interval_share: float | None
    open_share: float | None
    recovery_error: float | None
    bound: str = ""
    rejected: bool = False
    sides: tuple[bool, bool] | None = None

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is not pinned down, in words; empty if it is."""
        claimed = self.sides is not None
        sides = zip(("lower", "higher"), self.sides or (True, True), strict=True)
        open_ = " or ".join(side for side, rejected in sides if not rejected)
        said = (
            (self.rejected, "the estimate does not fit"),
            (bool(self.bound), f"it is at the bound {self.bound}, beyond which nothing was tried"),
            (self.interval_share is None and not claimed, "its interval is not known"),
            (bool(open_), f"{open_} values may fit as well"),
            (
                self.interval_share is not None and self.interval_share >= WIDE,
                f"its interval is {self.interval_share or 0:.0%} of the initial range",
            ),
            (
                self.open_share is not None and self.open_share >= WIDE and not claimed,
                f"up to {self.open_share or 0:.0%} of the range may be open",
            ),
            (
                self.recovery_error is not None and self.recovery_error >= FAR,
                f"a known truth was missed by {self.recovery_error or 0:.0%} of the range",
            ),
        )
        return tuple(reason for holds, reason in said if holds)

    @property
    def pinned_down(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.reasons

    @property
    def verdict(self) -> str:
        """What to say of it in a table."""
        if self.bound:
            return f"at the bound {self.bound}"
        return "pinned down" if self.pinned_down else "not pinned down"


@dataclass(frozen=True, repr=False)
class Check(Tabular):
    """Whether the estimate of a run can be believed.

    Attributes
    ----------
    test
        Fresh classifiers against the model with the estimated parameters.
    parameters
        What is said of each parameter.
    profiles
        Of each parameter; empty if they were left out.
    recoveries
        Runs whose truth is the estimate; empty if they were left out.
    quantities
        Distributions, genuine beside simulated.
    unfinished
        Generations, or trials of a run of trials, after which an unfinished run was checked, and those of the whole; else None.
    """

    test: TwoSampleTest
    parameters: tuple[PinnedDown, ...]
    profiles: tuple[Profile, ...]
    recoveries: tuple[Recovery, ...]
    quantities: tuple[Quantity, ...]
    unfinished: tuple[int, int] | None = None

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """What the check says of whether to believe the run; empty if nothing speaks against it.

        The model is rejected where classifiers tell it although searches find their truth: see `fault`, or for
        a run of generations, where every recovery comes within a quarter of the range.
        """
        found = [Verdict.BOUND] if any(each.bound for each in self.parameters) else []
        fits = all(share < FAR for each in self.recoveries for share in each.error_share.values())
        if self.fault == WRONG_MODEL or (self.fault is None and self.test.told_apart and self.recoveries and fits):
            found.append(Verdict.REJECTED)
        elif self.fault == FAILED_SEARCH or (self.fault is None and self.test.told_apart):
            found.append(Verdict.TOLD)
        return ordered(found) if found else ()

    @property
    def fault(self) -> str | None:
        """For a run of trials with two recoveries or more: "fine", "failed search" or "wrong model", see `fault`; else None.

        None, too, if classifiers tell the samples from the model better than in any recovery, and more cannot be said.
        """
        tested = [(each.accuracy, each.attainable) for each in self.recoveries if each.accuracy is not None]
        if len(tested) < 2:
            return None
        recovered, attainable = np.array(tested, dtype=float).T
        found = fault(self.test.accuracy, recovered, attainable)
        return None if found == FINE and self.test.told_apart and self.test.accuracy > recovered.max() else found

    @property
    def not_pinned_down(self) -> tuple[str, ...]:
        """Names of the parameters that are not pinned down."""
        return tuple(each.parameter for each in self.parameters if not each.pinned_down)

    @property
    def verdict(self) -> str:
        """All of it in two sentences, and a third if the run was not finished."""
        can = "can" if self.test.told_apart else "cannot"
        first = (
            f"Fresh classifiers {can} tell kept-out samples from the model "
            f"(accuracy {self.test.accuracy:.3f}, p = {self.test.p_value:.3f})."
        )
        first = {
            FINE: "The estimate is fine. ",
            FAILED_SEARCH: "The search has failed. ",
            WRONG_MODEL: "The model is wrong. ",
        }.get(self.fault or "", "") + first
        second = "Nothing speaks against any parameter being pinned down."
        loose = [
            f"{each.parameter} ({each.verdict})" if each.bound else each.parameter
            for each in self.parameters
            if each.reasons
        ]
        if loose:
            second = f"Not pinned down: {', '.join(loose)}."
        if self.unfinished is None:
            return f"{first} {second}"
        (done, asked), unit = self.unfinished, "generations" if self.parameters[0].sides is None else "trials"
        return f"{first} {second} The run was not finished: the estimate is that after {done} of {asked} {unit}."

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each parameter: what is left open, in shares of the initial range, and whether it is pinned down."""
        import pandas as pd

        rows = [
            asdict(each) | {"pinned_down": each.pinned_down, "why": "; ".join(each.reasons)} for each in self.parameters
        ]
        return pd.DataFrame(rows).set_index("parameter")

    def _shown(self) -> tuple[str, list[str], list[list[str]], list[str]]:
        rows = [
            [
                each.parameter,
                shown(each.interval_share, "{:.1%}".format),
                shown(each.open_share, "{:.0%}".format),
                shown(each.recovery_error, "{:.1%}".format),
                "; ".join(each.reasons) or "pinned down",
            ]
            for each in self.parameters
        ]
        headings = ["parameter", "interval", "left open", "missed by", "verdict"]
        remark = "Shares of the initial range; left open: at most. Where others may fit as well, the truth may be among them."
        return self.verdict, headings, rows, [remark]


def check_from_json(content: Mapping[str, Any]) -> Check:
    """Make a check of what `check.json` holds."""
    return Check(
        test=TwoSampleTest(**content["test"]),
        parameters=tuple(PinnedDown(**_tuples(each)) for each in content["parameters"]),
        profiles=tuple(Profile(**_tuples(each)) for each in content["profiles"].values()),
        recoveries=tuple(
            Recovery(**{**each, "interval": known_or(UNKNOWN, each["interval"])}) for each in content["recoveries"]
        ),
        quantities=tuple(Quantity(**_tuples(each)) for each in content["quantities"]),
        unfinished=_tuples(content).get("unfinished"),
    )


def _tuples(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in fields.items()}
