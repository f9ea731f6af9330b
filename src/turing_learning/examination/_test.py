"""The door: two sets of recordings or arrays to all that is said of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import LEVEL
from turing_learning.arrays import array
from turing_learning.errors import integer, refuse, require
from turing_learning.report import Tabular, counted
from turing_learning.trajectories import Trajectories, Windows

from ._examiners import PANEL, QUICK, Examiner, Ridge
from ._panel import PERMUTATIONS, Examined, Views, examine_views, group_numbers
from ._samples import Pair, pair_of, pair_of_arrays, pair_of_windows, recordings_of
from ._telling import LabelledWindows, Telling, told_by, what_tells

if TYPE_CHECKING:
    import pandas as pd
    from rich.text import Text

Motion = np.ndarray | Trajectories | Sequence[Trajectories]
"""Samples (K, T, D), a recording, or several."""

FEWEST_HALVED = 6
"""Groups of real samples that are halved for the control; with fewer, blocks of time are."""

RECORDINGS_DIFFER = "Smaller groups are told; but so are other divisions of the recordings, which differ themselves."
"""What to know where differences of recordings would count as one of the sides."""

ABOUT_GROUPS = {
    "recordings": "Groups are recordings.",
    "individuals": "Groups are individuals: what all of one recording share counts as a difference.",
    "blocks of time": "Groups are blocks of time: lasting differences between individuals, or recordings, count as differences.",
    "samples": "Each sample is a group: name `groups` if some belong together.",
    "groups": "Groups are those that were named.",
}
"""What to know about the groups."""


@dataclass(frozen=True, repr=False)
class TuringTest(Tabular):
    """Whether simulated motion is told from real motion, and by what."""

    examined: Examined  #: What the panel found
    signals: tuple[str, ...]  #: That it saw
    #: What gives the simulated samples away, the most telling statistics first
    telling: tuple[Telling, ...]
    #: The same test of one half of the real groups against the other
    control: Examined | None = None
    remarks: tuple[str, ...] = ()  #: How samples were made, a sentence each
    windows: LabelledWindows | None = field(default=None, compare=False)  #: The samples
    #: Of real and simulated samples (K, T + 1, 2)
    paths: tuple[np.ndarray | None, ...] = field(default=(), compare=False)

    @property
    def accuracy(self) -> float:
        """Share of right answers; 0.5 is guessing."""
        return self.examined.accuracy

    @property
    def p_value(self) -> float:
        """How often exchanged labels give so high an accuracy."""
        return self.examined.p_value

    @property
    def verdict(self) -> str:
        """What came out: "told apart", "cannot tell" or "cannot say"."""
        if self.examined.told_apart:
            return "told apart"
        power = self.examined.power_accuracy
        if power is not None and power <= NOTICED:
            return "cannot tell"
        return "cannot say"

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was found, sentence by sentence."""
        examined = self.examined
        low, high = examined.interval
        numbers = (
            f"accuracy {examined.accuracy:.3f}, {low:.3f} to {high:.3f}; p = {examined.p_value:.3f}"
        )
        power = examined.power_accuracy
        noticed = ""
        if power:
            noticed = f"It would have noticed an accuracy of {power:.2f} in 80 % of such tests."
        if self.verdict == "told apart":
            sentences = [f"The simulated motion is told from the real one ({numbers})."]
            sentences.append(told_by(self.telling))
        elif self.verdict == "cannot tell":
            sentences = [
                f"The panel cannot tell the simulated motion from the real one ({numbers}).",
                noticed,
            ]
        else:
            sentences = [f"The test cannot say whether the simulated motion passes ({numbers})."]
            if examined.blind:
                sentences.append("All samples look the same to the examiners.")
            elif RECORDINGS_DIFFER in self.remarks:
                sentences.append("Give more recordings.")
            else:
                sentences += [
                    noticed or "So few groups could not have noticed any difference.",
                    "Give more recordings.",
                ]
        if self.control is not None:
            sentences.append(self._of_control(self.control))
        return tuple(sentences)

    @property
    def text(self) -> str:
        """All sentences."""
        return " ".join(self.sentences)

    def to_json(self) -> dict[str, Any]:
        """Return what the command prints with --json."""
        telling = []
        for cue in self.telling:
            # what does not apply to a cue is left out
            facts = {name: value for name, value in vars(cue).items() if value not in (None, "")}
            telling.append(facts)
        control = None
        if self.control is not None:
            control = self.control.to_json()
        return {
            **self.examined.to_json(),
            "telling": telling,
            "verdict": self.verdict,
            "signals": list(self.signals),
            "control": control,
            "sentences": [*self.sentences, *self.remarks],
        }

    def to_dataframe(self) -> "pd.DataFrame":
        """Return a row for each examiner: its accuracy and its own p-value."""
        import pandas as pd

        rows = list(map(vars, self.examined.examiners))
        return pd.DataFrame(rows).set_index("name")

    def _of_control(self, control: Examined) -> str:
        numbers = f"(accuracy {control.accuracy:.3f}, p = {control.p_value:.3f})"
        if control.p_value > LEVEL:
            return f"Control: one half of the real groups is not told from the other {numbers}."
        return f"Control: even one half of the real groups is told from the other {numbers}; they differ among themselves."

    def _shown(self) -> "tuple[str, list[str], list[list[str]], list[str | Text]]":
        real, simulated = self.examined.samples
        groups = " and ".join(map(str, self.examined.groups))
        samples = f"{counted(real, 'real sample')}, {simulated} simulated, in {groups} {self.examined.grouping}"
        rows = []
        for member in self.examined.examiners:
            rows.append([member.name, f"{member.accuracy:.3f}", f"p = {member.p_value:.3f}"])
        for cue in self.telling:
            if cue.kind in ("statistic", "signal"):
                rows.append([cue.what, f"{cue.accuracy:.3f}", cue.words or "-"])
        headings = ["who, or by what", "accuracy", "simulated against real"]
        return f"{self.verdict}: {samples}", headings, rows, [self.text, " ".join(self.remarks)]


