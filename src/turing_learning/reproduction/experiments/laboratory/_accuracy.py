"""How well the classifiers of the runs in the emulated laboratory tell random models from agents."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.analysis import decision_accuracy
from turing_learning.purposes import ACCURACY_MODELS
from turing_learning.reproduction._work import Work
from turing_learning.reproduction.experiments.classifier_accuracy import BestAccuracies

from ._runs import LaboratoryRuns, laboratory_file


@dataclass(frozen=True)
class RandomModelSizes:
    """How many models, drawn uniformly from all wheel speeds."""

    models: int = 100
    seed: int = 6001


def laboratory_accuracies(work: Work, runs: LaboratoryRuns) -> BestAccuracies:
    """Let the classifiers of all runs and kept generations judge the same trials of random models.

    Source
    ------
    Paper, section 5.5.
    """
    from turing_learning.coevolution import THRESHOLD
    from turing_learning.config import classifier_of
    from turing_learning.robots import load_laboratory

    path = laboratory_file(work, "default")
    samples = work.arrays("random-models", partial(_observed, path, work.sizes.random_models))
    classifier = classifier_of(load_laboratory(path, dict(work.sizes.runs.settings)).configuration)
    genomes = runs.classifiers.reshape(-1, runs.classifiers.shape[-1]).astype(np.float64)
    agents, replicas = (classifier.judge(genomes, samples[name]) >= THRESHOLD for name in ("agents", "replicas"))
    accuracy = decision_accuracy(agents[..., None], replicas[..., None]).reshape(runs.classifier_fitness.shape)
    fittest = runs.classifier_fitness.argmax(axis=2, keepdims=True)  # the first of equals
    highest = accuracy.max(axis=2)
    return BestAccuracies(
        variant="",
        generations=np.array(work.sizes.runs.kept),
        subjective=np.take_along_axis(accuracy, fittest, axis=2)[..., 0],
        objective=highest,
        jury=highest,  # the archive is left out
    )


def _observed(path: Path, sizes: RandomModelSizes) -> dict[str, Any]:
    """Observe each random model once, with the whole chain: links, robots, camera, tracker."""
    from turing_learning.robots import LaboratorySource, laboratory_tracker, load_laboratory, rehearse

    laboratory = load_laboratory(path)
    setup, configuration = laboratory.setup, laboratory.configuration
    rng = np.random.default_rng((ACCURACY_MODELS, sizes.seed))
    models = rng.uniform(-1, 1, (sizes.models, len(configuration.parameter_names)))
    equipment, tracker = rehearse(laboratory, sizes.seed), laboratory_tracker(setup)
    with LaboratorySource(setup, configuration.scenario.control_steps, equipment, tracker) as source:
        samples = source.observe(models, "random-models")
    return {"models": models, "agents": samples.genuine, "replicas": samples.counterfeit[:, 0]}
