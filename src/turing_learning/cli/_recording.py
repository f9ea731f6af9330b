"""Options that name recorded motion and a family of models, and what they stand for."""

import shlex
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._numbers import integer, real
from ._wording import in_options

if TYPE_CHECKING:
    from turing_learning.families import Family
    from turing_learning.trajectories import Trajectories, Windows

WINDOW_S = 4.0

PANEL = "Recorded motion"
TOLD = 12
"""Most lines about what is found in a recording."""

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
FormatOption = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        help="Of a file that could be of several, see docs/trajectories.md.",
        rich_help_panel=PANEL,
    ),
]
KeypointOption = Annotated[
    str | None,
    typer.Option(
        "--keypoint",
        metavar="NAME",
        help="Point of the body that stands for the animal, in a file with several.",
        rich_help_panel=PANEL,
    ),
]
EveryOption = Annotated[
    int | None,
    typer.Option(
        "--every",
        metavar="K",
        help="Keep one frame in K, of a file that has only those, or is faster than the motion.",
        parser=integer,
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
        help=f"Length of the samples; by default {WINDOW_S:g}, or that of the run.",
        parser=real,
        rich_help_panel=PANEL,
    ),
]
HoldOutOption = Annotated[
    str | None,
    typer.Option(
        "--hold-out-individuals",
        metavar="NAMES",
        help="Individuals, separated by commas, that are for testing alone.",
        rich_help_panel=PANEL,
    ),
]


def read(path: Path, *, every: int | None, **options: Any) -> "Trajectories":
    """Open a recording with options of `load_trajectories`, and keep one frame in so many."""
    from turing_learning.config import ConfigurationError
    from turing_learning.trajectories import load_trajectories

    recording = load_trajectories(path, **options)
    if every is None:
        return recording
    if every >= 1 and every % recording.every:
        raise ConfigurationError(
            f"`--every` must be a multiple of {recording.every}, as only one frame in so many is there; got {every} [{path}]."
        )
    return recording.thinned(every)


def refuse_other_simulator(run: Path, call: str) -> None:
    """Raise ConfigurationError for a run on a system that the command line has no simulator of, as it did not begin it.

    Parameters
    ----------
    run
        The run folder.
    call
        What Python does with it, {run} for its path.
    """
    from turing_learning.config import ConfigurationError
    from turing_learning.families import FAMILIES
    from turing_learning.runs import RunFolder
    from turing_learning.sources import OwnSystem

    system = RunFolder(run).configuration().scenario
    if isinstance(system, OwnSystem) and system.name not in FAMILIES:  # those that `arguments` names
        raise ConfigurationError(
            f"`run` must be on recorded motion that the command line began with; got {system.name!r}, whose samples and simulator "
            f"Python has [{run}]. Call there turing_learning.{call.format(run=repr(str(run)))}."
        )


@dataclass(frozen=True)
class Recording:
    """What the options say."""

    trajectories: Path | None
    fps: float | None
    scale: float | None
    model: str | None
    window: float | None
    y_axis: Any = None
    format: str | None = None
    keypoint: str | None = None
    every: int | None = None
    hold_out_individuals: str | None = None

    @classmethod
    def of(cls, context: typer.Context) -> "Recording":
        """Return what a command was told, which has all of these options."""
        return cls(**{field.name: context.params[field.name] for field in fields(cls)})

    @property
    def given(self) -> bool:
        """Whether any of them is there."""
        return any(value is not None for value in vars(self).values())

    @property
    def options(self) -> str:
        """The options as they are typed; empty if there are none."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        return "".join(f" --{name.replace('_', '-')} {shlex.quote(str(value))}" for name, value in given.items())

    def refuse_beside(self, what: str) -> None:
        """Raise ConfigurationError if an option is given for a run or study that is not on recorded motion."""
        from turing_learning.config import ConfigurationError

        for name, value in vars(self).items():
            if value is not None:
                raise ConfigurationError(
                    f"`--{name.replace('_', '-')}` must be left out for {what}, which needs nothing but its folder; got {value}."
                )

    def opened(self, run: Path | None = None) -> tuple["Windows", "Family", "Trajectories"]:
        """Open the recording, and fit the family of models to it.

        What the family knows nothing of is not measured: headings are left out of account if its individuals have none.

        Parameters
        ----------
        run
            A run folder, which must be on recorded motion; windows are as long as those of the run if no option says otherwise.

        Raises
        ------
        ConfigurationError
            If an option is missing or refused, or the file cannot be read.
        """
        from turing_learning.config import ConfigurationError, nearest
        from turing_learning.families import FAMILIES

        steps = None if run is None else self._steps(run)
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
            motion = read(
                self.trajectories,
                every=self.every,
                fps=self.fps,
                pixels_per_cm=self.scale,
                y_axis=self.y_axis,
                format=self.format,
                keypoint=self.keypoint,
            )
            chosen = FAMILIES[self.model]
            if not chosen.headings:
                motion = replace(motion, headings=None)
            windows = motion.windows(**self._length(steps), hold_out_individuals=self._apart())
            family = chosen(
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
            raise ConfigurationError(in_options(str(error), file="--trajectories")) from error
        return windows, family, motion

    def _steps(self, run: Path) -> int | None:
        """Return the length of the samples of a run; refuse the options for one on simulated robots."""
        from turing_learning.runs import RunFolder
        from turing_learning.sources import OwnSystem

        system = RunFolder(run).configuration().scenario
        if isinstance(system, OwnSystem):
            return system.steps
        self.refuse_beside("a run on simulated robots")
        return None

    def _apart(self) -> list[str]:
        """Return the names of the individuals that are held out."""
        from turing_learning.config import ConfigurationError

        if self.hold_out_individuals is None:
            return []
        names = [name.strip() for name in self.hold_out_individuals.split(",")]
        if "" in names:
            raise ConfigurationError(
                "`--hold-out-individuals` must be names, separated by commas; got "
                f"{self.hold_out_individuals!r}, where one is empty."
            )
        return names

    def _length(self, steps: int | None) -> dict[str, Any]:
        if self.window is None and steps is not None:
            return {"steps": steps}
        return {"length_s": WINDOW_S if self.window is None else self.window}

    def arguments(self) -> dict[str, Any]:
        """Return what `turing_learning.infer` is told of the system, and tell what is found in the recording."""
        windows, family, motion = self.opened()
        assert self.trajectories is not None
        found = str(motion.problems).splitlines()
        for line in found[:TOLD]:
            typer.echo(f"{self.trajectories.name}: {line}")
        if len(found) > TOLD:
            typer.echo(f"{self.trajectories.name}: and {len(found) - TOLD} more; all by `recording.check()` in Python")
        return {
            "genuine": windows,
            "simulate": family,
            "parameters": family.parameters,
            "name": self.model,
            "title": f"{self.trajectories.name}, as {self.model}",
        }
