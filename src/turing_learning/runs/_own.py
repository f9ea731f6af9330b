"""Systems of one's own: from what a caller hands over to what a run is made of, and back again."""

import logging
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict

import numpy as np

from turing_learning.config import Configuration, ConfigurationError, OwnConfiguration, nearest
from turing_learning.models import Parameter
from turing_learning.purposes import GENUINE
from turing_learning.sources import (
    Genuine,
    OwnSource,
    OwnSystem,
    SplitSamples,
    cut_samples,
    read_genuine,
    same_time_step,
)
from turing_learning.swarm import SCENARIOS, Scenario
from turing_learning.trajectories import DIRECTED, SIGNALS, Signals, Trajectories

from .folder._errors import RunFolderError
from .folder._folder import RunFolder, going_on

_LOGGER = logging.getLogger("turing_learning")

Range = tuple[float | None, float | None] | Parameter
"""Lower and upper bound of a parameter, None for an open side; or all that can be said of one."""


class OwnOptions(TypedDict, total=False):
    """What may be said of a system of one's own, beyond its samples, its simulator and the parameters.

    name
        A word for folders and tables; "own-system" by default.
    title
        What stands above the report; the name by default.
    signals
        Names of the D signals per step; those of the samples' `names`, if they have some, by default.
    length
        How samples of different lengths are cut: "shortest", or a number of steps; None refuses them.
    held_out
        Share of the genuine samples that are never learned from, 0.2 by default; or which ones, counted from 0. Samples
        that come as `learning` and `held_out`, such as windows of recorded motion, are split already; a live source has
        none.
    samples_per_generation
        Genuine samples that the classifiers judge in a generation, drawn anew each time; as many as there are models by
        default, or all if there are fewer.
    vectorized
        Whether the simulator takes all models at once, (M, P) -> (M, T, D), as it does by default, or one, (P,) -> (T, D).
    batches
        Number of calls of a vectorized simulator in a generation, each with random numbers of its own; as many as
        there are workers by default, else 1. The result depends on it, as it does not on the number of workers.
    workers
        Number of processes that call the simulator; None calls it in this one.
    timeout_s
        Longest duration of a call (s), with workers only.
    """

    name: str
    title: str
    signals: tuple[str, ...]
    length: int | Literal["shortest"] | None
    held_out: Any
    samples_per_generation: int
    vectorized: bool
    batches: int
    workers: int | None
    timeout_s: float | None


def describe_system(genuine: Any, parameters: Mapping[str, Range], options: OwnOptions) -> tuple[OwnSystem, Genuine]:
    """Return a system as frozen data, and its samples; see `infer`.

    Raises
    ------
    ConfigurationError
        If anything is refused.
    """
    genuine = observed(genuine)
    try:
        data = read_genuine(
            genuine,
            length=options.get("length"),
            held_out=options.get("held_out"),
            rng=np.random.default_rng(GENUINE),
        )
        center, scale = data.scales()
        name, signals = options.get("name", "own-system"), _signals(options, genuine, data.samples.shape[2])
        system = OwnSystem(
            name=name,
            title=options.get("title", name),
            parameters=_parameters(parameters),
            signals=signals,
            steps=data.samples.shape[1],
            center=center,
            input_scale=scale,
            samples=0 if data.live else len(data.samples),
            samples_per_generation=options.get("samples_per_generation", 0),
            held_out=tuple(data.held_out.tolist()),
            batches=_batches(options),
            digest=data.digest,
            interval_s=float(getattr(genuine, "interval_s", 0.0)),
            headings=_headings(genuine) if set(DIRECTED) & set(signals) else "",
        )
    except ConfigurationError:
        raise
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    _tell_what_is_constant(genuine, system, data)
    return system, data


def _tell_what_is_constant(genuine: Any, system: OwnSystem, data: Genuine) -> None:
    """Warn of signals that never vary; raise ConfigurationError for a recording in which nothing does.

    Samples of another kind are taken even so: a model without noise can be found by a constant.
    """
    said = ", ".join(f"{system.signals[d]} is {system.center[d]:.6g}" for d in data.constant)
    if isinstance(genuine, SplitSamples) and len(data.constant) == len(system.signals):
        raise ConfigurationError(
            f"`genuine` must be windows of motion that varies; got the same at every step of all of them: {said}. See what "
            "`recording.check()` finds, and give windows of individuals that move."
        )
    if said:
        _LOGGER.warning(
            "Genuine samples do not vary in every signal: %s, at every step of all of them. If that is not what was observed, "
            "repair the samples, or leave the signal out.",
            said,
        )


