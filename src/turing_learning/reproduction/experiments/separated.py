"""Section 4.6.3: agents and replicas in groups of their own."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import pandas as pd

from turing_learning.figures._many_runs import box_panels_figure
from turing_learning.swarm import AGGREGATION

from .._experiment import Captions, Experiment, Findings, stacked
from .._verdicts import PRINTED, ClaimVerdict, listed, spreads_of, valued
from .._work import RunSizes, Work
from ._shared import KINDS, PRESETS, Runs, compare_columns, small, spreads_frame, variant_of

ID, CLAIM = "4.6.3", "4.6.3-separated"
GROUPINGS = ("mixed", "separated")
NAMES = AGGREGATION.parameter_names


@dataclass(frozen=True)
class SeparatedSizes(RunSizes):
    """How many runs and generations, with mixed and with separated groups."""

    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


def conduct(work: Work) -> Findings:
    """Conduct the studies, and test whether their errors differ."""
    sizes: SeparatedSizes = work.sizes
    captions, verdicts, errors, tables, pictures = Captions(ID), [], {}, [], []
    for preset in sizes.presets:
        both = {}
        for grouping in GROUPINGS:
            settings = {"scenario.grouping": grouping}
            result = work.runs(f"study-{grouping}-{preset}", AGGREGATION.name, preset, settings=settings)
            both[grouping] = Runs.of(result, preset, NAMES)
        for kind in KINDS:
            verdicts.append(separated_verdict(both, kind))
            frame = pd.DataFrame({"parameter": NAMES, "runs": sizes.runs})
            for name, runs in both.items():
                spreads = spreads_of(runs.errors[kind])
                frame = frame.join(spreads_frame(spreads, f"{name}_mean", f"{name}_standard_deviation"))
            tests = compare_columns(*(runs.errors[kind] for runs in both.values()))
            errors[preset, kind] = frame.assign(p_value=tests.p_values, significant=tests.significant)
        models = stacked({name: runs.models_frame() for name, runs in both.items()}, "grouping")
        tables.append(captions.table("{preset}-models", models, preset=preset))
        look: dict[str, Any] = {"titles": ("Mixed", "Separated"), "names": NAMES, "truth": AGGREGATION.controller}
        figure = box_panels_figure([runs.models["best_model"] for runs in both.values()], **look)
        pictures.append(captions.picture("{preset}-boxes", CLAIM, figure, preset=preset, runs=sizes.runs))
    summary = captions.table("absolute-errors", stacked(errors, "preset", "model"))
    return Findings(verdicts, [summary, *tables], pictures)


def separated_verdict(both: Mapping[str, Runs], kind: str) -> ClaimVerdict:
    """Test whether the errors of mixed and of separated runs differ, parameter by parameter."""
    tests = compare_columns(*(both[grouping].errors[kind] for grouping in GROUPINGS))
    texts = "; ".join(f"{name}: {listed(NAMES, spreads_of(runs.errors[kind]))}" for name, runs in both.items())
    agrees, observed = not tests.significant.any(), f"{texts}; p: {valued(NAMES, tests.p_values, '.2g')}"
    variant = variant_of(both["mixed"].preset, kind)
    return ClaimVerdict(CLAIM, agrees, PRINTED[CLAIM], observed, "separated", variant)


EXPERIMENT = Experiment.of(
    ID, conduct, full=SeparatedSizes(),
    fast=SeparatedSizes(runs=2, generations=8, presets=PRESETS[:1], settings=small(8, 8)),
)  # fmt: skip
