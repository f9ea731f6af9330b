"""Whatever is given: doors reject with their declared errors, commands with one line and exit code 2.

What is of another type than the door takes may end as Python ends it, with a TypeError or an AttributeError.

The suite tries a few cases of each door. By hand, with more of them and other seeds:

    TURING_LEARNING_FUZZ=1000 pytest -n 0 tests/reliability/test_fuzz_doors.py --hypothesis-seed=7
"""

import inspect
import json
import os
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from damage import run
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

import turing_learning as tl
from turing_learning.classifiers import ElmanClassifier
from turing_learning.config import flat_settings
from turing_learning.detection import Detector, detect
from turing_learning.errors import MissingExtraError, RefusedError
from turing_learning.identifiability import Effort
from turing_learning.runs import pool
from turing_learning.store import RunStorageError
from turing_learning.studies import plan_study
from turing_learning.swarm import AGGREGATION, simulate

CASES = int(os.environ.get("TURING_LEARNING_FUZZ", "12"))
DECLARED = (
    RefusedError,
    RunStorageError,
    MissingExtraError,
    MemoryError,
    TypeError,
    AttributeError,
)
SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
}
SMALL |= {"run.history": "thin"}
KEYS = sorted(flat_settings(plan_study("aggregation", runs=1).base))
fuzzed = settings(
    max_examples=CASES, deadline=None, derandomize="TURING_LEARNING_FUZZ" not in os.environ, database=None,
    suppress_health_check=list(HealthCheck), phases=[Phase.explicit, Phase.generate],
)  # fmt: skip

integers = st.sampled_from(
    [0, -1, 1, 2, 3, 2**31, 2**63 - 1, 2**63, 2**64, -(2**63), 10**18, 10**400]
)
floats = st.sampled_from(
    [
        0.0,
        -0.0,
        0.5,
        1.5,
        -1.0,
        1e308,
        1e-308,
        -1e308,
        5e-324,
        float("nan"),
        float("inf"),
        -float("inf"),
    ]
)
texts = st.sampled_from(
    ["", " ", "1", "-1", "1.5", "nan", "inf", "1e308", "1e-308", "true", "none", "thin", "full", "paper", "aggregation",
     "9" * 4301, "[" * 3000, "{" * 3000, '"' * 7, "[1, 2]", "[[1, 2], [3]]", "{a = 1}", "\x00", "a\nb", "\x1b[31m", "\ud800",
     "a" * 5000, "../..", "/", "/dev/null", "~nobody/x", "C:\\x", "%s{0}", "--help", "0x10", "1_0", "\u0661", "2026-01-01"]
) | st.text(max_size=6)  # fmt: skip
arrays = st.sampled_from(
    [np.zeros(0), np.zeros((1, 46)), np.zeros((1, 3, 4)), np.zeros((3, 5, 2)), np.zeros((1, 3, 4)) + 1j, np.array("a"),
     np.array([[None]]), np.full((1, 3, 3), np.nan), np.ma.masked_all((1, 3, 4)), np.full((1, 3, 3), 1e308), np.zeros((2, 2)),
     np.zeros((1, 3, 4), np.float16), np.zeros((1, 3, 4), bool), np.array([1], "M8[s]"), np.zeros((3, 5, 2))[::-1]]
)  # fmt: skip
scalars = st.one_of(
    st.none(), st.booleans(), integers, floats, texts, st.binary(max_size=3), st.builds(object)
)
odd = st.one_of(scalars, scalars, arrays, st.lists(scalars, max_size=3), st.dictionaries(texts, scalars, max_size=2),
                st.just(print), st.just(Path("nowhere")), st.just({1, 2}), st.just(1 + 2j))  # fmt: skip


class EnoughError(Exception):
    """The door has accepted what was given; the work behind it is not done here."""


def enough(*arguments):
    raise EnoughError


def accepted(call, *arguments, **options):
    """Call a door; tell whether it has accepted what was given. Any error that is not declared passes through."""
    try:
        call(*arguments, **options)
    except DECLARED:
        return False
    except EnoughError:
        pass
    return True


def options_of(door, *but):
    """Strategy: one option of a door, and any value."""
    known = [
        name
        for name, each in inspect.signature(door).parameters.items()
        if each.kind != each.VAR_KEYWORD
    ]
    return st.dictionaries(
        st.sampled_from([name for name in known if name not in but]), odd, min_size=1, max_size=2
    )


