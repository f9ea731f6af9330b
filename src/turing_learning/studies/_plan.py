"""What a study will run, a configuration and for each run the settings in which it differs; and the folder that holds it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import SEALS, digest_of, file_digest
from turing_learning.config import (
    LARGEST_SEED,
    PROSE,
    Configuration,
    ConfigurationError,
    flat_settings,
    load_configuration,
    require_visible_objects,
    to_toml,
)
from turing_learning.config.settings import load_variants, with_settings
from turing_learning.errors import brief, check, integer, is_integer, refusing_as, require
from turing_learning.interaction import describe_stimulated
from turing_learning.purposes import RANDOM_BEHAVIORS
from turing_learning.runs import is_custom, resume_command
from turing_learning.store import (
    FolderKind,
    RunFolderError,
    Store,
    StoredPath,
    check_folder,
    reject_folder,
)
from turing_learning.swarm import AGGREGATION, Scenario
from turing_learning.systems import CustomOptions, CustomSystem, Range, describe, imported, name_of

BEHAVIORS = replace(
    AGGREGATION,
    name="random-behaviors",
    title="Random behaviors",
    description="As aggregation; the controller is drawn at random, another one for each run (paper, section 4.6.4).",
)
"""A scenario of studies: the agents' parameters are uniform in [-1, 1], drawn from the seed of each run."""

SEED = "run.seed"
CONTROLLER = "scenario.controller"
MOST_RUNS = 1_000_000

SAMPLES = "genuine.npy"
"""File of the study with the genuine samples of a custom system."""
FAILURE = "failure.json"
"""File of a run that says why it failed."""
_IDENTITY = ("scenario", "configuration_sha256", "runs", "simulate")
STUDY = FolderKind("study", "study.json", identity=_IDENTITY)
_TABLES = ("runs.csv", "summary.csv", "convergence.csv")
_RESULTS = ("runs", "figures", "report.html", *_TABLES, SAMPLES, SEALS, STUDY.head)


@dataclass(frozen=True)
class Plan:
    """What a study will run."""

    base: Configuration  # of the first run
    # Of each run those that are not the same in all: dotted key -> value
    settings: tuple[dict[str, Any], ...]
    simulate: str = ""  # name of a custom system's simulator
    # Genuine ones (K, T, D); None once they are stored
    samples: np.ndarray | None = field(default=None, compare=False)

    def __len__(self) -> int:
        return len(self.settings)

    @property
    def numbers(self) -> range:
        """Numbers of the runs, from 1."""
        return range(1, len(self) + 1)

    def configuration(self, number: int) -> Configuration:
        return with_settings(self.base, self.settings[number - 1])

    def group(self, number: int) -> dict[str, Any]:
        """Return the settings that a run shares with those that differ from it by nothing but chance."""
        chance = (SEED, CONTROLLER) if self.behaviors else (SEED,)
        return {key: value for key, value in self.settings[number - 1].items() if key not in chance}

    @property
    def behaviors(self) -> bool:
        """Whether the agents' controllers are drawn at random."""
        return self.base.scenario.name == BEHAVIORS.name


