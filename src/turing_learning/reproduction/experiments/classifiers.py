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

from .._experiment import PRESETS, Findings, Sizes, Work, compare_columns, seeds_of, stacked, variant_of
from .._post_evaluation import count_agents, decision_accuracies, grid_models
from .._verdicts import REASONS, ClaimVerdict, Spreads, held

if TYPE_CHECKING:
    from turing_learning.runs import Progress

ACCURATE = "4.4-classifier-accuracy"
RISEN = 5  # the generation up to which the paper sees the subjectively best rise
SETTLED = 50  # the generation from which it is held against the printed range
RANGE = (0.62, 0.80)
LEVEL = 0.95
STEP_BACK = 0.02  # of a curve that still rises "almost monotonically"


@dataclass(frozen=True, eq=False)
class BestAccuracies:
    """Accuracy of the best classifiers over generations, of the runs of one preset."""

    variant: str  # of the verdicts: "" for the one that counts
    generations: np.ndarray  # (G,)
    subjective: np.ndarray  # (R, G), of the classifier with the highest subjective fitness
    objective: np.ndarray  # (R, G), the highest of the population
    jury: np.ndarray  # (R, G), the highest of all that judge models: population, and archive if any

    @classmethod
    def of(
        cls, variant: str, generations: list[int], accuracy: np.ndarray, fitness: np.ndarray, jury: Any = 0.0
    ) -> "BestAccuracies":
        """Return the best of classifiers (R, G, N); `jury` are accuracies of the best archived ones."""
        fittest, objective = fitness.argmax(axis=2, keepdims=True), accuracy.max(axis=2)  # the first of equals
        subjective = np.take_along_axis(accuracy, fittest, axis=2)[..., 0]
        return cls(variant, np.array(generations), subjective, objective, np.maximum(objective, jury))

    def means_frame(self, *names: str) -> pd.DataFrame:
        """Return mean and standard deviation over the runs of these curves, generation by generation."""
        frame = pd.DataFrame({"generation": self.generations})
        return frame.join([Spreads.of(getattr(self, name)).frame(name, f"{name}_deviation") for name in names])


def conduct_accuracy(work: Work, findings: Findings) -> None:
    """Conduct the runs; let all classifiers judge the same trials; compare the best of each generation."""
    sizes, means, every = work.sizes, {}, {}
    populations = {preset: run_populations(work, sizes["runs"], preset, sizes["generations"]) for preset in PRESETS}
    for preset, (accuracy, archived) in _accuracies(work, populations).items():
        pairs = [(run["judging"], each) for run, each in zip(populations[preset], archived, strict=True)]
        referees = [np.where(judging, each, 0.0).max(axis=1, initial=0.0) for judging, each in pairs]
        fitness = np.stack([run["fitness"] for run in populations[preset]])
        best = BestAccuracies.of(variant_of(preset), sizes["generations"], accuracy, fitness, referees)
        findings.verdicts += accuracy_verdicts(best)
        means[preset] = best.means_frame("subjective", "objective", "jury").assign(all=accuracy.mean(axis=(0, 2)))
        for k, seed in enumerate(seeds_of(sizes["runs"])):
            curves = {name: getattr(best, name)[k] for name in ("subjective", "objective", "jury")}
            every[preset, seed] = pd.DataFrame({"generation": best.generations, **curves})
        jury = best.jury if any(map(len, archived)) else None
        figure = accuracy_figure(best.generations, subjective=best.subjective, objective=best.objective, jury=jury)
        findings.picture("accuracy-{preset}", ACCURATE, figure, preset=preset, runs=len(best.objective))
    findings.table("accuracy", stacked(means, "preset"))
    findings.table("accuracy-runs", stacked(every, "preset", "seed"))


def configuration_of(sizes: Sizes, preset: str, seed: int) -> Configuration:
    """Return the configuration of a run."""
    own = {"run.generations": sizes["generations"], "run.seed": seed, "run.history": "thin"}
    return load_configuration(None, preset, sizes["settings"] | own, scenario=AGGREGATION.name)


def run_populations(work: Work, sizes: Sizes, preset: str, generations: list[int]) -> list[dict[str, np.ndarray]]:
    """Conduct runs, a piece of work for each, and return the classifiers of some generations G.

    Of each run there are "classifiers" (G, N, Q), in the single precision in which they judge; their subjective
    "fitness" (G, N); "archived" (U, Q), all that have judged beside them from the archive, each once; and
    "judging" (G, U), in which generations.
    """
    found = []
    for seed in seeds_of(sizes):
        compute = partial(_conducted, work, configuration_of(sizes, preset, seed), generations)
        found.append(work.piece(f"run-{preset}-seed{seed}", compute, "npz"))
    return found


def _conducted(work: Work, configuration: Configuration, chosen: list[int]) -> dict[str, np.ndarray] | None:
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


