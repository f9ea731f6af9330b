"""Games of runs: what is shown as real has not been learned from."""

import json
import re

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.comparison import game_of_run
from turing_learning.families import RecordedSystem


@pytest.fixture
def system(run):
    stored = tl.runs.RunFolder(run).manifest()["recording"]
    windows, family, motion = RecordedSystem.remembered(stored).opened()
    return {"genuine": windows, "simulate": family, "recording": motion}


def test_scenes_of_a_run_are_of_frames_that_are_held_out(run, system, monkeypatch):
    rests = []
    cleared = tl.Trajectories.cleared

    def noted(recording, **options):
        rests.append(options["longest_rest_s"])
        return cleared(recording, **options)

    monkeypatch.setattr(tl.Trajectories, "cleared", noted)
    made = game_of_run(tl.load_run(run), **system, pairs=3, length_s=1.0, seed=1)
    assert made.real.shape == made.simulated.shape == (3, 11, 4, 2)
    # as the run has cut its windows
    assert rests == [20]
    (recording,) = system["recording"]
    (held_out,) = system["genuine"].frames("held out")
    (learned,) = system["genuine"].frames("learning")
    for scene in made.real:
        near = np.abs(recording.positions[:, None] - scene[0][None, :, None]).max(axis=-1) < 1e-9
        rows = np.flatnonzero(near.any(axis=(1, 2)))
        assert len(rows) == 1
        shown = slice(rows[0], rows[0] + len(scene))
        assert held_out[shown].all()
        assert not learned[shown].any()
    again = game_of_run(tl.load_run(run), **system, pairs=3, length_s=1.0, seed=1)
    assert np.array_equal(again.simulated, made.simulated)


def test_a_recording_is_known_by_its_content_not_by_its_place(run):
    stored = tl.runs.RunFolder(run).manifest()["recording"]
    system = RecordedSystem.remembered(stored)
    moved = stored["options"] | {"trajectories": ["elsewhere.csv"]}
    assert system.same_motion(stored | {"options": moved})
    assert not system.same_motion(stored | {"sha256": ["0"]})
    assert not system.same_motion(stored | {"options": moved | {"smooth": 3}})
    assert not system.same_motion(None)


def test_without_positions_single_paths_are_shown_and_other_runs_refused(run, system):
    del system["recording"]
    made = game_of_run(tl.load_run(run), **system, pairs=2)
    assert made.real.shape == (2, 11, 1, 2)
    # walkers make steps of 0.5 to 0.65 cm
    steps = np.linalg.norm(np.diff(made.real[:, :, 0], axis=1), axis=-1)
    assert steps.min() > 0.4
    assert steps.max() < 0.75


def test_a_swarm_of_replicas_stands_beside_one_of_agents(small):
    result = tl.infer(config=small(generations=1))
    made = game_of_run(result, pairs=1, length_s=2.0)
    assert made.real.shape[0] == made.simulated.shape[0] == 1
    assert made.speed == 10


def test_the_command_writes_pages_of_runs_and_of_recordings(call, run, recorded, tmp_path):
    code, out, _ = call("game", run, "--pairs", "2", "--length", "1")
    assert (code, out) == (0, "walk-game.html\n")
    page = (tmp_path / "walk-game.html").read_text()
    data = json.loads(re.search(r'id="replay-data">(.*?)</script>', page, re.DOTALL)[1])
    assert len(data["pairs"]) == 2
    # it replaces a page of its own, but nothing else
    assert call("game", run, "--pairs", "1", "--length", "1")[0] == 0
    read = ("--fps", "10", "--scale", "1", "--y-axis", "up")
    code, out, _ = call("game", recorded, "--against", recorded, *read, "--out", "two.html")
    assert (code, out) == (0, "two.html\n")
    code, _, err = call("game", recorded, "--against", recorded, *read, "--out", "two.html")
    assert code == 2
    assert "replace it with --force" in err
    code, _, err = call("game", recorded)
    assert code == 2
    assert "`RUN` must be a run folder" in err
    assert "--against" in err
