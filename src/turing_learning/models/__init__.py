"""What is inferred: from the numbers that an optimizer varies to the parameters of a model, and to what a replica executes.

`Parameter`
    One parameter in its user's units: bounds, linear or logarithmic scale, initial range, and the map to them.
`Representation`
    What a robot's model is: names of its numbers, what replicas execute (`Execution`), and how it compares with agents.
`ReactiveModel`, `ElmanModel`
    The paper's two: the agents' own controller with other wheel speeds (gray box), a recurrent network (black box).
"""

from ._elman import STEADY_STEPS, ElmanModel
from ._parameters import Parameter
from ._reactive import ReactiveModel
from ._representation import Execution, Representation

__all__ = ["STEADY_STEPS", "ElmanModel", "Execution", "Parameter", "ReactiveModel", "Representation"]
