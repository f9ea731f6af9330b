"""Check whether the estimate of a run can be believed, in stages that are stored as they are
completed."""

import logging
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property, partial
from inspect import signature
from pathlib import Path
from time import perf_counter
from typing import Any, cast

import numpy as np
from scipy.special import ndtri

from turing_learning import systems
from turing_learning.analysis import is_known
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.config.settings import refuse_unknown, resolved
from turing_learning.errors import check as check_setting
from turing_learning.errors import integer, refusing_as, reject
from turing_learning.examination import Telling, telling_statistics
from turing_learning.identifiability import (
    Check,
    Effort,
    PinnedDown,
    Profile,
    Recovery,
    profile,
    read_check,
    reference_accuracies,
    two_sample_test,
)
from turing_learning.identifiability import evidence as evidences
from turing_learning.identifiability.evidence import (
    OBSERVING,
    RECOVERING,
    Evidence,
    Quantity,
    evidence_of,
    stream,
)
from turing_learning.report import counted
from turing_learning.store import RunFolderError, check_folder, storage, writable
from turing_learning.store import RunStorageError as RunStorageError
from turing_learning.systems import (
    Arguments,
    CustomSystem,
    CustomSystemError,
    Source,
    describe_simulated,
    same_time_step,
)
from turing_learning.trajectories import Trajectories

from ._folder import RunFolder
from ._report import draw_check, report, save_figures
from ._result import CHECK, Evolution, Posterior, Result
from ._run import Run, conduct

FOLDER = "check"
RECOVERIES = 5
"""Of a run of trials, by default."""
MODELS_PER_RECOVERY = 3
"""Models that each recovery calls plausible, tested as if they were the system."""
PLAUSIBLE_DRAWS = 1000
"""Models that a run of generations calls plausible, by its intervals."""

_LOGGER = logging.getLogger("turing_learning")

Stage = Callable[[str], None]


