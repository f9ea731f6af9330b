"""Check whether the estimate of a run can be believed, in stages that are kept as they are completed."""

import logging
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np

from turing_learning.analysis import is_known
from turing_learning.config import Configuration, ConfigurationError, load_configuration
from turing_learning.errors import refusing_as, require
from turing_learning.store import RunFolderError, RunStorageError, storage, writable
from turing_learning.swarm import Scenario
from turing_learning.systems import (
    CustomOptions,
    CustomSystem,
    CustomSystemError,
    Genuine,
    Simulator,
    Source,
    System,
    cut_samples,
    same_time_step,
)
from turing_learning.systems import Given as GivenSystem

from ._folder import RunFolder
from ._infer import infer, refuse_unknown, resume
from ._result import Result
from ._run import Run, conduct

if TYPE_CHECKING:
    from turing_learning.identifiability import Check, Effort, Evidence, Recovery
    from turing_learning.trajectories import Trajectories

FOLDER, CHECK = "check", "check/check.json"
COMPARED = 500  # simulated samples whose signals are compared
LEAST_INDIVIDUALS = 5
"""With fewer individuals, those of each are divided by blocks of time, too."""

_LOGGER = logging.getLogger("turing_learning")

Stage = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Given:
    """What a check needs of a custom system, beyond what is stored."""

    data: Genuine
    system: CustomSystem
    simulate: Any
    options: Mapping[str, Any]
    groups: np.ndarray | None
    grouping: str


class Recover(Protocol):
    """Runs what a check recovers, see `turing_learning.runs.infer`."""

    def __call__(self, configuration: Configuration, path: Path | None, system: Mapping[str, Any]) -> Result:
        """Return the result of a run of the configuration, in a folder or in memory."""


