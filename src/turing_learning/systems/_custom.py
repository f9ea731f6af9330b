"""A custom system as frozen data, and its samples: genuine ones, and those of models from any simulator."""

import logging
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, is_dataclass, replace
from functools import partial
from itertools import starmap
from typing import Any, Literal, NoReturn

import numpy as np

from turing_learning.models import LARGEST_DECADE, Settings

from ..coevolution import Classifier, Samples
from ..errors import Setting, Text, brief, integer, number, refuse, require
from ..models import Behavior, Jumps, Parameter
from ..trajectories import SIGNALS, Windows, origin_of
from ..workers import NotImportable, WorkerDied, Workers, packed
from ._calls import Answer, Failed, Simulator, answer
from ._executor import answers_by, workers_of
from ._genuine import (
    Genuine,
    cut_samples,
    names_of,
    observed,
    recorded_samples,
    table_names,
    value_text,
)
from ._per_model import value_of_parameter, with_columns
from ._system import Arguments, CustomSystemError, FallibleSource, Source, System

LARGEST_NUMBER = 10**9
"""Of samples, steps or calls."""


REPLAY_FRAMES = 601
"""Frames of a replay of replicas alone, where there is no recording."""


_LOGGER = logging.getLogger("turing_learning")
TIME_STEP_TOLERANCE = 0.01
"""Share by which time steps may differ that count as the same."""


_REMEDY = "Define it at the top level of a module, or leave `workers` out."
_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")
# families that are put together are named as kicks+walls
_SYSTEM_NAME = re.compile(r"[A-Za-z0-9_+-]{1,60}")


def same_time_step(one_s: float, other_s: float) -> bool:
    """Return whether two time steps (s), the second above 0, count as the same."""
    return abs(one_s / other_s - 1) <= TIME_STEP_TOLERANCE


