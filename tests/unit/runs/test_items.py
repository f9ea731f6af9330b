"""Runs on swarms whose sensors tell items of the user's own apart: inferred, resumed, shown, and stated in files."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import load_configuration
from turing_learning.runs import trial_replay, write_trial

FILE = """
[scenario]
preset = "aggregation"
name = "towards-a-light"
controller = [0.2, 0.8, 1.0, -0.6, 0.9, 0.5, -0.7, 0.3]
agents = 2

[scenario.items.light]
mobility = "seen"
radius_cm = 8
centers_cm = [[50, 50]]

[scenario.items.post]
count = 4
radius_cm = 6

[scenario.sensor]
readings = ["background", "robot", "light", "post"]

[scenario.arena]
width_cm = 100
height_cm = 100

[scenario.trial]
duration_s = 2

[classifiers]
population = 8

[run]
threads = 1
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "light.toml").write_text(FILE)
    return tmp_path / "light.toml"


def test_four_sensor_states_are_inferred_resumed_and_shown(file, tmp_path):
    run = tmp_path / "run"
    result = tl.infer(config=file, trials=60, seed=3, out=run, progress=False)
    assert list(result.estimate) == [f"v{side}{state}" for state in range(4) for side in "lr"]
    scenario = load_configuration(run / "config.toml").swarm
    assert scenario == result.configuration.swarm
    assert scenario.items["light"].centers_cm == ((50.0, 50.0),)
    assert scenario.items["post"] == tl.swarm.Item(count=4, radius_cm=6.0)
    longer = tl.resume(run, trials=90, progress=False)
    assert longer.trials == 90
    page = (run / "report.html").read_text()
    assert '<span class="key amber">1 light</span>' in page
    assert '<span class="key purple">4 post</span>' in page
    assert len(longer.plot.motion()) == 2
    replay = trial_replay(scenario, robots=5, duration_s=2.0)
    (swarm,) = replay.swarms
    assert swarm.objects == 5  # items are as many as before, whatever the number of robots
    assert replay.radii_cm(swarm).tolist() == [8.0, 6.0, 6.0, 6.0, 6.0]
    film = write_trial(replay, tmp_path / "light.gif")
    assert film.stat().st_size > 1000


@pytest.mark.parametrize(
    ("line", "instead", "message"),
    [
        ("count = 4", "cuont = 4", r"`scenario.items.post.cuont` must be a known setting"),
        ("radius_cm = 6", "radius_cm = 0", r"`scenario.items.post.radius_cm` must .*:15\]"),
        ('"seen"', '"sen"', r"`scenario.items.light.mobility` must be 'fixed', 'pushed' or 'seen'"),
        ("[[50, 50]]", "[50, 50]", r"`scenario.items.light.centers_cm` must be a list of pairs"),
        ("count = 4", "count = 0", r"`scenario.items.post.count` must be at least 1 where the sen"),
        ('"post"]', '"lamp"]', r"got 'lamp' .* Describe it below \[scenario.items.lamp\]"),
        ("items.post", "items.robot", r"names of letters, .* other than .*; got 'robot'"),
    ],
)
def test_what_a_file_says_wrongly_of_items_is_refused_with_its_name(line, instead, message, file):
    file.write_text(FILE.replace(line, instead))
    with pytest.raises(ValueError, match=message):
        tl.infer(config=file, trials=60, progress=False)


def test_a_place_in_a_wall_is_refused_unless_nothing_touches_the_item(file):
    file.write_text(FILE.replace("[[50, 50]]", "[[-50, 50]]"))
    assert load_configuration(file).swarm.items["light"].centers_cm == ((-50.0, 50.0),)
    file.write_text(FILE.replace("[[50, 50]]", "[[-50, 50]]").replace('"seen"', '"fixed"'))
    message = r"`scenario.items.light.centers_cm` must lie inside the arena of 100.0 x 100.0 cm"
    with pytest.raises(ValueError, match=message):
        load_configuration(file)


def test_items_are_single_settings_too(file):
    configuration = load_configuration(file, overrides={"scenario.items.post.count": 2})
    assert configuration.swarm.own_bodies == 3
    poses = tl.swarm.initial_poses(configuration.swarm, 4, np.random.default_rng(0))
    assert poses.shape == (4, 6, 3)
    assert poses[:, 3, :2].tolist() == [[50.0, 50.0]] * 4
