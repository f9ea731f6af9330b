"""What the command that pools runs prints."""

import pytest

from turing_learning.runs import infer, load_run, pool

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.threads": 1,
    "run.history": "thin",
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    parent = tmp_path_factory.mktemp("runs")
    for name, seed, generations in (("seed1", 1, 7), ("seed2", 2, 7), ("longer", 3, 8)):
        infer("aggregation", seed=seed, generations=generations, settings=SMALL, out=parent / name)
    return parent


def test_the_table_is_that_of_the_pool(call, folders):
    runs = [folders / "seed1", folders / "seed2"]
    code, out, err = call("pool", *runs)
    assert (code, err) == (0, "")
    pooled = pool([load_run(run) for run in runs])
    assert [line.rstrip() for line in out.splitlines()[:6]] == str(pooled).splitlines()[:6]
    assert pooled.verdict.meaning in " ".join(out.split())
    assert out.startswith("aggregation, 2 runs, seeds 1, 2, 7 generations: ")


def test_a_study_says_where_its_runs_are(call):
    assert (
        call("study", "aggregation", "--runs", 1, "--out", "s", "--write-slurm", "job.sh")[0] == 0
    )
    code, out, err = call("pool", "s")
    assert (code, out) == (2, "")
    assert err == "error: `RUN` must be a run folder; got s, a study. Its runs are s/runs/*.\n"


@pytest.mark.parametrize(
    ("names", "message"),
    [
        ([], 'Command "pool" parameter RUNS requires an argument.'),
        (["seed1"], "`runs` must be at least 2; got 1."),
        (["seed1", "seed1"], "`runs` must have different seeds; got seed 1 twice ["),
        (
            ["seed1", "longer"],
            "`runs` must be of the same system and configuration; got run.generations = 7 with seed 1 and 8",
        ),
        (["seed1", "."], "`run` must be a run folder; got "),
    ],
)
def test_what_cannot_be_pooled_is_refused(call, folders, names, message):
    code, out, err = call("pool", *[folders / name for name in names])
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {message}")
    assert err.count("\n") == 1
