"""Recordings of trackers and the family of models that imitates them, by the options that a stored run remembers."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

from turing_learning._files import digest_of, file_digest
from turing_learning.errors import RefusedError, Setting, refuse, refusing_as, require

from ..trajectories import SIGNALS, Trajectories, Windows, load_trajectories, pooled_windows
from . import FAMILIES, Family, Particles, Replicates, as_recorded

WINDOW_S = 4.0


@dataclass(frozen=True, kw_only=True)
class TrackerFile:
    """How a file of a tracker is read; the names are those of `load_trajectories` but for the scale."""

    fps: float | None = None
    scale: float | None = None
    y_axis: str | None = None
    format: str | None = None
    keypoint: str | None = None
    every: int | None = None
    bridge: int | None = None
    smooth: int | None = None

    def read(self, path: Path, name: str) -> Trajectories:
        """Open a recording; `name` is that of the argument for its file."""
        options = {"fps": self.fps, "pixels_per_cm": self.scale, "y_axis": self.y_axis, "format": self.format}
        try:
            with refusing_as(RefusedError):
                recording = load_trajectories(path, keypoint=self.keypoint, **options)
                if self.every is not None:
                    rule = f"be a multiple of {recording.every}, as only one frame in so many is there"
                    fits = self.every < 1 or self.every % recording.every == 0
                    require(fits, "every", rule, str(self.every), place=str(path))
                    recording = recording.thinned(self.every)
                return recording if self.bridge is None else recording.bridged(self.bridge)
        except RefusedError as error:
            if error.refusal is None or error.refusal.name != "path":
                raise
            raise RefusedError(replace(error.refusal, name=name)) from error
        except OSError as error:
            got = f"{path} ({error.strerror or error})"
            refuse(name, "be a readable file", got)
        except ImportError as error:
            raise RefusedError(str(error)) from error


@dataclass(frozen=True, kw_only=True)
class RecordedMotion(TrackerFile):
    """Recordings, how they are cut into samples, and the family of models that imitates them; texts are those of commands."""

    trajectories: list[Path]
    model: str
    window: float | None = None
    signals: str | None = None
    tank: list[str] | None = None
    hold_out_individuals: str | None = None
    hold_out_recordings: str | None = None

    @classmethod
    def remembered(cls, stored: Mapping[str, Any], remedy: Any = "", *, elsewhere: bool = False) -> Self:
        """Return what `entry` wrote; reject a recording that is gone or has changed, unless it is `elsewhere` now."""
        paths = [Path(path) for path in stored["options"]["trajectories"]]
        for path, digest in zip(paths, stored["sha256"], strict=True) if not elsewhere else ():
            found = _digest(path)
            got = f"{path}, which {'has changed since' if found else 'is not there any more'}"
            require(found == digest, "trajectories", "be the recording that the run began with", got, remedy)
        return cls(**stored["options"] | {"trajectories": paths})

    @property
    def entry(self) -> dict[str, Any]:
        """What a stored run remembers: the options that are given, and digests of the files."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        options = given | {"trajectories": [str(path.absolute()) for path in self.trajectories]}
        return {"options": options, "sha256": [_digest(path) for path in self.trajectories]}

    def opened(
        self, steps: int | None = None, signals: Sequence[str] | None = None
    ) -> tuple[Windows, Family | Replicates, tuple[Trajectories, ...]]:
        """Open the recordings, cut them into windows, by default of `steps` and `signals`, and fit the family of models to them.

        Headings are not measured if the individuals of the family have none.
        """
        apart = _listed(self.hold_out_individuals, "hold_out_individuals", "names")
        numbers = _listed(self.hold_out_recordings, "hold_out_recordings", "numbers")
        count, chosen = len(self.trajectories), FAMILIES[self.model]
        fits = all(each.isdecimal() and 1 <= int(each) <= count for each in numbers) and len(set(numbers)) < count
        rule = f"be numbers of some of the {count} recordings, from 1, but not of all"
        require(fits, "hold_out_recordings", rule, repr(self.hold_out_recordings))
        motion = tuple(self.read(path, "trajectories") for path in self.trajectories)
        if not chosen.headings:
            motion = tuple(replace(each, headings=None) for each in motion)
        length: dict[str, Any] = {"length_s": WINDOW_S if self.window is None else self.window}
        if self.window is None and steps is not None:
            length = {"steps": steps}
        with refusing_as(RefusedError):
            windows = pooled_windows(
                motion,
                **length,
                signals=_listed(self.signals, "signals", "names") or signals or _usual(chosen, motion),
                smooth_frames=1 if self.smooth is None else self.smooth,
                hold_out_individuals=apart,
                hold_out_recordings=[int(number) - 1 for number in numbers],
            )
            near = any(name.startswith("neighbor") for name in windows.names) and issubclass(chosen, Particles)
            asked = self.tank or (["recorded"] if near else [])
            asked = asked * count if asked in (["recorded"], ["none"]) else asked
            tanks = [_tank(text, motion[min(k, count - 1)]) for k, text in enumerate(asked)]
            family = as_recorded(chosen, motion, windows, tanks=tanks)
        return windows, family, motion


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file, or of all files in a folder; nothing where there is none."""
    files = sorted(each for each in path.rglob("*") if each.is_file()) if path.is_dir() else [path]
    try:
        digests = [file_digest(file) for file in files]
    except OSError:
        return ""
    return digests[0] if path.is_file() else digest_of("".join(digests).encode())


def _usual(family: type[Family], motion: Sequence[Trajectories]) -> tuple[str, ...]:
    """Return the signals that say most: those of neighbors, too, of groups whose models take notice of each other."""
    together = family.social and all(len(each.individuals) > 1 for each in motion)
    return tuple(SIGNALS) if together else ("speed", "turn")


def _listed(text: str | None, option: str, what: str) -> list[str]:
    """Return the parts of a text between commas."""
    parts = [] if text is None else [part.strip() for part in text.split(",")]
    require("" not in parts, option, f"be {what}, separated by commas", f"{text!r}, where one is empty")
    return parts


def _tank(text: str, recording: Trajectories) -> tuple[float, float] | None:
    """Return width and height of a tank (cm), those of the places where individuals have been if that is asked for."""
    if text == "none":
        return None
    if text == "recorded":
        where = recording.positions[recording.present]
        width, height = (where.max(axis=0) - where.min(axis=0)).tolist()
        return width, height
    sides = re.fullmatch(r"([0-9.]+)x([0-9.]+)", text)
    try:
        return float(sides[1]), float(sides[2])  # type: ignore[index]
    except (TypeError, ValueError):
        refuse(
            "tank",
            "be width x height in cm, recorded, or none",
            repr(text),
            ("For example: ", Setting("tank", "40x30")),
        )
