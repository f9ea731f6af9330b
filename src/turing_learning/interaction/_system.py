"""Systems that answer to stimuli: as frozen data, and as trials in which classifiers choose them or only watch."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ..arrays import array
from ..classifiers import ElmanClassifier
from ..coevolution import THRESHOLD, Classifier, InteractiveInterrogation, Interrogation, Samples
from ..errors import Setting, Text, brief, integer, refuse, require
from ..models import Parameter
from ..systems import CustomSystem, CustomSystemError, Given, GuardedInterrogation, Source
from ..systems._genuine import SCALE_PERCENTILE, SMALLEST_SCALE
from ..systems._system import FailureLog
from . import _examples
from ._stimulus import Dialogue, Interrogator, Stimulus

_LOGGER = logging.getLogger("turing_learning")
Step = Callable[[Any, np.ndarray, np.ndarray, np.random.Generator], tuple[Any, np.ndarray]]
"""(state, parameters (n, P), stimulus (n, S), rng) -> the next state, and what is observed (n, D); for n trials at once.

The first state is `initial(n, rng)`, where the function has such a method; else zeros (n, states)."""

BEHAVIORS: dict[str, Step] = {
    "light-response": _examples.LightResponse(),
    "light-response-stochastic": _examples.LightResponse(stochastic=True),
    "sensor-configuration": _examples.SensorConfiguration(),
}
_TOLD_APART = 20  # models with another value of a parameter, by which an interrogator is chosen for a report


@dataclass(frozen=True, kw_only=True)
class StimulatedSystem(CustomSystem):
    """A system that answers to stimuli, and how models of it do.

    Signals are what is observed, and then the stimuli: classifiers that only watch see both.

    Parameters
    ----------
    stimulus
        What can be done to it, and who chooses.
    behavior_name
        One of `BEHAVIORS`, which are built in; empty where the caller has a function.
    true
        The system's parameters (P,), by which it is simulated; empty where the caller has a function of the system.
    opponents
        Models that each classifier meets alone in a generation, and as often the system. Where classifiers only watch, samples
        of each model; there are as many genuine ones. With as many classifiers as models these are as many trials.
    states
        Numbers that a function without `initial` keeps of each trial.
    """

    stimulus: Stimulus
    behavior_name: str = ""
    true: tuple[float, ...] = ()
    opponents: int = 10
    states: int = 1

    kind: ClassVar[str] = "one on a system with stimuli"
    stimulated: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, least in (("opponents", 1), ("states", 1)):
            integer(name, getattr(self, name), least)
        given, count = len(self.true), len(self.parameters)
        require(given in (0, count), "true", f"be {count} numbers, or none", given)
        own = self.signals[len(self.signals) - len(self.stimulus.names) :]
        require(own == self.stimulus.names, "signals", f"end with the stimuli, {', '.join(self.stimulus.names)}", own)
        steps, recorded = self.steps, np.shape(self.stimulus.recorded)
        require(not self.stimulus.recorded or recorded[1] == steps, "recorded",
                f"be series of {steps} steps, as long as a trial", f"{recorded[1:2]}")  # fmt: skip

    @property
    def truth(self) -> tuple[float, ...] | None:
        """The true parameters; None where they are not known."""
        return self.true or None

    @property
    def trials_per_model(self) -> int:
        """Number of trials of each model in a generation."""
        return self.opponents

    @property
    def resuming(self) -> tuple[Setting, ...]:
        """What a folder does not hold: functions of the caller."""
        names = () if self.behavior_name else ("simulate",) if self.true else ("genuine", "simulate")
        return tuple(map(Setting, names))

    def evolved(self, network: Classifier) -> Classifier:
        """Return what evolves: networks that choose stimuli, too, unless they only watch."""
        if self.stimulus.passive:
            return network
        rule, remedy = (
            "be an Elman network where classifiers choose stimuli",
            'Or set scenario.stimulus.passive="random".',
        )
        if not isinstance(network, ElmanClassifier):
            refuse("classifier", rule, type(network).__name__, remedy)
        return Interrogator(network, self.stimulus)

    def require_trials(self) -> None:
        """Refuse a run of few trials: it judges samples again that a classifier was the only one to cause."""
        rule = "be 0 where classifiers choose stimuli, as a sample belongs to the one that has caused it"
        require(self.stimulus.passive, "run.trials", rule, "more", 'Or set scenario.stimulus.passive="random".')

    def imitated(self, values: np.ndarray) -> "StimulatedSystem":
        """Return the system whose truth is a model with parameters (P,)."""
        return replace(self, true=tuple(np.asarray(values, dtype=float).tolist()))

    def scaled(self, seen: np.ndarray) -> "StimulatedSystem":
        """Return the system with center and scale of the inputs as they are found in observations (n, D)."""
        center, scale = (np.array(each) for each in (self.center, self.input_scale))
        middle = np.median(seen, axis=0)
        spread = np.percentile(np.abs(seen - middle), SCALE_PERCENTILE, axis=0)
        center[: len(middle)], scale[: len(middle)] = middle, np.where(spread < SMALLEST_SCALE, 1.0, spread)
        return replace(self, center=tuple(center.tolist()), input_scale=tuple(scale.tolist()))

    def watched(self, series: np.ndarray) -> "StimulatedSystem":
        """Return the system under recorded stimuli (R, T, S), which nobody chooses."""
        recorded = tuple(tuple(map(tuple, one)) for one in np.asarray(series).tolist())
        return replace(self, stimulus=replace(self.stimulus, passive="recorded", recorded=recorded))

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        if self.resuming:
            return super().again(path)
        return f"Run it again: turing-learning infer --config {path} --set run.history=full"

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models."""
        samples = 2.0 * models * self.opponents
        return samples, 16.0 * samples * self.steps * len(self.signals), ()

    def accept(self, given: Given) -> Given:
        """Return what is given; refuse what the system has no use for."""
        for name, value in given.named.items():
            used = Setting(name) in self.resuming or (name == "genuine" and self.true and not self.behavior_name)
            rule, shown = f"be left out for {self.name}", type(value).__name__
            require(value is None or used, name, rule, shown, "It is simulated here, by what its folder says.")
        for name in ("simulate", "genuine"):
            value = getattr(given, name)
            fits = value is None or callable(value) or (name == "genuine" and isinstance(value, Mapping))
            require(fits, name, "be a function", brief(value))
        if isinstance(given.genuine, Mapping):
            same, got = self.true_of(given.genuine, self.parameters) == self.true, brief(dict(given.genuine))
            require(same, "genuine", f"be what the run began with, {self.shown(np.array(self.true))}", got)
        return given

    @staticmethod
    def true_of(values: Mapping[str, float], parameters: Mapping[str, Parameter]) -> tuple[float, ...]:
        """Return true parameters, given by name, in their order."""
        rule, remedy = f"name the parameters {', '.join(parameters)}", "Or be a function (state, stimulus, rng)."
        require(set(values) == set(parameters), "genuine", rule, brief(list(values)), remedy)
        found = array("genuine", [values[name] for name in parameters], "P")
        return tuple(found.tolist())

    def open(self, given: Given) -> "StimulatedSource":
        """Return its trials."""
        given = self.accept(given)
        for setting in self.resuming:
            rule = "be given for a system with stimuli, which no folder holds completely"
            require(getattr(given, setting.name) is not None, setting.name, rule, "nothing")
        step = BEHAVIORS[self.behavior_name] if self.behavior_name else given.simulate
        return StimulatedSource(self, step, None if self.true else given.genuine)


