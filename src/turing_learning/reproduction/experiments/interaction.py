"""Footnote 1 of section 3.1: classifiers that choose stimuli, against classifiers that only watch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.figures._many_runs import error_groups_figure
from turing_learning.interaction import STIMULATED

from .._experiment import Captions, Experiment, Findings, stacked
from .._work import Work
from ._shared import Runs, compare_columns, small

ID = "interaction"
FORMS: dict[str, dict[str, Any]] = {
    "interactive": {"scenario.opponents": 10},
    "random": {"scenario.opponents": 12, "scenario.stimulus.passive": "random"},
    "constant": {"scenario.opponents": 12, "scenario.stimulus.passive": "constant"},
}
"""Form -> settings; 12 trials of each model where classifiers watch are as many as interrogators and their archive cause."""
KIND = "estimate"


@dataclass(frozen=True)
class InteractionSizes:
    """How many runs of each form, in which systems and for how many generations, by how many models and classifiers."""

    runs: int = 30
    first_seed: int = 2001
    systems: Mapping[str, int] = field(default_factory=lambda: {"light-response": 250, "sensor-configuration": 50})
    settings: Mapping[str, Any] = field(default_factory=lambda: small(50, 50))


def conduct(work: Work) -> Findings:
    """Conduct the studies, and test whether those that interact have other errors than those that watch."""
    captions, tables, pictures, remarks, tests = Captions(ID), [], [], [], {}
    sizes: InteractionSizes = work.sizes
    for name, generations in sizes.systems.items():
        system, found = STIMULATED[name], {}
        for form, settings in FORMS.items():
            how = {"generations": generations, "settings": {**sizes.settings, **settings}, "runs": sizes.runs}
            result = work.study(f"{name}-{form}", name, first_seed=sizes.first_seed, **how)
            found[form] = Runs.of(result, "default", system.parameter_names)
        tests[name], remark = _compared(name, found)
        remarks.append(remark)
        models = stacked({form: runs.models_frame() for form, runs in found.items()}, "form")
        words: dict[str, Any] = {"system": system, "runs": sizes.runs}
        tables.append(captions.table("{system.name}-models", models, **words))
        spans = np.array([each.high - each.low for each in system.parameters.values()])  # type: ignore[operator]
        shares = {form: runs.errors[KIND] / spans for form, runs in found.items()}
        figure = error_groups_figure(shares, names=system.parameter_names)
        pictures.append(captions.picture("{system.name}-errors", "", figure, **words))
    summary = captions.table("errors", stacked(tests, "system"), True)
    return Findings([], [summary, *tables], pictures, remarks)


def _compared(name: str, found: Mapping[str, Runs]) -> tuple[pd.DataFrame, str]:
    """Return the median errors of all forms with the tests, parameter by parameter, and a sentence about them."""
    interactive, names = found["interactive"].errors[KIND], STIMULATED[name].parameter_names
    frame, better = pd.DataFrame({"parameter": names}), []
    for form, runs in found.items():
        frame[f"{form}_median"] = np.median(runs.errors[KIND], axis=0)
        if form != "interactive":
            frame[f"{form}_p_value"] = compare_columns(interactive, runs.errors[KIND]).p_values
    for row in frame.to_dict("records"):
        passive = [form for form in found if form != "interactive"]
        if all(row["interactive_median"] < row[f"{f}_median"] and row[f"{f}_p_value"] < 0.01 for f in passive):
            better.append(row["parameter"])
    said = ", ".join(better) if better else "no parameter"
    return frame, (
        f"{STIMULATED[name].title}: interaction has smaller errors than both passive forms (Mann-Whitney, p < 0.01 each) in {said}."
    )


_FAST = InteractionSizes(runs=2, systems={"light-response": 4, "sensor-configuration": 4}, settings=small(8, 4))
EXPERIMENT = Experiment.of(ID, conduct, full=InteractionSizes(), fast=_FAST)
