"""Past classifiers, which go on judging models."""

from collections.abc import Mapping

import numpy as np

from ..errors import integer
from ..evolution import Seed, check_seed, generation_rng, state_arrays


class ClassifierArchive:
    """A sample of the best classifiers of all past generations, drawn uniformly (reservoir sampling).

    Coevolution forgets: classifiers lose an ability once no model needs it, and models fall back into what
    they had left. Archived classifiers judge the models beside the present ones. They cost no simulation,
    earn nothing, and do not change the fitness of the present classifiers.

    Source: Rosin and Belew, New methods for competitive coevolution (1997), the hall of fame; Vitter, Random
    sampling with a reservoir (1985).

    Parameters
    ----------
    capacity
        Largest number of classifiers kept, >= 1.
    seed
        Entropy: a non-negative integer or a sequence of them.

    Attributes
    ----------
    genomes : (B, Q)
        The classifiers kept; empty at first.
    specificity : (B,)
        Share of genuine samples that each judged genuine in its own generation. It stays true, because the
        system does not change.
    """

    def __init__(self, capacity: int, *, seed: Seed) -> None:
        self.capacity = integer("capacity", capacity, 1)
        self.genomes = np.empty((0, 0))
        self.specificity = np.empty(0)
        self._seed = check_seed(seed)
        self._seen = 0

    def admit(self, genome: np.ndarray, specificity: float) -> None:
        """Offer a classifier (Q,): kept with probability capacity / number offered so far, in the place of another."""
        slot = int(generation_rng(self._seed, self._seen).integers(self._seen + 1))
        self._seen += 1
        if len(self.genomes) < self.capacity:
            self.genomes = np.vstack([*self.genomes, genome])
            self.specificity = np.append(self.specificity, specificity)
        elif slot < self.capacity:
            # who was given the arrays before keeps them as they were
            self.genomes = self.genomes.copy()
            self.specificity = self.specificity.copy()
            self.genomes[slot] = genome
            self.specificity[slot] = specificity

    def state(self) -> dict[str, np.ndarray]:
        """Return the classifiers, their specificity, and the number offered so far."""
        return {
            "genomes": self.genomes.copy(),
            "specificity": self.specificity.copy(),
            "seen": np.array(self._seen, dtype=np.int64),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state."""
        shapes = {"genomes": "B Q", "specificity": "B", "seen": ""}
        self.genomes, self.specificity, seen = state_arrays(state, shapes).values()
        self._seen = int(seen)