@dataclass(frozen=True, eq=False)
class Checker:
    """The stages of a check.

    Parameters
    ----------
    result, configuration
        Of the run.
    source
        Of the run, opened again.
    given
        Of a custom system; None for a scenario.
    effort, seed
        As for `Result.check`.
    recoveries, recovery_generations
        Number and length of the runs whose truth is the estimate.
    recording
        Positions of the recorded group; None leaves neighbor distance and polarization out.
    recover
        Does these runs.
    stage
        Called with a word on what comes next.
    """

    result: Result
    configuration: Configuration
    source: Source
    given: Given | None
    effort: "Effort"
    seed: int
    recoveries: int
    recovery_generations: int
    recording: "Trajectories | None"
    recover: Recover
    stage: Stage

    def run(self, folder: RunFolder | None, *, force: bool) -> "Check":
        """Go through the stages; what a folder holds already is not done again.

        Raises
        ------
        RunFolderError
            If the folder holds a check with other settings, and `force` is not given.
        ConfigurationError
            If the run or the samples do not allow a check.
        """
        from turing_learning.identifiability._check import check_from_json

        path = None if folder is None else folder.path / FOLDER
        known = self._known(path, force=force)
        evidence = self._evidence()  # refuses what cannot be checked, before anything is written
        content = self._begun(path) if known is None else known
        self._test(content, path, evidence)
        self._quantities(content, path, evidence)
        self._profiles(content, path, evidence)
        self._recoveries(content, path, evidence)
        content["parameters"] = self._pinned_down(content, evidence)
        _keep(content, path)
        return check_from_json(content)

    @property
    def _estimate(self) -> np.ndarray:
        return np.array(list(self.result.estimate.values()))

    @property
    def _model(self) -> np.ndarray:
        """The model that is simulated: the estimate, or the weights of the network that comes nearest to it."""
        networks = self.result.networks
        return self._estimate if networks is None else np.array(list(networks["estimate"].values()))

    @property
    def _profiled(self) -> bool:
        """Whether parameters are moved one by one: no weight of a network stands for one of them."""
        return self.effort.points > 0 and self.result.networks is None

    def _settings(self) -> dict[str, Any]:
        groups = None if self.given is None or self.given.groups is None else self.given.groups.tolist()
        return {
            "estimate": self.result.estimate,
            "seed": self.seed,
            "recoveries": self.recoveries,
            "recovery_generations": self.recovery_generations,
            "recording": self.recording is not None,
            "groups": groups,
        } | asdict(self.effort)

    def _known(self, path: Path | None, *, force: bool) -> dict[str, Any] | None:
        """Return what is known already, under these settings; None if all is to be looked at anew."""
        known = None if path is None or force else stored_check(path.parent)
        if known is None or known["settings"] == self._settings():
            return known
        if known["settings"]["estimate"] != self.result.estimate:
            raise RunFolderError(
                f"`run` must have the estimate that it had when its check began; got another, after {self.result.generations} "
                f"generations [{path}]. The run has gone on since: replace the check with force=True."
            )
        raise RunFolderError(
            f"`run` must be checked with the settings that its check began with; got others [{path}]. "
            "Replace it with force=True."
        )

    def _begun(self, path: Path | None) -> dict[str, Any]:
        """Return the beginning of a check, in place of one that may be there."""
        unfinished = None if self.result.complete else [self.result.generations, self.configuration.run.generations]
        new = {"settings": self._settings(), "unfinished": unfinished, "profiles": {}, "recoveries": []}
        if path is None:
            return new
        with kept(path.parent):
            if stored_check(path.parent) is not None:
                import shutil

                shutil.rmtree(path)
            elif (path.parent / CHECK).exists():
                aside = RunFolder(path.parent).set_aside(CHECK)
                _LOGGER.warning(
                    "%s is damaged; the check begins anew. The damaged file is %s.", path / "check.json", aside.name
                )
            path.mkdir(exist_ok=True)
        _keep(new, path)
        return new

    def _evidence(self) -> "Evidence":
        from turing_learning.identifiability import evidence_of

        groups, grouping = (None, "") if self.given is None else (self.given.groups, self.given.grouping)
        return evidence_of(self.configuration, self.source, self.effort, self.seed, groups, grouping)

    def _test(self, content: dict[str, Any], path: Path | None, evidence: "Evidence") -> None:
        from turing_learning.identifiability import two_sample_test

        if "test" not in content:
            self.stage("fresh classifiers against the estimate")
            content["test"] = two_sample_test(evidence, self._model, self.effort, seed=self.seed).to_json()
            _keep(content, path)

    def _quantities(self, content: dict[str, Any], path: Path | None, evidence: "Evidence") -> None:
        if "quantities" not in content:
            self.stage("distributions, genuine beside simulated")
            content["quantities"] = [each.to_json() for each in self._compared(evidence)]
            _keep(content, path)

    def _compared(self, evidence: "Evidence") -> tuple[Any, ...]:
        from turing_learning.identifiability import recorded_quantities, signal_quantities, swarm_quantities
        from turing_learning.trajectories import SIGNALS

        if self.given is None:
            return swarm_quantities(self.configuration, self._model, seed=self.seed)
        names = self.given.system.signals
        count = min(COMPARED, 2 * self.effort.samples)
        found = signal_quantities(evidence, self._estimate, names, SIGNALS, count=count, seed=self.seed)
        if self.recording is None or not hasattr(self.given.simulate, "simulate"):
            return found
        group = recorded_quantities(self.recording, self.given.simulate, self._estimate, seed=self.seed)
        return (*found, *(each for each in group if each.name not in names))

    def _profiles(self, content: dict[str, Any], path: Path | None, evidence: "Evidence") -> None:
        from turing_learning.identifiability import profile

        for place, name in enumerate(self.result.estimate if self._profiled else ()):
            if name not in content["profiles"]:
                self.stage(f"fresh classifiers where {name} is moved")
                try:
                    found = profile(evidence, self._estimate, place, self.effort, seed=self.seed)
                except CustomSystemError as error:
                    raise CustomSystemError(
                        f"{error} Or check without profiles, with points=0 in `effort` and force=True."
                    ) from error
                content["profiles"][name] = found.to_json()
                _keep(content, path)

    def _recoveries(self, content: dict[str, Any], path: Path | None, evidence: "Evidence") -> None:
        for k in range(len(content["recoveries"]), self.recoveries):
            self.stage(f"a run whose truth is the estimate, {k + 1} of {self.recoveries}")
            content["recoveries"].append(self._recovery(k, path, evidence).to_json())
            _keep(content, path)

    def _recovery(self, k: int, path: Path | None, evidence: "Evidence") -> "Recovery":
        from turing_learning.identifiability import Recovery

        seed = self.configuration.run.seed + 1 + k
        overrides = {
            "run.seed": seed,
            "run.generations": self.recovery_generations,
            "run.history": "thin",
        }
        system: dict[str, Any] = {}
        configuration = self.configuration
        scenario: Any
        if self.given is None:
            scenario = _with_agents(configuration.swarm, self._estimate)
        else:
            scenario, system = configuration.scenario, self._known_system(k, evidence)
        found = self.recover(
            _changed(configuration, scenario, overrides), None if path is None else path / f"recovery-{k + 1}", system
        )
        shares = np.abs(self._numbers(evidence, found.estimate) - self._numbers(evidence, self.result.estimate)) / 2
        return Recovery(
            seed=seed,
            generations=found.generations,
            truth=self.result.estimate,
            estimate=found.estimate,
            interval=found.interval,
            error_share=dict(zip(found.estimate, shares.tolist(), strict=True)),
        )

    def _known_system(self, k: int, evidence: "Evidence") -> dict[str, Any]:
        """Return as many samples as the run learned from, simulated at the estimate, in place of the genuine ones."""
        from turing_learning.identifiability._evidence import RECOVERING, stream

        given = self.given
        assert given is not None
        rng, live = stream(self.seed, RECOVERING, k), given.data.live
        system = given.system
        count = len(given.data.learning if live is None else cut_samples(live(rng), system.steps))

        def simulated(rng: np.random.Generator) -> np.ndarray:
            return evidence.simulate(np.tile(self._estimate, (count, 1)), rng)[:, 0]

        options = {
            "name": system.name,
            "title": system.title,
            "signals": system.signals,
            "samples_per_generation": system.samples_per_generation,
            "vectorized": system.vectorized,
            **({"batches": system.batches} if system.vectorized else {}),
            **({} if system.live else {"held_out": 0.0}),
        }
        return {
            "genuine": simulated(rng) if live is None else simulated,
            "simulate": given.simulate,
            "parameters": system.parameters,
            **options,
            **given.options,
        }

    def _pinned_down(self, content: dict[str, Any], evidence: "Evidence") -> list[dict[str, Any]]:
        from turing_learning.identifiability import PinnedDown
        from turing_learning.identifiability._profile import Profile

        interval = self.result.interval
        ends = [self._numbers(evidence, {name: each[side] for name, each in interval.items()}) for side in (0, 1)]
        widths = np.minimum(np.abs(ends[1] - ends[0]) / 2, 1.0)
        errors = [each["error_share"] for each in content["recoveries"]]
        return [
            asdict(
                PinnedDown(
                    parameter=name,
                    interval_share=float(width) if is_known(width) else None,
                    open_share=Profile(**content["profiles"][name]).open_share if self._profiled else None,
                    recovery_error=max(each[name] for each in errors) if errors else None,
                )
            )
            for name, width in zip(self.result.estimate, widths, strict=True)
        ]

    def _numbers(self, evidence: "Evidence", values: Mapping[str, float]) -> np.ndarray:
        """Return values as numbers from -1 to 1 over the initial ranges."""
        return np.array(
            [float(evidence.parameters[name].to_numbers(np.array(value))) for name, value in values.items()]
        )


