"""The loop that a configuration describes: a coevolution, or an estimate from few trials in the form of one.

Both step by generations, and have a `state`, to be restored; `rows`, samples that are stored as they come; and
a `readout`, what is read off at the end. In an estimate from few trials one step is one batch of trials.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from turing_learning import coevolution, evolution
from turing_learning.analysis import LEAST_P, Matched, combined, match, predictive_check, resemblance
from turing_learning.coevolution import THRESHOLD, Coevolution, FewTrials, Generation
from turing_learning.config import Configuration, classifier_of
from turing_learning.config.parts import classifiers_optimizer, models_optimizer, observers_of, optimizer_of
from turing_learning.purposes import ARCHIVE, CLASSIFIERS, INTERROGATION, MATCHING
from turing_learning.systems import Source, System

_READ_OUT = 1_000_000  # batch whose random numbers the intervals are drawn with
_JUDGED = 200  # genuine samples by which the fitness of a batch is stated
_AT_END = 0.05  # share of the loop's draws at an end that the 90 % interval reaches
_NEAR_END = 0.1  # of its width: an interval that is so near an end includes it, as draws do not become fewer towards it
_FEWEST = 50  # trials within the range, to be matched
_CENTERS, _SPREAD = 12, 0.03  # ends of searches that are matched; standard deviation of its draws to begin with
_AROUND = 0.2, 3.0  # share of the trials that an end is matched by; of these, one in so many are nearest to the agents
_SHARES = (0.3, 2.5), (0.2, 2.0), (0.1, 3.0), (0.1, 3.0)  # likewise, of the solutions of a lost run, which are mixed
_REFINED = 3  # batches after which a lost run that has settled is matched anew
_AT_LEAST = 500  # trials that such a share has
EXAMINED_SHARE, EXAMINED = 20, (30, 150)  # one trial in so many, within bounds, examines the estimate at the end
APART = 0.6  # standard deviations of an image, for each root of the number of genuine samples, within which it may be the solution
LEAST_IMAGE = 0.05  # p-value of new samples from which the image of a solution is a solution, too
IMAGES = 8  # that are examined, at most
NEIGHBORS, NEAR_IMAGE = (
    20,
    0.05,
)  # trials that are looked at beside an image; least distance that counts, in halves of a range
_LOOKED_AT = 4  # batches after which a run with a tolerance looks at its intervals, from the second time on


class Generations(Coevolution):
    """The coevolution that a configuration describes, as the loop of a run: its history is all that is stored and read off."""

    tolerated = False

    def __init__(self, configuration: Configuration, source: Source) -> None:
        classifier, run, archive = classifier_of(configuration), configuration.run, configuration.coevolution.archive
        known = coevolution.ClassifierArchive(archive, seed=(ARCHIVE, run.seed)) if archive else None
        reward = {"reward_models": coevolution.jury_reward} if archive else {}
        models, judges = models_optimizer(configuration), classifiers_optimizer(configuration, classifier.parameters)
        interrogation, seed = source.interrogation(classifier), (INTERROGATION, run.seed)
        super().__init__(interrogation, models, judges, seed=seed, archive=known, **reward)

    def rows(self) -> dict[str, np.ndarray]:
        """Return nothing."""
        return {}

    readout = rows


class TrialsLoop:
    """`FewTrials` for the configuration of a run with `run.trials`, and its samples, as the loop of the run."""

    def __init__(self, configuration: Configuration, source: Source) -> None:
        system, section, seed = configuration.system, configuration.classifiers, configuration.run.seed
        jumps, saturation = configuration.representation.jumps, dict(configuration.representation.saturation)
        self._source = source
        self._symmetries = symmetries_of(system) if source.genuine is not None else []
        self.classifier = classifier_of(configuration)
        dimension, models = len(configuration.parameter_names), configuration.models
        low, high = (models.initial_low, models.initial_high) if source.ends is None else source.ends
        middle, half = (low + high) / 2, (high - low) / 2
        reach = half * np.resize(np.asarray(jumps.reach, float), dimension)
        reach[list(saturation)] = list(saturation.values())
        ends = [each.initial == (each.low, each.high) for each in system.parameters.values()]
        self._saturated = np.isin(np.arange(dimension), list(saturation)) | (source.ends is not None)
        self._limits = np.array(ends) if source.genuine is not None else self._saturated
        learning = source.genuine.learning if source.genuine is not None and not source.genuine.live else None
        self._observed_anew = learning is None
        self._fixed: np.ndarray | None = None
        if learning is not None and source.genuine is not None:
            self._fixed = system.centered(source.genuine.samples)  # type: ignore[attr-defined]
        recorded = learning is not None and getattr(system, "interval_s", 0) > 0
        self._examinable = source.ends is None and not recorded
        optimizer = optimizer_of(section, self.classifier.parameters, (CLASSIFIERS, seed), "classifiers")
        self.trials = FewTrials(
            source,
            self.classifier,
            optimizer,
            low=middle - reach,
            high=middle + reach,
            trials=configuration.run.trials,
            seed=seed,
            extended=configuration.run.extended,
            observers=observers_of(configuration),
            genuine=None if learning is None else system.centered(learning),  # type: ignore[attr-defined]
            groups=jumps.groups,
            dependent=jumps.dependent,
            limits=self._limits & ~self._saturated,
            saturated=self._saturated,
            together=source.together,
            symmetries=self._symmetries,
            searches=learning is None and source.ends is None,  # not in a laboratory, which stores whole batches
        )
        self._seed, self._middle, self._reach = seed, np.full(dimension, middle), reach
        self._counts = (0, 0)  # rows of the buffer that are stored
        self._range = np.where(self._limits, 1.0, 2.0)
        self._tolerance, self._earlier = configuration.run.tolerance, configuration.run.earlier
        self._matched: tuple[int, Matched | None] = (0, None)
        self.tolerated = False  # whether it has stopped before its trials were spent

    @property
    def generation(self) -> int:
        """Number of completed batches."""
        return 0 if self.trials.batch is None else self.trials.batch.number + 1

    def step(self) -> Generation:
        """Spend a batch of trials; return it as a generation, whose models are those tried, the best one the most accepted."""
        before, number = len(self.trials.buffer), self.generation
        batch, buffer = self.trials.step(), self.trials.buffer
        if self.trials.climb.lost and not self.trials.complete:
            found = self._center(number)
            batch = batch if found is None else self.trials.settle(self._middle + self._reach * found.draws)
        if self._tolerance and number % _LOOKED_AT == 0 and number >= 2 * _LOOKED_AT and not self.trials.complete:
            found = None if self.trials.climb.lost else self.matched()
            if found is not None and found.settled and found.identified.any():
                halves = (found.interval_high - found.interval_low)[found.identified] / 2
                self.tolerated = bool((halves <= 2 * self._tolerance).all())  # of a range of 2
            batch = self.trials.average() if self.tolerated else batch
        jury, tried = self.trials.present, slice(before, len(buffer))
        samples = buffer.samples[tried, 0]
        accepted = self.classifier.judge(jury, samples) >= THRESHOLD
        genuine = self.classifier.judge(jury, buffer.genuine[-_JUDGED:]) >= THRESHOLD
        fitness = accepted.mean(axis=0)
        models = self._middle + self._reach * buffer.parameters[tried]
        return Generation(
            number=number,
            models=models,
            model_step_sizes=np.broadcast_to(batch.spread, models.shape),
            model_fitness=fitness,
            model_scores=fitness,
            classifiers=jury,
            classifier_step_sizes=np.zeros_like(jury),
            classifier_fitness=0.5 * (genuine.mean(axis=1) + 1 - accepted.mean(axis=1)),
            selection="active",  # nothing is selected among the models of a batch
            referees=jury[:0],
            estimate=self._source.to_units(batch.estimate[None])[0],
        )

    def rows(self) -> dict[str, np.ndarray]:
        """Return the samples that have come since the last call."""
        buffer, before = self.trials.buffer, self._counts
        self._counts = buffer.counts
        return buffer.since(*before)

    def matched(self) -> Matched | None:
        """Match the agents after the last batch, with the range of the first models as [-1, 1]; None with too few trials there.

        A canary is drawn by chance. So a solution that is not settled, though no classifier tells it from the
        agents, is sought twice more. Of the three, that counts whose canary has the middle share of its range.
        Solutions of a lost run depend on the trials they rest on. So several are mixed.
        """
        if self._matched[0] == self.generation:
            return self._matched[1]
        found, samples, rng = None, self._samples(), self._rng()
        middle = (self.trials.estimate - self._middle) / self._reach
        start = middle, self.trials.draws.std(axis=0) / self._reach
        if len(samples[0]) >= _FEWEST:
            if self.trials.climb.lost:
                found = combined([self._match(samples, *start, rng, *share) for share in _SHARES], self._range)
            else:
                found = self._match(samples, *start, rng)
                if not found.settled and found.p_value >= LEAST_P:
                    more = [self._match(samples, *start, rng) for _ in range(2)]
                    found = sorted((found, *more), key=lambda each: each.canary)[1]
        self._matched = self.generation, found
        return found

    def _center(self, number: int) -> Matched | None:
        """Return where a lost run goes on after a batch: None, if it goes on as it does.

        When it is time to decide, its walkers and the ends of its searches are matched, each from the trials around
        it; the best one counts. From then on it is matched anew from time to time.
        """
        walkers, samples = (self.trials.draws - self._middle) / self._reach, self._samples()
        due = self.trials.undecided or (self.trials.climb.settled and number % _REFINED == 0)
        if not due or len(samples[0]) < _FEWEST:
            return None
        starts = [(np.median(walkers, axis=0), walkers.std(axis=0))]
        if self.trials.undecided:
            starts += [(center, np.full(len(center), _SPREAD)) for center in self.trials.climb.centers[:_CENTERS]]
        best = min(
            (self._match(samples, *start, self._rng(1), *_AROUND) for start in starts), key=lambda each: each.order
        )
        return best if self.trials.undecided or not best.order[0] else None

    def _rng(self, *use: int) -> np.random.Generator:
        return evolution.generation_rng((MATCHING, self._seed, *use), _READ_OUT + self.generation)

    def _samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return parameters (S, P) of the trials within the range, and outputs for these (S, F) and for genuine samples (K, F)."""
        counterfeit, genuine, usable = self.trials.observed
        parameters = self.trials.buffer.parameters[usable]
        if self._limits.any():
            parameters = np.where(self._limits, np.clip(parameters, -1, 1), parameters)
        inside = (np.abs(parameters) <= self._range).all(axis=1)
        return parameters[inside], counterfeit[inside], genuine

    def _match(
        self, samples: tuple[np.ndarray, np.ndarray, np.ndarray], start: np.ndarray, spread: np.ndarray,
        rng: np.random.Generator, share: float = 1.0, parts: float = 1.0,
    ) -> Matched:  # fmt: skip
        """Match the agents; with a share, from those trials alone that are nearest to the start, and a few others."""
        parameters, counterfeit, genuine = samples
        count, size = max(round(share * len(parameters)), _AT_LEAST), {}
        if share < 1 and count < len(parameters):
            order = np.argsort(((parameters - start) ** 2).sum(axis=1), kind="stable")
            chosen = np.sort(np.concatenate((order[:count], rng.permutation(order[count:])[: count // 10])))
            parameters, counterfeit, size = parameters[chosen], counterfeit[chosen], {"size": round(count / parts)}
        return match(
            parameters,
            counterfeit.T,
            genuine.T,
            low=-self._range,
            high=self._range,
            start=np.clip(start, -self._range, self._range),
            spread=2 * np.maximum(spread, 1e-3),
            averaged=self.trials.buffer.samples.shape[1],
            farther=self._observed_anew,
            rng=rng,
            **size,
        )

    def readout(self) -> dict[str, np.ndarray]:
        """Return what matching found: "p_value"; if settled, in units, "estimate" (P,), "interval" (2, P), and "draws" (D, P)."""
        found = self.matched()
        if found is None:
            return {}
        low, high, inferred = found.interval_low, found.interval_high, np.median(found.draws, axis=0)
        if self._saturated.any():  # matching, whose models have a density, gives none of it to an end
            tried = (self.trials.draws - self._middle) / self._reach
            last = 1.0 if self._source.ends is not None else np.inf  # the end itself, if it is infinitely far
            near = _NEAR_END * (high - low)
            for side, bound in ((-1, low), (1, high)):
                at_end = np.where(self._saturated, (side * tried >= 1).mean(axis=0), 0)
                reached = (at_end >= _AT_END) | self._saturated & (side * bound >= 1 - near)
                low, high = np.where(reached & (side < 0), -last, low), np.where(reached & (side > 0), last, high)
                inferred = np.where(at_end > 0.5, side * last, inferred)
        values = {"estimate": inferred[None], "interval": np.stack((low, high)), "draws": found.draws}
        scaled = {name: self._source.to_units(self._middle + self._reach * value) for name, value in values.items()}
        scaled["estimate"] = scaled["estimate"][0]
        if not found.settled:
            return {"p_value": np.array(found.p_value)}
        examined, numbers = self._examined(found), found.mode
        if "draws" in examined:
            draws, numbers = examined.pop("draws"), examined.pop("mode")
            scaled["draws"] = self._source.to_units(self._middle + self._reach * draws)
        return {"p_value": np.array(found.p_value), "mode": numbers} | scaled | examined

    def _examined(self, found: Matched) -> dict[str, np.ndarray]:
        """Return what new samples of the draws say of them, see `predictive_check`: "examined" (2,), "statistic".

        Also "draws" and "mode", where the images of a solution by a symmetry of its parameters are solutions, too: as good
        by new samples. Nothing in a laboratory, whose trials cost, and of recordings, whose windows are not independent.
        """
        if not self._examinable:
            return {}
        rng = self._rng(2)
        names = self._source.system.signals
        buffer = self.trials.buffer
        others = buffer.samples[buffer.usable, 0], buffer.parameters[buffer.usable]
        count = int(np.clip(self.trials.trials // EXAMINED_SHARE, *EXAMINED))
        solutions = [found.draws[found.mode == number] for number in range(int(found.mode.max()) + 1)]
        checks, fresh = [], []
        for draws in solutions:
            models, samples, genuine = self._sampled(draws, count // len(solutions), rng)
            checks.append(predictive_check(genuine, samples, models, draws, names=names, rng=rng, others=others))
            fresh.append(samples)
        best = max(checks, key=lambda check: check.p_value)
        report = {"examined": np.array([best.p_value, best.difference]), "statistic": np.array(best.statistic)}
        if best.p_value < LEAST_IMAGE:
            return report
        images = []
        for draws, number in self._images(solutions)[:IMAGES]:
            _, samples, _ = self._sampled(draws, count // 2, rng)
            if resemblance(samples, fresh[number], names, rng) >= LEAST_IMAGE:
                images.append(draws)
        if not images:
            return report
        together = [*solutions, *images]
        draws = np.concatenate(together)
        numbers = np.repeat(np.arange(len(together)), [len(part) for part in together])
        return report | {"draws": draws, "mode": numbers}

    def _sampled(
        self, draws: np.ndarray, count: int, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Simulate so many of the draws (D, P); return them, their samples (count, T, D), and genuine ones (K, T, D)."""
        models = draws[rng.permutation(len(draws))[:count]]
        samples = self._source.collect(self._middle + self._reach * models, rng)
        failed = getattr(self._source, "failed", np.zeros(len(models), dtype=bool))
        # of a swarm that is observed anew, one agent of each trial: those of one trial depend on each other
        genuine = samples.genuine[:: max(len(samples.genuine) // count, 1)] if self._fixed is None else self._fixed
        return models[~failed], samples.counterfeit[~failed, 0], genuine

    def _images(self, solutions: Sequence[np.ndarray]) -> list[tuple[np.ndarray, int]]:
        """Return images of solutions by symmetries, and whose they are: those first whose trials look most genuine.

        They lie apart from all solutions: so far that samples of models halfway would be told.
        """
        images: list[tuple[np.ndarray, int]] = []
        far = APART if self._fixed is None else APART * np.sqrt(len(self._fixed))
        for number, draws in enumerate(solutions):
            for order, signs in self._symmetries:
                image = np.asarray(signs) * draws[:, order]
                before = [*solutions, *(other for other, _ in images)]
                if all(_apart(image, other, far) for other in before):
                    images.append((image, number))
        outputs, genuine, usable = self.trials.observed
        parameters = self.trials.buffer.parameters[usable]
        unlike = []
        for image, _ in images:
            scale = np.maximum(image.std(axis=0), NEAR_IMAGE)
            near = np.argsort((((parameters - np.median(image, axis=0)) / scale) ** 2).sum(axis=1))[:NEIGHBORS]
            spread = np.sqrt(outputs[near].var(axis=0) + genuine.var(axis=0)) + 1e-3
            unlike.append((((outputs[near].mean(axis=0) - genuine.mean(axis=0)) / spread) ** 2).mean())
        return [images[k] for k in np.argsort(unlike, kind="stable")]

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume but the buffer, whose rows are stored as they come."""
        state = {name: array for name, array in self.trials.state().items() if not name.startswith("buffer/")}
        return state | {"tolerated": np.array(self.tolerated)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state, with the rows of the buffer as "buffer/..."; without these the buffer stays as it is."""
        rows = {} if any(name.startswith("buffer/") for name in state) else self.trials.buffer.state()
        self.trials.restore({**state, **{f"buffer/{name}": array for name, array in rows.items()}})
        self._counts = self.trials.buffer.counts
        extended = self.trials.spent in self._earlier
        self.tolerated = bool(state.get("tolerated", False)) and not extended


def symmetries_of(system: System) -> list[tuple[list[int], list[float]]]:
    """Return what may turn one solution of a custom system into another: orders and signs of its parameters.

    Parameters of the same range may be exchanged: two of them, or those of two parts of a model, such as the mean and the
    spread of each of two states. Any parameter may be mirrored at the middle of its range.
    """
    parameters = list(system.parameters.values())
    count = len(parameters)
    alike: dict[tuple[float | None, float | None, str], list[int]] = {}
    for place, parameter in enumerate(parameters):
        low, high = parameter.initial or (parameter.low, parameter.high)
        alike.setdefault((low, high, parameter.scale), []).append(place)
    exchanges: set[tuple[int, ...]] = set()
    groups = [places for places in alike.values() if len(places) > 1]
    for size in {len(places) for places in groups}:
        same = [places for places in groups if len(places) == size]
        for first, second in combinations(range(size), 2):
            whole = list(range(count))
            for places in same:
                whole[places[first]], whole[places[second]] = places[second], places[first]
                single = list(range(count))
                single[places[first]], single[places[second]] = places[second], places[first]
                exchanges.add(tuple(single))
            exchanges.add(tuple(whole))
    for places in groups:  # parts whose parameters all have one range: every second, or the halves
        half = len(places) // 2
        if len(places) % 2 == 0 and half > 1:
            for pairs in (zip(places[::2], places[1::2], strict=True), zip(places[:half], places[half:], strict=True)):
                whole = list(range(count))
                for first, second in pairs:
                    whole[first], whole[second] = second, first
                exchanges.add(tuple(whole))
    plain = [1.0] * count
    found = [(list(order), plain) for order in sorted(exchanges)]
    for place in range(count):
        signs = plain.copy()
        signs[place] = -1.0
        found.append((list(range(count)), signs))
    return found


def _apart(some: np.ndarray, others: np.ndarray, far: float) -> bool:
    """Say whether draws (D, P) lie beside others in a parameter: their central 90 %, and so many standard deviations away."""
    low, high = np.quantile(some, [0.05, 0.95], axis=0)
    other_low, other_high = np.quantile(others, [0.05, 0.95], axis=0)
    distance = np.abs(np.median(some, axis=0) - np.median(others, axis=0))
    beside = (high < other_low) | (low > other_high)
    return bool((beside & (distance > far * np.maximum(some.std(axis=0), others.std(axis=0)))).any())


Loop = Generations | TrialsLoop


def loop_of(configuration: Configuration, source: Source) -> Loop:
    """Return the loop of a run, with its samples."""
    return (TrialsLoop if configuration.run.trials else Generations)(configuration, source)
