"""A run in pictures and in motion: what `Result.plot` draws into axes of matplotlib, and swarms
that move in pages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning import report
from turing_learning.config import Configuration
from turing_learning.errors import check, reject
from turing_learning.figures.one_run import fitness_figure, parameters_figure, quantities_figure
from turing_learning.figures.style import Panels, panel_grid, titled
from turing_learning.figures.swarms import draw_paths
from turing_learning.identifiability import evidence as evidence
from turing_learning.purposes import REPLAY
from turing_learning.swarm import Execution, Scenario, execution_of, initial_poses, simulate
from turing_learning.trajectories import filled

from ._history import SELECTION_CODES
from ._result import Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

REPLAY_DURATION_S = 180.0
FRAMES_PER_S = 5.0
# Of a replica in a replay, in maximum speeds: beyond it nothing can be seen
LARGEST_SPEED = 100.0


@dataclass(frozen=True, repr=False)
class Plots:
    """Pictures of a result on matplotlib axes.

    Each method draws into the axes `ax`, or into a new figure of pyplot, and returns the axes: one for
    `fitness`, an array with one for each panel otherwise. It raises a ConfigurationError if `ax` are not as
    many axes as there are panels.
    """

    result: Result

    def parameters(self, ax: Any = None) -> np.ndarray:
        """Draw each of P parameters over generations or trials, of the best and of the typical model; the truth is dashed."""
        record = self.result.stored()
        panels = _panels(ax, record.configuration.system.parameter_labels, 2.15)
        draw_parameters(record.series(), record.configuration, panels)
        return np.array(panels.axes)

    def fitness(self, ax: Any = None) -> "Axes":
        """Draw the fitness of models and classifiers over generations or trials.

        Median and quartiles, as in the report.
        """
        record = self.result.stored()
        panels = _panels(ax, [""], 3.1)
        draw_fitness(record.series(), record.configuration, panels)
        return panels.axes[0]

    def motion(self, ax: Any = None) -> np.ndarray:
        """Draw paths (cm) of genuine individuals, where they are known, and beside them of replicas that execute the estimate.

        Of a swarm both are simulated from the same start for 180 s. Of a recording it is what the
        report shows. Samples that are arrays do not say where anybody is, and are rejected: see
        `distributions`. The simulator needs a method `simulate` that returns positions, as families
        of models have.
        """
        record = self.result.stored()
        model = self.result.simulated_model
        if record.configuration.system.simulated is None:
            moved = recorded_replay(record.motion(model))
        else:
            moved = replay(record.configuration, model)
        if moved is None:
            rule = "be of a system whose simulator says where everybody is"
            got = "samples alone"
            remedy = "Its signals are in `plot.distributions()`. Positions are known of windows of a recording with a family "
            remedy += "of models, or another simulator with a method `simulate`."
            reject("run", rule, got, remedy)
        panels = _panels(ax, [swarm.label for swarm in moved.swarms], 4.0)
        swarms = [(swarm.poses, swarm.robots, swarm.replica_mask) for swarm in moved.swarms]
        radii: dict[str, Any] = {
            "robot_radius_cm": moved.robot_radius_cm,
            "object_radius_cm": moved.radii_cm(moved.swarms[0]),
        }
        draw_paths(panels, swarms, **radii)
        return np.array(panels.axes)

    def distributions(
        self, ax: Any = None, *, genuine: Any = None, simulate: Any = None
    ) -> np.ndarray:
        """Draw distributions of what can be seen of the genuine motion and of motion simulated at the estimate.

        Of a swarm: speed, turning, distance of neighbors and polarization. Of a custom system: its
        signals, for which `genuine` and `simulate` are given again if the run was loaded and they
        are no functions of a module.
        """
        record = self.result.stored()
        system = record.configuration.system
        model = self.result.simulated_model
        rule = "be of a system that can be simulated"
        where = str(self.result.path)
        check(not self.result.in_laboratory, "run", rule, "one in a laboratory", place=where)
        if system.simulated is not None:
            quantities = evidence.swarm_quantities(record.configuration, model, seed=0)
        else:
            with record.opened(genuine, simulate) as source:
                # No generation is collected
                source.generation = None
                rng = evidence.stream(0, evidence.COMPARING)
                simulated = source.simulate(np.tile(model, (evidence.COMPARED, 1)), rng)
                if source.genuine is None or source.genuine.live:
                    genuine = source.genuine_samples(evidence.COMPARED, rng)
                else:
                    genuine = source.genuine.samples
            quantities = evidence.signal_quantities(genuine, simulated, system)
        distributions = distributions_of(quantities)
        panels = _panels(ax, list(distributions), 2.1)
        quantities_figure(distributions, panels=panels)
        return np.array(panels.axes)


def _panels(ax: Any, titles: Sequence[str], height: float) -> Panels:
    """Return given axes with titles, or those of a new figure of pyplot."""
    if ax is None:
        from matplotlib.pyplot import figure

        return panel_grid(
            titles, height, make=lambda *size: figure(figsize=size, layout="constrained")
        )
    array = np.array(ax, dtype=object)
    axes = list(array.flat)
    drawable = all(hasattr(artist, "get_legend_handles_labels") for artist in axes)
    got = f"{array.size} of {type(axes[0]).__name__}" if axes else "none"
    rule = "be matplotlib axes"
    if len(titles) != 1:
        rule = f"be {len(titles)} matplotlib axes"
    check(drawable and len(axes) == len(titles), "ax", rule, got)
    columns = array.shape[-1] if array.ndim else 1
    panels = Panels(axes[0].figure, axes, columns, callers_axes=True)
    return titled(panels, titles, fontweight="bold", parse_math=False)


def draw_parameters(
    history: Mapping[str, np.ndarray], configuration: Configuration, panels: Panels | None = None
) -> "Figure":
    """Draw the parameters of the best and of the typical models of a history."""
    system = configuration.system
    best = configuration.described(history["best_model"])
    typical = configuration.described(history["typical_model"])
    over: dict[str, Any] = {
        "truth": system.truth,
        "trials": configuration.spent(len(best)),
        "panels": panels,
    }
    return parameters_figure(best, typical, names=system.parameter_labels, **over)


def draw_fitness(
    history: Mapping[str, np.ndarray], configuration: Configuration, panels: Panels | None = None
) -> "Figure":
    """Draw the fitness in a history.

    Of all individuals, or of a thin one the quantiles, which have the same quartiles.
    """
    suffix = "" if "model_fitness" in history else "_quantiles"
    models = history[f"model_fitness{suffix}"]
    classifiers = history[f"classifier_fitness{suffix}"]
    stopped = history["selection"] != SELECTION_CODES["active"]
    trials = configuration.spent(len(models))
    return fitness_figure(models, classifiers, stopped=stopped, trials=trials, panels=panels)


def distributions_of(
    quantities: Sequence[evidence.Quantity],
) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return quantities as they are drawn.

    Name and unit -> edges of bins, shares of genuine and simulated values.
    """
    distributions = {}
    for quantity in quantities:
        name = quantity.name
        if quantity.unit:
            name = f"{name.replace('_', ' ')} ({quantity.unit})"
        distributions[name] = (
            np.array(quantity.edges),
            np.array(quantity.genuine),
            np.array(quantity.simulated),
        )
    return distributions


