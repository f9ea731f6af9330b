"""The loop of a run of trials, batch by batch.

`FewTrials.step` tells the story from top to bottom.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from threadpoolctl import ThreadpoolController

from turing_learning.arrays import array
from turing_learning.coevolution import THRESHOLD, Classifier, ClassifierArchive, SampleSource
from turing_learning.errors import integer, require
from turing_learning.evolution import Optimizer, generation_rng, join_states, state_part
from turing_learning.purposes import (
    ARCHIVE,
    BUFFER,
    CLASSIFIERS,
    CLIMBING,
    DESIGN,
    INTERROGATION,
    MATCHING,
)

from ._buffer import JudgmentRecord, SampleBuffer
from ._design import TrialDesign
from ._examination import Examiner
from ._jurors import train_moments
from ._map import INDUCING, Density, MomentField
from ._matching import Matched
from ._observers import Observers
from ._readout import (
    Cloud,
    Evidence,
    beside_walkers,
    best_solution,
    birge_ratio,
    estimate_and_interval,
    evidence_in_reach,
    intervals_of_modes,
    solution,
    widened,
)
from ._ridge import Ridge
from ._schedule import batch_schedule
from ._search import DECIDED_AT, FEWEST_TO_SEARCH, Search
from ._space import SearchSpace
from ._symmetry import SymmetryGroup

# Classifiers that evolve. Decision 0028, "Judge again".

GENERATIONS = 3
"""Generations of classifiers in each batch."""
ARCHIVED = 60
"""Classifiers in the archive."""
FITTEST = 20
"""Best classifiers of the last generation, which judge beside the archive."""
RECENT_TRIALS = 60
"""Latest trials that a generation of classifiers judges."""
OLD_TRIALS = 40
"""Trials of any age beside them."""
GENUINE_JUDGED = 200
"""Genuine samples beside both; as many say how fit the classifiers of a batch are."""

# Observers, which are random. Decision 0028.

OBSERVERS = 200
"""How many there are."""
RENEWED_EVERY = 6
"""Batches between renewals of those that tell nothing any more; the third has the first one."""
RENEWED_UNTIL = 0.7
"""Share of the trials up to which they are renewed."""
RENEWED_BY = 200
"""Trials, the likeliest ones, whose samples say which observers tell nothing."""
STILL = 0.03
"""Standard deviation of an output, of 0 to 1, below which it tells nothing."""
# Random numbers within a batch, beside those of its portions and repeats
_RENEWAL = 7
_MIXTURE = 8

# Symmetries. Decision 0043.

FEWEST_FIRST = 10
"""First models below which they say nothing of symmetries."""

# Maps. Decision 0028, "Map".

NEAR_SHARE = 0.5
"""Share of the trials that the near map rests on, the likeliest ones, within the two bounds
below."""
NEAR_LEAST = 250
"""Fewest of them."""
NEAR_MOST = 3000
"""Most of them."""
FAR_TRIALS = 100
"""Trials from anywhere among them; at least as many near ones are among those of the wide map."""
WIDE_EVERY = 3
"""Batches after which the wide map is made anew."""
WIDE_TRIALS = 500
"""Trials that the wide map rests on."""
WIDE_POINTS = 120
"""Points of the processes of the wide map."""
REPEATS = 4
"""How often jurors are trained once more at the end, to average over the folds."""

# Other

EXPLORERS = 0.5
"""Share of explorers in the last batch where the genuine samples are all there are."""
POOL_SIZES = (500, 3000)
"""Fewest and most live genuine samples that are judged; within these as many as trials."""
PORTIONS = 5
"""Parts of a batch of a lost run, at most: where trials are many, many are tried at once."""
LOOKED_AT = 4
"""Batches after which a run with a tolerance looks at its intervals, from the second time on."""
MIXTURES_SOUGHT = (8, 16, 24)
"""Batches, from 0, in which it is looked whether walkers are a mixture of images of each other."""
REFINED = 3
"""Batches after which a lost run that has chosen where to go on is matched anew."""
_READ_OUT = 1_000_000  # batch whose random numbers intervals are drawn with


class _Stream(IntEnum):
    """Random numbers of what is read out, a stream for each purpose; results depend on the numbers."""

    CENTERS = 1  # which center of the search is followed
    EXAMINATION = 2  # the look at the estimate from outside
    SYMMETRIES = 3  # which images of the solution are as good
    MIXTURE = 4  # of which images the draws are a mixture
    FOLDED = 5  # the solution in one region
    HOLDING = 6  # whether the group that was followed is one
    UNFOLDED = 7  # the solution if it is none
    PRODUCTS = 8  # of which images by products the draws are a mixture
    PRODUCTS_FOLDED = 9  # the solution in one region of these
    RIDGE = 10  # whether the solution lies along a ridge


@cache
def _linear_algebra() -> ThreadpoolController:
    """Return the libraries whose threads can be limited: looking for them takes a millisecond."""
    return ThreadpoolController()


@dataclass(frozen=True, eq=False)
class Batch:
    """What is known after a batch of trials, in the optimizer's numbers."""

    number: int  #: 0 for the first batch
    trials: int  #: Trials spent so far
    estimate: np.ndarray  #: (P,), median of the draws of the right model
    spread: np.ndarray  #: (P,), their standard deviation
    #: (P,), share of the variance of each parameter, among the trials of the near map, that jurors
    #: see in one trial
    explained: np.ndarray
    #: Chi square per moment of the best model, at least 1: above about 5 no model explains the
    #: judgments
    misfit: float
    models: np.ndarray  #: (M, P), that were tried
    #: (M,), share of these classifiers that accept each
    model_fitness: np.ndarray
    classifiers: np.ndarray  #: (N, Q), the fittest of the last generation
    #: (N,), mean of specificity and sensitivity on genuine samples and those of the batch
    classifier_fitness: np.ndarray


