"""What a laboratory consists of, and how it works, as validated, frozen data."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError, model_validator

from turing_learning.config import (
    Configuration,
    ConfigurationError,
    Origins,
    Section,
    dotted,
    load_configuration,
    read_toml,
)
from turing_learning.errors import Refusal, brief, nearest, require
from turing_learning.systems import SystemFailedError

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Count = Annotated[int, Field(ge=0)]
Pixels = Annotated[int, Field(ge=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")]

RUN_SECTIONS = ("preset", "scenario", "models", "classifiers", "coevolution", "run")
"""Sections of a laboratory's file that configure the run, as in the configuration of any run."""

_BASE = {
    "models.parents": 10, "models.offspring": 10, "models.redraw": 0.0, "models.exchange": 0.0,
    "run.generations": 100, "run.checkpoint_every": 1,
    "scenario.arena.width_cm": 200.0, "scenario.arena.height_cm": 225.0,
    "scenario.robot.clamp_wheel_speeds": True, "scenario.trial.duration_s": 5.0,
}  # fmt: skip
"""The paper's setup (sections 5.1 and 5.3), for what the file leaves out; no jumps (decision 0025); each generation is saved."""
_RATES = {"models.adaptation": 1.0, "classifiers.adaptation": 2.0}
"""Of the default preset, in a run by generations: with slower ones more are lost (decision 0070)."""
#: Of a run that nothing is said of: an afternoon with robots (decision 0028)
DEFAULT_TRIALS = 300
_SIZES = {"models.population", "models.parents", "models.offspring"}

_OF_GENERATIONS = ("run.generations", "models", "coevolution")
"""Settings with which a laboratory's run has generations, unless `run.trials` is given."""

_DERIVED = {
    "scenario.agents": "[[robots]]",
    "scenario.replicas": "[[robots]]",
    "scenario.trial.control_interval_s": "camera.fps",
}


class LaboratoryError(SystemFailedError):
    """A session in a laboratory has to end; the run can be resumed."""

    explained = True


class RobotSection(Section):
    """A robot: a replica at an address, or an agent, which the PC starts and halts if it has one, and controls no further."""

    name: Name
    role: Literal["agent", "replica"]
    marker: str
    address: str | None = None

    @model_validator(mode="after")
    def _check_address(self) -> "RobotSection":
        if self.role == "replica":
            remedy = "Name a serial device or socket://host:port."
            require(self.address, "address", "be given for a replica", "nothing", remedy)
        return self


