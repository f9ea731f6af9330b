"""Samples of a custom system, and of models of it from any simulator."""

import logging
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..coevolution import Classifier, Judgments, PassiveInterrogation, Samples
from ..errors import integer, number, require
from ._calls import Answer, Call, Failed, InProcess, InWorkers, Runner, Simulator
from ._custom import CustomSystem
from ._genuine import Genuine, cut_samples, shown
from ._system import CustomSystemError, FailureLog, Source

_LOGGER = logging.getLogger("turing_learning")


class CustomSource(Source):
    """Genuine samples from a recording or a live source, and counterfeit ones from any simulator.

    A simulation fails if the simulator raises, takes too long, or returns the wrong shape, or a number masked or not finite.
    If a call with several models fails, each of its models is simulated again alone, so that only those that fail alone
    have failed. In generation 0 an exception or a wrong shape ends the run. Later a failed model has samples of zeros and
    is marked in `failed`. If more than half of the models of a generation fail, the run ends.

    Parameters
    ----------
    system
        What is known of it.
    genuine
        Its samples.
    simulate
        The simulator; see `CustomSystem.batches` for how many models it takes at once.
    workers
        Number of worker processes; None calls the simulator in this process. The samples do not depend on it.
    timeout_s
        Longest duration of a call (s), with workers only; None for no limit.

    Attributes
    ----------
    system, genuine
        As given.
    generation
        Number of the generation that is collected next; whoever runs the generations keeps it. None for simulations after a
        run, as in a check: there models fail as in later generations, and no message speaks of generations and bounds.
    failed : (M,) bool
        Which simulations of the last generation failed.
    failures
        All failures.
    """

    def __init__(
        self,
        system: CustomSystem,
        genuine: Genuine,
        simulate: Simulator,
        *,
        workers: int | None = None,
        timeout_s: float | None = None,
    ) -> None:
        self.system = system
        self.genuine: Genuine = genuine
        self.generation: int | None = 0
        self.failed = np.zeros(0, dtype=bool)
        self.failures: FailureLog = FailureLog(system.parameter_names)
        self._live = genuine.live
        self._learning = system.centered(genuine.learning)
        self._runner = _runner(simulate, system.vectorized, workers, timeout_s)

    def close(self) -> None:
        """End the worker processes, if there are any."""
        self._runner.close()

    def interrogation(self, classifier: Classifier) -> "GuardedInterrogation":
        """Return what lets classifiers judge its samples, and reject models whose simulation failed."""
        return GuardedInterrogation(self, classifier)

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P) in their users' units of models (M, P) as the optimizer has them."""
        return self.system.to_units(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (K, T, D), and counterfeit samples (M, C, T, D) of models (M, P) as the optimizer has them.

        Raises
        ------
        CustomSystemError
            If simulations fail in a way that ends the run, or a live source yields no proper samples.
        """
        parameters = self.system.to_units(models)
        genuine = self._observed(len(models), rng)
        return Samples(genuine=genuine, counterfeit=self.system.centered(self.simulated(parameters, rng)))

    def simulated(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (M, C, T, D) of models with parameters (M, P), both in their users' units; `failed` marks zeros.

        Raises
        ------
        CustomSystemError
            If simulations fail in a way that ends the run.
        """
        found = _Simulated(self.system, parameters, self.generation)
        for places, answer in self._answers(parameters, rng):
            found.take(places, answer)
        self.failed = found.failed
        self._note(found)
        return found.samples()

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, C, T, D) of models with parameters (M, P); after a run, without those that fail."""
        samples = self.simulated(parameters, rng)
        return samples[~self.failed]

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return the genuine samples (K, T, D) for learning; of a live source `count` or more new ones."""
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
            raise CustomSystemError(f"{error} [live source, generation {self.generation}]") from error
        if samples.shape[2] != len(self.system.signals):
            raise CustomSystemError(
                f"`genuine` must yield {len(self.system.signals)} signals as in the beginning; got {samples.shape[2]} "
                f"[live source, generation {self.generation}]."
            )
        return self.system.centered(samples)

    def _answers(self, parameters: np.ndarray, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, Answer]]:
        """Yield what the simulator says of which models: of groups, and of each model of a group that failed."""
        count = self.system.batches or len(parameters)
        groups = [part for part in np.array_split(np.arange(len(parameters)), count) if len(part)]
        generators = rng.spawn(len(groups))
        again: list[tuple[np.ndarray, np.random.Generator]] = []
        for group, generator, found in zip(groups, generators, self._run(parameters, groups, generators), strict=True):
            if isinstance(found, Failed) and len(group) > 1:
                self._refuse_misshapen(found, parameters[group])
                again.append((group, generator))
            else:
                yield group, found
        yield from self._alone(parameters, again)

    def _alone(
        self, parameters: np.ndarray, again: list[tuple[np.ndarray, np.random.Generator]]
    ) -> Iterator[tuple[np.ndarray, Answer]]:
        singles = [np.array([k]) for group, _ in again for k in group]
        generators = [one for group, rng in again for one in _untouched(rng).spawn(len(group))]
        yield from zip(singles, self._run(parameters, singles, generators), strict=True)
        if again and self.generation == 0:
            raise CustomSystemError(
                "`simulate` must return samples of several models at once; it failed for a group of models, and for none of "
                "them alone [generation 0]. Repair it, or set vectorized=False for a function of one model's parameters (P,)."
            )

    def _run(
        self, parameters: np.ndarray, groups: list[np.ndarray], generators: list[np.random.Generator]
    ) -> Iterator[Answer]:
        calls = [Call(parameters[group], rng) for group, rng in zip(groups, generators, strict=True)]
        for group, found in zip(groups, self._runner.run(calls), strict=True):
            yield found if isinstance(found, Failed) else self._shaped(found, len(group))

    def _shaped(self, samples: np.ndarray, count: int) -> Answer:
        """Return samples as (count, C, T, D), or that they are of another shape."""
        steps, signals = self.system.steps, len(self.system.signals)
        if samples.ndim in (3, 4) and samples.size and (len(samples), *samples.shape[-2:]) == (count, steps, signals):
            return samples.reshape(count, -1, steps, signals)
        if self.system.vectorized:
            rule, shape = f"(M, T, D) = ({count}, {steps}, {signals}) or (M, C, T, D)", samples.shape
        else:
            rule, shape = f"(T, D) = ({steps}, {signals}) or (C, T, D)", samples.shape[1:]
        return Failed(f"it returned shape {shape} instead of {rule}", misshapen=True)

    def _refuse_misshapen(self, found: Failed, parameters: np.ndarray) -> None:
        if self.generation == 0 and found.misshapen:
            raise CustomSystemError(
                _refusal(
                    self.system, found.reason, f"{self.system.shown(parameters[0])} and {len(parameters) - 1} more"
                )
            )

    def _note(self, simulated: "_Simulated") -> None:
        if not simulated.failed.any():
            return
        if self.failures.count == 0:
            when = "" if self.generation is None else f" in generation {self.generation}"
            _LOGGER.warning(
                "%d of %d simulations failed%s, the first with %s.",
                np.count_nonzero(simulated.failed), len(simulated.failed), when, simulated.first_failure(),
            )  # fmt: skip
        for k in sorted(simulated.reasons):
            self.failures.add(self.generation, simulated.parameters[k], simulated.reasons[k])


