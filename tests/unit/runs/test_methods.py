"""The text for a section on methods says what the run was, from its own settings."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.runs._methods import CITATION, methods_text

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")

MANIFEST = {"versions": {"turing-learning": "9.8.7"}, "commit": "0123456789abcdef"}


def drift(parameters, rng):
    """Walks whose speed is the first parameter; the second has no effect."""
    return parameters[:, :1, None] + rng.normal(0, 3, (len(parameters), 12, 1))


@pytest.fixture(scope="module")
def run():
    return tl.infer(
        genuine=drift(np.full((40, 2), 7.0), np.random.default_rng(1)),
        simulate=drift,
        parameters={
            "speed": tl.Parameter(0, 20, unit="cm/s"),
            "inert": tl.Parameter(0.1, 20, scale="log"),
        },
        signals=("pace",),
        trials=60,
        seed=4,
        settings={"run.threads": 1},
    )


def test_it_says_version_samples_signals_ranges_length_and_estimates(run):
    text = methods_text(run, MANIFEST)
    assert "(version 9.8.7, commit 01234567; seed 4)" in text
    assert "32 genuine samples were learned from, 8 held out; each is of 12 steps" in text
    assert "with the signals pace." in text
    assert "sought within speed 0 to 20 cm/s; inert 0.1 to 20, logarithmic" in text
    assert "The run of 60 trials is complete." in text
    low, high = run.interval["speed"]
    assert f"speed (cm/s) {run.estimate['speed']:.3f} [{low:.3f}, {high:.3f}]; inert" in text
    assert "Not identified: inert." in text
    assert f"The run's verdict is: {run.verdict}." in text
    assert text.endswith(f"[1] {CITATION}")


def test_it_says_how_recordings_were_read_and_which_family_imitates_them(run):
    options = {"trajectories": ["/home/me/fish.txt"], "fps": 25.0, "every": 2, "model": "couzin"}
    text = methods_text(run, MANIFEST | {"recording": {"options": options}})
    assert (
        "Recordings (fish.txt) were read at 25 frames per second, with one frame in 2 kept." in text
    )
    assert "Models were of the family couzin, sought within" in text
    assert "/home/me" not in text
    stated = {"recording": {"options": options | {"fps": None, "every": None}}}
    assert "(fish.txt) were read as their files say." in methods_text(run, stated)


@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (12.5, "with 12.5 pixels per cm."),
        (1.0, "with positions in cm."),
        ("unknown", "with positions in pixels, whose scale is unknown."),
    ],
)
def test_a_scale_is_said_in_words(scale, words, run):
    options = {"trajectories": ["fish.txt"], "scale": scale}
    text = methods_text(run, {"recording": {"options": options}})
    assert f"Recordings (fish.txt) were read {words}" in text


def test_a_learned_network_is_no_family(run):
    text = methods_text(run, {"recording": {"options": {"model": "network"}}})
    assert "Models were those of a learned network, sought within" in text


def test_each_run_by_generations_observes_anew_in_generations():
    options = {"parameters": {"speed": (0, 20), "inert": (0, 20)}, "settings": {"run.threads": 1}}
    result = tl.infer(
        genuine=lambda rng: drift(np.full((5, 2), 7.0), rng),
        simulate=drift,
        generations=1,
        **options,
    )
    text = methods_text(result, MANIFEST)
    assert "Genuine samples were observed anew in each generation; each is of 12 steps" in text


def test_of_a_swarm_it_says_trial_signals_and_first_models():
    settings = {"run.threads": 1, "scenario.agents": 2, "scenario.trial.duration_s": 1.0}
    result = tl.infer("aggregation", generations=1, settings=settings)
    text = methods_text(result, MANIFEST)
    title = result.configuration.scenario.title
    assert (
        f"Genuine samples are those of the simulated system {title}; each is of 1 s (10 steps), "
        "with the signals speed (cm/s), turn (rad/s)." in text
    )
    assert "Models were simulated, begun within vl0 -1 to 1; vr0 -1 to 1; vl1" in text


def test_it_names_the_program_that_simulates(run):
    text = methods_text(run, {"command": {"simulate_command": "ants {speed} {seed}"}})
    assert "Models were executed by `ants {speed} {seed}`" in text


def test_the_page_has_it_to_copy(run, tmp_path):
    page = run.report(tmp_path / "page.html").read_text()
    assert "Text for a section on methods" in page
    assert "The run of 60 trials is complete." in page
