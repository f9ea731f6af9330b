"""Swarms of simulated robots.

`Scenario` (with `Robot`, `Objects`, `Arena`, `Sensor`, `Trial`) says what moves and what it senses; `AGGREGATION` and
`OBJECT_CLUSTERING` are the paper's case studies, `AGGREGATION_VIEW_0` and `AGGREGATION_VIEW_60` those of section 4.6.1, where
the field of view is inferred too; `SCENARIOS` names them all. `initial_poses` places a swarm (`Start` says where), `simulate`
runs trials of it (a `Simulation` comes out), with networks as `Drivers` of robots that are not reactive, and `observe` only
measures speeds;
`execution_of` says what agents and replicas execute (an `Execution`). `MixedSwarm` is the sample source of the paper's main setup,
replicas mixed into a group of agents; `SeparatedSwarm` never mixes them. `ObservedSwarm` is a scenario as genuine motion for any
other simulator.
"""

from typing import TYPE_CHECKING, Any

from ._presets import AGGREGATION, AGGREGATION_VIEW_0, AGGREGATION_VIEW_60, OBJECT_CLUSTERING, SCENARIOS
from ._scenario import Arena, Objects, Robot, Scenario, Sensor, Trial
from ._start import Start

if TYPE_CHECKING:
    from ._drivers import Drivers
    from ._execution import Execution, execution_of
    from ._simulate import Simulation, initial_poses, observe, simulate
    from ._sources import MixedSwarm, ObservedSwarm, SeparatedSwarm

__all__ = [
    "AGGREGATION",
    "AGGREGATION_VIEW_0",
    "AGGREGATION_VIEW_60",
    "OBJECT_CLUSTERING",
    "SCENARIOS",
    "Arena",
    "Drivers",
    "Execution",
    "MixedSwarm",
    "Objects",
    "ObservedSwarm",
    "Robot",
    "Scenario",
    "Sensor",
    "SeparatedSwarm",
    "Simulation",
    "Start",
    "Trial",
    "execution_of",
    "initial_poses",
    "observe",
    "simulate",
]

_LAZY = (
    dict.fromkeys(("Simulation", "initial_poses", "observe", "simulate"), "_simulate")
    | dict.fromkeys(("MixedSwarm", "ObservedSwarm", "SeparatedSwarm"), "_sources")
    | dict.fromkeys(("Execution", "execution_of"), "_execution")
    | {"Drivers": "_drivers"}
)


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use, so that scenarios stay cheap to import."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
