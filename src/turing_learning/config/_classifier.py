"""From a configuration to the classifiers' network."""

from typing import TYPE_CHECKING

from ._sections import Configuration

if TYPE_CHECKING:
    from turing_learning.classifiers import ElmanClassifier


def classifier_of(configuration: Configuration) -> "ElmanClassifier":
    """Return the network that the classifiers of a run share; the kernels are imported only here."""
    from turing_learning.classifiers import ElmanClassifier

    scale = configuration.input_scale
    return ElmanClassifier(
        inputs=len(scale), hidden=configuration.classifiers.hidden, scale=scale, threads=configuration.threads
    )