NOTICED = 0.75
"""A test that would not notice this accuracy does not say that it cannot tell."""


def test(
    real: Motion, simulated: Motion, groups: Any = None, names: Sequence[str] | None = None, *,
    control: bool = False, window_s: float | None = None, smooth_frames: int = 1,
    examiners: Sequence[Examiner] = PANEL, permutations: int = PERMUTATIONS, seed: int = 0,
) -> TuringTest:  # fmt: skip
    """Put a simulator to the test: can a panel of examiners tell its motion from the real one?

    Nothing is inferred, and no simulator is needed: both sets may come from anywhere.

    Parameters
    ----------
    real, simulated : (K, T, D), (L, T, D)
        Samples of both, or recordings, which are cut into samples of the same length.
    groups : (K,), (L,)
        For samples: two sequences of labels, one for each side. Samples with the same label belong together, as those of one
        individual. None: each sample is a group. For recordings groups are chosen: recordings if there are enough of
        them, else individuals or blocks of time, whichever differ more among themselves.
    names : (D,)
        Of the signals. For recordings those to look at: "speed", "turn", "neighbor_distance", "neighbor_bearing",
        "polarization" (0 to 1) and "area" (of the group, cm2). None takes all that there are, the last two only where
        recordings are groups.
    control
        Whether to test one half of the real groups against the other, too.
    window_s
        Length of the samples of recordings (s). None takes 5 s, or less where individuals are not there for so long.
    smooth_frames
        Frames over which positions of recordings are averaged, an odd number.
    examiners
        Who judges: anything with `fit` and `score`, see `Examiner`.
    permutations
        Exchanges of labels behind the p-value, at least 19.
    seed
        Of all random numbers, >= 0.

    Returns
    -------
    TuringTest
        Accuracy, p-value, power, and what gives the simulated motion away.

    Raises
    ------
    ValueError
        If samples do not have the same T and D, recordings not the same unit and rate, or there are too few groups.

    Source
    ------
    Herbert-Read, Romenskyy and Sumpter, A Turing test for collective motion, Biology Letters 11 (2015);
    docs/decisions/0039-examination.md.
    """
    integer("seed", seed)
    if isinstance(real, np.ndarray) or isinstance(simulated, np.ndarray):
        pair, owners = _arrays(real, simulated, groups, names, seed)
        views = _views(pair, examiners, seed)
        grouping = "samples" if groups is None else "groups"
    else:
        require(groups is None, "groups", "be left out for recordings", "labels")
        sides = recordings_of(real, "real"), recordings_of(simulated, "simulated")
        pair = pair_of(
            *sides, names=names, window_s=window_s, smooth_frames=smooth_frames, seed=seed
        )
        return _of_pair(
            pair, control=control, examiners=examiners, permutations=permutations, seed=seed
        )
    return _tested(views, pair, owners, grouping, control, examiners, permutations, seed)


