"""The representations in which scenarios may describe their agents."""

from collections.abc import Callable

from ._morphology import MorphologyModel
from ._reactive import ReactiveModel
from ._representation import AgentsRepresentation

REPRESENTATIONS: dict[str, Callable[[int], AgentsRepresentation]] = {
    "reactive": ReactiveModel,
    "morphology": MorphologyModel,
}
"""What a scenario may say of its models: name -> the representation of so many sensor states."""
