"""Options that name recorded motion and a family of models, and what they stand for."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._numbers import real

if TYPE_CHECKING:
    from turing_learning.families import Family
    from turing_learning.trajectories import Trajectories, Windows

WINDOW_S = 4.0

_OPTIONS = {"pixels_per_cm": "--scale", "fps": "--fps", "length_s": "--window", "y_axis": "--y-axis"}
"""Arguments of `load_trajectories` and `windows`, and what they are called on the command line."""

PANEL = "Recorded motion instead of a scenario"

TrajectoriesOption = Annotated[
    Path | None,
    typer.Option("--trajectories", metavar="FILE", help="What a tracker wrote.", rich_help_panel=PANEL),
]
FpsOption = Annotated[
    float | None,
    typer.Option("--fps", metavar="RATE", help="Frames per second.", parser=real, rich_help_panel=PANEL),
]
ScaleOption = Annotated[
    float | None,
    typer.Option(
        "--scale", metavar="PIXELS", help="Pixels per cm; 1 for a file in cm.", parser=real, rich_help_panel=PANEL
    ),
]
YAxisOption = Annotated[
    str | None,
    typer.Option(
        "--y-axis",
        metavar="DIRECTION",
        help="Where y points in a file that does not say so: down, as in images, or up.",
        rich_help_panel=PANEL,
    ),
]
ModelOption = Annotated[
    str | None,
    typer.Option("--model", metavar="NAME", help="Family of models, see docs/families.md.", rich_help_panel=PANEL),
]
WindowOption = Annotated[
    float | None,
    typer.Option(
        "--window",
        metavar="SECONDS",
        help=f"Length of the samples; {WINDOW_S:g} by default.",
        parser=real,
        rich_help_panel=PANEL,
    ),
]


@dataclass(frozen=True)
class Recording:
    """What the options say."""

    trajectories: Path | None
    fps: float | None
    scale: float | None
    model: str | None
    window: float | None
    y_axis: Any = None

    @property
    def given(self) -> bool:
        """Whether any of them is there."""
        return any(value is not None for value in vars(self).values())

    @property
    def options(self) -> str:
        """The options as they are typed; empty if there are none."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        return "".join(f" --{name.replace('_', '-')} {shlex.quote(str(value))}" for name, value in given.items())

    def system(self) -> tuple["Windows", "Family"]:
        """Return windows of the recording, and a family of models that fits it; see `opened`."""
        windows, family, _ = self.opened()
        return windows, family

    def opened(self) -> tuple["Windows", "Family", "Trajectories"]:
        """Open the recording, and fit the family of models to it.

        Raises
        ------
        ConfigurationError
            If an option is missing or refused, or the file cannot be read.
        """
        from turing_learning.config import ConfigurationError, nearest
        from turing_learning.families import FAMILIES
        from turing_learning.trajectories import load_trajectories

        if self.trajectories is None or self.model is None:
            missing = "--trajectories" if self.trajectories is None else "--model"
            raise ConfigurationError(
                f"`{missing}` must be given for recorded motion; got none. For example: "
                "--trajectories fish.txt --fps 25 --scale 12.3 --model couzin"
            )
        if self.model not in FAMILIES:
            raise ConfigurationError(
                f"`--model` must be one of {', '.join(FAMILIES)}; got {self.model!r}. {nearest(self.model, FAMILIES)}"
            )
        try:
            motion = load_trajectories(self.trajectories, fps=self.fps, pixels_per_cm=self.scale, y_axis=self.y_axis)
            windows = motion.windows(length_s=WINDOW_S if self.window is None else self.window)
            family = FAMILIES[self.model](
                individuals=len(motion.individuals),
                steps=windows.learning.shape[1],
                interval_s=windows.interval_s,
                signals=windows.names,
            )
        except OSError as error:
            reason = error.strerror or str(error)
            raise ConfigurationError(
                f"`--trajectories` must be a readable file; got {self.trajectories} ({reason})."
            ) from error
        except (ValueError, ImportError) as error:
            raise ConfigurationError(in_options(str(error))) from error
        return windows, family, motion

    def arguments(self) -> dict[str, Any]:
        """Return what `turing_learning.infer` is told of the system."""
        windows, family = self.system()
        assert self.trajectories is not None
        return {
            "genuine": windows,
            "simulate": family,
            "parameters": family.parameters,
            "name": self.model,
            "title": f"{self.trajectories.name}, as {self.model}",
        }


def in_options(message: str) -> str:
    """Return a message with the names that arguments have on the command line."""
    message = message.replace(' Say "unknown" to stay in pixels, 1 if the file is in cm.', " Say 1 if it is in cm.")
    for argument, option in _OPTIONS.items():
        message = message.replace(f"`{argument}`", f"`{option}`")
    return message
