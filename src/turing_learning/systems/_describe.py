"""From what a caller hands over to a custom system as frozen data, and its samples."""

import logging
from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypedDict

import numpy as np

from ..errors import RefusedError, brief, integer, refuse, require
from ..models import Parameter
from ..purposes import GENUINE
from ..trajectories import DIRECTED
from ._custom import CustomSystem, headings_of
from ._genuine import (
    PRECISION,
    Genuine,
    SplitSamples,
    cut_samples,
    observed,
    read_genuine,
    table_names,
    unnamed,
)
from ._system import Source

_LOGGER = logging.getLogger("turing_learning")

EXECUTOR_BATCHES = 64
"""Calls of a simulator of several models in a generation by an executor, whatever its size."""

Range = tuple[float | None, float | None] | Parameter
"""Lower and upper bound of a parameter, None for an open side; or all that can be said of one."""


class CustomOptions(TypedDict, total=False):
    """Options of a custom system, beyond its samples, its simulator and the parameters.

    From `stimulus` on they are those of a system with stimuli, see docs/interaction.md.
    """

    name: str  #: A word for folders and tables; "own-system" by default
    title: str  #: What stands above the report; the name by default
    #: Names of the D signals per step; by default the samples' `names`, if any
    signals: tuple[str, ...]
    #: How samples of different lengths are cut: "shortest", or a number of steps; None refuses them
    length: int | Literal["shortest"] | None
    #: Share of the genuine samples that are never learned from, 0.2 by default; or which ones,
    #: from 0. Samples that come as `learning` and `held_out`, as windows do, are split already; a
    #: live source has none
    held_out: Any
    #: Genuine samples that the classifiers judge in a generation, drawn anew each time; as many
    #: as there are models by default, or all if there are fewer
    samples_per_generation: int
    #: Whether the simulator takes all models, (M, P) -> (M, T, D), as by default, or one, (P,) ->
    #: (T, D)
    vectorized: bool
    #: Number of calls of a vectorized simulator in a generation, each with random numbers of its
    #: own; as many as there are workers by default, 64 with an executor, else 1. The result depends
    #: on it, as it does not on the number of workers
    batches: int
    #: Number of processes that call the simulator; None calls it in this one
    workers: int | None
    timeout_s: float | None  #: Longest duration of a call (s), with workers only
    #: What calls the simulator instead, any `concurrent.futures.Executor`: a pool, Dask's, MPI's
    executor: Any
    #: Name -> value, JSON: where the samples come from, for the run's manifest
    provenance: Mapping[str, Any]
    stimulus: Mapping[str, tuple[float, float]]  #: Name -> (low, high) of each
    levels: int  #: 0, or one of how many values
    #: Empty where the classifiers choose, "random", "constant", "own", or series (R, T, S)
    passive: Any
    steps: int  #: Of a trial
    states: int  #: Numbers of a state
    opponents: int  #: Models that each classifier meets in a generation
    interval_s: float  #: Duration of a step (s)


