"""The command that lets a swarm or a group of animals move: a scenario, or what a run has inferred."""

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import turing_learning as tl
from turing_learning.errors import choice, refuse, require

from ._open import opened, system_of
from ._options import (
    Integer,
    Real,
    Recording,
    Settings,
    refuse_beside,
    require_scenario,
    settings_of,
)

if TYPE_CHECKING:
    from turing_learning.swarm import Scenario

SWARM_S = 180.0
"""Duration of a trial of a swarm (s), unless said otherwise."""
ANIMALS_S = 60.0
"""Duration of the motion of animals (s), unless said otherwise."""


def simulate(
    scenario: str | None = None,
    /,
    *,
    config: Path | None = None,
    controller: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    robots: Integer | None = None,
    individuals: Integer | None = None,
    tank: str | None = None,
    as_tracked: bool = False,
    duration: Real | None = None,
    seed: Integer = 1,
    threads: Integer | None = None,
    out: Path | None = None,
    force: bool = False,
    settings: Settings = None,
) -> None:
    """Simulate a swarm, or the animals that a run has learned, and write their motion as a page, a film, or a table.

    A run on recorded animals moves a group of any size, in any tank, with its estimate. A run on a swarm moves robots
    that execute its estimate.

    Examples:

      turing-learning simulate aggregation
      turing-learning simulate aggregation --robots 50 --duration 300 --out fifty.gif
      turing-learning simulate aggregation --controller=-0.7,-1,1,-1 --out agents.mp4
      turing-learning simulate --config my.toml --set scenario.sensor.field_of_view=0.5
      turing-learning simulate runs/fish --individuals 20 --duration 1800 --tank 100x60 --out fish.csv

    :param scenario: Name of a scenario, see `scenarios`; or a run folder; or in the file.
    :param config: TOML file with any setting, as for `infer`.
    :param controller: Wheel speeds for each sensor state, with commas between them; the agents' by default.
    :param robots: Number of robots; the scenario's by default.
    :param individuals: Number of animals; by default as many as were recorded.
    :param tank: Width and height of their tank (cm), as 100x60; by default the run's.
    :param as_tracked: Lose animals as the tracker of the recordings lost them, so that tables are gapped as recordings are.
    :param duration: Duration (s); 180 by default, 60 for animals.
    :param seed: Seed of initial poses and noise; 1 by default.
    :param threads: Number of threads; all by default. The result does not depend on it.
    :param out: Page (.html), GIF (.gif) or film (.mp4), and for animals a table (.csv) or a dataset of movement (.nc);
        a page by default.
    :param force: Replace a file that exists.
    :param settings: Any setting, for example scenario.noise.wheel_speed_sd=0.1. Repeatable.
    """
    of_animals: dict[str, Any] = {
        "individuals": individuals,
        "tank": tank,
        "as_tracked": as_tracked or None,
    }
    if scenario is None or not tl.runs.RunFolder(Path(scenario)).is_run():
        refuse_beside("be left out for robots", **of_animals)
        swarm = _swarm(scenario, config, settings)
        _write_trial(swarm, _speeds(controller), robots, duration, seed, threads, out, force)
        return
    run = Path(scenario)
    result = opened(run)
    refuse_beside("be left out for a run", config=config, controller=controller, set=settings)
    simulated = result.configuration.system.simulated
    if simulated is None:
        refuse_beside("be left out for animals", robots=robots, threads=threads)
        _write_animals(result, run, individuals, tank, as_tracked, duration, seed, out, force)
        return
    refuse_beside("be left out for robots", **of_animals)
    # Networks, and rules of other robots, have other parameters than the table has speeds.
    reactive = len(result.estimate) == len(simulated.controller)
    rule = "be on controllers that are tables of wheel speeds"
    require(reactive and result.networks is None, "run", rule, "another one", place=scenario)
    speeds = list(result.simulated_model)
    _write_trial(simulated, speeds, robots, duration, seed, threads, out, force)


def _speeds(controller: str | None) -> list[float] | None:
    if controller is None:
        return None
    try:
        return list(map(float, controller.split(",")))
    except ValueError:
        refuse("controller", "be numbers with commas between them", repr(controller))


def _swarm(name: str | None, config: Path | None, settings: Settings) -> "Scenario":
    from turing_learning.config import load_configuration

    require_scenario(name, config, tl.swarm.SCENARIOS)
    overrides, labels = settings_of(settings, {})
    named = None
    if name is not None:
        choice("scenario", name, tl.swarm.SCENARIOS, noun="scenario")
        named = tl.swarm.SCENARIOS[name]
    system = load_configuration(config, "default", overrides, scenario=named, labels=labels).system
    if system.simulated is None:
        refuse("SCENARIO", "be a swarm of robots", system.name)
    return system.simulated


def _write_trial(
    scenario: "Scenario",
    speeds: list[float] | None,
    robots: int | None,
    duration_s: float | None,
    seed: int,
    threads: int | None,
    out: Path | None,
    force: bool,
) -> None:
    from turing_learning.targets import refuse_target

    path = out or Path(f"{scenario.name}.html")
    refuse_target(path, name="out", suffixes=tl.runs.REPLAY_SUFFIXES, force=force)
    replay = tl.runs.trial_replay(
        scenario,
        speeds,
        robots=robots,
        duration_s=SWARM_S if duration_s is None else duration_s,
        seed=seed,
        threads=threads,
    )
    print(tl.runs.write_trial(replay, path, force=force))


def _write_animals(
    result: "tl.Result",
    run: Path,
    individuals: int | None,
    tank: str | None,
    as_tracked: bool,
    duration_s: float | None,
    seed: int,
    out: Path | None,
    force: bool,
) -> None:
    from turing_learning.families import beyond_recorded, tank_sides, virtual_group
    from turing_learning.targets import refuse_target

    path = out or Path("animals.html")
    refuse_target(
        path, name="out", suffixes=(*tl.runs.REPLAY_SUFFIXES, *tl.runs.TABLE_SUFFIXES), force=force
    )
    tank_cm = None if tank is None else tank_sides(tank)
    # No recording may be given: the run's own says how many individuals, and which tank.
    call = "families.virtual_group(simulate, load_run({run}).estimate)"
    system = system_of(run, Recording(), call)
    rule = "be on recorded animals, or on a swarm"
    require("simulate" in system, "run", rule, "one on another simulator", place=str(run))
    names = list(result.configuration.system.parameters)
    group = virtual_group(
        system["simulate"],
        dict(zip(names, result.simulated_model.tolist(), strict=True)),
        individuals=individuals,
        duration_s=ANIMALS_S if duration_s is None else duration_s,
        tank_cm=tank_cm,
        seed=seed,
        as_tracked=as_tracked,
    )
    for warning in beyond_recorded(group, system["recording"], tank_cm):
        print(f"beyond what was recorded: {warning}", file=sys.stderr)
    print(tl.runs.write_group(group, path, tank_cm=tank_cm, force=force))
    if path.suffix.lower() in tl.runs.TABLE_SUFFIXES:
        print(f"Read it with: turing-learning look {shlex.quote(str(path))}")
