"""Ways to confront classifiers with the system and the models."""

import numpy as np

from ..errors import integer, require
from ._protocols import Classifier, InteractiveSource, SampleSource
from ._rewards import Judgments


class PassiveInterrogation:
    """All classifiers judge the same samples: they do not influence what they observe.

    Source: paper, section 3.1.

    Parameters
    ----------
    source
        Yields the samples of a generation.
    classifier
        Judges them.
    """

    def __init__(self, source: SampleSource, classifier: Classifier) -> None:
        self.source = source
        self.classifier = classifier

    def __call__(
        self, models: np.ndarray, classifiers: np.ndarray, rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:  # fmt: skip
        """Collect samples of the M models (M, P) once; return the judgments of the N classifiers (N, Q).

        Referees (B, Q) judge the models' samples too.
        """
        samples = self.source.collect(models, rng)
        rule = f"yield counterfeit samples of each of the M = {len(models)} models"
        got = f"samples of {len(samples.counterfeit)}"
        require(len(samples.counterfeit) == len(models), "source", rule, got)
        genuine = self._outputs(classifiers, samples.genuine)
        jury = classifiers
        if referees is not None:
            jury = np.concatenate((classifiers, referees))
        flat = samples.counterfeit.reshape(-1, *samples.counterfeit.shape[2:])
        counterfeit = self._outputs(jury, flat).reshape(len(jury), *samples.counterfeit.shape[:2])
        own_outputs = counterfeit[: len(classifiers)]
        theirs = counterfeit[len(classifiers) :]
        return Judgments(genuine, own_outputs, theirs if len(theirs) else None)

    def _outputs(self, genomes: np.ndarray, samples: np.ndarray) -> np.ndarray:
        outputs = self.classifier.judge(genomes, samples)
        rule = f"return outputs of shape (N, S) = ({len(genomes)}, {len(samples)})"
        require(
            outputs.shape == (len(genomes), len(samples)),
            "classifier.judge",
            rule,
            str(outputs.shape),
        )
        return outputs


class InteractiveInterrogation:
    """Each classifier meets the system and some models alone, and influences what it sees of them.

    Source: paper, section 3.1, footnote 1; docs/decisions/0032-interaction.md.

    Parameters
    ----------
    source
        Lets classifiers meet the system and models.
    opponents
        Models that each classifier meets in a generation, and as many genuine samples; all models if there are
        fewer. Every model is met by as many classifiers, or by one more. The trials are (N + B) x opponents of
        models, N x opponents genuine.
    """

    def __init__(self, source: InteractiveSource, opponents: int) -> None:
        self.source = source
        self.opponents = integer("opponents", opponents, 1)

    def __call__(
        self, models: np.ndarray, classifiers: np.ndarray, rng: np.random.Generator,
        referees: np.ndarray | None = None,
    ) -> Judgments:  # fmt: skip
        """Return the judgments of the N classifiers (N, Q) on those of the M models (M, P) that they have met.

        Referees (B, Q) meet models, too, and no genuine samples.
        """
        met = self._opponents(len(models), len(classifiers), rng)
        genuine, counterfeit = self._confronted(models, classifiers, met, met.shape[1], rng)
        own_outputs = _spread(counterfeit, met, len(models))
        if referees is None or len(referees) == 0:
            return Judgments(genuine, own_outputs[0], met=own_outputs[1])
        refereed = self._opponents(len(models), len(referees), rng)
        _, outputs = self._confronted(models, referees, refereed, 0, rng)
        theirs = _spread(outputs, refereed, len(models))
        return Judgments(
            genuine, own_outputs[0], theirs[0], met=own_outputs[1], referees_met=theirs[1]
        )

    def _opponents(self, models: int, classifiers: int, rng: np.random.Generator) -> np.ndarray:
        """Return which models (N, k) each classifier meets: the next k of them, in a random order that has no end."""
        count = min(self.opponents, models)
        if count == models:
            return np.tile(np.arange(models), (classifiers, 1))
        indices = (np.arange(classifiers * count) % models).reshape(classifiers, count)
        return rng.permutation(models)[indices][rng.permutation(classifiers)]

    def _confronted(
        self,
        models: np.ndarray,
        genomes: np.ndarray,
        met: np.ndarray,
        genuine: int,
        rng: np.random.Generator,
    ) -> tuple[np.ndarray, np.ndarray]:
        outputs = self.source.confront(models, genomes, met, genuine, rng)
        wanted = ((len(genomes), genuine), met.shape)
        shapes = tuple(output.shape for output in outputs)
        rule = f"return outputs of shapes {wanted[0]} and {wanted[1]}"
        require(shapes == wanted, "source.confront", rule, " and ".join(map(str, shapes)))
        return outputs


def _spread(
    outputs: np.ndarray, met: np.ndarray, models: int
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return outputs (N, k) for the models that were met as (N, M, 1), 0 elsewhere, and which were; None for all."""
    spread = np.zeros((len(met), models), outputs.dtype)
    filled = np.zeros((len(met), models), bool)
    np.put_along_axis(spread, met, outputs, axis=1)
    np.put_along_axis(filled, met, True, axis=1)
    return spread[:, :, None], None if filled.all() else filled