def test_held_out(
    windows: Windows, simulated: np.ndarray, *, control: bool = False, examiners: Sequence[Examiner] = PANEL,
    permutations: int = PERMUTATIONS, seed: int = 0,
) -> TuringTest:  # fmt: skip
    """Test samples of a simulator against the windows that were held out from learning.

    Parameters
    ----------
    windows
        Of recorded motion, H of them held out.
    simulated : (H, T, D)
        As many samples, in the same signals. They are grouped as the windows are: recordings if there are enough of them,
        else individuals or blocks of time.
    control, examiners, permutations, seed
        As in `test`.

    Raises
    ------
    ValueError
        If the samples are not of that shape, or there are too few groups.
    """
    integer("seed", seed)
    held_out = windows.held_out.shape
    sizes = {"H": held_out[0], "T": held_out[1], "D": held_out[2]}
    simulated = array("simulated", simulated, "H T D", **sizes)
    pair = pair_of_windows(windows, simulated, seed)
    return _of_pair(
        pair, control=control, examiners=examiners, permutations=permutations, seed=seed
    )


def _of_pair(
    pair: Pair, *, control: bool, examiners: Sequence[Examiner], permutations: int, seed: int
) -> TuringTest:
    """Test a pair of sides whose groups are chosen."""
    views = _views(pair, examiners, seed)
    grouping = _grouping(pair, views, seed)
    owners = pair.real.owners(grouping), pair.simulated.owners(grouping)
    tested = _tested(views, pair, owners, grouping, control, examiners, permutations, seed)
    if grouping == "recordings" or not tested.examined.told_apart:
        return tested
    return _of_recordings(tested, views, pair, examiners, seed)


def _of_recordings(
    tested: TuringTest, views: Views, pair: Pair, examiners: Sequence[Examiner], seed: int
) -> TuringTest:
    """Return a test that tells, or what comes out by whole recordings if these differ among themselves as much.

    Recordings are too few to be groups, so that smaller groups tell. What one recording shares would be taken for a difference
    of the sides. So the panel has to tell the true sides better than any other division of the recordings.
    """
    owners = pair.real.recording, pair.simulated.recording
    counts = [len(np.unique(side)) for side in owners]
    if min(counts) < 2:
        return tested
    numbers = group_numbers((len(owners[0]), len(owners[1])), owners)
    examined = examine_views(views, numbers, "recordings", examiners, PERMUTATIONS, seed)
    # an exchange of both sides as a whole does as well as none
    alike = 2 if counts[0] == counts[1] else 1
    divisions = comb(sum(counts), counts[0]) // alike
    if examined.p_value <= 1 / divisions + 1e-9:
        weak = (
            f"With {counts[0]} recordings against {counts[1]}, chance alone tells them apart in one of "
            f"{divisions} tests: take it as weak evidence, or give four or more of each."
        )
        return replace(tested, remarks=(*tested.remarks, weak))
    remarks = [*tested.remarks, RECORDINGS_DIFFER]
    remarks.remove(ABOUT_GROUPS[tested.examined.grouping])
    # what is lost where something is shuffled is said only of what is told
    telling = [cue for cue in tested.telling if cue.kind != "shuffled"]
    return replace(tested, examined=examined, telling=tuple(telling), remarks=tuple(remarks))


def _tested(
    views: Views, pair: Pair, owners: tuple[np.ndarray, np.ndarray], grouping: str, control: bool,
    examiners: Sequence[Examiner], permutations: int, seed: int,
) -> TuringTest:  # fmt: skip
    numbers = group_numbers((len(owners[0]), len(owners[1])), owners)
    examined = examine_views(views, numbers, grouping, examiners, permutations, seed)
    labels = np.repeat([1.0, 0.0], examined.samples)
    windows = LabelledWindows(
        views.windows, labels, np.concatenate(numbers), pair.names, pair.units, pair.interval_s
    )
    telling = tuple(what_tells(windows, seed, told=examined.told_apart))
    between_halves = None
    if control:
        between_halves = _control(pair, owners[0], grouping, permutations, seed)
    return TuringTest(
        examined=examined,
        signals=pair.names,
        telling=telling,
        control=between_halves,
        remarks=(*pair.remarks, ABOUT_GROUPS[grouping], *_oddities(windows)),
        windows=windows,
        paths=(pair.real.paths, pair.simulated.paths),
    )


