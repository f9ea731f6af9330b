"""Signals to samples: windows for learning and for testing, with no frame in common."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from turing_learning.errors import integer, is_integer, require

from ._signals import Signals, last_true, next_true

MOST_PARTS = 5
EXCERPT_S = 60.0
LEAST_WINDOWS = 4
"""Windows that fit into a held-out block, one after the other, before there is a further one."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Samples for learning and testing, in the units that `SIGNALS` names: cm/s and rad/s for "speed" and "turn"."""

    learning: np.ndarray  #: (K, T, D): Samples, in order of time
    held_out: np.ndarray  #: (K, T, D)
    #: (K, 2): Place of the individual in `Trajectories.individuals`, row in `positions` of the window's first step;
    #: of several recordings individuals and rows are counted on, from one recording to the next
    learning_index: np.ndarray
    held_out_index: np.ndarray  #: (K, 2)
    names: tuple[str, ...]  #: Of the D signals
    interval_s: float  #: Duration of a step (s)
    #: Whether signals are measured with headings, speeds negative backwards, turns of the body; models have to be
    headings: bool
    steps_without_signal: (
        int  #: Steps of the chosen individuals that no window may contain because of gaps
    )
    steps_with_jump: int  #: Because of jumps
    #: Of each block: first row, row after the last, "learning", "held out", or if individuals are "learning and held out"
    blocks: tuple[tuple[int, int, str], ...]
    recordings: np.ndarray  #: (R, 2): Number of individuals and of rows of each recording
    #: (F, A, 2): Positions (cm) in the first `EXCERPT_S` of the first recording, if any; NaN where one is absent
    excerpt: np.ndarray | None = None
    smooth_frames: int = 1  #: Frames over which positions were averaged
    #: The R recordings, `Trajectories`, that they were cut from. They are pickled, too: a run that begins in another
    #: process knows by them which files it is on, and `origin_of` what was measured
    sources: tuple[Any, ...] = ()
    #: The arguments by which `pooled_windows` cuts them again, JSON; empty if those of recordings differ
    cut: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        counts = f"{len(self.learning)} windows for learning and {len(self.held_out)} held out"
        return f"{counts}, each of {self.learning.shape[1]} steps of {self.interval_s:g} s: {', '.join(self.names)}"

    @property
    def learning_recording(self) -> np.ndarray:
        """Of which recording (K,), from 0, each window for learning is."""
        return np.searchsorted(
            np.cumsum(self.recordings[:, 1]), self.learning_index[:, 1], side="right"
        )

    @property
    def held_out_recording(self) -> np.ndarray:
        """The same of each held-out window."""
        return np.searchsorted(
            np.cumsum(self.recordings[:, 1]), self.held_out_index[:, 1], side="right"
        )

    def frames(self, side: Literal["learning", "held out"]) -> list[np.ndarray]:
        """Return for each recording at which frames who may be learned from, or is held out: (F, A) bool."""
        require(side in ("learning", "held out"), "side", 'be "learning" or "held out"', side)
        individuals, rows = self.recordings.sum(axis=0)
        index = self.learning_index if side == "learning" else self.held_out_index
        # an individual that is for the other side alone has no windows on this one
        someone = np.isin(np.arange(individuals), index[:, 0])
        at_times = np.zeros(rows, dtype=bool)
        for begin, end, of in self.blocks:
            if of in (side, BOTH):
                at_times[begin:end] = True
        borders = np.cumsum(self.recordings[:-1], axis=0)
        times = np.split(at_times, borders[:, 1])
        people = np.split(someone, borders[:, 0])
        return [time[:, None] & who for time, who in zip(times, people, strict=True)]


def join_windows(recordings: Sequence[Windows], hold_out: Collection[int] = ()) -> Windows:
    """Join windows of several recordings, measured alike, whose individuals are different ones.

    Those in `hold_out`, from 0, are for testing alone, the others for learning alone then.
    """
    template = recordings[0]
    measured = _measured(template)
    for k, recording in enumerate(recordings, start=1):
        for name, value in _measured(recording).items():
            got = f"{measured[name]} and {value}"
            rule = "be the same in all recordings"
            require(value == measured[name], name, rule, got, place=f"recording {k}")
    if hold_out:
        fits = all(is_integer(k) and 0 <= k < len(recordings) for k in hold_out)
        fits = fits and len(set(hold_out)) < len(recordings)
        rule = f"be some of 0 to {len(recordings) - 1}, but not all"
        require(fits, "hold_out_recordings", rule, str(list(hold_out)))
    counts = np.concatenate([recording.recordings for recording in recordings])
    samples: dict[str, list[np.ndarray]] = {side: [] for side in SIDES}
    indices: dict[str, list[np.ndarray]] = {side: [] for side in SIDES}
    blocks: list[tuple[int, int, str]] = []
    # Individuals and rows are counted on, so that those of two recordings never meet.
    start = np.zeros(2, dtype=int)
    for k, recording in enumerate(recordings):
        learning_side, held_out_side = SIDES
        if hold_out:
            learning_side = held_out_side = SIDES[k in hold_out]
        samples[learning_side].append(recording.learning)
        indices[learning_side].append(recording.learning_index + start)
        samples[held_out_side].append(recording.held_out)
        indices[held_out_side].append(recording.held_out_index + start)
        for begin, end, side in recording.blocks:
            whole_side = learning_side if hold_out else side
            blocks.append((begin + start[1], end + start[1], whole_side))
        start = start + recording.recordings.sum(axis=0)
    cut: dict[str, Any] = {}
    if all(recording.cut == template.cut for recording in recordings):
        cut = {**template.cut, "hold_out_recordings": list(map(int, hold_out))}
    return replace(
        template,
        learning=np.concatenate(samples[SIDES[0]]),
        held_out=np.concatenate(samples[SIDES[1]]),
        learning_index=np.concatenate(indices[SIDES[0]]),
        held_out_index=np.concatenate(indices[SIDES[1]]),
        steps_without_signal=sum(recording.steps_without_signal for recording in recordings),
        steps_with_jump=sum(recording.steps_with_jump for recording in recordings),
        blocks=tuple(blocks),
        recordings=counts,
        sources=tuple(source for recording in recordings for source in recording.sources),
        cut=cut,
    )


