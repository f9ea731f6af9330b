"""Section 4.6.1: the field of view of the agents' sensor is inferred together with their controller."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from turing_learning.figures import box_figure
from turing_learning.swarm import AGGREGATION_VIEW_0, AGGREGATION_VIEW_60

from .._experiment import Captions, Experiment, Findings, stacked
from .._verdicts import REASONS, ClaimVerdict, errors_verdict, listed, spreads_of
from .._work import Work
from ._shared import KINDS, PRESETS, Runs, small, variant_of

ID = "4.6.1"
CASES = {"4.6.1-morphology-0": AGGREGATION_VIEW_0, "4.6.1-morphology-60": AGGREGATION_VIEW_60}  # claim -> scenario
OFF = 0.1  # mean absolute error above which a run is off


@dataclass(frozen=True)
class MorphologySizes:
    """How many runs, `beside` of them with the preset that stands beside the verdict, and generations."""

    runs: int = 30
    beside: int = 10
    generations: int = 1000
    first_seed: int = 2001
    presets: tuple[str, ...] = PRESETS
    settings: Mapping[str, Any] = field(default_factory=dict)


def conduct(work: Work) -> Findings:
    """Conduct a study for each field of view and preset."""
    sizes: MorphologySizes = work.sizes
    captions, verdicts, errors, tables, pictures = Captions(ID), [], {}, [], []
    for preset in sizes.presets:
        for claim, scenario in CASES.items():
            number = sizes.runs if preset == PRESETS[0] else sizes.beside
            result = work.runs(f"study-{scenario.name}-{preset}", scenario.name, preset, runs=number)
            runs = Runs.of(result, preset, scenario.parameter_names)
            verdicts += [morphology_verdict(claim, runs, kind) for kind in KINDS]
            errors[scenario.name, preset] = runs.errors_frame(claim)
            words = {"scenario": scenario, "preset": preset, "runs": number}
            tables.append(captions.table("{scenario.name}-{preset}-models", runs.models_frame(), **words))
            figure = box_figure(runs.models["best_model"], names=scenario.parameter_labels, truth=scenario.truth)
            pictures.append(captions.picture("{scenario.name}-{preset}-boxes", claim, figure, **words))
    summary = captions.table("absolute-errors", stacked(errors, "scenario", "preset"))
    return Findings(verdicts, [summary, *tables], pictures)


def morphology_verdict(claim: str, runs: Runs, kind: str) -> ClaimVerdict:
    """Hold the errors against a claim; name the runs that are off, which a mean hides, and those that mistook a reading."""
    names, truth, errors = CASES[claim].parameter_labels, np.array(CASES[claim].controller), runs.errors[kind]

    def seeds(chosen: np.ndarray) -> str:
        return ", ".join(str(runs.seeds[k]) for k in np.flatnonzero(chosen))

    off = runs.maes(kind) > OFF
    text = f"; the mean error is at most {OFF} in every run"
    if off.any():
        text = f"; the mean error exceeds {OFF} in {np.count_nonzero(off)} of {len(off)} runs (seeds {seeds(off)})"
        if not off.all():
            text += f", without them {listed(names, spreads_of(errors[~off]))}"
    speeds = runs.models[kind][:, : len(truth)]
    mirrored = np.abs(speeds - np.roll(truth, 2)).sum(axis=1) < np.abs(speeds - truth).sum(axis=1)
    strayed = {"mirrored": off & mirrored, "strayed": off & ~mirrored & (errors[:, -1] > math.pi / 2)}
    reasons = [
        f"{REASONS[f'4.6.1-{what}']} (seeds {seeds(chosen)})" for what, chosen in strayed.items() if chosen.any()
    ]
    reason = f"{'; '.join(reasons)}; docs/decisions/0016" if reasons else ""
    return errors_verdict(claim, errors, names, variant_of(runs.preset, kind), observed_also=text, reason=reason)


EXPERIMENT = Experiment.of(
    ID, conduct, full=MorphologySizes(), fast=MorphologySizes(runs=2, beside=2, generations=6, settings=small(6, 6))
)
