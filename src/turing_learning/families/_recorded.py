"""Groups as they were recorded, and recordings with the family that imitates them, by the options that a stored run remembers."""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path
from typing import Any, Self

import numpy as np

from turing_learning._files import digest_of, file_digest
from turing_learning.errors import RefusedError, Setting, nearest, refuse, refusing_as, require
from turing_learning.trajectories import LONGEST_REST_S

from ..models import Parameter
from ..systems import importable_name, imported
from ..trajectories import SIGNALS, Trajectories, Windows, pooled_windows
from ._composed import PARTS, Composed, check_parts, parts_of
from ._family import NEIGHBOR, BeginsAsRecorded, Family, Particles, most_moves
from ._kinds import FAMILIES
from ._network import Network
from ._ranges import recorded_ranges, said_ranges
from ._reading import listed, read_recording
from ._starts import joined_starts, recorded_starts

WINDOW_S = 4.0
GROUPS_BEGIN = "groups_begin"
"""In what a stored run remembers of its recordings: how groups of models begin."""
AS_RECORDED = "as recorded"
MODELS: Mapping[str, type[Family]] = {**FAMILIES, "network": Network}
"""All that may imitate a recording, by name: families of equations, and a network that learns."""


@dataclass(frozen=True)
class Replicates:
    """A simulator of one family for several recordings: each model is executed by one of the groups, by chance."""

    #: Families that differ in individuals and tank alone
    groups: tuple[Family, ...]
    shares: tuple[float, ...]  #: How often each group is drawn; they sum to 1

    #: The P parameters with suggested ranges
    parameters = property(lambda self: self.groups[0].parameters)
    #: The D signals of a step
    signals = property(lambda self: self.groups[0].signals)
    steps = property(lambda self: self.groups[0].steps)  #: Time steps T of a sample
    #: Duration of a step (s)
    interval_s = property(lambda self: self.groups[0].interval_s)
    #: Whether individuals have headings
    headings = property(lambda self: self.groups[0].headings)
    #: Whether samples cost little
    cheap = property(lambda self: self.groups[0].cheap)

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return positions (M, F, A, 2) in the first group."""
        return self.groups[0].simulate(parameters, rng)

    def __call__(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Simulate models (M, P) and return samples (M, C, T, D) of them, each in a group of its own."""
        which = rng.choice(len(self.groups), size=len(parameters), p=self.shares)
        leader = self.groups[0]
        samples = np.empty((len(parameters), leader.observed, leader.steps, len(leader.signals)))
        for k, group in enumerate(self.groups):
            if (which == k).any():
                samples[which == k] = group(parameters[which == k], rng)
        return samples