@dataclass(frozen=True)
class CustomSystem(System, Settings):
    """A system that was observed, and how models of it are simulated; what is not described here: see `System`."""

    name: str  #: Of 1 to 60 letters, digits, _, + and -
    title: str
    #: In the order of the simulator's columns; P >= 1, with names of letters, digits, _ and -
    parameters: dict[str, Parameter]
    signals: tuple[str, ...]
    steps: int
    #: (D,): The classifiers see (signal - center) / input_scale: here the median of the genuine
    #: data
    center: tuple[float, ...]
    #: (D,): 99th percentile of the distance from the median; see `read_genuine`
    input_scale: tuple[float, ...]
    samples: int  #: Number of genuine samples; 0 if they come from a live source
    #: How many of them are judged in a generation, drawn anew each time; 0 for as many as there
    #: are models
    samples_per_generation: int
    held_out: tuple[int, ...] = ()  #: Which samples (from 0) are never learned from
    #: Number of calls of a vectorized simulator in a generation, models split evenly; 0 if it
    #: takes one model
    batches: int = 1
    digest: str = ""  #: SHA-256 of the genuine data; empty for a live source
    interval_s: float = 0.0
    headings: Literal["", "with", "without"] = ""
    smooth_frames: int = 1
    #: SHA-256 of the recordings that the genuine data were measured in; empty of data from elsewhere
    origin: str = ""

    noun = "one on a custom system"
    jumps = Jumps()
    saturation = ()
    step_unit = ", in halves of its initial range"

    def __post_init__(self) -> None:
        rule = "be of 1 to 60 letters, digits, _, + and -"
        require(_SYSTEM_NAME.fullmatch(self.name), "name", rule, brief(self.name))
        require(self.parameters, "parameters", "name one parameter or more", brief(self.parameters))
        rule = "have names of 1 to 60 letters, digits, _ and -"
        remedy = "Give the unit to `Parameter`."
        for name in self.parameters:
            require(_NAME.fullmatch(name), "parameters", rule, brief(name), remedy)
        count = len(self.signals)
        fits = count == len(self.center) == len(self.input_scale) > 0
        rule = "be as many names as the data has signals, one or more"
        require(fits, "signals", rule, f"{count} names of {len(self.center)} signals")
        fits = len(set(self.signals)) == count
        require(fits, "signals", "have different names", ", ".join(self.signals))
        lowest = {
            "steps": 1,
            "samples": 0,
            "samples_per_generation": 0,
            "batches": 0,
            "smooth_frames": 1,
        }
        for name, lowest_value in lowest.items():
            value = integer(name, getattr(self, name), lowest_value)
            require(value <= LARGEST_NUMBER, name, f"be at most {LARGEST_NUMBER}", value)
        require(self.interval_s >= 0, "interval_s", "be at least 0", self.interval_s)
        fits = self.headings in ("", "with", "without")
        require(fits, "headings", 'be "with", "without" or empty', brief(self.headings))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the model parameters."""
        return tuple(self.parameters)

    @property
    def signal_units(self) -> Mapping[str, str]:
        """Units of its signals by name, where they are known: of a recording, whose signals this library measures."""
        if self.interval_s > 0 and not self.stimulated:
            return SIGNALS
        return {}

    @property
    def resuming(self) -> tuple[Setting, ...]:
        """Samples and simulator, which no folder holds."""
        return Setting("genuine"), Setting("simulate")

    @property
    def live(self) -> bool:
        """Whether the genuine samples are observed anew in every generation."""
        return self.samples == 0

    @property
    def vectorized(self) -> bool:
        """Whether the simulator takes several models at once."""
        return self.batches > 0

    @property
    def model(self) -> "CustomSystem":  # type: ignore[override]
        """The system itself says what its models are."""
        return self

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P) in their users' units of models (M, P) as the optimizer has them."""
        pairs = zip(self.parameters.values(), models.T, strict=True)
        return np.column_stack([parameter.to_units(column) for parameter, column in pairs])

    def described(self, parameters: np.ndarray) -> np.ndarray:
        """Return models with these parameters (..., P) as they are."""
        return parameters

    def behavior(self, parameters: np.ndarray) -> Behavior:
        """Refuse: its models are executed by the simulator, not by robots."""
        refuse("scenario", "be one of simulated robots", f"{self.name!r}, a custom system")

    def require_trials(self) -> None:
        """Refuse a run of few trials on a single sample, whose likeness to others nothing tells."""
        count = self.samples - len(self.held_out)
        rule = "be 2 samples or more to learn from, with a budget in trials"
        shorter = "Cut it into several that are shorter, or give "
        remedy = (shorter, Setting("generations"), " instead of trials.")
        got = f"{count} of {self.steps} steps"
        require(self.live or count > 1, "genuine", rule, got, remedy)

    def centered(self, samples: np.ndarray) -> np.ndarray:
        """Return samples (..., T, D) as the classifiers see them before their inputs are divided by the scale."""
        return samples - np.asarray(self.center)

    def classifier(self, network: Classifier) -> "CenteredClassifier":
        return CenteredClassifier(network, self)

    def on_scales(
        self, models: np.ndarray, summarize: Callable[[np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """Return a summary of models (..., P), parameter by parameter.

        It is computed in decades on a logarithmic scale, and stays within the bounds.
        """
        summaries = []
        for k, parameter in enumerate(self.parameters.values()):
            values = models[..., k, None]
            if parameter.scale == "log":
                decades = summarize(np.log10(values))
                summary = 10.0 ** np.clip(decades, -LARGEST_DECADE, LARGEST_DECADE)
            else:
                summary = summarize(values)
            summaries.append(np.clip(summary, parameter.low, parameter.high))
        return np.concatenate(summaries)

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        return ("Infer again as before, with ", Setting("run.history", "full"), ".")

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models.

        No settings of a swarm add to them.
        """
        samples = float(models + (self.samples_per_generation or models))
        return samples, 16.0 * models * self.steps * len(self.signals), ()

    def open(self, arguments: Arguments) -> Source:
        arguments = self.accept(arguments)
        self.require_all(arguments)
        return CustomSource(
            self,
            arguments.genuine,
            with_columns(arguments.simulate, arguments.genuine.names),
            workers=arguments.workers,
            timeout_s=arguments.timeout_s,
            executor=arguments.executor,
        )

    def accept(self, arguments: Arguments) -> Arguments:
        """Return what is given, its samples checked.

        Refuse samples that a stored run did not begin with, and another simulator.
        """
        if arguments.simulate is not None:
            self._refuse_other_simulator(arguments.simulate)
        # Samples that were checked when the run began need no second check
        if arguments.genuine is None or isinstance(arguments.genuine, Genuine):
            return arguments
        genuine = observed(arguments.genuine)
        held_out = np.array(self.held_out, dtype=np.int64)
        noun = "a live source" if self.live else "an array of samples"
        rule = f"be {noun}, as when the run began"
        require(callable(genuine) == self.live, "genuine", rule, f"a {type(genuine).__name__}")
        if self.live:
            nothing = np.zeros((1, self.steps, len(self.signals)))
            data = Genuine(nothing, held_out, genuine, names=table_names(self.signals))
            return replace(arguments, genuine=data)
        steps = np.shape(getattr(genuine, "learning", ()))[1:2]
        if steps:
            rule = f"be windows of {self.steps} steps, as when the run began"
            require(steps[0] == self.steps, "genuine", rule, steps[0], "Cut them as then.")
        columns = getattr(arguments.simulate, "columns", ())
        names = names_of(genuine, columns)
        # The run has fixed the order, unless its signals were given other names.
        if not columns and {*self.signals} <= {*names}:
            names = self.signals
        samples = cut_samples(genuine, self.steps, names)
        data = recorded_samples(genuine, samples, held_out, names)
        rule = f"be the samples that the run began with, of SHA-256 {self.digest[:12]}..."
        got = f"others, {data.digest[:12]}..."
        remedy = "Give the same, or start a new run."
        same = data.digest == self.digest
        # Another processor computes other last digits of the same recordings.
        if not same and self.origin and isinstance(genuine, Windows):
            same = origin_of(genuine) == self.origin
        require(same, "genuine", rule, got, remedy)
        return replace(arguments, genuine=data)

    def _refuse_other_simulator(self, simulate: Any) -> None:
        """Refuse a simulator that says itself that it simulates another system, as a family of models can."""

        def check(fits: bool, rule: str, got: str, remedy: str) -> None:
            require(fits, "simulate", rule, got, remedy)

        parameters = getattr(simulate, "parameters", None)
        if isinstance(parameters, Mapping | tuple):
            fits = tuple(parameters) == self.parameter_names
            rule = f"have the parameters of the run, {', '.join(self.parameters)}, in this order"
            remedy = "Give the simulator that the run has, or its parameters."
            check(fits, rule, ", ".join(map(str, parameters)), remedy)
        signals = getattr(simulate, "signals", None)
        if isinstance(signals, tuple) and {*signals, *self.signals} <= set(SIGNALS):
            rule = f"have the signals of the samples, {', '.join(self.signals)}, in this order"
            remedy = f"Give the family of models signals={self.signals}."
            check(signals == self.signals, rule, ", ".join(signals), remedy)
        self._refuse_other_headings(simulate)
        interval = getattr(simulate, "interval_s", None)
        if self.interval_s and isinstance(interval, float | int):
            fits = same_time_step(interval, self.interval_s)
            rule = f"have the time step of the samples, {self.interval_s:.6g} s"
            remedy = f"Give the family of models interval_s={self.interval_s:.6g}, or samples at its rate."
            check(fits, rule, f"{interval:.6g} s", remedy)
        steps = getattr(simulate, "steps", None)
        if isinstance(steps, int):
            rule = f"have as many steps as the samples, {self.steps}"
            remedy = f"Give the family of models steps={self.steps}."
            check(steps == self.steps, rule, str(steps), remedy)

    def _refuse_other_headings(self, simulate: Any) -> None:
        """Refuse a simulator whose speeds have signs where those of the samples have none, or the reverse."""
        name = type(simulate).__name__
        simulated = headings_of(simulate)
        if self.headings == "without" and simulated == "with":
            rule = "have no headings, as the samples have none"
            got = f"{name}, whose speeds are negative backwards"
            remedy = "Give another family of models, or windows of a recording with headings."
            refuse("simulate", rule, got, remedy)
        if self.headings == "with" and simulated == "without":
            rule = "have headings, as the samples do"
            got = f"{name}, whose speeds are never negative"
            remedy = "Give a family of models with headings, or measure the samples without: "
            remedy += "dataclasses.replace(recording, headings=None).windows(...)."
            refuse("simulate", rule, got, remedy)


def headings_of(measured: Any) -> Literal["", "with", "without"]:
    """Return whether samples or a simulator say that they are measured with headings."""
    headings = getattr(measured, "headings", None)
    if not isinstance(headings, bool):
        return ""
    return "with" if headings else "without"


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


class CustomSource(FallibleSource):
    """Genuine samples from a recording or a live source, and counterfeit ones from any simulator.

    A simulation fails if the simulator raises, takes too long, or returns the wrong shape, or a
    number masked or not finite. If a call with several models fails, each of its models is
    simulated again alone, so that only those that fail alone have failed. In generation 0 an
    exception or a wrong shape ends the run. Later a failed model has samples of zeros and is marked
    in `failed`. If more than half of the models of a generation fail, the run ends.

    Parameters
    ----------
    system
        What is known of it.
    genuine
        Its samples.
    simulate
        The simulator; see `CustomSystem.batches` for how many models it takes at once.
    workers
        Number of worker processes; None calls the simulator in this process. The samples do not
        depend on it.
    timeout_s
        Longest duration of a call (s), with workers only; None for no limit.
    executor
        What calls the simulator instead of workers, any `concurrent.futures.Executor`; it is left
        open. The samples do not depend on it.
    """

    system: CustomSystem
    genuine: Genuine
    _workers: Workers | None

    def __init__(
        self,
        system: CustomSystem,
        genuine: Genuine,
        simulate: Simulator,
        *,
        workers: int | None = None,
        timeout_s: float | None = None,
        executor: Executor | None = None,
    ) -> None:
        super().__init__(system)
        self.genuine = genuine
        self._learning = system.centered(genuine.learning)
        self.cheap = getattr(simulate, "cheap", False)
        rule = "be a function of (parameters, rng)"
        require(callable(simulate), "simulate", rule, type(simulate).__name__)
        self._simulate = simulate
        shape = (system.steps, len(system.signals))
        self._answer = partial(answer, simulate, system.vectorized, shape, names=genuine.names)
        self._worker_count = workers
        self._timeout_s = timeout_s
        self._workers = None
        self._executor = executor
        if executor is not None:
            rule = "be left out beside an executor, which has its own"
            require(workers is None, "workers", rule, workers)
        if workers is None:
            rule = "be given together with `workers`, as only a process can be ended"
            require(timeout_s is None, "timeout_s", rule, timeout_s)
            return
        integer("workers", workers, 1)
        if timeout_s is not None:
            number("timeout_s", timeout_s, above=0)
        _refuse_notebook(simulate)
        try:
            self._function = packed(self._answer)
        except Exception as error:
            # Pickle raises what the object's own methods raise
            rule = "be a function that another process can import"
            refuse("simulate", rule, f"{simulate!r} ({error})", _REMEDY)

    @property
    def recorded(self) -> np.ndarray | None:
        """All genuine samples (K, T, D) to learn from, as classifiers see them; or None."""
        return None if self.system.live else self._learning

    @property
    def independent(self) -> np.ndarray | None:
        """The same and those held out; None of windows of one recording."""
        if self.system.live or self.system.interval_s > 0:
            return None
        return self.system.centered(self.genuine.samples)

    @property
    def callers(self) -> int | None:
        """How many calls are made at once; None if nobody says it."""
        return self._worker_count if self._executor is None else workers_of(self._executor)

    def close(self) -> None:
        """End the worker processes, if there are any, at once."""
        workers = self._workers
        self._workers = None
        if workers is not None:
            workers.kill()
            workers.close()

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (K, T, D), and counterfeit ones (M, C, T, D) of models (M, P) as the optimizer has them.

        A CustomSystemError ends the run: simulations fail in such a way, or a live source yields no
        proper samples.
        """
        genuine = self._observed(len(models), rng)
        return Samples(genuine, self.system.centered(self.simulated(self.to_units(models), rng)))

    def simulated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (M, C, T, D) of models with parameters (M, P), both in their users' units.

        Those of failed models are zeros, and marked in `failed`.
        """
        # C is that of the first proper answer
        samples: np.ndarray | None = None
        reasons: dict[int, str] = {}
        for models, answered in self._answers(parameters, rng):
            if samples is not None and not isinstance(answered, Failed):
                answered = _of_as_many(answered, samples.shape[1])
            if isinstance(answered, Failed):
                if self.generation == 0:
                    self._refuse(answered, parameters[models])
                reasons |= dict.fromkeys(models.tolist(), answered.reason)
            else:
                if samples is None:
                    samples = np.zeros((len(parameters), *answered.shape[1:]))
                samples[models] = answered
                for k in np.flatnonzero(~np.isfinite(answered).all(axis=(1, 2, 3))):
                    reasons[int(models[k])] = self._not_finite(answered[k])
                    samples[models[k]] = 0
            if 2 * len(reasons) > len(parameters) and not self._probing:
                break
        self.note(parameters, reasons)
        # All have failed, of models that nobody has inferred
        if samples is None:
            samples = np.zeros((len(parameters), 1, self.system.steps, len(self.system.signals)))
        return samples

    def _not_finite(self, samples: np.ndarray) -> str:
        """Return the reason why a model with samples (C, T, D) has failed: its first value that is not finite."""
        c, t, d = np.argwhere(~np.isfinite(samples))[0].tolist()
        where = f"[step {t}, signal {self.system.signals[d]}]"
        return f"it returned {value_text(samples[c, t, d])} {where}"

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, C, T, D) of models with parameters (M, P).

        After a run, without those that fail.
        """
        samples = self.simulated(parameters, rng)
        return samples[~self.failed]

    def positions(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return where recorded individuals are, and replicas of the model with these parameters (P,).

        See `Source.positions`. Simulators can say it that have a method `simulate`, as families of
        models do; a dataclass with `steps` simulates as many as are recorded.
        """
        group: Any = getattr(self._simulate, "groups", (self._simulate,))[0]
        if self.system.interval_s <= 0 or not callable(getattr(group, "simulate", None)):
            return {}
        recorded = self.genuine.excerpt
        frames = REPLAY_FRAMES if recorded is None else len(recorded)
        if is_dataclass(group) and not isinstance(group, type) and hasattr(group, "steps"):
            group = replace(group, steps=max(1, frames - 2))
        try:
            moved = np.asarray(group.simulate(parameters[None], rng), dtype=np.float64)[0]
        except Exception as error:
            _LOGGER.warning("The report shows no replay: %s", error)
            return {}
        if moved.ndim != 3 or moved.shape[2] != 2 or not np.isfinite(moved).all():
            return {}
        positions = {"replicas": moved, "interval_s": np.array(self.system.interval_s)}
        if recorded is not None:
            frames = min(len(moved), len(recorded))
            positions["replicas"] = moved[:frames]
            positions["recorded"] = recorded[:frames]
        if getattr(group, "tank_cm", None) is not None:
            positions["tank"] = np.asarray(group.tank_cm, dtype=np.float64)
        return positions

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return the genuine samples (K, T, D) for learning.

        Of a live source `count` or more new ones.
        """
        live = self.genuine.live
        if live is None:
            return self.genuine.learning
        observations: list[np.ndarray] = []
        while sum(map(len, observations)) < count:
            samples = cut_samples(live(rng), self.system.steps, self.genuine.names)
            observations.append(samples)
        return np.concatenate(observations)

    def _observed(self, models: int, rng: np.random.Generator) -> np.ndarray:
        """Return centered genuine samples of a generation with so many models."""
        live = self.genuine.live
        if live is None:
            count = self.system.samples_per_generation or models
            if count >= len(self._learning):
                return self._learning
            return self._learning[rng.choice(len(self._learning), count, replace=False)]
        where = f"[live source, generation {self.generation}]"
        try:
            samples = cut_samples(live(rng), self.system.steps, self.genuine.names)
        except Exception as error:
            raise CustomSystemError(f"{error} {where}") from error
        signals = len(self.system.signals)
        if samples.shape[2] != signals:
            rule = f"yield {signals} signals as in the beginning; got {samples.shape[2]}"
            raise CustomSystemError(f"`genuine` must {rule} {where}.")
        return self.system.centered(samples)

    def _answers(
        self, parameters: np.ndarray, rng: np.random.Generator
    ) -> Iterator[tuple[np.ndarray, Answer]]:
        """Yield what the simulator says of which models: of groups, and of each model of a group that failed.

        It is called here, or in worker processes, which are started on the first call and stay. The
        answers come in the order of the calls, and do not depend on the number of workers.
        """
        count = self.system.batches or len(parameters)
        groups = [
            group for group in np.array_split(np.arange(len(parameters)), count) if len(group)
        ]
        generators = rng.spawn(len(groups))
        # Models of groups that failed, to be simulated again alone.
        alone: list[np.ndarray] = []
        new_generators: list[np.random.Generator] = []
        answers = self._called(parameters, groups, generators)
        for group, generator, answered in zip(groups, generators, answers, strict=True):
            if not isinstance(answered, Failed) or len(group) == 1:
                yield group, answered
                continue
            if self.generation == 0 and answered.misshapen:
                self._refuse(answered, parameters[group])
            alone += [np.array([k]) for k in group]
            new_generators += _untouched(generator).spawn(len(group))
        yield from zip(alone, self._called(parameters, alone, new_generators), strict=True)
        if alone and self.generation == 0:
            raise CustomSystemError(
                "`simulate` must return samples of several models at once; it failed for a group of"
                " models, and for none of them alone [generation 0]. Repair it, or set"
                " vectorized=False for a function of one model's parameters (P,)."
            )

    def _called(
        self,
        parameters: np.ndarray,
        groups: list[np.ndarray],
        generators: list[np.random.Generator],
    ) -> Iterator[Answer]:
        """Yield the answer for each group of models, here or from workers."""
        calls = []
        for group, generator in zip(groups, generators, strict=True):
            calls.append((parameters[group], generator))
        if self._executor is not None:
            yield from answers_by(self._executor, self._answer, calls)
            return
        if self._worker_count is None:
            yield from starmap(self._answer, calls)
            return
        if self._workers is None:
            # a worker that is lost costs nothing: its call is made again
            self._workers = Workers(
                self._function, self._worker_count, timeout_s=self._timeout_s, attempts=2
            )
        for future in self._workers.in_order(calls):
            try:
                yield future.result()
            except TimeoutError as error:
                yield Failed(str(error))
            except WorkerDied:
                yield Failed("its worker process died")
            except NotImportable as error:
                rule = "`simulate` must be importable by a worker process"
                raise CustomSystemError(f"{rule}; got {error}. {_REMEDY}") from None

    def _refuse(self, failed: Failed, parameters: np.ndarray) -> NoReturn:
        """Raise what says why models (m, P) of the first generation have failed."""
        if failed.complete:
            raise CustomSystemError(failed.reason)
        rule = "`simulate` must return samples of every model"
        remedy = "Repair it, return NaN for a model that has none, or narrow the bounds of the parameters"
        if self.system.vectorized:
            remedy += "; for a function of one model's parameters (P,) set vectorized=False"
        models = self.system.shown(parameters[0])
        if len(parameters) > 1:
            models += f" and {len(parameters) - 1} more"
        got = f"{failed.reason} [generation 0, {models}]"
        hint = self._whole_numbers(failed.reason, parameters[0])
        raise CustomSystemError(f"{rule}; {got}. {remedy}.{hint}")

    def _whole_numbers(self, reason: str, model: np.ndarray) -> str:
        """Return how to say that parameters are whole numbers, where a reason names values of a model (P,)."""
        ranges = []
        for (name, parameter), value in zip(
            self.system.parameters.items(), model.tolist(), strict=True
        ):
            bounded = parameter.low is not None and parameter.high is not None
            if bounded and not parameter.integer and value_of_parameter(value) in reason:
                ranges.append(f"{name}={parameter.low:g}:{parameter.high:g}:integer")
        if not ranges:
            return ""
        option = " ".join(f"--range {text}" for text in ranges)
        return f" If it takes a whole number: {option}, or in Python Parameter(..., integer=True)."


def _of_as_many(samples: np.ndarray, count: int) -> Answer:
    """Return samples (m, C, T, D) if C is the count of other models, else why they count as failed."""
    if samples.shape[1] == count:
        return samples
    return Failed(f"it returned {samples.shape[1]} samples of a model, and {count} of others")


def _refuse_notebook(simulate: Any) -> None:
    """Refuse a function that a notebook or a prompt defines, which no other process can import."""
    function = getattr(simulate, "function", simulate)
    main = sys.modules.get("__main__")
    in_notebook = getattr(function, "__module__", None) == "__main__" and not hasattr(
        main, "__file__"
    )
    name = getattr(function, "__name__", type(function).__name__)
    rule = "be a function that another process can import"
    remedy = "Write it to a file beside the notebook, as simulator.py, and import it; "
    remedy += "or leave `workers` out."
    require(not in_notebook, "simulate", rule, f"{name} of a notebook", remedy)


def _untouched(rng: np.random.Generator) -> np.random.Generator:
    """Return a generator as it was before a simulator had it.

    The simulator may have spawned from it, or from a copy in a worker.
    """
    origin = rng.bit_generator.seed_seq
    # What it was spawned from has one
    assert isinstance(origin, np.random.SeedSequence)
    seeds = np.random.SeedSequence(
        origin.entropy, spawn_key=origin.spawn_key, pool_size=origin.pool_size
    )
    return np.random.Generator(type(rng.bit_generator)(seeds))
