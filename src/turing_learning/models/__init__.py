"""What is inferred: from the numbers that an optimizer varies to the parameters of a model.

`Parameter`
    One parameter in its user's units: bounds, linear or logarithmic scale, initial range, and the map to them.
"""

from ._parameters import Parameter

__all__ = ["Parameter"]
