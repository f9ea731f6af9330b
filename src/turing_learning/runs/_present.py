"""Figures and report of a run: hand the arrays to the rooms that draw."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

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
from turing_learning.report._page import report_page as markup
from turing_learning.swarm import Drivers, Scenario, execution_of, initial_poses, simulate

from ._history import SELECTION_CODES
from ._paper import SOURCE
from ._result import Result

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from turing_learning.identifiability import Check, PinnedDown, Quantity

CITATION = (
    "W. Li, M. Gauci, R. Groß: Turing learning. Swarm Intelligence 10 (2016) 211-243, doi:10.1007/s11721-016-0126-1"
)
REPLAY_ROBOTS = 25
REPLAY_DURATION_S = 180.0
FRAMES_PER_S = 5.0
LARGEST_SPEED = 100.0  # of a replica in a replay, in maximum speeds: beyond it nothing can be seen


def drawn_history(result: Result) -> "xarray.Dataset":
    """Return the history in memory without the populations, which no page shows and which are half of it."""
    return result.history.drop_vars(["model", "classifier"], errors="ignore").load()


def draw(
    history: "xarray.Dataset", configuration: Configuration, dialogues: Mapping[str, np.ndarray] = MappingProxyType({})
) -> list[Picture]:
    """Draw the figures of a run, from the history of its completed generations, and what its classifiers did to the system."""
    truth, trials = configuration.scenario.truth, configuration.spent(history.sizes["generation"])
    over = "generations" if trials is None else "trials"
    best, typical = (configuration.described(history[name].to_numpy()) for name in ("best_model", "typical_model"))
    return [
        _parameters(best, typical, configuration, trials),
        *([] if truth is None else [_error(best, typical, np.asarray(truth, dtype=float), trials)]),
        *([_dialogues(dialogues, configuration)] if dialogues else []),
        Picture(
            "fitness",
            f"Fitness over {over}",
            "Subjective fitness of both populations: median and quartiles. Selection has stopped where it is shaded."
            if trials is None
            else "Fitness of the models tried in each batch, and of the classifiers: median and quartiles.",
            fitness_figure(
                fitness_of(history, "model"),
                fitness_of(history, "classifier"),
                stopped=history["selection"].to_numpy() != SELECTION_CODES["active"],
                trials=trials,
            ),
        ),
        *([_step_sizes(history, configuration)] if "model_step_size" in history and trials is None else []),
    ]


def _parameters(
    best: np.ndarray, typical: np.ndarray, configuration: Configuration, trials: np.ndarray | None
) -> Picture:
    caption, over = "Subjectively best and typical model of each generation", "generations"
    if trials is not None:
        caption, over = "Best model of each batch of trials, and the estimate after it", "trials"
    caption += ", steady outputs of the networks" if configuration.models.hidden else ""
    scenario = configuration.scenario
    if scenario.truth is not None:
        caption += "; the truth is dashed"
    drawn = parameters_figure(best, typical, names=scenario.parameter_labels, truth=scenario.truth, trials=trials)
    return Picture("parameters", f"Parameters over {over}", f"{caption}.", drawn, wide=True)


def _error(best: np.ndarray, typical: np.ndarray, truth: np.ndarray, trials: np.ndarray | None) -> Picture:
    return Picture(
        "error",
        f"Mean absolute error over {'generations' if trials is None else 'trials'}",
        f"Mean over the parameters, of the best model and of {'the typical one' if trials is None else 'the estimate so far'}.",
        error_figure(mean_absolute_error(best, truth), mean_absolute_error(typical, truth), trials=trials),
    )


def _dialogues(dialogues: Mapping[str, np.ndarray], configuration: Configuration) -> Picture:
    system, chosen = configuration.system, "outputs" in dialogues
    caption = "For each parameter the classifier, of the fittest of 50 generations, that tells the system best from models in "
    caption += "which this parameter is drawn anew: the stimulus that it chose, and the answer, in a trial with the "
    caption += "system and in one with the estimate. An output of 0.5 or more says genuine."
    if not chosen:
        caption = "Classifiers only watched: one trial of the system and one of the estimate under the same stimulus."
    drawn = dialogues_figure(
        dialogues, names=system.signals, rows=tuple(system.parameters), interval_s=system.interval_s
    )
    return Picture("stimuli", "Stimulus and answer", caption, drawn, wide=True)


def fitness_of(history: "xarray.Dataset", population: str) -> np.ndarray:
    """Return the fitness of all individuals, or of a thin history the quantiles, which have the same quartiles."""
    name = f"{population}_fitness"
    return history[name if name in history else f"{name}_quantiles"].to_numpy()


def _step_sizes(history: "xarray.Dataset", configuration: Configuration) -> Picture:
    names, caption = configuration.scenario.parameter_names, "Median mutation strength of each parameter"
    caption += configuration.system.step_unit
    sizes = np.median(history["model_step_size"].to_numpy(), axis=1)
    if configuration.models.hidden:
        names, caption = ("models",), "Median mutation strength of the models' weights"
        sizes = _weights_median(history, "model")[:, None]
    return Picture(
        "step-sizes",
        "Step sizes over generations",
        f"{caption}, and of the classifiers' weights.",
        step_sizes_figure(sizes, _weights_median(history, "classifier"), names=names),
    )


def _weights_median(history: "xarray.Dataset", population: str) -> np.ndarray:
    sizes = history[f"{population}_step_size"].to_numpy()
    return np.median(sizes.reshape(len(sizes), -1), axis=1).astype(float)


def save_figures(drawings: list[Picture], folder: Path) -> None:
    """Write every figure as PNG and SVG."""
    folder.mkdir(exist_ok=True)
    for drawing in drawings:
        drawing.save(folder)


def report_page(
    result: Result,
    history: "xarray.Dataset",
    configuration: Configuration,
    drawings: list[Picture],
    manifest: list[tuple[str, str]],
    check: "Check | None" = None,
    motion: Mapping[str, np.ndarray] | None = None,
) -> str:
    """Return the page of a run; `drawings` are those of `draw`, `manifest` names and values, `motion` as of `Source.positions`."""
    words = {code: word for word, code in SELECTION_CODES.items()}
    return markup(
        RunReport(
            title=f"{configuration.scenario.title}: what Turing Learning inferred",
            summary=summary(result),
            verdicts=result.verdicts,
            facts=facts(result, dict(manifest)),
            steps=next_steps(result),
            data=tables(result, history, configuration),
            table=run_table(result),
            selection=[words[int(code)] for code in history["selection"].to_numpy()],
            figures=tuple(drawings),
            configuration=to_toml(configuration),
            manifest=manifest,
            replay=recorded_replay(motion or {})
            if configuration.system.simulated is None
            else replay(configuration, simulated_model(result)),
            check=None if check is None else check_listing(check),
            check_figures=() if check is None else tuple(draw_check(check, result, configuration)),
        )
    )


def simulated_model(result: Result) -> np.ndarray:
    """Return what is simulated (P,): the estimate, or the weights of the network that comes nearest to it."""
    return np.array(list((result.networks or {"estimate": result.estimate})["estimate"].values()))


def summary(result: Result) -> str:
    """Say the result in one sentence, and how many simulations failed."""
    state = "" if result.complete else " (the run is not complete)"
    done = f"After {result.length}{state}"
    if result.estimate_mae is not None:
        return (
            f"{done} the estimate differs from the truth by {result.estimate_mae:.4f} in the mean over all parameters."
        )
    count = 0 if result.failed_simulations is None else result.failed_simulations["count"]
    failed = f" {report.counted(count, 'simulation')} failed; result.json says which." if count else ""
    return f"{done} the estimate stands; there is no truth to compare it with.{failed}"


def facts(result: Result, manifest: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what belongs at the top of a page: seed, date, versions, how to run it again, and what to cite."""
    again = "see Configuration, below"
    if result.path is not None and result.configuration.system.simulated is not None and not result.in_laboratory:
        again = "turing-learning infer --config RUN/config.toml --out AGAIN"
    return [
        ("Seed", str(result.seed)),
        ("Begun", manifest.get("started", "unknown").replace("T", " ").replace("+00:00", " UTC")),
        ("Run again", again),
        ("Cite", CITATION),
    ]


