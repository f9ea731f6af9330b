"""One video of eight termites, seen by three trackers: bring them together, and find where they disagree."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from turing_learning.trajectories import Trajectories, load_trajectories

DATA = Path(__file__).parent / "data" / "tracktor"
FILES = {
    "idtracker": "termite_video_idtracked.txt",
    "tracktor": "termite_video_tracked.csv",
    "toxtrac": "termite_video_toxtracked.txt",
}
FRAME_OF_VIDEO_0 = {"idtracker": 0, "tracktor": 1, "toxtrac": 0}
"""Tracktor counts frames from 1."""
CORNER = {"idtracker": (0.0, 0.0), "tracktor": (0.0, 0.0), "toxtrac": (371.0, -1.2)}
"""ToxTrac counts pixels from the corner of its arena: median difference to Tracktor."""


@dataclass(frozen=True, eq=False)
class Matches:
    """Individuals of two trackers paired frame by frame, so that the sum of distances is smallest; frames of the video.

    Arrays over the pairs: frame, individual of one and of the other, and the vector from the other to the one (pixels).
    """

    frame: np.ndarray
    one: np.ndarray
    other: np.ndarray
    offset: np.ndarray

    @property
    def distance(self) -> np.ndarray:
        return np.hypot(*self.offset.T)

    def frames_above(self, limit: float) -> list[int]:
        return sorted({int(frame) for frame in self.frame[self.distance > limit]})


def load(tracker: str) -> Trajectories:
    return load_trajectories(DATA / FILES[tracker], fps=25, pixels_per_cm="unknown")


def seen(tracker: str, recording: Trajectories, frame: int) -> tuple[np.ndarray, np.ndarray]:
    """Return who is present in a frame of the video, and where."""
    row = frame + FRAME_OF_VIDEO_0[tracker] - recording.first_frame
    who = (
        np.flatnonzero(recording.present[row])
        if 0 <= row < len(recording.present)
        else np.empty(0, dtype=int)
    )
    return who, recording.positions[row, who] + CORNER[tracker] if len(who) else np.empty((0, 2))


def match(one: str, other: str) -> Matches:
    first, second, found = load(one), load(other), []
    for frame in range(2801):
        who, here = seen(one, first, frame)
        whom, there = seen(other, second, frame)
        offset = here[:, None] - there[None]
        for i, j in zip(
            *linear_sum_assignment(np.hypot(offset[..., 0], offset[..., 1])), strict=True
        ):
            found.append((frame, who[i], whom[j], *offset[i, j]))
    table = np.array(found)
    return Matches(
        table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2].astype(int), table[:, 3:]
    )


def along_motion(matches: Matches, tracker: str, least_speed: float = 5.0) -> np.ndarray:
    """Return the offsets (pairs, 2) ahead and to the left, of those whom the other tracker sees move (pixels per frame)."""
    recording, ahead = load(tracker), []
    rows = matches.frame + FRAME_OF_VIDEO_0[tracker] - recording.first_frame
    for row, who, offset in zip(rows, matches.other, matches.offset, strict=True):
        if (
            2 <= row < len(recording.present) - 2
            and recording.present[row - 2 : row + 3, who].all()
        ):
            moved = (recording.positions[row + 2, who] - recording.positions[row - 2, who]) / 4
            speed = np.hypot(*moved)
            if speed > least_speed:
                ahead.append(
                    (offset @ moved / speed, (moved[0] * offset[1] - moved[1] * offset[0]) / speed)
                )
    return np.array(ahead)


def listing() -> str:
    """Return the disagreements as docs/results/termites.txt has them."""
    lines = []
    for one, other, limit in (
        ("tracktor", "toxtrac", 10),
        ("idtracker", "tracktor", 20),
        ("idtracker", "toxtrac", 15),
    ):
        matches = match(one, other)
        far = int((matches.distance > limit).sum())
        frames = matches.frames_above(limit)
        lines.append(
            f"{one} and {other}: {far} of {len(matches.frame)} pairs above {limit} px, in {len(frames)} frames:"
        )
        lines += [" ".join(map(str, frames[k : k + 20])) for k in range(0, len(frames), 20)]
    return "\n".join(lines)
