"""What a run has learned to see."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import (
    ConfigurationError,
    classifier_of,
    load_configuration,
)
from turing_learning.errors import refuse
from turing_learning.swarm import Scenario
from turing_learning.systems import System

from ._kept import stored_calibration
from ._simulated import CALIBRATION, random_controllers, simulate_behaviors, stream

ARCHIVE = 100


class StoredRun(Protocol):
    """What the room needs of a run: `turing_learning.Result` has it."""

    @property
    def path(self) -> Path | None:
        """The run folder, with ``config.toml``; None for a run that is kept in memory."""

    @property
    def in_laboratory(self) -> bool:
        """Whether robots in a laboratory are observed, real or emulated ones."""

    @property
    def system(self) -> System:
        """What was observed."""

    @property
    def history(self) -> Any:
        """Name -> array over the generations; "classifier" (G, N, Q) and "classifier_fitness" (G, N)."""


@dataclass(frozen=True, eq=False)
class RunClassifiers:
    """The classifiers that a run leaves.

    Attributes
    ----------
    classifier
        Judges.
    last : (N, Q)
        The last generation.
    best : (up to 100, Q)
        The subjectively best of generations that are evenly spread over the run, the last included.
    steps, signals
        Steps T and signals D of a sample.
    scenario
        The simulated swarm of the run; None where the computer cannot simulate its individuals.
    kind
        What the run is, in messages.
    names
        Of the D signals.
    interval_s
        Duration of a time step (s); 0 if it is not known.
    headings
        Whether samples are measured "with" headings or "without"; empty if that is not known, or makes no difference.
    calibration
        Genuine and abnormal motion (individuals, 1, T, D) that the run has kept; None if there is none.
    complete
        Whether the run has come to its end.
    in_laboratory
        Whether robots in a laboratory were observed.
    """

    classifier: Classifier
    last: np.ndarray
    best: np.ndarray
    steps: int
    signals: int
    scenario: Scenario | None
    names: tuple[str, ...]
    interval_s: float
    headings: str
    calibration: tuple[np.ndarray, np.ndarray] | None = None
    complete: bool = True
    in_laboratory: bool = False
    kind: str = "one on a custom system"

    def voters(self, rule: str) -> np.ndarray:
        """Return the classifiers (N, Q) among which a rule of `Detector` chooses."""
        both = (self.last, self.best)
        pools = {"fittest": (self.best[-1:],), "archive": (self.best,), "jury": both, "discriminant": both}
        return np.concatenate(pools.get(rule, (self.last,)))

    def simulated_scenario(self) -> Scenario:
        """Return the scenario.

        Raises
        ------
        ConfigurationError
            If the run has none.
        """
        if self.scenario is None:
            raise ConfigurationError(
                f"`run` must be on simulated robots for individuals to be simulated; got {self.kind}. Give motion that was "
                "observed."
            )
        return self.scenario


def run_classifiers(result: StoredRun) -> RunClassifiers:
    """Return the classifiers of a stored run.

    Parameters
    ----------
    result
        A run in a folder, with its full history: ``turing_learning.load_run(path)``.

    Raises
    ------
    ConfigurationError
        If the run is kept in memory or its history is thin.
    """
    if result.path is None:
        raise ConfigurationError("`run` must be stored in a folder; got one that is kept in memory. Run it with `out`.")
    path, history = result.path / "config.toml", result.history
    configuration = load_configuration(path)
    if "classifier" not in history:
        got, system = f'{result.path} with run.history = "thin", which keeps no classifiers', result.system
        refuse("run", "have a full history", got, system.again(str(path)), error=ConfigurationError)
    system = result.system
    network = classifier_of(configuration)
    return RunClassifiers(
        classifier=system.classifier(network),
        last=np.asarray(history["classifier"][-1]),
        best=_best_of_generations(history["classifier"], history["classifier_fitness"]),
        steps=system.steps,
        signals=network.inputs,
        scenario=system.simulated,
        names=system.signals,
        interval_s=system.interval_s,
        headings=system.headings,
        calibration=stored_calibration(result.path),
        complete=len(history["classifier"]) == configuration.run.generations,
        in_laboratory=result.in_laboratory,
        kind=system.kind,
    )


def _best_of_generations(populations: Any, fitness: Any) -> np.ndarray:
    total = len(populations)
    chosen = np.unique(np.linspace(total - 1, 0, min(ARCHIVE, total)).round().astype(int))
    return np.stack([np.asarray(populations[g])[np.argmax(np.asarray(fitness[g]))] for g in chosen.tolist()])


def _refuse_uncalibrated(run: RunClassifiers) -> None:
    """Raise ConfigurationError if a run, which has kept no motion, cannot be simulated either."""
    if run.scenario is not None:
        return
    if not run.complete:
        raise ConfigurationError(
            "`run` must be finished to have kept motion to calibrate with; got one that was stopped before its end. Resume it "
            "first, or give `genuine` and `abnormal`."
        )
    if run.in_laboratory:
        raise ConfigurationError(
            "`run` must have kept motion to calibrate with; got one in a laboratory that has not. It does once its last models "
            "have been observed again: resume it, with `evaluation.repeats` of at least 1 in its laboratory.json, or give "
            "`genuine` and `abnormal`."
        )
    raise ConfigurationError(
        "`genuine` and `abnormal` must be given for a run on a custom system; got one without. "
        "Give motion (individuals, samples, T, D) of both kinds."
    )


def calibration_motion(
    run: RunClassifiers,
    genuine: np.ndarray | None,
    abnormal: np.ndarray | None,
    *,
    behaviors: int,
    trials: int,
    seed: int,
    threads: int | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return genuine and abnormal motion: what is given, the rest kept by the run or simulated."""
    if genuine is not None and abnormal is not None:
        return genuine, abnormal
    if run.calibration is not None:
        return (
            run.calibration[0] if genuine is None else genuine,
            run.calibration[1] if abnormal is None else abnormal,
        )
    _refuse_uncalibrated(run)
    scenario, rng = run.simulated_scenario(), stream(seed, CALIBRATION)
    controllers = random_controllers(scenario, behaviors, rng)
    simulated = simulate_behaviors(scenario, controllers, trials=trials, rng=rng, threads=threads)
    return (
        simulated.genuine if genuine is None else genuine,
        simulated.abnormal if abnormal is None else abnormal,
    )