def next_steps(result: Result) -> list[tuple[str, str]]:
    """Return commands to go on with, and what they are for."""
    if result.path is None or result.in_laboratory:
        return []
    tells = "Can fresh classifiers tell the model from the system? What is pinned down? (RUN: the folder of this page.)"
    agree = "Do runs with other seeds agree? Make one or more, and pool them."
    return [("turing-learning check RUN", tells), ("turing-learning pool RUN ANOTHER-SEED", agree)]


def tables(result: Result, history: "xarray.Dataset", configuration: Configuration) -> dict[str, str]:
    """Return the table of the parameters, and the models of each generation, or after so many trials, as CSV."""
    names = configuration.scenario.parameter_names
    models = {name: configuration.described(history[name].to_numpy()) for name in ("typical_model", "best_model")}
    columns = [f"{of}_{name}" for of in models for name in names]
    rows = np.hstack([*models.values()])
    spent = configuration.spent(len(rows))
    lines = [",".join(["generation" if spent is None else "trials", *columns])]
    steps = range(len(rows)) if spent is None else spent
    lines += [f"{k},{','.join(f'{x:.7g}' for x in row)}" for k, row in zip(steps, rows, strict=True)]
    name = "generations.csv" if spent is None else "trials.csv"
    return {"parameters.csv": result.to_dataframe().to_csv(), name: "\n".join(lines) + "\n"}


