"""Figures and report of a run: hand the arrays to the rooms that draw."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning import report
from turing_learning.analysis import is_known, mean_absolute_error
from turing_learning.config import Configuration, to_toml
from turing_learning.figures import Picture
from turing_learning.figures._classifiers import Distribution, ParameterProfile, profiles_figure, quantities_figure
from turing_learning.figures._one_run import (
    dialogues_figure,
    error_figure,
    fitness_figure,
    parameters_figure,
    step_sizes_figure,
)
from turing_learning.purposes import REPLAY
from turing_learning.report._content import Listing, ParameterRow, RunReport, RunTable
from turing_learning.report._page import report_page
from turing_learning.swarm import Scenario, execution_of, initial_poses, simulate
from turing_learning.swarm._trials import Execution

from ._history import SELECTION_CODES
from ._paper import SOURCE
from ._result import Result

if TYPE_CHECKING:
    import xarray

    from turing_learning.identifiability import Check, Quantity

CITATION = (
    "W. Li, M. Gauci, R. Groß: Turing learning. Swarm Intelligence 10 (2016) 211-243, doi:10.1007/s11721-016-0126-1"
)
REPLAY_DURATION_S = 180.0
FRAMES_PER_S = 5.0
LARGEST_SPEED = 100.0  # of a replica in a replay, in maximum speeds: beyond it nothing can be seen


def write_report(
    result: Result,
    target: Path,
    manifest: list[tuple[str, str]],
    *,
    check: "Check | None" = None,
    figures: Path | None = None,
    motion: Mapping[str, np.ndarray] = MappingProxyType({}),
    dialogues: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> Path:
    """Write the page of a run, and its figures to a folder, if there is one; `motion` is as of `Source.positions`."""
    # without the populations, which no page shows and which are half of a history
    history = result.history.drop_vars(["model", "classifier"], errors="ignore").load()
    configuration, simulated = result.configuration, result.configuration.system.simulated is not None
    words = {code: word for word, code in SELECTION_CODES.items()}
    pictures = draw(history, configuration, dialogues)
    if figures is not None:
        save_figures(pictures, figures)
    page = RunReport(
        title=f"{configuration.scenario.title}: what Turing Learning inferred",
        summary=summary(result),
        verdicts=result.verdicts,
        facts=facts(result, dict(manifest)),
        steps=next_steps(result),
        data=tables(result, history, configuration),
        table=run_table(result),
        selection=[words[int(code)] for code in history["selection"].to_numpy()],
        figures=tuple(pictures),
        configuration=to_toml(configuration),
        manifest=manifest,
        replay=replay(configuration, simulated_model(result)) if simulated else recorded_replay(motion),
        check=None if check is None else check_listing(check),
        check_figures=() if check is None else tuple(draw_check(check, result)),
    )
    return report.write_page(report_page(page), target)


def save_figures(pictures: list[Picture], folder: Path) -> None:
    """Write every figure as PNG and SVG."""
    folder.mkdir(exist_ok=True)
    for picture in pictures:
        picture.save(folder)


def draw(history: "xarray.Dataset", configuration: Configuration, dialogues: Mapping[str, np.ndarray]) -> list[Picture]:
    """Draw the figures of a run, of its history, and of what its classifiers did to the system."""
    scenario, trials = configuration.scenario, configuration.spent(history.sizes["generation"])
    best, typical = (configuration.described(history[name].to_numpy()) for name in ("best_model", "typical_model"))
    over, middle, models = "generations", "the typical one", "Subjectively best and typical model of each generation"
    fitness = "Subjective fitness of both populations: median and quartiles. Selection has stopped where it is shaded."
    if trials is not None:
        over, middle = "trials", "the estimate so far"
        models = "Best model of each batch of trials, and the estimate after it"
        fitness = "Fitness of the models tried in each batch, and of the classifiers: median and quartiles."
    models += ", steady outputs of the networks" if configuration.models.hidden else ""
    models += "." if scenario.truth is None else "; the truth is dashed."
    drawn = parameters_figure(best, typical, names=scenario.parameter_labels, truth=scenario.truth, trials=trials)
    pictures = [Picture("parameters", f"Parameters over {over}", models, drawn, wide=True)]
    if scenario.truth is not None:
        errors = [mean_absolute_error(each, np.asarray(scenario.truth, dtype=float)) for each in (best, typical)]
        caption = f"Mean over the parameters, of the best model and of {middle}."
        drawn = error_figure(*errors, trials=trials)
        pictures.append(Picture("error", f"Mean absolute error over {over}", caption, drawn))
    if dialogues:
        pictures.append(_dialogues(dialogues, configuration))
    populations = [fitness_of(history, name) for name in ("model", "classifier")]
    drawn = fitness_figure(*populations, stopped=stopped_in(history), trials=trials)
    pictures.append(Picture("fitness", f"Fitness over {over}", fitness, drawn))
    if "model_step_size" in history and trials is None:
        pictures.append(_step_sizes(history, configuration))
    return pictures


def _dialogues(dialogues: Mapping[str, np.ndarray], configuration: Configuration) -> Picture:
    system, chosen = configuration.system, "outputs" in dialogues
    caption = "Classifiers only watched: one trial of the system and one of the estimate under the same stimulus."
    if chosen:
        caption = (
            "For each parameter the classifier, of the fittest of 50 generations, that tells the system best from "
            "models in which this parameter is drawn anew: the stimulus that it chose, and the answer, in a trial with "
            "the system and in one with the estimate. An output of 0.5 or more says genuine."
        )
    rows = tuple(system.parameters)
    drawn = dialogues_figure(dialogues, names=system.signals, rows=rows, interval_s=system.interval_s)
    return Picture("stimuli", "Stimulus and answer", caption, drawn, wide=True)


def fitness_of(history: "xarray.Dataset", population: str) -> np.ndarray:
    """Return the fitness of all individuals, or of a thin history the quantiles, which have the same quartiles."""
    name = f"{population}_fitness"
    return history[name if name in history else f"{name}_quantiles"].to_numpy()


def stopped_in(history: "xarray.Dataset") -> np.ndarray:
    """Return in which generations selection stopped (G,)."""
    return history["selection"].to_numpy() != SELECTION_CODES["active"]


def _step_sizes(history: "xarray.Dataset", configuration: Configuration) -> Picture:
    names, caption = configuration.scenario.parameter_names, "Median mutation strength of each parameter"
    caption += configuration.system.step_unit
    models, classifiers = (history[f"{of}_step_size"].to_numpy() for of in ("model", "classifier"))
    sizes = np.median(models, axis=1)
    if configuration.models.hidden:
        names, caption = ("models",), "Median mutation strength of the models' weights"
        sizes = np.median(models.reshape(len(models), -1), axis=1)[:, None]
    weights = np.median(classifiers.reshape(len(classifiers), -1), axis=1).astype(float)
    drawn = step_sizes_figure(sizes, weights, names=names)
    return Picture("step-sizes", "Step sizes over generations", f"{caption}, and of the classifiers' weights.", drawn)


def simulated_model(result: Result) -> np.ndarray:
    """Return what is simulated (P,): the estimate, or the weights of the network that comes nearest to it."""
    return np.array(list((result.networks or {"estimate": result.estimate})["estimate"].values()))


def summary(result: Result) -> str:
    """Say the result in one sentence, and how many simulations failed."""
    done = f"After {result.length}{'' if result.complete else ' (the run is not complete)'} the estimate"
    if result.estimate_mae is not None:
        return f"{done} differs from the truth by {result.estimate_mae:.4f} in the mean over all parameters."
    count = 0 if result.failed_simulations is None else result.failed_simulations["count"]
    failed = f" {report.counted(count, 'simulation')} failed; result.json says which." if count else ""
    return f"{done} stands; there is no truth to compare it with.{failed}"


def facts(result: Result, manifest: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what belongs at the top of a page: seed, date, versions, how to run it again, and what to cite."""
    again = f"see {'recording in Manifest' if 'recording' in manifest else 'Configuration'}, below"
    if result.path is not None and result.configuration.system.simulated is not None and not result.in_laboratory:
        again = "turing-learning infer --config RUN/config.toml --out AGAIN"
    begun = manifest.get("started", "unknown").replace("T", " ").replace("+00:00", " UTC")
    return [("Seed", str(result.seed)), ("Begun", begun), ("Run again", again), ("Cite", CITATION)]


