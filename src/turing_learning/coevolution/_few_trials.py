"""An estimate from few trials: every sample is kept and judged again, and the next trials are spent where they tell most."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from turing_learning.evolution import INDUCING, join_states, state_part

from ..arrays import array
from ..errors import integer, require
from ..evolution import MomentField, Optimizer, TrialDesign, generation_rng
from ..purposes import ARCHIVE, BUFFER, CLASSIFIERS, CLIMBING, DESIGN, INTERROGATION, MATCHING
from ._climb import END, FEWEST, Climb
from ._memory import ClassifierArchive, JudgmentRecord, SampleBuffer
from ._moments import train_moments
from ._protocols import Classifier, SampleSource
from ._rewards import THRESHOLD

BATCHES = 40
_FIRST_SHARE, _FIRST_LEAST, _FIRST_MOST = 0.1, 10, 40  # of the trials; times the number of parameters
_GENERATIONS = 3  # of classifiers, in each batch
_ARCHIVE, _PRESENT = 60, 20  # jurors
_RECENT, _OLD, _GENUINE = 60, 40, 200  # samples that a generation of classifiers judges
_OBSERVERS = 200
_RENEWED_EVERY, _RENEWED_UNTIL = (
    6,
    0.7,
)  # batches between renewals of observers; share of the trials up to which they are renewed
_RENEWED_BY, _STILL = (
    200,
    0.03,
)  # trials near the solution; standard deviation of an output, of 0 to 1, that says nothing
_RENEWAL = 7  # part of the random numbers of a batch
_NEAR_SHARE, _NEAR_LEAST, _NEAR_MOST = 0.5, 250, 3000  # trials that the moments are trained on
_FAR = 100  # and others among them
_WIDE_EVERY, _WIDE_TRIALS = 3, 500
_WIDE_POINTS = 120
_REPEATS = 4  # at the end, to average over the folds
_SLACK, _HOPELESS = 10.0, 50.0
_PARTS = 5  # of a batch of searches, at most: where trials are many, many are tried at once
_EXPLORERS = 0.5  # of the last batch, where the genuine samples are all there are
_POOL = (500, 3000)  # genuine samples: as many as trials, within these bounds


class Observers(Classifier, Protocol):
    """Classifiers that need not evolve: random ones, each looking for something else."""

    def draw(self, count: int, samples: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return genomes (count, Q) for samples like these (S, T, D)."""


@dataclass(frozen=True, eq=False)
class Batch:
    """What is known after a batch of trials."""

    number: int  #: 0 for the first batch
    trials: int  #: Trials spent so far
    estimate: np.ndarray  #: (P,), median of the draws of the right model
    spread: np.ndarray  #: (P,), their standard deviation
    #: (P,), share of the variance of each parameter, among the matched trials, that jurors see in one trial
    explained: np.ndarray
    #: Chi square per moment of the best model, at least 1: above about 5 no model explains the judgments
    misfit: float