def plan_study(
    scenario: str | Scenario | None = None,
    *,
    runs: int = 30,
    first_seed: int | None = None,
    preset: str = "default",
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    labels: Mapping[str, str] | None = None,
    grid: Mapping[str, Sequence[Any]] | None = None,
    genuine: Any = None,
    simulate: Any = None,
    parameters: Mapping[str, Range] | None = None,
    options: CustomOptions | None = None,
) -> Plan:
    """Resolve all configurations of a study.

    Parameters
    ----------
    scenario, runs, first_seed, preset, config, settings, grid, genuine, simulate, parameters
        As in `study`.
    labels
        Dotted key of a setting -> where it comes from, for messages.
    options
        Of a custom system, as in `study`.
    """
    behaviors = isinstance(scenario, str) and scenario == BEHAVIORS.name
    integer("runs", runs, 1, error=ConfigurationError)
    _refuse_settings_of_runs(settings or {}, behaviors)
    system: str | Scenario | CustomSystem | None = scenario
    if behaviors:
        system = BEHAVIORS
    simulator = ""
    samples = None
    if is_custom(scenario, genuine, simulate, parameters):
        simulator = name_of(simulate, error=ConfigurationError)
        with refusing_as(ConfigurationError):
            system, samples = _custom_system(simulator, genuine, parameters or {}, options or {})
    variants = load_variants(config, preset, settings, scenario=system, labels=labels, grid=grid)
    _check_variants(variants)
    count = len(variants) * runs
    check(count <= MOST_RUNS, "runs", f"be at most {MOST_RUNS} in all", count)
    if first_seed is None:
        first_seed = variants[0].run.seed
    last_first_seed = LARGEST_SEED - runs + 1
    rule = f"be an integer between 0 and {last_first_seed}, so that {runs} seeds follow"
    fits = is_integer(first_seed) and 0 <= first_seed <= last_first_seed
    check(fits, "first_seed", rule, first_seed)
    # What chance decides is drawn here, so that the plan alone says what will run.
    chance: list[dict[str, Any]] = []
    for seed in range(first_seed, first_seed + runs):
        chance.append({SEED: seed})
        if behaviors:
            chance[-1][CONTROLLER] = list(random_controller(seed))
    every_setting = [flat | drawn for flat, drawn in product(map(flat_settings, variants), chance)]
    base = with_settings(variants[0], chance[0])
    return Plan(base, _differing_settings(every_setting), simulator, samples)


def _refuse_settings_of_runs(settings: Mapping[str, Any], behaviors: bool) -> None:
    """Reject settings that a study has another one of for each run."""
    rule = "be left out of a study of random behaviors, which draws it"
    check(not (behaviors and CONTROLLER in settings), CONTROLLER, rule, settings.get(CONTROLLER))
    remedy = "Give the seeds with `runs` and `first_seed`."
    check(SEED not in settings, SEED, "be left out of a study", settings.get(SEED), remedy)


def _custom_system(
    simulator: str, genuine: Any, parameters: Mapping[str, Range], options: CustomOptions
) -> tuple[CustomSystem, np.ndarray | None]:
    """Return a custom system and its genuine samples; None where a simulator answers for the true parameters."""
    if "stimulus" in options:
        rule = "name true parameters in a study"
        require(isinstance(genuine, Mapping), "genuine", rule, brief(genuine))
        return describe_stimulated(genuine, imported(simulator), parameters, options), None
    system, data = describe(genuine, parameters, options)
    rule = "be samples in a study, whose workers cannot share a live source"
    require(data.live is None, "genuine", rule, genuine)
    return system, data.samples


def _check_variants(variants: Sequence[Configuration]) -> None:
    """Reject configurations that one table cannot hold, or whose truth is not known."""
    names = variants[0].scenario.parameter_names
    for number, variant in enumerate(variants, start=1):
        require_visible_objects(variant)
        scenario = variant.scenario
        rule = "be true in a study, whose agents are simulated"
        check(getattr(scenario, "known", True), "scenario.known", rule, False, "Leave it out.")
        sizes = f"{len(names)} in configuration 1 and {len(scenario.parameter_names)} in configuration {number}"
        rule = "have the same model parameters in all configurations of a study"
        check(scenario.parameter_names == names, "scenario", rule, sizes, "Make two studies.")


def _differing_settings(every_setting: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], ...]:
    """Return the seed of each run, and the settings that are not the same in all runs."""
    reference = every_setting[0]
    differing = []
    # a dictionary and no set, so that columns of tables stay in the order of the settings
    for key in dict.fromkeys(chain.from_iterable(every_setting)):
        same = all(settings.get(key) == reference.get(key) for settings in every_setting)
        if key == SEED or not same:
            differing.append(key)
    return tuple({key: settings.get(key) for key in differing} for settings in every_setting)


def random_controller(seed: int) -> tuple[float, ...]:
    """Draw the agents' parameters of a run of random behaviors from its seed, uniform in [-1, 1]: paper, section 4.6.4."""
    rng = np.random.default_rng(np.random.SeedSequence((RANDOM_BEHAVIORS, seed)))
    return tuple(rng.uniform(-1, 1, len(BEHAVIORS.controller)).tolist())


def is_study(path: str | Path) -> bool:
    """Return whether a folder holds a study of any version."""
    return StudyFolder(path).exists()


