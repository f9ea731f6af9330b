import json
import random
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves", "wide")
SMALL = ["--set", "models.population=8", "--set", "classifiers.population=8", "--threads", "1"]
PROGRAM = """
import sys
mean, sd, seed = float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
print("step,value")
for step in range(8):
    # The difference of two uniform numbers has a variance of 1/6; importing `random` would take most of the time of the program.
    numbers = []
    for _ in range(2):
        seed = (seed * 6364136223846793005 + 1442695040888963407) % 2**64
        numbers.append(seed / 2**64)
    print(f"{step},{mean + sd * 6**0.5 * (numbers[0] - numbers[1])}")
"""


@pytest.fixture
def program(call):
    Path("walk.py").write_text(PROGRAM)
    draw = random.Random(1)
    rows = [f"{run},{step},{draw.gauss(5, 1)}" for run in range(30) for step in range(8)]
    Path("data.csv").write_text("\n".join(["run,step,value", *rows]) + "\n")
    command = f"{sys.executable} -I -S {Path('walk.py').absolute()} {{mean}} {{sd}} {{seed}}"
    ranges = ["--range", "mean=0:10", "--range", "sd=0.1:3:log"]
    return [
        "--simulate-command",
        command,
        *ranges,
        "--series",
        "data.csv",
        "--simulate-columns",
        "value",
    ]


def test_a_program_and_its_series_make_a_run_that_is_resumed(call, program):
    code, out, err = call(
        "infer", *program, *SMALL, "--generations", "2", "--workers", "2", "--out", "run"
    )
    assert (code, err) == (0, "")
    assert "mean" in out
    result = json.loads(Path("run/result.json").read_text())
    assert set(result["interval"]) == {"mean", "sd"}
    assert 'signals = ["value"]' in Path("run/config.toml").read_text()
    assert call("resume", "run")[0] == 0
    quick = ["--samples", "10", "--points", "0", "--recoveries", "0"]
    code, _, err = call("check", "run", *quick)
    assert code == 0
    assert "ahead: fresh classifiers against the estimate" in err


@pytest.mark.parametrize(
    ("lacking", "message"),
    [
        (
            "--series",
            "`--series` must be given for a program; got none. For example: --simulate-command",
        ),
        ("--range", "`--range` must be given for a program"),
        ("--simulate-command", "`--simulate-command` must be given for a program"),
    ],
)
def test_all_of_a_program_is_given(call, program, lacking, message):
    options = list(program)
    while lacking in options:
        place = options.index(lacking)
        del options[place : place + 2]
    code, _, err = call("infer", *options, "--out", "run")
    assert (code, message in err) == (2, True), err


def test_a_program_stands_alone(call, program):
    code, _, err = call("infer", *program, "--fps", "25", "--out", "run")
    assert (code, "`--fps` must be left out for a program and its series" in err) == (2, True), err
    code, _, err = call("infer", "aggregation", "--workers", "2")
    assert (
        code,
        "`--workers` must be left out for simulated robots, whose threads are --threads" in err,
    ) == (2, True), err


@pytest.mark.parametrize("name", ["--cluster", "--dask"])
def test_a_scheduler_of_dask_has_two_names(name, call, program):
    code, _, err = call("infer", *program, *SMALL, "--workers", "2", name, "tcp://x:1")
    assert (code, "`--workers` must be left out beside --cluster" in err) == (2, True), err


def test_what_is_wrong_with_a_series_or_range_names_its_option(call, program):
    lines = Path("data.csv").read_text().splitlines()
    Path("one.csv").write_text("\n".join(lines[:9]) + "\n")
    one = ["one.csv" if option == "data.csv" else option for option in program]
    code, _, err = call("infer", *one, "--trials", "60")
    assert (code, "`--series` must be 2 samples or more" in err) == (2, True), err
    turned = ["mean=10:0" if option == "mean=0:10" else option for option in program]
    code, _, err = call("infer", *turned)
    assert (code, "`--range` must begin with its lower end; got 'mean=10:0'" in err) == (2, True)