def describe(
    genuine: Any,
    parameters: Mapping[str, Range],
    options: CustomOptions,
    columns: Sequence[str] = (),
) -> tuple[CustomSystem, Genuine]:
    """Return a custom system as frozen data, and its samples.

    Parameters
    ----------
    genuine, parameters, options
        As for `turing_learning.infer`.
    columns
        Of samples that are tables: which ones are signals, all by default.
    """
    genuine = observed(genuine)
    stated: Sequence[str] = options.get("signals") or getattr(genuine, "names", None) or ()
    # The letters of a text would be taken for names.
    rule = "be a tuple of names"
    remedy = f"For one signal: ({stated!r},)."
    require(not isinstance(stated, str), "signals", rule, brief(stated), remedy)
    if callable(genuine):
        # Stored runs know no other names of a live source's tables.
        columns = columns or table_names(stated)
    data = read_genuine(
        genuine,
        length=options.get("length"),
        held_out=options.get("held_out"),
        columns=columns,
        rng=np.random.default_rng(GENUINE),
    )
    signals = tuple(stated) or data.names or unnamed(data.samples.shape[2])
    center, scale = data.scales()
    name = options.get("name", "own-system")
    headings: Literal["", "with", "without"] = ""
    if not set(DIRECTED).isdisjoint(signals):
        headings = headings_of(genuine)
    system = CustomSystem(
        name=name,
        title=options.get("title", name),
        parameters=read_parameters(parameters),
        signals=signals,
        steps=data.samples.shape[1],
        center=center,
        input_scale=scale,
        samples=0 if data.live else len(data.samples),
        held_out=tuple(data.held_out.tolist()),
        digest=data.digest,
        origin=data.origin,
        samples_per_generation=options.get("samples_per_generation", 0),
        batches=_batches(options),
        interval_s=float(getattr(genuine, "interval_s", 0.0)),
        smooth_frames=int(getattr(genuine, "smooth_frames", 1)),
        headings=headings,
    )
    constant_signals = data.constant
    constant = ", ".join(f"{signals[d]} is {center[d]:.6g}" for d in constant_signals)
    if isinstance(genuine, SplitSamples) and len(constant_signals) == len(signals):
        remedy = "See what `recording.check()` finds, and give windows of individuals that move."
        got = f"the same at every step of all of them: {constant}"
        refuse("genuine", "be windows of motion that varies", got, remedy)
    values = data.learning.reshape(-1, len(signals))
    variation = np.ptp(values, axis=0)
    largest_values = np.abs(values).max(axis=0)
    rule = "vary by more than rounding leaves, in one signal or more"
    got = f"{variation.max():.3g} at most, of values up to {largest_values.max():.3g}"
    remedy = (
        "Give samples, also simulated ones, in a smaller unit, or as differences from a constant."
    )
    varies = len(constant_signals) < len(signals) or not variation.any()
    require(varies, "genuine", rule, got, remedy)
    for name, largest, divisor in zip(signals, largest_values, scale, strict=True):
        if 0 < largest < PRECISION and divisor < PRECISION:
            message = (
                "Signal %s is at most %.3g, and is divided by %.3g. "
                "If that is what rounding leaves of 0, leave the signal out."
            )
            _LOGGER.warning(message, name, largest, divisor)
    # A model without noise can be found by a constant
    if constant:
        remedy = "If that is not what was observed, repair the samples, or leave the signal out."
        message = "Constant signal of the genuine samples: %s, at every step of all of them. %s"
        _LOGGER.warning(message, constant, remedy)
    return system, data


def describe_simulated(
    system: CustomSystem, source: Source, parameters: np.ndarray, rng: np.random.Generator
) -> tuple[CustomSystem, Genuine]:
    """Return the same system with as many samples, simulated by its source with parameters (P,)."""
    data = source.genuine
    assert data is not None
    samples = data.learning
    if data.live is not None:
        samples = cut_samples(data.live(rng), system.steps)
    models = np.tile(parameters, (len(samples), 1))

    def simulated(rng: np.random.Generator) -> np.ndarray:
        return source.simulate(models, rng)[:, 0]

    options = CustomOptions(
        name=system.name,
        title=system.title,
        signals=system.signals,
        samples_per_generation=system.samples_per_generation,
        vectorized=system.vectorized,
    )
    if system.vectorized:
        options["batches"] = system.batches
    if not system.live:
        options["held_out"] = 0.0
    genuine = simulated(rng) if data.live is None else simulated
    return describe(genuine, system.parameters, options)


NO_PRIOR = (
    "Classifiers judge models, and no prior enters the search: give two bounds, and where the first "
    "models shall be by `Parameter(low, high, initial=(...))`."
)
"""Why a prior is refused, and what to do instead."""


def read_parameters(ranges: Any) -> dict[str, Parameter]:
    """Return parameters by name, checked; each is given as a `Parameter` or as two bounds."""
    parameters = {}
    for name, value in ranges.items():
        if isinstance(value, Parameter):
            parameters[name] = value
        elif callable(getattr(value, "ppf", None)):
            rule = "have a range for each name, not a distribution"
            refuse("parameters", rule, brief(value), NO_PRIOR, place=repr(name))
        else:
            parameters[name] = _parameter_within(tuple(value), name)
    return parameters


def _parameter_within(bounds: tuple[Any, ...], name: Any) -> Parameter:
    where = repr(name)
    rule = "have two bounds (low, high) or a `Parameter` for each name"
    remedy = "None leaves a side open."
    require(len(bounds) == 2, "parameters", rule, brief(bounds), remedy, place=where)
    try:
        return Parameter(*bounds)
    except ValueError as error:
        raise RefusedError(f"{error} [parameter {name!r}]") from error
    except OverflowError:
        refuse("parameters", rule, "one too large", place=where)


def _batches(options: CustomOptions) -> int:
    """Return the number of calls of a simulator of several models in a generation.

    0 if it takes one model.
    """
    if not options.get("vectorized", True):
        rule = "be left out where vectorized is False"
        remedy = "Every model has a call of its own."
        require("batches" not in options, "batches", rule, options.get("batches"), remedy)
        return 0
    calls = 1
    workers = options.get("workers")
    # Others are refused by what calls the simulator
    if type(workers) is int and workers >= 1:
        calls = workers
    if options.get("executor") is not None:
        calls = EXECUTOR_BATCHES
    return integer("batches", options.get("batches", calls), 1)
