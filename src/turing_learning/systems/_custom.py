"""A custom system as frozen data, and its samples: genuine ones, and those of models from any simulator."""

import logging
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass, replace
from functools import partial
from itertools import starmap
from typing import Any, Literal, NoReturn

import numpy as np

from turing_learning.models import LARGEST_DECADE, Settings

from ..coevolution import Classifier, Samples
from ..errors import Setting, Text, brief, integer, number, refuse, require
from ..models import Behavior, Jumps, Parameter
from ..trajectories import SIGNALS
from ..workers import NotImportable, WorkerDied, Workers, packed
from ._calls import Answer, Failed, Simulator, answer
from ._genuine import Genuine, cut_samples, observed, shown
from ._system import CustomSystemError, FallibleSource, Given, Source, System

_LOGGER = logging.getLogger("turing_learning")
MOST = 10**9  # samples, steps or calls
SHOWN = 601  # frames of replicas alone, where there is no recording
TIME_STEP_TOLERANCE = 0.01  # share by which time steps may differ that count as the same
_HERE = "Define it at the top level of a module, or leave `workers` out."
_NAME = re.compile(r"[A-Za-z0-9_-]{1,60}")


def same_time_step(one_s: float, other_s: float) -> bool:
    """Return whether two time steps (s), the second above 0, count as the same."""
    return abs(one_s / other_s - 1) <= TIME_STEP_TOLERANCE