def _with_agents(scenario: Scenario, parameters: np.ndarray) -> Scenario:
    """Return a scenario whose agents have these parameters (P,)."""
    robot = scenario.model.behavior(parameters)
    view = scenario.sensor.field_of_view if robot.field_of_view is None else float(robot.field_of_view)
    controller = tuple(robot.wheel_speeds.tolist())
    return replace(scenario, controller=controller, sensor=replace(scenario.sensor, field_of_view=view), known=True)


def stored_check(path: Path) -> dict[str, Any] | None:
    """Return what is known of the check of a run folder, complete or not; None if it was never begun."""
    try:
        content = RunFolder(path).read(CHECK)
    except RunFolderError:
        return None
    return content if isinstance(content, dict) and "settings" in content else None


def complete_check(path: Path | None) -> "Check | None":
    """Return the check of a run folder if it is complete."""
    content = None if path is None else stored_check(path)
    if content is None or "parameters" not in content:
        return None
    from turing_learning.identifiability._check import check_from_json

    return check_from_json(content)


def held_out_groups(genuine: Any, data: Genuine, groups: Any) -> tuple[np.ndarray | None, str]:
    """Return which held-out samples belong together, and what such a group is.

    Parameters
    ----------
    genuine
        As it was given; windows of recorded motion know of which individual they are.
    data
        The same, split.
    groups : (K,)
        Labels of all samples, of any kind; None takes those of the windows, if there are some.

    Raises
    ------
    ConfigurationError
        If there is not one label for each sample.
    """
    if groups is not None:
        labels = np.asarray(groups)
        if labels.shape != (len(data.samples),):
            raise ConfigurationError(
                f"`groups` must be one label for each of the {len(data.samples)} samples; got shape {labels.shape}."
            )
        return np.unique(labels[data.held_out], return_inverse=True)[1], "groups"
    index = getattr(genuine, "held_out_index", None)
    if index is None or not len(index):
        return None, "samples"
    individuals = index[:, 0]
    apart = not np.isin(individuals, genuine.learning_index[:, 0]).any()
    if apart or len(np.unique(individuals)) >= LEAST_INDIVIDUALS:
        return individuals, "individuals"
    blocks = np.searchsorted([begin for begin, _, _ in genuine.blocks], index[:, 1], side="right")
    pairs = np.stack((individuals, blocks), axis=1)
    return np.unique(pairs, axis=0, return_inverse=True)[1].ravel(), "individuals in blocks of time"


