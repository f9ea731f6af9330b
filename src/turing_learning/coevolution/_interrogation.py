"""Ways to confront classifiers with the system and the models."""

import numpy as np

from ._judgments import Judgments
from ._protocols import Classifier, InteractiveSampleSource, SampleSource
from ._samples import Samples


class PassiveInterrogation:
    """All classifiers judge the same samples: they do not influence what they observe.

    Parameters
    ----------
    source
        Yields the samples of a generation.
    classifier
        Judges them.

    Source
    ------
    Paper, section 3.1.
    """

    def __init__(self, source: SampleSource, classifier: Classifier) -> None:
        self.source = source
        self.classifier = classifier

    def __call__(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:
        """Collect samples of the M models (M, P) once; return the judgments of the N classifiers (N, Q).

        Referees (B, Q) judge the models' samples too.

        Raises
        ------
        ValueError
            If the source or the classifier returns another number of samples or outputs than it was asked for.
        """
        return _judge(self.classifier, classifiers, _collect(self.source, models, rng), referees)


class InteractiveInterrogation:
    """Each classifier judges samples of its own, and may influence them.

    Parameters
    ----------
    source
        Yields the samples, once for each classifier. Where it is an `InteractiveSampleSource`, each classifier
        meets ``source.facing(classifier)``; any other source yields independent samples for each.
    classifier
        Judges them.

    Source
    ------
    Paper, section 3.1, footnote 1.
    """

    def __init__(self, source: SampleSource, classifier: Classifier) -> None:
        self.source = source
        self.classifier = classifier

    def __call__(
        self,
        models: np.ndarray,
        classifiers: np.ndarray,
        rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:
        """Collect samples of the M models (M, P) for each of the N classifiers (N, Q); return the judgments.

        Referees (B, Q) judge samples of their own, too.

        Raises
        ------
        ValueError
            If the source or the classifier returns another number of samples or outputs than it was asked
            for, or the source not the same number for every classifier.
        """
        parts = [self._interrogate(models, genome, rng) for genome in classifiers]
        shapes = sorted({(*p.genuine_outputs.shape[1:], *p.counterfeit_outputs.shape[1:]) for p in parts})
        if len(shapes) > 1:
            raise ValueError(
                f"`source` must yield the same numbers of samples (K, M, C) for every classifier; got {shapes}."
            )
        referee_parts = [self._interrogate(models, genome, rng) for genome in ([] if referees is None else referees)]
        return Judgments(
            np.concatenate([p.genuine_outputs for p in parts]),
            np.concatenate([p.counterfeit_outputs for p in parts]),
            np.concatenate([p.counterfeit_outputs for p in referee_parts]) if referee_parts else None,
        )

    def _interrogate(self, models: np.ndarray, genome: np.ndarray, rng: np.random.Generator) -> Judgments:
        source = self.source.facing(genome) if isinstance(self.source, InteractiveSampleSource) else self.source
        return _judge(self.classifier, genome[None], _collect(source, models, rng))


def _collect(source: SampleSource, models: np.ndarray, rng: np.random.Generator) -> Samples:
    samples = source.collect(models, rng)
    if len(samples.counterfeit) != len(models):
        raise ValueError(
            f"`source` must yield counterfeit samples of each of the M = {len(models)} models; "
            f"got samples of {len(samples.counterfeit)}."
        )
    return samples


def _judge(
    classifier: Classifier, genomes: np.ndarray, samples: Samples, referees: np.ndarray | None = None
) -> Judgments:
    genuine = _outputs(classifier, genomes, samples.genuine)
    if referees is None or len(referees) == 0:
        return Judgments(genuine, _judge_counterfeit(classifier, genomes, samples))
    counterfeit = _judge_counterfeit(classifier, np.concatenate((genomes, referees)), samples)
    return Judgments(genuine, counterfeit[: len(genomes)], counterfeit[len(genomes) :])


def _judge_counterfeit(classifier: Classifier, genomes: np.ndarray, samples: Samples) -> np.ndarray:
    models, count, *series = samples.counterfeit.shape
    outputs = _outputs(classifier, genomes, samples.counterfeit.reshape(models * count, *series))
    return outputs.reshape(len(genomes), models, count)


def _outputs(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
    outputs = classifier.judge(genomes, samples)
    if outputs.shape != (len(genomes), len(samples)):
        raise ValueError(
            f"`classifier.judge` must return outputs of shape (N, S) = ({len(genomes)}, {len(samples)}); "
            f"got {outputs.shape}."
        )
    return outputs
