"""Systems that answer to stimuli: as frozen data, and as trials in which classifiers choose them or only watch."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from turing_learning.systems import FallibleSource, read_parameters, scales_of

from ..arrays import array
from ..classifiers import ElmanClassifier
from ..coevolution import THRESHOLD, Classifier, InteractiveInterrogation, Interrogation, Samples
from ..errors import Setting, Text, brief, integer, refuse, require
from ..models import Parameter
from ..purposes import GENUINE
from ..systems import CustomOptions, CustomSystem, CustomSystemError, Given, Range, System
from . import _examples
from ._stimulus import PASSIVE, Dialogue, Interrogator, Stimulus

Step = Callable[[Any, np.ndarray, np.ndarray, np.random.Generator], tuple[Any, np.ndarray]]
"""(state, parameters (n, P), stimulus (n, S), rng) -> the next state, and what is observed (n, D); for n trials at once.

The first state is `initial(n, rng)`, where the function has such a method; else zeros (n,
states)."""

BEHAVIORS: dict[str, Step] = {
    "light-response": _examples.LightResponse(),
    "light-response-stochastic": _examples.LightResponse(stochastic=True),
    "sensor-configuration": _examples.SensorConfiguration(),
}
_OBSERVED = 200  # trials that the scale of what is observed is found in
_NOT_FOR_STIMULI = (
    "length",
    "held_out",
    "samples_per_generation",
    "vectorized",
    "batches",
    "workers",
    "timeout_s",
)
_NOT_FINITE = "an answer was not finite"
_TOLD_APART = (
    20  # models with another value of a parameter, by which an interrogator is chosen for a report
)


@dataclass(frozen=True, kw_only=True)
class StimulatedSystem(CustomSystem):
    """A system that answers to stimuli, and how models of it do.

    Signals are what is observed, and then the stimuli: classifiers that only watch see both.
    """

    stimulus: Stimulus  #: What can be done to it, and who chooses
    #: One of `BEHAVIORS`, which are built in; empty where the caller has a function
    behavior_name: str = ""
    #: The system's parameters (P,), by which it is simulated; empty where the caller has a
    #: function of it
    true: tuple[float, ...] = ()
    #: Models that each classifier meets alone in a generation, and as often the system. Where
    #: classifiers only watch, samples of each model; there are as many genuine ones. With as many
    #: classifiers as models these are as many trials
    opponents: int = 10
    states: int = 1  #: Numbers that a function without `initial` keeps of each trial

    kind = "one on a system with stimuli"
    stimulated = True

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("opponents", "states"):
            integer(name, getattr(self, name), 1)
        given, count = len(self.true), len(self.parameters)
        require(given in (0, count), "true", f"be {count} numbers, or none", given)
        last, names = self.signals[self.own :], self.stimulus.names
        require(last == names, "signals", f"end with the stimuli, {', '.join(names)}", last)
        rule, recorded = (
            f"be series of {self.steps} steps, as long as a trial",
            np.shape(self.stimulus.recorded),
        )
        require(recorded[1:2] in ((), (self.steps,)), "recorded", rule, f"{recorded[1:2]}")

    @property
    def own(self) -> int:
        """Number of the signals that are no stimuli."""
        return len(self.signals) - len(self.stimulus.names)

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
        names = (
            () if self.behavior_name else ("simulate",) if self.true else ("genuine", "simulate")
        )
        return tuple(map(Setting, names))

    def evolved(self, network: Classifier) -> Classifier:
        """Return what evolves: networks that choose stimuli, too, unless they only watch."""
        if self.stimulus.passive:
            return network
        if not isinstance(network, ElmanClassifier):
            rule = "be an Elman network where classifiers choose stimuli"
            refuse(
                "classifier",
                rule,
                type(network).__name__,
                'Or set scenario.stimulus.passive="random".',
            )
        return Interrogator(network, self.stimulus)

    def require_trials(self) -> None:
        """Refuse a run of few trials: it judges samples again that a classifier was the only one to cause."""
        rule = "be 0 where classifiers choose stimuli, as a sample belongs to the one that has caused it"
        require(
            self.stimulus.passive,
            "run.trials",
            rule,
            "more",
            'Or set scenario.stimulus.passive="random".',
        )

    def imitated(self, values: np.ndarray) -> "StimulatedSystem":
        """Return the system whose truth is a model with parameters (P,)."""
        return replace(self, true=tuple(np.asarray(values, dtype=float).tolist()))

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        return super().again(path) if self.resuming else System.again(self, path)

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models."""
        samples = 2.0 * models * self.opponents
        return samples, 16.0 * samples * self.steps * len(self.signals), ()

    def accept(self, given: Given) -> Given:
        """Return what is given; refuse what the system has no use for."""
        for name, value in given.named.items():
            used = Setting(name) in self.resuming or (
                name == "genuine" and self.true and not self.behavior_name
            )
            rule, shown = f"be left out for {self.name}", type(value).__name__
            require(
                value is None or used,
                name,
                rule,
                shown,
                "It is simulated here, by what its folder says.",
            )
        truth = isinstance(given.genuine, Mapping)
        for name, value in (
            ("simulate", given.simulate),
            ("genuine", None if truth else given.genuine),
        ):
            require(value is None or callable(value), name, "be a function", brief(value))
        if truth:
            same, got = (
                self.true_of(given.genuine, self.parameters) == self.true,
                brief(dict(given.genuine)),
            )
            require(
                same,
                "genuine",
                f"be what the run began with, {self.shown(np.array(self.true))}",
                got,
            )
        return given

    @staticmethod
    def true_of(
        values: Mapping[str, float], parameters: Mapping[str, Parameter]
    ) -> tuple[float, ...]:
        """Return true parameters, given by name, in their order."""
        rule, remedy = (
            f"name the parameters {', '.join(parameters)}",
            "Or be a function (state, stimulus, rng).",
        )
        require(set(values) == set(parameters), "genuine", rule, brief(list(values)), remedy)
        return tuple(array("genuine", [values[name] for name in parameters], "P").tolist())

    def open(self, given: Given) -> "StimulatedSource":
        """Return its trials."""
        given = self.accept(given)
        self.require_all(given)
        step = BEHAVIORS[self.behavior_name] if self.behavior_name else given.simulate
        return StimulatedSource(self, step, None if self.true else given.genuine)


