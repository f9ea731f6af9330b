"""Options that several commands share: each is declared once, and its help is its docstring."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

import turing_learning as tl
from turing_learning.errors import RefusedError, Setting, refuse, refusing_as, require

if TYPE_CHECKING:
    from turing_learning.families import RecordedSystem

MOST_PROBLEMS = 12
"""Lines about what is found in a recording."""
RECORDED = Group("Recorded motion", sort_key=10)


def number_of(number_type: type, token: Any) -> Any:
    """Return the number that a text is."""
    text = token[0].value
    noun = "an integer" if number_type is int else "a number"
    try:
        return number_type(text)
    except ValueError as error:
        raise ValueError(f"must be {noun}; got {text!r}.") from error


Integer = Annotated[int, Parameter(converter=number_of, n_tokens=1)]
Real = Annotated[float, Parameter(converter=number_of, n_tokens=1)]
Files = Annotated[list[Path] | None, Parameter(negative="")]
Columns = Annotated[list[str] | None, Parameter(negative="")]
Settings = Annotated[list[str] | None, Parameter("--set", negative="")]


def option_of(name: str) -> str:
    """Return the option that a run has stored under a name."""
    if name == "scale":
        return "--pixels-per-cm"
    return f"--{name.replace('_', '-')}"


def refuse_beside(rule: str, remedy: str = "", **options: Any) -> None:
    """Reject the first option that is given; those that are not are None."""
    for name, value in options.items():
        if isinstance(value, list | tuple):
            value = " ".join(map(str, value))
        if value is not None:
            refuse(option_of(name), rule, str(value), remedy)


@dataclass(frozen=True)
class OptionGroup:
    """Options of a command; those that are not given are None."""

    @property
    def given(self) -> dict[str, Any]:
        """The options that are there, by their names in Python."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    def refuse_beside(self, rule: str, remedy: str = "", **others: Any) -> None:
        """Reject the first option that is given, of these and of others."""
        refuse_beside(rule, remedy, **self.given | others)


def words_of(options: Mapping[str, Any]) -> list[str]:
    """Return options, by their names in Python, as they are typed; those that are None or False are left out."""
    words = []
    for name, value in options.items():
        if value is None or value is False:
            continue
        option = option_of(name)
        if value is True:
            words.append(option)
            continue
        values = value if isinstance(value, list) else [value]
        for item in values:
            words += [option, f"{item:.12g}" if isinstance(item, float) else str(item)]
    return words


@Parameter(name="*", group=RECORDED)
@dataclass(frozen=True)
class Tracks(OptionGroup):
    """How a file of a tracker is read; the names are those of `load_trajectories`."""

    fps: Real | None = None
    """Frames per second."""
    # runs have stored it as "scale"
    scale: Annotated[Real | None, Parameter(("--pixels-per-cm", "--scale"))] = None
    """Pixels per cm; 1 for a file in cm."""
    y_axis: str | None = None
    """Where y points in a file that does not say so: down, as in images, or up."""
    format: str | None = None
    """Of a file that could be of several, see `turing-learning docs trajectories`."""
    keypoint: str | None = None
    """Point of the body that stands for the animal, in a file with several."""
    column: Columns = None
    """Which column of a table is what, as id=track; several times for several."""
    heading: str | None = None
    """Two points of the body, as nose,tail: headings lead from the second to the first."""
    resample: Real | None = None
    """Frames per second to which uneven times are brought."""
    project: bool | None = None
    """Bring longitude and latitude into a plane."""
    min_confidence: Real | None = None
    """Positions of which the tracker is less sure are missing."""
    every: Annotated[Integer | None, Parameter(name=("--thin", "--every"))] = None
    """Use every K-th frame: of a file that repeats frames, or whose rate is higher than the motion needs."""
    split_gaps: Real | None = None
    """Who is away for longer (s) is another individual after that."""
    bridge: Integer | None = None
    """Fill gaps of up to K frames by straight motion."""
    smooth: Integer | None = None
    """Average positions over K frames, an odd number, before signals are measured; `detect` takes that of the run."""

    def read(
        self, path: Path, name: str, usual: Mapping[str, Any] | None = None
    ) -> "tl.Trajectories":
        """Open a recording; `name` is that of the argument for its file.

        What neither options nor the file state is as `usual`.
        """
        from turing_learning.families import read_recording

        return read_recording(path, name, self.given, usual or {})


