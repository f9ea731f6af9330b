"""Swarms of simulated robots.

`Scenario` (with `Robot`, `Objects`, `Arena`, `Sensor`, `Trial`) says what moves and what it senses; `AGGREGATION` and
`OBJECT_CLUSTERING` are the paper's case studies, `SCENARIOS` names them all. `initial_poses` places a swarm, `simulate`
runs trials of it, with networks as `Drivers` of robots that are not reactive, and `observe` only measures speeds. `MixedSwarm` is
the sample source of the paper's main setup, replicas mixed into a group of agents; `SeparatedSwarm` never mixes them.
"""

from typing import TYPE_CHECKING, Any

from ._presets import AGGREGATION, OBJECT_CLUSTERING, SCENARIOS
from ._scenario import Arena, Objects, Robot, Scenario, Sensor, Trial

if TYPE_CHECKING:
    from ._drivers import Drivers, drivers_of
    from ._simulate import Simulation, initial_poses, observe, simulate
    from ._sources import MixedSwarm, SeparatedSwarm

__all__ = [
    "AGGREGATION",
    "OBJECT_CLUSTERING",
    "SCENARIOS",
    "Arena",
    "Drivers",
    "MixedSwarm",
    "Objects",
    "Robot",
    "Scenario",
    "Sensor",
    "SeparatedSwarm",
    "Simulation",
    "Trial",
    "drivers_of",
    "initial_poses",
    "observe",
    "simulate",
]

_LAZY = (
    dict.fromkeys(("Simulation", "initial_poses", "observe", "simulate"), "_simulate")
    | dict.fromkeys(("MixedSwarm", "SeparatedSwarm"), "_sources")
    | dict.fromkeys(("Drivers", "drivers_of"), "_drivers")
)


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use, so that scenarios stay cheap to import."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_LAZY[name]}", __name__), name)
