"""The sections of a configuration as validated, frozen data."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from turing_learning.errors import nearest, require
from turing_learning.evolution import FASTEST_ADAPTATION, STEP_SIZE_LIMIT

PROSE = ("scenario.title", "scenario.description")
"""Settings that are told, and change nothing: configurations that differ in them alone are the
same."""

LARGEST_SEED = 2**63 - 1
"""The largest integer that TOML promises to carry."""

# Inputs and hidden neurons, as in `classifiers.ElmanClassifier`
LARGEST_NEURONS = 255
LARGEST_START = 1e6  # of the range of the first population
LARGEST_GENERATIONS = 10_000_000  # a week and more at the paper's size
NETWORKS_STEP_SIZE = 0.3  # initial, of models that are networks: decision 0017
JUMPS_UNTIL = 0.7  # share of a run after which no model jumps

OPTIMIZERS = ("evolution-strategy", "cma")
"""Names of the optimizers that are built in, the paper's first."""
NETWORKS = ("elman",)
# Before the name of an object that only the process that began a run has
GIVEN = "given:"

# What floats carry; others are limited by memory
Count = Annotated[int, Field(ge=1, le=10**15)]
Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Start = Annotated[float, Field(ge=-LARGEST_START, le=LARGEST_START)]


def require_part(key: str, name: str, built_in: tuple[str, ...]) -> None:
    """Reject a name that is neither built in nor "module:function"."""
    fits = name in built_in or ":" in name.strip(":")
    rule = f"be {', '.join(built_in)}, or module:function"
    require(fits, key, rule, repr(name), nearest(name, built_in))