@Parameter(name="*")
@dataclass(frozen=True)
class Against(OptionGroup):
    """Simulated recordings, and how they are read where not as the real ones."""

    against: Annotated[list[Path] | None, Parameter(negative="", consume_multiple=True)] = None
    """Simulated recordings, or any others."""
    against_fps: Real | None = None
    """Frames per second of the simulated recordings; by default as stated, or as the real ones."""
    against_pixels_per_cm: Real | None = None
    """Their pixels per cm; the same."""
    against_y_axis: str | None = None
    """Where y points in them; the same."""

    def read(self, real: Tracks) -> "list[tl.Trajectories]":
        """Open the simulated recordings."""
        usual = {}
        for name, value in real.given.items():
            if name in ("fps", "scale", "y_axis"):
                usual[name] = value
        # faster recordings are thinned to the rate of the others, so `every` is for the real ones
        tracks = replace(
            real,
            fps=self.against_fps,
            scale=self.against_pixels_per_cm,
            y_axis=self.against_y_axis,
            every=None,
        )
        return [tracks.read(path, "--against", usual) for path in self.against or []]


@Parameter(name="*", group=RECORDED)
@dataclass(frozen=True)
class Sampling(Tracks):
    """How recordings become samples for learning and for testing, and the models that imitate them."""

    range: Columns = None
    """Range of a parameter of the models, as speed=5:300, also with :log or :integer; several times for several. By default it
    follows from the recording."""
    window: Real | None = None
    """Length of the samples (s); by default 4, or that of the run."""
    signals: str | None = None
    """What the classifiers see, with commas: speed, turn, neighbor_distance, neighbor_bearing. All by default; speed and turn of
    one individual, or where the models take no notice of others."""
    tank: Annotated[list[str] | None, Parameter(negative="")] = None
    """Walls of the models' tank, once or for each recording: as 40x30 (cm), recorded for as far as positions reach, or none. By
    default recorded where signals of neighbors are there, else none."""
    longest_rest: Real | None = None
    """Time at exactly one point (s), 10 by default, from which on that stands for missing positions."""
    hold_out_individuals: str | None = None
    """Individuals, separated by commas, that are for testing alone."""
    hold_out_recordings: str | None = None
    """Numbers, from 1 and separated by commas, of the recordings that are for testing alone."""


@Parameter(name="*", group=RECORDED)
@dataclass(frozen=True)
class Recording(Sampling):
    """Recorded motion and the family of models that imitates it."""

    trajectories: Files = None
    """File of a tracker; several times for several recordings, each with individuals of its own."""
    model: str | None = None
    """Family of models, see `turing-learning docs families`."""
    # of a run that Python began, no option
    cut: Annotated[Mapping[str, Any] | None, Parameter(parse=False)] = None

    def motion(self, *, own: bool = False) -> "RecordedSystem":
        """Return what the options name; reject them where they do not name recordings, and a model unless it is one's `own`."""
        from turing_learning.families import RecordedSystem

        recording = "--trajectories fish.txt --fps 25 --pixels-per-cm 12.3"
        example = f"For example: {recording} --model couzin"
        if not self.trajectories:
            refuse("--trajectories", "be given for recorded motion", "none", example)
        if self.model is None and not own:
            remedy = (example, *self._missing_options())
            refuse("--model", "be given for recorded motion", "none", remedy)
        return RecordedSystem(self.given)

    def _missing_options(self) -> tuple[Any, ...]:
        """Return what to give, too, to read the first recording; nothing if all is there."""
        assert self.trajectories
        try:
            self.read(self.trajectories[0], "--trajectories")
        except RefusedError as error:
            refusal = error.refusal
            if refusal is not None and refusal.rule == "be given":
                remedy = refusal.remedy
                if not isinstance(remedy, tuple):
                    remedy = (remedy,)
                return (". Give ", Setting(refusal.name), ", too. ", *remedy)
        return ()

    def system(self, seed: int) -> dict[str, Any]:
        """Return what `turing_learning.infer` takes, and print what is found in the recordings.

        A network is learned from `seed`.
        """
        motion = self.motion()
        chosen = tl.families.model_named(str(self.model), "--model", own=False)
        windows, family, recordings = motion.opened(progress=tell_learning, seed=seed)
        parameters, unusual_ranges = motion.parameters(family, recordings)
        paths = self.trajectories or []
        names = list(map(titled, paths))
        title = names[0]
        if len(paths) == 1:
            names = [paths[0].name]
        else:
            title += f" and {len(paths) - 1} more"
        for name, recording in zip(names, recordings, strict=True):
            print_problems(name, recording)
        if chosen.social and all(len(recording.individuals) == 1 for recording in recordings):
            neighbors = f"what {self.model} says of neighbors"
            print(f"there is one individual: {neighbors} cannot be inferred")
        for line in unusual_ranges:
            print(line)
        return {
            "genuine": windows,
            "simulate": family,
            "parameters": parameters,
            "name": self.model,
            "title": f"{title}, as {self.model}",
            "provenance": {"recording": motion.entry},
        }

    def remembered(self, run: Path) -> "Recording":
        """Return these options over those that a run began with; reject a recording that is gone or has changed."""
        from turing_learning.families import RecordedSystem

        stored = tl.runs.RunFolder(run).recording()
        if stored is None or "trajectories" not in stored["options"]:
            return self
        remedy = "Give its path with --trajectories."
        elsewhere = bool(self.trajectories)
        system = RecordedSystem.remembered(stored, remedy, elsewhere=elsewhere)
        return Recording(**system.options | self.given)


