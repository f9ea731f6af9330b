"""What is inferred: from the numbers that an optimizer varies to the parameters of a model, and to what robots execute.

`Parameter`
    One parameter in its user's units: bounds, linear or logarithmic scale, initial range, and the map to them.
`Representation`
    What a model of a robot is: names of its parameters, the map from genomes to them, and to a `Behavior`, what robots execute.
`ReactiveModel`, `MorphologyModel`
    Representations: wheel speeds for each sensor state; the same, and the field of view. `REPRESENTATIONS` names them.
"""

from ._parameters import Parameter
from ._representations import (
    FULL_VIEW,
    REPRESENTATIONS,
    Behavior,
    MorphologyModel,
    ReactiveModel,
    Representation,
)

__all__ = [
    "FULL_VIEW",
    "REPRESENTATIONS",
    "Behavior",
    "MorphologyModel",
    "Parameter",
    "ReactiveModel",
    "Representation",
]
