"""From what a run has stored of its generations or batches to its result; stored runs are opened
here."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.analysis import (
    UNKNOWN,
    Judgment,
    Verdict,
    absolute_error,
    classifiers_tell,
    estimate,
    interval,
    replace_unknown,
    settled,
)
from turing_learning.config import Configuration
from turing_learning.config.parts import give_again
from turing_learning.errors import refusing_as
from turing_learning.few_trials import LEAST_P, expressions
from turing_learning.store import RunFolderError
from turing_learning.systems import FailureLog

from ._folder import FINISHED, Checkpoint, RunFolder
from ._history import SELECTION_CODES, Traces
from ._paper import paper_absolute_errors
from ._record import READOUT, Record, stored_checkpoint, traces_of
from ._result import Evolution, Mode, Posterior, Result, named, result_from_json

FAILURES = "failures/"
"""Begin of the names of failed simulations, among the arrays of a checkpoint."""

COMPLETE = "complete"
"""Whether the run was complete, among the arrays of a checkpoint."""

LEAST_EXAMINED = 0.01
"""p-value of new samples of the estimate below which they differ from the genuine ones."""

_LAST_BATCHES = 10
"""Batches of trials whose classifiers say whether they tell the models."""
_TELLING_FITNESS = 0.75
"""Median fitness of these from which they do. In runs of right models it is at most 0.62."""
_FEWEST_OF_NETWORKS = 20
"""Fewest generations of networks whose halves can be compared."""
_OF_TRUTH = (
    "truth",
    "absolute_error",
    "estimate_absolute_error",
    "mae",
    "estimate_mae",
    "paper_absolute_error",
)

_LOGGER = logging.getLogger("turing_learning")


@dataclass(frozen=True)
class Ending:
    """How a run stands when its result is made.

    Attributes
    ----------
    seconds
        That it took in all sessions.
    complete
        Whether it has come to its end.
    spent
        Whether no generation or batch is left; the estimate of a run of trials may not be examined.
    readout
        What a run of trials has read off, see `few_trials`; empty before its end.
    failed_simulations
        See `Result`.
    """

    seconds: float
    complete: bool
    spent: bool
    readout: Mapping[str, np.ndarray]
    failed_simulations: dict[str, Any] | None = None


def summarize(traces: Traces, ending: Ending, record: Record) -> Result:
    """Return the result of the completed generations or batches, of which there is at least one."""
    if record.configuration.run.trials:
        return _posterior(traces, ending, record)
    return _evolution(traces, ending, record)


def _posterior(traces: Traces, ending: Ending, record: Record) -> Posterior:
    configuration = record.configuration
    names = configuration.scenario.parameter_names
    window = configuration.run.estimated_from(traces.completed)
    typical = configuration.described(traces["typical_model"][-window:])
    doubt = _doubt(traces, ending.readout)
    if ending.spent and not ending.complete:
        doubt = Verdict.UNEXAMINED
    # what is doubtful states no interval
    readout = {} if doubt else ending.readout
    inferred = readout.get("estimate", typical[-1])
    covariance = None
    modes: tuple[Mode, ...] = ()
    not_identified: tuple[str, ...] = ()
    ridge: tuple[str, ...] = ()
    if "interval" in readout:
        low, high = readout["interval"]
        covariance = _covariance(names, readout["draws"])
        modes = modes_of(names, readout)
        # runs of 0.2.0 do not say
        identified = readout.get("identified", np.ones(len(names), dtype=bool))
        not_identified = tuple(np.array(names)[~identified].tolist())
        if "ridge" in readout:
            ridge = expressions(readout["ridge"], bool(readout["ridge_logarithmic"]), names)
    else:
        low, high = np.full((2, len(names)), np.nan)
        doubt = doubt or Verdict.MOVING
    verdicts = [] if doubt is None else [doubt]
    if len(modes) > 1:
        verdicts.append(Verdict.SEVERAL)
        # a mean of several solutions would be none of them
        inferred = np.array(list(modes[0].estimate.values()))
        bounds = np.array([list(mode.interval.values()) for mode in modes])
        low = np.minimum(low, bounds[:, :, 0].min(axis=0))
        high = np.maximum(high, bounds[:, :, 1].max(axis=0))
    if not_identified:
        verdicts.append(Verdict.UNIDENTIFIED)
    if readout.get("told_by_panel", False):
        # intervals stay: they are about the best model of its kind
        verdicts.append(Verdict.DIFFERENT)
    between = dict(zip(names, np.stack((low, high), axis=1).tolist(), strict=True))
    return Posterior(
        interval=replace_unknown(UNKNOWN, between),
        covariance=covariance,
        modes=modes,
        not_identified=not_identified,
        ridge=ridge,
        trials=configuration.trials_after(traces.completed),
        **_common(traces, ending, record, inferred, typical, verdicts),
    )


def _doubt(traces: Traces, readout: Mapping[str, np.ndarray]) -> Verdict | None:
    """Return what speaks against the estimate of a run of trials, if anything does."""
    if readout.get("told_by_phases", False):
        return Verdict.PHASES
    fitness = traces["classifier_fitness_quantiles"][:, 2]
    p_value = float(readout.get("p_value", 1.0))
    if p_value < LEAST_P or classifiers_tell(fitness, _LAST_BATCHES, above=_TELLING_FITNESS):
        return Verdict.TOLD
    examined = 1.0
    if "examined" in readout:
        examined = float(readout["examined"][0])
    if examined < LEAST_EXAMINED:
        return Verdict.DIFFERENT
    return None


def _covariance(names: tuple[str, ...], draws: np.ndarray) -> dict[str, dict[str, float]]:
    rows = np.atleast_2d(np.cov(draws.T))
    return {name: named(names, row) for name, row in zip(names, rows, strict=True)}


def _evolution(traces: Traces, ending: Ending, record: Record) -> Evolution:
    configuration = record.configuration
    names = configuration.scenario.parameter_names
    window = configuration.run.estimated_from(traces.completed)
    typical = configuration.described(traces["typical_model"][-window:])
    pairs = configuration.system.on_scales(typical, partial(interval, window=window))
    wandering = replace_unknown(UNKNOWN, dict(zip(names, pairs.tolist(), strict=True)))
    verdicts = _said(configuration, traces, window)
    trials = configuration.trials_after(traces.completed)
    if record.folder is not None and record.folder.laboratory_path.exists():
        # Each executes a model of its own
        trials //= configuration.swarm.replicas
    return Evolution(
        interval=dict.fromkeys(names, [UNKNOWN] * 2) if verdicts else wandering,
        wandering=wandering,
        trials=trials,
        **_common(traces, ending, record, estimate(typical, window), typical, verdicts),
    )


def _common(
    traces: Traces,
    ending: Ending,
    record: Record,
    inferred: np.ndarray,
    typical: np.ndarray,
    verdicts: list[Verdict],
) -> dict[str, Any]:
    """Return what all results hold.

    `inferred` (P,) is the estimate, `typical` (W, P) are models beside it.
    """
    configuration = record.configuration
    names = configuration.scenario.parameter_names
    best = configuration.described(traces["best_model"][-1])
    networks = None
    if configuration.models.hidden:
        # the best network, and that typical one whose outputs are nearest to those inferred
        nearest = np.argmin(np.abs(typical - inferred).sum(axis=1))
        weights = traces["typical_model"][-len(typical) :][nearest]
        networks = {
            "best_model": named(configuration.parameter_names, traces["best_model"][-1]),
            "estimate": named(configuration.parameter_names, weights),
        }
    else:
        parameters = configuration.system.parameters.values()
        for parameter, value in zip(parameters, inferred.tolist(), strict=True):
            if parameter.bound_at(value):
                verdicts = [*verdicts, Verdict.BOUND]
    return {
        "scenario": configuration.scenario.name,
        "generations": traces.completed,
        "seed": configuration.run.seed,
        "complete": ending.complete,
        "best_model": named(names, best),
        "estimate": named(names, inferred),
        **_compared(configuration, best, inferred),
        "selection_stopped": int(
            np.count_nonzero(traces["selection"] != SELECTION_CODES["active"])
        ),
        "seconds_total": ending.seconds,
        "seconds_per_generation": float(np.median(traces["seconds"])),
        "path": record.path,
        "record": record,
        "failed_simulations": ending.failed_simulations,
        "networks": networks,
        "found": Judgment(tuple(verdicts)).verdicts,
    }


def modes_of(names: tuple[str, ...], readout: Mapping[str, np.ndarray]) -> tuple[Mode, ...]:
    """Return the solutions of a run of trials, that of most draws first; none where it has none."""
    if "mode" not in readout:
        return ()
    draws = readout["draws"]
    numbers = readout["mode"]
    modes = []
    for number in range(int(numbers.max()) + 1):
        members = draws[numbers == number]
        # runs of 0.2.0 do not say
        bounds = np.quantile(members, (0.05, 0.95), axis=0)
        if "mode_interval" in readout:
            bounds = readout["mode_interval"][number]
        estimate = np.median(members, axis=0)
        # medians alone are beside a ridge, which is one solution
        if "ridge" in readout:
            estimate = readout["estimate"]
        modes.append(
            Mode(
                weight=float(len(members) / len(draws)),
                estimate=named(names, estimate),
                interval=dict(zip(names, bounds.T.tolist(), strict=True)),
            )
        )
    return tuple(modes)


def _said(configuration: Configuration, traces: Traces, window: int) -> list[Verdict]:
    """Return what speaks against a run of generations by itself.

    That classifiers tell its models counts once the models have settled.
    """
    # without a spread of the first models there is none to compare with
    without_spread = configuration.models.start == "middle"
    spreads = traces["model_spread"][int(without_spread) :]
    networks = bool(configuration.models.hidden)
    if networks and min(window, traces.completed) < _FEWEST_OF_NETWORKS:
        return [Verdict.MOVING]
    # the spread of weights says nothing
    usable = not networks and bool(np.isfinite(spreads).all())
    typical = configuration.described(traces["typical_model"])
    if not settled(typical, window, spreads if usable else None).all():
        return [Verdict.MOVING]
    fitness = traces["classifier_fitness_quantiles"][:, 2]
    if classifiers_tell(fitness, window):
        return [Verdict.TOLD]
    return []


def _compared(
    configuration: Configuration, best: np.ndarray, inferred: np.ndarray
) -> dict[str, Any]:
    """Return what a result says of the truth, where there is one."""
    scenario = configuration.scenario
    if scenario.truth is None:
        return dict.fromkeys(_OF_TRUTH)
    names = scenario.parameter_names
    truth = np.asarray(scenario.truth, dtype=float)
    error = absolute_error(best, truth)
    estimate_error = absolute_error(inferred, truth)
    simulated = configuration.system.simulated
    papers = None
    if simulated and not configuration.models.hidden:
        papers = paper_absolute_errors(simulated)
    return {
        "truth": named(names, truth),
        "absolute_error": named(names, error),
        "estimate_absolute_error": named(names, estimate_error),
        "mae": float(error.mean()),
        "estimate_mae": float(estimate_error.mean()),
        "paper_absolute_error": papers,
    }


# Runs that are stored


def load_run(path: str | Path, *, models: Any = None, classifier: Any = None) -> Result:
    """Open a run that is finished, stopped, killed, or still running.

    Parameters
    ----------
    path
        The run folder.
    models, classifier
        The objects that the run began with, where no other process can import them; checks and
        detectors need the classifier.

    Returns
    -------
    Result
        What was inferred up to the last checkpoint: a `Posterior` or an `Evolution`.
    """
    folder = RunFolder(path)
    give_parts(folder, models, classifier)
    configuration = folder.configuration()
    result = stored_result(folder, configuration)
    if result is not None:
        return result
    checkpoint = stored_checkpoint(folder, configuration)
    result = result_of(checkpoint, folder, configuration)
    if folder.manifest()["state"] == FINISHED:
        text = "%s is damaged; the result is made again from the last checkpoint."
        _LOGGER.warning(text, folder.result_path)
    return result


def give_parts(folder: RunFolder, models: Any, classifier: Any) -> None:
    """Take optimizer and classifier that a stored run began with, as they are given again."""
    if models is not None or classifier is not None:
        configuration = folder.configuration()
        with refusing_as(RunFolderError):
            give_again("models", configuration.models.optimizer, models)
            give_again("classifier", configuration.classifiers.network, classifier)


def stored_result(folder: RunFolder, configuration: Configuration) -> Result | None:
    """Return the result of a finished run.

    None of one that is not, or if it is missing or damaged.
    """
    if folder.manifest()["state"] != FINISHED:
        return None
    try:
        content = folder.read("result.json")
        return result_from_json(content, Record.of(folder, configuration, content["generations"]))
    except (RunFolderError, ValueError, KeyError, TypeError, AttributeError):
        return None


def remade_result(folder: RunFolder, configuration: Configuration) -> Result | None:
    """Make the result of a finished run again, whose file is damaged or missing; the caller holds the lock.

    None of a run that is not finished, or without a usable checkpoint.
    """
    if folder.manifest()["state"] != FINISHED:
        return None
    checkpoint = folder.checkpoint()
    if checkpoint is None:
        return None
    if folder.result_path.exists():
        aside = folder.set_aside("result.json").name
        text = "%s is damaged; it is made again. The damaged file is %s."
        _LOGGER.warning(text, folder.result_path, aside)
    result = result_of(checkpoint, folder, configuration)
    folder.write("result.json", result.to_json())
    return result


def result_of(checkpoint: Checkpoint, folder: RunFolder, configuration: Configuration) -> Result:
    """Return the result of a run up to a checkpoint."""
    traces = traces_of(checkpoint, folder, configuration)
    failures = checkpoint.part(FAILURES)
    failed = None
    if failures:
        log = FailureLog(configuration.parameter_names)
        log.restore(failures)
        failed = log.summary()
    # of a run of trials the estimate may not be examined yet
    examined = bool(checkpoint.arrays.get(COMPLETE, True))
    spent = checkpoint.generation == configuration.length
    complete = spent and examined
    tolerated = checkpoint.arrays.get("coevolution/tolerated", False)
    if not spent and (checkpoint.arrays.get(COMPLETE) or tolerated):
        # it has stopped early, unless it was given more trials since
        trials = configuration.trials_after(checkpoint.generation)
        spent = trials not in configuration.run.earlier
        complete = spent and examined
    seconds = float(checkpoint.arrays["seconds"])
    ending = Ending(seconds, complete, spent, checkpoint.part(READOUT), failed)
    return summarize(traces, ending, Record.of(folder, configuration, traces.completed))
