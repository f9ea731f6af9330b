"""From what a caller hands over to a custom system as frozen data, and its samples."""

import logging
from collections.abc import Mapping
from typing import Any, Literal, TypedDict, cast

import numpy as np

from ..errors import RefusedError, brief, integer, refuse, require
from ..models import Parameter
from ..purposes import GENUINE
from ..trajectories import DIRECTED
from ._custom import CustomSystem, headings_of
from ._genuine import Genuine, SplitSamples, cut_samples, observed, read_genuine
from ._system import Source

_LOGGER = logging.getLogger("turing_learning")

Range = tuple[float | None, float | None] | Parameter
"""Lower and upper bound of a parameter, None for an open side; or all that can be said of one."""


class CustomOptions(TypedDict, total=False):
    """Options of a custom system, beyond its samples, its simulator and the parameters.

    From `stimulus` on they are those of a system with stimuli, see docs/interaction.md.
    """

    name: str  #: A word for folders and tables; "own-system" by default
    title: str  #: What stands above the report; the name by default
    signals: tuple[
        str, ...
    ]  #: Names of the D signals per step; by default the samples' `names`, if any
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
    #: own; as many as there are workers by default, else 1. The result depends on it, as it does
    #: not on the number of workers
    batches: int
    workers: int | None  #: Number of processes that call the simulator; None calls it in this one
    timeout_s: float | None  #: Longest duration of a call (s), with workers only
    provenance: Mapping[
        str, Any
    ]  #: Name -> value, JSON: where the samples come from, for the run's manifest
    stimulus: Mapping[str, tuple[float, float]]  #: Name -> (low, high) of each
    levels: int  #: 0, or one of how many values
    passive: Any  #: Empty where the classifiers choose, "random", "constant", or series (R, T, S)
    steps: int  #: Of a trial
    states: int  #: Numbers of a state
    opponents: int  #: Models that each classifier meets in a generation
    interval_s: float  #: Duration of a step (s)


def describe(
    genuine: Any, parameters: Mapping[str, Range], options: CustomOptions
) -> tuple[CustomSystem, Genuine]:
    """Return a custom system as frozen data, and its samples.

    Parameters
    ----------
    genuine, parameters, options
        As for `turing_learning.infer`.
    """
    genuine = observed(genuine)
    asked, rng = (options.get("length"), options.get("held_out")), np.random.default_rng(GENUINE)
    data = read_genuine(genuine, length=asked[0], held_out=asked[1], rng=rng)
    center, scale = data.scales()
    name, names = (
        options.get("name", "own-system"),
        options.get("signals") or getattr(genuine, "names", None),
    )
    # its letters would be taken for names
    require(
        not isinstance(names, str),
        "signals",
        "be a tuple of names",
        brief(names),
        f"For one signal: ({names!r},).",
    )
    signals = tuple(names or (f"signal{d}" for d in range(data.samples.shape[2])))
    system = CustomSystem(
        name=name, title=options.get("title", name), parameters=read_parameters(parameters),
        signals=signals, steps=data.samples.shape[1], center=center, input_scale=scale,
        samples=0 if data.live else len(data.samples), held_out=tuple(data.held_out.tolist()), digest=data.digest,
        samples_per_generation=options.get("samples_per_generation", 0), batches=_batches(options),
        interval_s=float(getattr(genuine, "interval_s", 0.0)), smooth_frames=int(getattr(genuine, "smooth_frames", 1)),
        headings=headings_of(genuine) if set(DIRECTED) & set(signals) else "",
    )  # fmt: skip
    constant = ", ".join(f"{signals[d]} is {center[d]:.6g}" for d in data.constant)
    if isinstance(genuine, SplitSamples) and len(data.constant) == len(signals):
        remedy = "See what `recording.check()` finds, and give windows of individuals that move."
        got = f"the same at every step of all of them: {constant}"
        refuse("genuine", "be windows of motion that varies", got, remedy)
    if constant:  # a model without noise can be found by a constant
        remedy = "If that is not what was observed, repair the samples, or leave the signal out."
        message = (
            "Genuine samples do not vary in every signal: %s, at every step of all of them. %s"
        )
        _LOGGER.warning(message, constant, remedy)
    return system, data


def describe_simulated(
    system: CustomSystem, source: Source, parameters: np.ndarray, rng: np.random.Generator
) -> tuple[CustomSystem, Genuine]:
    """Return the same system with as many samples as it was learned from, simulated with parameters (P,) by its source."""
    data = source.genuine
    assert data is not None
    count = len(data.learning if data.live is None else cut_samples(data.live(rng), system.steps))

    def simulated(rng: np.random.Generator) -> np.ndarray:
        return source.simulate(np.tile(parameters, (count, 1)), rng)[:, 0]

    names = ("name", "title", "signals", "samples_per_generation", "vectorized")
    options = cast(CustomOptions, {name: getattr(system, name) for name in names})
    if system.vectorized:
        options["batches"] = system.batches
    if not system.live:
        options["held_out"] = 0.0
    return describe(simulated(rng) if data.live is None else simulated, system.parameters, options)


def read_parameters(given: Any) -> dict[str, Parameter]:
    """Return parameters by name, checked; each is given as a `Parameter` or as two bounds."""
    found = {}
    for name, value in given.items():
        if not isinstance(value, Parameter):
            bounds, place = tuple(value), repr(name)
            rule = "have two bounds (low, high) or a `Parameter` for each name"
            require(
                len(bounds) == 2,
                "parameters",
                rule,
                brief(bounds),
                "None leaves a side open.",
                place=place,
            )
            try:
                value = Parameter(*bounds)
            except ValueError as error:
                raise RefusedError(f"{error} [parameter {name!r}]") from error
            except OverflowError:
                refuse("parameters", rule, "one too large", place=place)
        found[name] = value
    return found


def _batches(options: CustomOptions) -> int:
    """Return the number of calls of a simulator of several models in a generation.

    0 if it takes one model.
    """
    vectorized, workers = options.get("vectorized", True), options.get("workers")
    if vectorized:
        sound = (
            type(workers) is int and workers >= 1
        )  # others are refused by what calls the simulator
        return integer("batches", options.get("batches", workers if sound else 1), 1)
    rule, remedy = "be left out where vectorized is False", "Every model has a call of its own."
    require("batches" not in options, "batches", rule, options.get("batches"), remedy)
    return 0
