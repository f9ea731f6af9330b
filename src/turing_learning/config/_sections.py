"""The sections of a configuration as validated, frozen data."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from turing_learning.models import ElmanModel, Representation
from turing_learning.sources import OwnSystem
from turing_learning.swarm import Scenario

from ._limits import LARGEST_NEURONS, check_limits

LARGEST_SEED = 2**63 - 1
"""The largest integer that TOML promises to carry."""

LARGEST_STEP_SIZE = 1e6  # as in `evolution.EvolutionStrategy`
LARGEST_START = 1e6  # of the range of the first population
LARGEST_GENERATIONS = 10_000_000  # a week and more at the paper's size
NETWORKS_STEP_SIZE = 0.3  # initial, of models that are networks: decision 0017
SETTLED = 0.7  # share of a run after which no model jumps

Count = Annotated[int, Field(ge=1)]
Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Start = Annotated[float, Field(ge=-LARGEST_START, le=LARGEST_START)]


class Section(BaseModel):
    """What all sections share: frozen, no unknown keys, only finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)


class PopulationSection(Section):
    """A population and its evolution strategy.

    A file may give `population` instead of `parents` and `offspring`; it must be even and is split into halves.
    """

    parents: Count = 50
    offspring: Count = 50
    initial_low: Start = -1.0
    initial_high: Start = 1.0
    initial_step_size: Positive = 1.0
    minimum_step_size: Annotated[float, Field(ge=0)] = 0.01

    @model_validator(mode="after")
    def _check_range(self) -> "PopulationSection":
        if self.initial_low > self.initial_high:
            raise ValueError(
                f"`initial_low` must be at most initial_high; got {self.initial_low} and {self.initial_high}."
            )
        if not self.minimum_step_size <= self.initial_step_size <= LARGEST_STEP_SIZE:
            raise ValueError(
                f"`initial_step_size` must be between minimum_step_size ({self.minimum_step_size}) and "
                f"{LARGEST_STEP_SIZE:g}; got {self.initial_step_size}."
            )
        return self


class ModelsSection(PopulationSection):
    """The population of models, and what they are.

    With `hidden` 0 models are what the scenario says, in the agents' parameters (gray box); with 1 or more they are Elman networks
    with as many hidden neurons (black box; paper, section 4.6.2). Their `initial_step_size` is 0.3 unless it is given: with 1
    many of them come to oscillate.

    A run has two halves. The first searches for the right region: only a share `recombination` of the children has two parents,
    one parameter of a share `redraw` is drawn anew from the initial range, and in a share `exchange` two sensor states
    exchange their wheel speeds. The second searches for the right point: with `intermediate` children are the means of their
    parents, models are selected by the rewards of all generations that they have lived, each weighing `memory` times the
    next one, and until 0.7 of the run `redraw` and `exchange` shrink to nothing. The paper has none of this:
    recombination 1, intermediate false, and 0 for the others.
    """

    hidden: Annotated[int, Field(ge=0, le=LARGEST_NEURONS)] = 0
    recombination: Share = 0.5
    redraw: Share = 0.2
    exchange: Share = 0.1
    intermediate: bool = True
    memory: Share = 0.9

    @model_validator(mode="before")
    @classmethod
    def _begin_networks_with_small_steps(cls, given: Any) -> Any:
        if isinstance(given, Mapping) and given.get("hidden"):
            return {"initial_step_size": NETWORKS_STEP_SIZE, **given}
        return given


class ClassifiersSection(PopulationSection):
    """The population of classifiers and their networks.

    In the first half of a run the population is replaced by random classifiers after every `renewal` generations; 0 for
    never, as in the paper.

    `input_scale` divides the inputs of the networks: "robot" takes the largest speeds of the scenario's robot, a list
    gives one positive number (cm/s, rad/s) for each signal.
    """

    hidden: Count = 5
    renewal: Annotated[int, Field(ge=0)] = 100
    input_scale: Literal["robot"] | tuple[Positive, ...] = "robot"


class CoevolutionSection(Section):
    """The interplay of the two populations.

    `archive` is the number of past classifiers that go on judging models; with them, classifiers old and new have votes
    according to their competence. 0: none, and equal votes, as in the paper.
    """

    archive: Annotated[int, Field(ge=0)] = 100


