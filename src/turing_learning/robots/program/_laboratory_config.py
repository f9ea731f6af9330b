"""What a laboratory consists of, and how it works, as validated, frozen data."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError, model_validator

from turing_learning.config import (
    Configuration,
    ConfigurationError,
    Section,
    dotted,
    line_of,
    load_configuration,
    nearest,
    read_toml,
)

Positive = Annotated[float, Field(gt=0)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")]

RUN_SECTIONS = ("preset", "scenario", "models", "classifiers", "coevolution", "run")
"""What a laboratory's file says of the run, as the configuration of any run does."""

_BASE = {
    "models.parents": 10,
    "models.offspring": 10,
    "models.redraw": 0.0,
    "models.exchange": 0.0,
    "run.generations": 100,
    "run.checkpoint_every": 1,
    "scenario.arena.width_cm": 200.0,
    "scenario.arena.height_cm": 225.0,
    "scenario.robot.clamp_wheel_speeds": True,
    "scenario.trial.duration_s": 5.0,
}
"""The paper's setup where the file says nothing (sections 5.1 and 5.3); a generation takes minutes, so each one is saved.

No jumps (decision 0025): they come from the initial range, which the hyperbolic tangent makes -0.76 to 0.76 of the largest speed,
and 100 generations of 20 models cannot afford them.
"""

_DERIVED = {
    "scenario.agents": "[[robots]]",
    "scenario.replicas": "[[robots]]",
    "scenario.trial.control_interval_s": "camera.fps",
}


class RobotSection(Section):
    """A robot: an agent, which the PC does not control, or a replica at an address."""

    name: Name
    role: Literal["agent", "replica"]
    marker: str
    address: str | None = None

    @model_validator(mode="after")
    def _check_address(self) -> "RobotSection":
        if self.role == "replica" and not self.address:
            raise ValueError(
                f"`address` must be given for a replica; got nothing [robot {self.name!r}]. Name a serial device or "
                "socket://host:port."
            )
        if self.role == "agent" and self.address is not None:
            raise ValueError(
                f"`address` must be left out for an agent, which the PC does not control; got {self.address!r} "
                f"[robot {self.name!r}]."
            )
        return self


