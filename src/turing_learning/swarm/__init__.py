"""Swarms of simulated robots.

`Scenario` (with `Robot`, `Objects`, `Item`, `Arena`, `Sensor`, `Trial`, `Tracking`) says what moves
and what it senses;
`AGGREGATION` and `OBJECT_CLUSTERING` are the paper's case studies, `AGGREGATION_VIEW_0` and
`AGGREGATION_VIEW_60` those of section 4.6.1, where the field of view is inferred too; `SCENARIOS`
names them all. `WORLDS` are settings of simulators under a name, see `Scenario.in_world`.
`initial_poses` places a swarm (`Start` says where), `simulate` runs trials of it and returns a
`Simulation`, with networks as `Drivers` of robots that are not reactive; `observe` only measures
speeds, and `Cycles` moves robots one control cycle at a time.
`Trials` says who executes what, from which poses, with which noise (`mixed`, `alone`,
`execution_of`); an `Execution` has a controller for each robot, `AGENT` stands for that of the
agents.
`MixedSwarm` is the sample source of the paper's main setup, replicas mixed into a group of agents;
`SeparatedSwarm` never mixes them. `ObservedSwarm` is a scenario as genuine motion for any other
simulator.

Names are imported on first use, so that scenarios stay cheap to import.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