class StimulatedSource(FallibleSource):
    """Trials of a system with stimuli and of models of it, which answer by `step`.

    `genuine` is how the system answers, (state, stimulus, rng) -> (state, observation); None for a
    model with the true parameters.
    """

    system: StimulatedSystem

    def __init__(self, system: StimulatedSystem, step: Step, genuine: Any = None) -> None:
        super().__init__(system)
        self.step, self.answering = step, genuine

    def interrogation(self, classifier: Classifier) -> Interrogation:
        """Return what lets classifiers choose stimuli, or watch.

        No model is accepted whose answers are not finite.
        """
        if self.system.stimulus.passive:
            return super().interrogation(classifier)
        self._interrogator = cast(Interrogator, classifier)
        return InteractiveInterrogation(self, self.system.opponents)

    def confront(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        met: np.ndarray,
        genuine: int,
        rng: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return outputs (N, genuine) and (N, k) of classifiers that choose stimuli.

        See `coevolution.InteractiveSource`.
        """
        count, known = len(classifiers), self.system.to_units(models)
        trials = _Trials(self, count * genuine, known[met].reshape(-1, known.shape[1]), rng)
        talk = Dialogue(self._interrogator, classifiers, genuine + met.shape[1])
        for _ in range(self.system.steps):
            talk.observe(trials.answer(talk.stimuli))
        outputs, failed = talk.outputs, np.unique(met[trials.failed])
        self.note(known, dict.fromkeys(failed.tolist(), _NOT_FINITE))
        return outputs[:, :genuine], np.where(np.isin(met, failed), 0, outputs[:, genuine:])

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples (K, T, D) of the system and (M, C, T, D) of models, watched under stimuli that nobody chooses."""
        count, known = self.system.opponents, self.system.to_units(models)
        split = len(models) * count
        samples, failed = self._watched(split, np.repeat(known, count, axis=0), rng)
        places = np.flatnonzero(failed.reshape(-1, count).any(axis=1))
        self.note(known, dict.fromkeys(places.tolist(), _NOT_FINITE))
        return Samples(
            samples[:split], samples[split:].reshape(len(models), count, *samples.shape[1:])
        )

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (at most M, 1, T, D) of models with parameters (M, P), without those that fail."""
        samples, failed = self._watched(0, parameters, rng)
        return samples[~failed, None] + np.asarray(self.system.center)

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return samples (count, T, D) of the system under stimuli that nobody chooses."""
        samples, _ = self._watched(count, np.empty((0, len(self.system.parameters))), rng)
        return samples + np.asarray(self.system.center)

    def dialogues(
        self, classifiers: np.ndarray, estimate: np.ndarray, rng: np.random.Generator
    ) -> dict[str, np.ndarray]:
        """Return what the best interrogators of N (N, Q) do: one trial with the system, one with the estimate (P,).

        There is one for each parameter: that which tells the system best from models in which this
        parameter is drawn anew. The arrays are "stimuli" (P, 2, T, S), "answers" (P, 2, T, D),
        "ranges" (S, 2), and "outputs" (P, 2), "accuracy" (P,), shares of such models and of trials
        of the system; where classifiers only watch, those of one trial, and neither of the last
        two.
        """
        system, count, passive = self.system, len(estimate), bool(self.system.stimulus.passive)
        found = {"ranges": np.stack((system.stimulus.low, system.stimulus.high), 1)}
        n, chosen = 1, classifiers[:1]
        if not passive:
            moved = np.tile(np.arange(count), _TOLD_APART)
            numbers = [
                one.to_numbers(value)
                for one, value in zip(system.parameters.values(), estimate, strict=True)
            ]
            models = np.tile(numbers, (len(moved), 1))
            models[np.arange(len(moved)), moved] = rng.uniform(-1, 1, len(moved))
            met = np.tile(np.arange(len(moved)), (len(classifiers), 1))
            genuine, counterfeit = self.confront(models, classifiers, met, 2 * _TOLD_APART, rng)
            told = np.stack(
                [(counterfeit[:, moved == k] < THRESHOLD).mean(axis=1) for k in range(count)],
                axis=1,
            )
            right = (told + (genuine >= THRESHOLD).mean(axis=1)[:, None]) / 2
            n, chosen, found["accuracy"] = (
                count,
                classifiers[right.argmax(axis=0)],
                right.max(axis=0),
            )
        trials = _Trials(self, n, np.tile(estimate, (n, 1)), rng)
        given = system.stimulus.drawn(n, system.steps, rng)[:, None].repeat(2, axis=1)
        talk = None if passive else Dialogue(self._interrogator, chosen, 2)
        stimuli, answers = [], []
        for t in range(system.steps):
            stimuli.append(given[:, :, t] if talk is None else talk.stimuli)
            answers.append(trials.answer(stimuli[-1]))
            if talk is not None:
                talk.observe(answers[-1])
        found["stimuli"] = np.stack(stimuli, axis=2)
        found["answers"] = np.stack(answers, axis=2) + np.array(system.center[: system.own])
        return found | ({} if talk is None else {"outputs": talk.outputs})

    def _watched(
        self, genuine: int, parameters: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return centered samples of the system, then of models (n, P), and which models failed."""
        system, count = self.system, genuine + len(parameters)
        trials = _Trials(self, genuine, parameters, rng)
        stimuli = system.stimulus.drawn(count, system.steps, rng)
        samples = np.empty((count, system.steps, len(system.signals)))
        for t in range(system.steps):
            samples[:, t, : system.own] = trials.answer(stimuli[:, t][None])[0]
        samples[:, :, system.own :] = stimuli - system.stimulus.center
        return samples, trials.failed.ravel()


class _Trials:
    """Trials of the system and of models, all one step at a time: first those of the system, then those of models."""

    def __init__(
        self,
        source: StimulatedSource,
        genuine: int,
        parameters: np.ndarray,
        rng: np.random.Generator,
    ) -> None:
        system = source.system
        self._rng, self._genuine, self._count = rng, genuine, genuine + len(parameters)
        self._number, self._generation = 0, source.generation
        self._center = np.array(system.center[: system.own])
        self._failed = np.zeros(self._count, bool)
        self._answering: list[tuple[str, Any, tuple[np.ndarray, ...], int]] = []
        if genuine and source.answering is not None:
            self._answering.append(("genuine", source.answering, (), genuine))
        elif genuine:
            parameters = np.concatenate((np.tile(system.true, (genuine, 1)), parameters))
        if len(parameters):
            self._answering.append(("simulate", source.step, (parameters,), len(parameters)))
        self._states: dict[str, Any] = {}
        for name, step, _, count in reversed(self._answering):
            initial = getattr(step, "initial", None)
            self._states[name] = (
                np.zeros((count, system.states)) if initial is None else initial(count, rng)
            )

    @property
    def failed(self) -> np.ndarray:
        """Which models (N, k), in their arrangement, have answered something that is not finite."""
        return self._arranged(self._failed)[1]

    def answer(self, stimuli: np.ndarray) -> np.ndarray:
        """Return centered observations (N, g + k, D) of the next step, under stimuli (N, g + k, S); not finite ones are 0."""
        self._rows = len(stimuli)
        parts = np.split(stimuli, [self._genuine // self._rows], axis=1)
        given = np.concatenate([part.reshape(-1, stimuli.shape[2]) for part in parts])
        observed: np.ndarray = np.empty((self._count, len(self._center)))
        start, place = 0, f"[step {self._number}, generation {self._generation}]"
        for name, step, parameters, count in self._answering:
            rule = f"`{name}` must return the next state, and observations (n, D) = ({count}, {len(self._center)})"
            part = slice(start, start := start + count)
            try:
                self._states[name], seen = step(
                    self._states[name], *parameters, given[part], self._rng
                )
                seen = np.asarray(seen, dtype=np.float64)
            except Exception as error:
                raise CustomSystemError(
                    f"{rule}; it raised {type(error).__name__}: {error} {place}."
                ) from error
            if seen.shape != (count, len(self._center)):
                raise CustomSystemError(f"{rule}; got shape {seen.shape} {place}. Repair it.")
            observed[part] = seen
        bad = ~np.isfinite(observed).all(axis=1)
        if bad[: self._genuine].any():
            rule = "`genuine` must return finite observations"
            raise CustomSystemError(f"{rule}; got one that is not {place}. Repair it.")
        observed[bad] = self._center
        self._failed |= bad
        self._number += 1
        return np.concatenate(self._arranged(observed - self._center), axis=1)

    def _arranged(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows of trials as (N, g, ...) of the system, and (N, k, ...) of models."""
        genuine, models = np.split(flat, [self._genuine])
        return genuine.reshape(self._rows, -1, *flat.shape[1:]), models.reshape(
            self._rows, -1, *flat.shape[1:]
        )


def _system_of(
    stimulus: Stimulus,
    signals: Sequence[str],
    center: Sequence[float],
    scale: Sequence[float],
    **more: Any,
) -> StimulatedSystem:
    """Return a system of which these signals are observed.

    The inputs that are stimuli have half their range as a scale.
    """
    half = (stimulus.high - stimulus.low) / 2
    return StimulatedSystem(
        signals=(*signals, *stimulus.names), center=(*center, *stimulus.center.tolist()), input_scale=(*scale, *half.tolist()),
        samples=0, samples_per_generation=0, stimulus=stimulus, **more,
    )  # fmt: skip


def describe_stimulated(
    genuine: Any, simulate: Any, parameters: Mapping[str, Range], options: CustomOptions
) -> StimulatedSystem:
    """Return a system with stimuli as frozen data.

    Parameters
    ----------
    genuine
        The system: name -> true parameter, or a function (state, stimulus (n, S), rng) -> (state,
        observation (n, D)).
    simulate
        How a model answers, see `Step`.
    parameters, options
        As for `turing_learning.infer`; the options name `signals`, `steps` and `stimulus`.
    """
    given: dict[str, Any] = dict(options)
    for name in _NOT_FOR_STIMULI:
        require(name not in given, name, "be left out for a system with stimuli", given.get(name))
    for name, rule in (
        ("signals", "name what is observed"),
        ("steps", "be the number of steps of a trial"),
    ):
        require(name in given, name, rule, "nothing", 'For example signals=("speed",), steps=100.')
    ranges, known = given["stimulus"], read_parameters(parameters)
    if isinstance(ranges, Mapping):
        pairs = {str(name): ends for name, ends in ranges.items()}
        ranges = {
            name: tuple(array("stimulus", ends, "2", place=repr(name)).tolist())
            for name, ends in pairs.items()
        }
    passive, recorded = given.get("passive", ""), cast(Any, ())
    if not isinstance(passive, str):
        series = array(
            "passive",
            passive,
            "R T S",
            remedy="Series of stimuli, or one of: " + ", ".join(PASSIVE),
        )
        passive, recorded = "recorded", _frozen(series)
    stimulus, count = (
        Stimulus(ranges, given.get("levels", 0), cast(Any, passive), recorded),
        len(given["signals"]),
    )
    true = StimulatedSystem.true_of(genuine, known) if isinstance(genuine, Mapping) else ()
    name = given.get("name", "own-system")
    system = _system_of(
        stimulus, given["signals"], [0.0] * count, [1.0] * count, name=name, title=given.get("title", name), parameters=known,
        steps=given["steps"], interval_s=float(given.get("interval_s", 0.0)), true=true, opponents=given.get("opponents", 10),
        states=given.get("states", 1),
    )  # fmt: skip
    try:
        with system.open(Given(genuine=None if true else genuine, simulate=simulate)) as source:
            seen = source.genuine_samples(_OBSERVED, np.random.default_rng(GENUINE))[
                ..., :count
            ].reshape(-1, count)
    except CustomSystemError as error:
        raise CustomSystemError(
            f"{error} [the first {_OBSERVED} trials, under stimuli by chance]"
        ) from error
    center, scale = scales_of(seen)
    return replace(
        system,
        center=center + system.center[count:],
        input_scale=scale + system.input_scale[count:],
    )


def read_stimuli(path: Path, system: StimulatedSystem) -> StimulatedSystem:
    """Return a system that is watched under stimuli of a table with a heading (CSV): a column for each, and "trial" for several."""
    try:
        table: Any = np.genfromtxt(
            path, delimiter=",", names=True, dtype=np.float64, encoding="utf-8"
        )
    except (OSError, ValueError) as error:
        refuse("passive", f"be one of {', '.join(PASSIVE[:2])}, or a file", f"{path} ({error})")
    columns, names = table.dtype.names or (), system.stimulus.names
    rule = f"have the columns {', '.join(names)}, and trial for several series"
    require(
        set(names) <= set(columns), "passive", rule, ", ".join(columns) or "none", place=str(path)
    )
    rows = np.stack([np.atleast_1d(table[name]) for name in names], axis=-1)
    trial = np.atleast_1d(table["trial"]) if "trial" in columns else np.zeros(len(rows))
    series = [rows[trial == number] for number in dict.fromkeys(trial.tolist())]
    lengths = sorted({len(one) for one in series})
    require(
        lengths == [system.steps],
        "passive",
        f"hold series of {system.steps} steps",
        lengths,
        place=str(path),
    )
    recorded = _frozen(np.stack(series))
    return replace(system, stimulus=replace(system.stimulus, passive="recorded", recorded=recorded))


def _frozen(series: np.ndarray) -> tuple[tuple[tuple[float, ...], ...], ...]:
    return tuple(tuple(map(tuple, one)) for one in series.tolist())


_LIGHT: dict[str, Any] = {
    "stimulus": Stimulus({"light": (0.0, 1.0)}), "signals": ("speed",), "center": (5.0,), "scale": (4.0,),
    "parameters": _examples.LIGHT_PARAMETERS, "true": _examples.LIGHT_TRUTH,
}  # fmt: skip
_SENSORS: dict[str, Any] = {
    "stimulus": Stimulus({"left_wheel": (-1.0, 1.0), "right_wheel": (-1.0, 1.0)}),
    "signals": ("reading1", "reading2", "reading3"), "center": (15.0,) * 3, "scale": (15.0,) * 3,
    "parameters": _examples.SENSOR_PARAMETERS, "true": _examples.SENSOR_TRUTH,
}  # fmt: skip
STIMULATED: dict[str, StimulatedSystem] = {
    name: _system_of(name=name, title=title, behavior_name=name, steps=100, interval_s=0.1, **known)
    for name, title, known in (
        ("light-response", "Response to light", _LIGHT),
        ("light-response-stochastic", "Response to light, by chance", _LIGHT),
        ("sensor-configuration", "Sensors of a robot", _SENSORS),
    )
}
"""Built-in systems that answer to stimuli, by name."""