def replay(configuration: Configuration, estimate: np.ndarray) -> report.Replay:
    """Let a swarm of agents, where they are known, and one of replicas of a model (P,) move from common initial poses."""
    scenario = configuration.swarm
    rng = np.random.default_rng((REPLAY, configuration.run.seed))
    title = f"{scenario.title}: replicas"
    swarms = {"Replicas of the inferred model": True}
    if scenario.known:
        title = f"{scenario.title}: agents beside replicas"
        swarms = {"Agents": False, **swarms}
    # -1 stands for agents, 0 for replicas of the one model
    executed = [[replica - 1] for replica in swarms.values()]
    model = configuration.representation.behavior(estimate[None])
    robots = execution_of(scenario, model, np.repeat(executed, scenario.individuals, axis=1))
    return swarm_replay(
        scenario,
        replace(robots, controllers=np.clip(robots.controllers, -LARGEST_SPEED, LARGEST_SPEED)),
        np.repeat(initial_poses(scenario, 1, rng), len(swarms), axis=0),
        swarms,
        title=title,
        duration_s=REPLAY_DURATION_S,
        seed=configuration.run.seed,
        threads=configuration.threads,
    )


def recorded_replay(motion: Mapping[str, np.ndarray]) -> report.Replay | None:
    """Let recorded individuals, where they are known, and replicas move side by side.

    See `Source.positions`.
    """
    if "replicas" not in motion:
        return None
    interval = float(motion["interval_s"])
    # Recorded individuals first: they say how large the picture is
    swarms = []
    # Twice as many moments in a second as of robots
    stride = max(1, round(1 / (2 * FRAMES_PER_S * interval)))
    # Without walls replicas drift away: they are drawn where the recorded ones are
    if "recorded" in motion and "tank" not in motion:
        motion = {**motion, "replicas": _among(motion["replicas"], motion["recorded"])}
    for name, name_shown in (
        ("recorded", "Recorded individuals"),
        ("replicas", "Replicas of the inferred model"),
    ):
        if name in motion:
            present = np.isfinite(motion[name]).all(axis=2)
            paths = filled(np.where(present[..., None], motion[name], 0.0), present)
            # Positions alone are stored: individuals look where they go
            displacements = np.gradient(paths, axis=0)
            poses = np.concatenate(
                (paths, np.arctan2(displacements[..., 1:], displacements[..., :1])), axis=-1
            )[::stride]
            if name == "recorded":
                poses[..., :2] -= np.nanmin(motion[name], axis=(0, 1))
            swarms.append(
                report.Swarm(
                    name_shown, poses, poses.shape[1], np.full(poses.shape[1], name == "replicas")
                )
            )
    tank = motion.get("tank")
    walls_cm = None
    if tank is None:
        sides = np.ptp(swarms[0].poses[..., :2], axis=(0, 1))
    else:
        sides = tank
        walls_cm = (0.0, 0.0, float(tank[0]), float(tank[1]))
    # a share of the longer side, so that bodies are seen in any tank; above 0 where nobody moves
    radius = max(0.012 * float(np.max(sides)), 1e-6)
    title = "Replicas of the inferred model"
    if "recorded" in motion:
        title = "Recorded individuals beside replicas"
    return report.Replay(
        title=title,
        robot_radius_cm=radius,
        object_radius_cm=radius,
        interval_s=stride * interval,
        swarms=tuple(swarms),
        walls_cm=walls_cm,
        robotic=False,
    )


