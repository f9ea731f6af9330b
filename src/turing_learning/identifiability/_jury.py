"""Fresh classifiers, evolved to tell two fixed sets of samples apart."""

from dataclasses import dataclass

import numpy as np

from turing_learning.coevolution import THRESHOLD, Classifier, Judgments, classifier_reward
from turing_learning.evolution import EvolutionStrategy


@dataclass(frozen=True, eq=False)
class Jury:
    """Classifiers with votes.

    Attributes
    ----------
    classifier
        Judges.
    genomes : (N, Q)
        Those that vote.
    weights : (N,)
        Of the votes, summing to 1; none where no classifier could tell the samples apart.
    """

    classifier: Classifier
    genomes: np.ndarray
    weights: np.ndarray

    def score(self, samples: np.ndarray) -> np.ndarray:
        """Return the weighted share of votes (S,) that say genuine, of samples (S, T, D)."""
        if not len(self.weights):
            return np.full(len(samples), 0.5)
        return self.weights @ (self.classifier.judge(self.genomes, samples) >= THRESHOLD)


def train_jury(
    classifier: Classifier,
    genuine: np.ndarray,
    counterfeit: np.ndarray,
    *,
    generations: int,
    population: int,
    seed: tuple[int, ...],
) -> Jury:
    """Evolve classifiers as a run does, by the paper's reward, on samples (K, T, D) and (S, T, D) that stay the same.

    The better half of the last population votes; a vote weighs Youden's J on these samples where that is positive.
    """
    half = population // 2
    strategy = EvolutionStrategy(classifier.parameters, parents=half, offspring=population - half, seed=seed)
    samples = np.concatenate((genuine, counterfeit))
    for _ in range(generations):
        strategy.tell(classifier_reward(_judgments(classifier, strategy.ask(), samples, len(genuine))))
    genomes = strategy.ask()
    competence = 2 * classifier_reward(_judgments(classifier, genomes, samples, len(genuine))) - 1
    best = np.argsort(-competence, kind="stable")[:half]
    voters = best[competence[best] > 0]
    return Jury(classifier, genomes[voters], competence[voters] / max(competence[voters].sum(), 1e-12))


def _judgments(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray, genuine: int) -> Judgments:
    outputs = classifier.judge(genomes, samples)
    return Judgments(outputs[:, :genuine], outputs[:, genuine:, None])
