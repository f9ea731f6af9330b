"""Comparisons: the ranking, its intervals, and what is resumed."""

import json
import shutil

import numpy as np
import pytest
from walkers import READ, SMALL

import turing_learning as tl
from turing_learning.comparison import Compared, Comparison, Subject, examine_runs
from turing_learning.examination import QUICK
from turing_learning.families import BurstAndCoast, as_recorded
from turing_learning.store import RunFolderError
from turing_learning.systems import CustomSystemError

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")

MINE = """
import numpy as np

def simulate(parameters, rng):
    speeds = parameters[:, 0, None] * (1 + 0.3 * rng.random((len(parameters), 10)))
    return np.stack((speeds, 3 * rng.standard_normal(speeds.shape)), axis=-1)

simulate.parameters = {"speed": (0, 20)}
"""
FEW = {"models.population": 8, "classifiers.population": 8}


def of_samples(name, spread, rng):
    """One model whose samples have another spread than the genuine ones."""
    genuine = rng.standard_normal((40, 12, 2))
    test = tl.test(genuine, spread * rng.standard_normal((40, 12, 2)), examiners=QUICK)
    return Compared(name, test, {"a": 1.0}, {"a": [0.5, 1.5]}, "converged")


def test_intervals_of_differences_are_those_of_both_accuracies():
    rng = np.random.default_rng(3)
    near, far = of_samples("near", 1.3, rng), of_samples("far", 3.0, rng)
    found = Comparison((near, far))
    assert found.difference(near) == (0, 0, 0)
    difference, low, high = found.difference(far)
    assert difference == pytest.approx(far.accuracy - near.accuracy)
    # Zou and Donner: the root of the sum of the squares of the two ends that face each other
    below = (far.accuracy - far.interval[0]) ** 2 + (near.interval[1] - near.accuracy) ** 2
    assert difference - low == pytest.approx(below**0.5)
    assert low < difference < high
    assert "near is harder to tell than far" in " ".join(found.sentences)
    (rows,) = [found.to_json()["models"]]
    assert [row["name"] for row in rows] == ["near", "far"]
    assert rows[1]["telling"][0]["accuracy"] > 0.9
    assert "spread" in far.told_by


@pytest.fixture(scope="module")
def windows(recorded):
    recording = tl.load_trajectories(recorded, fps=10, pixels_per_cm=1, y_axis="up")
    return recording, recording.windows(length_s=1.0, signals=("speed", "turn"))


def test_a_comparison_that_was_stopped_ends_as_one_that_was_not(windows, tmp_path):
    recording, cut = windows
    models = {}
    for name, variation in (("even", 0.1), ("uneven", 0.9)):
        models[name] = as_recorded(BurstAndCoast, recording, cut, variation=variation)
    options = {"generations": 2, "settings": FEW, "threads": 1, "examiners": QUICK, "seed": 4}
    stopped = tl.compare(
        models, genuine=cut, out=tmp_path / "c", should_stop=lambda: True, **options
    )
    assert stopped.unfinished == ("uneven", "even")
    assert not stopped.models
    found = tl.compare(models, genuine=cut, out=tmp_path / "c", **options)
    whole = tl.compare(models, genuine=cut, **options)
    # without the paths of the folders
    assert found.to_dataframe().equals(whole.to_dataframe())
    stored = json.loads((tmp_path / "c" / "result.json").read_text())
    assert stored["models"][0]["accuracy"] == found.models[0].accuracy
    page = (tmp_path / "c" / "report.html").read_text()
    assert "What gives each away" in page
    assert "How well each is told" in page
    with pytest.raises(RunFolderError, match="a comparison of other models, settings"):
        tl.compare(models, genuine=cut, out=tmp_path / "c", **options | {"seed": 5})


def test_a_simulator_that_fails_is_refused_before_any_run_begins(windows, tmp_path):
    recording, cut = windows

    def short(parameters, rng):
        return np.zeros((len(parameters), 7, 2))

    models = {
        "coast": as_recorded(BurstAndCoast, recording, cut),
        "mine": Subject(cut, short, parameters={"a": (0, 1)}),
    }
    with pytest.raises(CustomSystemError, match=r"^mine: .* returned shape \(2, 7, 2\)"):
        tl.compare(models, genuine=cut, out=tmp_path / "c", generations=2, settings=FEW)
    assert not (tmp_path / "c").exists()
    # a folder of something else is refused before anybody is asked
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "notes.txt").touch()
    with pytest.raises(RunFolderError, match=r"notes\.txt"):
        tl.compare(models, genuine=cut, out=tmp_path / "d", generations=2, settings=FEW)


def test_the_genuine_motion_itself_is_not_told(windows, run):
    """A simulator that replays the motion that was learned from passes."""
    _, cut = windows

    def replays(parameters, rng):
        return cut.learning[rng.permutation(len(cut.learning))[: len(parameters)]].copy()

    result = tl.load_run(run)
    subjects = {name: Subject(cut, replays) for name in ("first", "second")}
    found = examine_runs(dict.fromkeys(subjects, result), subjects, examiners=QUICK)
    assert all(model.verdict != "told apart" for model in found.models)
    assert found.control is not None
    subjects["third"] = Subject(cut, lambda models, rng: 9 + replays(models, rng))
    found = examine_runs(dict.fromkeys(subjects, result), subjects, examiners=QUICK)
    assert found.models[-1].name == "third"
    assert found.models[-1].accuracy == 1


