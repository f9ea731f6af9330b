"""Robots that infer their own sensors, with the settings of the group's public code."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import Comparison
from turing_learning.config import Configuration, load_configuration
from turing_learning.figures.many_runs import error_groups_figure
from turing_learning.interaction import STIMULATED, StimulatedSystem

from .._experiment import Findings, Work, compare_columns, seeded, seeds_of, stacked

INTERACTIVE = "interactive"
PASSIVE = ("own", "random")
"""Forms: classifiers drive the robot, watch what it does by its own controller, or under commands by chance."""
READOUTS = {"best_model": "subjectively best, last generation", "estimate": "estimate"}
HISTORIES: dict[str, dict[str, tuple[tuple[float, ...], ...]]] = {
    "rangefinder-response": {
        INTERACTIVE: (
            (1.96631, 1.00014),
            (2.14796, 1.04811),
            (2.10988, 0.998256),
            (2.05121, 0.990553),
            (1.98344, 0.995047),
            (1.82424, 1.00416),
        ),
        "own": (
            (1.92481, 0.964784),
            (-0.863877, 0.187374),
            (2.1983, 1.00125),
            (0.293951, 1.074),
            (-0.939214, 1.1847),
            (1.93013, 0.998548),
            (0.210389, 1.1197),
        ),
    }
}
"""System -> form -> subjectively best models of the last generation of the runs whose histories are
published.

