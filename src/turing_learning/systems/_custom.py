"""A custom system as frozen data, everything that a run stores of it, and what its caller hands over."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NoReturn

import numpy as np

from ..coevolution import Classifier
from ..errors import Setting, Text, brief, integer, refuse, require
from ..models import Behavior, Jumps, Parameter
from ..swarm import Scenario
from ..trajectories import SIGNALS
from ._genuine import Genuine, cut_samples, observed

if TYPE_CHECKING:
    from ._source import CustomSource

TIME_STEP_TOLERANCE = 0.01  # share by which time steps may differ that count as the same
LARGEST_DECADE = 300.0
"""A summary on a logarithmic scale is at most so many decades from 1."""

_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")


def same_time_step(one_s: float, other_s: float) -> bool:
    """Return whether two time steps (s), the second above 0, count as the same."""
    return abs(one_s / other_s - 1) <= TIME_STEP_TOLERANCE


@dataclass(frozen=True, eq=False)
class Given:
    """What a caller hands over of a custom system, beyond what a run stores.

    Attributes
    ----------
    genuine
        Samples, in any form that `describe` takes, or `Genuine` once they are checked.
    simulate
        The simulator.
    workers, timeout_s
        Number of processes that call it, None for this one, and the longest duration of a call (s).
    groups : (K,)
        Of a check: labels of the samples.
    more
        Other options, which only a new run takes.
    """

    genuine: Any = None
    simulate: Any = None
    workers: int | None = None
    timeout_s: float | None = None
    groups: Any = None
    more: Mapping[str, Any] | None = None

    @property
    def named(self) -> dict[str, Any]:
        """Name -> value of everything that may have been given."""
        names = ("genuine", "simulate", "workers", "timeout_s", "groups")
        return {name: getattr(self, name) for name in names} | dict(self.more or {})


@dataclass(frozen=True)
class CustomSystem:
    """A system that was observed, and how models of it are simulated.

    Parameters
    ----------
    name, title
        A word for folders, and what stands above the report.
    parameters
        Name -> parameter, in the order of the simulator's columns; P >= 1. Names are of letters, digits, _ and -.
    signals
        Names of the D signals per step.
    steps
        Time steps of a sample, T.
    center, input_scale : (D,)
        The classifiers see (signal - center) / input_scale: median, and 99th percentile of the distance from it, of
        the genuine data; see `read_genuine`.
    samples
        Number of genuine samples; 0 if they come from a live source.
    samples_per_generation
        How many of them the classifiers judge in a generation, drawn anew each time; 0 for as many as there are models.
    held_out
        Which samples (from 0) are never learned from.
    batches
        Number of calls of a vectorized simulator in a generation; the models are split evenly. 0 if it takes one model.
    digest
        SHA-256 of the genuine data; empty for a live source.
    interval_s
        Duration of a time step (s); 0 if it is not known.
    headings
        Whether the signals are measured "with" headings or "without"; empty if that is not known, or makes no difference to them.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    name: str
    title: str
    parameters: dict[str, Parameter]
    signals: tuple[str, ...]
    steps: int
    center: tuple[float, ...]
    input_scale: tuple[float, ...]
    samples: int
    samples_per_generation: int
    held_out: tuple[int, ...] = ()
    batches: int = 1
    digest: str = ""
    interval_s: float = 0.0
    headings: Literal["", "with", "without"] = ""

    truth: ClassVar[None] = None
    kind: ClassVar[str] = "one on a custom system"
    simulated: ClassVar[Scenario | None] = None
    jumps: ClassVar[Jumps] = Jumps()
    step_unit: ClassVar[str] = ", in halves of its initial range"
    resuming: ClassVar[tuple[Setting, ...]] = (Setting("genuine"), Setting("simulate"))

    def __post_init__(self) -> None:
        rule = "be of 1 to 60 letters, digits, _ and -"
        require(isinstance(self.name, str) and _NAME.fullmatch(self.name), "name", rule, brief(self.name))
        named = isinstance(self.parameters, Mapping) and self.parameters
        require(named, "parameters", "name one parameter or more", brief(self.parameters))
        for name in self.parameters:
            rule, fits = (
                "have names of 1 to 60 letters, digits, _ and -",
                isinstance(name, str) and _NAME.fullmatch(name),
            )
            require(fits, "parameters", rule, brief(name), "Give the unit to `Parameter`.")
        require(
            len(self.signals) == len(self.center) == len(self.input_scale) > 0,
            "signals",
            "be as many names as the data has signals, one or more",
            f"{len(self.signals)} names of {len(self.center)} signals",
        )
        different = len(set(self.signals)) == len(self.signals)
        require(different, "signals", "have different names", ", ".join(self.signals))
        for name, least in (("steps", 1), ("samples", 0), ("samples_per_generation", 0), ("batches", 0)):
            integer(name, getattr(self, name), least)
        require(self.interval_s >= 0, "interval_s", "be at least 0", self.interval_s)
        known = self.headings in ("", "with", "without")
        require(known, "headings", 'be "with", "without" or empty', brief(self.headings))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the model parameters."""
        return tuple(self.parameters)

    @property
    def parameter_labels(self) -> tuple[str, ...]:
        """Names of the model parameters, with units where they have any, for figures."""
        pairs = self.parameters.items()
        return tuple(f"{name} ({parameter.unit})" if parameter.unit else name for name, parameter in pairs)

    @property
    def live(self) -> bool:
        """Whether the genuine samples are observed anew in every generation."""
        return self.samples == 0

    @property
    def vectorized(self) -> bool:
        """Whether the simulator takes several models at once."""
        return self.batches > 0

    @property
    def model(self) -> "CustomSystem":
        """The system itself says what its models are."""
        return self

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P) in their users' units of models (M, P) as the optimizer has them."""
        return np.column_stack(
            [parameter.to_units(column) for parameter, column in zip(self.parameters.values(), models.T, strict=True)]
        )

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return models with these parameters (..., P) as they are."""
        return parameters

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Refuse: its models are executed by the simulator, not by robots."""
        refuse("scenario", "be one of simulated robots", f"{self.name!r}, a custom system")

    def centered(self, samples: np.ndarray) -> np.ndarray:
        """Return samples (..., T, D) as the classifiers see them before their inputs are divided by the scale."""
        return samples - np.asarray(self.center)

    def classifier(self, network: Classifier) -> "CenteredClassifier":
        """Return what judges samples as they were observed."""
        return CenteredClassifier(network, self)

    def on_scales(self, models: np.ndarray, summarize: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return a summary of models (..., P), parameter by parameter: in decades on a logarithmic scale, and within its bounds."""
        found = []
        for place, parameter in enumerate(self.parameters.values()):
            values, decades = models[..., place, None], parameter.scale == "log"
            summary = summarize(np.log10(values) if decades else values)
            if decades:
                summary = 10.0 ** np.clip(summary, -LARGEST_DECADE, LARGEST_DECADE)
            low = -np.inf if parameter.low is None else parameter.low
            found.append(np.clip(summary, low, np.inf if parameter.high is None else parameter.high))
        return np.concatenate(found)

    def shown(self, values: np.ndarray) -> str:
        """Return one model's parameters (P,) as text, by name, with units."""
        return ", ".join(
            f"{name} = {value:.6g}{' ' + parameter.unit if parameter.unit else ''}"
            for (name, parameter), value in zip(self.parameters.items(), values, strict=True)
        )

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        return ("Infer again as before, with ", Setting("run.history", "full"), ".")

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models; no settings of a swarm add to them."""
        samples = float(models + (self.samples_per_generation or models))
        return samples, 16.0 * models * self.steps * len(self.signals), ()

    def open(self, given: Given) -> "CustomSource":
        """Return the samples of the system and of its simulator."""
        from ._source import CustomSource

        given = self.accept(given)
        for name in ("genuine", "simulate"):
            rule = "be given for a custom system, which no folder holds completely"
            remedy = (
                "Give ",
                Setting("genuine"),
                " and ",
                Setting("simulate"),
                " as the run began with them, from Python.",
            )
            require(getattr(given, name) is not None, name, rule, "nothing", remedy)
        return CustomSource(self, given.genuine, given.simulate, workers=given.workers, timeout_s=given.timeout_s)

    def accept(self, given: Given) -> Given:
        """Return what is given, its samples checked; refuse samples that a stored run did not begin with, and another simulator."""
        if given.simulate is not None:
            self._refuse_other_simulator(given.simulate)
        if given.genuine is None or isinstance(given.genuine, Genuine):
            return given
        return replace(given, genuine=self._same_samples(given.genuine))

    def _same_samples(self, given: Any) -> Genuine:
        """Return the samples with which a run began, as they are given again."""
        genuine = observed(given)
        kind = "a live source" if self.live else "an array of samples"
        rule = f"be {kind}, as when the run began"
        require(callable(genuine) == self.live, "genuine", rule, f"a {type(genuine).__name__}")
        held_out = np.array(self.held_out, dtype=np.int64)
        if self.live:
            return Genuine(np.zeros((1, self.steps, len(self.signals))), held_out, genuine)
        steps = np.shape(getattr(genuine, "learning", ()))[1:2]
        rule, remedy = f"be windows of {self.steps} steps, as when the run began", "Cut them as then."
        require(not steps or steps[0] == self.steps, "genuine", rule, steps and steps[0], remedy)
        data = Genuine(cut_samples(genuine, self.steps), held_out)
        rule = f"be the samples that the run began with, of SHA-256 {self.digest[:12]}..."
        others, remedy = f"others, {data.digest[:12]}...", "Give the same, or start a new run."
        require(data.digest == self.digest, "genuine", rule, others, remedy)
        return data

    def _refuse_other_simulator(self, simulate: Any) -> None:
        """Refuse a simulator that says itself that it simulates another system, as a family of models can."""

        def refuse_as(rule: str, got: str, remedy: str) -> NoReturn:
            refuse("simulate", rule, got, remedy)

        asked = ("parameters", "signals", "interval_s", "steps")
        parameters, signals, interval, steps = (getattr(simulate, name, None) for name in asked)
        name, known = type(simulate).__name__, self.interval_s  # the interval is 0 if it is not known
        if isinstance(parameters, Mapping) and tuple(parameters) != self.parameter_names:
            rule = f"have the parameters of the run, {', '.join(self.parameters)}, in this order"
            refuse_as(rule, ", ".join(map(str, parameters)), "Give the simulator that the run has, or its parameters.")
        if isinstance(signals, tuple) and signals != self.signals and {*signals, *self.signals} <= set(SIGNALS):
            rule = f"have the signals of the samples, {', '.join(self.signals)}, in this order"
            refuse_as(rule, ", ".join(signals), f"Give the family of models signals={self.signals}.")
        if (self.headings, headings_of(simulate)) == ("without", "with"):
            got = f"{name}, whose speeds are negative backwards"
            remedy = "Give another family of models, or windows of a recording with headings."
            refuse_as("have no headings, as the samples have none", got, remedy)
        if (self.headings, headings_of(simulate)) == ("with", "without"):
            remedy = "Give a family of models with headings, or measure the samples without: "
            remedy += "dataclasses.replace(recording, headings=None).windows(...)."
            refuse_as("have headings, as the samples do", f"{name}, whose speeds are never negative", remedy)
        if known and isinstance(interval, float | int) and not same_time_step(interval, known):
            rule, remedy = f"have the time step of the samples, {known:.6g} s", f"interval_s={known:.6g}"
            refuse_as(rule, f"{interval:.6g} s", f"Give the family of models {remedy}, or samples at its rate.")
        if isinstance(steps, int) and steps != self.steps:
            rule, remedy = f"have as many steps as the samples, {self.steps}", f"steps={self.steps}"
            refuse_as(rule, str(steps), f"Give the family of models {remedy}.")


def headings_of(measured: Any) -> Literal["", "with", "without"]:
    """Return whether samples or a simulator say that they are measured with headings."""
    known = getattr(measured, "headings", None)
    if not isinstance(known, bool):
        return ""
    return "with" if known else "without"


@dataclass(frozen=True)
class CenteredClassifier:
    """Judge samples of a custom system as its run did, which moved them to the center of the genuine ones."""

    classifier: Classifier
    system: CustomSystem

    @property
    def parameters(self) -> int:
        """Length of a genome, Q."""
        return self.classifier.parameters

    def judge(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        """Return outputs (N, S) for genomes (N, Q) and samples (S, T, D)."""
        return self.classifier.judge(genomes, self.system.centered(samples))