class FewTrials:
    """Infer a model from a given number of trials.

    Each batch: (1) Models are tried; their samples, and the genuine ones, go to the buffer. (2) Classifiers
    evolve for some generations on the buffer; the best of each goes to an archive. (3) Archived, present and
    random classifiers judge the samples again. (4) From their outputs jurors are trained whose expectation for
    a right model is that for the system (`train_moments`). (5) A map of these moments over the parameters
    (`MomentField`) says which models may be right; walkers follow it (`TrialDesign`), and the next batch is
    tried around them.

    Where the map fits nothing for long, `searches` go on instead. From 0.8 of the trials on such a run is `undecided`,
    until `settle` says which of their ends the rest of the trials is spent around.

    Only judgments enter: no distance between behaviors, no summary made by hand.

    Parameters
    ----------
    source
        Yields the samples of models (M, P) in the optimizer's numbers; one execution of `together` of them is
        one trial. If it has an attribute ``failed`` (M,), it marks simulations without samples.
    classifier
        Judges samples, as the genomes of `classifiers` say.
    classifiers
        Optimizer of the evolved classifiers.
    low, high : (P,)
        Range of first models.
    trials
        How many in all, at least 10.
    extended
        For a finished run that got more trials: the budget and the number of trials spent, (N, n), of each time
        before. Until n trials are spent it is a run of N trials; then its phases are those of one of `trials`,
        of which n are spent.
    seed
        A non-negative integer.
    observers
        Random classifiers beside the evolved ones; None: evolved ones only.
    genuine : (K, T, D)
        All genuine samples there are, for a system that is not observed anew in each trial. None takes those
        that come with each batch.
    groups, dependent, limits, saturated, symmetries
        As for `TrialDesign`: what may be exchanged or mirrored; which parameters end at `low` and `high`.
    together
        Number of models that a trial executes.
    searches
        Whether a run whose map fits nothing for long searches by the observers (`Climb`): with 3000 trials or
        more, whose batches are then collected in parts.

    Attributes
    ----------
    buffer
        All samples.
    batch
        What is known after the last batch; None before the first.
    present : (N, Q)
        The fittest classifiers after the last batch.
    climb
        Whether the run is lost, and its way out.

    Examples
    --------
    ``for batch in FewTrials(source, classifier, optimizer, low=low, high=high, trials=1000, seed=1): print(batch.estimate)``
    """

    def __init__(
        self, source: SampleSource, classifier: Classifier, classifiers: Optimizer, *, low: np.typing.ArrayLike,
        high: np.typing.ArrayLike, trials: int, seed: int, extended: Sequence[tuple[int, int]] = (),
        observers: Observers | None = None, genuine: np.ndarray | None = None,
        groups: Sequence[Sequence[int]] = (), dependent: Sequence[int] = (), limits: np.typing.ArrayLike = False,
        saturated: np.typing.ArrayLike = False, together: int = 1, searches: bool = False,
        symmetries: Sequence[tuple[Sequence[int], Sequence[float]]] = (),
    ) -> None:  # fmt: skip
        low, high = array("low", low, "P"), array("high", high, "P")
        require(low.shape == high.shape and (low < high).all(), "high", "be above `low`, for each parameter", f"{high}")
        self.trials = integer("trials", trials, 10)
        self._seed = integer("seed", seed)
        self._middle, self._half = (low + high) / 2, (high - low) / 2
        self._source, self._classifier, self._classifiers = source, classifier, classifiers
        self._observers, self._fixed = observers, genuine
        self._searches = searches and observers is not None
        self._archive = ClassifierArchive(_ARCHIVE, seed=(ARCHIVE, self._seed))
        self._design = TrialDesign(
            len(low),
            seed=(DESIGN, self._seed),
            explorers=0.0 if genuine is None else _EXPLORERS,
            groups=groups,
            dependent=dependent,
            limits=limits,
            saturated=saturated,
            symmetries=symmetries,
        )
        self._together = integer("together", together, 1)
        self._stages = (*extended, (trials, trials))
        self._schedule = batch_schedule(trials, len(low), extended)
        self.buffer = SampleBuffer(share=0.1 if genuine is None else 1.0)
        self.buffer.pool = self._pool
        self.batch: Batch | None = None
        self._number = 0
        self._drawn = np.empty((0, 0 if observers is None else observers.parameters))
        self._observed = None if observers is None else JudgmentRecord(observers)
        self._jury = JudgmentRecord(classifier)
        self.present = np.empty((0, classifier.parameters))
        self._density = _Density(None)
        self._pooled = np.empty((0, len(low)))
        self.climb = Climb(self._design.furthest)

    @property
    def complete(self) -> bool:
        """Whether all trials are spent."""
        return self.spent >= self.trials

    @property
    def spent(self) -> int:
        """Number of trials spent."""
        return len(self.buffer) // self._together

    @property
    def undecided(self) -> bool:
        """Whether it is time to `settle` on one of the centers of a lost run."""
        return self.climb.lost and not self.climb.settled and self.spent >= END * self._budget

    @property
    def _budget(self) -> int:
        """Number of trials that the phases of the next batch are relative to."""
        return next((trials for trials, end in self._stages if self.spent < end), self.trials)

    @property
    def _pool(self) -> int:
        return int(np.clip(self._budget, *_POOL)) if self._fixed is None else len(self._fixed)

    @property
    def draws(self) -> np.ndarray:
        """Draws (W, P) of the right model: the joint uncertainty as far as the moments tell.

        At the end of a run jurors are trained, and walkers moved, several times, to average over which trials
        fell into which fold.
        """
        return self._middle + self._half * (self._design.walkers if len(self._pooled) == 0 else self._pooled)

    @property
    def estimate(self) -> np.ndarray:
        """The estimate (P,): the median of the draws."""
        return np.median(self.draws, axis=0)

    @property
    def observed(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Outputs of the observers for usable trials (S, F) and genuine samples (K, F), and which trials these are (S,)."""
        usable = np.flatnonzero(self.buffer.usable)
        if self._observed is None:
            nothing = np.empty((0, 0), np.float32)
            return nothing.reshape(len(usable), 0), nothing.reshape(len(self.buffer.genuine), 0), usable
        return self._observed.counterfeit[usable], self._observed.genuine, usable

    def __iter__(self) -> Iterator[Batch]:
        while not self.complete:
            yield self.step()

    def step(self) -> Batch:
        """Spend a batch of trials and return what is known then; after a failure, `restore` the state before."""
        require(not self.complete, "trials", "be more than the run has spent", f"{self.trials}")
        with threadpool_limits(1, "blas"):  # sums in one order, for any number of processors
            if self.buffer.pool != self._pool:  # the run has got more trials: more genuine samples are judged
                self.buffer.pool = self._pool
                self._observe()
            spent, budget = self.spent, self._budget
            count = (self._schedule[self._number] - spent) * self._together
            self.climb.begin(spent / budget)
            if self.climb.settled:
                self._try(self.climb.around(count, self._design.walkers, self._rng(CLIMBING)))
            elif self.climb.lost:
                self._search(count)
            else:
                self._try(self._design.propose(count, spent / budget) if spent else self._design.start(count))
            self._evolve()
            explained, self._pooled = self._match(0), self._design.walkers
            if self._observers is not None and self._number % _RENEWED_EVERY == 2 and spent <= _RENEWED_UNTIL * budget:
                self._renew_observers()
        self._number += 1
        self.batch = self._known(explained)
        if self._searches and budget >= FEWEST:
            self.climb.end(self.spent / budget, self.batch.misfit)
        return self.average() if self.spent in [end for _, end in self._stages] else self.batch

    def average(self) -> Batch:
        """Train jurors and move walkers several times more, as at the end of a run; return what is known then."""
        assert self.batch is not None
        with threadpool_limits(1, "blas"):
            for k in range(0 if self.climb.settled else _REPEATS):
                self._match(k + 1)
                self._pooled = np.concatenate((self._pooled, self._design.walkers))
        self.batch = self._known(self.batch.explained)
        return self.batch

    def settle(self, draws: np.typing.ArrayLike) -> Batch:
        """Spend the next trials of a lost run around draws (N, P) of the right model; return what is known then."""
        require(self.climb.lost, "trials", "be those of a lost run", "those of another run")
        assert self.batch is not None
        self.climb.settled = True
        self._design.gather((array("draws", draws, "N P", P=len(self._middle)) - self._middle) / self._half)
        self._pooled = self._design.walkers
        self.batch = self._known(self.batch.explained)
        return self.batch

    def _search(self, count: int) -> None:
        """Try so many models of the searches of a lost run, a few at a time."""
        most = -(-max(self.climb.most, count // _PARTS) // self._together) * self._together
        ends = [*range(0, count, most), count]
        for part, (first, last) in enumerate(pairwise(ends)):
            outputs, genuine, usable = self.observed
            known = self.buffer.parameters[usable], outputs, genuine
            progress = self.spent / self._budget
            self._try(self.climb.models(last - first, progress, *known, self._rng(CLIMBING, part)), part)
        outputs, genuine, usable = self.observed
        self.climb.judge(self.buffer.parameters[usable], outputs, genuine)

    def _known(self, explained: np.ndarray) -> Batch:
        spread, field = self.draws.std(axis=0), self._density.near
        misfit = 1.0 if field is None else field.misfit
        return Batch(self._number - 1, self.spent, self.estimate, spread, explained, misfit)

    def _try(self, models: np.ndarray, part: int = 0) -> None:
        """Simulate models (M, P) in the design's units, a part of a batch, and let the observers see what comes."""
        use = (part,) if part else ()
        samples = self._source.collect(self._middle + self._half * models, self._rng(INTERROGATION, *use))
        failed = getattr(self._source, "failed", None)
        usable = None if failed is None else ~np.asarray(failed, bool)
        genuine = samples.genuine if self._fixed is None else self._fixed
        if part or (self._fixed is not None and len(self.buffer)):  # those of this batch, or all, are kept already
            genuine = genuine[:0]
        rng = self._rng(BUFFER, *use)
        kept = self.buffer.append(models, samples.counterfeit, genuine, rng, usable)
        if self._observers is not None and len(self._drawn) == 0:
            shown = samples.counterfeit.reshape(-1, *samples.counterfeit.shape[2:])
            some = kept[rng.permutation(len(kept))[: len(shown)]]
            self._drawn = self._observers.draw(_OBSERVERS, np.concatenate((shown, some)), rng)
        self._observe()

    def _observe(self) -> None:
        """Let the observers judge new trials and genuine samples."""
        if self._observed is not None:
            self._observed.update(self._drawn, self.buffer)

    def _renew_observers(self) -> None:
        """Draw anew the observers to which the trials near the solution look alike, and the genuine samples, too.

        The first observers look at models from the whole range. Where that is wide, most of them say the same of all models
        that are left.
        """
        usable = np.flatnonzero(self.buffer.usable)
        density = self._density(self.buffer.parameters[usable])
        near = usable[np.argsort(-density, kind="stable")[:_RENEWED_BY]]
        assert self._observers is not None
        assert self._observed is not None
        variation = np.maximum(self._observed.counterfeit[near].std(axis=0), self._observed.genuine.std(axis=0))
        still = np.flatnonzero(variation < _STILL)
        if len(still) == 0:
            return
        rng = self._rng(BUFFER, _RENEWAL)
        genuine = self.buffer.genuine
        samples = self.buffer.samples[near].reshape(-1, *genuine.shape[1:])
        count = min(len(samples), len(genuine))
        samples = samples[rng.permutation(len(samples))[:count]]
        shown = np.concatenate((samples, genuine[rng.permutation(len(genuine))[:count]]))
        self._drawn[still] = self._observers.draw(len(still), shown, rng)
        self._observe()

    def _evolve(self) -> None:
        """Let classifiers evolve on the buffer; keep the best."""
        usable = np.flatnonzero(self.buffer.usable)
        samples, genuine = self.buffer.samples, self.buffer.genuine
        for k in range(_GENERATIONS):
            rng = generation_rng((CLASSIFIERS, self._seed), _GENERATIONS * self._number + k)
            trials = np.concatenate((usable[-_RECENT:], usable[rng.integers(len(usable), size=_OLD)]))
            counterfeit = samples[trials, rng.integers(samples.shape[1], size=len(trials))]
            others = genuine[rng.integers(len(genuine), size=_GENUINE)]
            genomes = self._classifiers.ask()
            accepted = (self._classifier.judge(genomes, others) >= THRESHOLD).mean(axis=1)
            fooled = (self._classifier.judge(genomes, counterfeit) >= THRESHOLD).mean(axis=1)
            fitness = 0.5 * (accepted + 1 - fooled)
            self._classifiers.tell(fitness)
            best = int(np.argmax(fitness))
            self._archive.admit(genomes[best], float(accepted[best]))
        self.present = genomes[np.argsort(-fitness, kind="stable")[:_PRESENT]]
        self._jury.update(np.concatenate((self._archive.genomes, self.present)), self.buffer)

    def _match(self, repeat: int) -> np.ndarray:
        """Map the moments and let the walkers follow; return how much of each parameter a trial tells (P,)."""
        usable, number = np.flatnonzero(self.buffer.usable), self._number - (repeat > 0)
        rng = generation_rng((MATCHING, self._seed, repeat), number)
        near = self._nearest(usable, rng)
        field, explained = self._mapped(near, rng)
        wide, reference = self._density.wide, 0.0
        if len(usable) > _NEAR_LEAST and (wide is None or number % _WIDE_EVERY == 0):
            rest = rng.permutation(np.setdiff1d(usable, near))[: _WIDE_TRIALS - _FAR]
            some = rng.permutation(near)[: max(_FAR, _WIDE_TRIALS - len(rest))]
            wide, _ = self._mapped(np.sort(np.concatenate((rest, some))), rng, _WIDE_POINTS)
        if wide is not None:
            reference = float(wide.log_density(self._design.walkers).max())
        self._density = _Density(field, wide, reference)
        if not self.climb.settled:  # else the map says nothing
            self._design.move(self._density)
        return explained

    def _nearest(self, usable: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the trials that are matched: those most likely to be right, and some of the others."""
        size = round(np.clip(_NEAR_SHARE * len(usable), _NEAR_LEAST, _NEAR_MOST))
        if len(usable) <= size or self._density.near is None:
            return usable
        order = usable[np.argsort(-self._density(self.buffer.parameters[usable]), kind="stable")]
        others = rng.permutation(order[size - _FAR :])[:_FAR]
        return np.sort(np.concatenate((order[: size - _FAR], others)))

    def _mapped(
        self, trials: np.ndarray, rng: np.random.Generator, points: int = INDUCING
    ) -> tuple[MomentField, np.ndarray]:
        """Return a field of the moments of some trials, and how much of each parameter a trial tells (P,)."""
        records = [self._jury] if self._observed is None else [self._observed, self._jury]
        outputs = np.concatenate([record.counterfeit[trials] for record in records], axis=1)
        system = np.concatenate([record.genuine for record in records], axis=1)
        parameters = self.buffer.parameters[trials]
        moments = train_moments(parameters, outputs, system, rng)
        # of the genuine mean: as many samples of a trial may be alike
        noise = self.buffer.samples.shape[1] / len(system)
        field = MomentField(parameters, moments.values, noise, rng, inducing=points)
        field.calibrate(self._design.walkers)
        return field, moments.explained

    def _rng(self, purpose: int, *use: int) -> np.random.Generator:
        return generation_rng((purpose, self._seed, *use), self._number)

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume, as arrays.

        The rows of those named "buffer/..." only grow: `SampleBuffer.since` gives the new ones. All else is
        small.
        """
        parts = {
            "buffer": self.buffer.state(),
            "classifiers": self._classifiers.state(),
            "archive": self._archive.state(),
            "design": self._design.state(),
            "density": self._density.state(),
            "climb": self.climb.state(),
        }
        batch = {} if self.batch is None else {"explained": self.batch.explained}
        return {
            "number": np.array(self._number, dtype=np.int64),
            "drawn": self._drawn.copy(),
            "present": self.present.copy(),
            "pooled": self._pooled.copy(),
            **batch,
            **join_states(parts),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state of a run with the same settings, but for `extended`."""
        require("number" in state, "state", "be that of an estimate from few trials", str(sorted(state)))
        self._number = int(state["number"])
        self._drawn, self.present = (np.array(state[name], dtype=np.float64) for name in ("drawn", "present"))
        self._pooled = np.array(state["pooled"], dtype=np.float64)
        self.buffer.restore(state_part(state, "buffer/"))
        self.buffer.pool = self._pool
        self._classifiers.restore(state_part(state, "classifiers/"))
        self._archive.restore(state_part(state, "archive/"))
        self._design.restore(state_part(state, "design/"))
        self._density = _Density.restored(state_part(state, "density/"))
        self.climb = Climb(self._design.furthest)
        if climb := state_part(state, "climb/"):  # runs of before have none
            self.climb.restore(climb)
        self._observed = None if self._observers is None else JudgmentRecord(self._observers)
        self._jury = JudgmentRecord(self._classifier)
        if self._number:
            self._observe()
            self._jury.update(np.concatenate((self._archive.genomes, self.present)), self.buffer)
            self.batch = self._known(np.array(state["explained"], dtype=np.float64))
        else:
            self.batch = None


def batch_schedule(trials: int, dimension: int, extended: Sequence[tuple[int, int]] = ()) -> list[int]:
    """Return how many trials are spent after each batch of a run with so many parameters; see `FewTrials`."""
    spent: list[int] = []
    for budget, end in (*extended, (trials, trials)):
        first = min(
            round(np.clip(_FIRST_SHARE * budget, _FIRST_LEAST * dimension, _FIRST_MOST * dimension)), budget // 2
        )
        size = max(2, -(-(budget - first) // BATCHES))
        spent = spent or [first]
        while spent[-1] < end:
            spent.append(min(spent[-1] + size, end))
    return spent


class _Density:
    """The density of the right model: where it is by the nearest trials, as far as a map of all trials does not exclude it.

    Explorers ask for a power of it below 1. For them the map of all trials counts in full, not only where it
    excludes models.
    """

    def __init__(self, near: MomentField | None, wide: MomentField | None = None, reference: float = 0.0) -> None:
        self.near, self.wide, self._reference = near, wide, reference

    def __call__(
        self, models: np.ndarray, hopeful: bool = False, power: float = 1.0, least: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the logarithm (N,) of the density of models (N, P); see `TrialDesign` for the arguments."""
        assert self.near is not None
        density = self.near.log_density(models, hopeful)
        if self.wide is None:
            return power * density
        if power < 1:
            return power * (density + self.wide.log_density(models, hopeful))
        if least is None:
            least = np.full(len(density), density.max(initial=-np.inf) - _HOPELESS)
        # the wide map only makes models less likely
        counts = density > least
        if counts.any():
            excluded = self.wide.log_density(models[counts]) - self._reference + _SLACK
            density[counts] += np.minimum(excluded, 0)
        return density

    def state(self) -> dict[str, np.ndarray]:
        fields = {"near": self.near, "wide": self.wide}
        parts = join_states({name: field.state() for name, field in fields.items() if field})
        return {"reference": np.array(self._reference), **parts}

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray]) -> "_Density":
        parts = [state_part(state, f"{name}/") for name in ("near", "wide")]
        near, wide = (MomentField.restored(part) if part else None for part in parts)
        return cls(near, wide, float(state["reference"]))
