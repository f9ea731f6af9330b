"""What a configuration may ask of a machine: numbers, memory, and time between two chances to stop."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
    "classifiers.hidden": 5, "scenario.agents": 10, "scenario.replicas": 1, "scenario.objects.count": 10,
    "scenario.trial.duration_s": 10.0, "scenario.trial.physics_steps": 10, "run.checkpoint_every": 50,
}  # fmt: skip


def check_limits(configuration: "Configuration") -> None:
    """Raise ValueError if a run would leave the range of numbers, of memory, or of patience."""
    _check_numbers(configuration)
    _check_neurons(configuration)
    _check_demand(configuration)


def _check_numbers(configuration: "Configuration") -> None:
    for key, value in _numbers(asdict(configuration.scenario), "scenario."):
        if value != 0 and not SMALLEST <= abs(value) <= LARGEST:
            raise ValueError(f"`{key}` must be 0 or of a size between {SMALLEST:g} and {LARGEST:g}; got {value}.")
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


def _check_demand(configuration: "Configuration") -> None:
    run, scenario, trial = configuration.run, configuration.scenario, configuration.scenario.trial
    models = configuration.models.parents + configuration.models.offspring
    classifiers = configuration.classifiers.parents + configuration.classifiers.offspring
    hidden, inputs = configuration.classifiers.hidden, len(configuration.input_scale)
    weights = hidden * (inputs + hidden + 2) + 1
    steps = trial.duration_s / trial.control_interval_s
    population = 16.0 * (
        models * len(scenario.controller) + classifiers * weights
    )  # values and step sizes, 8 bytes each
    chunk = 1 if run.history == "thin" else min(run.checkpoint_every, run.generations)
    sizes = {"models.parents", "models.offspring", "classifiers.parents", "classifiers.offspring", "classifiers.hidden"}
    swarm = {"scenario.agents", "scenario.replicas"}
    time = {"scenario.trial.duration_s"}
    judged = sizes - {"classifiers.hidden"} | swarm
    demands = (
        ("keeping the history between two checkpoints", chunk * population, sizes | {"run.checkpoint_every"}),
        ("judging a generation", 8.0 * classifiers * models * scenario.individuals, judged),
        ("a generation's motion", 64.0 * models * scenario.individuals * steps, _of_models(sizes) | swarm | time),
        (
            "searching the bodies of a trial for near pairs",
            16.0 * (scenario.individuals + scenario.objects.count) ** 2,
            swarm | {"scenario.objects.count"},
        ),
    )
    for what, size, keys in demands:
        if size > LARGEST_GIB * 2**30:
            need = f"{what} needs {size / 2**30:.3g} GiB, and {LARGEST_GIB:g} are allowed"
            raise ValueError(f"{_largest(configuration, keys, need)}")
    work = float(models) * scenario.individuals * steps * trial.physics_steps
    if work > LARGEST_WORK:
        need = f"a generation has {work:.3g} physics steps of a robot, and {LARGEST_WORK:g} are allowed"
        keys = _of_models(sizes) | swarm | time | {"scenario.trial.physics_steps"}
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
