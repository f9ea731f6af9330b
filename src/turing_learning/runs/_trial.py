"""One trial of a scenario, to look at."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from turing_learning import report
from turing_learning._files import whole
from turing_learning.config import ConfigurationError, require_whole_cycles
from turing_learning.errors import brief, check, integer, number
from turing_learning.models import ReactiveModel
from turing_learning.swarm import Execution, Scenario, initial_poses
from turing_learning.targets import refuse_target, writing
from turing_learning.trajectories import Trajectories

from ._plots import recorded_replay, swarm_replay

LONGEST_S = 3600.0
MOST_ROBOTS = 1000
LARGEST_SPEED = 1e6  # of a controller, in maximum speeds
FILM_SPEED = 10.0  # seconds of the swarm's time in one second of film
REPLAY_SUFFIXES = (".html", ".gif", ".mp4")
"""Endings of the files that a replay is written to."""
TABLE_SUFFIXES = (".csv", ".nc")
"""Endings of the files that hold positions, and are read again as recordings."""


def trial_replay(
    scenario: Scenario,
    controller: Sequence[float] | None = None,
    *,
    robots: int | None = None,
    duration_s: float = 180.0,
    seed: int = 1,
    threads: int | None = None,
) -> report.Replay:
    """Simulate one trial and return what a page or film shows of it.

    Parameters
    ----------
    scenario
        What moves.
    controller : (2 n,)
        Wheel speeds for each sensor state, as fractions of the maximum; None takes the agents'.
    robots
        Number of robots, 1 to 1000; None takes the scenario's. Objects and start square grow in
        proportion.
    duration_s
        Duration (s), above 0 and at most 3600; a whole number of control intervals.
    seed
        Seed of initial poses and wheel noise, >= 0.
    threads
        Number of threads, None for all.
    """
    names = ReactiveModel(scenario.sensor.states).parameter_names
    try:
        speeds = np.asarray(scenario.controller if controller is None else controller, dtype=float)
    except (TypeError, ValueError, OverflowError):
        speeds = np.empty(0)
    fits = speeds.shape == (len(names),) and np.isfinite(speeds).all()
    got = brief(controller)
    check(fits, "controller", f"be {len(names)} finite numbers ({', '.join(names)})", got)
    rule = f"be at most {LARGEST_SPEED:g} in size"
    fits = controller is None or np.abs(speeds).max() <= LARGEST_SPEED
    check(fits, "controller", rule, got)
    for name, value, lowest, highest in (
        ("robots", robots, 1, MOST_ROBOTS),
        ("threads", threads, 1, None),
    ):
        if value is not None:
            integer(name, value, lowest, highest, error=ConfigurationError)
    number("duration", duration_s, above=0, most=LONGEST_S, error=ConfigurationError)
    require_whole_cycles(scenario, duration_s)
    integer("seed", seed, error=ConfigurationError)
    return swarm_replay(
        scenario,
        Execution(np.tile(speeds, (1, robots or scenario.individuals, 1)), None, None),
        initial_poses(scenario, 1, np.random.default_rng(seed), robots=robots),
        {
            "Agents" if controller is None else "Robots with the given controller": controller
            is not None
        },
        title=scenario.title,
        duration_s=duration_s,
        seed=seed,
        threads=threads,
    )


def write_group(
    group: Trajectories,
    path: Path,
    *,
    tank_cm: tuple[float, float] | None = None,
    force: bool = False,
) -> Path:
    """Write simulated animals as page, GIF, film, table (.csv) or dataset of movement (.nc), by the suffix of the path.

    `tank_cm` are the sides of walls to draw, one corner of which is the origin; `force` replaces a file that exists.

    Raises
    ------
    ConfigurationError
        As `write_trial`.
    """
    suffix = path.suffix.lower()
    if suffix not in TABLE_SUFFIXES:
        positions = np.where(group.present[..., None], group.positions, np.nan)
        motion = {"replicas": positions, "interval_s": np.array(1 / group.fps)}
        if tank_cm is not None:
            motion["tank"] = np.array(tank_cm)
        replay = recorded_replay(motion)
        assert replay is not None
        return write_trial(replace(replay, title="Virtual animals"), path, force=force)
    refuse_target(path, name="out", suffixes=TABLE_SUFFIXES, force=force)
    with writing(path, "out"), whole(path) as temporary:
        if suffix == ".csv":
            # it stands beside recordings in pixels, or in metres, whose options are not for it
            names = {"x": "x (cm)", "y": "y up (cm)", "time": "time (s)"}
            group.to_pandas().round(4).rename(columns=names).to_csv(temporary, index=False)
        else:
            group.to_xarray().to_netcdf(temporary, engine="scipy")
    return path


def write_trial(replay: report.Replay, path: Path, *, force: bool = False) -> Path:
    """Write a trial as page (.html), GIF (.gif) or film (.mp4), by the suffix of the path.

    `force` replaces a file that exists.

    Raises
    ------
    ConfigurationError
        If the suffix is unknown, the file exists, it cannot be written, or a film needs an extra
        that is not installed.
    """
    refuse_target(path, name="out", suffixes=REPLAY_SUFFIXES, force=force)
    try:
        with writing(path, "out"):
            if (suffix := path.suffix.lower()) == ".html":
                return report.write_page(report.replay_page(replay), path)
            write = report.write_gif if suffix == ".gif" else report.write_mp4
            return write(replay, path, speed=FILM_SPEED)
    except ImportError as error:
        raise ConfigurationError(str(error)) from error
