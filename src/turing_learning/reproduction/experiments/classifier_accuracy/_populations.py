"""The classifiers of chosen generations of many runs; nothing else of the runs is kept."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.config import Configuration, load_configuration
from turing_learning.reproduction._work import Work

if TYPE_CHECKING:
    from turing_learning.runs import Progress


@dataclass(frozen=True)
class RunSizes:
    """How many runs of how many generations, and what else is set."""

    runs: int = 30
    generations: int = 1000
    first_seed: int = 2001
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the runs."""
        return tuple(range(self.first_seed, self.first_seed + self.runs))

    def configuration(self, scenario: str, preset: str, seed: int) -> Configuration:
        """Return the configuration of a run."""
        own = {"run.generations": self.generations, "run.seed": seed, "run.history": "thin"}
        return load_configuration(None, preset, dict(self.settings) | own, scenario=scenario)


@dataclass(frozen=True)
class Populations:
    """Classifiers of some generations of R runs.

    Attributes
    ----------
    classifiers : (R, G, N, Q)
        Single precision, in which they judge.
    fitness : (R, G, N)
        Their subjective fitness.
    archived : R of (U, Q)
        All that have judged beside them from the archive, each once; U = 0 without an archive.
    judging : R of (G, U)
        In which of the generations each of those did.
    """

    classifiers: np.ndarray
    fitness: np.ndarray
    archived: list[np.ndarray]
    judging: list[np.ndarray]

    @property
    def weights(self) -> int:
        """Number of weights Q of a classifier."""
        return int(self.classifiers.shape[-1])


def run_populations(work: Work, sizes: RunSizes, scenario: str, preset: str, generations: Sequence[int]) -> Populations:
    """Conduct runs, a piece of work for each, and return the classifiers of some generations."""
    pieces = [
        work.arrays(
            f"run-{preset}-seed{seed}",
            partial(_conducted, work, sizes.configuration(scenario, preset, seed), tuple(generations)),
        )
        for seed in sizes.seeds
    ]
    return Populations(
        classifiers=np.stack([piece["classifiers"] for piece in pieces]),
        fitness=np.stack([piece["fitness"] for piece in pieces]),
        archived=[piece["archived"] for piece in pieces],
        judging=[piece["judging"] for piece in pieces],
    )


def _conducted(work: Work, configuration: Configuration, chosen: tuple[int, ...]) -> dict[str, np.ndarray] | None:
    from turing_learning.runs import infer

    kept: dict[str, list[np.ndarray]] = {"classifiers": [], "fitness": []}
    referees: list[np.ndarray] = []

    def keep(progress: "Progress") -> None:
        generation = progress.generation
        if generation.number in chosen:
            kept["classifiers"].append(generation.classifiers.astype(np.float32))
            kept["fitness"].append(generation.classifier_fitness)
            referees.append(generation.referees.astype(np.float32))

    result = infer(config=configuration, observer=keep, should_stop=work.should_stop)
    if not result.complete:
        return None
    archived, places = np.unique(np.concatenate(referees), axis=0, return_inverse=True)
    owners = np.repeat(np.arange(len(referees)), [len(one) for one in referees])
    judging = np.zeros((len(referees), len(archived)), dtype=bool)
    judging[owners, places.reshape(-1)] = True
    return {name: np.stack(arrays) for name, arrays in kept.items()} | {"archived": archived, "judging": judging}
