"""From what a caller hands over to a system with stimuli."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..arrays import array
from ..errors import brief, refuse, require
from ..purposes import GENUINE
from ..systems import CustomOptions, CustomSystemError, Given, Range
from ..systems._describe import read_parameters
from ._stimulus import PASSIVE, Stimulus
from ._system import StimulatedSystem

_OBSERVED = 200  # trials that the scale of what is observed is found in
_NOT_FOR_STIMULI = ("length", "held_out", "samples_per_generation", "vectorized", "batches", "workers", "timeout_s")


def describe_stimulated(
    genuine: Any, simulate: Any, parameters: Mapping[str, Range], options: CustomOptions
) -> StimulatedSystem:
    """Return a system with stimuli as frozen data.

    Parameters
    ----------
    genuine
        The system: name -> true parameter, or a function (state, stimulus (n, S), rng) -> (state, observation (n, D)).
    simulate
        How a model answers, see `Step`.
    parameters, options
        As for `turing_learning.infer`; the options name `signals`, `steps` and `stimulus`.
    """
    given: dict[str, Any] = dict(options)
    for name in _NOT_FOR_STIMULI:
        require(name not in given, name, "be left out for a system with stimuli", given.get(name))
    for name, rule in (("signals", "name what is observed"), ("steps", "be the number of steps of a trial")):
        require(name in given, name, rule, "nothing", 'For example signals=("speed",), steps=100.')
    require(callable(simulate), "simulate", "be a function (state, parameters, stimulus, rng)", brief(simulate))
    ranges, known = given["stimulus"], read_parameters(parameters)
    if isinstance(ranges, Mapping):
        pairs = {str(name): ends for name, ends in ranges.items()}
        ranges = {name: tuple(array("stimulus", ends, "2", place=repr(name)).tolist()) for name, ends in pairs.items()}
    passive, recorded = given.get("passive", ""), cast(Any, ())
    if not isinstance(passive, str):
        series = array("passive", passive, "R T S", remedy="Series of stimuli, or one of: " + ", ".join(PASSIVE))
        passive, recorded = "recorded", tuple(tuple(map(tuple, one)) for one in series.tolist())
    stimulus = Stimulus(ranges, given.get("levels", 0), cast(Any, passive), recorded)
    signals, own = (*given["signals"], *stimulus.names), len(given["signals"])
    width = tuple(((stimulus.high - stimulus.low) / 2).tolist())
    true = StimulatedSystem.true_of(genuine, known) if isinstance(genuine, Mapping) else ()
    name = given.get("name", "own-system")
    system = StimulatedSystem(
        name=name, title=given.get("title", name), parameters=known, signals=signals, steps=given["steps"],
        center=(*[0.0] * own, *stimulus.center.tolist()), input_scale=(*[1.0] * own, *width), samples=0,
        samples_per_generation=0, interval_s=float(given.get("interval_s", 0.0)), stimulus=stimulus, true=true,
        opponents=given.get("opponents", 10), states=given.get("states", 1),
    )  # fmt: skip
    try:
        with system.open(Given(genuine=None if true else genuine, simulate=simulate)) as source:
            seen = source.genuine_samples(_OBSERVED, np.random.default_rng(GENUINE))[..., :own].reshape(-1, own)
    except CustomSystemError as error:
        raise CustomSystemError(f"{error} [the first {_OBSERVED} trials, under stimuli by chance]") from error
    return system.scaled(seen)


def read_stimuli(path: Path, system: StimulatedSystem) -> StimulatedSystem:
    """Return a system that is watched under stimuli of a table with a heading (CSV): a column for each, and "trial" for several."""
    try:
        table: Any = np.genfromtxt(path, delimiter=",", names=True, dtype=np.float64, encoding="utf-8")
    except (OSError, ValueError) as error:
        refuse("passive", f"be one of {', '.join(PASSIVE[:2])}, or a file", f"{path} ({error})")
    columns, names = table.dtype.names or (), system.stimulus.names
    rule = f"have the columns {', '.join(names)}, and trial for several series"
    require(set(names) <= set(columns), "passive", rule, ", ".join(columns) or "none", place=str(path))
    rows = np.stack([np.atleast_1d(table[name]) for name in names], axis=-1)
    trial = np.atleast_1d(table["trial"]) if "trial" in columns else np.zeros(len(rows))
    series = [rows[trial == number] for number in dict.fromkeys(trial.tolist())]
    lengths = sorted({len(one) for one in series})
    require(lengths == [system.steps], "passive", f"hold series of {system.steps} steps", lengths, place=str(path))
    return system.watched(np.stack(series))
