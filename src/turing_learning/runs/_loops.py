"""The loop that a configuration describes.

A coevolution by generations, or an estimate from few trials.

Both step, and say what the step leaves: a `Generation`, or a `TrialBatch`. Both have a `state`, to be restored;
`take_rows`, samples that are stored as they come; and a `readout`, what is read off at the end.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from turing_learning import coevolution
from turing_learning.analysis import SURE, Judgment
from turing_learning.coevolution import Coevolution, Generation
from turing_learning.config import Configuration, classifier_of
from turing_learning.config.parts import (
    classifiers_optimizer,
    models_optimizer,
    observers_of,
    optimizer_of,
)
from turing_learning.errors import RefusedError
from turing_learning.evolution import join_states
from turing_learning.few_trials import (
    Coordinates,
    Examiner,
    FewTrials,
    Observers,
    SearchSpace,
    Symmetry,
    candidate_symmetries,
    ridge_coordinates,
    samples_of,
    walked_symmetries,
)
from turing_learning.identifiability import (
    Effort,
    evidence_of,
    reference_accuracies,
    two_sample_test,
)
from turing_learning.purposes import ARCHIVE, CLASSIFIERS, INTERROGATION
from turing_learning.systems import FallibleSource, Source, SystemFailedError

PANEL_EFFORT = Effort(samples=150, references=4, points=0)
"""Of a panel that looks at the estimate of a run of trials; 0.2 s of processor time in aggregation."""


class Generations:
    """The coevolution that a configuration describes.

    Its history is all that is stored and read off.
    """

    tolerated = False
    stores_rows = False

    def __init__(self, configuration: Configuration, source: Source) -> None:
        run = configuration.run
        classifier = classifier_of(configuration)
        options: dict[str, Any] = {}
        if configuration.coevolution.archive:
            size = configuration.coevolution.archive
            options["archive"] = coevolution.ClassifierArchive(size, seed=(ARCHIVE, run.seed))
            options["reward_models"] = coevolution.jury_reward
        self._source = source
        self.coevolution = Coevolution(
            source.interrogation(classifier),
            models_optimizer(configuration),
            classifiers_optimizer(configuration, classifier.parameters),
            seed=(INTERROGATION, run.seed),
            **options,
        )

    @property
    def completed(self) -> int:
        return self.coevolution.generation

    def step(self) -> Generation:
        """Run a generation; its models are in their units."""
        generation = self.coevolution.step()
        return replace(generation, models=self._source.to_units(generation.models))

    examined_by = 0

    def take_rows(self) -> dict[str, np.ndarray]:
        """Return nothing: populations are in the history, and the result is read from it."""
        return {}

    readout = take_rows

    def state(self) -> dict[str, np.ndarray]:
        return self.coevolution.state()

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        self.coevolution.restore(state)


@dataclass(frozen=True, eq=False)
class TrialBatch:
    """A batch of trials, and what is known after it."""

    number: int  #: 0 for the first
    models: np.ndarray  #: (M, P), that were tried, in their units
    model_fitness: np.ndarray  #: (M,), share of the classifiers that accept each
    classifiers: np.ndarray  #: (N, Q), the fittest ones
    classifier_fitness: np.ndarray  #: (N,), mean of specificity and sensitivity
    estimate: np.ndarray  #: (P,), after the batch, in its units

    @property
    def best_model(self) -> np.ndarray:
        """The model (P,) of the batch that most classifiers accept, the first of equals."""
        return self.models[np.argmax(self.model_fitness)]


class TrialsLoop:
    """The estimate from few trials that a configuration describes; its samples are stored, too."""

    stores_rows = True

    def __init__(self, configuration: Configuration, source: Source) -> None:
        section = configuration.classifiers
        run = configuration.run
        seed = run.seed
        classifier = classifier_of(configuration)
        space = search_space(configuration, source)
        observers = observers_of(configuration)
        self._configuration = configuration
        self._source = source
        # Rows of the buffer that are stored: trials, genuine samples
        self._stored = (0, 0)
        self.trials = FewTrials(
            source,
            classifier,
            optimizer_of(section, classifier.parameters, (CLASSIFIERS, seed), "classifiers"),
            space,
            trials=run.trials,
            seed=seed,
            tolerance=run.tolerance,
            extended=run.extended,
            batch=run.batch,
            observers=observers,
            genuine=source.recorded,
            examiner=examiner_of(source, space, observers),
            together=source.together,
            searches=source.observed_anew and not source.whole_batches,
        )

    @property
    def completed(self) -> int:
        return self.trials.batches

    @property
    def tolerated(self) -> bool:
        """Whether it has stopped before its trials were spent."""
        return self.trials.tolerated

    @property
    def examined_by(self) -> int:
        """Number of simulations by which the estimate is examined, or more; 0 where they cost little."""
        if self._source.independent is None or self._source.cheap:
            return 0
        return samples_of(self.trials.trials)

    def step(self) -> TrialBatch:
        """Spend a batch of trials."""
        batch = self.trials.step()
        return TrialBatch(
            number=batch.number,
            models=self._source.to_units(batch.models),
            model_fitness=batch.model_fitness,
            classifiers=batch.classifiers,
            classifier_fitness=batch.classifier_fitness,
            estimate=self._source.to_units(batch.estimate[None])[0],
        )

    def take_rows(self) -> dict[str, np.ndarray]:
        """Return the samples that have come since the last call."""
        before = self._stored
        self._stored = self.trials.buffer.counts
        return self.trials.buffer.since(*before)

    def readout(self) -> dict[str, np.ndarray]:
        """Return what is read off at the end, with parameters in their units.

        See `FewTrials.readout` and `panel_examination`.
        """
        readout = self.trials.readout()
        buffer = self.trials.buffer
        estimate = readout.get("estimate", self.trials.estimate)
        if self._source.told_by_phases(
            buffer.genuine, estimate, buffer.samples[:, 0], buffer.parameters
        ):
            readout["told_by_phases"] = np.array(True)
        if "estimate" in readout:
            readout["estimate"] = self._source.to_units(readout["estimate"][None])[0]
            # units grow with the numbers in which is searched, so that ends stay ends
            readout["interval"] = self._source.to_units(readout["interval"])
            readout["draws"] = self._source.to_units(readout["draws"])
            ends = readout["mode_interval"]
            rows = self._source.to_units(ends.reshape(-1, ends.shape[2]))
            readout["mode_interval"] = rows.reshape(ends.shape)
            readout |= panel_examination(self._configuration, self._source, readout["draws"])
        return readout

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume but the buffer, whose rows are stored as they come."""
        state = self.trials.state()
        return {name: array for name, array in state.items() if not name.startswith("buffer/")}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state, with the rows of the buffer as "buffer/...".

        Without these the buffer stays as it is.
        """
        if not any(name.startswith("buffer/") for name in state):
            rows = self.trials.buffer.state()
            state = {**state, **join_states({"buffer": rows})}
        self.trials.restore(state)
        self._stored = self.trials.buffer.counts


def panel_examination(
    configuration: Configuration, source: Source, draws: np.ndarray
) -> dict[str, np.ndarray]:
    """Let a panel of examiners tell models that a run calls plausible from the system.

    It judges what the run has not learned from: held-out windows, or agents in other trials. A
    wide posterior is told because it is wide. So each of a few of its models is examined in the
    same way, as if it were the system; what is told no better passes.

    Returns "told_by_panel" (), whether the models are told. Nothing where samples cost or come from
    a live source, where too few are held out or too many simulations fail, and where the run
    examines its estimate itself.
    """
    live = source.genuine is not None and source.genuine.live is not None
    if not source.cheap or live or source.independent is not None:
        return {}
    seed = configuration.run.seed
    generation = source.generation
    is_told = False
    with ExitStack() as opened:
        # All trials are spent: what fails now is not a failure of the run.
        if isinstance(source, FallibleSource):
            opened.enter_context(source.probing())
        try:
            evidence = evidence_of(configuration, source, PANEL_EFFORT, seed)
            test = two_sample_test(evidence, draws, PANEL_EFFORT, seed=seed)
            if test.p_value <= SURE:
                usual = []
                for accuracy in reference_accuracies(
                    evidence, draws, PANEL_EFFORT, PANEL_EFFORT.references, seed=seed
                ):
                    # It passes, whatever the others are: their limit is above each of them
                    if accuracy >= test.accuracy:
                        return {"told_by_panel": np.array(False)}
                    usual.append(accuracy)
                examination = replace(test, plausible=tuple(usual))
                is_told = Judgment(examination=examination).fits is False
        except (RefusedError, SystemFailedError):
            return {}
        finally:
            source.generation = generation
    return {"told_by_panel": np.array(is_told)}


def search_space(configuration: Configuration, source: Source) -> SearchSpace:
    """Return the space that a run of trials searches.

    The range of the first models, or of the source's numbers if these have ends, with what the
    representation allows beyond it.
    """
    models = configuration.models
    jumps = configuration.representation.jumps
    dimension = len(configuration.parameter_names)
    low, high = (models.initial_low, models.initial_high) if source.ends is None else source.ends
    middle = (low + high) / 2
    half = (high - low) / 2 * np.resize(np.asarray(jumps.reach, float), dimension)
    saturated = np.zeros(dimension, dtype=bool)
    for index, reach in configuration.representation.saturation:
        half[index] = reach
        saturated[index] = True
    if source.ends is not None:
        saturated[:] = True
    limits = saturated
    symmetries: list[Symmetry] = []
    candidates: list[list[Symmetry]] = []
    ridges: list[Coordinates] = []
    if source.genuine is not None:
        parameters = configuration.system.parameters
        bounded = []
        for parameter in parameters.values():
            # Where the first models come from a narrower range, that is a guess, and no limit
            bounded.append(parameter.initial == (parameter.low, parameter.high))
        limits = np.array(bounded)
        symmetries = walked_symmetries(parameters)
        candidates = candidate_symmetries(parameters)
        ridges = ridge_coordinates(parameters)
    return SearchSpace(
        np.full(dimension, middle),
        half,
        limits=limits,
        saturated=saturated,
        end=np.inf if source.ends is None else 1.0,
        groups=jumps.groups,
        dependent=jumps.dependent,
        symmetries=symmetries,
        candidates=candidates,
        ridges=ridges,
    )


def examiner_of(source: Source, space: SearchSpace, observers: Observers) -> Examiner | None:
    """Return who compares new samples of the estimate with the genuine ones, where these are independent."""
    genuine = source.independent
    if genuine is None:
        return None
    return Examiner(source, space, genuine, source.system.signals, observers)


Loop = Generations | TrialsLoop


def loop_of(configuration: Configuration, source: Source) -> Loop:
    """Return the loop of a run, with its samples."""
    if configuration.run.trials:
        return TrialsLoop(configuration, source)
    return Generations(configuration, source)