def dotted(table: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the values of nested tables by dotted keys, in their order."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= dotted(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


class Section(BaseModel):
    """What all sections share: frozen, no unknown keys, only finite numbers.

    What stands below a field describes it.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


class PopulationSection(Section):
    """A population and its evolution strategy.

    A file may give `population` instead of `parents` and `offspring`; it must be even and is split
    into halves.
    """

    parents: Count = 50
    """individuals that survive a generation, the fittest"""
    offspring: Count = 50
    """children of them in the next generation"""
    initial_low: Start = -1.0
    """lower end of the range from which the first individuals are drawn: wheel speeds of robots,
    weights of networks; for a custom system -1 and 1 are the ends of the first models' range of
    each parameter"""
    initial_high: Start = 1.0
    """upper end of that range"""
    start: Literal["range", "middle"] = "range"
    """ "range": the first individuals are drawn from it; "middle": they begin in its middle"""
    initial_step_size: Positive = 1.0
    """standard deviation of the first mutations; 0.3 if models are networks"""
    minimum_step_size: float = Field(default=0.01, ge=0)
    """no mutation has a smaller standard deviation"""
    adaptation: Annotated[float, Field(gt=0, le=FASTEST_ADAPTATION)] = 0.5
    """learning rates of the step sizes; 1: those of the textbook that the paper cites (Eiben and
    Smith 2003), 0.5: those of the group's public code"""
    optimizer: str = OPTIMIZERS[0]
    """what improves the population: "evolution-strategy", the paper's; "cma", CMA-ES; or
    "module:function", see docs/your-own-parts.md. The settings of step sizes and of children are
    those of the evolution strategy"""

    @model_validator(mode="after")
    def _check_range(self) -> "PopulationSection":
        fits = self.initial_low < self.initial_high
        got = f"{self.initial_low} and {self.initial_high}"
        require(fits, "initial_low", "be below initial_high", got)
        step = self.initial_step_size
        fits = self.minimum_step_size <= step <= STEP_SIZE_LIMIT
        rule = f"be between minimum_step_size ({self.minimum_step_size}) and {STEP_SIZE_LIMIT:g}"
        require(fits, "initial_step_size", rule, step)
        require_part("optimizer", self.optimizer, OPTIMIZERS)
        return self


class ModelsSection(PopulationSection):
    """The population of models, and what they are.

    With `hidden` 0 models are what the scenario says, in the agents' parameters (gray box); with 1
    or more they are Elman networks with as many hidden neurons (black box; paper, section 4.6.2).
    Their `initial_step_size` is 0.3 unless it is given: with 1 many of them come to oscillate.

    A run has two halves: the first searches for the right region, the second for the right point.
    docs/method.md says how; the paper has neither.
    """

    hidden: Annotated[int, Field(ge=0, le=LARGEST_NEURONS)] = 0
    """0: models are what the scenario says, in the agents' parameters; 1 or more: Elman networks
    with so many hidden neurons"""
    recombination: Share = 0.5
    """share of children with two parents in the first half of a run; the others have one"""
    redraw: Share = 0.2
    """share of children of which one parameter is drawn anew from the range of the first
    individuals (of a field of view five times that range), in the first half of a run; then of ever
    fewer, and of none after 0.7 of the run"""
    exchange: Share = 0.1
    """in the same way, share of children in which two sensor states exchange their wheel speeds,
    and an inferred field of view is drawn anew; without effect where models are networks or a
    custom system"""
    intermediate: bool = True
    """in the second half, children have the means of their parents' parameters, not one's or the
    other's"""
    memory: Share = 0.9
    """in the second half, models are selected by the mean of their rewards over the generations
    that they have lived, relative to the population, each weighing so many times the next one; 0:
    by the present reward alone"""

    @model_validator(mode="before")
    @classmethod
    def _begin_networks_with_small_steps(cls, settings: Any) -> Any:
        if isinstance(settings, Mapping) and settings.get("hidden"):
            return {"initial_step_size": NETWORKS_STEP_SIZE, **settings}
        return settings


class ClassifiersSection(PopulationSection):
    """The population of classifiers and their networks."""

    network: str = NETWORKS[0]
    """what judges: "elman", the paper's network; or "module:function", see
    docs/your-own-parts.md"""
    hidden: Count = 5
    """hidden neurons of an Elman network"""
    renewal: Annotated[int, Field(ge=0)] = 100
    """in the first half of a run all classifiers are replaced by random ones after every so many
    generations; 0: never. Needs an archive"""
    input_scale: Literal["robot"] | tuple[Positive, ...] = "robot"
    """what the inputs are divided by: "robot", the largest speeds of the scenario's robot, or a
    list with one positive number for each signal (cm/s, rad/s). Of a custom system it is found in
    the data"""

    @model_validator(mode="after")
    def _check_network(self) -> "ClassifiersSection":
        require_part("network", self.network, NETWORKS)
        return self


class CoevolutionSection(Section):
    """The interplay of the two populations."""

    archive: Annotated[int, Field(ge=0)] = 100
    """past classifiers, each the best of its generation, that judge the models beside the present
    ones; then votes weigh by competence. 0: none, and equal votes"""


class RunSection(Section):
    """How long and with what to run."""

    generations: Annotated[int, Field(ge=1, le=LARGEST_GENERATIONS)] = 1000
    """length of a run without `trials`"""
    trials: Annotated[int, Field(ge=0, le=LARGEST_GENERATIONS)] = 0
    """20 or more: the run infers from so many trials, keeps all samples and judges them again
    (decision 0028); generations and the population of models do not count. 0: as many trials as the
    generations need. 3000 where nothing is said of run.generations, checkpoint_every,
    estimate_window, models, classifiers and coevolution (decision 0035)"""
    tolerance: Annotated[float, Field(ge=0, lt=0.5)] = 0.0
    """of a run with `trials`: it stops before they are spent once it has settled and the interval
    of every parameter that can be identified is at most this share of the parameter's range to
    either side. 0: never"""
    batch: Annotated[int, Field(ge=0, le=LARGEST_GENERATIONS)] = 0
    """trials in a batch of a run with `trials`, whose simulations are made at once: a multiple of the
    number of workers lets few of them wait. The first batch has more. 0: a fortieth of the trials"""
    extended: tuple[tuple[int, int], ...] = ()
    """of a finished run that was given more `trials`: the number that it had, and how many of them
    were spent, for each time"""
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = 1
    """of all random numbers: the same seed gives the same result, another one another run"""
    threads: Literal["all"] | Count = "all"
    """a number, or all processors; results do not depend on it"""
    checkpoint_every: Count = 50
    """generations after which the run is saved"""
    estimate_window: Count = 300
    """last generations that the estimate is read from, or the last 0.3 of the run if these are
    fewer"""
    history: Literal["full", "thin"] = "full"
    """ "full": both populations of every generation are kept, and the run ends with figures and a
    report; "thin": the best and the typical models and the quartiles of the fitness, in a hundredth
    of the space, as studies keep them"""

    @property
    def earlier(self) -> set[int]:
        """Numbers of trials that were spent when the run was given more."""
        return {spent for _, spent in self.extended}

    @property
    def keeps_populations(self) -> bool:
        """Whether the history holds those of every generation: a full one, of a run by generations."""
        return self.history == "full" and self.trials == 0

    @property
    def save_every(self) -> int:
        """Number of generations, or batches of trials, after which the run is saved.

        After each batch: a stored run has a piece of its buffer for every one.
        """
        return 1 if self.trials else self.checkpoint_every

    @property
    def halfway(self) -> int:
        """Generation in which the search for the right region ends and that for the right point begins."""
        return self.generations // 2

    @property
    def settled(self) -> int:
        """Generation from which on no model jumps, and nothing disturbs what the estimate is read from."""
        return round(JUMPS_UNTIL * self.generations)

    def estimated_from(self, completed: int) -> int:
        """Return how many of so many completed generations the estimate is read from, counted from the last."""
        return min(self.estimate_window, max(1, round((1 - JUMPS_UNTIL) * completed)))
