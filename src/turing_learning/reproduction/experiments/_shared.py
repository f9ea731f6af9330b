"""What several experiments share: studies of many runs, the errors of their models, and the agents' sensor readings."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from turing_learning.analysis import Comparison, compare
from turing_learning.swarm import Scenario

from .._experiment import stacked
from .._verdicts import Spread, printed_spreads, spreads_of

if TYPE_CHECKING:
    from turing_learning.studies import StudyResult
    from turing_learning.swarm import Simulation

PRESETS = ("default", "paper")  # the first one decides; the other stands beside it
KINDS = {"best_model": "absolute_error", "estimate": "estimate_absolute_error"}
"""What a run infers, and its errors in the result of the run; the first is the paper's rule, and decides."""


def variant_of(preset: str, kind: str = "best_model") -> str:
    """Return what a verdict is about; nothing for the one that counts."""
    parts = [] if preset == PRESETS[0] else [f"preset {preset}"]
    return ", ".join([*parts, *([] if kind == "best_model" else [kind])])


def small(population: int, every: int) -> dict[str, Any]:
    """Return settings of a fast form: few models and classifiers, checkpoints every so many generations."""
    return {"models.population": population, "classifiers.population": population, "run.checkpoint_every": every}


@dataclass(frozen=True, eq=False)
class Runs:
    """What R runs of a study with one preset have inferred."""

    preset: str
    names: tuple[str, ...]
    seeds: tuple[int, ...]
    models: dict[str, np.ndarray]  # kind -> (R, P), by the kinds of `KINDS`
    errors: dict[str, np.ndarray]  # kind -> (R, P), their absolute errors

    @classmethod
    def of(cls, result: "StudyResult", preset: str, names: tuple[str, ...]) -> "Runs":
        """Return what the runs of a study have inferred."""
        models = {kind: values_of(result, kind) for kind in KINDS}
        errors = {kind: values_of(result, key) for kind, key in KINDS.items()}
        return cls(preset, names, tuple(run.seed for run in result.runs), models, errors)

    def __len__(self) -> int:
        return len(self.seeds)

    def maes(self, kind: str) -> np.ndarray:
        """Return the mean absolute error of each run (R,)."""
        return self.errors[kind].mean(axis=1)

    def models_frame(self) -> pd.DataFrame:
        """Return what every run has inferred: model, seed, parameters."""
        return stacked({kind: seeded(self.seeds, self.models[kind], self.names) for kind in KINDS}, "model")

    def errors_frame(self, claim: str = "") -> pd.DataFrame:
        """Return statistics of the errors: model, parameter, runs, mean, standard deviation, median; beside what a claim prints."""
        frame = stacked({kind: errors_frame(self.errors[kind], self.names) for kind in KINDS}, "model")
        return beside_the_paper(frame, claim) if claim else frame


def values_of(result: "StudyResult", name: str) -> np.ndarray:
    """Return what each run of a study has under a name, parameter by parameter (R, P)."""
    return np.array([list(run.result[name].values()) for run in result.runs if run.result is not None])


def seeded(seeds: Sequence[int], models: np.ndarray, names: Sequence[str]) -> pd.DataFrame:
    """Return models (R, P) with the seeds of their runs."""
    return pd.DataFrame({"seed": seeds}).join(pd.DataFrame(models, columns=list(names)))


def errors_frame(errors: np.ndarray, names: Sequence[str]) -> pd.DataFrame:
    """Return statistics of absolute errors (R, P): parameter, runs, mean, standard deviation, median."""
    frame = pd.DataFrame({"parameter": names, "runs": len(errors)})
    return frame.join(spreads_frame(spreads_of(errors))).assign(median=np.median(errors, axis=0))


def beside_the_paper(frame: pd.DataFrame, claim: str) -> pd.DataFrame:
    """Return statistics of errors with what a claim prints of the best model of a run; it comes first."""
    return frame.join(spreads_frame(printed_spreads(claim), "paper_mean", "paper_standard_deviation"))


def spreads_frame(spreads: Sequence[Spread], mean: str = "mean", deviation: str = "standard_deviation") -> pd.DataFrame:
    """Return means and standard deviations as columns of these names."""
    return pd.DataFrame([(one.mean, one.standard_deviation) for one in spreads], columns=[mean, deviation])


def compare_columns(genuine: np.ndarray, others: np.ndarray) -> Comparison:
    """Test each of P columns of values (R, P) against the same column of others (R, P)."""
    tests = [compare(genuine[:, k], [others[:, k]]) for k in range(genuine.shape[1])]
    return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


@dataclass(frozen=True)
class ShareSizes:
    """How many trials, of the scenario's own duration."""

    trials: int = 100
    seed: int = 1


def sensor_shares(scenario: Scenario, sizes: ShareSizes) -> np.ndarray:
    """Return the share of the agents in each sensor state (R, T, n), trial by trial and step by step (paper, section 4.3)."""
    robots, steps, seed = scenario.individuals, scenario.control_steps, sizes.seed
    sensors = moved(scenario, scenario.controller, sizes.trials, robots, steps, starts=seed, noise=seed).sensors
    return (sensors[:, :-1, :, None] == np.arange(scenario.sensor.states)).mean(axis=2)


def moved(
    scenario: Scenario,
    controller: np.typing.ArrayLike,
    trials: int,
    robots: int,
    steps: int,
    *,
    starts: Any,
    noise: int,
) -> "Simulation":
    """Simulate trials in which all robots execute one controller; `starts` seeds initial configurations."""
    from turing_learning.swarm import initial_poses, simulate

    start = initial_poses(scenario, trials, np.random.default_rng(starts), robots=robots)
    controllers = np.broadcast_to(controller, (trials, robots, len(scenario.controller)))
    return simulate(scenario, controllers, start, control_steps=steps, seed=noise)


def gathered(scenario: Scenario, poses: np.ndarray, robots: int) -> tuple[np.ndarray, float]:
    """Return positions (..., S, 2) and radius (cm) of those that are to gather: the objects, or robots if there are none."""
    if scenario.objects.count:
        return poses[..., robots:, :2], scenario.objects.radius_cm
    return poses[..., :robots, :2], scenario.robot.radius_cm