@dataclass(eq=False)
class _Checker:
    """The stages of a check; what is not named below is as for `check`."""

    result: Result
    source: Source  # the run's, opened again
    arguments: Arguments  # of a custom system
    evidence: Evidence
    effort: Effort
    settings: dict[str, Any]  # all that decides what a check finds
    recording: Sequence[Trajectories]
    stage: Stage

    def __post_init__(self) -> None:
        self.configuration = self.result.configuration
        self.by_trials = isinstance(self.result, Posterior)
        # no weight of a network stands for one of the parameters
        self.profiled = self.effort.points > 0 and self.result.networks is None
        self.seed = self.settings["seed"]
        self.folder = None if self.result.path is None else RunFolder(self.result.path)
        self.estimate = np.array(list(self.result.estimate.values()))

    @cached_property
    def plausible(self) -> np.ndarray:
        """Models (W, P) that the run calls plausible; a check that is complete needs none."""
        return plausible(self.result)

    def run(self, *, force: bool) -> Check:
        """Go through the stages; what a folder holds already is not done again."""
        content = self._begun(force)
        model = self.result.simulated_model
        began = perf_counter()
        test = None
        if "test" not in content:
            # the first of many tests, which says how long the others will take
            test = two_sample_test(self.evidence, self.plausible, self.effort, seed=self.seed)
        ahead = self._ahead(content, perf_counter() - began)
        if ahead:
            self.stage(ahead)
        if test is not None:
            self.stage("fresh classifiers against the estimate")
            usual = reference_accuracies(
                self.evidence, self.plausible, self.effort, self.effort.references, seed=self.seed
            )
            content["test"] = replace(test, plausible=tuple(usual)).to_json()
            self._write(content)
        if "quantities" not in content:
            self.stage("distributions, genuine beside simulated")
            content["quantities"] = [quantity.to_json() for quantity in self._quantities(model)]
            self._write(content)
        if self.profiled:
            self._profile(content)
        recoveries = self.settings["recoveries"]
        for k in range(len(content["recoveries"]), recoveries):
            self.stage(f"a run whose truth is the estimate, {k + 1} of {recoveries}")
            content["recoveries"].append(self._recovery(k))
            self._write(content)
        content["parameters"] = self._pinned_down(content)
        check = read_check(content, self.result.said)
        if check.judgment.fits is False and "telling" not in content:
            content["telling"] = list(map(asdict, self._telling(model)))
            check = read_check(content, self.result.said)
        content |= {
            "parameters": list(map(asdict, check.parameters)),
            "verdicts": check.verdicts,
            "judgment": check.judgment.to_json(),
        }
        self._write(content)
        if self.folder is None:
            self.result.stored().beside[CHECK] = content
        return check

    def _profile(self, content: dict[str, Any]) -> None:
        """Move each parameter, but for those whose profiles are stored."""
        for index, name in enumerate(self.result.estimate):
            if name in content["profiles"]:
                continue
            self.stage(f"fresh classifiers where {name} is moved")
            try:
                options: dict[str, Any] = {
                    "seed": self.seed,
                    "beyond": self.by_trials,
                    "plausible": self.plausible,
                }
                profiled = profile(self.evidence, self.estimate, index, self.effort, **options)
                content["profiles"][name] = profiled.to_json()
            except CustomSystemError as error:
                remedy = "Or check without profiles, with points=0 in `effort` and force=True."
                raise CustomSystemError(f"{error} {remedy}") from error
            self._write(content)

    def _ahead(self, content: dict[str, Any], test_s: float) -> str:
        """Return in words what is still to be done, and how long it takes.

        Nothing where all of it is stored. `test_s`: how long the first test took (s).
        """
        items = []
        tests = 0
        if "test" not in content:
            items.append("fresh classifiers against the estimate")
            tests += self.effort.references
        profiles = 0
        if self.profiled:
            profiles = len(self.result.estimate) - len(content["profiles"])
        tests += profiles * (self.effort.points + 1)
        if profiles:
            items.append(f"{counted(profiles, 'profile')} of {self.effort.points} values")
        runs = self.settings["recoveries"] - len(content["recoveries"])
        if runs:
            seconds = None
            if self.folder is not None:
                seconds = self.folder.manifest().get("seconds")
            took = ""
            if isinstance(seconds, int | float) and seconds > 0:
                took = f", {seconds:.0f} s"
            items.append(
                f"{counted(runs, 'run')} whose truth is the estimate, each about as long as this one{took}"
            )
            tests += runs * (1 + MODELS_PER_RECOVERY)
        if tests and "test" not in content:
            items.append(f"{tests} tests take about {tests * test_s:.0f} s")
        return f"ahead: {'; '.join(items)}" if items else ""

    def _write(self, content: dict[str, Any]) -> None:
        if self.folder is not None:
            with stored_in(self.folder.path):
                self.folder.write(CHECK, content)

    def _begun(self, force: bool) -> dict[str, Any]:
        """Return what is known already, under these settings.

        Else the beginning of a check, in place of one that is there.
        """
        stored = None if self.folder is None else stored_check(self.folder.path)
        if self.folder is not None and stored is not None and not force:
            needed = partial(check_folder, name="run", place=str(self.folder.path / FOLDER))
            same = stored["settings"]["estimate"] == self.result.estimate
            rule = "have the estimate that it had when its check began"
            remedy = "The run has gone on since: replace the check with force=True."
            needed(same, rule=rule, got=f"another, after {self.result.length}", remedy=remedy)
            rule = "be checked with the settings that its check began with"
            remedy = "Replace it with force=True."
            # those of 0.2.0 name the networks that judged; they are kept if they are complete
            stored_settings = stored["settings"]
            if "parameters" in stored:
                stored_settings = {"references": self.effort.references} | stored_settings
            asked = {name: stored_settings.get(name) for name in self.settings}
            needed(asked == self.settings, rule=rule, got="others", remedy=remedy)
            return stored
        unfinished = None if self.result.complete else self.result.progress
        begun: dict[str, Any] = {
            "settings": self.settings,
            "unfinished": unfinished,
            "profiles": {},
            "recoveries": [],
        }
        if self.folder is not None:
            path = self.folder.path / CHECK
            with stored_in(self.folder.path):
                if stored is not None:
                    shutil.rmtree(path.parent)
                elif path.exists():
                    aside = self.folder.set_aside(CHECK)
                    _LOGGER.warning(
                        "%s is damaged; the check begins anew. The damaged file is %s.",
                        path,
                        aside.name,
                    )
        self._write(begun)
        return begun

    def _telling(self, model: np.ndarray) -> tuple[Telling, ...]:
        """Return what gives a model (P,) away that does not fit."""
        evidence = self.evidence
        genuine = np.concatenate((evidence.testing, evidence.learning))
        # nothing is said of which samples for learning belong together
        own_groups = 1 + evidence.groups.max() + np.arange(len(evidence.learning))
        rng = stream(self.seed, evidences.COMPARING, 2)
        models = np.tile(model, (2 * self.effort.samples, 1))
        simulated = evidence.simulate(models, rng)
        return telling_statistics(
            genuine,
            simulated.reshape(-1, *simulated.shape[-2:]),
            np.concatenate((evidence.groups, own_groups)),
            names=evidence.names,
            units=self.configuration.system.signal_units,
            interval_s=self.configuration.system.interval_s,
            seed=self.seed,
        )

    def _quantities(self, model: np.ndarray) -> tuple[Quantity, ...]:
        if self.configuration.system.simulated is not None:
            return evidences.swarm_quantities(self.configuration, model, seed=self.seed)
        count = min(evidences.COMPARED, 2 * self.effort.samples)
        rng = stream(self.seed, evidences.COMPARING)
        genuine = np.concatenate((self.evidence.learning, self.evidence.testing))
        simulate = self.evidence.simulate
        simulated = simulate(np.tile(self.estimate, (count, 1)), rng)
        system = self.configuration.system
        comparisons = evidences.signal_quantities(genuine, simulated, system)
        if not self.recording or not hasattr(self.arguments.simulate, "simulate"):
            return comparisons
        group = evidences.recorded_quantities(
            self.recording, self.arguments.simulate, self.estimate, seed=self.seed
        )
        # signals are among the quantities of a group, too
        of_groups = [quantity for quantity in group if quantity.name not in system.signals]
        return (*comparisons, *of_groups)

    def _recovery(self, k: int) -> dict[str, Any]:
        """Run once more, with the estimate as the truth."""
        seed = self.configuration.run.seed + 1 + k
        overrides: dict[str, Any] = {"run.seed": seed, "run.history": "thin"}
        if not self.by_trials:
            overrides["run.generations"] = self.settings["recovery_generations"]
        path = None
        if self.folder is not None:
            path = self.folder.path / FOLDER / f"recovery-{k + 1}"
        if self.source.genuine is not None:
            system = cast(CustomSystem, self.configuration.scenario)
            rng = stream(self.seed, RECOVERING, k)
            with refusing_as(ConfigurationError):
                scenario, data = describe_simulated(system, self.source, self.estimate, rng)
            changed = replace(self.arguments, genuine=data, groups=None)
        else:
            scenario = self.configuration.system.imitated(self.estimate)
            changed = replace(self.arguments, genuine=None)
            overrides["classifiers.input_scale"] = self.configuration.classifiers.input_scale
        configuration = resolved(scenario, "default", self.configuration, overrides)
        try:
            recovered = begin_or_resume(configuration, path, changed)
        except (RunFolderError, RunStorageError) as error:
            if self.folder is None or not isinstance(error.__cause__, OSError):
                raise
            # Resumed as a check, not as a run of its own
            with stored_in(self.folder.path):
                raise error.__cause__ from None
        # a run of generations states no interval: its models wander
        interval = recovered.interval
        if isinstance(recovered, Evolution):
            interval = recovered.wandering
        shares = np.abs(self._numbers(recovered.estimate) - self._numbers(self.result.estimate)) / 2
        return Recovery(
            seed=seed,
            generations=recovered.generations,
            truth=self.result.estimate,
            estimate=recovered.estimate,
            interval=interval,
            error_share=dict(zip(recovered.estimate, shares.tolist(), strict=True)),
            **self._told(k, configuration, changed, recovered),
        ).to_json()

    def _told(
        self, k: int, configuration: Configuration, arguments: Arguments, recovered: Result
    ) -> dict[str, Any]:
        """Return how well a panel tells a recovery's truth from the models that it calls plausible.

        And `MODELS_PER_RECOVERY` of these models from the rest of them.
        """
        number = self.seed + 1 + k
        evidence = self.evidence
        with configuration.system.open(arguments) as source:
            if source.genuine is None:
                evidence = evidence_of(configuration, source, self.effort, number)
            else:
                rng = stream(self.seed, RECOVERING, k)
                truth = np.tile(self.result.simulated_model, (len(evidence.testing), 1))
                testing = evidence.simulate(truth, rng)[:, 0]
                learning = source.genuine_samples(self.effort.samples, rng)
                groups = evidence.groups[: len(testing)]
                evidence = replace(evidence, learning=learning, testing=testing, groups=groups)
            test = two_sample_test(
                evidence,
                plausible(recovered),
                self.effort,
                seed=number,
                purpose=(RECOVERING,),
                references=MODELS_PER_RECOVERY,
            )
        return {"accuracy": test.accuracy, "attainable": test.plausible}

    def _numbers(self, values: Mapping[str, float]) -> np.ndarray:
        """Return values as numbers from -1 to 1 over the initial ranges."""
        numbers = []
        for name, value in values.items():
            numbers.append(float(self.evidence.parameters[name].to_numbers(np.array(value))))
        return np.array(numbers)

    def _pinned_down(self, content: dict[str, Any]) -> list[dict[str, Any]]:
        interval = self.result.interval
        low_ends = self._numbers({name: low for name, (low, _) in interval.items()})
        high_ends = self._numbers({name: high for name, (_, high) in interval.items()})
        # an interval may reach beyond the initial range
        widths = np.minimum(np.abs(high_ends - low_ends) / 2, 1.0)
        errors = [recovery["error_share"] for recovery in content["recoveries"]]
        entries = []
        for (name, value), width in zip(self.result.estimate.items(), widths, strict=True):
            facts: dict[str, Any] = {"open_share": None}
            if self.profiled:
                facts["open_share"] = Profile(**content["profiles"][name]).open_share
            if not self.result.networks:
                facts["bound"] = self.evidence.parameters[name].bound_at(value)
            if self.by_trials:
                rejected = content["profiles"].get(name, {}).get("rejected", (False, False))
                facts["sides"] = tuple(rejected)
            entry = PinnedDown(
                parameter=name,
                interval_share=float(width) if is_known(width) else None,
                recovery_error=max(shares[name] for shares in errors) if errors else None,
                **facts,
            )
            entries.append(asdict(entry))
        return entries


