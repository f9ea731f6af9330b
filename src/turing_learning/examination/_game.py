"""A Turing test for people: scenes of recordings, and the answers of those who judged them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes half a second

from turing_learning.errors import integer, number, refuse, require
from turing_learning.report import Game
from turing_learning.trajectories import Trajectories, smooth

from ._examiners import QUICK
from ._samples import recordings_of, same_rate
from ._test import Motion, test

PAIRS = 6
"""Pairs of a game."""
LENGTH_S = 8.0
"""Duration of a scene (s), where recordings are as long without gaps."""
SHORTER = (1.0, 0.5, 0.25, 0.125)
"""Shares of that duration which are tried, one after the other, where they are not."""
MOST_INDIVIDUALS = 30
"""Individuals in a scene."""
CONFIDENCE = 0.95
"""Of the interval of people's accuracy."""
COLUMNS = ("game", "player", "pair", "answer", "real", "right", "seconds")
"""Of a file of answers."""


def game(
    real: Motion, simulated: Motion, *, pairs: int = PAIRS, length_s: float = LENGTH_S, smooth_frames: int = 1,
    seed: int = 0, title: str = "Which one is real?",
) -> Game:  # fmt: skip
    """Make a Turing test for people of two sets of recordings, with the score of the panel beside theirs.

    A scene shows individuals that are there all the time, as many on both sides. Which side of a pair is real is drawn
    from the seed.

    Parameters
    ----------
    real, simulated
        Recordings of both, in one unit and at one frame rate; faster ones are thinned.
    pairs
        Number of pairs, >= 1.
    length_s
        Duration of a scene (s), shorter where no individual is there for so long.
    smooth_frames
        Frames over which positions are averaged, an odd number.
    seed
        Of all random numbers, >= 0.
    title
        What stands above the page; it is seen before the answers.

    Raises
    ------
    ValueError
        If a value is refused, or the recordings cannot be brought to one rate.

    Source
    ------
    Herbert-Read, Romenskyy and Sumpter, A Turing test for collective motion, Biology Letters 11 (2015).
    """
    integer("seed", seed)
    real_cleared = [recording.cleared() for recording in recordings_of(real, "real")]
    simulated_cleared = [recording.cleared() for recording in recordings_of(simulated, "simulated")]
    every = [*real_cleared, *simulated_cleared]
    tested = test(
        real_cleared, simulated_cleared, smooth_frames=smooth_frames, examiners=QUICK, seed=seed
    )
    sides = [same_rate(side, every, []) for side in (real_cleared, simulated_cleared)]
    frames, individuals = scene_size(sides, pairs, length_s)
    rng = np.random.default_rng((seed, 5))
    scenes = [scenes_of(side, frames, individuals, pairs, smooth_frames, rng) for side in sides]
    return Game(
        title=title,
        real=scenes[0],
        simulated=scenes[1],
        interval_s=1 / sides[0][0].fps,
        panel=tested.examined.auc,
        seed=seed,
    )


def scene_size(
    sides: Sequence[Sequence[Trajectories]], pairs: int, length_s: float
) -> tuple[int, int]:
    """Return frames and individuals of a scene, as all sides have them at least `pairs` times."""
    integer("pairs", pairs, 1)
    number("length_s", length_s, above=0)
    fps = sides[0][0].fps
    for share in SHORTER:
        frames = max(3, round(share * length_s * fps) + 1)
        at_once = [_most_at_once(side, frames, pairs) for side in sides]
        if min(at_once) > 0:
            return frames, min(*at_once, MOST_INDIVIDUALS)
    remedy = "Bridge gaps, or record for longer."
    return refuse("recordings", "show individuals without gaps", f"gaps in {frames} frames", remedy)


