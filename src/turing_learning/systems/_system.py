"""What a run asks of a system, whatever its kind."""

import logging
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NoReturn, Self

import numpy as np

from ..coevolution import Classifier, Interrogation, Judgments, PassiveInterrogation, Samples
from ..errors import Setting, Text, refuse, require
from ..models import Parameter, Representation
from ..swarm import Scenario

if TYPE_CHECKING:
    from ._genuine import Genuine

_LOGGER = logging.getLogger("turing_learning")
MOST_LISTED = 100
"""Failed simulations that a result lists; the others are counted only."""
LONGEST_REASON = 300
"""Characters that are kept of the reason of a failure."""


class SystemFailedError(RuntimeError):
    """A system, or what imitates it, has failed; the run stopped, and one in a folder can be resumed.

    `explained` is whether the message says already how to resume the run.
    """

    explained = False


class CustomSystemError(SystemFailedError):
    """A custom system or its simulator has failed."""


@dataclass(frozen=True, eq=False)
class Arguments:
    """What a caller hands over of a custom system, beyond what a run stores."""

    #: Samples, in any form that `describe` takes, or `Genuine` once they are checked
    genuine: Any = None
    simulate: Any = None  #: The simulator
    #: Number of processes that call it, None for this one
    workers: int | None = None
    timeout_s: float | None = None  #: The longest duration of a call (s)
    groups: Any = None  #: (K,): Of a check: labels of the samples
    executor: Any = (
        None  #: A `concurrent.futures.Executor` that calls the simulator, instead of `workers`
    )
    #: Other options, which only a new run takes
    more: Mapping[str, Any] | None = None

    @property
    def named(self) -> dict[str, Any]:
        """Name -> value of everything that may have been given."""
        values = dict(vars(self))
        return values | dict(values.pop("more") or {})