class FewTrials:
    """Infer a model from a given number of trials.

    The method is told in `turing_learning.few_trials`.

    Parameters
    ----------
    source
        Yields the samples of models (M, P) in the optimizer's numbers; one execution of `together`
        of them is one trial. If it has an attribute ``failed`` (M,), it marks simulations without
        samples.
    classifier
        Judges samples, as the genomes of `classifiers` say.
    classifiers
        Optimizer of the evolved classifiers.
    space
        Of the models.
    trials
        How many in all, at least 10.
    seed
        A non-negative integer.
    tolerance
        The run stops before its trials are spent once the interval of each parameter that can be
        identified reaches at most this share of its range to either side; 0: never.
    extended
        For a finished run that got more trials: the budget and the number of trials spent, (N, n),
        of each time before. Until n trials are spent it is a run of N trials; then its phases are
        those of one of `trials`, of which n are spent.
    batch
        Trials in a batch after the first one; 0 for a fortieth of `trials`. What is left over is spent
        in the first batch, or at the end of trials that came later.
    observers
        Random classifiers beside the evolved ones.
    genuine : (K, T, D)
        All genuine samples there are, for a system that is not observed anew in each trial. None
        takes those that come with each batch.
    examiner
        Compares new samples of the estimate with the genuine ones at the end; None: nobody does.
    together
        Number of models that a trial executes.
    searches
        Whether a run whose map fits nothing for long searches by the observers (`Search`): with
        3000 trials or more, whose batches are then collected in parts.

    Attributes
    ----------
    batches
        Number of completed batches.
    buffer
        All samples.
    batch
        What is known after the last batch; None before the first.
    fittest : (N, Q)
        The fittest classifiers after the last batch.
    search
        Whether the run is lost, and its way out.
    tolerated
        Whether it has stopped before its trials were spent.

    Examples
    --------
    >>> run = FewTrials(source, classifier, optimizer, space, trials=1000, seed=1)  # doctest: +SKIP
    >>> for batch in run:  # doctest: +SKIP
    ...     print(batch.estimate)
    >>> run.readout()["interval"]  # doctest: +SKIP
    """

    def __init__(
        self,
        source: SampleSource,
        classifier: Classifier,
        classifiers: Optimizer,
        space: SearchSpace,
        *,
        trials: int,
        seed: int,
        tolerance: float = 0.0,
        extended: Sequence[tuple[int, int]] = (),
        batch: int = 0,
        observers: Observers,
        genuine: np.ndarray | None = None,
        examiner: Examiner | None = None,
        together: int = 1,
        searches: bool = False,
    ) -> None:
        self.trials = integer("trials", trials, 10)
        self._seed = integer("seed", seed)
        self._together = integer("together", together, 1)
        self._space = space
        self._source = source
        self._classifier = classifier
        self._classifiers = classifiers
        self._observers = observers
        self._fixed_genuine = genuine
        self._examiner = examiner
        self._tolerance = tolerance
        self._searches = searches
        self._archive = ClassifierArchive(ARCHIVED, seed=(ARCHIVE, self._seed))
        explorers = 0.0 if genuine is None else EXPLORERS
        self._design = TrialDesign(space, seed=(DESIGN, self._seed), explorers=explorers)
        self._stages = (*extended, (trials, trials))
        self._schedule = batch_schedule(trials, space.dimension, extended, batch)
        self.buffer = SampleBuffer(share=0.1 if genuine is None else 1.0)
        self.buffer.pool_size = self._pool_size
        self.batch: Batch | None = None
        self.tolerated = False
        self.batches = 0
        self._observer_genomes = np.empty((0, observers.parameters))
        self._observer_judgments = JudgmentRecord(observers)
        self._classifier_judgments = JudgmentRecord(classifier)
        self.fittest = np.empty((0, classifier.parameters))
        self._density = Density(None)
        # of the last batch, and of the repeats of `average`
        self._collected_walkers = np.empty((0, space.dimension))
        self.search = Search(self._space.furthest)
        self._group: SymmetryGroup | None = None
        # after how many batches, and with what result
        self._latest_match: tuple[int, Matched | None] = (0, None)

    # Where the run is

    @property
    def spent(self) -> int:
        """Number of trials spent."""
        return len(self.buffer) // self._together

    @property
    def complete(self) -> bool:
        """Whether all trials are spent."""
        return self.spent >= self.trials

    @property
    def decision_due(self) -> bool:
        """Whether a lost run has to choose where its other trials are spent, see `go_on_around`."""
        late = self.spent >= DECIDED_AT * self._budget
        return self.search.lost and not self.search.decided and late

    @property
    def _budget(self) -> int:
        """Number of trials that the phases of the next batch are relative to."""
        return next(
            (trials for trials, stage_end in self._stages if self.spent < stage_end), self.trials
        )

    @property
    def _pool_size(self) -> int:
        """Number of genuine samples that are judged."""
        if self._fixed_genuine is not None:
            return len(self._fixed_genuine)
        return int(np.clip(self._budget, *POOL_SIZES))

    def _in_region(self, models: np.ndarray) -> np.ndarray:
        """Return models (N, P); in one region where several are images of each other."""
        if self._group is None:
            return models
        return self._group.folded(models)

    def _parameters_of(self, trials: np.ndarray) -> np.ndarray:
        """Return the parameters (N, P) of some trials, in that region."""
        return self._in_region(self.buffer.parameters[trials])

    @property
    def draws(self) -> np.ndarray:
        """Draws (W, P) of the right model, in the optimizer's numbers.

        The joint uncertainty as far as the moments tell.
        """
        return self._space.to_numbers(self._walkers)

    @property
    def _walkers(self) -> np.ndarray:
        """The same in units of the space.

        At the end of a run jurors are trained, and walkers moved, several times, to average over
        which trials fell into which fold.
        """
        if len(self._collected_walkers):
            return self._collected_walkers
        return self._design.walkers

    @property
    def estimate(self) -> np.ndarray:
        """The estimate (P,): the median of the draws."""
        return np.median(self.draws, axis=0)

    @property
    def observer_outputs(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What observers say of usable trials (S, F) and of genuine samples (K, F).

        The third are the indices (S,) of these trials.
        """
        usable = np.flatnonzero(self.buffer.usable)
        return (
            self._observer_judgments.counterfeit[usable],
            self._observer_judgments.genuine,
            usable,
        )

    # The story of a batch

    def __iter__(self) -> Iterator[Batch]:
        while not self.complete and not self.tolerated:
            yield self.step()

    def step(self) -> Batch:
        """Spend a batch of trials and return what is known then.

        After a failure, `restore` the state before.
        """
        require(not self.complete, "trials", "be more than the run has spent", f"{self.trials}")
        budget = self._budget
        progress = self.spent / budget
        # Sums in one order, for any number of processors
        with _linear_algebra().limit(limits=1, user_api="blas"):
            self._resize_pool()
            self._try_models(progress)
            self._evolve_classifiers()
            explained = self._follow_moments()
            if self.batches in MIXTURES_SOUGHT:
                self._find_mixture()
            self._collected_walkers = self._design.walkers
            if self.batches % RENEWED_EVERY == 2 and progress <= RENEWED_UNTIL:
                self._renew_observers()
        self.batches += 1
        self.batch = self._describe_batch(explained)
        if self._searches and budget >= FEWEST_TO_SEARCH:
            self.search.note_misfit(self.spent / budget, self.batch.misfit)
        if self.spent in [stage_end for _, stage_end in self._stages]:
            self.average()
        if self.search.lost and not self.complete:
            self._decide_where_to_go_on()
        if self._tolerance and not self.complete:
            self._stop_if_tolerated()
        return self.batch

    def _resize_pool(self) -> None:
        """Let more genuine samples be judged where the run has got more trials."""
        if self.buffer.pool_size != self._pool_size:
            self.buffer.pool_size = self._pool_size
            self._judge_by_observers()

    def _try_models(self, progress: float) -> None:
        """Choose the models of a batch and simulate them.

        `progress` is the share of the trials spent.
        """
        count = (self._schedule[self.batches] - self.spent) * self._together
        self.search.reset_if_early(progress)
        if self.search.decided:
            self._try(self.search.around(count, self._design.walkers, self._rng(CLIMBING)))
        elif self.search.lost:
            self._try_parts(count)
        elif progress:
            self._try(self._design.propose(count, progress))
        else:
            self._try(self._design.start(count))

    def _try(self, models: np.ndarray, portion: int = 0) -> None:
        """Simulate models (M, P), a part of a batch, and let the observers see what comes."""
        portion_number = (portion,) if portion else ()
        numbers = self._space.to_numbers(models)
        samples = self._source.collect(numbers, self._rng(INTERROGATION, *portion_number))
        failed = getattr(self._source, "failed", None)
        usable = None if failed is None else ~np.asarray(failed, bool)
        genuine = samples.genuine if self._fixed_genuine is None else self._fixed_genuine
        fixed = self._fixed_genuine is not None and len(self.buffer) > 0
        # Those of this batch, or all, are kept already
        if portion or fixed:
            genuine = genuine[:0]
        rng = self._rng(BUFFER, *portion_number)
        indices = self.buffer.append(models, samples.counterfeit, genuine, rng, usable)
        if len(self._observer_genomes) == 0:
            counterfeit = samples.counterfeit.reshape(-1, *samples.counterfeit.shape[2:])
            genuine_rows = indices[rng.permutation(len(indices))[: len(counterfeit)]]
            self._observer_genomes = self._observers.draw(
                OBSERVERS, np.concatenate((counterfeit, genuine_rows)), rng
            )
        self._judge_by_observers()

    def _try_parts(self, count: int) -> None:
        """Try so many models of the searches of a lost run, a few at a time.

        So each part learns from those before.
        """
        portion_size = max(self.search.batch_size, count // PORTIONS)
        portion_size = -(-portion_size // self._together) * self._together
        borders = [*range(0, count, portion_size), count]
        for portion, (start, stop) in enumerate(pairwise(borders)):
            outputs, genuine, usable = self.observer_outputs
            models = self.search.step(
                stop - start,
                self.spent / self._budget,
                self.buffer.parameters[usable],
                outputs,
                genuine,
                self._rng(CLIMBING, portion),
            )
            self._try(models, portion)
        outputs, genuine, usable = self.observer_outputs
        self.search.update_centers(self.buffer.parameters[usable], outputs, genuine)

    def _evolve_classifiers(self) -> None:
        """Let classifiers evolve on the buffer; keep the best."""
        usable = np.flatnonzero(self.buffer.usable)
        samples = self.buffer.samples
        genuine = self.buffer.genuine
        for k in range(GENERATIONS):
            rng = generation_rng((CLASSIFIERS, self._seed), GENERATIONS * self.batches + k)
            old = usable[rng.integers(len(usable), size=OLD_TRIALS)]
            trials = np.concatenate((usable[-RECENT_TRIALS:], old))
            counterfeit = samples[trials, rng.integers(samples.shape[1], size=len(trials))]
            testing = genuine[rng.integers(len(genuine), size=GENUINE_JUDGED)]
            genomes = self._classifiers.ask()
            accepted = (self._classifier.judge(genomes, testing) >= THRESHOLD).mean(axis=1)
            fooled = (self._classifier.judge(genomes, counterfeit) >= THRESHOLD).mean(axis=1)
            fitness = 0.5 * (accepted + 1 - fooled)
            self._classifiers.tell(fitness)
            best = int(np.argmax(fitness))
            self._archive.admit(genomes[best], float(accepted[best]))
        self.fittest = genomes[np.argsort(-fitness, kind="stable")[:FITTEST]]
        self._judge_by_classifiers()

    def _follow_moments(self, repeat: int = 0) -> np.ndarray:
        """Train jurors, map their moments, and let the walkers follow.

        Return how much of each parameter a trial tells (P,).
        """
        usable = np.flatnonzero(self.buffer.usable)
        # repeats follow a batch that is counted already
        number = self.batches - (repeat > 0)
        rng = generation_rng((MATCHING, self._seed, repeat), number)
        nearest = self._nearest(usable, rng)
        field, explained = self._moment_map(nearest, rng)
        wide = self._density.wide
        if len(usable) > NEAR_LEAST and (wide is None or number % WIDE_EVERY == 0):
            remote = rng.permutation(np.setdiff1d(usable, nearest))[: WIDE_TRIALS - FAR_TRIALS]
            near_sample = rng.permutation(nearest)[: max(FAR_TRIALS, WIDE_TRIALS - len(remote))]
            wide, _ = self._moment_map(
                np.sort(np.concatenate((remote, near_sample))), rng, WIDE_POINTS
            )
        reference = 0.0
        if wide is not None:
            reference = float(wide.log_density(self._design.walkers).max())
        self._density = Density(field, wide, reference)
        # After a lost run has chosen where its search ends, the map says nothing
        if not self.search.decided:
            self._design.move(self._log_density)
        if self._group is not None:
            self._design.fold(self._group)
        return explained

    def _log_density(self, models: np.ndarray, **options: Any) -> np.ndarray:
        """Return the logarithm (N,) of the density of models (N, P), whichever region they are in."""
        return self._density(self._in_region(models), **options)

    def _find_mixture(self) -> None:
        """Go on in one region where walkers are in several that are images of each other.

        Else no parameter of one of two parts that may be exchanged could be predicted from what
        classifiers say.
        """
        if self._examiner is None:
            return
        if self._group is not None or self.search.lost:
            return
        first_trials = self._first_trials()
        if len(first_trials.parameters) < FEWEST_FIRST:
            return
        walkers = self._design.walkers
        rng = self._rng(MATCHING, _MIXTURE)
        self._group = self._examiner.mixture(walkers, first_trials, self.trials, rng)
        if self._group is not None:
            self._design.fold(self._group)

    def _nearest(self, usable: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the trials of the near map: the likeliest to be right, and some of the others."""
        size = round(np.clip(NEAR_SHARE * len(usable), NEAR_LEAST, NEAR_MOST))
        if len(usable) <= size or self._density.near is None:
            return usable
        density = self._density(self._parameters_of(usable))
        order = usable[np.argsort(-density, kind="stable")]
        far_sample = rng.permutation(order[size - FAR_TRIALS :])[:FAR_TRIALS]
        return np.sort(np.concatenate((order[: size - FAR_TRIALS], far_sample)))

    def _moment_map(
        self, trials: np.ndarray, rng: np.random.Generator, points: int = INDUCING
    ) -> tuple[MomentField, np.ndarray]:
        """Return a map of the moments of some trials, and how much a trial tells (P,)."""
        records = [self._observer_judgments, self._classifier_judgments]
        outputs = np.concatenate([record.counterfeit[trials] for record in records], axis=1)
        system = np.concatenate([record.genuine for record in records], axis=1)
        parameters = self._parameters_of(trials)
        moments = train_moments(parameters, outputs, system, rng)
        # of the genuine mean: as many samples of a trial may be alike
        noise = self.buffer.samples.shape[1] / len(system)
        field = MomentField(parameters, moments.values, noise, rng, inducing=points)
        field.calibrate(self._design.walkers)
        return field, moments.explained

    def _renew_observers(self) -> None:
        """Draw anew the observers that say nearly the same of the likeliest trials and of genuine samples.

        The first observers look at models from the whole range. Where that is wide, most of them
        say the same of all models that are left. Systems that are observed anew keep theirs: in
        object clustering others cost accuracy (decision 0037).
        """
        if self._fixed_genuine is None:
            return
        usable = np.flatnonzero(self.buffer.usable)
        density = self._density(self._parameters_of(usable))
        nearest = usable[np.argsort(-density, kind="stable")[:RENEWED_BY]]
        counterfeit = self._observer_judgments.counterfeit[nearest].std(axis=0)
        variation = np.maximum(counterfeit, self._observer_judgments.genuine.std(axis=0))
        still = np.flatnonzero(variation < STILL)
        if len(still) == 0:
            return
        rng = self._rng(BUFFER, _RENEWAL)
        genuine = self.buffer.genuine
        samples = self.buffer.samples[nearest].reshape(-1, *genuine.shape[1:])
        count = min(len(samples), len(genuine))
        samples = samples[rng.permutation(len(samples))[:count]]
        material = np.concatenate((samples, genuine[rng.permutation(len(genuine))[:count]]))
        self._observer_genomes[still] = self._observers.draw(len(still), material, rng)
        self._judge_by_observers()

    def _judge_by_observers(self) -> None:
        """Let the observers judge what is new to them."""
        self._observer_judgments.update(self._observer_genomes, self.buffer)

    def _judge_by_classifiers(self) -> None:
        """Let archived and the fittest classifiers judge what is new to them."""
        self._classifier_judgments.update(
            np.concatenate((self._archive.genomes, self.fittest)), self.buffer
        )

    def _describe_batch(self, explained: np.ndarray) -> Batch:
        """Return what is known after a batch."""
        number = self.batches - 1
        start = self._schedule[number - 1] * self._together if number else 0
        samples = self.buffer.samples[start:, 0]
        accepted = self._classifier.judge(self.fittest, samples) >= THRESHOLD
        genuine = (
            self._classifier.judge(self.fittest, self.buffer.genuine[-GENUINE_JUDGED:]) >= THRESHOLD
        )
        return Batch(
            number=number,
            trials=self.spent,
            estimate=self.estimate,
            spread=self.draws.std(axis=0),
            explained=explained,
            misfit=1.0 if self._density.near is None else self._density.near.misfit,
            models=self._space.to_numbers(self.buffer.parameters[start:]),
            model_fitness=accepted.mean(axis=0),
            classifiers=self.fittest,
            classifier_fitness=0.5 * (genuine.mean(axis=1) + 1 - accepted.mean(axis=1)),
        )

    def _estimate_anew(self) -> Batch:
        """Return what is known after the last batch, with the estimate of the present walkers."""
        assert self.batch is not None
        self.batch = replace(self.batch, estimate=self.estimate, spread=self.draws.std(axis=0))
        return self.batch

    # The end, and what comes before it

    def average(self) -> Batch:
        """Train jurors and move walkers several times more, as at the end of a run.

        Return what is known then.
        """
        with _linear_algebra().limit(limits=1, user_api="blas"):
            for k in range(0 if self.search.decided else REPEATS):
                self._follow_moments(repeat=k + 1)
                self._collected_walkers = np.concatenate(
                    (self._collected_walkers, self._design.walkers)
                )
        assert self._density.near is not None
        self.batch = replace(self._estimate_anew(), misfit=self._density.near.misfit)
        return self.batch

    def go_on_around(self, draws: np.typing.ArrayLike) -> Batch:
        """Spend the next trials of a lost run around draws (N, P), in units of the space."""
        rule = "be those of a lost run"
        require(self.search.lost, "trials", rule, "those of another run")
        self.search.decided = True
        self._design.gather(array("draws", draws, "N P", P=self._space.dimension))
        self._collected_walkers = self._design.walkers
        return self._estimate_anew()

    def _decide_where_to_go_on(self) -> None:
        """Let a lost run go on around what matches best.

        When it is time to decide, its walkers and the ends of its searches are matched, each from
        the trials around it; the best one counts. From then on it is matched anew from time to
        time.
        """
        due = self.decision_due
        again = self.search.decided and (self.batches - 1) % REFINED == 0
        if not (due or again):
            return
        evidence = self._evidence_in_reach()
        if not evidence.enough:
            return
        centers = self.search.centers if due else self.search.centers[:0]
        if len(centers):
            centers = self._in_region(centers)
        best = best_solution(
            evidence, Cloud.of(self._walkers), centers, lambda: self._match_rng(_Stream.CENTERS)
        )
        if due or best.usable:
            self.go_on_around(best.draws)

    def _stop_if_tolerated(self) -> None:
        """Stop where the intervals of all parameters that can be identified are narrow enough."""
        number = self.batches - 1
        if number % LOOKED_AT or number < 2 * LOOKED_AT or self.search.lost:
            return
        matched = self.matched()
        if matched is None or not matched.passed_checks or not matched.identified.any():
            return
        widths = (matched.interval_high - matched.interval_low)[matched.identified]
        widths = widths * self._widening(matched)
        # the range is 2 wide
        self.tolerated = bool((widths / 2 <= 2 * self._tolerance).all())
        if self.tolerated:
            self.average()

    def matched(self) -> Matched | None:
        """Match the agents after the last batch, in units of the space.

        None with too few trials within reach.
        """
        if self._latest_match[0] != self.batches:
            evidence = self._evidence_in_reach()
            reached = None
            if evidence.enough:
                cloud = Cloud.of(self._walkers)
                reached = solution(evidence, cloud, self._match_rng(), lost=self.search.lost)
            self._latest_match = self.batches, reached
        return self._latest_match[1]

    def readout(self) -> dict[str, np.ndarray]:
        """Return what matching says of the parameters.

        Returns
        -------
        dict
            "p_value": how often classifiers would tell the model from the agents as well by chance.
            If `Matched.passed_checks`, in the optimizer's numbers, "estimate" (P,), "interval" (2, P),
            that of all solutions, "mode_interval" (M, 2, P), that of each, and "draws" (D, P);
            "mode" (D,), to which solution each draw belongs, and "identified" (P,), of which
            parameters the run says something. With an examiner "examined" (2,) and "statistic".
            Along a ridge "ridge" (M, P), exponents or factors of what shows, and "ridge_logarithmic".
            Nothing if there are too few trials within reach.
        """
        matched = self.matched()
        if matched is None:
            return {}
        group = None
        along = None
        if self._group is None:
            along = self._along_ridge(matched)
        if along is None and self._examiner is not None:
            first_trials = self._first_trials()
            if len(first_trials.parameters) >= FEWEST_FIRST:
                matched, group = self._folded(matched, self._examiner, first_trials)
            # what the run has followed as a symmetry may have been the two sides of a ridge
            if self._group is not None and group is None:
                along = self._along_ridge(matched)
        if along is not None:
            matched = matched.with_draws(along[0])
        p_value = np.array(matched.p_value)
        if not matched.passed_checks:
            return {"p_value": p_value}
        draws = matched.draws
        # of a system that is observed anew modes are no solutions of their own
        mode = np.zeros_like(matched.mode)
        examined: dict[str, np.ndarray] = {}
        if self._examiner is not None:
            examination = self._examiner.examine(
                matched, group, self.buffer, self.trials, self._match_rng(_Stream.EXAMINATION)
            )
            examined = examination.report
            draws = examination.draws
            mode = examination.mode
        factor = 1.0 if along is not None else self._widening(matched, group)
        widest = self._space.widest
        if factor > 1:
            as_one = np.zeros(len(matched.draws), dtype=np.int64)
            matched = matched.with_draws(widened(matched.draws, as_one, factor, widest))
            draws = widened(draws, mode, factor, widest)
        ridge: dict[str, np.ndarray] = {}
        if along is not None:
            ridge = {
                "ridge": along[1].shown,
                "ridge_logarithmic": np.array(along[1].coordinates.logarithmic),
            }
        elif self._examiner is not None and group is None and not (mode.any() or self.search.lost):
            joined = beside_walkers(draws, self._in_region(self._walkers), widest)
            if joined is not None:
                draws = joined
                matched = matched.with_draws(draws)
        estimate, interval = estimate_and_interval(matched, self._walkers, self._space)
        if along is not None:
            estimate = along[1].middle(draws)
        mode_interval, identified = intervals_of_modes(draws, mode, interval, self._space)
        interval = np.stack((mode_interval[:, 0].min(axis=0), mode_interval[:, 1].max(axis=0)))
        return {
            "p_value": p_value,
            "mode": mode,
            "identified": identified,
            "estimate": self._space.to_numbers(estimate),
            "interval": self._space.to_numbers(interval),
            "mode_interval": self._space.to_numbers(mode_interval),
            "draws": self._space.to_numbers(draws),
            **examined,
            **ridge,
        }

    def _along_ridge(self, matched: Matched) -> tuple[np.ndarray, Ridge] | None:
        """Return draws all along the ridge on which a solution lies, and the ridge; None if it lies on none."""
        if self._examiner is None:
            return None
        if not matched.passed_checks or self.search.lost:
            return None
        rng = self._match_rng(_Stream.RIDGE)
        return self._examiner.along_ridge(matched.main_draws, self.trials, rng)

    def _widening(self, matched: Matched, group: SymmetryGroup | None = None) -> float:
        """Return by which factor draws are wider than a solution says, in the region of a group.

        Systems that are observed anew have intervals that hold.
        """
        if self._fixed_genuine is None:
            return 1.0
        walkers = self._walkers
        if group is not None:
            walkers = group.folded(walkers)
        return birge_ratio(matched.main_draws, walkers)

    def _folded(
        self, matched: Matched, examiner: Examiner, first_trials: Evidence
    ) -> tuple[Matched, SymmetryGroup | None]:
        """Return the solution in one of the regions that are images of each other, and their group.

        Where there are several, trials of all of them tell of one. Without that a parameter of one
        of two parts that may be exchanged could not be predicted from what classifiers say.
        """
        followed = self._group
        if followed is not None:
            draws = matched.main_draws
            rng = self._match_rng(_Stream.HOLDING)
            if not examiner.certain(followed.members[1], followed, draws, self.trials, rng):
                # It was taken for a symmetry while draws were still broad.
                followed = None
                matched = self._solved_again(None, draws, _Stream.UNFOLDED)
        draws = matched.main_draws
        rng = self._match_rng(_Stream.SYMMETRIES)
        group = examiner.symmetries(draws, first_trials, self.trials, rng, followed)
        if followed is not None:
            if group is None:
                # Regions that are images of each other, but do not lie apart, are one.
                images = examiner.with_images([draws], followed)
                return matched.with_draws(np.concatenate(images)), None
            if len(group.members) == len(followed.members):
                # The run has looked in one of these regions already.
                return matched, group
        if group is None:
            rng = self._match_rng(_Stream.MIXTURE)
            group = examiner.mixture(draws, first_trials, self.trials, rng)
        if group is None:
            return self._folded_along_products(matched, examiner, first_trials)
        folded = self._solved_again(group, draws, _Stream.FOLDED)
        if folded.passed_checks and examiner.apart(folded.draws, group):
            return folded, group
        if examiner.apart(draws, group):
            return matched, group
        return matched, None

    def _folded_along_products(
        self, matched: Matched, examiner: Examiner, first_trials: Evidence
    ) -> tuple[Matched, SymmetryGroup | None]:
        """Return the same where draws may be a mixture of solutions that follow by products."""
        draws = matched.main_draws
        rng = self._match_rng(_Stream.PRODUCTS)
        group = examiner.mixture(draws, first_trials, self.trials, rng, products=True)
        if group is not None:
            folded = self._solved_again(group, draws, _Stream.PRODUCTS_FOLDED)
            apart = folded.passed_checks and examiner.apart(folded.draws, group)
            if apart and examiner.certain(group.members[1], group, folded.draws, self.trials, rng):
                return folded, group
        return matched, None

    def _solved_again(
        self, group: SymmetryGroup | None, draws: np.ndarray, stream: "_Stream"
    ) -> Matched:
        """Return the solution with all trials turned into one region of a group; without one near draws (D, P)."""
        parameters = self.buffer.parameters[self.buffer.usable]
        cloud = Cloud.of(draws)
        if group is not None:
            parameters = group.folded(parameters)
            cloud = Cloud(group.reference, group.scale)
        evidence = evidence_in_reach(self._evidence_of(parameters))
        return solution(evidence, cloud, self._match_rng(stream), lost=self.search.lost)

    def _first_trials(self) -> Evidence:
        """Return what observers say of the first models, which are anywhere."""
        usable = np.flatnonzero(self.buffer.usable)
        among_first = usable < self._schedule[0] * self._together
        return self._evidence_of(self.buffer.parameters[usable]).of_trials(among_first)

    def _evidence_in_reach(self) -> Evidence:
        """Return what observers say of the trials within reach of a solution."""
        usable = self.observer_outputs[2]
        return evidence_in_reach(self._evidence_of(self._parameters_of(usable)))

    def _evidence_of(self, parameters: np.ndarray) -> Evidence:
        """Return what observers say of all usable trials, whose parameters (S, P) are given."""
        counterfeit, genuine, _ = self.observer_outputs
        return Evidence(
            space=self._space,
            parameters=parameters,
            counterfeit=counterfeit,
            genuine=genuine,
            samples_per_trial=self.buffer.samples.shape[1],
            observed_anew=self._fixed_genuine is None,
        )

    def _rng(self, purpose: int, *stage: int) -> np.random.Generator:
        return generation_rng((purpose, self._seed, *stage), self.batches)

    def _match_rng(self, *stage: int) -> np.random.Generator:
        return generation_rng((MATCHING, self._seed, *stage), _READ_OUT + self.batches)

    # What is stored

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume, as arrays.

        The rows of those named "buffer/..." only grow: `SampleBuffer.since` gives the new ones. All
        else is small.
        """
        states = {
            "buffer": self.buffer.state(),
            "classifiers": self._classifiers.state(),
            "archive": self._archive.state(),
            "design": self._design.state(),
            "density": self._density.state(),
            "climb": self.search.state(),
        }
        if self._group is not None:
            states["group"] = self._group.state
        state = {
            "number": np.array(self.batches, dtype=np.int64),
            "tolerated": np.array(self.tolerated),
            "drawn": self._observer_genomes.copy(),
            "present": self.fittest.copy(),
            "pooled": self._collected_walkers.copy(),
        }
        if self.batch is not None:
            state["explained"] = self.batch.explained
        return state | join_states(states)

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state of a run with the same settings, but for `extended`."""
        rule = "be that of an estimate from few trials"
        require("number" in state, "state", rule, str(sorted(state)))
        self.batches = int(state["number"])
        self._observer_genomes = np.array(state["drawn"], dtype=np.float64)
        self.fittest = np.array(state["present"], dtype=np.float64)
        self._collected_walkers = np.array(state["pooled"], dtype=np.float64)
        self.buffer.restore(state_part(state, "buffer/"))
        self.buffer.pool_size = self._pool_size
        # a run that has got more trials goes on
        extended = self.spent in [stage_end for _, stage_end in self._stages[:-1]]
        self.tolerated = bool(state.get("tolerated", False)) and not extended
        self._classifiers.restore(state_part(state, "classifiers/"))
        self._archive.restore(state_part(state, "archive/"))
        self._design.restore(state_part(state, "design/"))
        # Maps are built to the same bits as in `step`
        with _linear_algebra().limit(limits=1, user_api="blas"):
            self._density = Density.restored(state_part(state, "density/"))
        self.search = Search(self._space.furthest)
        searches = state_part(state, "climb/")
        # Runs of 0.2.0 may have none
        if searches:
            self.search.restore(searches)
        group = state_part(state, "group/")
        self._group = SymmetryGroup.restored(group) if group else None
        self._observer_judgments = JudgmentRecord(self._observers)
        self._classifier_judgments = JudgmentRecord(self._classifier)
        self.batch = None
        if self.batches:
            self._judge_by_observers()
            self._judge_by_classifiers()
            self.batch = self._describe_batch(np.array(state["explained"], dtype=np.float64))