def observed(genuine: Any) -> Any:
    """Return genuine samples as they are given, and of a scenario or its name a source of its agents' motion.

    Raises
    ------
    ConfigurationError
        If there is no scenario of that name, or a recording is given that has not been cut into samples.
    """
    if isinstance(genuine, Trajectories | Signals):
        raise ConfigurationError(
            f"`genuine` must be samples, into which a recording is cut; got {type(genuine).__name__}. Give windows of it, for "
            "example of 4 s: genuine=recording.windows(length_s=4.0), where recording is what `load_trajectories` returned."
        )
    if isinstance(genuine, str):
        if genuine not in SCENARIOS:
            raise ConfigurationError(
                f"`genuine` must be samples, a scenario or the name of one; got {genuine!r}. {nearest(genuine, SCENARIOS)} A file "
                "is read with `load_trajectories`."
            )
        genuine = SCENARIOS[genuine]
    if not isinstance(genuine, Scenario):
        return genuine
    from turing_learning.swarm import ObservedSwarm

    return ObservedSwarm(genuine)


def open_source(system: OwnSystem, data: Genuine, simulate: Any, options: OwnOptions) -> OwnSource:
    """Return the sample source of a run; the caller closes it.

    Raises
    ------
    ConfigurationError
        If the simulator or a setting is refused.
    """
    _refuse_others_samples(system, simulate)
    try:
        return OwnSource(system, data, simulate, workers=options.get("workers"), timeout_s=options.get("timeout_s"))
    except ValueError as error:
        raise ConfigurationError(str(error)) from error


def _refuse_others_samples(system: OwnSystem, simulate: Any) -> None:
    """Raise ConfigurationError if a simulator says that it does not simulate this system, as a family of models can."""
    told = ("parameters", "signals", "interval_s", "steps")
    parameters, signals, interval, steps = (getattr(simulate, name, None) for name in told)
    if isinstance(parameters, Mapping) and tuple(parameters) != system.parameter_names:
        raise ConfigurationError(
            f"`simulate` must have the parameters of the run, {', '.join(system.parameters)}, in this order; got "
            f"{', '.join(map(str, parameters))}. Give the simulator that the run has, or its parameters."
        )
    if isinstance(signals, tuple) and signals != system.signals and {*signals, *system.signals} <= set(SIGNALS):
        raise ConfigurationError(
            f"`simulate` must have the signals of the samples, {', '.join(system.signals)}, in this order; got "
            f"{', '.join(signals)}. Give the family of models signals={system.signals}."
        )
    _refuse_other_headings(system, simulate)
    known = system.interval_s  # 0 if it is not
    if known and isinstance(interval, float | int) and not same_time_step(interval, known):
        raise ConfigurationError(
            f"`simulate` must have the time step of the samples, {known:.6g} s; got {interval:.6g} s. Give the family of models "
            f"interval_s={known:.6g}, or samples at its rate."
        )
    if isinstance(steps, int) and steps != system.steps:
        raise ConfigurationError(
            f"`simulate` must have as many steps as the samples, {system.steps}; got {steps}. Give the family of models "
            f"steps={system.steps}."
        )


def _refuse_other_headings(system: OwnSystem, simulate: Any) -> None:
    """Raise ConfigurationError if a simulator says that it measures with headings, and the samples are without, or vice versa."""
    simulated, name = _headings(simulate), type(simulate).__name__
    if (system.headings, simulated) == ("without", "with"):
        raise ConfigurationError(
            f"`simulate` must have no headings, as the samples have none; got {name}, whose speeds are negative backwards. Give "
            "another family of models, or windows of a recording with headings."
        )
    if (system.headings, simulated) == ("with", "without"):
        raise ConfigurationError(
            f"`simulate` must have headings, as the samples do; got {name}, whose speeds are never negative. Give a family of "
            "models with headings, or measure the samples without: dataclasses.replace(recording, headings=None).windows(...)."
        )


def _headings(measured: Any) -> Literal["", "with", "without"]:
    known = getattr(measured, "headings", None)
    if not isinstance(known, bool):
        return ""
    return "with" if known else "without"


def given_again(
    folder: RunFolder, configuration: Configuration, genuine: Any, simulate: Any, options: OwnOptions
) -> Genuine | None:
    """Return the samples of a stored run, None if they are not given; a run that is finished needs none, but no others either.

    Raises
    ------
    ConfigurationError
        If the simulator is another, or something is given that the run has no use for.
    RunFolderError
        If the samples are not those that the run began with.
    """
    if not isinstance(configuration, OwnConfiguration):
        refuse_without_system(genuine=genuine, simulate=simulate, **options)
        return None
    if simulate is not None:
        _refuse_others_samples(configuration.scenario, simulate)
    return None if genuine is None else same_data(folder.path, configuration.scenario, genuine)


def reopen_source(
    folder: RunFolder, configuration: Configuration, data: Genuine | None, simulate: Any, options: OwnOptions
) -> OwnSource | None:
    """Return the sample source with which a stored run goes on; None for a run of simulated robots.

    Raises
    ------
    ConfigurationError
        If the simulator or a setting is refused.
    RunFolderError
        If simulator or samples are missing.
    """
    if not isinstance(configuration, OwnConfiguration):
        return None
    if data is None or simulate is None:
        missing = "genuine" if data is None else "simulate"
        raise RunFolderError(
            f"`{missing}` must be given to go on with a system of one's own, which no folder can hold whole; got nothing "
            f"[{folder.path}]. Call {going_on(folder.path, configuration)} from Python."
        )
    return open_source(configuration.scenario, data, simulate, options)


