"""What nobody should give is rejected in one message, by errors that are declared, before anything is written."""

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.errors import RefusedError
from turing_learning.runs import RunFolderError, start, trial_replay
from turing_learning.swarm import AGGREGATION

HUGE = 10**400
SMALL = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"out": "a\0b"}, "`run` must be the path of a folder; got 'a\\x00b'"),
        ({"generations": HUGE}, "`run.generations` must be less than or equal to 10000000"),
        ({"generations": 10**5000}, "`run.generations` must be a value of usual size"),
        ({"generations": 10**5000, "trials": 90}, "`trials` must be given without `generations`"),
        (
            {"settings": {"models.population": HUGE}},
            "`models.parents` must be less than or equal to",
        ),
        (
            {"settings": {"run.checkpoint_every": HUGE}},
            "`run.checkpoint_every` must be less than or equal to",
        ),
        (
            {"settings": {"models.initial_low": 1.0}},
            "`models.initial_low` must be below initial_high; got 1.0 and 1.0",
        ),
        (
            {"settings": {"scenario.trial.duration_s": 1e308}},
            "`scenario.trial.duration_s` must be a whole number of",
        ),
        (
            {"settings": {"scenario.trial.duration_s": 1e-308}},
            "`scenario.trial.duration_s` must be a whole number of",
        ),
        (
            {"settings": {"scenario.controller": [1e308, 1, 1, 1]}},
            "`scenario.controller` must be 0 or of a size",
        ),
        (
            {"settings": {"scenario.title": "\ud800"}},
            "`scenario.title` must be a value of usual size, or a text",
        ),
    ],
)
def test_a_run_is_rejected_by_its_door(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    options = {"out": "run", **options, "settings": SMALL | options.get("settings", {})}
    with pytest.raises(RefusedError) as refused:
        tl.infer("aggregation", **options)
    assert message in str(refused.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"parameters": {"a": (HUGE, 10 * HUGE)}}, "`parameters` must have two bounds"),
        ({"samples_per_generation": HUGE}, "`samples_per_generation` must be at most"),
        ({"batches": HUGE}, "`batches` must be at most"),
        ({"title": "\ud800"}, "`scenario.title` must be a value of usual size, or a text"),
    ],
)
def test_a_custom_system_is_rejected_by_its_door(tmp_path, options, message):
    given = {
        "genuine": np.ones((9, 2, 1)),
        "simulate": lambda p, rng: p,
        "parameters": {"a": (0, 1)},
    } | options
    with pytest.raises(ConfigurationError) as refused:
        tl.infer(**given, out=tmp_path / "run")
    assert message in str(refused.value)
    assert not (tmp_path / "run").exists()


def test_what_is_no_path_is_no_run():
    for door in (tl.load_run, tl.resume):
        with pytest.raises(RunFolderError, match="`run` must be the path of a folder; got"):
            door("a\0")
        with pytest.raises(TypeError, match="PathLike"):
            door(None)


def test_doors_of_runs_that_are_there(small, tmp_path):
    result = start(small(history="thin", generations=1), tmp_path / "run")
    with pytest.raises(
        ConfigurationError, match=r"`recoveries` must be an integer of at least 0; got 1\.5"
    ):
        result.check(recoveries=1.5)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robots": 1.5}, "`robots` must be an integer from 1 to 1000; got 1.5"),
        (
            {"duration_s": "x"},
            "`duration` must be a finite number above 0 and of at most 3600; got 'x'",
        ),
        ({"seed": 1.5}, "`seed` must be an integer of at least 0; got 1.5"),
        ({"controller": "abcd"}, "`controller` must be 4 finite numbers"),
        ({"controller": [HUGE] * 4}, "`controller` must be 4 finite numbers"),
        ({"controller": [1e308] * 4}, "`controller` must be at most 1e+06 in size"),
        ({"threads": 1.5}, "`threads` must be an integer of at least 1; got 1.5"),
    ],
)
def test_a_trial_to_look_at_is_rejected_by_its_door(options, message):
    with pytest.raises(ConfigurationError) as refused:
        trial_replay(AGGREGATION, **options)
    assert message in str(refused.value)
