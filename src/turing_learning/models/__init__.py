"""What is inferred: from the numbers that an optimizer varies to the parameters of a model, and to what robots execute.

`Parameter`
    One parameter in its user's units: bounds, linear or logarithmic scale, initial range, and the map to them.
`Representation`
    What a model of a robot is: names of its parameters, the map from genomes to them, and to a `Behavior`,
    what robots execute; how results describe it, and which `Jumps` the optimizer may make.
`ReactiveModel`, `MorphologyModel`
    Gray boxes, whose parameters agents have, too: wheel speeds for each sensor state; the same, and the field
    of view. `FULL_VIEW` is the largest field of view.
`ElmanModel`
    Black boxes: networks from the sensor reading to the wheel speeds, described by what they put out.
"""

from ._parameters import Parameter
from ._representation import FULL_VIEW, Behavior, ElmanModel, Jumps, MorphologyModel, ReactiveModel, Representation

__all__ = [
    "FULL_VIEW", "Behavior", "ElmanModel", "Jumps", "MorphologyModel", "Parameter", "ReactiveModel",
    "Representation",
]  # fmt: skip
