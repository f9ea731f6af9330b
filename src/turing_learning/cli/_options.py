"""Options that several commands share: each is declared once, and its help is its docstring."""

import shlex
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from turing_learning.errors import nearest, refuse, refusing_as

if TYPE_CHECKING:
    from turing_learning.families import Family
    from turing_learning.trajectories import Trajectories, Windows

WINDOW_S = 4.0
MOST_PROBLEMS = 12  # lines about what is found in a recording
RECORDED = Group("Recorded motion", sort_key=10)


def number_of(kind: type, token: Any) -> Any:
    """Return the number that a text is."""
    text = token[0].value
    try:
        return kind(text)
    except ValueError as error:
        raise ValueError(f"must be {_NUMBERS[kind]}; got {text!r}.") from error


_NUMBERS = {int: "an integer", float: "a number"}

Integer = Annotated[int, Parameter(converter=number_of, n_tokens=1)]
Real = Annotated[float, Parameter(converter=number_of, n_tokens=1)]
Settings = Annotated[list[str] | None, Parameter("--set", negative="")]
Threads = Integer | None


@Parameter(name="*", group=RECORDED)
@dataclass(frozen=True)
class Tracks:
    """How a file of a tracker is read; the names are those of `load_trajectories` but for the scale."""

    fps: Real | None = None
    """Frames per second."""
    scale: Real | None = None
    """Pixels per cm; 1 for a file in cm."""
    y_axis: str | None = None
    """Where y points in a file that does not say so: down, as in images, or up."""
    format: str | None = None
    """Of a file that could be of several, see docs/trajectories.md."""
    keypoint: str | None = None
    """Point of the body that stands for the animal, in a file with several."""
    every: Integer | None = None
    """Keep one frame in K, of a file that has only those, or is faster than the motion."""

    @property
    def given(self) -> dict[str, Any]:
        """The options that are there, by their names in Python."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    @property
    def typed(self) -> str:
        """The options as they are typed; empty if there are none."""
        return "".join(f" --{name.replace('_', '-')} {shlex.quote(str(value))}" for name, value in self.given.items())

    def refuse_beside(self, rule: str) -> None:
        """Reject the first option that is given."""
        for name, value in self.given.items():
            refuse(f"--{name.replace('_', '-')}", rule, str(value))

    def read(self, path: Path, name: str) -> "Trajectories":
        """Open a recording; `name` is that of the argument for its file."""
        from turing_learning.config import ConfigurationError
        from turing_learning.trajectories import load_trajectories

        options = {"fps": self.fps, "pixels_per_cm": self.scale, "y_axis": self.y_axis, "format": self.format}
        try:
            with refusing_as(ConfigurationError):
                recording = load_trajectories(path, keypoint=self.keypoint, **options)  # type: ignore[arg-type]
                if self.every is None:
                    return recording
                if self.every >= 1 and self.every % recording.every:
                    rule = f"be a multiple of {recording.every}, as only one frame in so many is there"
                    refuse("every", rule, str(self.every), place=str(path))
                return recording.thinned(self.every)
        except ConfigurationError as error:
            if error.refusal is None or error.refusal.name != "path":
                raise
            raise ConfigurationError(replace(error.refusal, name=name)) from error
        except OSError as error:
            got = f"{path} ({error.strerror or error})"
            refuse(name, "be a readable file", got, error=ConfigurationError)
        except ImportError as error:
            raise ConfigurationError(str(error)) from error


@Parameter(name="*", group=RECORDED)
@dataclass(frozen=True)
class Recording(Tracks):
    """Recorded motion and the family of models that imitates it."""

    trajectories: Path | None = None
    """File of a tracker."""
    model: str | None = None
    """Family of models, see docs/families.md."""
    window: Real | None = None
    """Length of the samples (s); by default 4, or that of the run."""
    hold_out_individuals: str | None = None
    """Individuals, separated by commas, that are for testing alone."""

    def opened(self, steps: int | None = None) -> tuple["Windows", "Family", "Trajectories"]:
        """Open the recording, cut it into windows, by default of `steps`, and fit the family of models to it.

        Headings are not measured if the individuals of the family have none.
        """
        from turing_learning.config import ConfigurationError
        from turing_learning.families import FAMILIES

        if self.trajectories is None or self.model is None:
            missing = "--trajectories" if self.trajectories is None else "--model"
            example = "For example: --trajectories fish.txt --fps 25 --scale 12.3 --model couzin"
            refuse(missing, "be given for recorded motion", "none", example)
        if self.model not in FAMILIES:
            refuse("--model", f"be one of {', '.join(FAMILIES)}", repr(self.model), nearest(self.model, FAMILIES))
        apart = (
            [] if self.hold_out_individuals is None else [name.strip() for name in self.hold_out_individuals.split(",")]
        )
        if "" in apart:
            got = f"{self.hold_out_individuals!r}, where one is empty"
            refuse("--hold-out-individuals", "be names, separated by commas", got)
        motion, chosen = self.read(self.trajectories, "--trajectories"), FAMILIES[self.model]
        if not chosen.headings:
            motion = replace(motion, headings=None)
        length: dict[str, Any] = {"length_s": WINDOW_S if self.window is None else self.window}
        if self.window is None and steps is not None:
            length = {"steps": steps}
        with refusing_as(ConfigurationError):
            windows = motion.windows(**length, hold_out_individuals=apart)
            family = chosen(
                individuals=len(motion.individuals),
                steps=windows.learning.shape[1],
                interval_s=windows.interval_s,
                signals=windows.names,
            )
        return windows, family, motion

    def system(self) -> dict[str, Any]:
        """Return what `turing_learning.infer` takes, and print what is found in the recording."""
        windows, family, motion = self.opened()
        assert self.trajectories is not None
        found = str(motion.problems).splitlines()
        for line in found[:MOST_PROBLEMS]:
            print(f"{self.trajectories.name}: {line}")
        if len(found) > MOST_PROBLEMS:
            more = len(found) - MOST_PROBLEMS
            print(f"{self.trajectories.name}: and {more} more; all by `recording.check()` in Python")
        title = f"{self.trajectories.name}, as {self.model}"
        given = {"genuine": windows, "simulate": family, "parameters": family.parameters}
        return {**given, "name": self.model, "title": title}


def settings_of(settings: list[str] | None, options: Mapping[str, str | None]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return dotted key -> value, and dotted key -> where it was given, of --set texts and of the options for some keys."""
    from turing_learning.config import stated_once

    given = {key: text for key, text in options.items() if text is not None}
    stated = [(key, toml_value(text), f"--{key.removeprefix('run.')} {text}") for key, text in given.items()]
    for setting in settings or []:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip():
            refuse("--set", "be KEY=VALUE", repr(setting), "For example: --set models.parents=20")
        value = toml_value(text)
        stated.append((key.strip(), value, f"--set {key.strip()}={value}"))
    values = stated_once(stated)
    return values, {key: f"--{key.removeprefix('run.')}" if key in given else f"--set {key}" for key in values}


def toml_value(text: str) -> Any:
    """Return the value that a text is in TOML, or else the text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):  # not TOML, or an integer of thousands of digits
        return text


def require_scenario(scenario: str | None, config: Path | None, names: Iterable[str]) -> None:
    """Reject a command line that says nowhere what is to run."""
    if scenario is None and config is None:
        remedy = f"Choose from: {', '.join(names)}."
        refuse("SCENARIO", "be given, or a file with --config", "neither", remedy)
