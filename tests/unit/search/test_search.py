import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from turing_learning.analysis import dispersion
from turing_learning.config import ConfigurationError
from turing_learning.search import SearchSettings, mirrored, search_controller
from turing_learning.search import _search as rounds
from turing_learning.search._search import gathering_costs, grid_controllers
from turing_learning.store import DamagedError, RunFolderError, RunStorageError, Store
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, initial_poses, simulate

SMALL = SearchSettings(steps=2, trials=1, finalists=3, final_trials=4, duration_s=5.0, seed=3)
SWARM = replace(AGGREGATION, agents=3)


def search(folder, **arguments):
    return search_controller(SWARM, SMALL, out=folder, **{"threads": 1} | arguments)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return search(tmp_path_factory.mktemp("search") / "run")


def table(result):
    return (result.path / "controllers.csv").read_bytes()


@pytest.mark.parametrize(("states", "steps"), [(1, 5), (2, 4), (3, 2)])
def test_a_grid_and_its_mirror_image_are_the_whole_grid(states, steps):
    half = grid_controllers(states, steps)
    whole = {tuple(row) for row in np.concatenate((half, mirrored(half)))}
    assert len(whole) == steps ** (2 * states)
    own = (mirrored(half) == half).all(axis=1).sum()
    assert 2 * len(half) - own == len(whole)


def test_the_papers_controller_is_on_the_default_grid():
    grid = grid_controllers(2, SearchSettings().steps)
    assert AGGREGATION.controller in {tuple(row) for row in grid.tolist()}


def test_a_mirror_image_exchanges_left_and_right():
    np.testing.assert_array_equal(mirrored(np.array([[1.0, 2.0, 3.0, 4.0]])), [[2.0, 1.0, 4.0, 3.0]])


@pytest.mark.parametrize("scenario", [SWARM, replace(OBJECT_CLUSTERING, agents=2)], ids=["robots", "objects"])
def test_the_cost_is_the_dispersion_weighted_by_time(scenario):
    starts = initial_poses(scenario, 2, np.random.default_rng(1))
    controllers = np.random.default_rng(2).uniform(-1, 1, (3, len(scenario.controller)))
    costs = gathering_costs(scenario, controllers, starts, duration_s=4.0, seed=5)
    executed = np.repeat(controllers, 2, axis=0)[:, None].repeat(scenario.individuals, axis=1)
    poses = simulate(scenario, executed, np.tile(starts, (3, 1, 1)), control_steps=40, seed=5).poses
    objects = scenario.objects.count > 0
    for k in range(6):
        bodies = poses[k, :, scenario.individuals :, :2] if objects else poses[k, :, :, :2]
        spread = [float(dispersion(bodies[10 * t], 5.0 if objects else 3.5)) for t in range(1, 5)]
        expected = sum(t * u for t, u in enumerate(spread, start=1)) / 10
        np.testing.assert_allclose(costs.reshape(6, 2)[k], (expected, spread[-1]), rtol=1e-12)


def test_the_papers_controller_gathers_and_its_opposite_does_not():
    starts = initial_poses(AGGREGATION, 4, np.random.default_rng(1))
    best, opposite = AGGREGATION.controller, tuple(-v for v in AGGREGATION.controller)
    costs = gathering_costs(AGGREGATION, np.array([best, opposite]), starts, duration_s=180.0, seed=1)[..., 0]
    assert costs[0].max() < costs[1].min()


def test_the_finalists_are_sorted_and_in_the_table(found):
    means = found.costs.mean(axis=1)
    assert found.controllers.shape == (3, 4)
    assert found.costs.shape == found.ends.shape == (3, 4)
    assert (np.diff(means) >= 0).all()
    assert found.best == tuple(found.controllers[0])
    rows = list(csv.DictReader(table(found).decode().splitlines()))
    assert [float(row["cost"]) for row in rows] == pytest.approx(means.tolist(), rel=1e-5)
    assert [float(rows[0][name]) for name in ("vl0", "vr0", "vl1", "vr1")] == list(found.best)


def test_threads_change_nothing(found, tmp_path):
    assert table(search(tmp_path / "run", threads=2)) == table(found)


def test_a_search_that_was_stopped_goes_on_to_the_same_table(found, tmp_path, monkeypatch):
    monkeypatch.setattr(rounds, "BLOCK", 4)
    whole = search(tmp_path / "whole")
    told, asked = [], iter([False] * 2)
    assert search(tmp_path / "run", should_stop=lambda: next(asked, True), observer=told.append) is None
    assert told
    assert not (tmp_path / "run" / "controllers.csv").exists()
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "run").rglob("*.npy")}
    assert before
    assert table(search(tmp_path / "run")) == table(whole)
    assert {path: path.stat().st_mtime_ns for path in before} == before