def plausible(result: Result) -> np.ndarray:
    """Return models (W, P) that a run calls plausible, in what `simulate` takes.

    Those are the draws of a run of trials, values within the intervals of one of generations, or
    its last networks. A run that states nothing calls its estimate plausible, and nothing else.
    """
    model = result.simulated_model[None]
    if not all(is_known(*bounds) for bounds in result.interval.values()):
        return model
    if isinstance(result, Posterior):
        return result.draws() if result.settled else model
    if result.networks is not None:
        window = result.configuration.run.estimated_from(result.generations)
        return np.asarray(result.history["typical_model"].to_numpy()[-window:])
    columns = []
    rng = stream(result.seed, OBSERVING, 1)
    parameters = result.configuration.system.parameters
    for name, bounds in result.interval.items():
        parameter = parameters[name]
        low, high = parameter.to_numbers(np.array(bounds))
        middle = float(parameter.to_numbers(np.array(result.estimate[name])))
        # the ends hold the central 90 %
        drawn = middle + (high - low) / (2 * ndtri(0.95)) * rng.standard_normal(PLAUSIBLE_DRAWS)
        columns.append(parameter.to_units(drawn))
    return np.stack(columns, axis=1)


def stored_check(path: Path) -> dict[str, Any] | None:
    """Return what is known of the check of a run folder, complete or not.

    None if it was never begun.
    """
    try:
        content = RunFolder(path).read(CHECK)
    except RunFolderError:
        return None
    if isinstance(content, dict) and "settings" in content:
        return content
    return None