def print_problems(name: str, recording: "tl.Trajectories") -> None:
    """Print what is found in a recording, by the name of its file."""
    problems = str(recording.problems).splitlines()
    for line in problems[:MOST_PROBLEMS]:
        print(f"{name}: {line}")
    unshown = len(problems) - MOST_PROBLEMS
    if unshown > 0:
        print(f"{name}: and {unshown} more; all by `recording.check()` in Python")


def tell_learning(done: int, steps: int) -> None:
    """Say how far a network has learned, every tenth of the way."""
    tenth = max(steps // 10, 1)
    if done % tenth == 0:
        print(f"learning what the animals do next: {done / steps:.0%}", flush=True)


def named(paths: Sequence[Path]) -> str:
    """Return the name of the first file, and how many more there are."""
    if len(paths) == 1:
        return paths[0].name
    return f"{paths[0].name} and {len(paths) - 1} more"


def titled(path: Path) -> str:
    """Return the name of a file with its folder, since trackers give all files one name."""
    return f"{path.absolute().parent.name}/{path.name}".lstrip("/")


def settings_of(
    settings: list[str] | None, options: Mapping[str, str | None]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return dotted key -> value, and dotted key -> where it was given.

    They come from --set texts and from the options for some keys.
    """
    from turing_learning.config.settings import stated_once

    texts = {key: text for key, text in options.items() if text is not None}
    if {"run.trials", "run.generations"} <= texts.keys():
        got = f"{texts['run.trials']} beside {texts['run.generations']}"
        refuse("--trials", "be given without --generations", got)
    statements = []
    for key, text in texts.items():
        statements.append((key, toml_value(text), f"--{key.removeprefix('run.')} {text}"))
    for setting in settings or []:
        key, equals, text = setting.partition("=")
        key = key.strip()
        if not equals or not key:
            refuse("--set", "be KEY=VALUE", repr(setting), "For example: --set models.parents=20")
        value = toml_value(text)
        statements.append((key, value, f"--set {key}={value}"))
    values = stated_once(statements)
    labels = {}
    for key in values:
        labels[key] = f"--{key.removeprefix('run.')}" if key in texts else f"--set {key}"
    return values, labels


def toml_value(text: str) -> Any:
    """Return the value that a text is in TOML, or else the text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        # Not TOML, or an integer of thousands of digits
        return text


def require_scenario(scenario: str | None, config: Path | None, names: Iterable[str]) -> None:
    """Reject a command line that says nowhere what is to run."""
    if scenario is not None and scenario.endswith(".toml"):
        refuse("SCENARIO", "be the name of a scenario", scenario, "Give a file with --config.")
    if scenario is not None and Path(scenario).is_file():
        remedy = "To infer from a recording, give it with --trajectories."
        refuse("SCENARIO", "be the name of a scenario", scenario, remedy)
    if scenario is None and config is None:
        remedy = f"Choose from: {', '.join(names)}."
        refuse("SCENARIO", "be given, or a file with --config", "neither", remedy)


def watched(scenario: str | None, passive: str) -> "tl.interaction.StimulatedSystem":
    """Return a system with stimuli that classifiers only watch: under those of a word, or of a file."""
    from turing_learning.interaction import PASSIVE, read_stimuli

    systems = tl.interaction.STIMULATED
    rule = "be given for a system with stimuli"
    remedy = f"Choose from: {', '.join(systems)}."
    require(scenario in systems, "--passive", rule, repr(scenario), remedy)
    with refusing_as(RefusedError, name="--passive"):
        system = systems[str(scenario)]
        if passive not in PASSIVE:
            return read_stimuli(Path(passive), system)
        return replace(system, stimulus=replace(system.stimulus, passive=passive))  # type: ignore[arg-type]