Source: repository wawachen/Turing_learning, 2019: of TL_interactive/data/model round1_normal, round2
and round2_2 to round2_5; of TL_passive/data/model 1, 2, 8880 and zz2 to zz5. Other files of these
folders are copies."""


def conduct(work: Work, findings: Findings) -> None:
    """Conduct the runs of each system, and test whether those that interact have other errors."""
    medians = {}
    for name, sizes in work.sizes["systems"].items():
        system = STIMULATED[name]
        models = _models(work, system)
        errors = {}
        for form, inferred in models.items():
            errors[form] = {readout: _errors(system, inferred[readout]) for readout in READOUTS}
        frames = {label: _tests(system, errors, readout) for readout, label in READOUTS.items()}
        if name in HISTORIES:
            published = {}
            for form, values in HISTORIES[name].items():
                published[form] = {"best_model": _errors(system, np.array(values))}
            frames["published histories"] = _tests(system, published, "best_model")
        medians[name] = stacked(frames, "models")
        findings.remarks.append(_remark(system, frames))
        seeds = tuple(seeds_of(work.sizes | sizes))
        rows = {}
        for form, inferred in models.items():
            for readout in READOUTS:
                rows[form, readout] = seeded(seeds, inferred[readout], system.parameter_names)
        findings.table("{system.name}-models", stacked(rows, "form", "model"), system=system)
        parameters = system.parameters.values()
        spans = np.array([parameter.high - parameter.low for parameter in parameters])  # type: ignore[operator]
        relative = {form: of_form["best_model"] / spans for form, of_form in errors.items()}
        figure = error_groups_figure(relative, names=system.parameter_names)
        findings.picture("{system.name}-errors", "", figure, system=system, runs=sizes["runs"])
    findings.table("errors", stacked(medians, "system"), True)


def _models(work: Work, system: StimulatedSystem) -> dict[str, dict[str, np.ndarray]]:
    """Return form -> readout -> models (R, P); a run is a piece of work, and those of a seed come together."""
    sizes = work.sizes["systems"][system.name]
    runs: dict[str, list[dict[str, Any]]] = {form: [] for form in (INTERACTIVE, *PASSIVE)}
    for seed in seeds_of(work.sizes | sizes):
        for form in runs:
            configuration = configuration_of(work, system, form, seed)
            name = f"{system.name}-seed{seed}-{form}"
            runs[form].append(work.piece(name, partial(_inferred, work, configuration)))
    models = {}
    for form, of_form in runs.items():
        models[form] = {
            readout: np.array([run[readout] for run in of_form]) for readout in READOUTS
        }
    return models


def configuration_of(work: Work, system: StimulatedSystem, form: str, seed: int) -> Configuration:
    """Return the configuration of a run.

    Classifiers that watch under commands by chance see these: without them, directions of sensors
    could not be known.
    """
    sizes = work.sizes["systems"][system.name]
    settings: dict[str, Any] = {
        **sizes["settings"],
        "scenario.opponents": sizes["opponents"],
        "run.generations": sizes["generations"],
        "run.seed": seed,
        "run.history": "thin",
        "run.threads": 1,
    }
    if form in PASSIVE:
        settings["scenario.stimulus.passive"] = form
    if form == "random":
        wheels = system.stimulus.names
        settings |= {
            "scenario.stimulus.shown": True,
            "scenario.signals": [*system.signals, *wheels],
            "scenario.center": [*system.center, *system.stimulus.center.tolist()],
            "scenario.input_scale": [*system.input_scale, *[1.0] * len(wheels)],
        }
    return load_configuration(None, "authors", settings, scenario=system.name)


def _inferred(work: Work, configuration: Configuration) -> dict[str, Any] | None:
    from turing_learning.runs import infer

    result = infer(config=configuration, should_stop=work.should_stop)
    if not result.complete:
        return None
    return {readout: list(getattr(result, readout).values()) for readout in READOUTS}


def _errors(system: StimulatedSystem, models: np.ndarray) -> np.ndarray:
    """Return absolute errors of models (R, P); those of angles around the circle."""
    errors = np.abs(models - np.array(system.true))
    for k, parameter in enumerate(system.parameters.values()):
        if parameter.unit == "rad":
            errors[:, k] = np.minimum(errors[:, k], 2 * np.pi - errors[:, k])
    return errors


def _grouped(system: StimulatedSystem, errors: np.ndarray) -> pd.DataFrame:
    """Return mean errors (R, G) of parameters whose names differ by their number alone."""
    groups = [name.rstrip("0123456789") for name in system.parameter_names]
    frame = pd.DataFrame(errors).T.groupby(groups, sort=False).mean()
    return frame.T


def _tests(
    system: StimulatedSystem, errors: dict[str, dict[str, np.ndarray]], readout: str
) -> pd.DataFrame:
    """Return runs and median errors of each form, and tests of the interactive one against the others.

    An error is the mean of a run over all angles, or displacements, that it infers. "smaller" says
    whether those of the interactive form are significantly smaller, with Bonferroni's correction
    for all tests.
    """
    grouped = {form: _grouped(system, of_form[readout]) for form, of_form in errors.items()}
    interactive = grouped.pop(INTERACTIVE)
    frame = pd.DataFrame({"error": interactive.columns})
    frame["interactive_runs"] = len(interactive)
    frame["interactive_median"] = interactive.median().to_numpy()
    tests = {}
    for form, values in grouped.items():
        tests[form] = compare_columns(interactive.to_numpy(), values.to_numpy())
    p_values = np.concatenate([test.p_values for test in tests.values()])
    level = next(iter(tests.values())).level
    significant = Comparison(p_values, level).significant.reshape(len(grouped), -1)
    for k, (form, values) in enumerate(grouped.items()):
        medians = values.median().to_numpy()
        frame[f"{form}_runs"] = len(values)
        frame[f"{form}_median"] = medians
        frame[f"{form}_p_value"] = tests[form].p_values
        smaller = significant[k] & (frame["interactive_median"] < medians)
        frame[f"smaller_than_{form}"] = np.where(smaller, "yes", "no")
    return frame


def _remark(system: StimulatedSystem, frames: dict[str, pd.DataFrame]) -> str:
    """Say which errors are significantly smaller with interaction, of each kind of models."""
    sentences = []
    for label, frame in frames.items():
        for form in PASSIVE:
            if f"smaller_than_{form}" in frame:
                names = frame["error"][frame[f"smaller_than_{form}"] == "yes"]
                sentences.append(f"{label}, than `{form}`: {', '.join(names) or 'none'}")
    return (
        f"{system.title}, errors that are significantly smaller with interaction "
        f"(Mann-Whitney, Bonferroni): {'; '.join(sentences)}."
    )
