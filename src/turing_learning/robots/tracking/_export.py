"""Tracks as tables that `load_trajectories` reads."""

from pathlib import Path

from turing_learning._files import whole
from turing_learning.robots._files import refuse_taken

from ._tracker import Track


def write_table(track: Track, path: Path, *, force: bool = False) -> None:
    """Write a table with a header: frame, x, y (cm), id, and heading (rad) where markers show it.

    A robot that was not seen in a frame has no row there. Read it with
    ``load_trajectories(path, fps=..., pixels_per_cm=1, y_axis="up")``.

    Parameters
    ----------
    track
        Individuals are numbered from 1, agents first.
    path
        The file, in a folder that exists.
    force
        Whether a file that is there may be replaced.

    Raises
    ------
    FileExistsError
        If it is there, and may not be replaced.
    """
    refuse_taken_table(path, force=force)
    names = ["frame", "x", "y", "id", *(["heading"] if track.has_headings else [])]
    with whole(path) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(",".join(names) + "\n")
        for frame, (poses, present) in enumerate(zip(track.poses, track.present, strict=True)):
            for number, (x, y, heading) in enumerate(poses.tolist(), start=1):
                if present[number - 1]:
                    row = f"{frame},{x:.4f},{y:.4f},{number}"
                    file.write(row + (f",{heading:.5f}\n" if track.has_headings else "\n"))


def refuse_taken_table(path: Path, *, force: bool) -> None:
    """Raise FileExistsError if a file is there, and may not be replaced; for those who have much to do before they write."""
    refuse_taken(path, name="out", force=force)