class StimulatedSource(Source):
    """Trials of a system with stimuli and of models of it.

    Parameters
    ----------
    system
        What is known of it.
    step
        How models answer.
    genuine
        How the system answers, (state, stimulus, rng) -> (state, observation); None for a model with the true parameters.
    """

    def __init__(self, system: StimulatedSystem, step: Step, genuine: Any = None) -> None:
        self.system, self._step, self._genuine = system, step, genuine
        self.failures: FailureLog = FailureLog(system.parameter_names)
        self.failed = np.zeros(0, dtype=bool)

    def interrogation(self, classifier: Classifier) -> Interrogation:
        """Return what lets classifiers choose stimuli, or watch; no model is accepted whose answers are not finite."""
        if self.system.stimulus.passive:
            return GuardedInterrogation(self, classifier)
        self._interrogator = classifier
        return InteractiveInterrogation(self, self.system.opponents)

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the parameters (M, P) in their units of models (M, P) as the optimizer has them."""
        return self.system.to_units(models)

    def confront(
        self, models: np.ndarray, classifiers: np.ndarray, met: np.ndarray, genuine: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return outputs (N, genuine) and (N, k) of classifiers that choose stimuli; see `coevolution.InteractiveSource`."""
        count, known = len(classifiers), self.system.to_units(models)
        trials = _Trials(self, count * genuine, known[met].reshape(-1, known.shape[1]), rng)
        talk = self._dialogue(classifiers, genuine + met.shape[1])
        for _ in range(self.system.steps):
            talk.observe(trials.answer(talk.stimuli))
        outputs, failed = talk.outputs, trials.failed
        self._note(known, met, failed)
        counterfeit = np.where(np.isin(met, np.unique(met[failed])), 0, outputs[:, genuine:])
        return outputs[:, :genuine], counterfeit

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples (K, T, D) of the system and (M, C, T, D) of models, watched under stimuli that nobody chooses."""
        count, known = self.system.opponents, self.system.to_units(models)
        samples, failed = self._watched(len(models) * count, np.repeat(known, count, axis=0), rng)
        self._note(known, np.repeat(np.arange(len(models)), count)[:, None], failed[:, None])
        split, shape = len(models) * count, (len(models), count, *samples.shape[1:])
        return Samples(samples[:split], samples[split:].reshape(shape))

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, 1, T, D) of models with parameters (M, P), without those that fail."""
        samples, failed = self._watched(0, parameters, rng)
        return self._as_observed(samples[~failed])[:, None]

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return samples (count, T, D) of the system under stimuli that nobody chooses."""
        return self._as_observed(self._watched(count, np.empty((0, len(self.system.parameters))), rng)[0])

    def dialogues(
        self, classifiers: np.ndarray, estimate: np.ndarray, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Return what the best interrogators of N (N, Q) do: one trial with the system, one with the estimate (P,).

        There is one for each parameter: that which tells the system best from models in which this parameter is drawn anew.

        Returns
        -------
        dict
            "stimuli" (P, 2, T, S), "answers" (P, 2, T, D), "ranges" (S, 2), and "outputs" (P, 2), "accuracy" (P,), shares of such
            models and of trials of the system; where classifiers only watch, one trial, and neither of the two.
        """
        system, own = self.system, len(self.system.signals) - len(self.system.stimulus.names)
        passive, found = (
            bool(system.stimulus.passive),
            {"ranges": np.stack((system.stimulus.low, system.stimulus.high), 1)},
        )
        n, chosen, count = 1, classifiers[:1], len(estimate)
        if not passive:
            moved = np.tile(np.arange(count), _TOLD_APART)
            models = np.tile(self._numbers(estimate), (len(moved), 1))
            models[np.arange(len(moved)), moved] = rng.uniform(-1, 1, len(moved))
            met = np.tile(np.arange(len(moved)), (len(classifiers), 1))
            genuine, counterfeit = self.confront(models, classifiers, met, 2 * _TOLD_APART, rng)
            told = np.stack([(counterfeit[:, moved == k] < THRESHOLD).mean(axis=1) for k in range(count)], axis=1)
            right = (told + (genuine >= THRESHOLD).mean(axis=1)[:, None]) / 2
            n, chosen, found["accuracy"] = count, classifiers[right.argmax(axis=0)], right.max(axis=0)
        trials = _Trials(self, n, np.tile(estimate, (n, 1)), rng)
        given = system.stimulus.drawn(n, system.steps, rng)[:, None].repeat(2, axis=1)
        talk = None if passive else self._dialogue(chosen, 2)
        stimuli, answers = [], []
        for t in range(system.steps):
            stimuli.append(given[:, :, t] if talk is None else talk.stimuli)
            answers.append(trials.answer(stimuli[-1]))
            if talk is not None:
                talk.observe(answers[-1])
        found["stimuli"] = np.stack(stimuli, axis=2)
        found["answers"] = np.stack(answers, axis=2) + np.array(system.center[:own])
        return found | ({} if talk is None else {"outputs": talk.outputs})

    def _numbers(self, parameters: np.ndarray) -> np.ndarray:
        """Return the optimizer's numbers of a model (P,)."""
        pairs = zip(self.system.parameters.values(), parameters, strict=True)
        return np.array([each.to_numbers(value) for each, value in pairs])

    def _dialogue(self, classifiers: np.ndarray, count: int) -> Dialogue:
        network = self._interrogator
        assert isinstance(network, Interrogator)
        return Dialogue(network, classifiers, count)

    def _watched(self, genuine: int, parameters: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Return centered samples of the system, then of models (n, P), and which models failed."""
        system, count = self.system, genuine + len(parameters)
        trials = _Trials(self, genuine, parameters, rng)
        stimuli, own = system.stimulus.drawn(count, system.steps, rng), len(system.signals) - len(system.stimulus.names)
        samples = np.empty((count, system.steps, len(system.signals)))
        for t in range(system.steps):
            samples[:, t, :own] = trials.answer(stimuli[:, t][None])[0]
        samples[:, :, own:] = stimuli - system.stimulus.center
        return samples, trials.failed.ravel()

    def _as_observed(self, samples: np.ndarray) -> np.ndarray:
        return samples + np.asarray(self.system.center)

    def _note(self, parameters: np.ndarray, met: np.ndarray, failed: np.ndarray) -> None:
        """List models (M, P) that failed in one of the trials that met them (N, k)."""
        self.failed = np.isin(np.arange(len(parameters)), met[failed.reshape(met.shape)])
        places = np.flatnonzero(self.failed)
        if len(places) and self.failures.count == 0:
            _LOGGER.warning("%d of %d models failed: an answer was not finite.", len(places), len(parameters))
        for k in places:
            self.failures.add(self.generation, parameters[k], "an answer was not finite")
        if 2 * len(places) > len(parameters):
            raise CustomSystemError(
                f"`simulate` must return finite observations; it failed for {len(places)} of {len(parameters)} models "
                f"[generation {self.generation}], the first with {self.system.shown(parameters[places[0]])}. Repair it, or "
                "narrow the bounds of the parameters."
            )


class _Trials:
    """Trials of the system and of models, all one step at a time: first those of the system, then those of models."""

    def __init__(
        self, source: StimulatedSource, genuine: int, parameters: np.ndarray, rng: np.random.Generator
    ) -> None:
        system = source.system
        self._system, self._rng, self._number, self._generation = system, rng, 0, source.generation
        self._genuine, self._count = genuine, genuine + len(parameters)
        self._own = len(system.signals) - len(system.stimulus.names)
        self._center = np.array(system.center[: self._own])
        self._given = source._genuine if genuine else None
        if genuine and self._given is None:
            parameters = np.concatenate((np.tile(system.true, (genuine, 1)), parameters))
        self._step, self._parameters = source._step, parameters
        self._state = self._initial(self._step, len(parameters)) if len(parameters) else None
        self._genuine_state = None if self._given is None else self._initial(self._given, genuine)
        self._failed = np.zeros(self._count, bool)

    @property
    def failed(self) -> np.ndarray:
        """Which models (N, k), in their arrangement, have answered something that is not finite."""
        return self._arranged(self._failed)[1]

    def answer(self, stimuli: np.ndarray) -> np.ndarray:
        """Return centered observations (N, g + k, D) of the next step, under stimuli (N, g + k, S); not finite ones are 0."""
        self._rows = len(stimuli)
        genuine, models = np.split(stimuli, [self._genuine // self._rows], axis=1)
        width, found = stimuli.shape[2], []
        if self._given is None:
            both = np.concatenate((genuine.reshape(-1, width), models.reshape(-1, width)))
            self._state, seen = self._called("simulate", self._step, self._state, (self._parameters,), both)
            found.append(seen)
        else:
            ahead = genuine.reshape(-1, width)
            self._genuine_state, seen = self._called("genuine", self._given, self._genuine_state, (), ahead)
            found.append(seen)
            if len(self._parameters):
                behind = models.reshape(-1, width)
                self._state, seen = self._called("simulate", self._step, self._state, (self._parameters,), behind)
                found.append(seen)
        observed = np.concatenate(found) if len(found) > 1 else found[0]
        bad = ~np.isfinite(observed).all(axis=1)
        if bad.any():
            observed = np.where(bad[:, None], self._center, observed)
            self._failed |= bad
            if bad[: self._genuine].any():
                raise CustomSystemError(
                    f"`genuine` must return finite observations; got one that is not [step {self._number}, generation "
                    f"{self._generation}]. Repair it."
                )
        self._number += 1
        return np.concatenate(self._arranged(observed - self._center), axis=1)

    def _arranged(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows of trials as (N, g, ...) of the system, and (N, k, ...) of models."""
        split, shape = self._genuine, flat.shape[1:]
        return (
            flat[:split].reshape(self._rows, split // self._rows, *shape),
            flat[split:].reshape(self._rows, (self._count - split) // self._rows, *shape),
        )

    def _initial(self, step: Any, count: int) -> Any:
        initial = getattr(step, "initial", None)
        return np.zeros((count, self._system.states)) if initial is None else initial(count, self._rng)

    def _called(
        self, name: str, step: Any, state: Any, parameters: tuple[np.ndarray, ...], stimuli: np.ndarray
    ) -> tuple[Any, np.ndarray]:
        """Return the next state and what is observed (n, D), by a function that may be the caller's."""
        count, place = len(stimuli), f"[step {self._number}, generation {self._generation}]"
        rule = f"return the next state, and observations (n, D) = ({count}, {self._own})"
        try:
            state, seen = step(state, *parameters, stimuli, self._rng)
            observed = np.asarray(seen, dtype=np.float64)
        except Exception as error:
            raise CustomSystemError(
                f"`{name}` must {rule}; it raised {type(error).__name__}: {error} {place}."
            ) from error
        if observed.shape != (count, self._own):
            raise CustomSystemError(f"`{name}` must {rule}; got shape {observed.shape} {place}. Repair it.")
        return state, observed


def _built_in(
    name: str, title: str, parameters: dict[str, Parameter], true: tuple[float, ...], ranges: dict[str, tuple[float, float]],
    center: dict[str, float], scale: tuple[float, ...],
) -> StimulatedSystem:  # fmt: skip
    stimulus = Stimulus(ranges)
    return StimulatedSystem(
        name=name, title=title, parameters=parameters, signals=(*center, *ranges), steps=100, interval_s=0.1,
        center=(*center.values(), *stimulus.center.tolist()),
        input_scale=(*scale, *((stimulus.high - stimulus.low) / 2).tolist()),
        samples=0, samples_per_generation=0, stimulus=stimulus, behavior_name=name, true=true,
    )  # fmt: skip


_LIGHT: dict[str, Any] = {
    "parameters": _examples.LIGHT_PARAMETERS, "true": _examples.LIGHT_TRUTH,
    "ranges": {"light": (0.0, 1.0)}, "center": {"speed": 5.0}, "scale": (4.0,),
}  # fmt: skip
STIMULATED: dict[str, StimulatedSystem] = {
    system.name: system
    for system in (
        _built_in("light-response", "Response to light", **_LIGHT),
        _built_in("light-response-stochastic", "Response to light, by chance", **_LIGHT),
        _built_in(
            "sensor-configuration",
            "Sensors of a robot",
            _examples.SENSOR_PARAMETERS,
            _examples.SENSOR_TRUTH,
            {"left_wheel": (-1.0, 1.0), "right_wheel": (-1.0, 1.0)},
            dict.fromkeys(("reading1", "reading2", "reading3"), 15.0),
            (15.0,) * 3,
        ),
    )
}
"""Built-in systems that answer to stimuli, by name."""