class _Simulated:
    """The samples of one generation, or of one step of a check, as they come in."""

    def __init__(self, system: CustomSystem, parameters: np.ndarray, generation: int | None) -> None:
        self.parameters = parameters
        self.failed = np.zeros(len(parameters), dtype=bool)  # which models have no samples, (M,)
        self.reasons: dict[int, str] = {}
        self._system = system
        self._generation = generation
        self._samples: np.ndarray | None = None  # (M, C, T, D), C being that of the first proper answer

    def take(self, places: np.ndarray, answer: Answer) -> None:
        """Take an answer for the models at `places`; raise CustomSystemError where the run has to end."""
        if not isinstance(answer, Failed) and self._samples is not None and answer.shape[1] != self._samples.shape[1]:
            answer = Failed(f"it returned {answer.shape[1]} samples of a model, and {self._samples.shape[1]} of others")
        if isinstance(answer, Failed):
            if self._generation == 0:
                raise CustomSystemError(
                    _refusal(self._system, answer.reason, self._system.shown(self.parameters[places[0]]))
                )
            self._fail(places, answer.reason)
            return
        if self._samples is None:
            self._samples = np.zeros((len(self.parameters), *answer.shape[1:]))
        if np.isfinite(answer).all():  # as nearly always
            self._samples[places] = answer
            return
        fine = np.isfinite(answer).all(axis=(1, 2, 3))
        self._samples[places[fine]] = answer[fine]
        for k in np.flatnonzero(~fine):
            c, t, d = (int(place) for place in np.argwhere(~np.isfinite(answer[k]))[0])
            self._fail(
                places[k : k + 1],
                f"it returned {shown(answer[k, c, t, d])} [step {t}, signal {self._system.signals[d]}]",
            )

    def samples(self) -> np.ndarray:
        """Return the samples (M, C, T, D), zeros for models that failed."""
        assert self._samples is not None  # more than half of the models would have failed
        return self._samples

    def first_failure(self) -> str:
        """Return the first model that failed, and why."""
        k = min(self.reasons)
        return f"{self._system.shown(self.parameters[k])}: {self.reasons[k]}"

    def _fail(self, places: np.ndarray, reason: str) -> None:
        self.reasons |= dict.fromkeys(places.tolist(), reason)
        self.failed[places] = True
        if 2 * len(self.reasons) > len(self.parameters):
            of, place, remedy = "", "", "Repair the simulator."
            if self._generation is not None:
                of, place = " of a generation", f" [generation {self._generation}]"
                remedy = "Narrow the bounds of the parameters, or repair the simulator."
            raise CustomSystemError(
                f"`simulate` must not fail for more than half of the {len(self.parameters)} models{of}; got "
                f"{len(self.reasons)} failures or more{place}, the first with {self.first_failure()}. {remedy}"
            )


