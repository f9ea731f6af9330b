"""Check whether the estimate of a run can be believed, in stages that are kept as they are completed."""

import json
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from turing_learning.analysis import is_known
from turing_learning.config import Configuration, ConfigurationError, load_configuration
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomSystem, CustomSystemError, Genuine, Source, cut_samples

from .folder._errors import RunFolderError, storage
from .folder._files import write_json
from .folder._folder import RunFolder
from .results._result import Result

if TYPE_CHECKING:
    from turing_learning.identifiability import Check, Effort, Evidence, Recovery
    from turing_learning.trajectories import Trajectories

FOLDER = "check"
COMPARED = 500  # simulated samples whose signals are compared
LEAST_INDIVIDUALS = 5
"""With fewer individuals, those of each are divided by blocks of time, too."""

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
        content = json.loads((path / FOLDER / "check.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
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
            write_json(path / "check.json", content)


def kept(path: Path) -> AbstractContextManager[None]:
    """Say of a run folder that cannot be written any further how to go on with its check."""
    return storage(path, "check again: it goes on.", name="run")


def _changed(configuration: Configuration, scenario: Any, overrides: Mapping[str, Any]) -> Configuration:
    """Return a configuration with another scenario and other settings."""
    sections = configuration.model_dump()
    flat = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
    kept = {key: value for key, value in flat.items() if not key.startswith("scenario.")}
    return load_configuration(None, "default", kept | dict(overrides), scenario=scenario)