def test_the_command_compares_families_and_functions_and_goes_on(
    call, recorded, tmp_path, monkeypatch
):
    (tmp_path / "mine.py").write_text(MINE)
    monkeypatch.syspath_prepend(tmp_path)
    asked = ("compare", recorded, *READ, "--window", "1", "--signals", "speed,turn", *SMALL)
    asked += ("--model", "burst-and-coast", "--model", "mine:simulate", "--range", "speed=0:30")
    code, out, err = call(*asked, "--quick", "--out", "c", "--json")
    assert code == 0, err
    found = json.loads(out)
    assert {"name", "accuracy", "interval", "verdict"} <= found["models"][0].keys()
    assert {model["name"] for model in found["models"]} == {"burst-and-coast", "mine:simulate"}
    assert found["control"]["accuracy"] <= 1
    # the same again, from the folder alone: nothing is inferred anew
    assert call("resume", "c")[0] == 0
    assert json.loads((tmp_path / "c" / "result.json").read_text()) == found
    code, out, err = call("show", "c")
    assert code == 0, err
    assert {"burst-and-coast", "mine:simulate", "control", "runs:"} <= {*out.split()}
    assert found["sentences"][0].split(",")[0] in " ".join(out.split())
    # nor where the recording has moved
    moved = shutil.copy(recorded, tmp_path / "moved.csv")
    assert call("compare", moved, *asked[2:], "--quick", "--out", "c")[0] == 0
    code, _, err = call(*asked, "--quick", "--out", "c", "--smooth", "3")
    assert code == 2
    assert "a comparison of other models, settings, ranges, simulators or recordings" in err
    # a run of a function is opened as those of families are, but says nowhere where animals are
    assert call("game", "c/runs/mine-simulate", "--pairs", "1")[0] == 0
    code, _, err = call("simulate", "c/runs/mine-simulate", "--out", "animals.csv")
    assert code == 2
    assert "must be a family of models, which says where everybody is" in err
    both = ("c/runs/burst-and-coast", "c/runs/mine-simulate")
    code, out, err = call("compare", *both, "--quick", "--json", "--out", "page.html")
    assert code == 0, err
    assert "--seed 1 --quick" in (tmp_path / "page.html").read_text()
    again = json.loads(out)
    assert [model["accuracy"] for model in again["models"]] == [
        model["accuracy"] for model in found["models"]
    ]


def test_runs_with_other_signals_are_compared_in_all_of_them(call, run, recorded):
    options = ("--trajectories", recorded, *READ, "--model", "couzin", "--window", "1")
    assert call("infer", *options, *SMALL, "--out", "couzin")[0] == 0
    code, out, err = call("compare", run, "couzin", "--quick", "--json")
    assert code == 0, err
    assert {model["name"] for model in json.loads(out)["models"]} == {"walk", "couzin"}


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ((), "`--model` must be given twice or more often; got 0"),
        (("--model", "couzin", "--model", "boid"), "Did you mean `boids`?"),
        (("--model", "couzin", "--model", "couzin"), "`--model` must be given once for each model"),
        (
            ("--model", "couzin", "--model", "math:cos"),
            "must say its parameters and their ranges by an attribute `parameters`; got none [math:cos]",
        ),
        (
            ("--model", "couzin", "--model", "boids", "--range", "sped=0:1"),
            "`--range` must name a parameter of one of the models",
        ),
    ],
)
def test_what_cannot_be_compared_is_refused_in_a_line(call, recorded, more, message):
    code, _, err = call("compare", recorded, *READ, *more)
    assert code == 2
    assert message in err


def models_of(windows, highest):
    """Two models of one family, whose speed is searched up to `highest`."""
    recording, cut = windows
    models = {}
    for name, variation in (("even", 0.1), ("uneven", 0.9)):
        family = as_recorded(BurstAndCoast, recording, cut, variation=variation)
        ranges = dict(family.parameters) | {"speed": (0, highest)}
        models[name] = Subject(cut, family, parameters=ranges)
    return models


STOPPED = {"generations": np.int64(2), "settings": FEW, "threads": 1, "should_stop": lambda: True}


def test_other_ranges_are_another_comparison(windows, tmp_path):
    out = tmp_path / "c"
    assert tl.compare(models_of(windows, 20), out=out, **STOPPED).unfinished
    assert tl.compare(models_of(windows, 20), out=out, **STOPPED).unfinished
    with pytest.raises(RunFolderError, match="a comparison of other models, settings, ranges"):
        tl.compare(models_of(windows, 5), out=out, **STOPPED)
    # the same ranges, but individuals of one family that vary otherwise
    even, uneven = models_of(windows, 20).values()
    with pytest.raises(RunFolderError, match="settings, ranges, simulators or recordings"):
        tl.compare({"even": uneven, "uneven": even}, out=out, **STOPPED)


@pytest.mark.parametrize("force", [False, True])
def test_runs_of_nobody_are_neither_taken_over_nor_removed(windows, tmp_path, force):
    precious = tmp_path / "c" / "runs" / "even" / "result.json"
    precious.parent.mkdir(parents=True)
    precious.touch()
    with pytest.raises(RunFolderError, match="be a new or empty folder"):
        tl.compare(models_of(windows, 20), out=tmp_path / "c", force=force, **STOPPED)
    assert precious.exists()
