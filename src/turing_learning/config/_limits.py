"""What a configuration may ask of a machine: numbers, memory, and time between two chances to stop."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from turing_learning.errors import Refusal, refuse, refusing_as, require
from turing_learning.systems import physics_steps

from ._errors import ConfigurationError

if TYPE_CHECKING:
    from turing_learning.swarm import Scenario

    from ._sections import Configuration

SMALLEST, LARGEST = 1e-9, 1e9  # of a scenario's numbers (cm, g, s): no square or ratio leaves the range of floats
LARGEST_NEURONS = 255  # inputs and hidden neurons, as in `classifiers.ElmanClassifier`
LARGEST_GIB = 64.0
LARGEST_WORK = 1e11  # physics steps of single robots in a generation: minutes; a run stops between generations only

_USUAL = {
    "models.parents": 50, "models.offspring": 50, "classifiers.parents": 50, "classifiers.offspring": 50,
    "classifiers.hidden": 5, "models.hidden": 5, "scenario.agents": 10, "scenario.replicas": 1, "scenario.objects.count": 10,
    "scenario.trial.duration_s": 10.0, "scenario.trial.physics_steps": 10, "run.checkpoint_every": 50,
}  # fmt: skip
_MODELS = ("models.parents", "models.offspring")
_POPULATIONS = (*_MODELS, "classifiers.parents", "classifiers.offspring")
_SWARM = ("scenario.agents", "scenario.replicas")


def check_limits(configuration: "Configuration") -> None:
    """Reject a run that would leave the range of numbers, of memory, or of patience."""
    scenario, inputs = configuration.system.simulated, len(configuration.input_scale)
    for key, value in _numbers(asdict(scenario), "scenario.") if scenario else ():
        fits = value == 0 or SMALLEST <= abs(value) <= LARGEST
        require(fits, key, f"be 0 or of a size between {SMALLEST:g} and {LARGEST:g}", str(value))
    name, rule = "classifiers.input_scale", "be"
    if configuration.classifiers.input_scale == "robot":
        name, rule = "scenario.robot.wheel_distance_cm", "make the largest speeds"
    for value in configuration.input_scale:
        require(SMALLEST <= value <= LARGEST, name, f"{rule} between {SMALLEST:g} and {LARGEST:g}", f"{value:g}")
    hidden, most = configuration.classifiers.hidden, LARGEST_NEURONS - inputs
    because = f"be at most {most}, as a network has at most {LARGEST_NEURONS} inputs and hidden neurons"
    require(hidden <= most, "classifiers.hidden", because, hidden)
    for what, size, keys in _demands(configuration):
        if size > LARGEST_GIB * 2**30:
            _refuse_largest(
                configuration, keys, f"{what} needs {size / 2**30:.3g} GiB, and {LARGEST_GIB:g} are allowed"
            )
    models = configuration.models.parents + configuration.models.offspring
    if scenario and (work := float(models) * physics_steps(scenario)) > LARGEST_WORK:
        keys = (*_MODELS, *_SWARM, "scenario.trial.duration_s", "scenario.trial.physics_steps")
        need = f"a generation has {work:.3g} physics steps of a robot, and {LARGEST_WORK:g} are allowed"
        _refuse_largest(configuration, keys, need)


def require_whole_cycles(scenario: "Scenario", duration_s: float) -> None:
    """Reject a `duration` that is no whole number of control cycles."""
    with refusing_as(ConfigurationError):
        scenario.trial.steps_of(duration_s, "duration")


def require_seen(configuration: "Configuration") -> None:
    """Reject a sensor that tells objects apart that are not there: how robots react to them could not be inferred.

    For new runs; a stored one can be opened and resumed.
    """
    scenario = configuration.system.simulated
    if scenario and not scenario.objects.count and (reading := scenario.sensor.reading_of("object")):
        refuse(
            "scenario.objects.count",
            "be at least 1 where the sensor tells objects apart, without which the parameters "
            f"vl{reading} and vr{reading} cannot be inferred",
            "0",
            "Set it, or leave 'object' out of scenario.sensor.readings and these two speeds out of scenario.controller.",
            error=ConfigurationError,
        )


def _numbers(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, float]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{name}.")
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int):
                yield prefix + name, number


def _demands(configuration: "Configuration") -> Iterator[tuple[str, float, tuple[str, ...]]]:
    """Yield what needs memory, how many bytes, and the settings that add up to it."""
    run, inputs, hidden = configuration.run, len(configuration.input_scale), configuration.classifiers.hidden
    models = configuration.models.parents + configuration.models.offspring
    classifiers = configuration.classifiers.parents + configuration.classifiers.offspring
    weights = hidden * (inputs + hidden + 2) + 1
    population = 16.0 * (models * len(configuration.parameter_names) + classifiers * weights)  # values and step sizes
    chunk = 1 if run.history == "thin" else min(run.checkpoint_every, run.generations)
    keys = (*_POPULATIONS, "classifiers.hidden", "models.hidden", "run.checkpoint_every")
    yield "keeping the history between two checkpoints", chunk * population, keys
    samples, motion, of_system = configuration.system.demands(models)
    yield "judging a generation", 8.0 * classifiers * samples, (*_POPULATIONS, *of_system)
    times = ("scenario.trial.duration_s",) if of_system else ()
    yield "a generation's motion", motion, (*_MODELS, *of_system, *times)
    if scenario := configuration.system.simulated:
        bodies = scenario.individuals + scenario.objects.count
        yield "searching the bodies of a trial for near pairs", 16.0 * bodies**2, (*_SWARM, "scenario.objects.count")


def _refuse_largest(configuration: "Configuration", keys: tuple[str, ...], need: str) -> None:
    """Reject the one of some settings that is farthest above its usual value."""
    values: dict[str, Any] = {}
    for key in sorted(keys):
        values[key] = configuration
        for part in key.split("."):
            values[key] = getattr(values[key], part)
    key = max(values, key=lambda key: math.log(max(values[key], 1e-9) / _USUAL[key]))
    raise ConfigurationError(Refusal(key, f"be smaller, as {need}", str(values[key])))
