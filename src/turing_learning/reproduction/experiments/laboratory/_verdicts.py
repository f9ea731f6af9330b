"""Section 5 held against what the paper prints."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from turing_learning.analysis import absolute_error, mean_absolute_error
from turing_learning.reproduction._claims import Claim
from turing_learning.reproduction._verdicts import Spread, Verdict, listed, not_worse, printed_spreads
from turing_learning.reproduction.experiments.classifier_accuracy import BestAccuracies

from ._runs import LaboratoryRuns
from ._validation import QUANTITIES, Validation

ERRORS, DYNAMICS, VALIDATION, CLASSIFIERS = (
    f"5-physical-{what}" for what in ("ae", "dynamics", "validation", "classifiers")
)
PAPER_RUNS = 10
CORRESPONDENCE = 0.1
"""Difference of medians that still counts as good correspondence, as "near the truth" does in section 4.3."""
LATE = 0.2
"""Share of the generations, the last ones, over which medians are compared."""
HIGH = 0.9
NO_NOISE = (
    "as in simulation, the fittest classifier comes to know the present models only; the paper supposes that the noise of its "
    "robots has prevented that, and emulated robots have none but that of their wheels and of the camera"
)


@dataclass(frozen=True, eq=False)
class ErrorDynamics:
    """Medians over the runs of the MAE of three models of each generation (G,)."""

    average: np.ndarray
    subjective: np.ndarray
    objective: np.ndarray

    @classmethod
    def of(cls, runs: LaboratoryRuns, truth: np.ndarray) -> "ErrorDynamics":
        """Return the errors of all models on average, of the subjectively best, and of the best."""
        maes = mean_absolute_error(runs.models, truth)
        return cls(
            average=np.median(maes.mean(axis=2), axis=0),
            subjective=np.median(mean_absolute_error(runs.fittest, truth), axis=0),
            objective=np.median(maes.min(axis=2), axis=0),
        )

    @property
    def share_between(self) -> float:
        """Share of the generations in which the subjectively best model lies between the best and the average one."""
        return float(np.mean((self.objective <= self.subjective) & (self.subjective <= self.average)))


def medians(runs: LaboratoryRuns) -> np.ndarray:
    """Return the medians over the runs of the subjectively best model of each generation (G, P)."""
    return np.asarray(np.median(runs.fittest, axis=0))


def distances(emulated: LaboratoryRuns, simulated: LaboratoryRuns) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the medians of two kinds of runs are apart (P,), on average over the last fifth and over all generations."""
    apart = np.abs(medians(emulated) - medians(simulated))
    return np.asarray(apart[-max(1, round(LATE * len(apart))) :].mean(axis=0)), np.asarray(apart.mean(axis=0))


def errors_verdict(
    runs: LaboratoryRuns, truth: np.ndarray, names: tuple[str, ...], claims: Mapping[str, Claim], variant: str = ""
) -> Verdict:
    """Hold the absolute errors of the post-evaluated best models against the printed ones."""
    printed = printed_spreads(claims[ERRORS].values, PAPER_RUNS)
    observed = [Spread.of(errors) for errors in absolute_error(runs.best, truth).T]
    return Verdict(
        ERRORS,
        not_worse(observed, printed),
        f"{listed(names, printed, 2)}; median model {_joined(claims[ERRORS].values['median_parameters'])}",
        f"{listed(names, observed)}; median model {_joined(np.median(runs.best, axis=0))}",
        "absolute errors",
        variant,
    )


def _joined(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def dynamics_verdict(
    emulated: LaboratoryRuns, simulated: LaboratoryRuns, truth: np.ndarray, names: tuple[str, ...]
) -> Verdict:
    """Compare the dynamics of emulated and of simulated runs."""
    shares = [ErrorDynamics.of(runs, truth).share_between for runs in (emulated, simulated)]
    late, overall = distances(emulated, simulated)
    listings = [
        ", ".join(f"{name} {value:.2f}" for name, value in zip(names, apart, strict=True)) for apart in (late, overall)
    ]
    return Verdict(
        DYNAMICS,
        bool(min(shares) > 0.5 and (late <= CORRESPONDENCE).all()),
        "good correspondence of physical and simulated runs; the subjectively best model lies between the best and the average "
        "one in the majority of the generations of both",
        f"between them in {shares[0]:.0%} of the generations of emulated and {shares[1]:.0%} of simulated runs; medians apart in "
        f"the last fifth of the generations: {listings[0]}; over all generations: {listings[1]}",
        "dynamics",
    )


def validation_verdict(validation: Validation) -> Verdict:
    """Compare what swarms of the median model and of agents do."""
    comparison = validation.comparison
    tests = ", ".join(f"{name} {p:.2g}" for name, p in zip(QUANTITIES, comparison.p_values, strict=True))
    ends = [Spread.of(one.proportion[:, -1]) for one in (validation.agents, validation.replicas)]
    spreads = [Spread.of(one.dispersion[:, -1]) for one in (validation.agents, validation.replicas)]
    robots = validation.agents.seen.shape[2]
    return Verdict(
        VALIDATION,
        not comparison.significant.any(),
        "the dynamics of the agents and of the median inferred model show good correspondence",
        f"{robots} robots after {validation.times_s[-1]:g} s: largest cluster {ends[0].mean:.2f} (agents), {ends[1].mean:.2f} "
        f"(model) of the robots; dispersion {spreads[0].mean:.0f}, {spreads[1].mean:.0f}; p: {tests}",
        "validation",
    )


def does_not_drop(values: np.ndarray) -> bool:
    """Return whether no generation's mean over the runs (R, G) is below an earlier one by more than twice the standard error of
    the difference."""  # fmt: skip
    spreads = [Spread.of(column) for column in values.T]
    return all(
        earlier.mean - later.mean <= 2 * float(np.hypot(earlier.standard_error, later.standard_error))
        for k, later in enumerate(spreads)
        for earlier in spreads[:k]
    )


def classifiers_verdict(best: BestAccuracies) -> Verdict:
    """Hold the accuracy of the best classifiers against what the text says of the figure."""
    objective, subjective = best.objective.mean(axis=0), best.subjective.mean(axis=0)
    lowest = int(subjective.argmin())
    agrees = bool(objective[-1] >= HIGH and does_not_drop(best.subjective))
    return Verdict(
        CLASSIFIERS,
        agrees,
        "best classifier (objective) high; best classifier (subjective) does not drop within 100 generations",
        f"objective best {objective[0]:.2f} at first, {objective[-1]:.2f} in the end; subjective best {subjective[0]:.2f} at "
        f"first, {subjective[-1]:.2f} in the end, lowest {subjective[lowest]:.2f} in generation {best.generations[lowest]}",
        "classifiers in the laboratory",
        reason="" if agrees else NO_NOISE,
    )