def test_a_damaged_block_is_set_aside_and_computed_again(found, tmp_path, caplog):
    search(tmp_path / "run")
    block = tmp_path / "run" / "round1" / "0000000.npy"
    sound = block.read_bytes()
    for damaged in (sound[:50], sound[:-8] + bytes(8), (tmp_path / "run" / "round2" / "0000000.npy").read_bytes()):
        block.write_bytes(damaged)
        assert table(search(tmp_path / "run")) == table(found)
        assert block.read_bytes() == sound
        assert "round1/0000000.npy is damaged (it has been changed)" in caplog.messages[-1]
    assert len(list(block.parent.glob("*.damaged*"))) == 3


def test_a_search_in_use_is_refused(found):
    with Store(found.path, rounds.SEARCH).locked(), pytest.raises(RunFolderError, match="`search` must not be in use"):
        search(found.path)


def test_changed_settings_of_a_search_are_refused(tmp_path):
    path = search(tmp_path / "run").path / "search.json"
    path.write_text(path.read_text().replace('"seed": 3', '"seed": 4'))
    with pytest.raises(DamagedError, match=r"^`search` must hold search\.json as it was written"):
        search_controller(SWARM, replace(SMALL, seed=4), out=tmp_path / "run")


def test_progress_says_how_far_a_search_is(tmp_path):
    told = []
    search(tmp_path / "run", observer=told.append)
    assert [(one.round, one.rounds, one.done, one.total) for one in told] == [
        (1, 3, 10, 10),
        (2, 3, 10, 10),
        (3, 3, 3, 3),
    ]


def test_a_search_that_is_described_otherwise_is_the_same(found):
    again = search_controller(replace(SWARM, description="11 robots gather."), SMALL, out=found.path)
    assert (again.controllers == found.controllers).all()


def test_a_folder_of_another_search_is_refused(found):
    with pytest.raises(RunFolderError, match="`out` must be the folder of the same search; got one of other settings"):
        search_controller(SWARM, replace(SMALL, seed=4), out=found.path)


def test_a_folder_with_something_else_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(
        RunFolderError,
        match=r"`out` must be a new folder, or that of a search; got .*, without a readable search\.json",
    ):
        search(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_full_disk_ends_a_search_that_can_go_on(tmp_path, monkeypatch):
    def full(store, name, content):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(rounds, "_begin", lambda store, *search: store.create({}))
    monkeypatch.setattr(
        rounds,
        "gathering_costs",
        lambda *given, **settings: monkeypatch.setattr(Store, "write", full) or np.zeros((10, 1, 2)),
    )
    with pytest.raises(RunStorageError, match=r"`out` must be a folder with space left; .*No space left"):
        search(tmp_path / "run")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"steps": 1}, "`steps` must be an integer from 2 to 1000000; got 1"),
        ({"steps": 2.5}, r"`steps` must be an integer from 2 to 1000000; got 2\.5"),
        ({"finalists": True}, "`finalists` must be an integer from 1 to 1000000; got True"),
        ({"trials": 0}, "`trials` must be an integer from 1 to 100000; got 0"),
        ({"finalists": 0}, "`finalists` must be an integer from 1 to 1000000; got 0"),
        ({"trials": 9}, "`final_trials` must be an integer from 9 to 100000; got 4"),
        ({"seed": -1}, "`seed` must be an integer from 0 to 9223372036854775807; got -1"),
        ({"duration_s": 0.0}, "`duration` must be a finite number above 0 and of at most 3600; got 0"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(change, message):
    with pytest.raises(ConfigurationError, match=message):
        replace(SMALL, **change)


def test_a_grid_that_is_too_large_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"`steps` must give at most 1000000 .* 21\^6 in scenario 'object-clus"
    ):
        search_controller(OBJECT_CLUSTERING, SearchSettings(), out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("duration", "message"),
    [
        (0.5, r"`duration` must be at least 1 s; got 0\.5"),
        (3.05, r"`duration` must be a whole number of control intervals of 0\.1 s; got 3\.05"),
    ],
)
def test_a_trial_too_short_or_with_a_part_of_a_control_interval_is_refused(duration, message, tmp_path):
    with pytest.raises(ConfigurationError, match=message):
        search_controller(SWARM, replace(SMALL, duration_s=duration), out=tmp_path / "run")


def test_the_settings_of_a_search_are_in_its_folder(found):
    stored = json.loads((found.path / "search.json").read_text())
    assert stored["settings"]["steps"] == 2
    assert stored["scenario"]["sensor"]["field_of_view"] == 0


def test_a_search_in_the_home_folder_is_there(found, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert table(search("~/run")) == table(found)
    assert not (tmp_path / "~").exists()
