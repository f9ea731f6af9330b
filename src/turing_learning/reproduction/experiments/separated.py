"""Section 4.6.3: agents and replicas in groups of their own."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import Comparison, compare
from turing_learning.figures import Picture
from turing_learning.figures._many_runs import box_panels_figure
from turing_learning.swarm import AGGREGATION

from .._experiment import Experiment, Findings, Table, stacked
from .._verdicts import Verdict, listed, spreads_of, valued
from .._work import Work
from ._shared import KINDS, PRESETS, Runs, spreads_frame, variant_of

CLAIM = "4.6.3-separated"
GROUPINGS = ("mixed", "separated")
NAMES = AGGREGATION.parameter_names


@dataclass(frozen=True)
class SeparatedSizes:
    """How many runs and generations, with mixed and with separated groups."""

    runs: int = 30
    generations: int = 1000
    first_seed: int = 2001
    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


def conduct(work: Work) -> Findings:
    """Conduct the studies, and test whether their errors differ."""
    sizes: SeparatedSizes = work.sizes
    found: dict[str, dict[str, Runs]] = {preset: {} for preset in sizes.presets}
    for preset, both in found.items():
        for grouping in GROUPINGS:
            settings = {"scenario.grouping": grouping}
            result = work.runs(f"study-{grouping}-{preset}", AGGREGATION.name, preset, settings=settings)
            both[grouping] = Runs.of(result, preset, NAMES)
    return Findings(
        [separated_verdict(both, kind) for both in found.values() for kind in KINDS],
        [_errors_table(found), *(_models_table(preset, both) for preset, both in found.items())],
        [_picture(preset, both) for preset, both in found.items()],
    )


def _comparison(both: Mapping[str, Runs], kind: str) -> Comparison:
    """Test the absolute errors of separated runs against those of mixed ones, parameter by parameter."""
    mixed, separated = (both[grouping].errors[kind] for grouping in GROUPINGS)
    tests = [compare(mixed[:, k], [separated[:, k]]) for k in range(mixed.shape[1])]
    return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


def separated_verdict(both: Mapping[str, Runs], kind: str) -> Verdict:
    """Test whether the errors of runs, by their grouping, differ."""
    comparison = _comparison(both, kind)
    texts = "; ".join(f"{name}: {listed(NAMES, spreads_of(runs.errors[kind]))}" for name, runs in both.items())
    return Verdict(
        CLAIM,
        not comparison.significant.any(),
        "no significant difference",
        f"{texts}; p: {valued(NAMES, comparison.p_values, '.2g')}",
        "separated",
        variant_of(both["mixed"].preset, kind),
    )


def _errors_table(found: Mapping[str, Mapping[str, Runs]]) -> Table:
    frames = {}
    for preset, both in found.items():
        for kind in KINDS:
            comparison = _comparison(both, kind)
            frame = pd.DataFrame({"parameter": NAMES, "runs": len(both["mixed"])})
            for name, runs in both.items():
                spreads = spreads_of(runs.errors[kind])
                frame = frame.join(spreads_frame(spreads, f"{name}_mean", f"{name}_standard_deviation"))
            frames[preset, kind] = frame.assign(p_value=comparison.p_values, significant=comparison.significant)
    caption = "Absolute errors over the runs with mixed and with separated groups, and the Mann-Whitney test of each parameter"
    return Table("absolute-errors", caption, stacked(frames, "preset", "model"))


def _models_table(preset: str, both: Mapping[str, Runs]) -> Table:
    frame = stacked({name: runs.models_frame() for name, runs in both.items()}, "grouping")
    return Table(f"{preset}-models", f"What every run has inferred, preset {preset}", frame)


def _picture(preset: str, both: Mapping[str, Runs]) -> Picture:
    models = [both[grouping].models["best_model"] for grouping in GROUPINGS]
    figure = box_panels_figure(models, titles=("Mixed", "Separated"), names=NAMES, truth=AGGREGATION.controller)
    caption = (
        f"Parameters of the subjectively best model of the last generation, {len(models[0])} runs each, preset "
        f"{preset}: replicas mixed into groups of agents, and separated from them; the truth is dashed."
    )
    return Picture(f"{preset}-boxes", CLAIM, caption, figure)


EXPERIMENT = Experiment.of(
    "4.6.3",
    conduct,
    full=SeparatedSizes(),
    fast=SeparatedSizes(
        runs=2,
        generations=8,
        presets=PRESETS[:1],
        settings={"models.population": 8, "classifiers.population": 8, "run.checkpoint_every": 8},
    ),
)
