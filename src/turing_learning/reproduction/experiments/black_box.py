"""Section 4.6.2: models that assume nothing of the agents' control system."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import DYNAMIC_READINGS as READINGS
from turing_learning.analysis import dynamic_outputs, median_place, response_error
from turing_learning.figures import Picture
from turing_learning.figures._many_runs import box_panels_figure, dynamic_outputs_figure
from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION

from .._experiment import Experiment, Findings, Table, stacked
from .._verdicts import PAPER_RUNS, Verdict, shares_not_worse, valued
from .._work import Work
from ._shared import PRESETS, Runs, variant_of

CLAIM = "4.6.2-black-box"
NEAR = 0.1
QUICK = 3
"""Steps after a change of the reading in which the outputs are to be near their steady values."""
PRINTED_ASTRAY = {5: 2}
"""Hidden neurons -> outliers that the caption of figure 11 names, of `PAPER_RUNS`."""
TRUTH, NAMES = np.array(AGGREGATION.controller), AGGREGATION.parameter_names


@dataclass(frozen=True)
class BlackBoxSizes:
    """How many runs and generations, for networks of which sizes."""

    runs: int = 30
    generations: int = 1000
    first_seed: int = 2001
    hidden: tuple[int, ...] = (1, 3, 5)
    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class NetworkRuns:
    """What runs with networks of one size have inferred."""

    runs: Runs  # whose "models" are the steady outputs of the networks
    model: ElmanModel
    networks: np.ndarray  # (R, Q), weights of the subjectively best models

    @property
    def title(self) -> str:
        """The size in words."""
        neurons = {1: "One", 3: "Three", 5: "Five"}.get(self.model.hidden, str(self.model.hidden))
        return f"{neurons} hidden neuron{'s' if self.model.hidden > 1 else ''}"

    @property
    def performance(self) -> np.ndarray:
        """The paper's metric of each network (R,)."""
        return response_error(self.model, self.networks, TRUTH)

    @property
    def dynamics(self) -> np.ndarray:
        """Outputs (T, 2) of the network of median performance."""
        return dynamic_outputs(self.model, self.networks[median_place(self.performance)])

    @property
    def near(self) -> bool:
        """Whether the median of every steady output is near the truth."""
        return bool((np.abs(np.median(self.runs.models["best_model"], axis=0) - TRUTH) <= NEAR).all())

    @property
    def astray(self) -> int:
        """Number of runs with an output far from the truth."""
        return int(np.count_nonzero(self.runs.errors["best_model"].max(axis=1) > 2 * NEAR))

    @property
    def few_astray(self) -> bool:
        """Whether the share of the others does not fall short of the printed one."""
        runs, printed = len(self.runs), PRINTED_ASTRAY.get(self.model.hidden, 0)
        return shares_not_worse(1 - self.astray / runs, runs, 1 - printed / PAPER_RUNS, PAPER_RUNS)


def conduct(work: Work) -> Findings:
    """Conduct the studies, and look at what the networks do."""
    sizes: BlackBoxSizes = work.sizes
    found: dict[str, list[NetworkRuns]] = {preset: [] for preset in sizes.presets}
    for preset in sizes.presets:
        for hidden in sizes.hidden:
            settings = {"models.hidden": hidden}
            result = work.runs(f"study-{hidden}-hidden-{preset}", AGGREGATION.name, preset, settings=settings)
            networks = [
                list(run.result["networks"]["best_model"].values()) for run in result.runs if run.result is not None
            ]
            model = ElmanModel(AGGREGATION.sensor.states, hidden)
            found[preset].append(NetworkRuns(Runs.of(result, preset, NAMES), model, np.array(networks)))
    return Findings(
        [black_box_verdict(outcomes) for outcomes in found.values()],
        _tables([outcome for outcomes in found.values() for outcome in outcomes]),
        [picture for outcomes in found.values() for picture in _pictures(outcomes)],
    )


def settling(outputs: np.ndarray, readings: np.ndarray = READINGS) -> int:
    """Return in which step after a change of the reading, from 1, the outputs (T, 2) are near where they end, to stay."""
    begins = np.flatnonzero(np.diff(readings, prepend=readings[0] - 1))
    slowest = 1
    for phase in np.split(outputs, begins[1:]):
        astray = np.flatnonzero((np.abs(phase - phase[-1]) > NEAR).any(axis=1))
        slowest = max(slowest, int(astray[-1]) + 2 if astray.size else 1)
    return slowest