class CameraSection(Section):
    """The camera: its number, a video file or a URL, what it is asked for, its calibration, and what the robots wear.

    Exposure and white balance have the units of the driver; `marker_cm` is a square's side, or a triangle's
    length. `landmarks` (4X4_50) stay on the floor: identity -> x, y (cm). Of another `tracker` than that of a
    camera only `fps` counts.
    """

    source: int | str = 0
    fps: Positive = 10.0
    width: Pixels | None = None
    height: Pixels | None = None
    fourcc: Annotated[str, Field(pattern=r"^[\x20-\x7e]{4}$")] | None = None
    exposure: float | None = None
    white_balance: float | None = None
    calibration: str | None = None
    markers: Literal["triangles", "aruco"] = "triangles"
    dictionary: str = "4X4_50"
    marker_cm: Positive | None = None
    marker_height_cm: Positive = 6.0
    landmarks: dict[str, tuple[float, float]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_landmarks(self) -> "CameraSection":
        for identity in self.landmarks:
            fits = identity.isdecimal() and int(identity) < 50
            rule = "be named by their identities, 0 to 49"
            require(fits, "camera.landmarks", rule, repr(identity))
        return self


class TimingSection(Section):
    """Durations (s) of a replica's states, as in its firmware: R1, R3, R4 wait; R2 disperses; R5 executes."""

    wait_s: Positive = 1.0
    disperse_s: Positive = 8.0
    execute_s: Positive = 7.0
    #: How late a signal may be, and how far apart those of two replicas
    tolerance_s: Positive = 1.0

    @property
    def loop_s(self) -> float:
        """Duration of a loop (s)."""
        return 3 * self.wait_s + self.disperse_s + self.execute_s


class InterventionsSection(Section):
    """When a human has to come (paper, section 5.3); 0 for never."""

    #: Generations, or tens of trials, after which all batteries are replaced
    batteries_every: Count = 25
    #: A robot that moves less in a trial, and does not turn, is stuck
    stuck_cm: NotNegative = 0.2


class EvaluationSection(Section):
    """How often each model of the last generation is observed again, to find the best; 0 for not at all, as in a run of trials."""

    repeats: Count = 5


class LaboratorySetup(Section):
    """The laboratory itself. With `emulated`, its runs are rehearsals, which never meet the real robots.

    `open_replica` and `tracker` are for other robots than e-pucks, and other trackers than that of a camera:
    "module:function", or the name of an entry point. See `runs.start_laboratory`.
    """

    emulated: bool = False
    open_replica: str | None = None
    tracker: str | None = None
    robots: tuple[RobotSection, ...]
    camera: CameraSection = CameraSection()
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
    def linked(self) -> tuple[RobotSection, ...]:
        """Robots with an address, agents first: all replicas, and agents that the PC starts and halts."""
        return tuple(robot for robot in (*self.agents, *self.replicas) if robot.address)

    @property
    def labels(self) -> tuple[str, ...]:
        """Markers of all robots, agents first, in the order of a tracker."""
        return tuple(robot.marker for robot in (*self.agents, *self.replicas))

    @model_validator(mode="after")
    def _check_robots(self) -> "LaboratorySetup":
        for role, robots in (("agent", self.agents), ("replica", self.replicas)):
            rule = f"have one {role} or more"
            require(robots, "robots", rule, "none", f"Add one with role = {role!r}.")
        unique = [("name", "robots"), ("address", "robots")]
        camera = self.camera
        if camera.markers == "aruco":
            unique.append(("marker", "robots with ArUco markers"))
            if camera.dictionary == "4X4_50":
                shared = sorted(camera.landmarks.keys() & set(self.labels))
            else:
                shared = []
            rule = "not be among the robots' markers"
            require(not shared, "camera.landmarks", rule, f"{shared[:1]} in both")
        for name, whose in unique:
            values = [getattr(robot, name) for robot in self.robots]
            for value in filter(None, values):
                rule = f"be different for all {whose}"
                require(values.count(value) == 1, name, rule, f"{value!r} twice")
        calibrated = camera.calibration or self.tracker
        remedy = "Calibrate the camera first."
        require(calibrated, "camera.calibration", "be given", "nothing", remedy)
        for replica in self.replicas:
            for robot in self.robots:
                twin = robot.marker == replica.marker and robot != replica
                got = f"{replica.marker!r} of {replica.name!r} for {robot.name!r} too"
                require(not twin, "marker", "be a replica's alone", got)
        return self


@dataclass(frozen=True)
class Laboratory:
    """A laboratory and the run that takes place in it."""

    setup: LaboratorySetup  #: Robots, camera, timing
    configuration: Configuration  #: The run; its scenario is that of the laboratory


@dataclass(frozen=True)
class _File(Origins):
    document: Mapping[str, Any] = field(default_factory=dict)

    def where(self, key: str) -> str:
        path = key.split(".")
        robots = self.document.get("robots")
        if path[0] == "robots" and len(path) > 1:
            robot = robots[int(path[1])] if isinstance(robots, list) else {}
            if isinstance(robot, Mapping):
                name = robot.get("name", f"number {int(path[1]) + 1}")
            else:
                name = path[1]
            return f"robot {name!r}, {self.path}"
        return super().where(key) or str(self.path)

    def require(self, holds: object, key: str, rule: str, got: object, remedy: str = "") -> None:
        require(holds, key, rule, got, remedy, place=self.where(key), error=ConfigurationError)


def load_laboratory(
    path: str | Path,
    overrides: Mapping[str, Any] | None = None,
    labels: Mapping[str, str] | None = None,
) -> Laboratory:
    """Read a laboratory's file (paper, section 5); a ConfigurationError says what is rejected, where, the value and what to do.

    Parameters
    ----------
    path
        A TOML file: `robots`, `camera`, `timing`, `interventions`, `evaluation`, and the sections of any run.
        What it leaves out is as in the paper: 5 s observed, an arena of 200 cm x 225 cm; and a run of 300
        trials (decision 0028), or of 100 generations of 20 models where it says how generations are: `models`,
        `coevolution`, `run.generations`, preset "paper".
    overrides
        Dotted key -> value, settings of the run.
    labels
        Dotted key -> where an override comes from, for messages.
    """
    path = Path(path)
    text, document = read_toml(path)
    file = _File(path, text, labels or {}, document)
    sections = (*LaboratorySetup.model_fields, *RUN_SECTIONS)
    for key in document:
        file.require(key in sections, key, "be a known section", "one", nearest(key, sections))
    described = {key: value for key, value in document.items() if key not in RUN_SECTIONS}
    setup = read_setup(json.dumps(described, default=str), file.where, strict=True)
    if setup.camera.calibration:
        camera = {"calibration": str((path.parent / setup.camera.calibration).absolute())}
        setup = setup.model_copy(update={"camera": setup.camera.model_copy(update=camera)})
    return Laboratory(setup, _configuration(setup, file, overrides or {}))


def read_setup(
    text: str,
    where: Callable[[str], str] = lambda key: "laboratory.json",
    *,
    strict: bool | None = None,
) -> LaboratorySetup:
    """Return a setup from its JSON; raise ConfigurationError for anything else, with where a setting is."""
    try:
        return LaboratorySetup.model_validate_json(text, strict=strict)
    except ValidationError as error:
        # one complaint at a time: the first one is often the cause of the others
        complaint = error.errors(include_url=False)[0]
        key = ".".join(map(str, complaint["loc"]))
        why = _refusal_of(complaint, key)
        raise ConfigurationError(replace(why, place=where(key))) from error


def _refusal_of(complaint: Any, key: str) -> Refusal:
    """Return what is wrong with a setting, of what pydantic complains of."""
    got = brief(complaint["input"])
    match complaint["type"]:
        case "value_error":
            refused: Refusal = complaint["ctx"]["error"].refusal
            return refused
        case "missing":
            return Refusal(key, "be given", "nothing")
        case "extra_forbidden":
            *sections, name = complaint["loc"]
            return Refusal(key, "be a known setting", got, remedy=_nearest_setting(sections, name))
    return Refusal(key, f"be {complaint['msg'].removeprefix('Input should be ')}", got)


def _nearest_setting(sections: Sequence[str | int], name: str) -> str:
    """Return in words which setting of a section may be meant by a name that none has."""
    section: Any = LaboratorySetup
    for part in sections:
        if part == "robots":
            section = RobotSection
        # a number is a robot's place in their list
        elif not isinstance(part, int):
            section = section.model_fields[part].annotation
    if issubclass(section, BaseModel):
        return nearest(str(name), section.model_fields)
    return ""


def _configuration(
    setup: LaboratorySetup, file: _File, overrides: Mapping[str, Any]
) -> Configuration:
    """Return the run's configuration: the paper's, over it what follows from the setup, over that the file and the overrides."""
    document = dict(file.document)
    scenario = document.pop("scenario", {})
    table = {"preset": scenario} if isinstance(scenario, str) else scenario
    settings = dotted(
        {"scenario": table, **{key: document[key] for key in RUN_SECTIONS[2:] if key in document}}
    )
    if "run.generations" in overrides:
        # the budget of a file gives way
        settings.pop("run.trials", None)
    settings |= overrides
    # Two statements of one fact could contradict each other
    for key, source in _DERIVED.items():
        rule = f"be left out, as it follows from {source}"
        file.require(key not in settings, key, rule, repr(settings.get(key)))
    base = dict(_BASE)
    if _SIZES & settings.keys():
        # they say the same in two ways: defaults must not contradict what is given
        for key in _SIZES:
            base.pop(key, None)
    derived = dict(
        zip(_DERIVED, (len(setup.agents), len(setup.replicas), 1 / setup.camera.fps), strict=True)
    )
    key = "scenario.trial.duration_s"
    fps = setup.camera.fps
    duration_s = settings.get(key, _BASE[key])
    if (
        isinstance(duration_s, int | float)
        and not isinstance(duration_s, bool)
        and 0 < duration_s * fps < math.inf
    ):
        # The nearest duration that is possible, for the remedy
        images = max(1, min(round(duration_s * fps), math.floor(setup.timing.execute_s * fps)))
        fits = (
            round(duration_s * fps) >= 1 and abs(duration_s * fps - round(duration_s * fps)) < 1e-6
        )
        rule = f"be a whole number of images at camera.fps, {fps:g} per second [{file.where('camera.fps')}]"
        got = f"{duration_s} s"
        remedy = f"Set {key} = {images / fps:.10g}."
        if key not in settings:
            require(fits, key, rule, f"{got} by default", remedy, error=ConfigurationError)
        file.require(fits, key, rule, got, remedy)
    preset = document.get("preset", "default")
    # Robots' time is dear: few trials unless settings of generations are given
    if preset == "default" and not any(key.startswith(_OF_GENERATIONS) for key in settings):
        base["run.trials"] = DEFAULT_TRIALS
    # They were measured in runs by generations alone
    if preset == "default" and not (base | settings).get("run.trials"):
        base |= _RATES
    labels = {}
    for setting in settings:
        if setting in file.labels or setting not in overrides:
            labels[setting] = file.where(setting)
    configuration = load_configuration(None, preset, base | derived | settings, labels=labels)
    scenario = configuration.swarm
    models = configuration.models
    of_trials = configuration.run.trials
    refuse_without_history(setup, configuration, file.where("run.history"))
    number = models.parents + models.offspring
    replicas = len(setup.replicas)
    multiple = f"be a multiple of the {replicas} replicas, which execute them at the same time"
    file.require(of_trials or number % replicas == 0, "models", multiple, number)
    # A map of moments needs trials all over the space that is searched
    limits = (models.initial_low, models.initial_high)
    wide = "whose first models have all wheel speeds"
    rule = f"be -1 and 1 with run.trials, {wide}"
    file.require(not of_trials or limits == (-1, 1), "models.initial_low", rule, limits)
    duration_s = scenario.trial.duration_s
    longest = setup.timing.execute_s
    speeds = len(scenario.controller)
    file.require(duration_s <= longest, key, f"be at most timing.execute_s, {longest}", duration_s)
    rule = "have 16 wheel speeds or fewer, which a replica takes"
    file.require(speeds <= 16, "scenario.controller", rule, speeds)
    rule = "be left out, as sensors of robots see what there is in the laboratory"
    file.require(not scenario.items, "scenario.items", rule, ", ".join(scenario.items))
    for name, value, needed in (
        ("models.hidden", models.hidden, 0),
        ("scenario.representation", scenario.representation, "reactive"),
        ("scenario.grouping", scenario.grouping, "mixed"),
    ):
        rule = f"be {needed!r} for robots: replicas, among agents, take wheel speeds alone"
        file.require(value == needed, name, rule, repr(value))
    return configuration


def refuse_without_history(
    setup: LaboratorySetup, configuration: Configuration, place: str = ""
) -> None:
    """Raise ConfigurationError if the last models are to be observed again in a run that does not keep them."""
    run = configuration.run
    fits = not setup.evaluation.repeats or run.history != "thin" or run.trials
    rule = 'be "full" for a post-evaluation'
    remedy = "Or set evaluation.repeats = 0."
    require(fits, "run.history", rule, '"thin"', remedy, place=place, error=ConfigurationError)