def next_steps(result: Result) -> list[tuple[str, str]]:
    """Return commands to go on with, and what they are for."""
    if result.path is None or result.in_laboratory:
        return []
    tells = "Can fresh classifiers tell the model from the system? What is pinned down? (RUN: the folder of this page.)"
    agree = "Do runs with other seeds agree? Make one or more, and pool them."
    return [("turing-learning check RUN", tells), ("turing-learning pool RUN ANOTHER-SEED", agree)]


def tables(result: Result, history: "xarray.Dataset", configuration: Configuration) -> dict[str, str]:
    """Return the table of the parameters, and the models of each generation, or after so many trials, as CSV."""
    kinds = ("typical_model", "best_model")
    rows = np.hstack([configuration.described(history[name].to_numpy()) for name in kinds])
    spent, word, name = configuration.spent(len(rows)), "trials", "trials.csv"
    if spent is None:
        spent, word, name = np.arange(len(rows)), "generation", "generations.csv"
    lines = [",".join([word, *(f"{of}_{each}" for of in kinds for each in configuration.scenario.parameter_names)])]
    lines += [f"{k},{','.join(f'{x:.7g}' for x in row)}" for k, row in zip(spent, rows, strict=True)]
    return {"parameters.csv": result.to_dataframe().to_csv(), name: "\n".join(lines) + "\n"}


