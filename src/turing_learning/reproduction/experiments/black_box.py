"""Section 4.6.2: models that assume nothing of the agents' control system."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import DYNAMIC_READINGS as READINGS
from turing_learning.analysis import dynamic_outputs, median_place, response_error
from turing_learning.figures._many_runs import box_panels_figure, dynamic_outputs_figure
from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION

from .._experiment import Captions, Experiment, Findings, stacked
from .._verdicts import PAPER_RUNS, PRINTED, ClaimVerdict, shares_not_worse, valued
from .._work import RunSizes, Work
from ._shared import PRESETS, Runs, seeded, small, variant_of

ID, CLAIM = "4.6.2", "4.6.2-black-box"
NEAR = 0.1
QUICK = 3  # steps after a change of the reading in which the outputs are to be near their steady values
PRINTED_ASTRAY = {5: 2}  # hidden neurons -> outliers that the caption of figure 11 names, of `PAPER_RUNS`
TRUTH, NAMES = np.array(AGGREGATION.controller), AGGREGATION.parameter_names


@dataclass(frozen=True)
class BlackBoxSizes(RunSizes):
    """How many runs and generations, for networks of which sizes."""

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
    captions, verdicts, pictures = Captions(ID), [], []
    errors, steady, dynamic = {}, {}, {}
    for preset in sizes.presets:
        outcomes = []
        for hidden in sizes.hidden:
            settings = {"models.hidden": hidden}
            result = work.runs(f"study-{hidden}-hidden-{preset}", AGGREGATION.name, preset, settings=settings)
            found = [run.result["networks"]["best_model"] for run in result.runs if run.result is not None]
            model, networks = ElmanModel(AGGREGATION.sensor.states, hidden), [list(one.values()) for one in found]
            outcomes.append(NetworkRuns(Runs.of(result, preset, NAMES), model, np.array(networks)))
        verdicts.append(black_box_verdict(outcomes))
        for one in outcomes:
            key, runs = (preset, one.model.hidden), one.runs
            frame = runs.errors_frame()
            frame.insert(3, "median_output", np.ravel([np.median(outputs, axis=0) for outputs in runs.models.values()]))
            errors[*key, len(one.model.parameter_names)] = frame
            median = np.arange(len(runs)) == median_place(one.performance)
            steady[key] = frame = seeded(runs.seeds, runs.models["best_model"], NAMES)
            frame.insert(1, "metric", one.performance)
            frame.insert(2, "is_median", median)
            moments = pd.DataFrame({"step": np.arange(1, len(READINGS) + 1), "reading": READINGS})
            dynamic[key] = moments.join(pd.DataFrame(one.dynamics, columns=["left", "right"]))
        titles, words = [one.title for one in outcomes], {"preset": preset, "runs": len(outcomes[0].runs)}
        look: dict[str, Any] = {"titles": titles, "names": NAMES, "truth": TRUTH, "what": "Steady output"}
        boxes = box_panels_figure([one.runs.models["best_model"] for one in outcomes], **look)
        truth, dynamics = TRUTH.reshape(-1, 2)[READINGS], [one.dynamics for one in outcomes]
        curves = dynamic_outputs_figure(dynamics, readings=READINGS, titles=titles, truth=truth)
        pictures += [
            captions.picture("{preset}-steady-outputs", CLAIM, boxes, **words),
            captions.picture("{preset}-dynamic-outputs", CLAIM, curves, **words),
        ]
    tables = [
        captions.table("absolute-errors", stacked(errors, "preset", "hidden", "weights")),
        captions.table("steady-outputs", stacked(steady, "preset", "hidden")),
        captions.table("dynamic-outputs", stacked(dynamic, "preset", "hidden")),
    ]
    return Findings(verdicts, tables, pictures)


def settling(outputs: np.ndarray, readings: np.ndarray = READINGS) -> int:
    """Return in which step after a change of the reading, from 1, the outputs (T, 2) are near where they end, to stay."""
    begins = np.flatnonzero(np.diff(readings, prepend=readings[0] - 1))
    slowest = 1
    for phase in np.split(outputs, begins[1:]):
        astray = np.flatnonzero((np.abs(phase - phase[-1]) > NEAR).any(axis=1))
        slowest = max(slowest, int(astray[-1]) + 2 if astray.size else 1)
    return slowest


def black_box_verdict(outcomes: Sequence[NetworkRuns]) -> ClaimVerdict:
    """Hold networks of all sizes against the claim."""
    settled = [settling(outcome.dynamics) for outcome in outcomes]
    texts = []
    for one, step in zip(outcomes, settled, strict=True):
        medians = valued(NAMES, np.median(one.runs.models["best_model"], axis=0))
        texts.append(
            f"{one.model.hidden} hidden: medians {medians}; median MAE {np.median(one.runs.maes('best_model')):.3f}, an output "
            f"off by more than {2 * NEAR:g} in {one.astray} of {len(one.runs)} runs; settled in step {step}"
        )
    return ClaimVerdict(
        CLAIM,
        all(one.near and one.few_astray for one in outcomes) and max(settled) <= QUICK,
        PRINTED[CLAIM],
        ". ".join(texts),
        "black box",
        variant_of(outcomes[0].runs.preset),
    )


EXPERIMENT = Experiment.of(
    ID, conduct, full=BlackBoxSizes(),
    fast=BlackBoxSizes(runs=2, generations=8, hidden=(1, 3), presets=PRESETS[:1], settings=small(8, 8)),
)  # fmt: skip
