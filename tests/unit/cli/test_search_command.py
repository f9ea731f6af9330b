import pytest

SMALL = ["--steps", 2, "--trials", 1, "--finalists", 2, "--final-trials", 2, "--duration", 2, "--threads", 1]


def test_the_best_controllers_are_printed_and_the_table_is_left(call, tmp_path):
    code, out, _ = call("search-controller", "--field-of-view", 60, *SMALL)
    folder = "runs/search-aggregation-view60-steps2-seed1"
    assert code == 0
    assert "round 3 of 3: 2 of 2 controllers" in out
    assert "field of view 60 degrees" in out
    assert "best: " in out
    assert f"table: {folder}/controllers.csv" in out
    assert (tmp_path / folder / "controllers.csv").read_text().count("\n") == 3


def test_the_same_command_does_nothing_twice(call):
    first = call("search-controller", *SMALL, "--out", "here")[1]
    assert call("search-controller", *SMALL, "--out", "here")[1] == first


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--field-of-view", 361], "`field_of_view` must be from 0 to 360 degrees; got 361 [--field-of-view]."),
        (["--scenario", "agregation"], "`scenario` must be a known scenario; got 'agregation'."),
        (["--steps", 1], "`steps` must be an integer from 2 to 1000000; got 1."),
        (["--threads", 0], "`threads` must be an integer of at least 1; got 0 [--threads]."),
    ],
)
def test_what_makes_no_sense_is_refused(call, tmp_path, arguments, message):
    code, out, err = call("search-controller", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {message}")
    assert not list(tmp_path.iterdir())


def test_a_search_that_was_stopped_says_how_to_go_on(call, monkeypatch):
    monkeypatch.setattr("turing_learning.cli._signals.StopRequest.__call__", lambda self: True)
    code, _, err = call("search-controller", *SMALL, "--out", "here")
    assert code == 130
    assert err == "stopped; the same command goes on, in here\n"
