"""Section 4.5: least squares instead of classifiers."""

from ._conduct import EXPERIMENT

__all__ = ["EXPERIMENT"]
