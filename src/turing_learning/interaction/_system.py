"""Systems that answer to stimuli: as frozen data, and as trials in which classifiers choose them or only watch."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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
from ..systems import Arguments, CustomOptions, CustomSystem, CustomSystemError, Range, System
from . import _epuck, _examples
from ._stimulus import PASSIVE, Dialogue, Interrogator, Stimulus

# Trials in which the scale of what is observed is found.
_SCALING_TRIALS = 200


Step = Callable[[Any, np.ndarray, np.ndarray, np.random.Generator], tuple[Any, np.ndarray]]
"""(state, parameters (n, P), stimulus (n, S), rng) -> the next state, and what is observed (n, D);
for n trials at once.

The first state is `initial(n, rng)`, where the function has such a method; else zeros (n,
states). What it does where nobody chooses, with passive="own", is its method `own(state,
parameters)` -> (n, S), `own(state)` of a `genuine` function."""

BEHAVIORS: dict[str, Step] = {
    "light-response": _examples.LightResponse(),
    "light-response-stochastic": _examples.LightResponse(stochastic=True),
    "sensor-configuration": _examples.SensorConfiguration(),
    "infrared-sensors": _epuck.InfraredSensors(),
    "rangefinder-response": _epuck.RangefinderResponse(),
}
_NOT_FOR_STIMULI = (
    "length",
    "held_out",
    "samples_per_generation",
    "vectorized",
    "batches",
    "workers",
    "timeout_s",
)


# For a report: models with another value of a parameter, by which its interrogator is chosen.
_VARIED_MODELS = 20


_OR_PASSIVE = 'Or set scenario.stimulus.passive="random".'
_NOT_FINITE = "an answer was not finite"


@dataclass(frozen=True, kw_only=True)
class StimulatedSystem(CustomSystem):
    """A system that answers to stimuli, and how models of it do.

    Signals are what is observed, and then the stimuli if they are shown: classifiers that only watch
    see both.
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
    #: Numbers that a function without `initial` keeps of each trial
    states: int = 1

    noun = "one on a system with stimuli"
    stimulated = True

    def __post_init__(self) -> None:
        super().__post_init__()
        integer("opponents", self.opponents, 1)
        integer("states", self.states, 1)
        count = len(self.parameters)
        fits = len(self.true) in (0, count)
        require(fits, "true", f"be {count} numbers, or none", len(self.true))
        names = self.stimulus.inputs
        final = self.signals[self.observed :]
        require(final == names, "signals", f"end with the stimuli, {', '.join(names)}", final)
        steps = np.shape(self.stimulus.recorded)[1:2]
        rule = f"be series of {self.steps} steps, as long as a trial"
        require(steps in ((), (self.steps,)), "recorded", rule, f"{steps}")

    @property
    def observed(self) -> int:
        """Number of the signals that are no stimuli."""
        return len(self.signals) - len(self.stimulus.inputs)

    @property
    def dialogue_names(self) -> tuple[str, ...]:
        """Names of what is observed, then of stimuli, shown or not."""
        return (*self.signals[: self.observed], *self.stimulus.names)

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
        if self.behavior_name:
            return ()
        if self.true:
            return (Setting("simulate"),)
        return (Setting("genuine"), Setting("simulate"))

    def evolved(self, network: Classifier) -> Classifier:
        """Return what evolves: networks that choose stimuli, too, unless they only watch."""
        if self.stimulus.passive:
            return network
        if not isinstance(network, ElmanClassifier):
            rule = "be an Elman network where classifiers choose stimuli"
            refuse("classifier", rule, type(network).__name__, _OR_PASSIVE)
        return Interrogator(network, self.stimulus)

    def require_trials(self) -> None:
        """Refuse a run of few trials, which lets all classifiers judge samples that one of them has caused."""
        rule = "be 0 where classifiers choose stimuli, as a sample belongs to the one that has caused it"
        require(self.stimulus.passive, "run.trials", rule, "more", _OR_PASSIVE)

    def imitated(self, values: np.ndarray) -> "StimulatedSystem":
        """Return the system whose truth is a model with parameters (P,)."""
        return replace(self, true=tuple(np.asarray(values, dtype=float).tolist()))

    def again(self, path: str) -> Text:
        """Return how to run it again."""
        if self.resuming:
            return super().again(path)
        return System.again(self, path)

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models."""
        samples = 2.0 * models * self.opponents
        return samples, 16.0 * samples * self.steps * len(self.signals), ()

    def accept(self, arguments: Arguments) -> Arguments:
        """Return what is given; refuse what the system has no use for."""
        # The truth may be given again, to be compared.
        has_truth = bool(self.true) and not self.behavior_name
        for name, value in arguments.named.items():
            is_taken = Setting(name) in self.resuming or (name == "genuine" and has_truth)
            rule = f"be left out for {self.name}"
            remedy = "It is simulated here, by what its folder says."
            require(value is None or is_taken, name, rule, type(value).__name__, remedy)
        functions = {"simulate": arguments.simulate}
        if not isinstance(arguments.genuine, Mapping):
            functions["genuine"] = arguments.genuine
        for name, value in functions.items():
            require(value is None or callable(value), name, "be a function", brief(value))
        if isinstance(arguments.genuine, Mapping):
            fits = self.true_of(arguments.genuine, self.parameters) == self.true
            rule = f"be what the run began with, {self.shown(np.array(self.true))}"
            require(fits, "genuine", rule, brief(dict(arguments.genuine)))
        return arguments

    @staticmethod
    def true_of(
        values: Mapping[str, float], parameters: Mapping[str, Parameter]
    ) -> tuple[float, ...]:
        """Return true parameters, given by name, in their order."""
        fits = set(values) == set(parameters)
        rule = f"name the parameters {', '.join(parameters)}"
        remedy = "Or be a function (state, stimulus, rng)."
        require(fits, "genuine", rule, brief(list(values)), remedy)
        return tuple(array("genuine", [values[name] for name in parameters], "P").tolist())

    def open(self, arguments: Arguments) -> "StimulatedSource":
        """Return its trials."""
        arguments = self.accept(arguments)
        self.require_all(arguments)
        step = arguments.simulate
        if self.behavior_name:
            step = BEHAVIORS[self.behavior_name]
        if self.stimulus.passive == "own":
            functions = {"simulate": step}
            if not self.true:
                functions["genuine"] = arguments.genuine
            for name, function in functions.items():
                if function is None or hasattr(function, "own"):
                    continue
                got = f'a function of "{self.name}", without'
                refuse(name, 'have a method `own` with passive="own"', got, _OR_PASSIVE)
        return StimulatedSource(self, step, None if self.true else arguments.genuine)


class StimulatedSource(FallibleSource):
    """Trials of a system with stimuli and of models of it, which answer by `step`.

    `genuine` is how the system answers, (state, stimulus, rng) -> (state, observation); None for a
    model with the true parameters.
    """

    system: StimulatedSystem

    def __init__(self, system: StimulatedSystem, step: Step, genuine: Any = None) -> None:
        super().__init__(system)
        self.step = step
        self.genuine_step = genuine

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
        parameters = self.system.to_units(models)
        opponents = parameters[met].reshape(-1, parameters.shape[1])
        trials = _Trials(self, len(classifiers) * genuine, opponents, rng)
        dialogue = Dialogue(self._interrogator, classifiers, genuine + met.shape[1])
        for _ in range(self.system.steps):
            dialogue.observe(trials.answer(dialogue.stimuli))
        outputs = dialogue.outputs
        failed = np.unique(met[trials.failed])
        self.note(parameters, dict.fromkeys(failed.tolist(), _NOT_FINITE))
        counterfeit = np.where(np.isin(met, failed), 0, outputs[:, genuine:])
        return outputs[:, :genuine], counterfeit

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples (K, T, D) of the system and (M, C, T, D) of models, under stimuli that nobody chooses."""
        count = self.system.opponents
        parameters = self.system.to_units(models)
        genuine = len(models) * count
        samples, failed = self._watched(genuine, np.repeat(parameters, count, axis=0), rng)
        failed_models = np.flatnonzero(failed.reshape(-1, count).any(axis=1))
        self.note(parameters, dict.fromkeys(failed_models.tolist(), _NOT_FINITE))
        counterfeit = samples[genuine:].reshape(len(models), count, *samples.shape[1:])
        return Samples(samples[:genuine], counterfeit)

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
        system = self.system
        arrays = {"ranges": np.stack((system.stimulus.low, system.stimulus.high), 1)}
        if system.stimulus.passive:
            trials = _Trials(self, 1, estimate[None], rng)
            stimuli = []
            answers = []
            for stimulus in self._unchosen(trials, 1, rng):
                stimuli.append(np.broadcast_to(stimulus, (2, stimulus.shape[1]))[None])
                answers.append(trials.answer(stimuli[-1]))
        else:
            best, arrays["accuracy"] = self._best_interrogators(classifiers, estimate, rng)
            trials = _Trials(self, len(estimate), np.tile(estimate, (len(estimate), 1)), rng)
            # Nobody uses these stimuli, but the generator goes on as where classifiers watch.
            system.stimulus.drawn(len(estimate), system.steps, rng)
            dialogue = Dialogue(self._interrogator, best, 2)
            stimuli = []
            answers = []
            for _ in range(system.steps):
                stimuli.append(dialogue.stimuli)
                answers.append(trials.answer(dialogue.stimuli))
                dialogue.observe(answers[-1])
        arrays["stimuli"] = np.stack(stimuli, axis=2)
        arrays["answers"] = np.stack(answers, axis=2) + np.array(system.center[: system.observed])
        if not system.stimulus.passive:
            arrays["outputs"] = dialogue.outputs
        return arrays

    def _best_interrogators(
        self, classifiers: np.ndarray, estimate: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return for each parameter the best of N interrogators (P, Q), and its accuracy (P,)."""
        numbers = []
        for parameter, value in zip(self.system.parameters.values(), estimate, strict=True):
            numbers.append(parameter.to_numbers(value))
        varied = np.tile(np.arange(len(estimate)), _VARIED_MODELS)
        models = np.tile(numbers, (len(varied), 1))
        models[np.arange(len(varied)), varied] = rng.uniform(-1, 1, len(varied))
        met = np.tile(np.arange(len(varied)), (len(classifiers), 1))
        genuine, counterfeit = self.confront(models, classifiers, met, 2 * _VARIED_MODELS, rng)
        sensitivity = (genuine >= THRESHOLD).mean(axis=1)
        accuracy = np.empty((len(classifiers), len(estimate)))
        for k in range(len(estimate)):
            specificity = (counterfeit[:, varied == k] < THRESHOLD).mean(axis=1)
            accuracy[:, k] = (specificity + sensitivity) / 2
        return classifiers[accuracy.argmax(axis=0)], accuracy.max(axis=0)

    def _watched(
        self, genuine: int, parameters: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return centered samples of the system, then of models (n, P), and which models failed."""
        system = self.system
        count = genuine + len(parameters)
        trials = _Trials(self, genuine, parameters, rng)
        samples = np.empty((count, system.steps, len(system.signals)))
        for t, stimuli in enumerate(self._unchosen(trials, count, rng)):
            samples[:, t, : system.observed] = trials.answer(stimuli[None])[0]
            if system.stimulus.shown:
                samples[:, t, system.observed :] = stimuli - system.stimulus.center
        return samples, trials.failed.ravel()

    def _unchosen(
        self, trials: "_Trials", count: int, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield the stimuli (count, S) of each step, which nobody chooses.

        Where the system itself does, there are stimuli of all trials.
        """
        system = self.system
        if system.stimulus.passive == "own":
            for _ in range(system.steps):
                yield trials.own_stimuli()
        else:
            stimuli = system.stimulus.drawn(count, system.steps, rng)
            for t in range(system.steps):
                yield stimuli[:, t]


class _Trials:
    """Trials of the system, and after them trials of models, all one step at a time."""

    def __init__(
        self,
        source: StimulatedSource,
        genuine: int,
        parameters: np.ndarray,
        rng: np.random.Generator,
    ) -> None:
        system = source.system
        self._rng = rng
        self._genuine = genuine
        self._count = genuine + len(parameters)
        self._step_number = 0
        self._generation = source.generation
        self._center = np.array(system.center[: system.observed])
        self._stimuli = len(system.stimulus.names)
        self._failed = np.zeros(self._count, bool)
        # Name, step function, its parameters if it has any, and number of trials.
        self._steps: list[tuple[str, Any, tuple[np.ndarray, ...], int]] = []
        if genuine and source.genuine_step is not None:
            self._steps.append(("genuine", source.genuine_step, (), genuine))
        elif genuine:
            parameters = np.concatenate((np.tile(system.true, (genuine, 1)), parameters))
        if len(parameters):
            self._steps.append(("simulate", source.step, (parameters,), len(parameters)))
        self._states: dict[str, Any] = {}
        for name, step, _, count in reversed(self._steps):
            if hasattr(step, "initial"):
                self._states[name] = step.initial(count, rng)
            else:
                self._states[name] = np.zeros((count, system.states))

    @property
    def failed(self) -> np.ndarray:
        """Which models (N, k), in their arrangement, have answered something that is not finite."""
        return self._arranged(self._failed)[1]

    @property
    def _moment(self) -> str:
        """The step and the generation, as messages name them."""
        return f"[step {self._step_number}, generation {self._generation}]"

    @contextmanager
    def _refusing(self, rule: str) -> Iterator[None]:
        """Turn whatever a function of the user's raises into an error that says the rule and when."""
        try:
            yield
        except Exception as error:
            raised = f"it raised {type(error).__name__}: {error}"
            raise CustomSystemError(f"{rule}; {raised} {self._moment}.") from error

    def own_stimuli(self) -> np.ndarray:
        """Return what the system and the models do by themselves in the next step (g + k, S)."""
        stimuli = []
        for name, step, parameters, count in self._steps:
            shape = (count, self._stimuli)
            rule = f"`{name}.own` must return finite stimuli (n, S) = {shape}"
            with self._refusing(rule):
                stimulus = np.asarray(step.own(self._states[name], *parameters), dtype=np.float64)
            if stimulus.shape != shape:
                raise CustomSystemError(f"{rule}; got shape {stimulus.shape} {self._moment}.")
            if not np.isfinite(stimulus).all():
                raise CustomSystemError(f"{rule}; got one that is not {self._moment}.")
            stimuli.append(stimulus)
        return np.concatenate(stimuli)

    def answer(self, stimuli: np.ndarray) -> np.ndarray:
        """Return centered observations (N, g + k, D) of the next step, under stimuli (N, g + k, S).

        Those that are not finite become 0.
        """
        self._rows = len(stimuli)
        genuine, counterfeit = np.split(stimuli, [self._genuine // self._rows], axis=1)
        size = stimuli.shape[2]
        flat = np.concatenate((genuine.reshape(-1, size), counterfeit.reshape(-1, size)))
        when = self._moment
        observed: np.ndarray = np.empty((self._count, len(self._center)))
        start = 0
        for name, step, parameters, count in self._steps:
            rows = slice(start, start + count)
            start += count
            shape = (count, len(self._center))
            rule = f"`{name}` must return the next state, and observations (n, D) = {shape}"
            with self._refusing(rule):
                state = self._states[name]
                self._states[name], answers = step(state, *parameters, flat[rows], self._rng)
                answers = np.asarray(answers, dtype=np.float64)
            if answers.shape != shape:
                got = f"got shape {answers.shape}"
                raise CustomSystemError(f"{rule}; {got} {when}. Repair it.")
            observed[rows] = answers
        failed = ~np.isfinite(observed).all(axis=1)
        if failed[: self._genuine].any():
            rule = "`genuine` must return finite observations"
            raise CustomSystemError(f"{rule}; got one that is not {when}. Repair it.")
        observed[failed] = self._center
        self._failed |= failed
        self._step_number += 1
        return np.concatenate(self._arranged(observed - self._center), axis=1)

    def _arranged(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return rows of trials as (N, g, ...) of the system, and (N, k, ...) of models."""
        genuine, models = np.split(flat, [self._genuine])
        shape = (self._rows, -1, *flat.shape[1:])
        return genuine.reshape(shape), models.reshape(shape)


def _system_of(
    stimulus: Stimulus,
    signals: Sequence[str],
    center: Sequence[float],
    scale: Sequence[float],
    **fields: Any,
) -> StimulatedSystem:
    """Return a system of which these signals are observed.

    The inputs that are stimuli have half their range as a scale.
    """
    half = (stimulus.high - stimulus.low) / 2
    inputs = len(stimulus.inputs)
    return StimulatedSystem(
        signals=(*signals, *stimulus.inputs),
        center=(*center, *stimulus.center[:inputs].tolist()),
        input_scale=(*scale, *half[:inputs].tolist()),
        samples=0,
        samples_per_generation=0,
        stimulus=stimulus,
        **fields,
    )


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
    settings: dict[str, Any] = dict(options)
    for name in _NOT_FOR_STIMULI:
        rule = "be left out for a system with stimuli"
        require(name not in settings, name, rule, settings.get(name))
    example = 'For example signals=("speed",), steps=100.'
    require("signals" in settings, "signals", "name what is observed", "nothing", example)
    require("steps" in settings, "steps", "be the number of steps of a trial", "nothing", example)
    system_parameters = read_parameters(parameters)
    stimulus = _stimulus_of(settings)
    true: tuple[float, ...] = ()
    if isinstance(genuine, Mapping):
        true = StimulatedSystem.true_of(genuine, system_parameters)
        genuine = None
    name = settings.get("name", "own-system")
    signals = settings["signals"]
    count = len(signals)
    system = _system_of(
        stimulus,
        signals,
        [0.0] * count,
        [1.0] * count,
        name=name,
        title=settings.get("title", name),
        parameters=system_parameters,
        steps=settings["steps"],
        interval_s=float(settings.get("interval_s", 0.0)),
        true=true,
        opponents=settings.get("opponents", 10),
        states=settings.get("states", 1),
    )
    try:
        # Inputs of networks are scaled by what the system does under random stimuli
        with system.open(Arguments(genuine=genuine, simulate=simulate)) as source:
            rng = np.random.default_rng(GENUINE)
            samples = source.genuine_samples(_SCALING_TRIALS, rng)
    except CustomSystemError as error:
        where = f"[the first {_SCALING_TRIALS} trials, whose stimuli no classifier chooses]"
        raise CustomSystemError(f"{error} {where}") from error
    center, scale = scales_of(samples[..., :count].reshape(-1, count), recorded=False)
    return replace(
        system,
        center=center + system.center[count:],
        input_scale=scale + system.input_scale[count:],
    )


def _stimulus_of(settings: Mapping[str, Any]) -> Stimulus:
    ranges = settings["stimulus"]
    if isinstance(ranges, Mapping):
        checked = {}
        for name, bounds in ranges.items():
            pair = array("stimulus", bounds, "2", place=repr(str(name)))
            checked[str(name)] = tuple(pair.tolist())
        ranges = checked
    passive = settings.get("passive", "")
    recorded: Any = ()
    if not isinstance(passive, str):
        remedy = "Series of stimuli, or one of: " + ", ".join(PASSIVE)
        recorded = _frozen(array("passive", passive, "R T S", remedy=remedy))
        passive = "recorded"
    return Stimulus(ranges, settings.get("levels", 0), cast(Any, passive), recorded)


def read_stimuli(path: Path, system: StimulatedSystem) -> StimulatedSystem:
    """Return a system that is watched under stimuli of a table with a heading (CSV).

    It has a column for each stimulus, and "trial" where there are several series.
    """
    try:
        table: Any = np.genfromtxt(
            path, delimiter=",", names=True, dtype=np.float64, encoding="utf-8"
        )
    except (OSError, ValueError) as error:
        refuse("passive", f"be one of {', '.join(PASSIVE)}, or a file", f"{path} ({error})")
    columns = table.dtype.names or ()
    names = system.stimulus.names
    fits = set(names) <= set(columns)
    rule = f"have the columns {', '.join(names)}, and trial for several series"
    require(fits, "passive", rule, ", ".join(columns) or "none", place=str(path))
    rows = np.stack([np.atleast_1d(table[name]) for name in names], axis=-1)
    trial = np.zeros(len(rows))
    if "trial" in columns:
        trial = np.atleast_1d(table["trial"])
    series = [rows[trial == number] for number in dict.fromkeys(trial.tolist())]
    lengths = sorted(set(map(len, series)))
    rule = f"hold series of {system.steps} steps"
    require(lengths == [system.steps], "passive", rule, lengths, place=str(path))
    recorded = _frozen(np.stack(series))
    return replace(system, stimulus=replace(system.stimulus, passive="recorded", recorded=recorded))


def _frozen(series: np.ndarray) -> tuple[tuple[tuple[float, ...], ...], ...]:
    return tuple(tuple(map(tuple, trial)) for trial in series.tolist())


_LIGHT: dict[str, Any] = {
    "stimulus": Stimulus({"light": (0.0, 1.0)}),
    "signals": ("speed",),
    "center": (5.0,),
    "scale": (4.0,),
    "parameters": _examples.LIGHT_PARAMETERS,
    "true": _examples.LIGHT_TRUTH,
}
_WHEELS = {"left_wheel": (-1.0, 1.0), "right_wheel": (-1.0, 1.0)}
_SENSORS: dict[str, Any] = {
    "stimulus": Stimulus(_WHEELS),
    "signals": ("reading1", "reading2", "reading3"),
    "center": (15.0,) * 3,
    "scale": (15.0,) * 3,
    "parameters": _examples.SENSOR_PARAMETERS,
    "true": _examples.SENSOR_TRUTH,
}
# As published: classifiers see readings as they are, and not what the wheels do.
_INFRARED: dict[str, Any] = {
    "stimulus": Stimulus(_WHEELS, shown=False),
    "signals": tuple(f"reading{k}" for k in range(1, 9)),
    "center": (0.0,) * 8,
    "scale": (1.0,) * 8,
    "parameters": _epuck.INFRARED_PARAMETERS,
    "true": _epuck.INFRARED_TRUTH,
}
_RANGEFINDER: dict[str, Any] = {
    "stimulus": Stimulus(_WHEELS, shown=False),
    "signals": ("answer",),
    "center": (0.0,),
    "scale": (1.0,),
    "parameters": _epuck.RANGEFINDER_PARAMETERS,
    "true": _epuck.RANGEFINDER_TRUTH,
}


def _named(name: str, title: str, fields: Mapping[str, Any]) -> StimulatedSystem:
    # Trials of 10 s, as in the paper.
    return _system_of(
        name=name, title=title, behavior_name=name, steps=100, interval_s=0.1, **fields
    )


STIMULATED: dict[str, StimulatedSystem] = {
    "light-response": _named("light-response", "Response to light", _LIGHT),
    "light-response-stochastic": _named(
        "light-response-stochastic", "Response to light, by chance", _LIGHT
    ),
    "sensor-configuration": _named("sensor-configuration", "Sensors of a robot", _SENSORS),
    "infrared-sensors": _named("infrared-sensors", "Infrared sensors of an e-puck", _INFRARED),
    "rangefinder-response": _named(
        "rangefinder-response", "Rangefinder of an e-puck", _RANGEFINDER
    ),
}
"""Systems with stimuli, by name: what classifiers may interrogate."""
