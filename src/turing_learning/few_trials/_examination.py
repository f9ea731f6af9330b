"""New samples of the estimate beside the genuine ones, and solutions that are images of others.
Decisions 0037, 0043 and 0069."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes a second
from scipy.spatial.distance import pdist, squareform

from turing_learning.analysis import predictive_check, resemblance
from turing_learning.coevolution import SampleSource

from ._buffer import SampleBuffer
from ._matching import Matched
from ._observers import Observers
from ._readout import Evidence
from ._ridge import Ridge, ridges
from ._space import SearchSpace
from ._symmetry import Symmetry, SymmetryGroup, oddness, one_side, share_beyond

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
"""The same of an image by exchanged parameters, or by products."""

LEAST_IMAGE_P = 0.005
"""p-value of new samples from which an image of a solution is a solution, too."""

LINEAR_IMAGES = 12
"""Images by linear symmetries whose samples are simulated, at most."""

PRODUCT_IMAGES = 12
"""The same of symmetries with products of parameters, of which more are plausible by chance."""

PRODUCT_MIXTURES = 6
"""Products along which draws may be a mixture, at most."""

SAMPLES_OF_IMAGE = 75
"""Samples of an image, at most."""

FIRST_SAMPLES = 12
"""Samples of an image that are enough to tell most wrong ones."""

SURE_SAMPLES = 300
"""Samples, at most, by which an image that has passed is looked at once more; of the solution as many."""

TRIALS_PER_SURE_SAMPLE = 10
"""For so many trials of the run, one of these is simulated."""

PERMUTATIONS = 999
"""Exchanges of samples of a model and its image by which their differences are held against
chance."""

MOST_VALUES = 600
"""Values of a sample that its image is held against, evenly from all steps and signals."""

MOST_RULED_OUT = 10
"""After so many symmetries of a family are ruled out, the rest of it is not looked at."""

FEWEST_SIMULATED = 10
"""Samples, of those that have not failed, below which nothing is said."""

LEAST_ODD_P = 0.0005
"""p-value from which the first models of a run do not rule a symmetry out, see `oddness`."""

MOST_MOVING_P = 0.01
"""p-value up to which what a symmetry moves says something at all."""

MIXED_SHARE = 0.1
"""Draws may be a mixture if at least this share of them lies on the smaller side."""

DIRECTIONS = 12
"""Principal directions of the observers' outputs that `oddness` sees."""

JUDGES = 200
"""Observers that judge samples of a model and of its image."""

PAIR_PENALTY = 0.3
"""Of the regression on their outputs, in the mean square of the differences of a pair."""

PAIR_FOLDS = 5
"""Parts of the pairs; what is learned from four is asked of the fifth."""

MOST_DRAWS = 3600
"""Draws of all images together, at most: six times those of one solution."""


@dataclass(frozen=True, eq=False)
class Examination:
    """What new samples say of a solution."""

    #: "examined" (2,): p-value and difference; "statistic": its name
    report: dict[str, np.ndarray]
    #: (D, P), of the solutions and of their images that are as good
    draws: np.ndarray
    mode: np.ndarray  #: (D,), to which of these each draw belongs