@dataclass(frozen=True)
class CustomSystem(System, Settings):
    """A system that was observed, and how models of it are simulated; what is not described here: see `System`."""

    name: str  #: Of 1 to 60 letters, digits, _ and -
    title: str
    parameters: dict[
        str, Parameter
    ]  #: In the order of the simulator's columns; P >= 1, with names like `name`
    signals: tuple[str, ...]
    steps: int
    #: (D,): The classifiers see (signal - center) / input_scale: here the median of the genuine
    #: data
    center: tuple[float, ...]
    input_scale: tuple[
        float, ...
    ]  #: (D,): 99th percentile of the distance from the median; see `read_genuine`
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

    kind = "one on a custom system"
    jumps, saturation = Jumps(), ()
    step_unit = ", in halves of its initial range"

    def __post_init__(self) -> None:
        rule = "be of 1 to 60 letters, digits, _ and -"
        require(_NAME.fullmatch(self.name), "name", rule, brief(self.name))
        require(self.parameters, "parameters", "name one parameter or more", brief(self.parameters))
        rule = "have names of 1 to 60 letters, digits, _ and -"
        for name in self.parameters:
            require(
                _NAME.fullmatch(name),
                "parameters",
                rule,
                brief(name),
                "Give the unit to `Parameter`.",
            )
        rule, given = "be as many names as the data has signals, one or more", len(self.signals)
        fits = given == len(self.center) == len(self.input_scale) > 0
        require(fits, "signals", rule, f"{given} names of {len(self.center)} signals")
        different = len(set(self.signals)) == len(self.signals)
        require(different, "signals", "have different names", ", ".join(self.signals))
        least = {
            "steps": 1,
            "samples": 0,
            "samples_per_generation": 0,
            "batches": 0,
            "smooth_frames": 1,
        }
        for name, lowest in least.items():
            if integer(name, getattr(self, name), lowest) > MOST:
                refuse(name, f"be at most {MOST}", getattr(self, name))
        require(self.interval_s >= 0, "interval_s", "be at least 0", self.interval_s)
        known = self.headings in ("", "with", "without")
        require(known, "headings", 'be "with", "without" or empty', brief(self.headings))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the model parameters."""
        return tuple(self.parameters)

    @property
    def signal_units(self) -> Mapping[str, str]:
        """Units of its signals by name, where they are known: of a recording, whose signals this library measures."""
        return SIGNALS if self.interval_s > 0 and not self.stimulated else {}

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
        rule, got = (
            "be 2 samples or more to learn from, with a budget in trials",
            f"{count} of {self.steps} steps",
        )
        remedy = (
            "Cut it into several that are shorter, or give ",
            Setting("generations"),
            " instead of trials.",
        )
        require(self.live or count > 1, "genuine", rule, got, remedy)

    def centered(self, samples: np.ndarray) -> np.ndarray:
        """Return samples (..., T, D) as the classifiers see them before their inputs are divided by the scale."""
        return samples - np.asarray(self.center)

    def classifier(self, network: Classifier) -> "CenteredClassifier":
        return CenteredClassifier(network, self)

    def on_scales(
        self, models: np.ndarray, summarize: Callable[[np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """Return a summary of models (..., P), parameter by parameter: in decades on a logarithmic scale, and within its bounds."""
        found = []
        for place, parameter in enumerate(self.parameters.values()):
            values = models[..., place, None]
            if parameter.scale == "log":
                summary = 10.0 ** np.clip(
                    summarize(np.log10(values)), -LARGEST_DECADE, LARGEST_DECADE
                )
            else:
                summary = summarize(values)
            found.append(np.clip(summary, parameter.low, parameter.high))
        return np.concatenate(found)

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        return ("Infer again as before, with ", Setting("run.history", "full"), ".")

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models.

        No settings of a swarm add to them.
        """
        samples = float(models + (self.samples_per_generation or models))
        return samples, 16.0 * models * self.steps * len(self.signals), ()

    def open(self, given: Given) -> Source:
        given = self.accept(given)
        self.require_all(given)
        return CustomSource(
            self, given.genuine, given.simulate, workers=given.workers, timeout_s=given.timeout_s
        )

    def accept(self, given: Given) -> Given:
        """Return what is given, its samples checked.

        Refuse samples that a stored run did not begin with, and another simulator.
        """
        if given.simulate is not None:
            self._refuse_other_simulator(given.simulate)
        if given.genuine is None or isinstance(given.genuine, Genuine):
            return given
        genuine, held_out = observed(given.genuine), np.array(self.held_out, dtype=np.int64)
        rule = (
            f"be {'a live source' if self.live else 'an array of samples'}, as when the run began"
        )
        require(callable(genuine) == self.live, "genuine", rule, f"a {type(genuine).__name__}")
        if self.live:
            data = Genuine(np.zeros((1, self.steps, len(self.signals))), held_out, genuine)
            return replace(given, genuine=data)
        steps = np.shape(getattr(genuine, "learning", ()))[1:2]
        rule, remedy = (
            f"be windows of {self.steps} steps, as when the run began",
            "Cut them as then.",
        )
        require(not steps or steps[0] == self.steps, "genuine", rule, steps and steps[0], remedy)
        data = Genuine(
            cut_samples(genuine, self.steps), held_out, excerpt=getattr(genuine, "excerpt", None)
        )
        rule = f"be the samples that the run began with, of SHA-256 {self.digest[:12]}..."
        others, remedy = f"others, {data.digest[:12]}...", "Give the same, or start a new run."
        require(data.digest == self.digest, "genuine", rule, others, remedy)
        return replace(given, genuine=data)

    def _refuse_other_simulator(self, simulate: Any) -> None:
        """Refuse a simulator that says itself that it simulates another system, as a family of models can."""
        asked = ("parameters", "signals", "interval_s", "steps")
        parameters, signals, interval, steps = (getattr(simulate, name, None) for name in asked)
        name, known, headings = (
            type(simulate).__name__,
            self.interval_s,
            (self.headings, headings_of(simulate)),
        )
        if isinstance(parameters, Mapping) and tuple(parameters) != self.parameter_names:
            rule = f"have the parameters of the run, {', '.join(self.parameters)}, in this order"
            got, remedy = (
                ", ".join(map(str, parameters)),
                "Give the simulator that the run has, or its parameters.",
            )
        elif (
            isinstance(signals, tuple)
            and signals != self.signals
            and {*signals, *self.signals} <= set(SIGNALS)
        ):
            rule = f"have the signals of the samples, {', '.join(self.signals)}, in this order"
            got, remedy = ", ".join(signals), f"Give the family of models signals={self.signals}."
        elif headings == ("without", "with"):
            rule, got = (
                "have no headings, as the samples have none",
                f"{name}, whose speeds are negative backwards",
            )
            remedy = "Give another family of models, or windows of a recording with headings."
        elif headings == ("with", "without"):
            rule, got = (
                "have headings, as the samples do",
                f"{name}, whose speeds are never negative",
            )
            remedy = "Give a family of models with headings, or measure the samples without: "
            remedy += "dataclasses.replace(recording, headings=None).windows(...)."
        elif known and isinstance(interval, float | int) and not same_time_step(interval, known):
            rule, got = f"have the time step of the samples, {known:.6g} s", f"{interval:.6g} s"
            remedy = f"Give the family of models interval_s={known:.6g}, or samples at its rate."
        elif isinstance(steps, int) and steps != self.steps:
            rule, got = f"have as many steps as the samples, {self.steps}", str(steps)
            remedy = f"Give the family of models steps={self.steps}."
        else:
            return
        refuse("simulate", rule, got, remedy)


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
    """

    system: CustomSystem
    genuine: Genuine
    _workers: Workers | None

    def __init__(
        self, system: CustomSystem, genuine: Genuine, simulate: Simulator, *, workers: int | None = None,
        timeout_s: float | None = None,
    ) -> None:  # fmt: skip
        super().__init__(system)
        self.genuine, self._live, self._learning = (
            genuine,
            genuine.live,
            system.centered(genuine.learning),
        )
        require(
            callable(simulate),
            "simulate",
            "be a function of (parameters, rng)",
            type(simulate).__name__,
        )
        self._simulate, shape = simulate, (system.steps, len(system.signals))
        self._answer = partial(answer, simulate, system.vectorized, shape)
        self._count, self._timeout_s, self._workers = workers, timeout_s, None
        if workers is None:
            rule = "be given together with `workers`, as only a process can be ended"
            require(timeout_s is None, "timeout_s", rule, timeout_s)
            return
        integer("workers", workers, 1)
        if timeout_s is not None:
            number("timeout_s", timeout_s, above=0)
        try:
            self._function = packed(self._answer)
        except Exception as error:  # pickle raises what the object's own methods raise
            refuse(
                "simulate",
                "be a function that another process can import",
                f"{simulate!r} ({error})",
                _HERE,
            )

    def close(self) -> None:
        """End the worker processes, if there are any, at once."""
        workers, self._workers = self._workers, None
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
        """Return samples (M, C, T, D) of models with parameters (M, P), both in their users' units; `failed` marks zeros."""
        samples: np.ndarray | None = None  # C is that of the first proper answer
        reasons: dict[int, str] = {}
        for places, found in self._answers(parameters, rng):
            if (
                not isinstance(found, Failed)
                and samples is not None
                and found.shape[1] != samples.shape[1]
            ):
                found = Failed(
                    f"it returned {found.shape[1]} samples of a model, and {samples.shape[1]} of others"
                )
            if isinstance(found, Failed):
                if self.generation == 0:
                    self._refuse(found, self.system.shown(parameters[places[0]]))
                reasons |= dict.fromkeys(places.tolist(), found.reason)
            else:
                samples = (
                    np.zeros((len(parameters), *found.shape[1:])) if samples is None else samples
                )
                samples[places] = found
                for k in np.flatnonzero(~np.isfinite(found).all(axis=(1, 2, 3))):
                    c, t, d = (int(place) for place in np.argwhere(~np.isfinite(found[k]))[0])
                    got = f"{shown(found[k, c, t, d])} [step {t}, signal {self.system.signals[d]}]"
                    reasons[int(places[k])] = f"it returned {got}"
                    samples[places[k]] = 0
            if 2 * len(reasons) > len(parameters):
                break
        self.note(parameters, reasons)
        assert samples is not None  # more than half of the models would have failed
        return samples

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, C, T, D) of models with parameters (M, P).

        After a run, without those that fail.
        """
        samples = self.simulated(parameters, rng)
        return samples[~self.failed]

    def positions(self, parameters: np.ndarray, rng: np.random.Generator) -> dict[str, np.ndarray]:
        """Return where recorded individuals are, and replicas of the model with these parameters (P,), see `Source.positions`.

        Simulators know it that have a method `simulate`, as families of models do; a dataclass with
        `steps` simulates as many as are recorded.
        """
        group: Any = getattr(self._simulate, "groups", (self._simulate,))[0]
        if self.system.interval_s <= 0 or not callable(getattr(group, "simulate", None)):
            return {}
        recorded = self.genuine.excerpt
        frames = SHOWN if recorded is None else len(recorded)
        if is_dataclass(group) and not isinstance(group, type) and hasattr(group, "steps"):
            group = replace(group, steps=max(1, frames - 2))
        try:
            moved = np.asarray(group.simulate(parameters[None], rng), dtype=np.float64)[0]
        except Exception as error:
            _LOGGER.warning("The report shows no replay: %s", error)
            return {}
        if moved.ndim != 3 or moved.shape[2] != 2 or not np.isfinite(moved).all():
            return {}
        found = {"replicas": moved, "interval_s": np.array(self.system.interval_s)}
        if recorded is not None:
            shown = min(len(moved), len(recorded))
            found |= {"replicas": moved[:shown], "recorded": recorded[:shown]}
        if getattr(group, "tank_cm", None) is not None:
            found["tank"] = np.asarray(group.tank_cm, dtype=np.float64)
        return found

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return the genuine samples (K, T, D) for learning.

        Of a live source `count` or more new ones.
        """
        if self._live is None:
            return self.genuine.learning
        parts: list[np.ndarray] = []
        while sum(map(len, parts)) < count:
            parts.append(cut_samples(self._live(rng), self.system.steps))
        return np.concatenate(parts)

    def _observed(self, models: int, rng: np.random.Generator) -> np.ndarray:
        if self._live is None:
            count = self.system.samples_per_generation or models
            if count >= len(self._learning):
                return self._learning
            return self._learning[rng.choice(len(self._learning), count, replace=False)]
        try:
            samples = cut_samples(self._live(rng), self.system.steps)
        except Exception as error:
            raise CustomSystemError(
                f"{error} [live source, generation {self.generation}]"
            ) from error
        if samples.shape[2] != len(self.system.signals):
            rule = f"yield {len(self.system.signals)} signals as in the beginning; got {samples.shape[2]}"
            raise CustomSystemError(
                f"`genuine` must {rule} [live source, generation {self.generation}]."
            )
        return self.system.centered(samples)

    def _answers(
        self, parameters: np.ndarray, rng: np.random.Generator
    ) -> Iterator[tuple[np.ndarray, Answer]]:
        """Yield what the simulator says of which models: of groups, and of each model of a group that failed.

        It is called here, or in worker processes, which are started on the first call and stay. The
        answers come in the order of the calls, and do not depend on the number of workers.
        """

        def asked(
            groups: list[np.ndarray], generators: list[np.random.Generator]
        ) -> Iterator[Answer]:
            calls = [(parameters[k], rng) for k, rng in zip(groups, generators, strict=True)]
            if self._count is None:
                yield from starmap(self._answer, calls)
                return
            if self._workers is None:
                self._workers = Workers(self._function, self._count, timeout_s=self._timeout_s)
            for future in self._workers.in_order(calls):
                try:
                    yield future.result()
                except TimeoutError as error:
                    yield Failed(str(error))
                except WorkerDied:
                    yield Failed("its worker process died")
                except NotImportable as error:
                    rule = "be importable by a worker process"
                    raise CustomSystemError(
                        f"`simulate` must {rule}; got {error}. {_HERE}"
                    ) from error

        count = self.system.batches or len(parameters)
        groups = [part for part in np.array_split(np.arange(len(parameters)), count) if len(part)]
        generators = rng.spawn(len(groups))
        singles: list[np.ndarray] = []
        again: list[np.random.Generator] = []
        for group, generator, found in zip(
            groups, generators, asked(groups, generators), strict=True
        ):
            if not isinstance(found, Failed) or len(group) == 1:
                yield group, found
                continue
            if self.generation == 0 and found.misshapen:
                self._refuse(
                    found, f"{self.system.shown(parameters[group[0]])} and {len(group) - 1} more"
                )
            singles += [np.array([k]) for k in group]
            again += _untouched(generator).spawn(len(group))
        yield from zip(singles, asked(singles, again), strict=True)
        if singles and self.generation == 0:
            raise CustomSystemError(
                "`simulate` must return samples of several models at once; it failed for a group of models, and for none of "
                "them alone [generation 0]. Repair it, or set vectorized=False for a function of one model's parameters (P,)."
            )

    def _refuse(self, failed: Failed, models: str) -> NoReturn:
        advice = (
            "; for a function of one model's parameters (P,) set vectorized=False"
            * self.system.vectorized
        )
        raise CustomSystemError(
            f"`simulate` must return samples of every model; {failed.reason} [generation 0, {models}]. Repair it, or narrow "
            f"the bounds of the parameters{advice}."
        )


def _untouched(rng: np.random.Generator) -> np.random.Generator:
    """Return a generator as it was before a simulator had it, which may have spawned from it, or from a copy in a worker."""
    given = rng.bit_generator.seed_seq
    assert isinstance(given, np.random.SeedSequence)  # what it was spawned from has one
    seeds = np.random.SeedSequence(
        given.entropy, spawn_key=given.spawn_key, pool_size=given.pool_size
    )
    return np.random.Generator(type(rng.bit_generator)(seeds))
