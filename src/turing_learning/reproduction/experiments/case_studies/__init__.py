"""Section 4.3: both case studies."""

from ._conduct import EXPERIMENT

__all__ = ["EXPERIMENT"]
