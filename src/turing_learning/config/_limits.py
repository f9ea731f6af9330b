"""What a configuration may ask of a machine: numbers, memory, and time between two chances to stop."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from turing_learning.sources import OwnSystem

from ._errors import ConfigurationError

if TYPE_CHECKING:
    from turing_learning.swarm import Scenario

    from ._sections import Configuration

SMALLEST, LARGEST = (
    1e-9,
    1e9,
)  # of the scenario's numbers (cm, g, s), so that no square or ratio leaves the range of floats
LARGEST_NEURONS = 255  # inputs and hidden neurons, as in `classifiers.ElmanClassifier`
LARGEST_GIB = 64.0
LARGEST_WORK = 1e11  # physics steps of single robots in a generation: minutes; a run stops between generations only

_USUAL = {
    "models.parents": 50, "models.offspring": 50, "classifiers.parents": 50, "classifiers.offspring": 50,
    "classifiers.hidden": 5, "models.hidden": 5, "scenario.agents": 10, "scenario.replicas": 1, "scenario.objects.count": 10,
    "scenario.trial.duration_s": 10.0, "scenario.trial.physics_steps": 10, "run.checkpoint_every": 50,
}  # fmt: skip


def check_limits(configuration: "Configuration") -> None:
    """Raise ValueError if a run would leave the range of numbers, of memory, or of patience."""
    own = isinstance(configuration.scenario, OwnSystem)
    if not own:
        _check_numbers(configuration)
    _check_scale(configuration)
    _check_neurons(configuration)
    _check_sizes(configuration, _own_demands(configuration) if own else _demands(configuration))
    if not own:
        _check_work(configuration)


def require_whole_cycles(scenario: "Scenario", duration_s: float) -> None:
    """Raise ConfigurationError if a `duration` that is asked for is no whole number of control cycles."""
    try:
        scenario.trial.steps_of(duration_s, "duration")
    except ValueError as error:
        raise ConfigurationError(str(error)) from error


def require_seen(configuration: "Configuration") -> None:
    """Raise ConfigurationError if a sensor tells objects apart that are not there: how robots react to them could not be inferred.

    For new runs; such a one that is stored can be opened and gone on with.
    """
    scenario = configuration.scenario
    if isinstance(scenario, OwnSystem) or scenario.objects.count:
        return
    if reading := scenario.sensor.reading_of("object"):
        raise ConfigurationError(
            "`scenario.objects.count` must be at least 1 where the sensor tells objects apart, without which the parameters "
            f"vl{reading} and vr{reading} cannot be inferred; got 0. Set it, or leave 'object' out of scenario.sensor.readings and "
            "these two speeds out of scenario.controller."
        )


def _check_numbers(configuration: "Configuration") -> None:
    for key, value in _numbers(asdict(configuration.scenario), "scenario."):
        if value != 0 and not SMALLEST <= abs(value) <= LARGEST:
            raise ValueError(f"`{key}` must be 0 or of a size between {SMALLEST:g} and {LARGEST:g}; got {value}.")


def _check_scale(configuration: "Configuration") -> None:
    own = configuration.classifiers.input_scale == "robot"
    rule = (
        "`scenario.robot.wheel_distance_cm` must make the largest speeds"
        if own
        else "`classifiers.input_scale` must be"
    )
    for value in configuration.input_scale:
        if not SMALLEST <= value <= LARGEST:
            raise ValueError(f"{rule} between {SMALLEST:g} and {LARGEST:g}; got {value:g}.")


def _numbers(table: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, float]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{name}.")
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, float | int):
                yield prefix + name, number


def _check_neurons(configuration: "Configuration") -> None:
    inputs, hidden = len(configuration.input_scale), configuration.classifiers.hidden
    if inputs + hidden > LARGEST_NEURONS:
        raise ValueError(
            f"`classifiers.hidden` must be at most {LARGEST_NEURONS - inputs}, as a network has at most "
            f"{LARGEST_NEURONS} inputs and hidden neurons; got {hidden}."
        )


Demand = tuple[str, float, set[str]]
"""What needs memory, how many bytes, and the settings that add up to it."""

_SIZES = {"models.parents", "models.offspring", "classifiers.parents", "classifiers.offspring", "classifiers.hidden"}
_SWARM = {"scenario.agents", "scenario.replicas"}
_TIME = {"scenario.trial.duration_s"}


def _check_sizes(configuration: "Configuration", demands: Iterable[Demand]) -> None:
    for what, size, keys in demands:
        if size > LARGEST_GIB * 2**30:
            need = f"{what} needs {size / 2**30:.3g} GiB, and {LARGEST_GIB:g} are allowed"
            raise ValueError(f"{_largest(configuration, keys, need)}")


def _demands(configuration: "Configuration") -> Iterator[Demand]:
    scenario, models, classifiers = configuration.scenario, *_populations(configuration)
    steps = scenario.trial.duration_s / scenario.trial.control_interval_s
    yield _history_demand(configuration)
    groups = _groups(configuration)
    judged = _SIZES - {"classifiers.hidden"} | _SWARM
    yield "judging a generation", 8.0 * classifiers * models * groups * scenario.individuals, judged
    moving = _of_models(_SIZES) | _SWARM | _TIME
    yield "a generation's motion", 64.0 * models * groups * scenario.individuals * steps, moving
    yield (
        "searching the bodies of a trial for near pairs",
        16.0 * (scenario.individuals + scenario.objects.count) ** 2,
        _SWARM | {"scenario.objects.count"},
    )


def _own_demands(configuration: "Configuration") -> Iterator[Demand]:
    system, models, classifiers = configuration.scenario, *_populations(configuration)
    assert isinstance(system, OwnSystem)
    yield _history_demand(configuration)
    genuine = system.samples_per_generation or models
    yield "judging a generation", 8.0 * classifiers * (models + genuine), _SIZES - {"classifiers.hidden"}
    moving = 16.0 * models * system.steps * len(system.signals)
    yield "a generation's motion", moving, _of_models(_SIZES)


def _groups(configuration: "Configuration") -> int:
    """Return the number of trials for each model."""
    return 2 if configuration.scenario.grouping == "separated" else 1


def _history_demand(configuration: "Configuration") -> Demand:
    models, classifiers = _populations(configuration)
    parameters = len(configuration.parameter_names)
    hidden, inputs, run = configuration.classifiers.hidden, len(configuration.input_scale), configuration.run
    weights = hidden * (inputs + hidden + 2) + 1
    population = 16.0 * (models * parameters + classifiers * weights)  # values and step sizes, 8 bytes each
    chunk = 1 if run.history == "thin" else min(run.checkpoint_every, run.generations)
    return (
        "keeping the history between two checkpoints",
        chunk * population,
        _SIZES | {"models.hidden", "run.checkpoint_every"},
    )


def _populations(configuration: "Configuration") -> tuple[int, int]:
    models, classifiers = configuration.models, configuration.classifiers
    return models.parents + models.offspring, classifiers.parents + classifiers.offspring


def _check_work(configuration: "Configuration") -> None:
    scenario, (models, _) = configuration.scenario, _populations(configuration)
    steps = scenario.trial.duration_s / scenario.trial.control_interval_s
    work = float(models) * _groups(configuration) * scenario.individuals * steps * scenario.trial.physics_steps
    if work > LARGEST_WORK:
        need = f"a generation has {work:.3g} physics steps of a robot, and {LARGEST_WORK:g} are allowed"
        keys = _of_models(_SIZES) | _SWARM | _TIME | {"scenario.trial.physics_steps"}
        raise ValueError(_largest(configuration, keys, need))


def _of_models(keys: set[str]) -> set[str]:
    return {key for key in keys if key.startswith("models.")}


def _largest(configuration: "Configuration", keys: set[str], need: str) -> str:
    """Say which of the settings that add up to a need should be smaller: the one farthest above its usual value."""
    values = {key: _looked_up(configuration, key) for key in sorted(keys)}
    key = max(values, key=lambda key: math.log(max(values[key], 1e-9) / _USUAL[key]))
    return f"`{key}` must be smaller, as {need}; got {values[key]}."


def _looked_up(configuration: "Configuration", key: str) -> float:
    value: Any = configuration
    for part in key.split("."):
        value = getattr(value, part)
    return float(value) if isinstance(value, float) else int(value)
