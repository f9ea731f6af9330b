import re
from pathlib import Path

import numpy as np
import pytest

import turing_learning as tl

pytestmark = pytest.mark.usefixtures("wide")


def write_walk(path, frames=300, individuals=3, seed=0):
    """Write a plain table in pixels, with a column that is not read."""
    places = np.cumsum(np.random.default_rng(seed).normal(1, 1, (frames, individuals, 2)), axis=0)
    rows = [
        f"{t},{who},{x:.2f},{y:.2f},0.3"
        for t, each in enumerate(places)
        for who, (x, y) in enumerate(each)
    ]
    Path(path).write_text("\n".join(["frame,track,x,y,area", *rows]) + "\n")


def test_look_says_how_a_file_is_read_and_writes_a_page(call):
    write_walk("fish.csv")
    code, out, err = call(
        "look", "fish.csv", "--fps", "25", "--pixels-per-cm", "10", "--y-axis", "down"
    )
    assert (code, err) == (0, "")
    lines = {line.partition("  ")[0]: line.partition("  ")[2].strip() for line in out.splitlines()}
    assert lines["read from"] == "frame = frame, id = track, x = x, y = y"
    assert lines["not read"] == "area"
    assert lines["frame rate"] == "25 per second, given"
    assert lines["scale"] == "10 pixels per cm"
    assert lines["y points"] == "down in the file, as given"
    assert lines["individuals"] == "3, at most 3 at once: 0, 1, 2"
    assert lines["speed"].startswith("median ")
    page = Path("fish-look.html").read_text()
    for part in ("tracks", "presence", "speed", "turn"):
        assert f'id="{part}-' in page
    # distributions answer to the pointer, as curves do
    assert page.count("share in each of 60 bins&quot;") == 2
    assert "10 pixels per cm" in page


def test_look_marks_what_nobody_states(call):
    write_walk("fish.csv")
    code, out, _ = call("look", "fish.csv")
    assert code == 0
    assert "1 per second, NOT STATED: say it" in out
    assert "unknown: positions stay in pixels" in out
    assert "up in the file, NOT STATED: say it" in out


def test_a_page_of_look_is_replaced_and_no_other_file(call):
    write_walk("fish.csv")
    assert call("look", "fish.csv")[0] == call("look", "fish.csv")[0] == 0
    Path("fish-look.html").write_text("mine")
    code, _, err = call("look", "fish.csv")
    assert code == 2
    assert "fish-look.html" in err
    assert call("look", "fish.csv", "--force")[0] == 0


def test_several_files_have_a_page_each(call):
    write_walk("a.csv")
    write_walk("b.csv", seed=1)
    assert call("look", "a.csv", "b.csv")[0] == 0
    assert Path("a-look.html").exists()
    assert Path("b-look.html").exists()
    code, _, err = call("look", "a.csv", "b.csv", "--out", "c.html")
    assert (code, "`--out` must be left out for several files" in err) == (2, True)


def test_many_jumps_and_gaps_are_summed_up(call):
    rng = np.random.default_rng(0)
    places = np.cumsum(rng.normal(1, 0.2, (400, 12, 2)), axis=0)
    places[::40] += rng.uniform(300, 400, (10, 12, 2))
    rows = [
        f"{t},{who},{x:.2f},{y:.2f}"
        for t, each in enumerate(places)
        for who, (x, y) in enumerate(each)
        if (t * 7 + who) % 11
    ]
    Path("fish.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    recording = tl.load_trajectories("fish.csv", fps=25, pixels_per_cm=1, y_axis="up")
    lines = str(recording.check()).splitlines()
    assert sum("jump" in line for line in lines) <= 2
    assert sum("missing" in line for line in lines) == 1
    problems = recording.check()
    assert f"{len(problems.jumps)} jumps of " in problems.described_jumps
    assert (
        f"{sum(problems.missing.values())} positions of all individuals missing ("
        in problems.described_gaps
    )


@pytest.mark.parametrize(
    ("change", "said", "line"),
    [
        (
            lambda places: places,
            {"fps": 0.04},
            "a frame rate of 0.04 per second: see whether times are in s",
        ),
        (
            lambda places: places,
            {"fps": 25, "pixels_per_cm": 1e-4},
            r"a typical speed of [0-9.]+e\+05 cm/s, [0-9.]+ km/s",
        ),
        (
            lambda places: np.round(places / 100) * 100,
            {"fps": 25},
            "half of all steps or more are 0",
        ),
    ],
)
def test_what_can_hardly_be_true_is_said(change, said, line, tmp_path, caplog):
    places = change(100 + np.cumsum(np.random.default_rng(0).normal(1, 1, (300, 3, 2)), axis=0))
    tl.load_trajectories(places, **{"pixels_per_cm": 1, "y_axis": "up"} | said)
    assert any(re.search(line, message) for message in caplog.messages)


def test_individuals_of_a_moment_are_named(caplog):
    places = np.cumsum(np.random.default_rng(0).normal(1, 1, (300, 3, 2)), axis=0)
    places[4:, 1] = np.nan
    tl.load_trajectories(places, fps=25, pixels_per_cm=1, y_axis="up")
    assert "1 of 3 individuals are there for 5 frames or fewer: 2" in caplog.text


def test_in_a_notebook_a_look_shows_facts_and_figures():
    places = np.cumsum(np.random.default_rng(0).normal(1, 1, (300, 3, 2)), axis=0)
    look = tl.load_trajectories(places, fps=25, pixels_per_cm=1, y_axis="up").look()
    markup = look._repr_html_()
    assert markup.count("<svg") == 4
    assert "Nothing odd was found" in markup