class System:
    """What is observed, and what imitates it: `Swarm`, `CustomSystem`, `Laboratory`."""

    name: str  #: A word for folders and tables
    title: str  #: Heading of the report
    noun: str  #: What a run of it is, in messages: "one in a laboratory"
    #: In which results state models, with units and ranges of first models
    parameters: Mapping[str, Parameter]
    signals: tuple[str, ...]  #: Names of the D signals per time step
    steps: int  #: Time steps of a sample, T
    interval_s: float  #: Duration of a step (s), 0 if it is not known
    #: Whether signals are measured "with" headings or "without"; empty if unknown, or if it makes
    #: no difference
    headings: Literal["", "with", "without"] = ""
    #: Frames over which recorded positions were averaged; 1 for none
    smooth_frames: int = 1
    #: From the optimizer's numbers to parameters of models, and to what results state
    model: Representation
    #: The scenario, where the computer can simulate its swarms
    simulated: Scenario | None = None
    #: Whether something is done to it while it is observed, see `Source.dialogues`
    stimulated: bool = False
    #: What a caption adds on the unit of the models' step sizes
    step_unit: str = ""

    @property
    def parameter_labels(self) -> tuple[str, ...]:
        """Names of the parameters, with units where they have any, for figures."""
        labels = []
        for name, parameter in self.parameters.items():
            labels.append(f"{name} ({parameter.unit})" if parameter.unit else name)
        return tuple(labels)

    @property
    def truth(self) -> tuple[float, ...] | None:
        """The true parameters; None where they are not known."""
        return None

    @property
    def dialogue_names(self) -> tuple[str, ...]:
        """Names of what is observed, then of stimuli, in what `Source.dialogues` returns."""
        return self.signals

    @property
    def signal_units(self) -> Mapping[str, str]:
        """Units of the signals by name, where they are known."""
        return {}

    @property
    def trials_per_model(self) -> int:
        """Number of trials in which a model is executed in a generation."""
        return 1

    @property
    def resuming(self) -> tuple[Setting, ...]:
        """Arguments that `resume` needs besides the folder."""
        return ()

    def shown(self, values: np.ndarray) -> str:
        """Return one model's parameters (P,) as text, by name, with units."""
        texts = []
        for (name, parameter), value in zip(self.parameters.items(), values, strict=True):
            texts.append(f"{name} = {value:.6g} {parameter.unit}".rstrip())
        return ", ".join(texts)

    def evolved(self, network: Classifier) -> Classifier:
        """Return what evolves, made of the network that judges: the network itself, or one that chooses stimuli, too."""
        return network

    def classifier(self, network: Classifier) -> Classifier:
        """Return what judges samples as they were observed."""
        return network

    def require_trials(self) -> None:
        """Refuse a run of few trials, which judges samples again, where that cannot be."""

    def imitated(self, values: np.ndarray) -> Any:
        """Return the scenario of a system whose truth is a model with parameters (P,), to be simulated."""
        return self

    def on_scales(
        self, models: np.ndarray, summarize: Callable[[np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """Return a summary of models (..., P), parameter by parameter, on the scale of each and within its bounds."""
        return summarize(models)

    def again(self, path: str) -> Text:
        """Return how to run it again with its full history, where `path` is its configuration."""
        return f"Run it again: turing-learning infer --config {shlex.quote(path)} --set run.history=full"

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models, and the settings that both grow with."""
        raise NotImplementedError

    def require_all(self, arguments: Arguments) -> None:
        """Refuse where something is missing that no folder holds, see `resuming`."""
        if not self.resuming:
            return
        rule = f"be given for {self.noun.removeprefix('one on ')}, which no folder holds completely"
        names: list[str | Setting] = [self.resuming[0]]
        for setting in self.resuming[1:]:
            names += [" and ", setting]
        pronoun = "them" if len(self.resuming) > 1 else "it"
        remedy = ("Give ", *names, f" as the run began with {pronoun}, from Python.")
        for setting in self.resuming:
            got = "nothing"
            require(getattr(arguments, setting.name) is not None, setting.name, rule, got, remedy)

    def accept(self, arguments: Arguments) -> Arguments:
        """Return what is given, checked.

        Refuse what it has no use for, and what differs from that of the stored run.
        """
        raise NotImplementedError

    def open(self, arguments: Arguments) -> "Source":
        """Return its samples; the caller closes them. Refuse what is missing."""
        raise NotImplementedError


class Source:
    """Samples of a system and of models of it while a run, or a check, needs them. A context manager.

    What derives from it implements `collect`, and `simulate` and `genuine_samples` where the
    computer can do that alone; also `to_units` where it has no `system`.
    """

    system: System  #: Whose samples these are
    #: Number of the generation that is collected next, set by who runs them; None after a run, as
    #: in a check
    generation: int | None = 0
    #: Whether all trials are spent, and what is simulated examines the estimate
    examining: bool = False
    #: Whether collecting may raise a `SystemFailedError`; the run returns to the generation's
    #: beginning then
    fallible: bool = True
    #: Failed simulations; None where none can fail alone
    failures: "FailureLog | None" = None
    #: Samples that the run was given; None where some are observed anew
    genuine: "Genuine | None" = None
    together: int = 1  #: Number of models that a trial executes
    #: Whether the samples of a batch of trials have to be collected at once
    whole_batches: bool = False
    #: Whether a few hundred samples more cost little, as of simulated swarms and families of models
    cheap: bool = False
    #: Lowest and highest of the optimizer's numbers, beyond which a model is that at the end; None
    #: without ends
    ends: tuple[float, float] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *stop: object) -> None:
        self.close()

    def close(self) -> None:
        """Release what was opened."""

    @property
    def callers(self) -> int | None:
        """How many simulations are made at once by workers or an executor; None if nobody says it."""
        return None

    @property
    def recorded(self) -> np.ndarray | None:
        """All genuine samples (K, T, D) to learn from, as classifiers see them; None where the system is observed anew."""
        return None

    @property
    def observed_anew(self) -> bool:
        """Whether the system is observed anew in each generation or batch."""
        return self.recorded is None

    @property
    def independent(self) -> np.ndarray | None:
        """The same and those held out, if they are independent of each other; None of windows of one recording."""
        return None

    def interrogation(self, classifier: Classifier) -> Interrogation:
        """Return what lets classifiers judge its samples."""
        return PassiveInterrogation(self, classifier)

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P), in their units, of models (M, P) as the optimizer has them."""
        return self.system.model.to_units(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the system, and of models (M, P) as the optimizer has them."""
        raise NotImplementedError

    def told_by_phases(
        self, genuine: np.ndarray, estimate: np.ndarray, samples: np.ndarray, models: np.ndarray
    ) -> bool:
        """Say whether genuine samples are told from those of models by what no model can explain.

        Genuine ones (K, T, D), which the estimate (P,) describes, and samples (N, T, D) of models
        (N, P), both as the optimizer has them.
        """
        return False

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, C, T, D) of models with parameters (M, P) in their units, without those that fail."""
        _refuse_simulation()

    def positions(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return where individuals are whose motion can be shown, in steps of `interval_s` (s), by name.

        "replicas" (F, A, 2), who execute the model with these parameters (P,); "recorded" (F, A',
        2) individuals, NaN where somebody is absent; "tank" (2,) width and height. Without
        "replicas" there is nothing to show.
        """
        return {}

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return genuine samples (count or more, T, D), as they are observed, that no two trials share."""
        _refuse_simulation()

    def dialogues(
        self, classifiers: np.ndarray, estimate: np.ndarray, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Return what the best of N classifiers (N, Q) do to the system and to the estimate (P,).

        Nothing without stimuli.
        """
        return {}


def _refuse_simulation() -> NoReturn:
    remedy = "The worth of its models there is in post_evaluation.json; "
    remedy += "`turing_learning.runs.simulate_laboratory` infers the same setup in simulation."
    refuse("run", "be of a system that can be simulated", "one in a laboratory", remedy)


class FailureLog:
    """Failed simulations of a run, of models with P parameters of these names: all of them counted, the first hundred listed."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.count = 0
        self._names = names
        self._listed: list[tuple[int, tuple[float, ...], str]] = []

    def add(self, generation: int | None, parameters: np.ndarray, reason: str) -> None:
        """Count a failure of a model with parameters (P,), and list it if it is of a generation."""
        self.count += 1
        if generation is not None and len(self._listed) < MOST_LISTED:
            self._listed.append((generation, tuple(parameters.tolist()), reason[:LONGEST_REASON]))

    def summary(self) -> dict[str, Any]:
        """Return the number of failures, and the first ones by generation, parameters and reason, for a result."""
        listed = []
        for generation, values, reason in self._listed:
            parameters = dict(zip(self._names, values, strict=True))
            failure = {"generation": generation, "parameters": parameters, "reason": reason}
            listed.append(failure)
        return {"count": self.count, "listed": listed}

    def state(self) -> dict[str, np.ndarray]:
        """Return everything as arrays, without Python objects."""
        generations = [generation for generation, _, _ in self._listed]
        parameters = [values for _, values, _ in self._listed]
        reasons = [reason for _, _, reason in self._listed]
        shape = (len(self._listed), len(self._names))
        return {
            "count": np.array(self.count, dtype=np.int64),
            "generations": np.array(generations, dtype=np.int64),
            "parameters": np.array(parameters, dtype=np.float64).reshape(shape),
            "reasons": np.array(reasons, dtype=f"<U{LONGEST_REASON}"),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a `state`."""
        self.count = int(state["count"])
        self._listed = []
        for generation, values, reason in zip(
            state["generations"].tolist(),
            state["parameters"].tolist(),
            state["reasons"].tolist(),
            strict=True,
        ):
            self._listed.append((generation, tuple(values), reason))


class FallibleSource(Source):
    """A source whose models are simulated by a caller's function, which may fail for some of them.

    A failed model is marked in `failed`, and no classifier accepts it.
    """

    failures: FailureLog

    def __init__(self, system: System) -> None:
        self.system = system
        self.failures = FailureLog(tuple(system.parameters))
        # Of the models that were simulated last, (M,)
        self.failed = np.zeros(0, dtype=bool)
        self._probing = False

    @contextmanager
    def probing(self) -> Iterator[None]:
        """Simulate models that nobody has inferred, such as images of a solution.

        Failures are only marked. They are not counted, and do not end the run.
        """
        self._probing = True
        try:
            yield
        finally:
            self._probing = False

    def interrogation(self, classifier: Classifier) -> Interrogation:
        """Return what lets classifiers judge its samples, and reject models whose simulation failed."""
        return GuardedInterrogation(self, classifier)

    def note(self, parameters: np.ndarray, reasons: Mapping[int, str]) -> None:
        """Mark and count the models, of those with parameters (M, P), that failed.

        End the run if these are more than half.
        """
        models = len(parameters)
        self.failed = np.isin(np.arange(models), list(reasons))
        if not reasons or self._probing:
            return
        count = len(reasons)
        first_failed = min(reasons)
        example = (
            f"the first with {self.system.shown(parameters[first_failed])}: {reasons[first_failed]}"
        )
        if 2 * count > models:
            self._end_run(models, count, example)
        generation = self.generation
        if self.failures.count == 0:
            when = "" if generation is None else f" in generation {generation}"
            if self.examining:
                when = " in the examination"
            _LOGGER.warning("%d of %d simulations failed%s, %s.", count, models, when, example)
        for k in sorted(reasons):
            self.failures.add(generation, parameters[k], reasons[k])

    def _end_run(self, models: int, failed: int, example: str) -> NoReturn:
        """Raise what says that more than half of the models have failed."""
        several = f"more than half of the {models} models"
        got = f"{failed} failures or more"
        remedy = "Repair the simulator."
        if self.examining:
            several += " of the examination"
        elif self.generation is not None:
            several += " of a generation"
            got += f" [generation {self.generation}]"
            remedy = "Narrow the bounds of the parameters, or repair the simulator."
        rule = f"`simulate` must not fail for {several}"
        raise CustomSystemError(f"{rule}; got {got}, {example}. {remedy}")


class GuardedInterrogation(PassiveInterrogation):
    """A passive interrogation in which no classifier ever judges a model genuine whose simulation failed.

    Its samples stand for nothing; its reward is 0, the worst that there is. All classifiers gain
    the same by it, so that their ranks stay as they are.
    """

    source: FallibleSource  #: Yields the samples, and says which models failed

    def __call__(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:
        """Return the judgments of N classifiers (N, Q), and of B archived ones (B, Q) if given, on M models (M, P)."""
        judgments = super().__call__(models, classifiers, rng, referees)
        failed = self.source.failed[:, None]
        if not failed.any():
            return judgments
        archived = judgments.referee_outputs
        if archived is not None:
            archived = np.where(failed, 0.0, archived)
        outputs = np.where(failed, 0.0, judgments.counterfeit_outputs)
        return replace(judgments, counterfeit_outputs=outputs, referee_outputs=archived)
