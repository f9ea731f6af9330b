"""Past classifiers that go on judging models."""

from collections.abc import Mapping

import numpy as np

from turing_learning.evolution import Seed, check_seed, generation_rng


class ClassifierArchive:
    """A sample of the best classifiers of all past generations, drawn uniformly (reservoir sampling).

    Coevolution forgets: classifiers lose an ability once no model needs it, and models fall back into what they had left.
    Archived classifiers judge the models beside the present ones. They cost no simulation, earn nothing, and do not
    change the fitness of the present classifiers.

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

    Raises
    ------
    ValueError
        If `capacity` or `seed` breaks the rules above.

    Source
    ------
    Rosin and Belew, New methods for competitive coevolution (1997), the hall of fame; Vitter, Random sampling with a
    reservoir (1985).
    """

    def __init__(self, capacity: int, *, seed: Seed) -> None:
        if capacity < 1:
            raise ValueError(f"`capacity` must be 1 or more; got {capacity}.")
        self.capacity = capacity
        self.genomes = np.empty((0, 0))
        self._seed = check_seed(seed)
        self._seen = 0

    def admit(self, genome: np.ndarray) -> None:
        """Offer a classifier (Q,): kept with probability capacity / number offered so far, in the place of another."""
        place = int(generation_rng(self._seed, self._seen).integers(self._seen + 1))
        self._seen += 1
        if len(self.genomes) < self.capacity:
            self.genomes = np.vstack([*self.genomes, genome])
        elif place < self.capacity:
            self.genomes = self.genomes.copy()
            self.genomes[place] = genome

    def state(self) -> dict[str, np.ndarray]:
        """Return the classifiers and the number offered so far."""
        return {"genomes": self.genomes.copy(), "seen": np.array(self._seen, dtype=np.int64)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state.

        Raises
        ------
        ValueError
            If the state lacks an array or holds more classifiers than the capacity.
        """
        if "genomes" not in state or "seen" not in state:
            raise ValueError(f"`state` must hold 'genomes' and 'seen'; got {sorted(state)}.")
        genomes = np.array(state["genomes"], dtype=np.float64)
        if genomes.ndim != 2 or len(genomes) > self.capacity or not np.isfinite(genomes).all():
            raise ValueError(
                f"`state['genomes']` must be at most {self.capacity} finite classifiers (B, Q); got shape {genomes.shape}."
            )
        self.genomes, self._seen = genomes, int(state["seen"])
