"""A run that has not moved, on the command line."""

import re

import pytest

SHORT = [
    "--generations", "1", "--threads", "1", "--set", "models.population=8", "--set", "classifiers.population=8",
    "--set", "scenario.agents=2", "--set", "scenario.trial.duration_s=1.0",
]  # fmt: skip


@pytest.mark.usefixtures("wide")
def test_the_interval_is_a_dash_and_it_is_said_why(call):
    code, out, _ = call("infer", "aggregation", *SHORT, "--out", "run")
    assert code == 0
    assert [row.split()[2] for row in out.splitlines() if re.match(r"v[lr]\d ", row)] == ["-"] * 4
    assert (
        "Verdict: still moving. The models had not settled when the run ended: run longer. Such a run states no interval."
        in out
    )
    assert "nan" not in out
    assert "null" not in out