def run_table(result: Result) -> RunTable:
    """Return the table inferred / true / absolute error / the paper's figure."""
    none: dict[str, float] = {}
    rows = tuple(
        ParameterRow(
            name=label,
            estimate=result.estimate[name],
            best_model=result.best_model[name],
            truth=(result.truth or none).get(name),
            estimate_error=(result.estimate_absolute_error or none).get(name),
            best_model_error=(result.absolute_error or none).get(name),
            published_error=(result.paper_absolute_error or none).get(name),
            interval=(result.interval[name][0], result.interval[name][1]),
        )
        for name, label in result.labels.items()
    )
    note = f"Paper's error: {SOURCE}, of the best model." if result.paper_absolute_error else ""
    if result.networks:
        note = "Outputs of the networks after 20 steps of each constant sensor reading."
    note = f"{note} {result.unknown}".strip()
    return RunTable(rows, result.estimate_mae, result.mae, note)


def replay(configuration: Configuration, estimate: np.ndarray) -> report.Replay:
    """Let a swarm of agents, where they are known, and one of replicas of a model (P,) move from common initial poses."""
    scenario = configuration.swarm
    rng = np.random.default_rng((REPLAY, configuration.run.seed))
    swarms = ({"Agents": False} if scenario.known else {}) | {"Replicas of the inferred model": True}
    executed = [[replica - 1] for replica in swarms.values()]  # by agents, and by replicas of the one model
    model = configuration.representation.behavior(estimate[None])
    robots = execution_of(scenario, model, np.repeat(executed, scenario.individuals, axis=1))
    return swarm_replay(
        scenario,
        replace(robots, controllers=np.clip(robots.controllers, -LARGEST_SPEED, LARGEST_SPEED)),
        np.repeat(initial_poses(scenario, 1, rng), len(swarms), axis=0),
        swarms,
        title=f"{scenario.title}: {'agents beside replicas' if scenario.known else 'replicas'}",
        duration_s=REPLAY_DURATION_S,
        seed=configuration.run.seed,
        threads=configuration.threads,
    )


def recorded_replay(motion: Mapping[str, np.ndarray]) -> report.Replay | None:
    """Let recorded individuals, where they are known, and replicas move side by side; see `Source.positions`."""
    if "replicas" not in motion:
        return None
    interval, swarms = float(motion["interval_s"]), []
    stride = max(1, round(1 / (2 * FRAMES_PER_S * interval)))
    for name, shown in (("recorded", "Recorded individuals"), ("replicas", "Replicas of the inferred model")):
        if name in motion:
            places = motion[name].copy()
            for path in (places[:, k, d] for k in range(places.shape[1]) for d in (0, 1)):
                there = np.isfinite(path)
                path[:] = np.interp(np.arange(len(path)), np.flatnonzero(there), path[there]) if there.any() else 0.0
            ways = np.gradient(places, axis=0)
            poses = np.concatenate((places, np.arctan2(ways[..., 1:], ways[..., :1])), axis=-1)[::stride]
            if name == "recorded":
                poses[..., :2] -= np.nanmin(motion[name], axis=(0, 1))
            swarms.append(report.Swarm(shown, poses, poses.shape[1], np.full(poses.shape[1], name == "replicas")))
    tank = motion.get("tank")
    sides = np.ptp(swarms[0].poses[..., :2], axis=(0, 1)) if tank is None else tank
    radius = max(0.012 * float(np.max(sides)), 1e-6)
    return report.Replay(
        title="Recorded individuals beside replicas" if "recorded" in motion else "Replicas of the inferred model",
        robot_radius_cm=radius,
        object_radius_cm=radius,
        interval_s=stride * interval,
        swarms=tuple(swarms),
        walls_cm=None if tank is None else (0.0, 0.0, float(tank[0]), float(tank[1])),
        robotic=False,
    )