def check(
    result: Result,
    *,
    genuine: Any = None,
    simulate: systems.Simulator | None = None,
    recording: Trajectories | Sequence[Trajectories] | None = None,
    groups: Any = None,
    effort: Effort | None = None,
    recoveries: int | None = None,
    recovery_generations: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    executor: Any = None,
    timeout_s: float | None = None,
    force: bool = False,
    stage: Stage | None = None,
) -> Check:
    """Check whether the estimate of a run can be believed.

    `Result.check` calls it. See docs/identifiability.md.

    A panel of examiners learns to tell genuine samples from samples of models that the run calls
    plausible, and is tested on held-out ones. The same is done for some of these models, as if
    each were the system, and where each parameter is moved across its range. Further
    runs are made whose truth is the estimate; and distributions of the motion are compared. Of a
    run in a folder all of it is kept there, and goes on where it was stopped.

    Parameters
    ----------
    result
        Of the run.
    genuine, simulate
        Of a custom system, as when the run began; needed where the run was loaded from a folder.
    recording
        The recording that the samples are from, or several, to compare distances of neighbors and
        polarization, too; by default those that windows were cut from. The simulator has to say
        where everybody was, as model families do.
    groups : (K,)
        Labels of the samples, of any kind; those with the same one are alike, for example of one
        individual. None takes the individuals of windows of recorded motion, and each sample for
        itself otherwise.
    effort
        How much is simulated and trained.
    recoveries, recovery_generations
        Number of runs whose truth is the estimate, 0 for none, and their length. None makes 1 of
        the length of the run. Of a run of trials it makes 5, which spend as many trials as the run
        was to spend: 2 or more say whether the search or the model is at fault.
    seed
        Of all random numbers of the check, >= 0.
    workers, timeout_s, executor
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
    RunFolderError
        If the folder is in use or holds a check with other settings, or the samples are not those
        of the run.
    CustomSystemError
        If the simulator fails for most of the samples.
    """
    record = result.stored()
    configuration = record.configuration
    by_trials = isinstance(result, Posterior)
    got = f"{recovery_generations} for a run of trials"
    rule = "be left out for a run of trials"
    check_setting(not (by_trials and recovery_generations), "recovery_generations", rule, got)
    length = recovery_generations
    if recovery_generations is None:
        length = result.generations
    if recoveries is None:
        recoveries = RECOVERIES if by_trials else 1
    limits = {"recoveries": (recoveries, 0), "recovery_generations": (length, 1), "seed": (seed, 0)}
    for name, (value, lowest) in limits.items():
        integer(name, value, lowest, error=ConfigurationError)
    # Else a check would compare two simulations
    rule = "be of a system that can be simulated"
    remedy = "What its models are worth there is in post_evaluation.json; `turing_learning.runs.simulate_laboratory` "
    remedy += "says what its setup could infer at all."
    got = "one in a laboratory"
    check_setting(not result.in_laboratory, "run", rule, got, remedy, place=str(result.path))
    folder = None if result.path is None else RunFolder(result.path)
    system = configuration.system
    functions = record.samples_and_simulator(genuine, simulate)
    arguments = Arguments(
        functions.genuine, functions.simulate, workers, timeout_s, groups, executor
    )
    say = stage or (lambda text: None)
    if isinstance(recording, Trajectories):
        recording = (recording,)
    if recording is None and hasattr(functions.simulate, "interval_s"):
        recording = getattr(functions.genuine, "sources", ())
    recordings = tuple(recording or ())
    with ExitStack() as stack:
        if folder is not None:
            with writable("run", folder.path):
                stack.enter_context(folder.locked())
        with refusing_as(ConfigurationError):
            source = stack.enter_context(system.open(arguments))
        labels = None
        if groups is not None and source.genuine is not None:
            labels = evidences.labelled_groups(source.genuine, groups)
        if recordings and source.genuine is None:
            reject("recording", "be left out for simulated robots", "one")
        if system.interval_s > 0:
            _refuse_other_rates(recordings, system.interval_s)
        effort = effort or Effort()
        # refuses what cannot be checked, before anything is written
        evidence = evidence_of(configuration, source, effort, seed, labels)
        # Where samples do not say what belongs together, nothing is stored of it
        stored_groups = None
        if evidence.grouping not in ("samples", "trials"):
            stored_groups = evidence.groups.tolist()
        settings = {
            "estimate": result.estimate,
            "seed": seed,
            "recoveries": recoveries,
            "recovery_generations": length,
            "recording": bool(recordings),
            "groups": stored_groups,
        } | asdict(effort)
        checked = _Checker(
            result, source, arguments, evidence, effort, settings, recordings, say
        ).run(force=force)
        # The report again where there is one, and the history that it shows
        if folder is not None:
            with stored_in(folder.path):
                save_figures(draw_check(checked, result), folder.figures_path)
                if folder.report_path.exists():
                    try:
                        report(result)
                    except RunFolderError as error:
                        say(f"the report is left as it was: {error}")
    return checked


