"""What a study will run: a configuration, and for each run the settings in which it differs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.config import Configuration, ConfigurationError, flat_settings, with_settings
from turing_learning.config._configuration import require_seen
from turing_learning.config._sections import LARGEST_SEED, check
from turing_learning.config._study import load_variants
from turing_learning.errors import brief, integer, is_integer, refusing_as, require
from turing_learning.interaction import describe_stimulated
from turing_learning.purposes import RANDOM_BEHAVIORS
from turing_learning.runs._infer import is_custom
from turing_learning.swarm import AGGREGATION, Scenario
from turing_learning.systems import CustomOptions, CustomSystem, Range, describe, imported
from turing_learning.systems._calls import name_of

BEHAVIORS = replace(
    AGGREGATION,
    name="random-behaviors",
    title="Random behaviors",
    description="As aggregation; the controller is drawn at random, another one for each run (paper, section 4.6.4).",
)
"""A scenario of studies: the agents' parameters are uniform in [-1, 1], drawn from the seed of each run."""

SEED, CONTROLLER = "run.seed", "scenario.controller"
MOST_RUNS = 1_000_000


@dataclass(frozen=True)
class Plan:
    """What a study will run."""

    base: Configuration  # of the first run
    settings: tuple[dict[str, Any], ...]  # of each run those that are not the same in all: dotted key -> value
    simulate: str = ""  # name of a custom system's simulator
    samples: np.ndarray | None = field(default=None, compare=False)  # genuine ones (K, T, D); None once they are stored

    def __len__(self) -> int:
        return len(self.settings)

    @property
    def numbers(self) -> range:
        """Numbers of the runs, from 1."""
        return range(1, len(self) + 1)

    def configuration(self, number: int) -> Configuration:
        """Return the configuration of a run."""
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
    for key, value in (("settings", settings), ("grid", grid)):
        check(isinstance(value, Mapping | None), key, "be dotted keys with values", brief(value))
    behaviors, given = isinstance(scenario, str) and scenario == BEHAVIORS.name, settings or {}
    integer("runs", runs, 1, error=ConfigurationError)
    rule = "be left out of a study of random behaviors, which draws it"
    check(not (behaviors and CONTROLLER in given), CONTROLLER, rule, given.get(CONTROLLER))
    remedy = "Give the seeds with `runs` and `first_seed`."
    check(SEED not in given, SEED, "be left out of a study", given.get(SEED), remedy)
    known: str | Scenario | CustomSystem | None = BEHAVIORS if behaviors else scenario
    name, samples = "", None
    if is_custom(scenario, genuine, simulate, parameters):
        name, parameters, options = name_of(simulate, error=ConfigurationError), parameters or {}, options or {}
        with refusing_as(ConfigurationError):
            if "stimulus" in options:
                require(isinstance(genuine, Mapping), "genuine", "name true parameters in a study", brief(genuine))
                known = describe_stimulated(genuine, imported(name), parameters, options)
            else:
                known, data = describe(genuine, parameters, options)
                rule = "be samples in a study, whose workers cannot share a live source"
                require(data.live is None, "genuine", rule, genuine)
                samples = data.samples
    variants = load_variants(config, preset, settings, scenario=known, labels=labels, grid=grid)
    names = variants[0].scenario.parameter_names
    for number, variant in enumerate(variants, start=1):
        require_seen(variant)
        own, rule = variant.scenario, "be true in a study, whose agents are simulated"
        check(getattr(own, "known", True), "scenario.known", rule, False, "Leave it out.")
        sizes = f"{len(names)} in configuration 1 and {len(own.parameter_names)} in configuration {number}"
        rule = "have the same model parameters in all configurations of a study"
        check(own.parameter_names == names, "scenario", rule, sizes, "Make two studies.")
    count, most = len(variants) * runs, LARGEST_SEED - runs + 1
    check(count <= MOST_RUNS, "runs", f"be at most {MOST_RUNS} in all", count)
    first = variants[0].run.seed if first_seed is None else first_seed
    rule = f"be an integer between 0 and {most}, so that {runs} seeds follow"
    check(is_integer(first) and 0 <= first <= most, "first_seed", rule, first)
    chance: list[dict[str, Any]] = [
        {SEED: seed} | ({CONTROLLER: list(random_controller(seed))} if behaviors else {})
        for seed in range(first, first + runs)
    ]
    flat = [settings | drawn for settings, drawn in product(map(flat_settings, variants), chance)]
    keys = dict.fromkeys(key for one in flat for key in one)
    varying = [key for key in keys if key == SEED or any(one.get(key) != flat[0].get(key) for one in flat)]
    of_runs = tuple({key: one.get(key) for key in varying} for one in flat)
    return Plan(with_settings(variants[0], chance[0]), of_runs, name, samples)


def random_controller(seed: int) -> tuple[float, ...]:
    """Draw the agents' parameters of a run of random behaviors from its seed, uniform in [-1, 1]: paper, section 4.6.4."""
    rng = np.random.default_rng(np.random.SeedSequence((RANDOM_BEHAVIORS, seed)))
    return tuple(rng.uniform(-1, 1, len(BEHAVIORS.controller)).tolist())