def refuse_without_source(configuration: Configuration, source: object | None) -> None:
    """Raise ConfigurationError if a configuration alone cannot run."""
    if isinstance(configuration, OwnConfiguration) and source is None:
        raise ConfigurationError(
            f"`simulate` must be given for a system of one's own; got the configuration of {configuration.scenario.name!r} "
            "alone. Call `turing_learning.infer(genuine=..., simulate=..., parameters=...)` from Python."
        )


def refuse_without_system(**given: Any) -> None:
    """Raise ConfigurationError if something is given that only a system of one's own has a use for."""
    for name, value in given.items():
        if value is not None:
            raise ConfigurationError(
                f"`{name}` must be left out for simulated robots; got {_shown(value)}. A system of one's own has "
                "`genuine`, `simulate` and `parameters`, and no scenario."
            )


def refuse_unknown_options(options: Mapping[str, Any], known: Iterable[str]) -> None:
    """Raise ConfigurationError if an option is none of the known arguments of a call; the message names the nearest of them."""
    for name, value in options.items():
        if name not in known:
            raise ConfigurationError(f"`{name}` must be a known option; got {_shown(value)}. {nearest(name, known)}")


def _shown(value: Any) -> str:
    return repr(value) if isinstance(value, str | int | float | bool) else type(value).__name__


def _signals(options: OwnOptions, genuine: Any, count: int) -> tuple[str, ...]:
    names: Any = options.get("signals") or getattr(genuine, "names", None)
    if isinstance(names, str):
        raise ConfigurationError(f"`signals` must be a tuple of names; got {names!r}. For one signal: ({names!r},).")
    if names is not None and not (isinstance(names, Sequence) and all(isinstance(name, str) for name in names)):
        raise ConfigurationError(f'`signals` must be a tuple of names; got {names!r}. For example ("speed", "turn").')
    return tuple(names or (f"signal{d}" for d in range(count)))


def _parameters(given: Any) -> dict[str, Parameter]:
    if not isinstance(given, Mapping):
        raise ConfigurationError(
            f"`parameters` must be a dict name -> (low, high); got {_shown(given)}. For example "
            '{"speed": (0, 20), "turn_noise": (0, None)}.'
        )
    return {name: _parameter(name, value) for name, value in given.items()}


def _parameter(name: str, value: Any) -> Parameter:
    if isinstance(value, Parameter):
        return value
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise ConfigurationError(
            f"`parameters` must have two bounds (low, high) or a `Parameter` for each name; got {value!r} [{name!r}]. "
            "None leaves a side open."
        )
    try:
        return Parameter(*value)
    except ValueError as error:
        raise ConfigurationError(f"{error} [parameter {name!r}]") from error


def _batches(options: OwnOptions) -> int:
    vectorized, workers = options.get("vectorized", True), options.get("workers")
    if type(vectorized) is not bool:
        raise ConfigurationError(f"`vectorized` must be True or False; got {vectorized!r}.")
    if vectorized:
        sound = type(workers) is int and workers >= 1  # others are refused by those who call the simulator
        batches: Any = options.get("batches", workers if sound else 1)
        if type(batches) is not int or batches < 1:
            raise ConfigurationError(f"`batches` must be an integer of at least 1; got {batches!r}.")
        return batches
    if "batches" in options:
        raise ConfigurationError(
            f"`batches` must be left out where vectorized is False; got {options['batches']!r}. Every model has a call of "
            "its own."
        )
    return 0


def same_data(place: Path, system: OwnSystem, genuine: Any) -> Genuine:
    """Return the samples of a stored run as they are given again.

    Raises
    ------
    RunFolderError
        If they are others.
    """
    genuine = observed(genuine)
    if callable(genuine) != system.live:
        kind = "a live source" if system.live else "an array of samples"
        raise RunFolderError(f"`genuine` must be {kind}, as when the run began; got {_shown(genuine)} [{place}].")
    held_out = np.array(system.held_out, dtype=np.int64)
    if system.live:
        return Genuine(np.zeros((1, system.steps, len(system.signals))), held_out, genuine)
    steps = np.shape(getattr(genuine, "learning", ()))[1:2]
    if steps and steps[0] != system.steps:
        raise RunFolderError(
            f"`genuine` must be windows of {system.steps} steps, as when the run began; got {steps[0]} [{place}]. Cut them as then."
        )
    try:
        data = Genuine(cut_samples(genuine, system.steps), held_out)
    except ValueError as error:
        raise RunFolderError(f"{error} [{place}]") from error
    if data.digest != system.digest:
        raise RunFolderError(
            f"`genuine` must be the samples that the run began with, of SHA-256 {system.digest[:12]}...; got others, "
            f"{data.digest[:12]}... [{place}]. Give the same, or start a new run."
        )
    return data
