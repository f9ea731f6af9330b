"""What a study will run: a configuration, and for each run the settings in which it differs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.config import (
    LARGEST_SEED,
    Configuration,
    ConfigurationError,
    Variant,
    flat_settings,
    is_integer,
    load_variants,
    require_at_least,
    require_seen,
    with_settings,
)
from turing_learning.purposes import RANDOM_BEHAVIORS
from turing_learning.swarm import AGGREGATION, Scenario

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
    """What a study will run.

    Parameters
    ----------
    base
        The configuration of the first run.
    settings
        For each run the settings that are not the same in all runs: dotted key -> value, the same keys in all.
    """

    base: Configuration
    settings: tuple[dict[str, Any], ...]

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
) -> Plan:
    """Resolve all configurations of a study.

    Parameters
    ----------
    scenario
        As in `infer`; "random-behaviors" draws the agents' parameters uniformly in [-1, 1] from the seed of each run.
    runs
        Number of runs of each configuration, >= 1, with the seeds `first_seed`, `first_seed` + 1, ...
    first_seed
        >= 0; None takes `run.seed` of the file, 1 by default.
    preset, config
        As in `infer`; the file may hold a ``[grid]`` or a ``[[list]]``, see `turing_learning.config.load_variants`.
    settings, labels
        Dotted key -> value, over preset and file; dotted key -> where it comes from, for messages.
    grid
        Dotted key -> values: all combinations are run.

    Raises
    ------
    ConfigurationError
        If anything is refused.
    """
    behaviors = scenario == BEHAVIORS.name
    require_at_least(1, runs=runs)
    if behaviors and CONTROLLER in (settings or {}):
        raise ConfigurationError(
            f"`{CONTROLLER}` must be left out of a study of random behaviors, which draws it; got "
            f"{(settings or {})[CONTROLLER]!r}."
        )
    if SEED in (settings or {}):
        raise ConfigurationError(
            f"`{SEED}` must be left out of a study; got {(settings or {})[SEED]!r}. Give the seeds with `runs` and "
            "`first_seed`."
        )
    variants = load_variants(
        config, preset, settings, scenario=BEHAVIORS if behaviors else scenario, labels=labels, grid=grid
    )
    _check_variants(variants, runs)
    seeds = _seeds(variants[0].configuration.run.seed if first_seed is None else first_seed, runs)
    return _plan([_seeded(variant.configuration, seed, behaviors) for variant in variants for seed in seeds])


def _seeds(first_seed: int, runs: int) -> range:
    if not is_integer(first_seed) or not 0 <= first_seed <= LARGEST_SEED - runs + 1:
        raise ConfigurationError(
            f"`first_seed` must be an integer between 0 and {LARGEST_SEED - runs + 1}, so that {runs} seeds follow; "
            f"got {first_seed!r}."
        )
    return range(first_seed, first_seed + runs)


def _check_variants(variants: Sequence[Variant], runs: int) -> None:
    names = variants[0].configuration.scenario.parameter_names
    for number, variant in enumerate(variants, start=1):
        require_seen(variant.configuration)
        if not variant.configuration.swarm.known:
            raise ConfigurationError(
                "`scenario.known` must be true in a study, whose agents are simulated; got False. Leave it out."
            )
        other = variant.configuration.scenario.parameter_names
        if other != names:
            raise ConfigurationError(
                f"`scenario` must have the same model parameters in all configurations of a study; got {len(names)} "
                f"in configuration 1 and {len(other)} in configuration {number}. Make two studies."
            )
    if len(variants) * runs > MOST_RUNS:
        raise ConfigurationError(f"`runs` must be at most {MOST_RUNS} in all; got {len(variants) * runs}.")


def _seeded(configuration: Configuration, seed: int, behaviors: bool) -> Configuration:
    seeded = configuration.model_copy(update={"run": configuration.run.model_copy(update={"seed": seed})})
    if not behaviors:
        return seeded
    return seeded.model_copy(update={"scenario": replace(seeded.swarm, controller=random_controller(seed))})


def random_controller(seed: int) -> tuple[float, ...]:
    """Draw the agents' parameters of a run of random behaviors, uniform in [-1, 1].

    Parameters
    ----------
    seed
        Seed of the run.

    Source
    ------
    Paper, section 4.6.4.
    """
    rng = np.random.default_rng(np.random.SeedSequence((RANDOM_BEHAVIORS, seed)))
    return tuple(rng.uniform(-1, 1, len(BEHAVIORS.controller)).tolist())


def _plan(configurations: Sequence[Configuration]) -> Plan:
    flat = [flat_settings(configuration) for configuration in configurations]
    keys = dict.fromkeys(key for settings in flat for key in settings)
    varying = [key for key in keys if key == SEED or any(own.get(key) != flat[0].get(key) for own in flat)]
    return Plan(configurations[0], tuple({key: own.get(key) for key in varying} for own in flat))