def black_box_verdict(outcomes: Sequence[NetworkRuns]) -> Verdict:
    """Hold networks of all sizes against the claim."""
    settled = [settling(outcome.dynamics) for outcome in outcomes]
    texts = []
    for one, step in zip(outcomes, settled, strict=True):
        medians = valued(NAMES, np.median(one.runs.models["best_model"], axis=0))
        texts.append(
            f"{one.model.hidden} hidden: medians {medians}; median MAE {np.median(one.runs.maes('best_model')):.3f}, an output "
            f"off by more than {2 * NEAR:g} in {one.astray} of {len(one.runs)} runs; settled in step {step}"
        )
    return Verdict(
        CLAIM,
        all(one.near and one.few_astray for one in outcomes) and max(settled) <= QUICK,
        "steady outputs near (-0.7, -1, 1, -1), more hidden neurons worse, two outliers with five; outputs settle quickly",
        ". ".join(texts),
        "black box",
        variant_of(outcomes[0].runs.preset),
    )


def _tables(outcomes: Sequence[NetworkRuns]) -> list[Table]:
    errors, steady, dynamic = {}, {}, {}
    for one in outcomes:
        key, runs = (one.runs.preset, one.model.hidden), one.runs
        frame = runs.errors_frame()
        frame.insert(3, "median_output", np.ravel([np.median(outputs, axis=0) for outputs in runs.models.values()]))
        errors[*key, len(one.model.parameter_names)] = frame
        median = np.arange(len(runs)) == median_place(one.performance)
        numbers = pd.DataFrame({"seed": runs.seeds, "metric": one.performance, "is_median": median})
        steady[key] = numbers.join(pd.DataFrame(runs.models["best_model"], columns=NAMES))
        moments = pd.DataFrame({"step": np.arange(1, len(READINGS) + 1), "reading": READINGS})
        dynamic[key] = moments.join(pd.DataFrame(one.dynamics, columns=["left", "right"]))
    return [
        Table(
            "absolute-errors",
            "Steady outputs of the networks over the runs, and their absolute errors",
            stacked(errors, "preset", "hidden", "weights"),
        ),
        Table(
            "steady-outputs",
            "Steady outputs of the subjectively best network of the last generation of every run, and the paper's metric, by which "
            "one is the median",
            stacked(steady, "preset", "hidden"),
        ),
        Table(
            "dynamic-outputs",
            "Outputs of the networks of median performance while the reading changes",
            stacked(dynamic, "preset", "hidden"),
        ),
    ]


def _pictures(outcomes: Sequence[NetworkRuns]) -> list[Picture]:
    runs, titles = outcomes[0].runs, [outcome.title for outcome in outcomes]
    outputs = [one.runs.models["best_model"] for one in outcomes]
    steady = box_panels_figure(outputs, titles=titles, names=NAMES, truth=TRUTH, what="Steady output")
    truth = TRUTH.reshape(-1, 2)[READINGS]
    dynamics = dynamic_outputs_figure([one.dynamics for one in outcomes], readings=READINGS, titles=titles, truth=truth)
    return [
        Picture(
            f"{runs.preset}-steady-outputs",
            CLAIM,
            f"Outputs in the 20th step of each constant reading, of the subjectively best network of the last generation, "
            f"{len(runs)} runs, preset {runs.preset}; the agents' parameters are dashed (figure 11 of the paper).",
            steady,
        ),
        Picture(
            f"{runs.preset}-dynamic-outputs",
            CLAIM,
            f"Outputs of the network of median performance for I = 0, 1 (shaded), 0, ten steps each, preset {runs.preset}; what "
            "the agents do is dashed (figure 12 of the paper).",
            dynamics,
        ),
    ]


EXPERIMENT = Experiment.of(
    "4.6.2",
    conduct,
    full=BlackBoxSizes(),
    fast=BlackBoxSizes(
        runs=2,
        generations=8,
        hidden=(1, 3),
        presets=PRESETS[:1],
        settings={"models.population": 8, "classifiers.population": 8, "run.checkpoint_every": 8},
    ),
)
