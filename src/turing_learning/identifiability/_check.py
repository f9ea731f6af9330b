"""What the samples pin down, parameter by parameter, what may be claimed of it, and all that a check has found."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter

from turing_learning.analysis import LEVEL, UNKNOWN, Judgment, Verdict, replace_unknown
from turing_learning.arrays import array
from turing_learning.examination import Telling, told_by
from turing_learning.report import Judged, counted, shown
from turing_learning.report.tabular import judged

from ._two_sample import TwoSampleTest, paired_test
from .evidence import PROFILING, Effort, Evidence, Quantity, Stored, stream

if TYPE_CHECKING:
    import pandas as pd
    from rich.text import Text

WIDE = 0.5
"""Share of the initial range from which on a parameter is not pinned down."""

FAR = 0.25
"""Error of a recovery, as a share of the initial range, from which on it has failed."""

FLIPS = 2000
"""Random signs that a claim is held against."""

FEWEST_GROUPS = 6
"""Groups below which no choice of signs is as rare as `LEVEL` on either side."""


def sides_rejected(
    differences: np.ndarray, above: np.ndarray, rng: np.random.Generator
) -> tuple[bool, bool]:
    """Say whether a panel tells a parameter's values below the estimate, and those above it, better than the estimate.

    Per side the largest t statistic over its values is held against the same for random signs of the groups,
    the same signs for all values: so many values are no more likely to be rejected by chance than one. A
    parameter is pinned down only if both sides are rejected: beside an end of its range, where there is no
    value on one side, it never is. Returns whether the values below, and those above, are rejected.

    Source: Westfall and Young, Resampling-based multiple testing (1993); Berger, Multiparameter hypothesis
    testing and acceptance sampling (1982), for two sides that both must be rejected.

    Parameters
    ----------
    differences : (V, G)
        For each of V values and each of G groups of samples: how much better a panel of that value decides
        about the group than those of the estimate do about the same group.
    above : (V,) bool
        Which values are above the estimate; the others are below.
    rng
        For the signs.
    """
    differences = array("differences", differences, "V G")
    above = array("above", above, "V", dtype=bool, V=len(differences))
    count = differences.shape[1]
    if count < FEWEST_GROUPS:
        return False, False

    def t(signs: np.ndarray) -> np.ndarray:
        """Return t statistics (F, V) of the mean over groups with signs (F, G)."""
        means = signs @ differences.T / count
        variances = np.maximum((differences**2).mean(axis=1) - means**2, 1e-12) / (count - 1)
        return np.asarray(means / np.sqrt(variances))

    chance = t(rng.choice([-1.0, 1.0], (FLIPS, count)))
    observed = t(np.ones((1, count)))[0]

    def rejected(side: np.ndarray) -> bool:
        if not side.any():
            return False
        # the largest over all values of a side, so that many values do not reject by chance
        exceeded = (chance[:, side].max(axis=1) >= observed[side].max() - 1e-9).sum()
        return bool((1 + exceeded) / (1 + FLIPS) <= LEVEL)

    return rejected(~above), rejected(above)


@dataclass(frozen=True)
class Profile(Stored):
    """A panel against models that differ from the estimate in one parameter."""

    parameter: str  #: Its name
    #: Values of the parameter, ascending over its initial range, the estimate among them
    values: tuple[float, ...]
    #: The same as numbers from -1 to 1 over the initial range
    numbers: tuple[float, ...]
    place: int  #: Which of them is the estimate
    accuracies: tuple[float, ...]  #: Of the test at each value, see `TwoSampleTest`
    criticals: tuple[float, ...]  #: The same, see `TwoSampleTest`
    #: Whether values below the estimate, and above it, are shown to fit worse, see `sides_rejected`; None in older checks
    rejected: tuple[bool, bool] | None = None

    @property
    def told_apart(self) -> tuple[bool, ...]:
        """Whether a panel tells a value from the genuine samples, and better than it tells the estimate."""
        # A panel that tells the estimate, too, has to tell a value better than that.
        lead = max(0.0, self.accuracies[self.place] - 0.5)
        apart = np.array(self.accuracies) > np.array(self.criticals) + lead
        return tuple(apart.tolist())

    @property
    def open_share(self) -> float:
        """Share of the initial range, around the estimate, in which no value is told apart: at most so much is left open."""
        apart = np.flatnonzero(self.told_apart)
        numbers = np.array(self.numbers)
        below = numbers[apart[apart < self.place]]
        above = numbers[apart[apart > self.place]]
        # Where nothing is told apart on a side, all of it is open.
        low = min(-1.0, numbers[0])
        high = max(1.0, numbers[-1])
        if len(below):
            low = below[-1]
        if len(above):
            high = above[0]
        return float(min((high - low) / 2, 1.0))


def profile(
    evidence: Evidence,
    estimate: np.ndarray,
    index: int,
    effort: Effort,
    *,
    seed: int,
    beyond: bool = False,
    plausible: np.ndarray | None = None,
) -> Profile:
    """Move one parameter across its initial range, and test at each value as at the estimate.

    The other parameters stay where they are, or within what is plausible. A parameter that only others can
    make up for may look pinned down here.

    Parameters
    ----------
    evidence
        The samples and the simulator.
    estimate : (P,)
        In the parameters' units.
    index
        Which parameter.
    effort
        How much is simulated and trained, and at how many values.
    seed
        Of all random numbers.
    plausible : (W, P)
        Models whose other parameters take part; None: those of the estimate alone.
    beyond
        If True, and the estimate lies at an end of the initial range that the search may leave: the values
        extend beyond that end by a quarter of the range.
    """
    name, parameter = list(evidence.parameters.items())[index]
    estimated = float(parameter.to_numbers(estimate[index]))
    low = -1.0
    high = 1.0
    if beyond:
        half_step = 1 / max(effort.points - 1, 1)
        if parameter.low is None and estimated < half_step - 1:
            low = estimated - 0.5
        if parameter.high is None and estimated > 1 - half_step:
            high = estimated + 0.5
    numbers = np.append(np.linspace(low, high, effort.points), estimated)
    order = np.argsort(numbers, kind="stable")
    values = parameter.to_units(numbers[order])
    best = int(order.argmax())
    around = estimate[None] if plausible is None else plausible
    tests = []
    for k, value in enumerate(values):
        models = around.copy()
        # at the estimate the parameter is as uncertain as the others
        if k != best:
            models[:, index] = value
        # with the same random numbers a parameter without effect changes nothing
        tests.append(paired_test(evidence, models, effort, seed, (PROFILING, index)))
    accuracies = np.array([of_groups for _, of_groups in tests])
    away = np.delete(np.arange(len(values)), best)
    differences = accuracies[away] - accuracies[best]
    rng = stream(seed, PROFILING, index, effort.points + 1)
    moved = Profile(
        parameter=name,
        values=tuple(values.tolist()),
        numbers=tuple(numbers[order].tolist()),
        place=best,
        accuracies=tuple(test.accuracy for test, _ in tests),
        criticals=tuple(test.critical for test, _ in tests),
    )
    low, high = sides_rejected(differences, away > best, rng)
    # a panel that learned badly at the estimate makes all others look better
    apart = np.array(moved.told_apart)
    return replace(
        moved, rejected=(low and bool(apart[:best].any()), high and bool(apart[best:].any()))
    )


@dataclass(frozen=True)
class Recovery(Stored):
    """A run whose truth is the estimate: what it found."""

    seed: int  #: Of the run
    generations: int  #: Of the run
    truth: Mapping[str, float]  #: Name -> value
    estimate: Mapping[str, float]  #: Name -> value
    #: Name -> two ends; both are NaN, in `check.json` null, where they are not known
    interval: Mapping[str, list[float]]
    #: Name -> absolute error as a share of the initial range
    error_share: Mapping[str, float]
    #: Of a panel that tells its truth from what it found; None in older checks of runs of generations
    accuracy: float | None = None
    #: The same for models that it calls plausible, each tested as if it were the truth
    attainable: tuple[float, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, as in `check.json`."""
        return super().to_json() | {"interval": replace_unknown(None, self.interval)}