def require_numbers(*, recoveries: int, recovery_generations: int, seed: int) -> None:
    """Raise ConfigurationError if a number is too small."""
    least = {"recoveries": (recoveries, 0), "recovery_generations": (recovery_generations, 1), "seed": (seed, 0)}
    for name, (value, lowest) in least.items():
        if type(value) is not int or value < lowest:
            raise ConfigurationError(f"`{name}` must be an integer of at least {lowest}; got {value!r}.")


def _keep(content: dict[str, Any], path: Path | None) -> None:
    if path is not None:
        with kept(path.parent):
            RunFolder(path.parent).write(CHECK, content)


def kept(path: Path) -> AbstractContextManager[None]:
    """Say of a run folder that cannot be written any further how to go on with its check."""
    return storage(path, "check again: it goes on.", name="run")


def _changed(configuration: Configuration, scenario: Any, overrides: Mapping[str, Any]) -> Configuration:
    """Return a configuration with another scenario and other settings."""
    sections = configuration.model_dump()
    flat = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
    kept = {key: value for key, value in flat.items() if not key.startswith("scenario.")}
    return load_configuration(None, "default", kept | dict(overrides), scenario=scenario)


def check_run(
    result: Result,
    configuration: Configuration,
    *,
    genuine: Any = None,
    simulate: Simulator | None = None,
    recording: "Trajectories | None" = None,
    groups: Any = None,
    effort: "Effort | None" = None,
    recoveries: int = 1,
    recovery_generations: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    timeout_s: float | None = None,
    force: bool = False,
    stage: Stage | None = None,
) -> "Check":
    """Check whether the estimate of a run can be believed; call it as `Result.check`.

    Parameters
    ----------
    result, configuration
        Of the run.
    genuine, simulate
        Of a custom system, as when the run began; needed where the run was loaded from a folder.
    recording
        The recording that the samples are from, to compare distances of neighbors and polarization, too. The simulator has
        to say where everybody was, as model families do.
    groups : (K,)
        Labels of the samples, of any kind; those with the same one are alike, for example of one individual. None takes the
        individuals of windows of recorded motion, and each sample for itself otherwise.
    effort
        How much is simulated and trained.
    recoveries, recovery_generations
        Number of runs whose truth is the estimate, 0 for none, and their length; None takes that of the run.
    seed
        Of all random numbers of the check, >= 0.
    workers, timeout_s
        As in `infer`.
    force
        Whether to look anew, and to replace the check that is there, whatever its settings.
    stage
        Called with a word on what comes next.

    Returns
    -------
    Check
        Of a run in a folder it is also in ``check/check.json``, in figures, and in the report.

    Raises
    ------
    ConfigurationError
        If a setting is refused, or the run does not allow a check.
    RunFolderError
        If the folder is in use or holds a check with other settings, or the samples are not those of the run.
    CustomSystemError
        If the simulator fails for most of the samples.
    """
    from turing_learning.identifiability import Effort

    length = result.generations if recovery_generations is None else recovery_generations
    require_numbers(recoveries=recoveries, recovery_generations=length, seed=seed)
    if not isinstance(effort, Effort | None):
        raise ConfigurationError(
            f"`effort` must be an Effort; got {type(effort).__name__}. For example "
            "turing_learning.identifiability.Effort(samples=100)."
        )
    _refuse_laboratory(result)
    trials, rule = configuration.run.trials, "be one of generations, to be checked"
    require(trials == 0, "run", rule, f"one of {trials} trials", error=ConfigurationError)
    folder = None if result.path is None else RunFolder(result.path)
    options: CustomOptions = {}
    if workers is not None:
        options["workers"] = workers
    if timeout_s is not None:
        options["timeout_s"] = timeout_s
    with ExitStack() as stack:
        if folder is not None:
            with writable("run", folder.path):
                stack.enter_context(folder.locked())
        source, given = _given(configuration, genuine, simulate, groups, options)
        stack.enter_context(source)
        if given is not None:
            _refuse_other_rate(recording, given.system)
        elif recording is not None:
            raise ConfigurationError("`recording` must be left out for simulated robots; got one.")
        found = Checker(
            result=result,
            configuration=configuration,
            source=source,
            given=given,
            effort=effort or Effort(),
            seed=seed,
            recoveries=recoveries,
            recovery_generations=length,
            recording=recording,
            recover=partial(_recover, options=options),
            stage=stage or _say_nothing,
        ).run(folder, force=force)
        if folder is not None:
            _draw(result, configuration, found, folder, stage or _say_nothing)
    return found