def _arrays(
    real: Any, simulated: Any, groups: Any, names: Sequence[str] | None, seed: int
) -> tuple[Pair, tuple[np.ndarray, np.ndarray]]:
    """Return samples that are arrays, and the labels of their groups."""
    real = array("real", real, "K T D")
    sizes = {"T": real.shape[1], "D": real.shape[2]}
    simulated = array("simulated", simulated, "L T D", **sizes)
    names = names or [f"signal {d + 1}" for d in range(sizes["D"])]
    rule = f"be one for each of the {sizes['D']} signals"
    require(len(names) == sizes["D"], "names", rule, len(names))
    if groups is not None:
        if isinstance(groups, Mapping):
            sides = list(groups.values())
        else:
            sides = list(groups)
        # One sequence for all samples, the real ones first
        if len(sides) == len(real) + len(simulated) and np.ndim(sides[0]) == 0:
            sides = [sides[: len(real)], sides[len(real) :]]
        rule = "be two sequences of labels, for real and simulated samples"
        require(len(sides) == 2, "groups", rule, counted(len(sides), "sequence"))
        for name, labels, samples in zip(
            ("real", "simulated"), sides, (real, simulated), strict=True
        ):
            if np.shape(labels) != (len(samples),):
                rule = f"be one label for each of the {len(samples)} {name} samples"
                refuse("groups", rule, str(np.shape(labels)))
        groups = np.asarray(sides[0]), np.asarray(sides[1])
    return pair_of_arrays(real, simulated, groups, names, seed)


def _views(pair: Pair, examiners: Sequence[Examiner], seed: int) -> Views:
    windows = np.concatenate((pair.real.samples, pair.simulated.samples))
    return Views.of(windows, pair.names, pair.interval_s, examiners, seed)


def _grouping(pair: Pair, views: Views, seed: int) -> str:
    """Return what a group is: of several choices the one under which chance alone reaches the highest accuracy.

    Individuals that differ lastingly are alike within individuals; individuals that influence each other are alike within a
    block of time. Where it is not known which holds, the more careful choice counts.
    """
    choices = pair.groupings
    if len(choices) == 1:
        return choices[0]
    reached = []
    for grouping in choices:
        owners = pair.real.owners(grouping), pair.simulated.owners(grouping)
        numbers = group_numbers((len(owners[0]), len(owners[1])), owners)
        reached.append(
            examine_views(views, numbers, grouping, (Ridge(),), PERMUTATIONS, seed).critical
        )
    return choices[int(np.argmax(reached))]


def _control(
    pair: Pair, owners: np.ndarray, grouping: str, permutations: int, seed: int
) -> Examined | None:
    """Examine one half of the real groups against the other; None if they are too few."""
    labels = np.unique(owners)
    if len(labels) < FEWEST_HALVED and pair.real.paths is not None:
        owners = pair.real.owners("blocks of time")
        grouping = "blocks of time"
        labels = np.unique(owners)
    if len(labels) < 4:
        return None
    half = np.random.default_rng((seed, 4)).permutation(labels)[: len(labels) // 2]
    in_half = np.isin(owners, half)
    halves = pair.real.taken(np.flatnonzero(in_half)), pair.real.taken(np.flatnonzero(~in_half))
    split = Pair(*halves, pair.names, pair.units, pair.interval_s)
    numbers = group_numbers(
        (int(in_half.sum()), int((~in_half).sum())), (owners[in_half], owners[~in_half])
    )
    return examine_views(_views(split, QUICK, seed), numbers, grouping, QUICK, permutations, seed)


def _oddities(samples: LabelledWindows) -> list[str]:
    """Return what is odd about samples and easily overlooked: signals that stand still, and copies."""
    oddities = []
    for name, values in zip(samples.names, np.moveaxis(samples.windows, 2, 0), strict=True):
        if np.ptp(values) == 0:
            oddities.append(
                f"{name} is constant: differences below 1e-9 of its largest value do not count."
            )
    genuine = {window.tobytes() for window in samples.windows[samples.labels > 0.5]}
    simulated = samples.windows[samples.labels < 0.5]
    copies = sum(window.tobytes() in genuine for window in simulated)
    if copies:
        oddities.append(
            f"{copies} of {len(simulated)} simulated samples equal a real one, as far as the panel sees."
        )
    return oddities
