"""Virtual animals: groups that were never recorded, in the formats that are read."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.cli import main
from turing_learning.families import BurstAndCoast, Couzin, Vicsek, beyond_recorded, virtual_group


def command(*words):
    """Call the command line; return its exit code."""
    with pytest.raises(SystemExit) as exited:
        main([str(word) for word in words])
    return exited.value.code


VALUES = {name: (p.low + p.high) / 2 for name, p in Couzin().parameters.items()}


def test_a_group_has_the_size_duration_and_tank_that_are_asked_for():
    family = Couzin(individuals=4, interval_s=0.2, tank_cm=(20.0, 20.0))
    group = virtual_group(family, VALUES, individuals=7, duration_s=6.0, tank_cm=(50.0, 30.0))
    assert group.positions.shape == (31, 7, 2)
    assert group.duration_s == pytest.approx(6.0)
    assert (group.positions <= (50.0, 30.0)).all()
    assert group.reach[1, 0] > 25.0
    again = virtual_group(family, VALUES, individuals=7, duration_s=6.0, tank_cm=(50.0, 30.0))
    assert (again.positions == group.positions).all()


def test_ten_minutes_of_twenty_animals():
    family = BurstAndCoast(individuals=5, interval_s=0.1, tank_cm=(30.0, 30.0))
    middle = {name: (p.low + p.high) / 2 for name, p in family.parameters.items()}
    group = virtual_group(family, middle, individuals=20, duration_s=600, tank_cm=(100, 60))
    assert group.positions.shape == (6_001, 20, 2)
    last_minute = group.positions[-600:]
    assert ((last_minute >= 0) & (last_minute <= (100.0, 60.0))).all()
    assert np.linalg.norm(np.diff(last_minute, axis=0), axis=-1).mean() > 0


def test_too_long_is_refused_and_so_is_a_parameter_that_is_missing():
    with pytest.raises(ValueError, match=r"`duration_s` must be at least 0\.2 s, and at most"):
        virtual_group(Couzin(), VALUES, duration_s=1e6)
    with pytest.raises(ValueError, match="`parameters` must name speed, turning_rate"):
        virtual_group(Couzin(), {})


def test_what_is_no_family_is_refused():
    def simulate(parameters, rng):
        return rng.random((len(parameters), 10, 2))

    with pytest.raises(ValueError, match="`family` must be a family of models"):
        virtual_group(simulate, {"speed": 1.0})


def test_a_periodic_square_grows_with_the_group():
    larger = Vicsek(individuals=10).in_group(40)
    assert larger.period_cm == larger.start_side_cm == pytest.approx(40.0)


def test_what_was_never_recorded_is_said():
    recorded = virtual_group(Couzin(individuals=5, tank_cm=(30.0, 30.0)), VALUES, duration_s=20)
    assert beyond_recorded(recorded, [recorded]) == []
    crowd = virtual_group(Couzin(tank_cm=(30.0, 30.0)), VALUES, individuals=40, duration_s=20)
    (density,) = beyond_recorded(crowd, [recorded], (30.0, 30.0))
    assert "individuals in a square metre; recorded were" in density
    (tank,) = [line for line in beyond_recorded(crowd, [recorded], (300.0, 30.0)) if "tank" in line]
    assert tank.startswith("a tank of 300 x 30 cm; recorded were")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short run on a recording of simulated animals."""
    folder = tmp_path_factory.mktemp("virtual")
    family = Couzin(individuals=5, interval_s=0.1, tank_cm=(30.0, 30.0))
    table = folder / "recorded.csv"
    virtual_group(family, VALUES, duration_s=60).to_pandas().to_csv(table, index=False)
    options = f"--scale 1 --y-axis up --model couzin --trials 60 --window 2 --tank 30x30 --out {folder / 'run'}"
    assert command("infer", "--trajectories", table, *options.split()) == 0
    return folder / "run"


@pytest.mark.parametrize("ending", [".csv", ".nc", ".html"])
def test_a_run_simulates_animals_in_formats_that_are_read_again(run, tmp_path, capsys, ending):
    path = tmp_path / f"virtual{ending}"
    options = f"--individuals 9 --duration 12 --tank 60x40 --out {path}"
    assert command("simulate", run, *options.split()) == 0
    printed = capsys.readouterr()
    assert "beyond what was recorded: a tank of 60 x 40 cm" in printed.err
    if ending == ".html":
        assert "<html" in path.read_text()
        return
    read = tl.load_trajectories(path)
    assert read.positions[..., 1].min() >= -0.001  # y is not turned
    assert read.present.shape == (121, 9)
    assert read.unit == "cm"
    assert read.fps == pytest.approx(10)
    assert read.positions.max() <= 60.001


def test_options_that_do_not_belong_together_are_refused(run, capsys):
    assert command("simulate", run, "--robots", "3") == 2
    assert "`--robots` must be left out for animals" in capsys.readouterr().err
    assert command("simulate", "aggregation", "--tank", "30x30") == 2
    assert "`--tank` must be left out for robots" in capsys.readouterr().err
    assert command("simulate", run, "--tank", "wide") == 2
    assert "width x height in cm" in capsys.readouterr().err
