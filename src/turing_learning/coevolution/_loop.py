"""The Turing Learning loop."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from turing_learning.errors import require
from turing_learning.evolution import (
    Optimizer,
    Seed,
    check_generation,
    check_seed,
    generation_rng,
    join_states,
    state_part,
)

from ._archive import ClassifierArchive
from ._protocols import Interrogation
from ._rewards import Judgments, Reward, classifier_reward, model_reward, specificity


@dataclass(frozen=True, eq=False)
class Generation:
    """Both populations of one generation, scored."""

    number: int  #: 0 for the first
    models: np.ndarray  #: (M, P), parameters of the models
    model_step_sizes: np.ndarray  #: (M, P), their step sizes
    #: (M,), their subjective fitness, equation 1 of the paper, whatever reward the optimizer is told
    model_fitness: np.ndarray
    #: (M,), what the optimizer ranks them by: what it is told, by default that fitness, or its mean over their lives
    model_scores: np.ndarray
    classifiers: np.ndarray  #: (N, Q), parameters of the classifiers
    classifier_step_sizes: np.ndarray  #: (N, Q), their step sizes
    #: (N,), their subjective fitness, equation 2 of the paper, whatever reward the optimizer is told
    classifier_fitness: np.ndarray
    #: "active"; "all accepted" or "all rejected" where every classifier accepts, or rejects, every model
    selection: str
    #: (B, Q), archived classifiers that judged the models beside them; (0, Q) where there were none
    referees: np.ndarray

    @property
    def best_model(self) -> np.ndarray:
        """The model (P,) with the highest subjective fitness, the first of equals: the paper's rule."""
        return self.models[np.argmax(self.model_fitness)]

    @property
    def typical_model(self) -> np.ndarray:
        """The median (P,), parameter by parameter, of the half of the models with the higher scores.

        Of equals the first come first, as in `evolution.EvolutionStrategy`, whose next parents these are where
        mu is half the population. Much less noisy than `best_model`, whose fitness rests on a single trial.
        """
        half = np.argsort(-self.model_scores, kind="stable")[: max(1, len(self.models) // 2)]
        return np.median(self.models[half], axis=0)


class Coevolution:
    """Coevolve models that imitate a system with classifiers that tell system and models apart.

    Source: paper, section 3.1, algorithm 1.

    Parameters
    ----------
    interrogation
        Lets all classifiers judge the system and all models.
    models, classifiers
        Optimizers of the two populations. Give them different seeds.
    seed
        Entropy of the interrogations: a non-negative integer or a sequence of them. In generation g they draw
        from ``default_rng(SeedSequence(seed, spawn_key=(g,)))``.
    reward_models, reward_classifiers
        What the optimizers are told: functions of the judgments that return (M,) and (N,) finite numbers,
        larger being better. By default equations 1 and 2 of the paper.
    archive
        Keeps the best classifier of each generation; those kept judge the models as referees, which only a
        reward such as `jury_reward` takes into account. None: no archive, as in the paper.

    Attributes
    ----------
    generation
        Number of completed generations.
    """

    def __init__(
        self, interrogation: Interrogation, models: Optimizer, classifiers: Optimizer, *, seed: Seed,
        reward_models: Reward = model_reward, reward_classifiers: Reward = classifier_reward,
        archive: ClassifierArchive | None = None,
    ) -> None:  # fmt: skip
        self.generation = 0
        self._interrogation = interrogation
        self._models = models
        self._classifiers = classifiers
        self._reward_models = reward_models
        self._reward_classifiers = reward_classifiers
        self._seed = check_seed(seed)
        self._archive = archive

    def step(self) -> Generation:
        """Run one generation: let the classifiers judge, reward and improve both populations; return them as they were judged.

        Raises
        ------
        RuntimeError
            If the step before this one failed. Call `restore` with the last state to go on.
        ValueError
            If the interrogation or a reward returns something of the wrong shape, or a reward is not finite.
        """
        models = self._models.ask()
        classifiers = self._classifiers.ask()
        rng = generation_rng(self._seed, self.generation)
        referees = classifiers[:0]
        # Archived classifiers judge along, but neither breed nor are rewarded
        if self._archive is None or not len(self._archive.genomes):
            judgments = self._interrogation(models, classifiers, rng)
        else:
            referees = self._archive.genomes
            judgments = self._interrogation(models, classifiers, rng, referees=referees)
            judgments = replace(judgments, referee_specificity=self._archive.specificity)
        # Interrogations may be the user's: a wrong shape would be rewarded in silence
        received = judgments.counterfeit_outputs.shape[:2]
        wanted = (len(classifiers), len(models))
        rule = f"return judgments of N = {wanted[0]} classifiers on M = {wanted[1]} models"
        require(received == wanted, "interrogation", rule, f"{received[0]} and {received[1]}")
        model_rewards = _reward("reward_models", self._reward_models, judgments, len(models))
        classifier_rewards = _reward(
            "reward_classifiers", self._reward_classifiers, judgments, len(classifiers)
        )
        # Before `tell`, which changes them: those with which these individuals were drawn
        steps = self._models.step_sizes, self._classifiers.step_sizes
        model_scores = self._models.tell(model_rewards)
        self._classifiers.tell(classifier_rewards)
        generation = Generation(
            number=self.generation,
            models=models,
            model_step_sizes=steps[0],
            model_fitness=model_reward(judgments),
            model_scores=model_scores,
            classifiers=classifiers,
            classifier_step_sizes=steps[1],
            classifier_fitness=classifier_reward(judgments),
            selection=judgments.selection,
            referees=referees,
        )
        if self._archive is not None:
            best = int(np.argmax(generation.classifier_fitness))
            self._archive.admit(classifiers[best], float(specificity(judgments)[best]))
        self.generation += 1
        return generation

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to go on from here, as arrays; after a step that failed there is no state.

        That is "generation", the states of the optimizers as "models/..." and "classifiers/...", and that of
        the archive, if there is one, as "archive/...".
        """
        states = {"models": self._models.state(), "classifiers": self._classifiers.state()}
        states |= {} if self._archive is None else {"archive": self._archive.state()}
        return {"generation": np.array(self.generation, dtype=np.int64), **join_states(states)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over what `state` returned, from a coevolution with the same settings; allowed at any time.

        A state that lacks an array, or does not fit the settings, is rejected; restore another one to go on.
        """
        generation = check_generation(state)
        self._models.restore(state_part(state, "models/"))
        self._classifiers.restore(state_part(state, "classifiers/"))
        if self._archive is not None:
            self._archive.restore(state_part(state, "archive/"))
        self.generation = generation


def _reward(name: str, reward: Reward, judgments: Judgments, size: int) -> np.ndarray:
    rewards = np.asarray(reward(judgments), dtype=np.float64)
    rule = f"return an array of shape ({size},)"
    require(rewards.shape == (size,), name, rule, str(rewards.shape))
    k = int(np.argmin(np.isfinite(rewards)))
    require(np.isfinite(rewards[k]), name, "return finite numbers", f"{rewards[k]} at {k}")
    return rewards