def as_recorded(
    family: type[Family], recordings: Trajectories | Sequence[Trajectories], windows: Windows, *,
    tanks: Sequence[tuple[float, float] | None] = (), **settings: Any,
) -> Family | Replicates:  # fmt: skip
    """Return a simulator of groups as large as those that windows are learned from, with their steps, rate and signals.

    Groups begin as one was recorded at some moment of the learning part, and move for at least as long as a window before
    they are observed. They begin scattered where as many were never there at once, in a periodic square, and among walls or objects
    of a scenario, whose places no recording says.

    Parameters
    ----------
    family
        Whose models are simulated.
    recordings, windows
        What was recorded, once or several times, and the windows of all of it.
    tanks
        Width and height of the tank (cm) of each recording, or one for all; None, or none, for the unbounded
        plane.
    **settings
        Others of the family.

    Returns
    -------
    Family or Replicates
        `Replicates` where recordings differ in the number of individuals or the tank; they are drawn as often
        as windows are from them.
    """
    if isinstance(recordings, Trajectories):
        recordings = [recordings]
    rule = "be in cm, as the models are"
    remedy = "Give their scale, pixels_per_cm."
    for recording in recordings:
        require(recording.unit == "cm", "recordings", rule, "pixels", remedy)
    shapes = list(tanks)
    if len(shapes) == 1:
        shapes *= len(recordings)
    fits = len(shapes) in (0, len(recordings))
    require(fits, "tanks", f"be one, or one for each of {len(recordings)} recordings", len(tanks))
    walls = any(tank is not None for tank in shapes)
    rule = "be left out for this family, whose walls are those of its scenario"
    require(not walls or issubclass(family, Particles), "tanks", rule, family.__name__)
    # A periodic square has neither walls nor neighbors that are seen across its border.
    if hasattr(family, "period_cm") and (walls or NEIGHBOR & set(windows.names)):
        settings = {"period_cm": None} | settings
    conditions = []
    for recording, tank in zip(recordings, shapes or repeat(None), strict=False):
        conditions.append((recording.at_once, tank))
    # Nothing is learned from a recording that is held out: its condition counts 0 windows.
    windows_of = Counter(conditions[k] for k in windows.learning_recording)
    steps = windows.learning.shape[1]
    learned = [np.asarray(mask.any(axis=1)) for mask in windows.frames("learning")]
    groups = []
    shares = []
    for individuals, tank in dict.fromkeys(conditions):
        count = windows_of[individuals, tank]
        if not count:
            continue
        group_settings: dict[str, Any] = {}
        if "starts" not in settings and issubclass(family, BeginsAsRecorded):
            alike = [
                (recording, frames)
                for recording, frames, condition in zip(
                    recordings, learned, conditions, strict=True
                )
                if condition == (individuals, tank)
            ]
            group_settings = _beginning(family, alike, individuals, tank, steps, settings)
        group_settings |= settings
        if tank is not None:
            group_settings["tank_cm"] = tank
        group = family(
            individuals=individuals,
            steps=steps,
            interval_s=windows.interval_s,
            signals=windows.names,
            **group_settings,
        )
        groups.append(group)
        shares.append(count / windows_of.total())
    if len(groups) == 1:
        return groups[0]
    return Replicates(tuple(groups), tuple(shares))


def _beginning(
    family: type[BeginsAsRecorded], recorded: Sequence[tuple[Trajectories, np.ndarray]], individuals: int,
    tank: tuple[float, float] | None, steps: int, settings: Mapping[str, Any],
) -> dict[str, Any]:  # fmt: skip
    """Return the settings with which groups begin as recorded ones did, at frames (F,) that may be learned from."""
    if not family.can_begin_as_recorded(**settings):
        return {}
    starts = []
    for recording, learned in recorded:
        starts.append(
            recorded_starts(recording, learned, individuals, tank, headings=family.headings)
        )
    begun = joined_starts(starts)
    if begun is None:
        return {}
    room = most_moves(individuals, social=family.social) - steps - 1
    settling_steps = max(0, min(max(steps, family.settling_steps), room))
    return {"starts": begun, "settling_steps": settling_steps}


def is_model(name: str) -> bool:
    """Return whether a family has this name, or is put together from the parts that it names, as kicks+walls."""
    return name in MODELS or not set(parts_of(name)).isdisjoint(PARTS)


def model_named(name: str, argument: str = "model", *, own: bool = True) -> Any:
    """Return a family of models by its name, or what "module:name" names: a family, or a simulator as `infer` takes it.

    An unknown name is refused, in a message on an `argument`; without `own` any "module:name" is, too.
    """
    rule = f"be one of {', '.join(MODELS)}, or parts as kicks+walls"
    remedy = nearest(name, (*MODELS, *PARTS))
    if ":" in name:
        if own:
            return imported(name, argument)
        remedy = (
            'A simulator of your own goes with tl.infer(genuine=windows, simulate="module:name")'
        )
        remedy += " in Python, a program with --simulate-command."
    elif own:
        rule += ", or module:name"
    require(is_model(name), argument, rule, repr(name), remedy)
    if name in MODELS:
        return MODELS[name]
    check_parts(parts_of(name), argument)
    return Composed


