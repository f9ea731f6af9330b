"""New samples of the estimate beside the genuine ones, and solutions that are images of others.
Decision 0037."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.analysis import predictive_check, resemblance
from turing_learning.coevolution import SampleSource

from ._buffer import SampleBuffer
from ._matching import Matched
from ._readout import Evidence
from ._space import SearchSpace

TRIALS_PER_SAMPLE = 20
"""For so many trials of the run, one new sample is simulated, within the two bounds below."""

FEWEST_SAMPLES = 30
"""Fewest new samples."""

MOST_SAMPLES = 150
"""Most new samples."""

MIRRORED_APART = 0.6
"""Standard deviations between a solution and its mirror image, from which on they are two.

For each root of the number of genuine samples.
"""

EXCHANGED_APART = 0.3
"""The same of an image by exchanged parameters."""

LEAST_IMAGE = 0.05
"""p-value of new samples from which the image of a solution is a solution, too."""

IMAGES = 8
"""Images whose samples are simulated, at most."""

NEIGHBORS = 20
"""Trials beside an image whose judgments say whether it is worth simulating."""

NEAR_IMAGE = 0.05
"""Least distance from an image that counts, in units of the space."""


@dataclass(frozen=True, eq=False)
class Examination:
    """What new samples say of a solution."""

    report: dict[str, np.ndarray]  #: "examined" (2,): p-value and difference; "statistic": its name
    draws: np.ndarray  #: (D, P), of the solutions and of their images that are as good
    mode: np.ndarray  #: (D,), to which of these each draw belongs


@dataclass(frozen=True, eq=False)
class Examiner:
    """Simulates draws of a solution anew, and compares the samples with the genuine ones."""

    source: SampleSource
    space: SearchSpace
    genuine: np.ndarray  #: (K, T, D), all genuine samples, as they are judged
    signals: tuple[str, ...]  #: Names of the D signals

    def examine(
        self,
        matched: Matched,
        evidence: Evidence,
        buffer: SampleBuffer,
        trials: int,
        rng: np.random.Generator,
    ) -> Examination:
        """Examine a solution of a run of so many trials.

        If it passes, look for images of it that pass, too.
        """
        count = int(np.clip(trials // TRIALS_PER_SAMPLE, FEWEST_SAMPLES, MOST_SAMPLES))
        others = buffer.samples[buffer.usable, 0], buffer.parameters[buffer.usable]
        modes = range(int(matched.mode.max()) + 1)
        solutions = [matched.draws[matched.mode == number] for number in modes]
        checks = []
        fresh = []
        for draws in solutions:
            models, samples = self._simulated(draws, count // len(solutions), rng)
            checks.append(
                predictive_check(
                    self.genuine, samples, models, draws, names=self.signals, rng=rng, others=others
                )
            )
            fresh.append(samples)
        best = max(checks, key=lambda check: check.p_value)
        report = {
            "examined": np.array([best.p_value, best.difference]),
            "statistic": np.array(best.statistic),
        }
        images = []
        if best.p_value >= LEAST_IMAGE:
            for draws, number in self._images(solutions, evidence)[:IMAGES]:
                _, samples = self._simulated(draws, count // 2, rng)
                if resemblance(samples, fresh[number], self.signals, rng) >= LEAST_IMAGE:
                    images.append(draws)
        if not images:
            return Examination(report, matched.draws, matched.mode)
        together = [*solutions, *images]
        sizes = [len(part) for part in together]
        mode = np.repeat(np.arange(len(together)), sizes)
        return Examination(report, np.concatenate(together), mode)

    def _simulated(
        self, draws: np.ndarray, count: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Simulate so many of the draws (D, P).

        Return those that have not failed, and their samples (count, T, D).
        """
        models = draws[rng.permutation(len(draws))[:count]]
        samples = self.source.collect(self.space.to_numbers(models), rng)
        failed = getattr(self.source, "failed", np.zeros(len(models), dtype=bool))
        return models[~failed], samples.counterfeit[~failed, 0]

    def _images(
        self, solutions: Sequence[np.ndarray], evidence: Evidence
    ) -> list[tuple[np.ndarray, int]]:
        """Return images of solutions by symmetries, and whose they are.

        Those first whose trials look most genuine.

        They lie apart from all solutions: so far that samples of models halfway would be told.
        """
        images: list[tuple[np.ndarray, int]] = []
        for number, draws in enumerate(solutions):
            for order, signs in self.space.symmetries:
                image = np.asarray(signs) * draws[:, list(order)]
                distance = MIRRORED_APART if min(signs) < 0 else EXCHANGED_APART
                far = distance * np.sqrt(len(self.genuine))
                before = [*solutions, *(other for other, _ in images)]
                if all(_apart(image, other, far) for other in before):
                    images.append((image, number))
        unlike = [_unlikeness(image, evidence) for image, _ in images]
        return [images[k] for k in np.argsort(unlike, kind="stable")]


def _unlikeness(image: np.ndarray, evidence: Evidence) -> float:
    """Return how far observers tell the trials beside draws (D, P) from the genuine samples.

    Mean squared deviations.
    """
    scale = np.maximum(image.std(axis=0), NEAR_IMAGE)
    distances = ((evidence.parameters - np.median(image, axis=0)) / scale) ** 2
    near = np.argsort(distances.sum(axis=1))[:NEIGHBORS]
    outputs = evidence.counterfeit[near]
    genuine = evidence.genuine
    spread = np.sqrt(outputs.var(axis=0) + genuine.var(axis=0)) + 1e-3
    deviations = (outputs.mean(axis=0) - genuine.mean(axis=0)) / spread
    return float((deviations**2).mean())


def _apart(some: np.ndarray, others: np.ndarray, far: float) -> bool:
    """Say whether draws (D, P) lie beside others in a parameter.

    Their central 90 %, and so many standard deviations away.
    """
    low, high = np.quantile(some, [0.05, 0.95], axis=0)
    other_low, other_high = np.quantile(others, [0.05, 0.95], axis=0)
    distance = np.abs(np.median(some, axis=0) - np.median(others, axis=0))
    spread = np.maximum(some.std(axis=0), others.std(axis=0))
    beside = (high < other_low) | (low > other_high)
    return bool((beside & (distance > far * spread)).any())
