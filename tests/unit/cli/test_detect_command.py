"""What `detect` prints, and what it refuses."""

import json
import re

import numpy as np
import pytest

from turing_learning.detection import Detector
from turing_learning.runs import load_run

pytestmark = pytest.mark.usefixtures("wide")

SMALL = [
    "--set", "models.population=20", "--set", "classifiers.population=20", "--set", "scenario.agents=2",
    "--set", "scenario.trial.duration_s=1.0", "--threads", "1", "--generations", "10",
]  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory, done):
    """A small run, made by the command line."""
    folder = tmp_path_factory.mktemp("runs") / "run"
    done("infer", "aggregation", *SMALL, "--out", folder)
    return folder


def test_a_demonstration_ranks_every_individual(run, call):
    code, out, err = call("detect", run, "--simulate", 1, "--samples", 4)
    assert (code, err) == (0, "")
    for text in ("individual", "rank", "windows", "score", "p-value", "verdict", "since sample"):
        assert text in out
    rows = dict(re.findall(r"^(\w+ \d) .* (normal|abnormal) ", out, re.MULTILINE))
    assert sorted(rows) == ["agent 1", "agent 2", "planted 1"]
    assert (
        f"{list(rows.values()).count('abnormal')} of 3 abnormal, by windows of 10 steps; ranked by "
        in out
    )
    assert re.search(
        r"each of the 600 normal individuals was judged .*: \d+ came out as abnormal", out
    )
    assert re.search(
        r"On 96 simulated robots .* the classifiers (do not )?beat the baselines; .*judged alike\s+[01]\.\d{3}",
        out,
    )


def test_json_holds_every_ranking(run, call):
    np.savez("motion.npz", samples=np.zeros((2, 3, 10, 2)), individuals=np.array(["[red]", "Bo"]))
    code, out, _ = call("detect", run, "motion.npz", "--false-alarms", "0.05", "--json")
    content = json.loads(out)
    assert code == 0
    assert (content["rule"], content["false_alarms"], content["promised"]) == (
        "judged-alike",
        0.05,
        0.05,
    )
    assert [entry["individual"] for entry in content["individuals"]] == ["[red]", "Bo"]
    assert sorted(entry["rank"] for entry in content["individuals"]) == [1, 2]
    for entry in content["individuals"]:
        assert entry["abnormal"] == (entry["p_value"] <= 0.05)
        assert bool(entry["samples"]) == entry["abnormal"]
    assert {each["by"] for each in content["rankings"]} >= {
        "judged alike",
        "window statistics",
        "motion statistics",
    }
    assert content["by"] == content["rankings"][0]["by"]
    assert (
        content["rankings"][0]["area"] >= max(each["area"] for each in content["rankings"]) - 0.02
    )


def test_a_rule_by_votes_prints_what_it_did(run, call):
    np.save("motion.npy", np.zeros((2, 30, 2)))
    code, out, _ = call(
        "detect", run, "motion.npy", "--rule", "discriminant", "--false-alarms", "0.05", "--json"
    )
    content = json.loads(out)
    assert code == 0
    assert (content["rule"], content["false_alarms"], content["samples"]) == (
        "discriminant",
        0.05,
        3,
    )
    for entry in content["individuals"]:
        assert entry["abnormal"] == (entry["p_value"] <= 0.05)
        assert (entry["since"] is None) != entry["abnormal"]
    code, out, _ = call("detect", run, "motion.npy", "--rule", "fittest")
    assert code == 0
    assert "by 3 samples each of 10 steps; rule fittest" in out


def test_several_files_of_normal_individuals_are_recordings(run, call):
    rng = np.random.default_rng(0)
    for name in ("one", "two", "three"):
        np.save(f"{name}.npy", rng.normal(8, 3, (5, 4, 10, 2)))
    strange = rng.normal(8, 3, (4, 4, 10, 2))
    strange[2] *= 5
    np.save("motion.npy", strange)
    given = [each for name in ("one", "two", "three") for each in ("--genuine", f"{name}.npy")]
    content = json.loads(call("detect", run, "motion.npy", *given, "--json")[1])
    assert content["normal"] == {"recordings": 3, "individuals": 15}
    assert content["promised"] == pytest.approx(1 / 16)
    assert content["individuals"][2]["rank"] == 1
    assert any(
        "0.01 cannot be promised by 15 normal individuals" in remark
        for remark in content["remarks"]
    )
    assert any("judged by the recordings of the others" in remark for remark in content["remarks"])
    code, _, err = call("detect", run, "motion.npy", *given, "--rule", "discriminant")
    assert code == 2
    assert (
        "`--genuine` must be given once with the rule discriminant; got 3. Take --rule judged-alike."
        in err
    )