@dataclass(frozen=True)
class PinnedDown:
    """What the samples say of one parameter; shares are of its initial range."""

    parameter: str  #: Its name
    #: Width of the interval of the estimate; None where it is not known
    interval_share: float | None
    #: Width of what its profile may leave open, at most; None without profile
    open_share: float | None
    #: Largest error of the recoveries; None without recovery
    recovery_error: float | None
    #: The bound that the estimate sits at, in words, such as "6 rad/s"; empty for none
    bound: str = ""
    #: Whether a panel tells the model from the samples: nothing is known of the parameters of a model that is wrong
    rejected: bool = False
    #: Of a run of trials: whether values below the estimate, and above it, are shown to fit worse. Only a parameter of
    #: which both are is pinned down: nothing is claimed beside an end of its range, or without profiles.
    sides: tuple[bool, bool] | None = None

    @property
    def examined(self) -> bool:
        """Whether anything may be said of it: in a run of trials only by its profile."""
        return self.sides is None or self.open_share is not None

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is not pinned down, in words; empty if it is."""
        unknown = []
        if self.examined and self.sides is not None:
            for side, rejected in zip(("lower", "higher"), self.sides, strict=True):
                if not rejected:
                    unknown.append(side)
        width = self.interval_share or 0.0
        share = self.open_share or 0.0
        error = self.recovery_error or 0.0
        findings = (
            (self.rejected, "the estimate does not fit"),
            (bool(self.bound), f"it is at the bound {self.bound}, beyond which nothing was tried"),
            (self.interval_share is None and self.sides is None, "its interval is not known"),
            (not self.examined, "it has no profile"),
            (bool(unknown), f"{' or '.join(unknown)} values are not shown to fit worse"),
            (width >= WIDE, f"its interval is {width:.0%} of the initial range"),
            (share >= WIDE and self.sides is None, f"up to {share:.0%} of the range may be open"),
            (error >= FAR, f"a known truth was missed by {error:.0%} of the range"),
        )
        return tuple(reason for holds, reason in findings if holds)

    @property
    def pinned_down(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.reasons

    @property
    def verdict(self) -> str:
        """What to say of it in a table."""
        if self.bound:
            return f"at the bound {self.bound}"
        if self.pinned_down:
            return "pinned down"
        return "not pinned down"


@dataclass(frozen=True, repr=False)
class Check(Judged):
    """Whether the estimate of a run can be believed."""

    test: TwoSampleTest  #: A panel against the model with the estimated parameters
    parameters: tuple[PinnedDown, ...]  #: What is said of each parameter
    profiles: tuple[Profile, ...]  #: Of each parameter; empty if they were left out
    #: Runs whose truth is the estimate; empty if they were left out
    recoveries: tuple[Recovery, ...]
    quantities: tuple[Quantity, ...]  #: Distributions, genuine beside simulated
    #: Generations, or trials, after which an unfinished run was checked, and those of the whole; else None
    unfinished: tuple[int, int] | None = None
    #: What the run says of itself, and the last pool that it was in; not in `check.json`
    said: tuple[Verdict, ...] = ()
    #: Statistics that give an estimate away that does not fit, the most telling first, as of `turing_learning.test`
    telling: tuple[Telling, ...] = ()

    def __post_init__(self) -> None:
        # nothing is known of the parameters of a model that does not fit
        rejected = self.judgment.fits is False
        parameters = tuple(replace(entry, rejected=rejected) for entry in self.parameters)
        object.__setattr__(self, "parameters", parameters)

    @property
    def judgment(self) -> Judgment:
        """Whether to believe the estimate: all words and sentences of a check are from here."""
        said = list(self.said)
        loose = []
        for entry in self.parameters:
            if entry.bound:
                said.append(Verdict.BOUND)
                loose.append(f"{entry.parameter} ({entry.verdict})")
            elif entry.reasons:
                loose.append(entry.parameter)
        recovered = []
        attainable: list[float] = []
        near = None
        for recovery in self.recoveries:
            near = near is not False and max(recovery.error_share.values()) < FAR
            attainable += recovery.attainable
            if recovery.accuracy is not None:
                recovered.append(recovery.accuracy)
        # A run of trials without profiles says nothing of any parameter.
        examined = any(entry.examined for entry in self.parameters)
        return Judgment(
            said=tuple(said),
            examination=self.test,
            recovered=tuple(recovered),
            attainable=tuple(attainable),
            near=near,
            parameters=len(self.parameters) if examined else 0,
            loose=tuple(loose) if examined else (),
        )

    @property
    def not_pinned_down(self) -> tuple[str, ...]:
        """Names of the parameters that are not pinned down."""
        return tuple(entry.parameter for entry in self.parameters if not entry.pinned_down)

    @property
    def text(self) -> str:
        """What was found, in sentences."""
        sentences = [*self.judgment.sentences]
        if self.telling:
            sentences.append(told_by(self.telling))
        if self.unfinished is not None:
            done, asked = self.unfinished
            unit = "generations" if self.parameters[0].sides is None else "trials"
            sentences.append(
                f"The run was not finished: the estimate is that after {done} of {asked} {unit}."
            )
        return " ".join(sentences)

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each parameter: what is left open, in shares of the initial range, and whether it is pinned down."""
        import pandas as pd

        parameters = [(entry, "; ".join(entry.reasons)) for entry in self.parameters]
        rows = [vars(entry) | {"pinned_down": not why, "why": why} for entry, why in parameters]
        return pd.DataFrame(rows).set_index("parameter")

    def _shown(self) -> "tuple[str, list[str], list[list[str]], list[str | Text]]":
        rows = []
        for entry in self.parameters:
            shares = (
                (entry.interval_share, "{:.1%}"),
                (entry.open_share, "{:.0%}"),
                (entry.recovery_error, "{:.1%}"),
            )
            cells = [shown(share, form.format) for share, form in shares]
            rows.append([entry.parameter, *cells, "; ".join(entry.reasons) or "pinned down"])
        headings = ["parameter", "interval", "left open", "missed by", "verdict"]
        samples = counted(self.test.genuine_samples, "held-out sample")
        truths = len(self.recoveries)
        head = f"{samples}, {counted(truths, 'known truth')}, {counted(len(self.profiles), 'profile')}: {self.verdict}"
        remark = "Shares of the initial range; those left open are upper bounds."
        return head, headings, rows, [remark, self.text, judged(self.judgment)]


def read_check(content: Mapping[str, Any], said: tuple[Verdict, ...] = ()) -> Check:
    """Make a check of what `check.json` holds, beside what else is said of the run."""
    recovered = []
    for recovery in content["recoveries"]:
        # JSON has no NaN: null stands for it
        interval = replace_unknown(UNKNOWN, recovery["interval"])
        recovered.append({**recovery, "interval": interval})
    fields = {"profiles": list(content["profiles"].values()), "recoveries": recovered, "said": said}
    return _reader().validate_python({**content, **fields})


@cache
def _reader() -> TypeAdapter[Check]:
    # takes long to make
    return TypeAdapter(Check)
