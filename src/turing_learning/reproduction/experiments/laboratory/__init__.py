"""Section 5: robots in the loop, in an emulated laboratory."""

from ._conduct import EXPERIMENT

__all__ = ["EXPERIMENT"]