def test_motion_to_calibrate_with_may_be_given(run, call):
    rng = np.random.default_rng(0)
    for name, speed in (("normal", 8), ("other", -8)):
        np.save(f"{name}.npy", rng.normal(speed, 3, (9, 4, 10, 2)))
    np.save("motion.npy", np.zeros((1, 4, 10, 2)))
    given = ["--genuine", "normal.npy", "--abnormal", "other.npy"]
    code, out, _ = call("detect", run, "motion.npy", *given, "--rule", "discriminant", "--json")
    expected = Detector.from_run(
        load_run(run),
        rule="discriminant",
        genuine=np.load("normal.npy"),
        abnormal=np.load("other.npy"),
    )
    content = json.loads(out)
    assert code == 0
    (verdict,) = expected.verdicts(np.load("motion.npy"))
    found = content["individuals"][0]
    assert (found["score"], found["p_value"]) == (verdict.score, verdict.p_value)
    kept = json.loads(call("detect", run, "motion.npy", "--rule", "discriminant", "--json")[1])[
        "individuals"
    ][0]
    assert found["p_value"] != kept["p_value"]


def test_too_few_genuine_samples_to_calibrate_with_are_told(run, call, caplog):
    np.save("normal.npy", np.random.default_rng(0).normal(8, 3, (9, 1, 10, 2)))
    np.save("motion.npy", np.zeros((1, 1, 10, 2)))
    assert (
        call("detect", run, "motion.npy", "--genuine", "normal.npy", "--rule", "discriminant")[0]
        == 0
    )
    assert (
        "99 genuine samples without a part in the weights (the second half of `genuine`) are needed, and there are 5"
        in caplog.text
    )


def test_the_same_motion_cannot_be_genuine_and_abnormal(run, call):
    np.save("motion.npy", np.random.default_rng(0).normal(8, 3, (9, 4, 10, 2)))
    assert call(
        "detect",
        run,
        "motion.npy",
        "--genuine",
        "motion.npy",
        "--abnormal",
        "motion.npy",
        "--rule",
        "discriminant",
    ) == (
        *(2, ""),
        "error: `abnormal` must be other motion than `genuine`; got 36 samples that are all in `genuine`, too. Give motion of "
        "individuals that behave otherwise.\n",
    )


def test_the_unanimous_rule_states_no_rate_of_false_alarms(run, call):
    code, out, _ = call("detect", run, "--simulate", 1, "--rule", "unanimous", "--json")
    assert code == 0
    assert json.loads(out)["false_alarms"] is None


def test_the_same_seed_gives_the_same_output(run, call):
    first, second = (call("detect", run, "--simulate", 1, "--seed", 3, "--json") for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "`MOTION` must be given, or --simulate; got neither"),
        ("motion.npy --simulate 1", "`MOTION` must be given, or --simulate; got both"),
        (
            "motion.npy --samples 3",
            r"`samples` must be left out beside a file; got 3 \[--samples\]",
        ),
        ("nothing.npy", "`motion` must be a file that can be read; got nothing.npy"),
        ("motion.npy", r"`motion` must be of .* \(any, any, 10, 2\); got \(2, 3, 4, 2\)"),
        ("--simulate 1 --genuine motion.npy", r"`--genuine` must be .* got \(2, 3, 4, 2\)"),
        (
            "good.npy --rule fitest",
            "`rule` must be one of the rules; got 'fitest'. Did you mean `fittest`?",
        ),
        ("good.npy --false-alarms 1", "`false_alarms` must be .* above 0 and below 1; got 1.0"),
        ("good.npy --false-alarms few", "must be a number; got 'few'"),
        ("--simulate 3", "`simulate` must be an integer from 1 to 2; got 3"),
        ("--simulate 1 --samples 0", "`samples` must be an integer from 1 to 1000000000000; got 0"),
        ("--simulate 1 --seed -1", "`seed` must be an integer of at least 0; got -1"),
    ],
)
def test_what_cannot_be_judged_is_refused_in_one_line(arguments, message, run, call):
    np.save("motion.npy", np.zeros((2, 3, 4, 2)))
    np.save("good.npy", np.zeros((2, 3, 10, 2)))
    code, out, err = call("detect", run, *arguments.split())
    assert code == 2
    assert out == ""
    assert re.search(message, err), err
    assert err.startswith("error: ")
    assert err.count("\n") == 1


def test_a_folder_that_is_no_run_is_refused(call):
    code, _, err = call("detect", "nothing", "--simulate", 1)
    assert code == 2
    assert err.startswith("error: `run` must be a run folder; got nothing")


def test_a_run_with_a_thin_history_is_refused_with_advice(call, tmp_path):
    folder = tmp_path / "thin"
    assert (
        call("infer", "aggregation", *SMALL, "--set", "run.history=thin", "--out", folder)[0] == 0
    )
    code, _, err = call("detect", folder, "--simulate", 1)
    assert code == 2
    assert 'with run.history = "thin", which keeps no classifiers' in err
    assert f"turing-learning infer --config {folder}/config.toml --set run.history=full" in err