def _among(replicas: np.ndarray, recorded: np.ndarray) -> np.ndarray:
    """Return positions of replicas (F, A, 2) with 0 where those of recorded individuals (F, A', 2) are lowest.

    Models that know no place begin anywhere. Their group is moved to where the recorded one begins.
    """
    low = np.nanmin(recorded, axis=(0, 1))
    high = np.nanmax(recorded, axis=(0, 1))
    begin = _first_center(replicas)
    if not ((low <= begin) & (begin <= high)).all():
        replicas = replicas + _first_center(recorded) - begin
    return replicas - low


def _first_center(positions: np.ndarray) -> np.ndarray:
    """Return the center (2,) of those who are there in the first frame with anybody, of positions (F, A, 2)."""
    is_there = np.isfinite(positions).all(axis=2).any(axis=1)
    center: np.ndarray = np.nanmean(positions[int(np.argmax(is_there))], axis=0)
    return center


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
    """Simulate R swarms, each in one trial from poses (R, A + O, 3), items last, and return what a page shows.

    `swarms` says what each is, and whether its robots are replicas.
    """
    interval = scenario.trial.control_interval_s
    stride = max(1, round(1 / (FRAMES_PER_S * interval)))
    steps = max(1, round(duration_s / interval))
    options: dict[str, Any] = {
        "fields_of_view": robots.fields_of_view,
        "drivers": robots.drivers,
        "threads": threads,
    }
    moved = simulate(
        scenario, robots.controllers, poses, control_steps=steps, seed=seed, **options
    ).poses[:, ::stride]
    count = robots.controllers.shape[1]
    width = scenario.arena.width_cm
    height = scenario.arena.height_cm
    walls_cm = None
    if width is not None and height is not None:
        walls_cm = (0.0, 0.0, width, height)
    items = []
    for name, item in scenario.items.items():
        visible = scenario.sensor.reading_of(name) > 0
        items.append(report.ShownItems(name, item.count, item.radius_cm, visible))
    shown = []
    for (name, replica), path in zip(swarms.items(), moved, strict=True):
        shown.append(report.Swarm(name, path, count, np.full(count, replica)))
    return report.Replay(
        title=title,
        robot_radius_cm=scenario.robot.radius_cm,
        object_radius_cm=scenario.objects.radius_cm,
        items=tuple(items),
        interval_s=stride * interval,
        swarms=tuple(shown),
        walls_cm=walls_cm,
    )
