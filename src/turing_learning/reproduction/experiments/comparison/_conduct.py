"""Beyond section 4.5: likelihood-free inference, and a mixture fit to the speeds, on the same scenarios."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from turing_learning.analysis import is_known
from turing_learning.purposes import COMPARISON_OBSERVATION
from turing_learning.reproduction._experiment import Cell, Experiment, Findings, Picture, Table
from turing_learning.reproduction._work import Work
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from ._groups import Groups, Inferred, baseline, summaries
from ._outcome import ABC_SMC, METHODS, MIXTURE, NPE_IN_ROUNDS, TURING_LEARNING, Outcome
from ._text import CONDITIONS, remarks

PACKAGES = ("pyabc", "sbi", "sklearn")
Stop = Callable[[], bool]


@dataclass(frozen=True)
class ComparisonSizes:
    """How many seeds, trials and rounds.

    Attributes
    ----------
    seeds, first_seed
        Which seeds.
    trials
        Simulated trials of every method that simulates.
    observed
        Trials in which agents are observed, for the mixture; the summaries of the others are of the largest number.
    group
        Trials with the same model.
    rounds
        Rounds of sequential neural posterior estimation.
    population
        Models, and classifiers, of Turing Learning.
    """

    seeds: int = 5
    first_seed: int = 2001
    trials: tuple[int, ...] = (1_000, 10_000, 100_000)
    observed: tuple[int, ...] = (10, 100, 1_000)
    group: int = 10
    rounds: int = 2
    population: int = 100
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if any(trials % self.group or trials % self.population for trials in self.trials):
            raise ValueError(f"`trials` must be multiples of {self.group} and {self.population}; got {self.trials}.")


def conduct(work: Work) -> Findings:
    """Run every method with every number of trials."""
    for package in PACKAGES:
        baseline(package)
    outcomes = [outcome for scenario in (AGGREGATION, OBJECT_CLUSTERING) for outcome in _outcomes(work, scenario)]
    tables = [
        *(_summary_table(scenario, outcomes) for scenario in (AGGREGATION, OBJECT_CLUSTERING)),
        *(_runs_table(scenario, outcomes) for scenario in (AGGREGATION, OBJECT_CLUSTERING)),
    ]
    return Findings([], tables, [_picture(outcomes)], remarks(outcomes))


def _outcomes(work: Work, scenario: Scenario) -> "Iterator[Outcome]":
    sizes: ComparisonSizes = work.sizes
    seeds = range(sizes.first_seed, sizes.first_seed + sizes.seeds)
    for method in METHODS:
        for trials in sizes.observed if method == MIXTURE else sizes.trials:
            found = [_found(work, scenario, method, trials, seed) for seed in seeds]
            yield Outcome.of(scenario, method, trials, tuple(seeds), found)


def _found(work: Work, scenario: Scenario, method: str, trials: int, seed: int) -> dict[str, Any]:
    sizes: ComparisonSizes = work.sizes

    def compute() -> dict[str, Any] | None:
        groups = Groups(scenario, sizes.group)
        observed = trials if method == MIXTURE else max(sizes.observed)
        genuine = groups.observe(observed, np.random.default_rng((COMPARISON_OBSERVATION, seed)))
        begun = time.process_time()
        inferred = _infer(method, groups, genuine, trials, seed, sizes, work.should_stop)
        return None if inferred is None else _as_json(inferred, time.process_time() - begun)

    return work.piece(f"{scenario.name}-{method}-{trials}-seed{seed}", compute)


def _infer(
    method: str, groups: Groups, genuine: np.ndarray, trials: int, seed: int, sizes: ComparisonSizes, stop: Stop
) -> Inferred | None:
    if method == TURING_LEARNING:
        return _infer_by_turing_learning(groups.scenario, trials, seed, sizes, stop)
    if method == MIXTURE:
        from ._mixture import fit_mixture

        return fit_mixture(genuine, groups.scenario, seed)
    summary, evaluations = summaries(genuine, groups.scenario), trials // groups.size
    if method == ABC_SMC:
        from ._abc_smc import infer_by_abc_smc

        return infer_by_abc_smc(groups, summary, evaluations, seed, stop)
    from ._neural_posterior import infer_by_npe

    rounds = sizes.rounds if method == NPE_IN_ROUNDS else 1
    return infer_by_npe(groups, summary, evaluations, seed, stop, rounds=rounds)


def _infer_by_turing_learning(
    scenario: Scenario, trials: int, seed: int, sizes: ComparisonSizes, stop: Stop
) -> Inferred | None:
    from turing_learning.runs import infer

    population = {"models.population": sizes.population, "classifiers.population": sizes.population}
    settings = {**population, **sizes.settings}
    generations = trials // sizes.population
    result = infer(scenario, generations=generations, seed=seed, settings=settings, threads=1, should_stop=stop)
    if not result.complete:
        return None
    low, high = np.array(list(result.interval.values())).T
    return Inferred(np.array(list(result.estimate.values())), low, high)


def _as_json(inferred: Inferred, seconds: float) -> dict[str, Any]:
    arrays = {"estimate": inferred.estimate, "low": inferred.low, "high": inferred.high}
    listed = {name: None if array is None else _listed(array) for name, array in arrays.items()}
    return listed | {"processor_seconds": round(seconds, 2)}


def _listed(values: np.ndarray) -> list[float | None]:
    """Return numbers as a file or table holds them: None where they are not known."""
    return [value if is_known(value) else None for value in values.tolist()]


# Tables and picture.


def _summary_table(scenario: Scenario, outcomes: "list[Outcome]") -> Table:
    rows: list[tuple[Cell, ...]] = [
        (
            METHODS[one.method], one.trials, one.mae, *map(float, np.median(one.errors, axis=0)), one.coverage, one.width,
            one.seconds,
        )
        for one in outcomes
        if one.scenario == scenario
    ]  # fmt: skip
    columns = ("method", "trials", "MAE", *scenario.parameter_names, "coverage", "width", "processor_s")
    caption = (
        f"{scenario.title}: medians over the seeds of the mean absolute error and of the absolute errors; share of the true "
        "parameters inside the central 90 % interval, and its mean width; median processor time (s)"
    )
    return Table(scenario.name, caption, columns, rows, inline=True)


def _runs_table(scenario: Scenario, outcomes: "list[Outcome]") -> Table:
    rows: list[tuple[Cell, ...]] = [
        (one.method, one.trials, seed, *map(float, one.estimates[k]), float(one.maes[k]), *_ends(one, k))
        for one in outcomes
        if one.scenario == scenario
        for k, seed in enumerate(one.seeds)
    ]
    ends = (f"{end}_{name}" for name in scenario.parameter_names for end in ("low", "high"))
    columns = ("method", "trials", "seed", *scenario.parameter_names, "MAE", *ends)
    return Table(f"{scenario.name}-runs", f"{scenario.title}: every run, with its interval", columns, rows)


def _ends(outcome: "Outcome", k: int) -> list[Cell]:
    if outcome.intervals is None:
        return [None] * (2 * outcome.estimates.shape[1])
    return [*_listed(outcome.intervals[k].T.ravel())]


def _picture(outcomes: "list[Outcome]") -> Picture:
    from turing_learning.figures._many_runs import budget_figure

    panels: dict[str, dict[str, dict[int, np.ndarray]]] = {}
    for one in outcomes:
        panels.setdefault(one.scenario.title, {}).setdefault(METHODS[one.method], {})[one.trials] = one.maes
    caption = (
        f"Mean absolute error of each of {len(outcomes[0].seeds)} seeds, and their medians, over the number of simulated trials; "
        "for the mixture, which simulates nothing, over the number of trials in which agents were observed."
    )
    return Picture("accuracy", caption, "", budget_figure(panels))


EXPERIMENT = Experiment(
    id="4.5+",
    title="Likelihood-free inference, and a mixture, instead of classifiers",
    cost="about 1 hour",
    claims=(),
    deviations=(),
    conditions=CONDITIONS,
    full=ComparisonSizes(),
    fast=ComparisonSizes(
        seeds=1,
        trials=(500,),
        observed=(10,),
        group=5,
        population=10,
        settings={"run.checkpoint_every": 50},
    ),
    conduct=conduct,
    packages=PACKAGES,
    extra="baselines",
)
