"""The laboratory's file: what it may say, and what is refused."""

import re

import pytest
from program_laboratory import FILE

from turing_learning.config import ConfigurationError
from turing_learning.robots import load_laboratory
from turing_learning.robots.program import read_setup


@pytest.fixture
def load(tmp_path):
    def load(text, **options):
        path = tmp_path / "lab.toml"
        path.write_text(text)
        return load_laboratory(path, **options)

    return load


def paper_file():
    robots = "".join(
        f'[[robots]]\nname = "a{k}"\nrole = "agent"\nmarker = "blue"\n' for k in range(8)
    )
    for k, color in enumerate(("orange", "purple")):
        robots += f'[[robots]]\nname = "{color}"\nrole = "replica"\nmarker = "{color}"\naddress = "/dev/rfcomm{k}"\n'
    return f'[camera]\ncalibration = "camera.json"\n{robots}'


def test_what_is_left_out_is_as_in_the_paper(load, tmp_path):
    laboratory = load(paper_file())
    setup, configuration = laboratory.setup, laboratory.configuration
    assert setup.labels == ("blue",) * 8 + ("orange", "purple")
    assert setup.timing.loop_s == 18.0
    assert setup.interventions.batteries_every == 25
    assert setup.evaluation.repeats == 5
    assert setup.camera.fps == 10.0
    assert setup.camera.calibration == str(tmp_path / "camera.json")
    scenario = configuration.scenario
    assert (scenario.agents, scenario.replicas, scenario.control_steps) == (8, 2, 50)
    assert (scenario.arena.width_cm, scenario.arena.height_cm) == (200.0, 225.0)
    assert (configuration.models.parents, configuration.models.offspring) == (10, 10)
    assert (configuration.classifiers.parents, configuration.classifiers.offspring) == (50, 50)
    assert configuration.run.generations == 100


def test_a_setup_survives_its_json(load):
    setup = load(FILE).setup
    assert read_setup(setup.model_dump_json()) == setup


def test_options_come_before_the_file(load):
    laboratory = load(
        FILE, overrides={"run.generations": 7}, labels={"run.generations": "--generations"}
    )
    assert laboratory.configuration.run.generations == 7


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[camera]", "[camra]"), r"`camra` must be a known section; got one \[.*:2\]\. Did you mean `camera`\?"),
        (("[camera]", "[camera]\nfsp = 10"), r"`camera\.fsp` must be a known setting; got 10 .*Did you mean `fps`\?"),
        (('calibration = "camera.json"', ""), r"`camera\.calibration` must be given; got nothing"),
        (('role = "replica"\nmarker = "orange"', 'role = "replcia"\nmarker = "orange"'), r"must be 'agent' or 'replica'; .*'r1'"),
        (('address = "r-purple"', 'address = "r-orange"'), r"`address` must be different for all robots; got 'r-orange' twice"),
        (('address = "r-purple"', ""), r"`address` must be given for a replica; got nothing \[robot 'r2', .*\]"),
        (('marker = "purple"', 'marker = "orange"'), r"`marker` must be a replica's alone; got 'orange'"),
        (('name = "a2"', 'name = "a1"'), r"`name` must be different for all robots; got 'a1' twice"),
        (('calibration = "camera.json"', ""), r"`camera\.calibration` must be given; got nothing.*Calibrate the camera first"),
        (("population = 4", "parents = 2\noffspring = 1"), r"`models` must be a multiple of the 2 replicas.*; got 3 \[.*lab\.toml"),
        (("duration_s = 1.0", "duration_s = 7.5"), r"duration_s` must be at most timing\.execute_s, 7\.0; got 7\.5"),
        (("duration_s = 1.0", "control_interval_s = 0.2"), r"control_interval_s` must be left out, as it follows from camera\.fps"),
        (("population = 4", "population = 4\nhidden = 3"), r"`models\.hidden` must be 0 for robots: .* wheel speeds alone; got 3"),
        (("duration_s = 1.0", 'duration_s = 1.0\n[scenario]\nrepresentation = "morphology"'),
         r"`scenario\.representation` must be 'reactive' for robots: .*; got 'morphology'"),
        (("duration_s = 1.0", 'duration_s = 1.0\n[scenario]\ngrouping = "separated"'),
         r"`scenario\.grouping` must be 'mixed' for robots: .*; got 'separated'"),
        (("generations = 3", "generation = 3"), r"`run\.generation` must be a known setting; .*Did you mean `run\.generations`\?"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_in_one_message(load, change, message):
    assert change[0] in FILE
    with pytest.raises(ConfigurationError, match=message):
        load(FILE.replace(*change, 1))


@pytest.mark.parametrize(
    ("fps", "change", "message"),
    [
        (29.97, ("duration_s = 1.0", ""), r"29\.97 per second \[.*lab\.toml:3\]; got 5\.0 s by default\. Set .* = 5\.005005005\.$"),
        (12.5, ("duration_s = 1.0", "duration_s = 1.0"), r"12\.5 per second .*; got 1\.0 s \[.*lab\.toml:.*\]\. Set .* = 0\.96\.$"),
        (29.97, ("duration_s = 1.0", "duration_s = 7"), r"got 7 s \[.*lab\.toml:.*\]\. Set .* = 6\.973640307\.$"),
    ],
)  # fmt: skip
def test_a_trial_that_ends_between_two_images_is_refused_with_one_that_does_not(
    load, fps, change, message
):
    text = FILE.replace("[camera]", f"[camera]\nfps = {fps}")
    with pytest.raises(
        ConfigurationError,
        match=r"^`scenario\.trial\.duration_s` must be a whole number of images at camera\.fps, ",
    ) as told:
        load(text.replace(*change))
    assert re.search(message, str(told.value))
    followed = str(told.value).rsplit(" = ", 1)[1].rstrip(".")
    trial = load(
        text.replace("duration_s = 1.0", f"duration_s = {followed}")
    ).configuration.scenario.trial
    assert trial.duration_s / trial.control_interval_s == pytest.approx(
        round(float(followed) * fps), abs=1e-6
    )


def test_a_history_that_a_post_evaluation_cannot_use_is_refused(load):
    text = FILE.replace("repeats = 0", "repeats = 1").replace(
        "generations = 3", 'generations = 3\nhistory = "thin"'
    )
    with pytest.raises(
        ConfigurationError, match=r'`run\.history` must be "full" for a post-evaluation; got "thin"'
    ):
        load(text)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"none\.toml"):
        load_laboratory(tmp_path / "none.toml")
