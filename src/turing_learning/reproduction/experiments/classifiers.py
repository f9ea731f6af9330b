"""Section 4.4, how accurate classifiers are; and footnote 1 of section 3.1, classifiers that choose stimuli."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from turing_learning.config import Configuration, classifier_of, load_configuration
from turing_learning.figures._classifiers import accuracy_figure
from turing_learning.figures._many_runs import error_groups_figure
from turing_learning.interaction import STIMULATED
from turing_learning.swarm import AGGREGATION

from .._experiment import (
    PRESETS,
    Captions,
    Experiment,
    Findings,
    Runs,
    Work,
    compare_columns,
    small,
    spreads_frame,
    stacked,
    variant_of,
)
from .._experiment import RunSizes as Sizes
from .._verdicts import PRINTED, REASONS, ClaimVerdict, spreads_of

if TYPE_CHECKING:
    from turing_learning.runs import Progress

ACCURATE = "4.4-classifier-accuracy"
RISEN = 5  # the generation up to which the paper sees the subjectively best rise
SETTLED = 50  # the generation from which it is held against the printed range
RANGE = (0.62, 0.80)
LEVEL = 0.95
STEP_BACK = 0.02  # of a curve that still rises "almost monotonically"


@dataclass(frozen=True)
class RunSizes(Sizes):
    """How many runs of how many generations, and what else is set."""

    settings: Mapping[str, Any] = field(default_factory=dict)

    def configuration(self, scenario: str, preset: str, seed: int) -> Configuration:
        """Return the configuration of a run."""
        own = {"run.generations": self.generations, "run.seed": seed, "run.history": "thin"}
        return load_configuration(None, preset, dict(self.settings) | own, scenario=scenario)


@dataclass(frozen=True)
class AccuracySizes:
    """Which runs and generations, and the grid of models; its trials are done in so many parts."""

    runs: RunSizes = field(default_factory=RunSizes)
    generations: tuple[int, ...] = (0, 1, 2, 3, 5, 10, 20, 50, 99, 199, 299, 499, 699, 899, 999)
    points: int = 11
    trials: int = 10
    parts: int = 22
    seed: int = 1


@dataclass(frozen=True, eq=False)
class BestAccuracies:
    """Accuracy of the best classifiers over generations, of the runs of one preset."""

    variant: str  # of the verdicts: "" for the one that counts
    generations: np.ndarray  # (G,)
    subjective: np.ndarray  # (R, G), of the classifier with the highest subjective fitness
    objective: np.ndarray  # (R, G), the highest of the population
    jury: np.ndarray  # (R, G), the highest of all that judge models: the population, and its archive if it has one

    @classmethod
    def of(
        cls, variant: str, generations: tuple[int, ...], accuracy: np.ndarray, fitness: np.ndarray, jury: Any = 0.0
    ) -> "BestAccuracies":
        """Return the best of classifiers with accuracies and fitness (R, G, N); `jury` are those of the best archived ones."""
        fittest, objective = fitness.argmax(axis=2, keepdims=True), accuracy.max(axis=2)  # the first of equals
        subjective = np.take_along_axis(accuracy, fittest, axis=2)[..., 0]
        return cls(variant, np.array(generations), subjective, objective, np.maximum(objective, jury))

    def means_frame(self, *names: str) -> pd.DataFrame:
        """Return mean and standard deviation over the runs of these curves, generation by generation."""
        frame = pd.DataFrame({"generation": self.generations})
        for name in names:
            frame = frame.join(spreads_frame(spreads_of(getattr(self, name)), name, f"{name}_deviation"))
        return frame


@dataclass(frozen=True, eq=False)
class Populations:
    """Classifiers of some generations of R runs."""

    classifiers: np.ndarray  # (R, G, N, Q), in the single precision in which they judge
    fitness: np.ndarray  # (R, G, N), subjective
    archived: list[np.ndarray]  # R of (U, Q): all that have judged beside them from the archive, each once
    judging: list[np.ndarray]  # R of (G, U): in which of the generations each of those did


def conduct_accuracy(work: Work) -> Findings:
    """Conduct the runs, let all of their classifiers judge the same trials, and compare the best of each generation."""
    sizes: AccuracySizes = work.sizes
    populations = {preset: run_populations(work, sizes.runs, preset, sizes.generations) for preset in PRESETS}
    captions, verdicts, means, every, pictures = Captions("4.4"), [], {}, {}, []
    for preset, (accuracy, archived) in _accuracies(work, populations).items():
        one = populations[preset]
        pairs = zip(one.judging, archived, strict=True)
        referees = [np.where(judging, each, 0.0).max(axis=1, initial=0.0) for judging, each in pairs]
        best = BestAccuracies.of(variant_of(preset), sizes.generations, accuracy, one.fitness, referees)
        verdicts += accuracy_verdicts(best)
        means[preset] = best.means_frame("subjective", "objective", "jury").assign(all=accuracy.mean(axis=(0, 2)))
        for k, seed in enumerate(sizes.runs.seeds):
            curves = {name: getattr(best, name)[k] for name in ("subjective", "objective", "jury")}
            every[preset, seed] = pd.DataFrame({"generation": best.generations, **curves})
        jury = best.jury if any(map(len, archived)) else None
        figure = accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective, jury=jury)
        words = {"preset": preset, "runs": len(best.objective)}
        pictures.append(captions.picture("accuracy-{preset}", ACCURATE, figure, **words))
    summary, runs = stacked(means, "preset"), stacked(every, "preset", "seed")
    return Findings(verdicts, [captions.table("accuracy", summary), captions.table("accuracy-runs", runs)], pictures)


def run_populations(work: Work, sizes: RunSizes, preset: str, generations: tuple[int, ...]) -> Populations:
    """Conduct runs, a piece of work for each, and return the classifiers of some generations."""
    pieces = []
    for seed in sizes.seeds:
        compute = partial(_conducted, work, sizes.configuration(AGGREGATION.name, preset, seed), generations)
        pieces.append(work.arrays(f"run-{preset}-seed{seed}", compute))
    classifiers, fitness, archived, judging = (
        [piece[name] for piece in pieces] for name in ("classifiers", "fitness", "archived", "judging")
    )
    return Populations(np.stack(classifiers), np.stack(fitness), archived, judging)


def _conducted(work: Work, configuration: Configuration, chosen: tuple[int, ...]) -> dict[str, np.ndarray] | None:
    from turing_learning.runs import infer

    kept: dict[str, list[np.ndarray]] = {"classifiers": [], "fitness": []}
    referees: list[np.ndarray] = []

    def keep(progress: "Progress") -> None:
        generation = progress.generation
        if generation.number in chosen:
            kept["classifiers"].append(generation.classifiers.astype(np.float32))
            kept["fitness"].append(generation.classifier_fitness)
            referees.append(generation.referees.astype(np.float32))

    if not infer(config=configuration, observer=keep, should_stop=work.should_stop).complete:
        return None
    archived, places = np.unique(np.concatenate(referees), axis=0, return_inverse=True)
    owners = np.repeat(np.arange(len(referees)), [len(one) for one in referees])
    judging = np.zeros((len(referees), len(archived)), dtype=bool)
    judging[owners, places.reshape(-1)] = True
    return {name: np.stack(arrays) for name, arrays in kept.items()} | {"archived": archived, "judging": judging}


def _accuracies(work: Work, populations: Mapping[str, Populations]) -> dict[str, tuple[np.ndarray, list[np.ndarray]]]:
    """Return preset -> accuracies of the populations (R, G, N) and of what was archived, R of (U,).

    Each trial is simulated once, for the classifiers of all runs and presets.
    """
    from turing_learning.detection import PostEvaluation, count_agents, grid_models

    sizes: AccuracySizes = work.sizes
    models = grid_models(AGGREGATION, sizes.points)
    groups: list[np.ndarray] = []
    for one in populations.values():
        groups += [one.classifiers.reshape(-1, one.classifiers.shape[-1]), *one.archived]
    genomes = np.concatenate(groups)
    classifier = classifier_of(sizes.runs.configuration(AGGREGATION.name, PRESETS[0], sizes.runs.first_seed))
    bounds = [len(models) * k // sizes.parts for k in range(sizes.parts + 1)]

    def counted(part: int) -> dict[str, np.ndarray] | None:
        chosen = slice(bounds[part], bounds[part + 1])
        how: dict[str, Any] = {"trials": sizes.trials, "seed": sizes.seed, "should_stop": work.should_stop}
        counts = count_agents(classifier, genomes, AGGREGATION, models, part=chosen, **how)
        return None if counts is None else {"agents": counts.astype(np.uint32)}

    parts = [work.arrays(f"grid-part{k + 1:02d}", partial(counted, k))["agents"] for k in range(sizes.parts)]
    accuracy = PostEvaluation.of_counts(np.asarray(sum(parts)), AGGREGATION, len(models)).accuracy
    split = iter(np.split(accuracy, np.cumsum([len(group) for group in groups])[:-1]))
    return {
        preset: (next(split).reshape(one.fitness.shape), [next(split) for _ in one.archived])
        for preset, one in populations.items()
    }


def accuracy_verdicts(best: BestAccuracies) -> list[ClaimVerdict]:
    """Hold both curves against the claim, together and one by one, and that of the population without its archive."""
    means, (low, high) = best.subjective.mean(axis=0), RANGE
    early, late = best.generations <= RISEN, best.generations >= SETTLED
    peak, latest = int(means[early].argmax()), means[late]
    text = f"subjective best: {means[0]:.2f} at first, highest of the first {RISEN} generations {means[peak]:.2f} in "
    text += f"generation {best.generations[peak]}"
    if latest.size:
        text += f", {latest.min():.2f} to {latest.max():.2f} from generation {SETTLED} on"
    within = all(
        low <= one.mean + 2 * one.standard_error and one.mean - 2 * one.standard_error <= high
        for one in spreads_of(best.subjective[:, late])
    )
    subjective = bool(means[peak] > means[0] and (latest < means[peak]).all() and within)
    exceeds = bool(latest.size and latest.max() > high and latest.min() >= low)
    higher = REASONS["4.4-jumps"] if exceeds and not (subjective or best.variant) else ""
    rule = "accuracy of the objective best"
    objective, jury_text, forgets = _of_the_objective_best(best.jury)
    alone, alone_text, alone_forgets = _of_the_objective_best(best.objective)
    both, reasons = f"{text}; {jury_text}", "; ".join(filter(None, (higher, forgets)))
    return [
        ClaimVerdict(
            ACCURATE, agrees, PRINTED[ACCURATE], observed, rule, ", ".join(filter(None, (best.variant, part))), reason
        )
        for part, agrees, observed, rule, reason in (
            ("", subjective and objective, both, "accuracy of classifiers", reasons),
            ("subjective best", subjective, text, "accuracy of the subjective best", higher),
            ("objective best", objective, jury_text, rule, forgets),
            ("objective best without the archive", alone, alone_text, rule, alone_forgets),
        )
    ]


def _of_the_objective_best(highest_of_runs: np.ndarray) -> tuple[bool, str, str]:
    """Return whether accuracies (R, G) agree, what they do, and why not, if they had come to the level and did not stay there."""
    means = highest_of_runs.mean(axis=0)
    back = float((np.maximum.accumulate(means) - means).max())
    agrees = bool(
        means[-1] > LEVEL and means[-1] > means[0] and (means >= np.maximum.accumulate(means) - STEP_BACK).all()
    )
    text = f"objective best: {means[0]:.3f} at first, {means[-1]:.3f} in the end, largest step back {back:.3f}"
    return agrees, text, REASONS["4.4-forgets"] if means.max() > LEVEL and not agrees else ""


ACCURACY = Experiment.of(
    "4.4", conduct_accuracy, full=AccuracySizes(),
    fast=AccuracySizes(
        runs=RunSizes(runs=3, generations=12, settings={"models.population": 10, "classifiers.population": 10}),
        generations=(0, 1, 5, 11), points=2, trials=4, parts=3,
    ),
)  # fmt: skip


FORMS: dict[str, dict[str, Any]] = {
    "interactive": {"scenario.opponents": 10},
    "random": {"scenario.opponents": 12, "scenario.stimulus.passive": "random"},
    "constant": {"scenario.opponents": 12, "scenario.stimulus.passive": "constant"},
}
"""Form -> settings; 12 trials of each model where classifiers watch are as many as interrogators and their archive cause."""
KIND = "estimate"


@dataclass(frozen=True)
class InteractionSizes:
    """How many runs of each form, in which systems and for how many generations, by how many models and classifiers."""

    runs: int = 30
    first_seed: int = 2001
    systems: Mapping[str, int] = field(default_factory=lambda: {"light-response": 250, "sensor-configuration": 50})
    settings: Mapping[str, Any] = field(default_factory=lambda: small(50, 50))


def conduct_interaction(work: Work) -> Findings:
    """Conduct the studies, and test whether those that interact have other errors than those that watch."""
    captions, tables, pictures, remarks, tests = Captions("interaction"), [], [], [], {}
    sizes: InteractionSizes = work.sizes
    for name, generations in sizes.systems.items():
        system, found = STIMULATED[name], {}
        for form, settings in FORMS.items():
            how = {"generations": generations, "settings": {**sizes.settings, **settings}, "runs": sizes.runs}
            result = work.study(f"{name}-{form}", name, first_seed=sizes.first_seed, **how)
            found[form] = Runs.of(result, "default", system.parameter_names)
        tests[name], remark = _compared(name, found)
        remarks.append(remark)
        models = stacked({form: runs.models_frame() for form, runs in found.items()}, "form")
        words: dict[str, Any] = {"system": system, "runs": sizes.runs}
        tables.append(captions.table("{system.name}-models", models, **words))
        spans = np.array([each.high - each.low for each in system.parameters.values()])  # type: ignore[operator]
        shares = {form: runs.errors[KIND] / spans for form, runs in found.items()}
        figure = error_groups_figure(shares, names=system.parameter_names)
        pictures.append(captions.picture("{system.name}-errors", "", figure, **words))
    summary = captions.table("errors", stacked(tests, "system"), True)
    return Findings([], [summary, *tables], pictures, remarks)


def _compared(name: str, found: Mapping[str, Runs]) -> tuple[pd.DataFrame, str]:
    """Return median errors of all forms with the tests, parameter by parameter, and a sentence about them."""
    interactive, names = found["interactive"].errors[KIND], STIMULATED[name].parameter_names
    frame, better = pd.DataFrame({"parameter": names}), []
    for form, runs in found.items():
        frame[f"{form}_median"] = np.median(runs.errors[KIND], axis=0)
        if form != "interactive":
            frame[f"{form}_p_value"] = compare_columns(interactive, runs.errors[KIND]).p_values
    for row in frame.to_dict("records"):
        passive = [form for form in found if form != "interactive"]
        if all(row["interactive_median"] < row[f"{f}_median"] and row[f"{f}_p_value"] < 0.01 for f in passive):
            better.append(row["parameter"])
    said = ", ".join(better) if better else "no parameter"
    return frame, (
        f"{STIMULATED[name].title}: interaction has smaller errors than both passive forms (Mann-Whitney, p < 0.01 each) in {said}."
    )


_FAST = InteractionSizes(runs=2, systems={"light-response": 4, "sensor-configuration": 4}, settings=small(8, 4))
INTERACTION = Experiment.of("interaction", conduct_interaction, full=InteractionSizes(), fast=_FAST)