class StudyFolder(Store):
    """Where a study keeps its files.

    Parameters
    ----------
    path
        The folder; a leading ~ is the home folder.
    """

    def __init__(self, path: str | Path) -> None:
        super().__init__(path, STUDY)

    configuration_path = StoredPath(
        "config.toml", "The resolved configuration of the first run (TOML)."
    )
    study_path = StoredPath(STUDY.head, "The settings in which each run differs (JSON).")
    figures_path = StoredPath("figures", "PNG and SVG pictures.")
    report_path = StoredPath("report.html", "The page that shows it all.")

    def run_path(self, number: int) -> Path:
        """The folder of a run, whose number counts from 1."""
        return self.path / "runs" / f"{number:04d}"

    def plan(self) -> Plan:
        """Return what the study runs.

        Raises
        ------
        RunFolderError
            If this is not a study folder, it has been changed, or a later version of the package
            has written it.
        """
        content = self.head()
        file = self.configuration_path
        otherwise = "or start a new study."
        try:
            same = content["configuration_sha256"] == file_digest(file)
            rule = "be as it was when the study began"
            got = "a changed one"
            check_folder(same, file.name, rule, got, f"Restore it, {otherwise}", place=str(file))
            seeds = [run["run.seed"] for run in content["runs"] or ()]
            if not seeds or not all(map(is_integer, seeds)):
                raise TypeError("no run, or one without a seed")  # noqa: TRY301
            return Plan(
                load_configuration(file), tuple(content["runs"]), str(content.get("simulate", ""))
            )
        except (OSError, KeyError, TypeError, ConfigurationError) as error:
            got = f"{self.path}, whose files cannot be read ({error})"
            reject_folder("study", "be as it was when it began", got, f"Restore them, {otherwise}")

    def refuse_if_taken(self, plan: Plan, *, force: bool) -> None:
        """Raise RunFolderError if something else is here, or a study of other settings that may not be replaced."""
        if self.exists():
            if not force and (difference := _difference(self.plan(), plan)):
                ahead = f"go on with the old study by `{resume_command(self.path)}`, or replace it with force=True."
                raise RunFolderError(f"{difference} [{self.path}]. Choose another folder, {ahead}")
            return
        foreign = self.foreign_names()
        # A study that was killed while it was made has a lock, and perhaps its configuration.
        if (self.path / "lock").exists():
            foreign = [name for name in foreign if name != "config.toml"]
        if foreign:
            rule = "be a new or empty folder, or hold this study"
            got = f"{self.path}, which holds {foreign[0]!r} and is not a study"
            reject_folder("out", rule, got, "Choose another folder.")

    def begin(self, plan: Plan, *, force: bool) -> None:
        """Make this the folder of a study, or leave it if it holds the same one; the caller holds the lock."""
        self.refuse_if_taken(plan, force=force)
        if self.exists():
            if not force:
                return
            # study.json comes last: until then it is a study that may be replaced.
            self.clear(_RESULTS)
        configuration = to_toml(plan.base).encode()
        head: dict[str, Any] = {
            "scenario": plan.base.scenario.name,
            "configuration_sha256": digest_of(configuration),
            "runs": list(plan.settings),
        }
        files: dict[str, Any] = {self.configuration_path.name: configuration}
        if plan.simulate:
            head["simulate"] = plan.simulate
        if plan.samples is not None:
            files[SAMPLES] = plan.samples
        self.create(head, files)


def _difference(stored_plan: Plan, plan: Plan) -> str:
    """Name the first setting in which two plans differ, nothing if there is none."""
    before = flat_settings(stored_plan.base)
    after = flat_settings(plan.base)
    compared: list[tuple[str, Any, Any, str]] = []
    for key in [*after, *before]:
        if key not in PROSE:
            compared.append((key, before.get(key), after.get(key), ""))
    compared.append(("runs", len(stored_plan), len(plan), ""))
    compared.append(("simulate", stored_plan.simulate, plan.simulate, ""))
    pairs = zip(stored_plan.settings, plan.settings, strict=False)
    for number, (stored, asked) in enumerate(pairs, start=1):
        for key in [*asked, *stored]:
            compared.append((key, stored.get(key), asked.get(key), f" in run {number}"))
    # The first difference is enough to tell the user what is wrong.
    for key, value, wanted, where in compared:
        if value != wanted:
            return f"`{key}` must be {value!r}{where}, as in the study that is in the folder; got {wanted!r}"
    return ""