def _accuracies(
    work: Work, populations: Mapping[str, Sequence[Mapping[str, np.ndarray]]]
) -> dict[str, tuple[np.ndarray, list[np.ndarray]]]:
    """Return preset -> accuracies of populations (R, G, N) and archives, R of (U,), all in the same trials."""
    sizes = work.sizes
    models = grid_models(len(AGGREGATION.controller), sizes["points"])
    groups: list[np.ndarray] = []
    for runs in populations.values():
        groups += [one for run in runs for one in run["classifiers"]] + [run["archived"] for run in runs]
    genomes = np.concatenate(groups)
    classifier = classifier_of(configuration_of(sizes["runs"], PRESETS[0], sizes["runs"]["first_seed"]))
    bounds = [len(models) * k // sizes["parts"] for k in range(sizes["parts"] + 1)]
    how = {"trials": sizes["trials"], "seed": sizes["seed"], "should_stop": work.should_stop}

    def counted(part: int) -> dict[str, np.ndarray] | None:
        chosen = slice(bounds[part], bounds[part + 1])
        counts = count_agents(classifier, genomes, AGGREGATION, models, part=chosen, **how)
        return None if counts is None else {"agents": counts.astype(np.uint32)}

    names = [f"grid-part{k + 1:02d}" for k in range(sizes["parts"])]
    parts = [work.piece(name, partial(counted, k), "npz")["agents"] for k, name in enumerate(names)]
    accuracy = decision_accuracies(np.asarray(sum(parts)), AGGREGATION, len(models))
    split = iter(np.split(accuracy, np.cumsum([len(group) for group in groups])[:-1]))
    return {
        preset: (np.array([[next(split) for _ in run["fitness"]] for run in runs]), [next(split) for _ in runs])
        for preset, runs in populations.items()
    }


def accuracy_verdicts(best: BestAccuracies) -> list[ClaimVerdict]:
    """Hold both curves against the claim, together and alone, and the population without its archive."""
    means, (low, high) = best.subjective.mean(axis=0), RANGE
    early, late = best.generations <= RISEN, best.generations >= SETTLED
    peak, latest = int(means[early].argmax()), means[late]
    text = f"subjective best: {means[0]:.2f} at first, highest of the first {RISEN} generations {means[peak]:.2f} in "
    text += f"generation {best.generations[peak]}"
    if latest.size:
        text += f", {latest.min():.2f} to {latest.max():.2f} from generation {SETTLED} on"
    spreads = Spreads.of(best.subjective[:, late])
    error = 2 * spreads.standard_error
    within = ((low <= spreads.mean + error) & (spreads.mean - error <= high)).all()
    subjective = bool(means[peak] > means[0] and (latest < means[peak]).all() and within)
    exceeds = bool(latest.size and latest.max() > high and latest.min() >= low)
    higher = REASONS["4.4-jumps"] if exceeds and not (subjective or best.variant) else ""
    rule = "accuracy of the objective best"
    objective, jury_text, forgets = _of_the_objective_best(best.jury)
    both, reasons = f"{text}; {jury_text}", "; ".join(filter(None, (higher, forgets)))
    alone, alone_text, alone_forgets = _of_the_objective_best(best.objective)
    found = (
        ("", subjective and objective, both, "accuracy of classifiers", reasons),
        ("subjective best", subjective, text, "accuracy of the subjective best", higher),
        ("objective best", objective, jury_text, rule, forgets),
        ("objective best without the archive", alone, alone_text, rule, alone_forgets),
    )
    return [
        held(ACCURATE, agrees, observed, rule, ", ".join(filter(None, (best.variant, part))), reason=reason)
        for part, agrees, observed, rule, reason in found
    ]


def _of_the_objective_best(highest_of_runs: np.ndarray) -> tuple[bool, str, str]:
    """Return whether accuracies (R, G) agree, what they do, and why they left the level that they reached."""
    means = highest_of_runs.mean(axis=0)
    highest = np.maximum.accumulate(means)
    agrees = bool(means[-1] > LEVEL and means[-1] > means[0] and (means >= highest - STEP_BACK).all())
    back = (highest - means).max()
    text = f"objective best: {means[0]:.3f} at first, {means[-1]:.3f} in the end, largest step back {back:.3f}"
    return agrees, text, REASONS["4.4-forgets"] if means.max() > LEVEL and not agrees else ""


FORMS: dict[str, dict[str, Any]] = {
    "interactive": {"scenario.opponents": 10},
    "random": {"scenario.opponents": 12, "scenario.stimulus.passive": "random"},
    "constant": {"scenario.opponents": 12, "scenario.stimulus.passive": "constant"},
}
"""Form -> settings; 12 trials of each model where classifiers watch are as many as interrogators and their archive cause."""
KIND = "estimate"


def conduct_interaction(work: Work, findings: Findings) -> None:
    """Conduct the studies, and test whether those that interact have other errors than those that watch."""
    tests = {}
    for name, generations in work.sizes["systems"].items():
        system, found = STIMULATED[name], {}
        names = system.parameter_names
        for form, settings in FORMS.items():
            how: dict[str, Any] = {"generations": generations, "settings": settings}
            found[form] = work.runs(f"{name}-{form}", name, PRESETS[0], names, **how)
        interactive, better = found["interactive"].errors[KIND], np.full(len(names), True)
        tests[name] = frame = pd.DataFrame({"parameter": names})
        for form, runs in found.items():
            frame[f"{form}_median"] = np.median(runs.errors[KIND], axis=0)
            if form != "interactive":
                frame[f"{form}_p_value"] = compare_columns(interactive, runs.errors[KIND]).p_values
                better &= frame["interactive_median"] < frame[f"{form}_median"]
                better &= frame[f"{form}_p_value"] < 0.01
        findings.remarks.append(
            f"{system.title}: interaction has smaller errors than both passive forms (Mann-Whitney, p < 0.01 each) in "
            f"{', '.join(frame['parameter'][better]) or 'no parameter'}."
        )
        models = stacked({form: runs.models_frame() for form, runs in found.items()}, "form")
        findings.table("{system.name}-models", models, system=system)
        spans = np.array([each.high - each.low for each in system.parameters.values()])  # type: ignore[operator]
        figure = error_groups_figure({form: runs.errors[KIND] / spans for form, runs in found.items()}, names=names)
        findings.picture("{system.name}-errors", "", figure, system=system, runs=work.sizes["runs"])
    findings.table("errors", stacked(tests, "system"), True)
