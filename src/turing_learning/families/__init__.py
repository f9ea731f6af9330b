"""Model families: simulators with named parameters, ready for `turing_learning.infer`, and examples for one's own.

==================  ===========================================================================================
`Family`            What all have in common: groups, time steps, signals, and the checks of what is given.
`Particles`         Families of points in the plane, to derive one's own from.
`Vicsek`            Alignment with all within a radius, and noise (Vicsek et al. 1995).
`Couzin`            Zones of repulsion, orientation and attraction (Couzin et al. 2002).
`Boids`             Collision avoidance, velocity matching and flock centering (Reynolds 1987).
`BurstAndCoast`     A persistent random walk in kicks, each followed by a glide (Calovi et al. 2018).
`Composed`          Motion and influences, of which each can be left out: those of `PARTS`.
`Network`           What a network has learned from recordings, with gains (extra `networks`).
`Robots`            The paper's robots, whose controller is a table from sensor state to wheel speeds.
`FAMILIES`          The families of equations by name; `MODELS` has the network, too;
                    `model_named` finds one, or what "module:name" names; `is_model` tells whether there is one.
`as_recorded`       A family with groups, steps and signals as recorded; `Replicates` where recordings differ in group or tank.
`RecordedStarts`    Moments of a recorded group, at which groups of models begin.
`recorded_ranges`   Ranges of the parameters that fit a recording; `said_ranges` reads those of commands, as speed=5:300.
`virtual_group`     A group of any size in any tank, as if recorded; `beyond_recorded` says where it leaves what was recorded.
`tank_sides`        Width and height of a tank that is given as 100x60.
`RecordedSystem`    Recordings, how they are cut into samples, and the family that imitates them; `read_recording` opens one.
==================  ===========================================================================================

A family of one's own derives from `Particles`, names its parameters and yields positions step by step.
Positions and directions of motion are complex numbers x + iy there, one for each model and individual: a turn
is a product then.

Names are listed in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