@dataclass(frozen=True, eq=False)
class Examiner:
    """Simulates draws of a solution anew, and compares the samples with the genuine ones.

    A source whose simulations may fail has `failed` and `probing`, see `systems.FallibleSource`.
    """

    source: SampleSource
    space: SearchSpace
    genuine: np.ndarray  #: (K, T, D), all genuine samples, as they are judged
    signals: tuple[str, ...]  #: Names of the D signals
    observers: Observers  #: What judges samples of a model and of its image

    def examine(
        self,
        matched: Matched,
        group: SymmetryGroup | None,
        buffer: SampleBuffer,
        trials: int,
        rng: np.random.Generator,
    ) -> Examination:
        """Examine a solution of a run of so many trials; add its images by a group of symmetries."""
        count = samples_of(trials)
        run_trials = buffer.samples[buffer.usable, 0], buffer.parameters[buffer.usable]
        modes = range(int(matched.mode.max()) + 1)
        solutions = [matched.draws[matched.mode == number] for number in modes]
        checks = []
        for draws in solutions:
            models = draws[rng.permutation(len(draws))[: count // len(solutions)]]
            samples, usable = self._simulated(models, rng)
            checks.append(
                predictive_check(
                    self.genuine,
                    samples[usable],
                    models[usable],
                    draws,
                    names=self.signals,
                    rng=rng,
                    others=run_trials,
                )
            )
        best = max(checks, key=lambda check: check.p_value)
        report = {
            "examined": np.array([best.p_value, best.difference]),
            "statistic": np.array(best.statistic),
        }
        if group is not None:
            solutions = self.with_images(solutions, group)
        sizes = [len(draws) for draws in solutions]
        mode = np.repeat(np.arange(len(solutions)), sizes)
        return Examination(report, np.concatenate(solutions), mode)

    def symmetries(
        self,
        draws: np.ndarray,
        first_trials: Evidence,
        trials: int,
        rng: np.random.Generator,
        followed: SymmetryGroup | None = None,
    ) -> SymmetryGroup | None:
        """Return what turns draws (D, P) of a solution into others that are as good, apart from it.

        A group that the run has followed counts if its images lie apart.
        The first models of the run are anywhere. If these do not rule a symmetry out, samples
        of an image of the solution are held against samples of itself.
        """
        count = min(samples_of(trials), SAMPLES_OF_IMAGE)
        generators: list[Symmetry] = []
        tried: list[np.ndarray] = []
        group = None
        if followed is not None and self.apart(draws, followed):
            generators.extend(followed.members[1:])
            group = self._group(generators, draws)
        solution = draws if group is None else group.folded(draws)
        chosen = rng.permutation(len(draws))[:count]
        # samples of the solution itself, which all of its images are held against
        solution_samples = None
        for symmetry in self._plausible(draws, first_trials):
            image = symmetry.images_of(solution)
            if any(_alike(image, earlier) for earlier in tried):
                continue
            # what a known symmetry turns back to the solution, or near it, is nothing new
            if group is not None and not self._lies_apart(symmetry, solution, group.folded(image)):
                continue
            if solution_samples is None:
                solution_samples = self._simulated(solution[chosen], rng)
            alike = self._resemble(solution[chosen], solution_samples, image[chosen], rng)
            larger = self._group([*generators, symmetry], solution)
            members = 1 if group is None else len(group.members)
            further = alike and len(larger.members) > members
            if further and self.certain(symmetry, larger, larger.folded(draws), trials, rng):
                generators.append(symmetry)
                group = larger
                solution = group.folded(draws)
                solution_samples = None
            else:
                tried.append(image)
        return group

    def along_ridge(
        self, draws: np.ndarray, trials: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, Ridge] | None:
        """Return draws (D, P) of a solution moved all along a ridge, and the ridge.

        Samples of models at each of its ends have to resemble those of the solution, as many as
        there are recordings at least.
        """
        count = max(trials // TRIALS_PER_SURE_SAMPLE, len(self.genuine), FEWEST_SAMPLES)
        count = min(count, SURE_SAMPLES, len(draws) // 3)
        widest = self.space.widest
        chosen = draws[rng.permutation(len(draws))[:count]]
        samples = None
        for ridge in ridges(draws, widest, self.space.ridges):
            spread = ridge.spread(draws, widest, rng)
            if samples is None:
                samples = self._simulated(chosen, rng)
            outermost = [
                models[rng.permutation(len(models))[:count]] for models in ridge.ends(spread)
            ]
            if all(self._resemble(chosen, samples, models, rng) for models in outermost):
                return spread, ridge
        return None

    def mixture(
        self,
        draws: np.ndarray,
        first_trials: Evidence,
        trials: int,
        rng: np.random.Generator,
        *,
        products: bool = False,
    ) -> SymmetryGroup | None:
        """Return symmetries of the system of which draws (D, P) are a mixture of several images.

        That is, the first family of symmetries that the first models of the run, which are
        anywhere, do not rule out, nor samples of the draws on one side beside those of their
        images. All of its symmetries belong to a system, or none. Products are asked for at the end
        of a run alone: of broad draws many of these hold nearly, which `certain` says of the
        solution in one region.
        """
        outputs = self._outputs(first_trials)
        tried = 0
        for family in self.space.candidates:
            if any(symmetry.logarithmic.any() for symmetry in family) != products:
                continue
            if not any(share_beyond(symmetry, draws) >= MIXED_SHARE for symmetry in family):
                continue
            if not products and not all(
                self._moves_evenly(symmetry, first_trials, outputs, family) for symmetry in family
            ):
                continue
            folded = draws
            # twice: what one symmetry turns may lie on the wrong side of another
            for symmetry in [*family, *family]:
                folded = one_side(symmetry, folded)
            group = self._group(family, folded)
            if len(group.members) == 1:
                continue
            if self.holds(group, group.folded(folded), trials, rng):
                return group
            tried += 1
            if products and tried == PRODUCT_MIXTURES:
                break
        return None

    def certain(
        self,
        symmetry: Symmetry,
        group: SymmetryGroup,
        draws: np.ndarray,
        trials: int,
        rng: np.random.Generator,
    ) -> bool:
        """Say whether images of a solution (D, P) by a group are others, by samples in number.

        A symmetry of the group has just been found. Where models halfway along products are as
        good, both are of one ridge.
        """
        if symmetry.logarithmic.any():
            count = min(samples_of(trials), SAMPLES_OF_IMAGE)
            chosen = draws[rng.permutation(len(draws))[:count]]
            samples = self._simulated(chosen, rng)
            if self._resemble(chosen, samples, symmetry.halfway(chosen), rng):
                return False
        count = int(np.clip(trials // TRIALS_PER_SURE_SAMPLE, FEWEST_SAMPLES, SURE_SAMPLES))
        return self._holds(group, draws, count, rng)

    def holds(
        self, group: SymmetryGroup, draws: np.ndarray, trials: int, rng: np.random.Generator
    ) -> bool:
        """Say whether samples of draws (D, P) resemble those of their images by a group."""
        return self._holds(group, draws, min(samples_of(trials), SAMPLES_OF_IMAGE), rng)

    def _holds(
        self, group: SymmetryGroup, draws: np.ndarray, count: int, rng: np.random.Generator
    ) -> bool:
        """Say the same by so many samples of each."""
        images = np.stack([member.images_of(draws) for member in group.members])
        member = rng.integers(1, len(images), size=len(draws))
        image = images[member, np.arange(len(draws))]
        chosen = rng.permutation(len(draws))[:count]
        solution_samples = self._simulated(draws[chosen], rng)
        return self._resemble(draws[chosen], solution_samples, image[chosen], rng)

    @staticmethod
    def _moves_evenly(
        symmetry: Symmetry, first_trials: Evidence, outputs: np.ndarray, family: Sequence[Symmetry]
    ) -> bool:
        """Say whether outputs change with what a symmetry moves, but not with its sign."""
        by_chance, moving = oddness(symmetry, first_trials.parameters, outputs)
        return by_chance >= LEAST_ODD_P / len(family) and moving <= MOST_MOVING_P

    def apart(self, draws: np.ndarray, group: SymmetryGroup) -> bool:
        """Say whether an image of draws (D, P) by a group lies apart from them."""
        return any(self._apart(member, draws) for member in group.members[1:])

    def _apart(self, symmetry: Symmetry, draws: np.ndarray) -> bool:
        """Say whether the image of draws (D, P) lies apart from them.

        So far that samples of models halfway would be told.
        """
        image = symmetry.images_of(draws)
        inside = (np.abs(np.median(image, axis=0)) <= self.space.widest).all()
        return bool(inside) and self._lies_apart(symmetry, draws, image)

    def _lies_apart(self, symmetry: Symmetry, draws: np.ndarray, image: np.ndarray) -> bool:
        """Say whether an image (D, P) of draws (D, P) by a symmetry is so far from them."""
        distance = MIRRORED_APART
        # of products it is looked at whether models halfway are told
        if symmetry.exchanges or symmetry.logarithmic.any():
            distance = EXCHANGED_APART
        coordinates = symmetry.coordinates(draws), symmetry.coordinates(image)
        return _apart(*coordinates, distance * np.sqrt(len(self.genuine)))

    def _group(self, generators: Sequence[Symmetry], draws: np.ndarray) -> SymmetryGroup:
        """Return the group of some symmetries about draws (D, P)."""
        scale = draws.std(axis=0) + 1e-12
        widest = self.space.widest
        return SymmetryGroup.generated(generators, np.median(draws, axis=0), scale, widest)

    def _outputs(self, first_trials: Evidence) -> np.ndarray:
        """Return the principal directions (N, F) of what observers say of the first models."""
        outputs = first_trials.counterfeit - first_trials.counterfeit.mean(axis=0)
        vectors, values, _ = np.linalg.svd(outputs, full_matrices=False)
        return np.asarray(vectors[:, values > 1e-6 * values[0]][:, :DIRECTIONS])

    def _plausible(self, draws: np.ndarray, first_trials: Evidence) -> list[Symmetry]:
        """Return symmetries whose images of draws (D, P) lie apart, linear ones first.

        None that the first models of a run rule out, and the most plausible of each kind.
        """
        outputs = self._outputs(first_trials)
        linear: list[tuple[float, Symmetry]] = []
        products: list[tuple[float, Symmetry]] = []
        for family in self.space.candidates:
            ruled_out = 0
            for symmetry in family:
                if ruled_out == MOST_RULED_OUT:
                    break
                if not self._apart(symmetry, draws):
                    continue
                by_chance, _ = oddness(symmetry, first_trials.parameters, outputs)
                if symmetry.logarithmic.any():
                    # outputs bend along products, which the F-test takes for noise: it only says
                    # which are tried first
                    products.append((by_chance, symmetry))
                elif by_chance >= LEAST_ODD_P:
                    linear.append((by_chance, symmetry))
                else:
                    ruled_out += 1
        chosen: list[Symmetry] = []
        for plausible, most in ((linear, LINEAR_IMAGES), (products, PRODUCT_IMAGES)):
            plausible.sort(key=lambda entry: -entry[0])
            chosen.extend(symmetry for _, symmetry in plausible[:most])
        return chosen

    def _resemble(
        self,
        models: np.ndarray,
        model_samples: tuple[np.ndarray, np.ndarray],
        image: np.ndarray,
        rng: np.random.Generator,
    ) -> bool:
        """Say whether samples of models (N, P) and of their images (N, P) are alike, pair by pair.

        `model_samples` are those of the models, and which of them have not failed.
        """
        samples, own_usable = model_samples
        parts = []
        for rows in (slice(FIRST_SAMPLES), slice(FIRST_SAMPLES, None)):
            if not len(image[rows]):
                break
            with getattr(self.source, "probing", nullcontext)():
                parts.append(self._simulated(image[rows], rng))
            image_samples, image_usable = (
                np.concatenate(part) for part in zip(*parts, strict=True)
            )
            usable = np.flatnonzero(own_usable[: len(image_usable)] & image_usable)
            if len(usable) < FEWEST_SIMULATED:
                continue
            pairs = samples[usable], image_samples[usable]
            if paired_p_value(models[usable], *pairs, rng) < LEAST_IMAGE_P:
                return False
        if len(usable) < FEWEST_SIMULATED:
            return False
        if resemblance(pairs[1], pairs[0], self.signals, rng) < LEAST_IMAGE_P:
            return False
        return self._learned_p_value(*pairs, rng) >= LEAST_IMAGE_P

    def _learned_p_value(
        self, samples: np.ndarray, image_samples: np.ndarray, rng: np.random.Generator
    ) -> float:
        """Return how often what observers say would tell samples from those of images by chance.

        Statistics that somebody has named do not know of everything, such as the order of skewed
        shocks in time. Squares say whether samples differ more from each other.
        """
        all_samples = np.concatenate((samples, image_samples))
        judgments = self.observers.judge(
            self.observers.draw(JUDGES, all_samples, rng), all_samples
        ).T
        ranks = scipy.stats.rankdata(judgments, axis=0) - (len(all_samples) + 1) / 2
        values = np.concatenate((ranks, ranks**2), axis=1)
        scaled = values / (values.std(axis=0) + 1e-12)
        return learned_p_value(scaled[: len(samples)] - scaled[len(samples) :], rng)

    def with_images(
        self, solutions: Sequence[np.ndarray], group: SymmetryGroup
    ) -> list[np.ndarray]:
        """Return solutions (D, P) with those of their images that are no other solution."""
        distinct: list[np.ndarray] = []
        for number, member in enumerate(group.members):
            for draws in solutions:
                image = member.images_of(draws)
                # the solutions themselves count wherever they are
                if number:
                    image = image[(np.abs(image) <= self.space.widest).all(axis=1)]
                if len(image) and not any(_alike(image, earlier) for earlier in distinct):
                    distinct.append(image)
        step = -(-sum(map(len, distinct)) // MOST_DRAWS)
        return [region[::step] for region in distinct]

    def _simulated(
        self, models: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return samples (N, T, D) of models (N, P), and which of them (N,) have not failed."""
        samples = self.source.collect(self.space.to_numbers(models), rng)
        failed = getattr(self.source, "failed", np.zeros(len(models), dtype=bool))
        return samples.counterfeit[:, 0], ~failed


def samples_of(trials: int) -> int:
    """Return how many new samples a run of so many trials is examined by."""
    return int(np.clip(trials // TRIALS_PER_SAMPLE, FEWEST_SAMPLES, MOST_SAMPLES))


def paired_p_value(
    models: np.ndarray, samples: np.ndarray, image_samples: np.ndarray, rng: np.random.Generator
) -> float:
    """Return how often samples (N, T, D) would differ so much from those of images by chance.

    Both of a pair are of one of the models (N, P) and of its image. Under a symmetry they may be
    exchanged. Two things count: the mean difference of each value, and how alike differences are
    of models that are near each other. Over broad draws differences of opposite signs add up to
    nothing. Statistics of whole samples do not know of a phase, nor of a time at which something
    happens.
    """
    count = len(models)
    values = np.concatenate((samples, image_samples)).reshape(2 * count, -1)
    values = values[:, :: -(-values.shape[1] // MOST_VALUES)]
    ranks = scipy.stats.rankdata(values, axis=0)
    differences = ranks[:count] - ranks[count:]
    differences /= np.sqrt((differences**2).sum(axis=0)) + 1e-12
    scaled = (models - models.mean(axis=0)) / (models.std(axis=0) + 1e-12)
    distances = pdist(scaled)
    width = np.median(distances) / 2 + 1e-12
    # 0 of each to itself
    nearness = squareform(np.exp(-0.5 * (distances / width) ** 2))
    signs = rng.choice((-1.0, 1.0), size=(PERMUTATIONS + 1, count))
    signs[0] = 1
    likeness = nearness * (differences @ differences.T)
    statistics = (
        np.abs(signs @ differences).max(axis=1),
        np.einsum("ij,ij->i", signs @ likeness, signs),
    )
    # the least p-value of the two, held against that of each exchange
    smallest = np.min([_shares_above(statistic) for statistic in statistics], axis=0)
    return float((smallest <= smallest[0] + 1e-9).mean())


def learned_p_value(differences: np.ndarray, rng: np.random.Generator) -> float:
    """Return how often one would learn so well from some pairs which is which in the others.

    `differences` (N, F) are those of the features of both of a pair. A regression (ridge) of their
    signs is learned from all folds of pairs but one, which it judges. With each exchange within
    pairs it is learned anew.

    Source: Lopez-Paz and Oquab, Revisiting classifier two-sample tests (2017).
    """
    count = len(differences)
    products = differences @ differences.T
    penalty = PAIR_PENALTY * np.trace(products) / count + 1e-12
    signs = rng.choice((-1.0, 1.0), size=(PERMUTATIONS + 1, count)).T
    signs[:, 0] = 1
    fold = rng.permutation(count) % PAIR_FOLDS
    scores = np.empty_like(signs)
    for number in range(PAIR_FOLDS):
        out = fold == number
        among = products[np.ix_(~out, ~out)] + penalty * np.eye((~out).sum())
        scores[out] = products[np.ix_(out, ~out)] @ np.linalg.solve(among, signs[~out])
    right = scores * signs
    return float(_shares_above(right.mean(axis=0) / (right.std(axis=0) + 1e-12))[0])


def _shares_above(statistic: np.ndarray) -> np.ndarray:
    """Return for each of the values (N,) the share of them that are as large or larger."""
    order = np.sort(statistic)
    margin = 1e-9 * np.abs(order).max()
    return 1 - np.searchsorted(order, statistic - margin) / len(order)


def _alike(draws: np.ndarray, other_draws: np.ndarray) -> bool:
    """Say whether the middles of draws (D, P) lie within both, in each parameter."""
    distance = np.abs(np.median(draws, axis=0) - np.median(other_draws, axis=0))
    return bool((distance <= np.maximum(draws.std(axis=0), other_draws.std(axis=0)) + 1e-12).all())


def _apart(draws: np.ndarray, other_draws: np.ndarray, threshold: float) -> bool:
    """Say whether draws (D, P) lie beside others in a parameter.

    Their central 90 %, and so many standard deviations away.
    """
    low, high = np.quantile(draws, [0.05, 0.95], axis=0)
    other_low, other_high = np.quantile(other_draws, [0.05, 0.95], axis=0)
    distance = np.abs(np.median(draws, axis=0) - np.median(other_draws, axis=0))
    spread = np.maximum(draws.std(axis=0), other_draws.std(axis=0))
    beside = (high < other_low) | (low > other_high)
    return bool((beside & (distance > threshold * spread)).any())
