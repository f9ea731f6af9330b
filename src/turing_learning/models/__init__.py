"""What is inferred: from the numbers that an optimizer varies to the parameters of a model, and to what robots execute.

`Parameter`
    One parameter in its user's units: bounds, linear or logarithmic scale, initial range, and the
    map to them.
    `LARGEST_DECADE` limits it; it is one of the `Settings` that files of configuration fill.
`Representation`
    What a model of a robot is: names of its parameters, the map from genomes to them, and to a
    `Behavior`, what robots execute; how results describe it, and which `Jumps` the optimizer may
    make.
`ReactiveModel`, `MorphologyModel`
    Gray boxes, whose parameters agents have, too: wheel speeds for each sensor state; the same, and
    the field of view. `FULL_VIEW` is the largest field of view.
`REPRESENTATIONS`
    Representations by the names that scenarios have for them.
`ElmanModel`
    Black boxes: networks from the sensor reading to the wheel speeds, described by what they put
    out.
"""

from ._parameters import LARGEST_DECADE, Parameter, Settings
from ._representation import (
    FULL_VIEW,
    REPRESENTATIONS,
    Behavior,
    ElmanModel,
    Jumps,
    MorphologyModel,
    ReactiveModel,
    Representation,
)

__all__ = [
    "FULL_VIEW", "LARGEST_DECADE", "REPRESENTATIONS", "Behavior", "ElmanModel", "Jumps", "MorphologyModel",
    "Parameter", "ReactiveModel", "Representation", "Settings",
]  # fmt: skip
