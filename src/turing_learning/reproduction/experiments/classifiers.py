"""Section 4.4, how accurate classifiers are; and footnote 1 of section 3.1, classifiers that choose stimuli."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from turing_learning.config import Configuration, classifier_of, load_configuration
from turing_learning.figures.many_runs import error_groups_figure
from turing_learning.figures.one_run import accuracy_figure
from turing_learning.interaction import STIMULATED
from turing_learning.swarm import AGGREGATION

from .._experiment import Findings, Sizes, Work, compare_columns, seeds_of, stacked
from .._post_evaluation import count_agents, decision_accuracies, grid_models
from .._verdicts import REASONS, ClaimVerdict, Spreads, verdict_on

if TYPE_CHECKING:
    from turing_learning.runs import Progress

ACCURATE = "4.4-classifier-accuracy"
RISEN = 5
"""The generation up to which the paper sees the subjectively best rise."""
PRINTED_RANGE_FROM = 50
"""The generation from which it is held against the printed range."""
RANGE = (0.62, 0.80)
"""Accuracies between which the paper sees the subjectively best."""
PRINTED_ACCURACY = 0.95
"""Accuracy that the objectively best exceeds in the paper."""
STEP_BACK = 0.02
"""Largest step back of a curve that still rises "almost monotonically"."""


@dataclass(frozen=True, eq=False)
class BestAccuracies:
    """Accuracy of the best classifiers over generations, of the runs of one preset."""

    variant: str  # of the verdicts: "" for the one that counts
    generations: np.ndarray  # (G,)
    # (R, G), of the classifier with the highest subjective fitness
    subjective: np.ndarray
    objective: np.ndarray  # (R, G), the highest of the population
    # (R, G), the highest of all that judge models: population, and archive if any
    jury: np.ndarray

    @classmethod
    def of(
        cls,
        variant: str,
        generations: list[int],
        accuracy: np.ndarray,
        fitness: np.ndarray,
        jury: Any = 0.0,
    ) -> "BestAccuracies":
        """Return the best of classifiers (R, G, N); `jury` are accuracies of the best archived ones."""
        # The first of equals.
        fittest = fitness.argmax(axis=2, keepdims=True)
        subjective = np.take_along_axis(accuracy, fittest, axis=2)[..., 0]
        objective = accuracy.max(axis=2)
        return cls(
            variant, np.array(generations), subjective, objective, np.maximum(objective, jury)
        )

    def means_frame(self, *names: str) -> pd.DataFrame:
        """Return mean and standard deviation over the runs of these curves, generation by generation."""
        frame = pd.DataFrame({"generation": self.generations})
        return frame.join(
            [Spreads.of(getattr(self, name)).frame(name, f"{name}_deviation") for name in names]
        )


def conduct_accuracy(work: Work, findings: Findings) -> None:
    """Conduct the runs; let all classifiers judge the same trials; compare the best of each generation."""
    sizes = work.sizes
    means = {}
    frames = {}
    populations = {}
    for preset in work.presets:
        populations[preset] = run_populations(work, sizes["runs"], preset, sizes["generations"])
    for preset, (accuracy, archived) in _accuracies(work, populations).items():
        # The best of the archived classifiers that judged in each generation; 0 without any.
        referees = []
        for run, accuracies in zip(populations[preset], archived, strict=True):
            referees.append(np.where(run["judging"], accuracies, 0.0).max(axis=1, initial=0.0))
        fitness = np.stack([run["fitness"] for run in populations[preset]])
        best = BestAccuracies.of(
            work.variant_of(preset), sizes["generations"], accuracy, fitness, referees
        )
        findings.verdicts += accuracy_verdicts(best)
        mean_of_all = accuracy.mean(axis=(0, 2))
        means[preset] = best.means_frame("subjective", "objective", "jury").assign(all=mean_of_all)
        for k, seed in enumerate(seeds_of(sizes["runs"])):
            curves = {name: getattr(best, name)[k] for name in ("subjective", "objective", "jury")}
            frames[preset, seed] = pd.DataFrame({"generation": best.generations, **curves})
        figure = accuracy_figure(
            best.generations,
            subjective=best.subjective,
            objective=best.objective,
            jury=best.jury if any(map(len, archived)) else None,
        )
        words = {"preset": preset, "runs": len(best.objective)}
        findings.picture("accuracy-{preset}", ACCURATE, figure, **words)
    findings.table("accuracy", stacked(means, "preset"))
    findings.table("accuracy-runs", stacked(frames, "preset", "seed"))


def configuration_of(work: Work, sizes: Sizes, preset: str, seed: int) -> Configuration:
    """Return the configuration of a run."""
    settings = {"run.generations": sizes["generations"], "run.seed": seed, "run.history": "thin"}
    settings = sizes["settings"] | work.settings | settings
    return load_configuration(None, preset, settings, scenario=AGGREGATION.name)


def run_populations(
    work: Work, sizes: Sizes, preset: str, generations: list[int]
) -> list[dict[str, np.ndarray]]:
    """Conduct runs, a piece of work for each, and return the classifiers of some generations G.

    Of each run there are "classifiers" (G, N, Q), in the single precision in which they judge;
    their subjective "fitness" (G, N); "archived" (U, Q), all that have judged beside them from the
    archive, each once; and "judging" (G, U), in which generations.
    """
    populations = []
    for seed in seeds_of(sizes):
        compute = partial(
            _conducted, work, configuration_of(work, sizes, preset, seed), generations
        )
        populations.append(work.piece(f"run-{preset}-seed{seed}", compute, "npz"))
    return populations


def _conducted(
    work: Work, configuration: Configuration, generations: list[int]
) -> dict[str, np.ndarray] | None:
    from turing_learning.runs import infer

    classifiers: list[np.ndarray] = []
    fitness: list[np.ndarray] = []
    referees: list[np.ndarray] = []

    def keep(progress: "Progress") -> None:
        generation = progress.generation
        assert generation is not None  # the run has generations
        if generation.number in generations:
            classifiers.append(generation.classifiers.astype(np.float32))
            fitness.append(generation.classifier_fitness)
            referees.append(generation.referees.astype(np.float32))

    if not infer(config=configuration, observer=keep, should_stop=work.should_stop).complete:
        return None
    # A classifier stays in the archive for many generations: it is judged once.
    archived, indices = np.unique(np.concatenate(referees), axis=0, return_inverse=True)
    generation_of = np.repeat(np.arange(len(referees)), list(map(len, referees)))
    judging = np.zeros((len(referees), len(archived)), dtype=bool)
    judging[generation_of, indices.reshape(-1)] = True
    return {
        "classifiers": np.stack(classifiers),
        "fitness": np.stack(fitness),
        "archived": archived,
        "judging": judging,
    }


def _accuracies(
    work: Work, populations: Mapping[str, Sequence[Mapping[str, np.ndarray]]]
) -> dict[str, tuple[np.ndarray, list[np.ndarray]]]:
    """Return preset -> accuracies of populations (R, G, N) and archives, R of (U,), all in the same trials."""
    sizes = work.sizes
    models = grid_models(len(AGGREGATION.controller), sizes["points"])
    groups: list[np.ndarray] = []
    for runs in populations.values():
        for run in runs:
            groups += list(run["classifiers"])
        groups += [run["archived"] for run in runs]
    # All classifiers judge the same trials: differences are theirs, not those of the trials.
    genomes = np.concatenate(groups)
    first_seed = sizes["runs"]["first_seed"]
    configuration = configuration_of(work, sizes["runs"], work.presets[0], first_seed)
    classifier = classifier_of(configuration)
    swarm = work.in_world(AGGREGATION)
    bounds = [len(models) * k // sizes["parts"] for k in range(sizes["parts"] + 1)]

    def counted(chunk: int) -> dict[str, np.ndarray] | None:
        counts = count_agents(
            classifier,
            genomes,
            swarm,
            models,
            chunk=slice(bounds[chunk], bounds[chunk + 1]),
            trials=sizes["trials"],
            seed=sizes["seed"],
            should_stop=work.should_stop,
        )
        if counts is None:
            return None
        return {"agents": counts.astype(np.uint32)}

    counts = []
    for chunk in range(sizes["parts"]):
        counts.append(
            work.piece(f"grid-part{chunk + 1:02d}", partial(counted, chunk), "npz")["agents"]
        )
    accuracy = decision_accuracies(np.asarray(sum(counts)), swarm, len(models))
    accuracies = iter(np.split(accuracy, np.cumsum(list(map(len, groups)))[:-1]))
    # In the order in which the groups were joined above.
    by_preset = {}
    for preset, runs in populations.items():
        of_populations = np.array([[next(accuracies) for _ in run["fitness"]] for run in runs])
        by_preset[preset] = (of_populations, [next(accuracies) for _ in runs])
    return by_preset


def accuracy_verdicts(best: BestAccuracies) -> list[ClaimVerdict]:
    """Hold both curves against the claim, together and alone, and the population without its archive."""
    subjective, text, exceeds = _of_the_subjective_best(best)
    higher = ""
    if exceeds and not (subjective or best.variant):
        higher = REASONS["4.4-jumps"]
    objective, jury_text, forgets = _of_the_objective_best(best.jury)
    alone, alone_text, alone_forgets = _of_the_objective_best(best.objective)
    rule = "accuracy of the objective best"
    joint_text = f"{text}; {jury_text}"
    reasons = _joined("; ", higher, forgets)

    def verdict(subset: str, agrees: bool, observed: str, rule: str, reason: str) -> ClaimVerdict:
        return verdict_on(
            ACCURATE, agrees, observed, rule, _joined(", ", best.variant, subset), reason=reason
        )

    return [
        verdict("", subjective and objective, joint_text, "accuracy of classifiers", reasons),
        verdict("subjective best", subjective, text, "accuracy of the subjective best", higher),
        verdict("objective best", objective, jury_text, rule, forgets),
        verdict("objective best without the archive", alone, alone_text, rule, alone_forgets),
    ]


def _joined(separator: str, *texts: str) -> str:
    return separator.join(filter(None, texts))


def _of_the_subjective_best(best: BestAccuracies) -> tuple[bool, str, bool]:
    """Return whether the curve agrees, what it does, and whether it exceeds the printed range."""
    low, high = RANGE
    means = best.subjective.mean(axis=0)
    early = best.generations <= RISEN
    late = best.generations >= PRINTED_RANGE_FROM
    peak = int(means[early].argmax())
    late_means = means[late]
    text = f"subjective best: {means[0]:.2f} at first, highest of the first {RISEN} generations {means[peak]:.2f} in "
    text += f"generation {best.generations[peak]}"
    if late_means.size:
        text += f", {late_means.min():.2f} to {late_means.max():.2f} from generation {PRINTED_RANGE_FROM} on"
    spreads = Spreads.of(best.subjective[:, late])
    error = 2 * spreads.standard_error
    within = ((low <= spreads.mean + error) & (spreads.mean - error <= high)).all()
    agrees = bool(means[peak] > means[0] and (late_means < means[peak]).all() and within)
    exceeds = bool(late_means.size and late_means.max() > high and late_means.min() >= low)
    return agrees, text, exceeds


def _of_the_objective_best(accuracies: np.ndarray) -> tuple[bool, str, str]:
    """Return whether accuracies (R, G) agree, what they do, and why they left the level that they reached."""
    means = accuracies.mean(axis=0)
    highest = np.maximum.accumulate(means)
    back = (highest - means).max()
    agrees = bool(
        means[-1] > PRINTED_ACCURACY
        and means[-1] > means[0]
        and (means >= highest - STEP_BACK).all()
    )
    text = f"objective best: {means[0]:.3f} at first, {means[-1]:.3f} in the end, largest step back {back:.3f}"
    forgets = means.max() > PRINTED_ACCURACY and not agrees
    return agrees, text, REASONS["4.4-forgets"] if forgets else ""


FORMS: dict[str, dict[str, Any]] = {
    "interactive": {"scenario.opponents": 10},
    "random": {"scenario.opponents": 12, "scenario.stimulus.passive": "random"},
    "constant": {"scenario.opponents": 12, "scenario.stimulus.passive": "constant"},
}
"""Form -> settings; 12 trials of each model where classifiers watch are as many as interrogators and their archive cause."""
COMPARED_MODEL = "estimate"


def conduct_interaction(work: Work, findings: Findings) -> None:
    """Conduct the studies, and test whether those that interact have other errors than those that watch."""
    tests = {}
    for name, generations in work.sizes["systems"].items():
        system = STIMULATED[name]
        names = system.parameter_names
        runs = {}
        for form, settings in FORMS.items():
            how: dict[str, Any] = {"generations": generations, "settings": settings}
            runs[form] = work.runs(f"{name}-{form}", name, work.presets[0], names, **how)
        errors = {form: form_runs.errors[COMPARED_MODEL] for form, form_runs in runs.items()}
        tests[name] = _tests_of_interaction(names, errors)
        better = _clearly_smaller(tests[name])
        findings.remarks.append(
            f"{system.title}: interaction has smaller errors than both passive forms "
            f"(Mann-Whitney, p < 0.01 each) in {', '.join(tests[name]['parameter'][better]) or 'no parameter'}."
        )
        models = stacked(
            {form: form_runs.models_frame() for form, form_runs in runs.items()}, "form"
        )
        findings.table("{system.name}-models", models, system=system)
        parameters = system.parameters.values()
        spans = np.array([parameter.high - parameter.low for parameter in parameters])  # type: ignore[operator]
        relative = {form: values / spans for form, values in errors.items()}
        figure = error_groups_figure(relative, names=names)
        findings.picture("{system.name}-errors", "", figure, system=system, runs=work.sizes["runs"])
    findings.table("errors", stacked(tests, "system"), True)


def _tests_of_interaction(names: Sequence[str], errors: Mapping[str, np.ndarray]) -> pd.DataFrame:
    """Return median errors of each form, and tests of the interactive form against the passive ones."""
    frame = pd.DataFrame({"parameter": names})
    for form, values in errors.items():
        frame[f"{form}_median"] = np.median(values, axis=0)
        if form != "interactive":
            frame[f"{form}_p_value"] = compare_columns(errors["interactive"], values).p_values
    return frame


def _clearly_smaller(tests: pd.DataFrame) -> pd.Series:
    """Return which parameters have smaller errors with interaction than in both passive forms."""
    better = pd.Series(True, index=tests.index)
    for form in FORMS:
        if form != "interactive":
            better &= tests["interactive_median"] < tests[f"{form}_median"]
            better &= tests[f"{form}_p_value"] < 0.01
    return better