@pytest.fixture(scope="module", autouse=True)
def place(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("fuzz")
        patch.chdir(folder)
        patch.setenv("COLUMNS", "200")
        yield folder


@pytest.fixture(scope="module")
def finished(place):
    tl.infer(
        "aggregation",
        generations=2,
        seed=1,
        settings=SMALL | {"run.history": "full"},
        threads=1,
        out=place / "run",
    )
    return tl.load_run(place / "run")


@fuzzed
@given(options=options_of(tl.infer, "should_stop", "observer"))
@example(options={"settings": {"run.seed": 10**400}})
@example(options={"out": 5})
@example(options={"models": print})
def test_infer(options):
    base = {
        "scenario": "aggregation",
        "settings": SMALL,
        "threads": 1,
        "force": True,
        "should_stop": lambda: True,
    }
    accepted(tl.infer, **(base | options))


@fuzzed
@given(key=st.sampled_from(KEYS), value=odd)
def test_settings(key, value):
    accepted(plan_study, "aggregation", runs=1, settings=SMALL | {key: value})
    accepted(plan_study, "aggregation", runs=1, settings=SMALL, grid={key: [value]})


@fuzzed
@given(
    options=options_of(
        tl.study,
        "executor",
        "observer",
        "should_stop",
        "cluster",
        "genuine",
        "simulate",
        "parameters",
    )
)
def test_study(options):
    with ThreadPoolExecutor(1) as executor:
        base = {
            "scenario": "aggregation",
            "runs": 1,
            "settings": SMALL,
            "executor": executor,
            "out": "study",
            "force": True,
        }
        options = {
            name: value
            for name, value in options.items()
            if not (name == "runs" and isinstance(value, int) and value > 3)
        }
        accepted(tl.study, **(base | {"generations": 1, "observer": enough} | options))


@fuzzed
@given(options=options_of(simulate))
def test_simulate(options):
    base = {
        "scenario": AGGREGATION,
        "controllers": np.zeros((1, 3, 4)),
        "initial_poses": np.zeros((1, 3, 3)),
        "control_steps": 2,
    }
    accepted(
        simulate, **(base | {name: value for name, value in options.items() if name != "scenario"})
    )


@fuzzed
@given(genomes=odd, samples=odd)
@example(genomes=np.zeros((1, 46)), samples=np.zeros((3, 5, 2))[::-1])
def test_judge(genomes, samples):
    accepted(ElmanClassifier().judge, genomes, np.zeros((1, 2, 2)))
    accepted(ElmanClassifier().judge, np.zeros((1, 46)), samples)


CHECKED = (
    "genuine",
    "groups",
    "recoveries",
    "recovery_generations",
    "seed",
    "workers",
    "timeout_s",
    "force",
    "effort",
    "none",
)


@fuzzed
@given(options=st.dictionaries(st.sampled_from(CHECKED), odd, min_size=1, max_size=2))
def test_check(options, finished):
    accepted(finished.check, **({"stage": enough} | options))
    accepted(
        Effort, **{name: options["seed"] for name in ("samples", "points") if "seed" in options}
    )


@fuzzed
@given(options=options_of(Detector.from_run, "result"), motion=odd)
@example(options={"rule": "unanimous"}, motion=[b"\x9e", "a"])
@example(options={"rule": "unanimous"}, motion=np.ma.masked_all((1, 3, 4)))
def test_detect(options, motion, finished):
    base = {"behaviors": 2, "trials": 1, "threads": 1, "rule": "unanimous"}
    detector = Detector.from_run(finished, **base)
    for door in (detector.judge, detector.p_values, detector.verdicts):
        accepted(door, motion)
    if not any(isinstance(value, int) and value > 3 for value in options.values()):
        accepted(Detector.from_run, finished, **(base | options))
    assert callable(detect)


@fuzzed
@pytest.mark.usefixtures("finished")
@given(path=odd, other=odd)
def test_what_is_stored(path, other):
    for call in (tl.load_run, tl.resume, tl.studies.load_study, tl.studies.resume_study):
        accepted(call, path)
    accepted(pool, path)
    accepted(pool, [tl.load_run("run"), other])


COMMANDS = {
    "infer": ["infer", "aggregation", "--generations", "1", "--threads", "1", "--force", "--out", "cli",
              *(part for key, value in SMALL.items() for part in ("--set", f"{key}={value}"))],
    "study": ["study", "aggregation", "--runs", "1", "--write-slurm", "job.sh", "--out", "clistudy", "--force"],
    "resume": ["resume", "nowhere"], "check": ["check", "nowhere"], "detect": ["detect", "nowhere"], "pool": ["pool"],
    "simulate": ["simulate", "aggregation", "--duration", "1", "--out", "one.html", "--force"], "show": ["show"],
}  # fmt: skip


def options_in_help(command):
    """Return the options of a command, without those that wait for others or print help."""
    found = set(re.findall(r"--[a-z][a-z-]*", run([command, "--help"]).out))
    return sorted(
        found
        - {
            "--help",
            "--version",
            "--cluster",
            "--dask",
            "--generations",
            "--trials",
            "--robots",
            "--runs",
        }
    )


@fuzzed
@given(data=st.data())
def test_commands(data):
    command = data.draw(st.sampled_from(sorted(COMMANDS)))
    option = data.draw(st.sampled_from([*options_in_help(command), "--set", "--nonsense", ""]))
    value = data.draw(texts)
    if option == "--set":
        value = f"{data.draw(st.sampled_from([*KEYS, 'nonsense', '']))}={value}"
    if (option, command) == ("--duration", "simulate") and value not in (
        "",
        "nan",
        "inf",
        "-1",
        "1e308",
        "1e-308",
    ):
        return
    said = run([*COMMANDS[command], *([option] if option else []), value])
    assert said.code in (0, 2), (option, value, said.err)
    if said.code:
        assert said.err.startswith("error: ")
        assert said.err.count("\n") == 1
        json.dumps(said.err)