@dataclass(frozen=True)
class RecordedSystem:
    """Recordings, how they are cut into samples, and the family of models that imitates them.

    `options` are those of commands that are given, by their names in Python: `trajectories`, a list of paths,
    and `model` at least. Of a run that Python began also `cut`, see `Windows`, and those may be missing that
    commands cannot say.
    """

    options: dict[str, Any]
    #: Whether groups of models begin scattered, as they did before decision 0059: a run goes on as it began
    scattered: bool = False

    @classmethod
    def begun_in_python(cls, windows: Windows, simulate: Any) -> Self | None:
        """Return what commands need to know of windows and of what imitates them, as far as they can.

        None where the windows do not say what they were cut from. Without `trajectories` where the recordings were
        in no files, or where their files, read again, do not give the same windows; without `model` where they do
        not lead to the same simulator.
        """
        readings = [recording.reading for recording in windows.sources]
        if not readings:
            return None
        shared = readings[0].options.items()
        options = {}
        for name, value in shared:
            if all(reading.options.get(name) == value for reading in readings):
                options[name] = value
        alike = all(reading.options == options for reading in readings)
        if not (alike and windows.cut and all(reading.path for reading in readings)):
            return cls(options) if options else None
        in_files = {
            "trajectories": [Path(reading.path) for reading in readings],
            "cut": {**windows.cut, "headings": windows.headings},
        }
        if windows.cut["longest_rest_s"] is not None:
            in_files["longest_rest"] = windows.cut["longest_rest_s"]
        system = cls(options | in_files)
        if not system._leads_to(windows):
            return cls(options) if options else None
        family = _family_options(simulate, windows.sources)
        for scattered in (False, True):
            imitated = cls(options | in_files | family, scattered)
            if family and imitated._makes(simulate, windows.sources):
                return imitated
        return system

    def _leads_to(self, windows: Windows) -> bool:
        """Say whether the files, read again, give the same windows.

        What was done to a recording in Python, such as a choice of individuals, is not always among its options.
        """
        try:
            again, _, _ = self.opened()
        except (RefusedError, OSError):
            return False
        same = np.array_equal(again.learning, windows.learning)
        return same and np.array_equal(again.held_out, windows.held_out)

    def _makes(self, simulate: Any, recordings: Sequence[Trajectories]) -> bool:
        """Say whether the family that is named, fitted to recordings, is the same simulator."""
        network = simulate if isinstance(simulate, Network) else None
        try:
            _, family, _ = self.opened(recordings=recordings, network=network)
            return bool(family == simulate)
        except Exception:  # families are the user's code
            return False

    @classmethod
    def remembered(
        cls, stored: Mapping[str, Any], remedy: Any = "", *, elsewhere: bool = False
    ) -> Self:
        """Return what `entry` wrote; reject a recording that is gone or has changed, unless it is `elsewhere` now."""
        rule = "be on recordings in files"
        paths = [Path(path) for path in stored["options"].get("trajectories", ())]
        require(paths, "run", rule, "one on others", "Give `genuine` and `simulate`.")
        options = stored["options"] | {"trajectories": paths}
        scattered = stored.get(GROUPS_BEGIN) != AS_RECORDED
        if elsewhere:
            return cls(options, scattered)
        rule = "be the recording that the run began with"
        for path, digest in zip(paths, stored["sha256"], strict=True):
            digest_now = _digest(path)
            change = "has changed since" if digest_now else "is not there any more"
            got = f"{path}, which {change}"
            require(digest_now == digest, "trajectories", rule, got, remedy)
        return cls(options, scattered)

    @property
    def entry(self) -> dict[str, Any]:
        """What a stored run remembers: the options that are given, and digests of the files."""
        options = dict(self.options)
        paths = options.get("trajectories", ())
        if paths:
            options["trajectories"] = [str(path.absolute()) for path in paths]
        entry = {"options": options, "sha256": [_digest(path) for path in paths]}
        if not self.scattered:
            entry[GROUPS_BEGIN] = AS_RECORDED
        return entry

    def same_motion(self, stored: Mapping[str, Any] | None) -> bool:
        """Return whether `entry` wrote the same content and options, wherever the files were."""
        if stored is None:
            return False
        entry = self.entry
        options = dict.fromkeys(("trajectories", "range"))
        same_options = entry["options"] | options == stored["options"] | options
        return bool(same_options and entry["sha256"] == stored["sha256"])

    def parameters(
        self, family: Family | Replicates, recordings: Sequence[Trajectories]
    ) -> tuple[dict[str, Parameter], list[str]]:
        """Return the parameters of the models, with ranges as said or else as recorded, and in words which are unusual."""
        longest_rest_s = self.options.get("longest_rest", LONGEST_REST_S)
        likely = [recording.cleared(longest_rest_s=longest_rest_s) for recording in recordings]
        recorded = recorded_ranges(family, likely)
        texts = self.options.get("range") or ()
        ranges = said_ranges(texts, recorded)
        named = {text.partition("=")[0] for text in texts}
        lines = []
        for name, parameter in ranges.items():
            usual = family.parameters[name]
            if parameter != usual and name not in named:
                bounds = f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
                usually = f"usually {usual.low:g} to {usual.high:g}"
                lines.append(f"range of {name} by the recording: {bounds} ({usually})")
        return ranges, lines

    def opened(
        self,
        steps: int | None = None,
        signals: Sequence[str] | None = None,
        *,
        recordings: Sequence[Trajectories] | None = None,
        network: Network | None = None,
        progress: Callable[[int, int], None] | None = None,
        seed: int = 1,
    ) -> tuple[Windows, Any, tuple[Trajectories, ...]]:
        """Open the recordings, unless they are given, cut them into windows, and fit the family of models to them.

        Without `model` there is no family, but None. Windows have `steps` and `signals` by default. Headings are not
        measured if the individuals of the family have none. A network is learned, with `progress` and from `seed`,
        unless it is given.
        """
        option = self.options.get
        paths = self.options["trajectories"]
        cut = dict(option("cut") or {})
        chosen: Any = None
        if "model" in self.options:
            chosen = model_named(self.options["model"])
        names = listed(option("signals"), "signals", "names")
        apart = listed(option("hold_out_individuals"), "hold_out_individuals", "names")
        numbers = listed(option("hold_out_recordings"), "hold_out_recordings", "numbers")
        count = len(paths)
        fits = set(numbers) < set(map(str, range(1, count + 1)))
        rule = f"be numbers of some of the {count} recordings, from 1, but not of all"
        require(fits, "hold_out_recordings", rule, repr(option("hold_out_recordings")))
        if recordings is None:
            recordings = [read_recording(path, "trajectories", self.options) for path in paths]
        motion = tuple(recordings)
        # Models that have no headings are measured by displacements, and so is the recording then.
        if not cut.pop("headings", getattr(chosen, "headings", False)):
            motion = tuple(replace(recording, headings=None) for recording in motion)
        length_s = None
        if steps is None or "window" in self.options:
            steps = None
            length_s = option("window", WINDOW_S)
        signals = names or signals or cut.get("signals")
        if not signals:
            # signals of neighbors say most of groups whose models take notice of each other
            lonely = any(len(recording.individuals) == 1 for recording in motion)
            social = getattr(chosen, "social", True) and not lonely
            signals = tuple(SIGNALS) if social else ("speed", "turn")
        rest_s = option("longest_rest", LONGEST_REST_S)
        said: dict[str, dict[str, Any]] = {
            "window": {"steps": None, "length_s": length_s},
            "smooth": {"smooth_frames": option("smooth", 1)},
            "longest_rest": {"longest_rest_s": rest_s},
            "hold_out_individuals": {"hold_out_individuals": apart},
            "hold_out_recordings": {"hold_out_recordings": [int(number) - 1 for number in numbers]},
        }
        is_cut_in_python = bool(cut)
        for name, arguments in said.items():
            # What is said now counts more than how a run in Python cut its windows.
            if name in self.options or not is_cut_in_python:
                cut |= arguments
        if steps is not None:
            cut["steps"] = steps
        cut["signals"] = signals
        with refusing_as(RefusedError):
            windows = pooled_windows(motion, **cut)
            likely = [recording.cleared(longest_rest_s=rest_s) for recording in motion]
            # a function of the user's says itself what a sample is
            model = chosen
            if isinstance(chosen, type) and issubclass(chosen, Network):
                model = network
                if network is None:
                    tanks = option("tank") or ["recorded"]
                    model = _learned(likely, windows, tanks, progress, seed)
            elif isinstance(chosen, type) and issubclass(chosen, Family):
                model = self._fitted(chosen, likely, windows)
        return windows, model, motion

    def _fitted(
        self, family: type[Family], recordings: Sequence[Trajectories], windows: Windows
    ) -> Any:
        """Return a family of models, with groups and tanks as in recordings and windows of them."""
        settings = family.settings_of(self.options["model"])
        if self.scattered and issubclass(family, BeginsAsRecorded):
            settings["starts"] = None
        tanks = self.options.get("tank") or []
        # without walls a group would spread, and neighbors be farther away than in the tank
        confined = NEIGHBOR & set(windows.names) or family.needs_tank(**settings)
        if not tanks and issubclass(family, Particles) and confined:
            tanks = ["recorded"]
        count = len(recordings)
        if tanks in (["recorded"], ["none"]):
            tanks = tanks * count
        # `as_recorded` refuses more tanks than there are recordings
        sides = [_tank(text, recordings[min(k, count - 1)]) for k, text in enumerate(tanks)]
        return as_recorded(family, recordings, windows, tanks=sides, **settings)