class RunSection(Section):
    """How long and with what to run.

    `threads` is "all" or a number; the results do not depend on it. The run is saved after every `checkpoint_every`
    generations. The estimate is a median over the last `estimate_window` generations, or the last 0.3 of the run if that is less.
    With `history` "full" both populations of every generation are kept, and the run ends with figures and a report; with
    "thin" only the best and typical models and the quartiles of the fitness, in a hundredth of the space, as studies of
    many runs do.
    """

    generations: Annotated[int, Field(ge=1, le=LARGEST_GENERATIONS)] = 1000
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 1
    threads: Literal["all"] | Count = "all"
    checkpoint_every: Count = 50
    estimate_window: Count = 300
    history: Literal["full", "thin"] = "full"

    @property
    def halfway(self) -> int:
        """Generation in which the search for the right region ends and that for the right point begins."""
        return self.generations // 2

    @property
    def settled(self) -> int:
        """Generation from which on no model jumps, and nothing disturbs what the estimate is read from."""
        return round(SETTLED * self.generations)

    def estimated_from(self, completed: int) -> int:
        """Return how many of so many completed generations the estimate is read from, counted from the last."""
        return min(self.estimate_window, max(1, round((1 - SETTLED) * completed)))


class Configuration(Section):
    """Everything that determines a run, resolved: no field is left to a default elsewhere."""

    scenario: Scenario
    models: ModelsSection = ModelsSection()
    classifiers: ClassifiersSection = ClassifiersSection()
    coevolution: CoevolutionSection = CoevolutionSection()
    run: RunSection = RunSection()

    @model_validator(mode="after")
    def _check_scale(self) -> "Configuration":
        scale = self.classifiers.input_scale
        if scale != "robot" and len(scale) != len(self.scenario.input_scale):
            raise ValueError(
                f'`classifiers.input_scale` must be "robot" or {len(self.scenario.input_scale)} positive numbers, '
                f"one for each signal; got {list(scale)}."
            )
        return self

    @model_validator(mode="after")
    def _check_renewal(self) -> "Configuration":
        if self.classifiers.renewal > 0 and self.coevolution.archive == 0:
            raise ValueError(
                "`classifiers.renewal` must be 0 without an archive (coevolution.archive = 0), which would remember what "
                f"renewed classifiers forget; got {self.classifiers.renewal}."
            )
        return self

    @model_validator(mode="after")
    def _check_hidden(self) -> "Configuration":
        if self.models.hidden and self.scenario.representation != "reactive":
            raise ValueError(
                '`models.hidden` must be 0 unless scenario.representation is "reactive", as a network infers no field of view; '
                f"got {self.models.hidden} with {self.scenario.representation!r}."
            )
        return self

    @model_validator(mode="after")
    def _check_limits(self) -> "Configuration":
        check_limits(self)
        return self

    @property
    def representation(self) -> Representation:
        """What a model is: that of the scenario, or a network."""
        scenario, hidden = self.scenario, self.models.hidden
        return ElmanModel(scenario.sensor.states, hidden) if hidden else scenario.model

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters of a model, in which the history keeps it."""
        return self.representation.parameter_names

    def described(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the parameters that results state: the agents', by `scenario.parameter_names`."""
        return self.representation.described(models)

    @property
    def input_scale(self) -> tuple[float, ...]:
        """What the classifiers' inputs are divided by, one number for each signal (cm/s, rad/s)."""
        scale = self.classifiers.input_scale
        return self.scenario.input_scale if scale == "robot" else scale

    @property
    def threads(self) -> int | None:
        """Number of threads, None for all processors."""
        return None if self.run.threads == "all" else self.run.threads


class OwnConfiguration(Configuration):
    """Everything that determines a run with a system of one's own, apart from the data and the simulator.

    `classifiers.input_scale` holds the scales found in the data, unless others were given.
    """

    scenario: OwnSystem  # type: ignore[assignment] # stands in for a scenario wherever a run asks one

    @model_validator(mode="after")
    def _check_hidden(self) -> "OwnConfiguration":
        if self.models.hidden:
            raise ValueError(
                "`models.hidden` must be 0 for a system of one's own, whose simulator takes the parameters of its models; "
                f"got {self.models.hidden}."
            )
        return self

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters."""
        return self.scenario.parameter_names

    def described(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) as they are."""
        return models