def refuse_unknown_part(options: Mapping[str, Any]) -> None:
    """Raise ConfigurationError if there is an option that no check has."""
    from turing_learning.identifiability import Effort

    for each in fields(Effort):
        if each.name in options:
            raise ConfigurationError(
                f"`{each.name}` must be a part of the effort; got {options[each.name]!r} beside it. Give "
                f"effort=turing_learning.identifiability.Effort({each.name}={options[each.name]!r})."
            )
    refuse_unknown(options, list(signature(check_run).parameters)[2:])


def _say_nothing(stage: str) -> None:
    pass


def _refuse_other_rate(recording: "Trajectories | None", system: System) -> None:
    """Raise ConfigurationError if a recording has another frame rate than the samples, which are from it."""
    if recording is not None and system.interval_s > 0 and not same_time_step(system.interval_s, 1 / recording.fps):
        raise ConfigurationError(
            f"`recording` must have the frame rate of the samples, {1 / system.interval_s:.6g} per second; got "
            f"{recording.fps:.6g}. Give the recording that the samples are from."
        )


def _refuse_laboratory(result: Result) -> None:
    """Raise ConfigurationError for robots that nobody can simulate: a check would compare two simulations."""
    if result.in_laboratory:
        raise ConfigurationError(
            f"`run` must be of a system that can be simulated; got one in a laboratory [{result.path}]. What its models are worth "
            "there is in post_evaluation.json; `turing_learning.runs.simulate_laboratory` says what its setup could infer at all."
        )


def _given(
    configuration: Configuration, genuine: Any, simulate: Any, groups: Any, options: CustomOptions
) -> tuple[Source, Given | None]:
    given = GivenSystem(genuine, simulate, options.get("workers"), options.get("timeout_s"), groups)
    with refusing_as(ConfigurationError):
        source = configuration.system.open(given)
    if source.genuine is None:
        return source, None
    labels, grouping = held_out_groups(genuine, source.genuine, groups)
    system = cast(CustomSystem, configuration.scenario)
    return source, Given(source.genuine, system, simulate, options, labels, grouping)


def _recover(
    configuration: Configuration, path: Path | None, system: Mapping[str, Any], options: CustomOptions
) -> Result:
    try:
        if path is not None and RunFolder(path).is_run():
            return resume(
                path,
                genuine=system.get("genuine"),
                simulate=system.get("simulate"),
                workers=options.get("workers"),
                timeout_s=options.get("timeout_s"),
            )
        if system:
            return infer(config=configuration, out=path, **system)
        return conduct(Run.begin(configuration, path))
    except (RunFolderError, RunStorageError) as error:
        if path is None or not isinstance(error.__cause__, OSError):
            raise
        with kept(path.parent.parent):  # goes on as a check, not as a run of its own
            raise error.__cause__ from None


def _draw(result: Result, configuration: Configuration, found: "Check", folder: RunFolder, stage: Stage) -> None:
    """Write the figures of a check, and the report of the run again where there is one and the history that it shows."""
    from ._present import draw_check, save_figures

    drawings = draw_check(found, result, configuration)
    with kept(folder.path):
        save_figures(drawings, folder.figures_path)
        if folder.report_path.exists():
            try:
                result.report()
            except RunFolderError as error:
                stage(f"the report is left as it was: {error}")