class CameraSection(Section):
    """The camera: its number, a video file or a URL; images per second; its calibration; what the robots wear.

    `landmarks` are printed markers that stay on the floor: identity -> x, y (cm). They must not be among the robots' markers.
    """

    source: int | str = 0
    fps: Positive = 10.0
    calibration: str
    markers: Literal["triangles", "aruco"] = "triangles"
    marker_height_cm: Positive = 6.0
    landmarks: dict[str, tuple[float, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_landmarks(self) -> "CameraSection":
        for identity in self.landmarks:
            if not (identity.isdecimal() and int(identity) < 50):
                raise ValueError(f"`camera.landmarks` must be named by their identities, 0 to 49; got {identity!r}.")
        return self


class TimingSection(Section):
    """How long a replica stays in its states (s), as in its firmware: R1, R3 and R4 wait; R2 disperses; R5 executes.

    `tolerance_s` is how late a signal may be, and how far apart those of two replicas.

    Source: paper, section 5.2.
    """

    wait_s: Positive = 1.0
    disperse_s: Positive = 8.0
    execute_s: Positive = 7.0
    tolerance_s: Positive = 1.0

    @property
    def loop_s(self) -> float:
        """Duration of a loop (s)."""
        return 3 * self.wait_s + self.disperse_s + self.execute_s


class InterventionsSection(Section):
    """When a human has to come.

    All batteries are replaced every `batteries_every` generations. A robot that moves less than `stuck_cm` in a trial, and
    does not turn, is stuck. 0 for never.

    Source: paper, section 5.3.
    """

    batteries_every: Annotated[int, Field(ge=0)] = 25
    stuck_cm: Annotated[float, Field(ge=0)] = 0.2


class EvaluationSection(Section):
    """How often each model of the last generation is observed again, to tell which is the best; 0 for not at all."""

    repeats: Annotated[int, Field(ge=0)] = 5


class LaboratorySetup(Section):
    """The laboratory itself. With `emulated`, all of it is: its runs are rehearsals, which never meet the real robots."""

    emulated: bool = False
    robots: tuple[RobotSection, ...]
    camera: CameraSection
    timing: TimingSection = TimingSection()
    interventions: InterventionsSection = InterventionsSection()
    evaluation: EvaluationSection = EvaluationSection()

    @property
    def agents(self) -> tuple[RobotSection, ...]:
        """The agents, in the order of the file."""
        return tuple(robot for robot in self.robots if robot.role == "agent")

    @property
    def replicas(self) -> tuple[RobotSection, ...]:
        """The replicas, in the order of the file."""
        return tuple(robot for robot in self.robots if robot.role == "replica")

    @property
    def labels(self) -> tuple[str, ...]:
        """Markers of all robots, agents first, as a tracker takes them."""
        return tuple(robot.marker for robot in (*self.agents, *self.replicas))

    @model_validator(mode="after")
    def _check_robots(self) -> "LaboratorySetup":
        for role, found in (("agent", self.agents), ("replica", self.replicas)):
            if not found:
                raise ValueError(f"`robots` must have one {role} or more; got none. Add one with role = {role!r}.")
        self._refuse_twice("name", [robot.name for robot in self.robots], "robots")
        self._refuse_twice("address", [str(robot.address) for robot in self.replicas], "replicas")
        for replica in self.replicas:
            others = [robot.name for robot in self.robots if robot.marker == replica.marker and robot != replica]
            if others:
                raise ValueError(
                    f"`marker` must be a replica's alone; got {replica.marker!r} of {replica.name!r} for {others[0]!r} too."
                )
        if self.camera.markers == "aruco":
            worn = [robot.marker for robot in self.robots]
            self._refuse_twice("marker", worn, "robots with ArUco markers")
            both = sorted(self.camera.landmarks.keys() & set(worn))
            if both:
                raise ValueError(f"`camera.landmarks` must not be among the robots' markers; got {both[0]!r} in both.")
        return self

    def _refuse_twice(self, field: str, values: list[str], whose: str) -> None:
        for value in values:
            if values.count(value) > 1:
                raise ValueError(f"`{field}` must be different for all {whose}; got {value!r} twice.")


@dataclass(frozen=True)
class Laboratory:
    """A laboratory and the run that it is to do.

    Attributes
    ----------
    setup
        Robots, camera, timing.
    configuration
        The run; its scenario is that of the laboratory.
    """

    setup: LaboratorySetup
    configuration: Configuration


def load_laboratory(
    path: str | Path, overrides: Mapping[str, Any] | None = None, labels: Mapping[str, str] | None = None
) -> Laboratory:
    """Read a laboratory's file.

    Parameters
    ----------
    path
        A TOML file: `robots`, `camera`, `timing`, `interventions`, `evaluation`, and the sections of any run. What it leaves
        out is as in the paper: 20 models, 100 generations, 5 s observed, an arena of 200 cm x 225 cm.
    overrides
        Dotted key -> value, settings of the run.
    labels
        Dotted key -> where an override comes from, for messages.

    Raises
    ------
    ConfigurationError
        If anything is refused; one message that says what, where, the value and what to do.

    Source
    ------
    Paper, section 5.
    """
    path = Path(path)
    text, document = read_toml(path)
    place = _Place(path, text, document)
    known = (*LaboratorySetup.model_fields, *RUN_SECTIONS)
    for key in document:
        if key not in known:
            raise ConfigurationError(
                f"`{key}` must be a known section; got one{place.where(key)}. {nearest(key, known)}"
            )
    described = {key: value for key, value in document.items() if key not in RUN_SECTIONS}
    setup = _validated(described, place)
    calibration = path.parent / setup.camera.calibration
    camera = setup.camera.model_copy(update={"calibration": str(calibration.absolute())})
    setup = setup.model_copy(update={"camera": camera})
    configuration = _configuration(setup, document, overrides or {}, labels or {}, place)
    _check_together(setup, configuration, place)
    return Laboratory(setup, configuration)


def read_setup(text: str) -> LaboratorySetup:
    """Return a setup from its JSON.

    Raises
    ------
    ConfigurationError
        If it is not one.
    """
    try:
        return LaboratorySetup.model_validate_json(text)
    except ValidationError as error:
        raise ConfigurationError(f"`laboratory.json` must describe a laboratory; {_first(error)[1]}.") from error


@dataclass(frozen=True)
class _Place:
    """A file, for messages."""

    path: Path
    text: str
    document: Mapping[str, Any]

    def where(self, key: str) -> str:
        """Return where a dotted key comes from, in brackets."""
        parts = key.split(".")
        if parts[0] == "robots" and len(parts) > 1:
            robots = self.document.get("robots")
            robot = robots[int(parts[1])] if isinstance(robots, list) else {}
            name = robot.get("name", f"number {int(parts[1]) + 1}") if isinstance(robot, Mapping) else parts[1]
            return f" [robot {name!r}, {self.path}]"
        line = line_of(self.text, key)
        return f" [{self.path}:{line}]" if line else f" [{self.path}]"


def _validated(document: Mapping[str, Any], place: _Place) -> LaboratorySetup:
    try:
        return LaboratorySetup.model_validate_json(json.dumps(document, default=str), strict=True)
    except ValidationError as error:
        key, what = _first(error)
        raise ConfigurationError(f"{what}{place.where(key)}.{_advice(error)}") from error


def _first(error: ValidationError) -> tuple[str, str]:
    """Return the key of the first complaint, and what it says, without an end."""
    first = error.errors(include_url=False)[0]
    key = ".".join(map(str, first["loc"]))
    if first["type"] == "value_error":
        return key, str(first["ctx"]["error"]).rstrip(".")
    if first["type"] == "missing":
        return key, f"`{key}` must be given; got nothing"
    if first["type"] == "extra_forbidden":
        return key, f"`{key}` must be a known setting; got {first['input']!r}"
    return key, f"`{key}` must be {first['msg'].removeprefix('Input should be ')}; got {first['input']!r}"


def _advice(error: ValidationError) -> str:
    """Name the setting that was perhaps meant."""
    first = error.errors(include_url=False)[0]
    if first["type"] != "extra_forbidden":
        return ""
    kind: Any = LaboratorySetup
    for part in first["loc"][:-1]:
        if not isinstance(part, int):
            kind = {"robots": RobotSection}.get(part) or kind.model_fields[part].annotation
    return f" {nearest(str(first['loc'][-1]), kind.model_fields)}" if issubclass(kind, BaseModel) else ""


def _configuration(
    setup: LaboratorySetup,
    document: Mapping[str, Any],
    overrides: Mapping[str, Any],
    labels: Mapping[str, str],
    place: _Place,
) -> Configuration:
    document = dict(document)
    preset = document.get("preset", "default")
    scenario = document.pop("scenario", {})
    table = {"preset": scenario} if isinstance(scenario, str) else scenario
    given = dotted({"scenario": table, **{key: document[key] for key in RUN_SECTIONS[2:] if key in document}})
    told = {key: place.where(key).strip(" []") for key in given} | dict(labels)
    given |= overrides
    for key, source in _DERIVED.items():
        if key in given:
            raise ConfigurationError(
                f"`{key}` must be left out, as it follows from {source}; got {given[key]!r} [{told.get(key, place.path)}]."
            )
    sizes = {"models.population", "models.parents", "models.offspring"}
    base = {key: value for key, value in _BASE.items() if key not in sizes or not sizes & given.keys()}
    derived = {
        "scenario.agents": len(setup.agents),
        "scenario.replicas": len(setup.replicas),
        "scenario.trial.control_interval_s": 1 / setup.camera.fps,
    }
    _refuse_part_of_an_image(setup, (base | given)["scenario.trial.duration_s"], told, place)
    return load_configuration(None, preset, base | derived | given, labels=told)


def _refuse_part_of_an_image(
    setup: LaboratorySetup, duration_s: object, told: Mapping[str, str], place: _Place
) -> None:
    """Refuse a trial that ends between two images of the camera, with the nearest one that does not."""
    key, fps = "scenario.trial.duration_s", setup.camera.fps
    if isinstance(duration_s, bool) or not isinstance(duration_s, int | float) or not 0 < duration_s * fps < math.inf:
        return  # refused as in any run
    images = round(duration_s * fps)
    if images >= 1 and abs(duration_s * fps - images) < 1e-6:
        return
    images = max(1, min(images, math.floor(setup.timing.execute_s * fps)))
    where = f" [{told[key]}]" if key in told else " by default"
    raise ConfigurationError(
        f"`{key}` must be a whole number of images at camera.fps, {fps:g} per second{place.where('camera.fps')}; got {duration_s} s"
        f"{where}. Set {key} = {images / fps:.10g}."
    )


def refuse_without_history(setup: LaboratorySetup, configuration: Configuration, where: str = "") -> None:
    """Raise ConfigurationError if the last models are to be observed again in a run that does not keep them."""
    if setup.evaluation.repeats and configuration.run.history == "thin":
        raise ConfigurationError(
            f'`run.history` must be "full" for a post-evaluation; got "thin"{where}. Or set evaluation.repeats = 0.'
        )


def _check_together(setup: LaboratorySetup, configuration: Configuration, place: _Place) -> None:
    """Refuse what fits each part and not the whole."""
    models = configuration.models.parents + configuration.models.offspring
    if models % len(setup.replicas):
        raise ConfigurationError(
            f"`models` must be a multiple of the {len(setup.replicas)} replicas, which execute them at the same time; got "
            f"{models}{place.where('models')}."
        )
    trial = configuration.scenario.trial.duration_s
    if trial > setup.timing.execute_s:
        raise ConfigurationError(
            f"`scenario.trial.duration_s` must be at most timing.execute_s, {setup.timing.execute_s}; got {trial}"
            f"{place.where('scenario.trial.duration_s')}."
        )
    refuse_without_history(setup, configuration, place.where("run.history"))
    for key, value, needed in (
        ("models.hidden", configuration.models.hidden, 0),
        ("scenario.representation", configuration.scenario.representation, "reactive"),
        ("scenario.grouping", configuration.scenario.grouping, "mixed"),
    ):
        if value != needed:
            raise ConfigurationError(
                f"`{key}` must be {needed!r} for robots: replicas, among agents, take wheel speeds alone; got {value!r}"
                f"{place.where(key)}."
            )
    if len(configuration.scenario.controller) > 16:
        raise ConfigurationError(
            f"`scenario.controller` must have 16 wheel speeds or fewer, which a replica takes; got "
            f"{len(configuration.scenario.controller)}{place.where('scenario.controller')}."
        )