def run_table(result: Result) -> RunTable:
    """Return the table inferred / true / absolute error / the paper's figure."""

    def of(values: Mapping[str, float] | None, name: str) -> float | None:
        return None if values is None else values[name]

    labels = result.labels
    rows = tuple(
        ParameterRow(
            name=labels[name],
            estimate=value,
            best_model=result.best_model[name],
            truth=of(result.truth, name),
            estimate_error=of(result.estimate_absolute_error, name),
            best_model_error=of(result.absolute_error, name),
            published_error=of(result.paper_absolute_error, name),
            interval=(result.interval[name][0], result.interval[name][1]),
        )
        for name, value in result.estimate.items()
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
    individuals = scenario.individuals if scenario.start(REPLAY_ROBOTS).crowd else REPLAY_ROBOTS
    labels = (*(["Agents"] if scenario.known else []), "Replicas of the inferred model")
    poses = np.repeat(initial_poses(scenario, 1, rng, robots=individuals), len(labels), axis=0)
    executed = [[-1], [0]][-len(labels) :]  # by agents, and by replicas of the one model
    robots = execution_of(
        scenario, configuration.representation.behavior(estimate[None]), np.repeat(executed, individuals, axis=1)
    )
    return swarm_replay(
        scenario,
        np.clip(robots.controllers, -LARGEST_SPEED, LARGEST_SPEED),
        poses,
        fields_of_view=robots.fields_of_view,
        labels=labels,
        replicas=(False, True)[-len(labels) :],
        title=f"{scenario.title}: {'agents beside replicas' if scenario.known else 'replicas'}",
        duration_s=REPLAY_DURATION_S,
        seed=configuration.run.seed,
        threads=configuration.threads,
        drivers=robots.drivers,
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
    controllers: np.ndarray,
    poses: np.ndarray,
    *,
    labels: tuple[str, ...],
    replicas: tuple[bool, ...],
    title: str,
    duration_s: float,
    seed: int,
    threads: int | None,
    fields_of_view: np.ndarray | None = None,
    drivers: Drivers | None = None,
) -> report.Replay:
    """Simulate swarms, each in one trial, and return what a page shows of them.

    Parameters
    ----------
    controllers : (R, A, 2 n)
        Of the robots; those with one of the `drivers` follow that network instead.
    poses : (R, A + O, 3)
        Initial poses.
    labels, replicas
        What each swarm is, and whether it executes a model.
    fields_of_view : (R, A)
        Of the robots' sensors (rad); None takes the scenario's.
    """
    interval = scenario.trial.control_interval_s
    stride = max(1, round(1 / (FRAMES_PER_S * interval)))
    steps = max(1, round(duration_s / interval))
    result = simulate(
        scenario,
        controllers,
        poses,
        control_steps=steps,
        seed=seed,
        fields_of_view=fields_of_view,
        threads=threads,
        drivers=drivers,
    )
    moved, robots = result.poses[:, ::stride], controllers.shape[1]
    width, height = scenario.arena.width_cm, scenario.arena.height_cm
    return report.Replay(
        title=title,
        robot_radius_cm=scenario.robot.radius_cm,
        object_radius_cm=scenario.objects.radius_cm,
        interval_s=stride * interval,
        swarms=tuple(
            report.Swarm(label, swarm, robots, np.full(robots, is_replica))
            for label, swarm, is_replica in zip(labels, moved, replicas, strict=True)
        ),
        walls_cm=None if width is None or height is None else (0.0, 0.0, width, height),
    )


def draw_check(check: "Check", result: Result, configuration: Configuration) -> list[Picture]:
    """Draw the figures of a check of a run."""
    drawings = []
    if check.profiles:
        drawings.append(
            Picture(
                "check-profiles",
                "What each parameter leaves open",
                "Accuracy on held-out samples of fresh classifiers, trained against models in which one parameter is moved "
                "across its initial range; below the dashed line they may be guessing. "
                f"{result.unknown}".strip(),
                _profiles(check, result, configuration),
                wide=True,
            )
        )
    if check.quantities:
        drawings.append(
            Picture(
                "check-quantities",
                "Genuine motion and motion simulated at the estimate",
                "Shares of the values in each bin; the outermost bins hold what is beyond them.",
                quantities_figure(distributions_of(check.quantities)),
                wide=True,
            )
        )
    return drawings


def distributions_of(quantities: "Iterable[Quantity]") -> list[Distribution]:
    """Return quantities as they are drawn."""
    return [
        Distribution(
            name=f"{each.name.replace('_', ' ')} ({each.unit})" if each.unit else each.name,
            edges=np.array(each.edges),
            genuine=np.array(each.genuine),
            simulated=np.array(each.simulated),
        )
        for each in quantities
    ]


def _profiles(check: "Check", result: Result, configuration: Configuration) -> "Figure":
    system = configuration.system
    labels = dict(zip(system.parameters, system.parameter_labels, strict=True))
    return profiles_figure(
        [
            ParameterProfile(
                name=labels[each.parameter],
                values=np.array(each.values),
                accuracies=np.array(each.accuracies),
                criticals=np.array(each.criticals),
                estimate=result.estimate[each.parameter],
                interval=_known_ends(result.interval[each.parameter]),
                recovered=[recovery.estimate[each.parameter] for recovery in check.recoveries],
                logarithmic=system.parameters[each.parameter].scale == "log",
            )
            for each in check.profiles
        ]
    )


def _known_ends(ends: list[float]) -> tuple[float, float] | None:
    return (ends[0], ends[1]) if is_known(*ends) else None


def check_listing(check: "Check") -> Listing:
    """Return what is said of each parameter, as a table."""
    test = check.test
    return Listing(
        name="check",
        heading="Can it be believed?",
        columns=("parameter", "interval", "left open", "missed by", ""),
        rows=[_row(each) for each in check.parameters],
        note=f"{check.verdict} Tested on {test.genuine_samples} held-out samples in {test.genuine_groups} groups "
        f"({test.grouping}) and {test.counterfeit_samples} simulated ones. Shares of the initial range: width of the interval of "
        "the estimate, what fresh classifiers leave open where this parameter alone is moved, and by how much a run missed "
        "the estimate when it was the truth.",
    )


def _row(each: "PinnedDown") -> tuple[str | None, ...]:
    return (
        each.parameter,
        None if each.interval_share is None else f"{each.interval_share:.0%}",
        None if each.open_share is None else f"at most {each.open_share:.0%}",
        None if each.recovery_error is None else f"{each.recovery_error:.1%}",
        each.verdict,
    )
