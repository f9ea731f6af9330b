"""Beyond section 4.5: likelihood-free inference, and a mixture, instead of classifiers."""

from ._conduct import EXPERIMENT

__all__ = ["EXPERIMENT"]