def _untouched(rng: np.random.Generator) -> np.random.Generator:
    """Return a generator as it was before a simulator had it, which may have spawned from it, or from a copy in a worker."""
    given = rng.bit_generator.seed_seq
    assert isinstance(given, np.random.SeedSequence)  # what it was spawned from has one
    seeds = np.random.SeedSequence(given.entropy, spawn_key=given.spawn_key, pool_size=given.pool_size)
    return np.random.Generator(type(rng.bit_generator)(seeds))


def _refusal(system: CustomSystem, reason: str, models: str) -> str:
    advice = "; for a function of one model's parameters (P,) set vectorized=False" if system.vectorized else ""
    return (
        f"`simulate` must return samples of every model; {reason} [generation 0, {models}]. Repair it, or narrow the bounds "
        f"of the parameters{advice}."
    )


def _runner(simulate: Simulator, vectorized: bool, workers: int | None, timeout_s: float | None) -> Runner:
    """Return what executes calls: this process, or workers."""
    require(callable(simulate), "simulate", "be a function of (parameters, rng)", type(simulate).__name__)
    if workers is None:
        rule = "be given together with `workers`, as only a process can be ended"
        require(timeout_s is None, "timeout_s", rule, timeout_s)
        return InProcess(simulate, vectorized=vectorized)
    integer("workers", workers, 1)
    if timeout_s is not None:
        number("timeout_s", timeout_s, above=0)
    return InWorkers(simulate, vectorized=vectorized, workers=workers, timeout_s=timeout_s)


class GuardedInterrogation:
    """A passive interrogation in which no classifier ever judges a model genuine whose simulation failed.

    Its samples stand for nothing; its reward is 0, the worst that there is. All classifiers gain the same by it, so that
    their ranks stay as they are.

    Parameters
    ----------
    source
        Yields the samples, and says which models failed.
    classifier
        Judges them.
    """

    def __init__(self, source: CustomSource, classifier: Classifier) -> None:
        self._source = source
        self._interrogate = PassiveInterrogation(source, classifier)

    def __call__(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:
        """Return the judgments of N classifiers (N, Q), and of B archived ones (B, Q) if given, on M models (M, P)."""
        judgments = self._interrogate(models, classifiers, rng, referees)
        failed = self._source.failed
        if not failed.any():
            return judgments
        outputs, referees_outputs = judgments.counterfeit_outputs, judgments.referee_outputs
        return replace(
            judgments,
            counterfeit_outputs=np.where(failed[:, None], 0.0, outputs),
            referee_outputs=None if referees_outputs is None else np.where(failed[:, None], 0.0, referees_outputs),
        )
