"""How the models of a study converge: medians over the runs, generation by generation."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.runs import stored_traces

from ._folder import StudyFolder
from ._plan import Plan
from ._table import StudyRun, members


@dataclass(frozen=True)
class Convergence:
    """Medians over the complete runs of one configuration.

    Attributes
    ----------
    group
        The settings of the configuration.
    best_model, typical_model : (G, P)
        Medians of the agents' parameters, of networks of their steady outputs.
    best_error, typical_error : (G, P)
        Medians of the absolute errors.
    best_mae, typical_mae : (G,)
        Medians of their means over the parameters.
    """

    group: dict[str, Any]
    best_model: np.ndarray
    typical_model: np.ndarray
    best_error: np.ndarray
    typical_error: np.ndarray
    best_mae: np.ndarray
    typical_mae: np.ndarray


def convergences(folder: StudyFolder, plan: Plan, runs: Iterable[StudyRun]) -> list[Convergence]:
    """Compute the medians of each configuration, from the runs that are complete."""
    found = (_convergence(folder, plan, group, own) for group, own in members(plan, runs))
    return [convergence for convergence in found if convergence is not None]


def _convergence(folder: StudyFolder, plan: Plan, group: dict[str, Any], own: list[StudyRun]) -> Convergence | None:
    described = plan.configuration(own[0].number).described
    traces = [(run, stored_traces(folder.run_path(run.number) / "checkpoints")) for run in own]
    usable = [(run, found) for run, found in traces if found is not None and run.result and run.result["truth"]]
    if not usable:
        return None
    truths = [np.array(list(run.result["truth"].values())) for run, _ in usable if run.result is not None]
    best = np.stack([described(found["best_model"]) for _, found in usable])
    typical = np.stack([described(found["typical_model"]) for _, found in usable])
    best_errors = np.stack([absolute_error(models, truth) for models, truth in zip(best, truths, strict=True)])
    typical_errors = np.stack([absolute_error(models, truth) for models, truth in zip(typical, truths, strict=True)])
    return Convergence(
        group,
        np.median(best, axis=0),
        np.median(typical, axis=0),
        np.median(best_errors, axis=0),
        np.median(typical_errors, axis=0),
        np.median(best_errors.mean(axis=-1), axis=0),
        np.median(typical_errors.mean(axis=-1), axis=0),
    )