def swarm_replay(
    scenario: Scenario,
    robots: Execution,
    poses: np.ndarray,
    swarms: Mapping[str, bool],
    *,
    title: str,
    duration_s: float,
    seed: int,
    threads: int | None,
) -> report.Replay:
    """Simulate R swarms, each in one trial from poses (R, A + O, 3), and return what a page shows.

    `swarms` says what each is, and whether its robots are replicas.
    """
    interval = scenario.trial.control_interval_s
    stride = max(1, round(1 / (FRAMES_PER_S * interval)))
    steps = max(1, round(duration_s / interval))
    more: dict[str, Any] = {"fields_of_view": robots.fields_of_view, "drivers": robots.drivers, "threads": threads}
    moved = simulate(scenario, robots.controllers, poses, control_steps=steps, seed=seed, **more).poses[:, ::stride]
    count, width, height = robots.controllers.shape[1], scenario.arena.width_cm, scenario.arena.height_cm
    shown = zip(swarms.items(), moved, strict=True)
    return report.Replay(
        title=title,
        robot_radius_cm=scenario.robot.radius_cm,
        object_radius_cm=scenario.objects.radius_cm,
        interval_s=stride * interval,
        swarms=tuple(report.Swarm(name, each, count, np.full(count, replica)) for (name, replica), each in shown),
        walls_cm=None if width is None or height is None else (0.0, 0.0, width, height),
    )


def draw_check(check: "Check", result: Result) -> list[Picture]:
    """Draw the figures of a check of a run."""
    pictures, parameters = [], result.configuration.system.parameters
    if check.profiles:
        caption = "Accuracy on held-out samples of fresh classifiers, trained against models in which one parameter "
        caption += f"is moved across its initial range; below the dashed line they may be guessing. {result.unknown}"
        labels, intervals = result.labels, result.interval
        panels = [
            ParameterProfile(
                name=labels[each.parameter],
                values=np.array(each.values),
                accuracies=np.array(each.accuracies),
                criticals=np.array(each.criticals),
                estimate=result.estimate[each.parameter],
                interval=intervals[each.parameter] if is_known(*intervals[each.parameter]) else None,
                recovered=[recovery.estimate[each.parameter] for recovery in check.recoveries],
                logarithmic=parameters[each.parameter].scale == "log",
            )
            for each in check.profiles
        ]
        drawn = profiles_figure(panels)
        pictures.append(Picture("check-profiles", "What each parameter leaves open", caption.strip(), drawn, wide=True))
    if check.quantities:
        heading = "Genuine motion and motion simulated at the estimate"
        caption = "Shares of the values in each bin; the outermost bins hold what is beyond them."
        drawn = quantities_figure(distributions_of(check.quantities))
        pictures.append(Picture("check-quantities", heading, caption, drawn, wide=True))
    return pictures


def distributions_of(quantities: "Iterable[Quantity]") -> list[Distribution]:
    """Return quantities as they are drawn."""
    return [
        Distribution(
            f"{each.name.replace('_', ' ')} ({each.unit})" if each.unit else each.name,
            *map(np.array, (each.edges, each.genuine, each.simulated)),
        )
        for each in quantities
    ]


def check_listing(check: "Check") -> Listing:
    """Return what is said of each parameter, as a table."""

    def share(value: float | None, form: str) -> str | None:
        return None if value is None else form.format(value)

    rows = []
    for each in check.parameters:
        shares = share(each.interval_share, "{:.0%}"), share(each.open_share, "at most {:.0%}")
        rows.append((each.parameter, *shares, share(each.recovery_error, "{:.1%}"), each.verdict))
    test, columns = check.test, ("parameter", "interval", "left open", "missed by", "")
    note = f"{check.verdict} Tested on {test.genuine_samples} held-out samples in {test.genuine_groups} groups "
    note += f"({test.grouping}) and {test.counterfeit_samples} simulated ones. Shares of the initial range: width "
    note += "of the interval of the estimate, what fresh classifiers leave open where this parameter alone is moved, "
    note += "and by how much a run missed the estimate when it was the truth."
    return Listing(name="check", heading="Can it be believed?", columns=columns, rows=rows, note=note)