def _most_at_once(recordings: Sequence[Trajectories], frames: int, pairs: int) -> int:
    """Return how many individuals are there all the time, in `pairs` scenes that have most of them."""
    counts = np.concatenate([_there(recording, frames).sum(axis=1) for recording in recordings])
    counts = counts[counts > 0]
    if len(counts) < pairs:
        return 0
    return int(np.sort(counts)[::-1][: max(pairs, len(counts) // 2)].min())


def _there(recording: Trajectories, frames: int) -> np.ndarray:
    """Return who is there in all `frames` from a first one on: (F - frames + 1, A) bool."""
    absent = np.cumsum(~recording.present, axis=0)
    absent = np.concatenate((np.zeros((1, absent.shape[1]), dtype=absent.dtype), absent))
    return np.asarray(absent[frames:] == absent[:-frames])


def scenes_of(
    recordings: Sequence[Trajectories], frames: int, individuals: int, pairs: int, smooth_frames: int,
    rng: np.random.Generator,
) -> np.ndarray:  # fmt: skip
    """Return scenes (N, F, A, 2) of recordings, spread over time, in random order."""
    starts: list[tuple[int, int]] = []
    presence = [_there(recording, frames) for recording in recordings]
    for number_of, present in enumerate(presence):
        rows = np.flatnonzero(present.sum(axis=1) >= individuals)
        starts += [(number_of, int(row)) for row in rows]
    chosen = np.linspace(0, len(starts) - 1, pairs).round().astype(int)
    scenes = []
    for pick in rng.permutation(chosen):
        number_of, row = starts[pick]
        recording = recordings[number_of]
        positions = recording.positions
        if smooth_frames > 1:
            positions = smooth(positions, recording.present, smooth_frames)
        who = np.flatnonzero(presence[number_of][row])
        # neighbors of somebody, so that they stand as densely as they do
        distances = np.linalg.norm(positions[row, who] - positions[row, rng.choice(who)], axis=1)
        closest = who[np.argsort(distances, kind="stable")[:individuals]]
        scenes.append(positions[row : row + frames, closest])
    return np.stack(scenes)


@dataclass(frozen=True)
class Answers:
    """What several people answered."""

    right: int  #: Right answers
    answers: int  #: All of them
    people: int  #: Names of players; files without a name count as one each
    #: Of the accuracy, 95 %, exact (Clopper and Pearson)
    interval: tuple[float, float]
    p_value: float  #: How often who guesses is right so often, or more often
    table: Any  #: A data frame with a row for each answer

    @property
    def accuracy(self) -> float:
        """Share of right answers; 0.5 is guessing."""
        return self.right / self.answers

    def __str__(self) -> str:
        low, high = self.interval
        who = "1 person" if self.people == 1 else f"{self.people} people"
        return (
            f"{who}: {self.right} of {self.answers} right (accuracy {self.accuracy:.3f}, "
            f"{low:.3f} to {high:.3f}; p = {self.p_value:.3g})"
        )


def pool_answers(files: Iterable[str | Path]) -> Answers:
    """Pool the files that players of games have saved.

    Answers count as independent of each other; those of one person hardly are, so look at `table`, too.

    Parameters
    ----------
    files
        CSV files. A file that comes twice counts twice.

    Raises
    ------
    ValueError
        If there is no file, or one is no file of answers.
    """
    import pandas as pd

    tables = []
    people = []
    for number_of, path in enumerate(files):
        # somebody may be called None, or NA
        table = pd.read_csv(path, keep_default_na=False)
        missing = [column for column in COLUMNS if column not in table]
        rule = "be saved by a game"
        require(not missing, "files", rule, f"one without {', '.join(missing)}", place=str(path))
        judged = table["right"].astype(str).str.fullmatch("[01]")
        rule = "say of each answer whether it is right, as 0 or 1"
        wrong = table["right"][~judged].tolist()
        require(not wrong, "files", rule, repr(wrong[:1]), place=str(path))
        table["right"] = table["right"].astype(int)
        player = table["player"].astype(str)
        table["player"] = player.where(player != "", f"file {number_of + 1}")
        people += table["player"].unique().tolist()
        tables.append(table)
    require(tables, "files", "be one or more", "none")
    pooled = pd.concat(tables, ignore_index=True)
    right = int(pooled["right"].sum())
    count = len(pooled)
    require(count, "files", "hold answers", "none")
    interval = scipy.stats.binomtest(right, count).proportion_ci(CONFIDENCE)
    chance = scipy.stats.binomtest(right, count, alternative="greater").pvalue
    bounds = (float(interval.low), float(interval.high))
    return Answers(right, count, len(set(people)), bounds, float(chance), pooled)