def _measured(windows: Windows) -> dict[str, Any]:
    """Return what has to be alike in recordings that are joined."""
    return {
        "steps": windows.learning.shape[1],
        "signals": windows.names,
        "headings": windows.headings,
        "smooth_frames": windows.smooth_frames,
        "fps": f"{1 / windows.interval_s:.6g}",
    }


def cut_windows(
    signals: Signals, individuals: Sequence[int], jumps: np.ndarray, *, steps: int, stride: int | None, hold_out: float,
    gap: int, half: int, lead: int, apart: Sequence[int], **measured: Any,
) -> Windows:  # fmt: skip
    """Cut windows of T = `steps` of some individuals out of signals (F - 1, A, D), each as early as possible.

    So many frames on either side of a step as `half`, and before it as `lead`, enter its signals; individuals
    `apart` are for testing alone; `measured` says how the signals are.
    """
    stride = steps if stride is None else integer("stride", stride, 1)
    require(0 <= hold_out <= 0.9, "hold_out", "be from 0 to 0.9", str(hold_out))
    integer("gap", gap)
    valid = signals.valid.copy()
    frames = len(valid) + 1
    indices = []
    step_of = np.arange(len(valid))[:, None]
    # A jump enters later signals by the lead, and those around it by smoothing.
    for step, who in np.argwhere(jumps):
        valid[max(0, step - half) : step + half + lead + 1, who] = False
    blocks: tuple[tuple[int, int, str], ...] = ((0, frames, BOTH if apart else SIDES[0]),)
    if hold_out:
        blocks = cut_blocks(frames, hold_out, gap, lead + steps + 1 + 2 * half)
    for side, tested in zip(SIDES, (False, True), strict=True):
        chosen = [who for who in individuals if not apart or (who in apart) == tested]
        usable = np.zeros_like(valid)
        for begin, end, of in blocks:
            # the steps whose frames lie within the block
            if of in (side, BOTH):
                within = slice(begin + lead + half, max(0, end - half - 1))
                usable[within, chosen] = valid[within, chosen]
        # Where the stretch of usable steps around a step ends
        before = last_true(~usable)
        after = next_true(~usable)
        begins = ((step_of - before - 1) % stride == 0) & (after - step_of >= steps)
        index = np.argwhere(begins)[:, ::-1]
        rule = f"leave at least one window {'held out' if tested else 'for learning'}"
        got = f"{steps} steps in {frames} frames with hold_out {hold_out}, gap {gap}"
        needed = not tested or hold_out or apart
        remedy = "Take shorter windows, or bridge gaps."
        require(len(index) or not needed, "steps", rule, got, remedy)
        indices.append(index)
    samples = []
    for index in indices:
        samples.append(signals.values[index[:, 1, None] + np.arange(steps), index[:, 0, None]])
    return Windows(
        learning=samples[0],
        held_out=samples[1],
        learning_index=indices[0],
        held_out_index=indices[1],
        names=signals.names,
        steps_without_signal=int((~signals.valid[:, individuals]).sum()),
        steps_with_jump=int(jumps[:, individuals].sum()),
        blocks=blocks,
        recordings=np.array([[valid.shape[1], frames]]),
        **measured,
    )


SIDES = ("learning", "held out")
BOTH = "learning and held out"


def cut_blocks(
    frames: int, hold_out: float, gap: int, of_window: int
) -> tuple[tuple[int, int, str], ...]:
    """Return the blocks of frames for learning and for testing, those for testing spread over time.

    So many frames enter the signals `of_window`, one window.
    """
    count = int(np.clip(frames * hold_out // (LEAST_WINDOWS * of_window), 1, MOST_PARTS))
    blocks = []
    for k in range(count):
        start = frames * k // count
        end = frames * (k + 1) // count
        border = end - round((end - start) * hold_out)
        # The first block has nothing before it that it could meet.
        begin = start + gap if k else start
        blocks += [(begin, border, SIDES[0]), (border + gap, end, SIDES[1])]
    return tuple(block for block in blocks if block[0] < block[1])