def _family_options(simulate: Any, recordings: Sequence[Trajectories]) -> dict[str, Any]:
    """Return `model` and `tank` by which `RecordedSystem` may make a simulator again; nothing for others."""
    groups = getattr(simulate, "groups", (simulate,))
    family = type(groups[0])
    name = importable_name(family)
    for model, builtin in MODELS.items():
        if builtin is family:
            name = model
    # who is put together from parts names them
    name = getattr(groups[0], "name", name)
    if name is None or not issubclass(family, Family):
        return {}
    if not issubclass(family, Particles):
        return {"model": name}
    tanks = []
    for recording in recordings:
        tank = "none"
        for group in groups:
            if group.individuals == recording.at_once and group.tank_cm is not None:
                width, height = group.tank_cm
                tank = f"{width!r}x{height!r}"
        tanks.append(tank)
    return {"model": name, "tank": tanks}


def _learned(
    recordings: Sequence[Trajectories],
    windows: Windows,
    tanks: Sequence[str],
    progress: Callable[[int, int], None] | None,
    seed: int,
) -> Network:
    """Learn a network from recordings, in tanks as they are asked for."""
    walls = [text if text == "recorded" else _tank(text, recordings[0]) for text in tanks]
    return Network.learned(recordings, windows, tanks=walls, seed=seed, progress=progress)


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file, or of all files in a folder; nothing where there is none."""
    try:
        if not path.is_dir():
            return file_digest(path)
        files = [file for file in sorted(path.rglob("*")) if file.is_file()]
        return digest_of("".join(map(file_digest, files)).encode())
    except OSError:
        return ""


def _tank(text: str, recording: Trajectories) -> tuple[float, float] | None:
    """Return width and height of a tank (cm), those of the places where individuals have been if that is asked for."""
    if text == "none":
        return None
    if text == "recorded":
        low, high = recording.reach
        width, height = (high - low).tolist()
        return width, height
    return tank_sides(text, "be width x height in cm, recorded, or none")


def tank_sides(text: str, rule: str = "be width x height in cm") -> tuple[float, float]:
    """Return width and height (cm) of a tank that is given as 100x60.

    Raises
    ------
    RefusedError
        If it is not two numbers.
    """
    sides = re.fullmatch(r"([0-9.]+)x([0-9.]+)", text)
    try:
        return float(sides[1]), float(sides[2])  # type: ignore[index]
    except (TypeError, ValueError):
        remedy = ("For example: ", Setting("tank", "40x30"))
        refuse("tank", rule, repr(text), remedy)