def _refuse_other_rates(recordings: Sequence[Trajectories], interval_s: float) -> None:
    """Refuse recordings that are not of the samples, by their frame rates."""
    rule = f"have the frame rate of the samples, {1 / interval_s:.6g} per second"
    remedy = "Give the recording that the samples are from."
    for recording in recordings:
        same = same_time_step(interval_s, 1 / recording.fps)
        check_setting(same, "recording", rule, f"{recording.fps:.6g}", remedy)


def begin_or_resume(
    configuration: Configuration, path: Path | None, arguments: Arguments
) -> Result:
    """Run a configuration, in a folder or in memory.

    One that is in the folder already is resumed.
    """
    if path is not None and RunFolder(path).is_run():
        return conduct(Run.open(path, lambda configuration: configuration.system.open(arguments)))
    with refusing_as(ConfigurationError):
        source = configuration.system.open(arguments)
    with source:
        return conduct(Run.begin(configuration, path, source=source))


def refuse_unknown_part(options: Mapping[str, Any]) -> None:
    """Raise ConfigurationError if there is an option that no check has."""
    for effort_field in fields(Effort):
        name = effort_field.name
        if name in options:
            example = (
                f"Give effort=turing_learning.identifiability.Effort({name}={options[name]!r})."
            )
            reject(name, "be a part of the effort", f"{options[name]!r} beside it", example)
    refuse_unknown(options, list(signature(check).parameters)[1:])


def stored_in(path: Path) -> AbstractContextManager[None]:
    """Say of a run folder that cannot be written any further how to resume its check."""
    return storage(path, "check again: it goes on.", name="run")
