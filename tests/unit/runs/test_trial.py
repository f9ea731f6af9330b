import errno

import pytest

import turing_learning.report
from turing_learning.config import ConfigurationError
from turing_learning.runs import trial_replay, write_trial
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING


def test_a_trial_has_the_robots_and_frames_that_were_asked_for():
    replay = trial_replay(AGGREGATION, robots=4, duration_s=2.0)
    assert replay.frames == 11
    assert replay.duration_s == pytest.approx(2.0)
    assert replay.swarms[0].robots == 4
    assert not replay.swarms[0].is_replica.any()


def test_a_given_controller_is_executed():
    still = trial_replay(OBJECT_CLUSTERING, [0.0] * 6, robots=2, duration_s=1.0)
    assert (still.swarms[0].poses[0, :2, :2] == still.swarms[0].poses[-1, :2, :2]).all()
    assert still.swarms[0].is_replica.all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"controller": [1.0]},
            r"`controller` must be 4 finite numbers \(vl0, vr0, vl1, vr1\); got \[1.0\].",
        ),
        ({"controller": [1.0, 1.0, 1.0, float("nan")]}, "`controller` must be 4 finite numbers"),
        ({"robots": 0}, "`robots` must be an integer from 1 to 1000; got 0."),
        (
            {"duration_s": 0.0},
            "`duration` must be a finite number above 0 and of at most 3600; got 0.",
        ),
        (
            {"duration_s": float("nan")},
            "`duration` must be a finite number above 0 and of at most 3600; got nan.",
        ),
        (
            {"duration_s": 0.01},
            r"`duration` must be a whole number of control intervals of 0\.1 s; got 0\.01\.",
        ),
        (
            {"duration_s": 3.05},
            r"`duration` must be a whole number of control intervals of 0\.1 s; got 3\.05\.",
        ),
        ({"threads": 0}, "`threads` must be an integer of at least 1; got 0."),
        ({"seed": -1}, "`seed` must be an integer of at least 0; got -1."),
    ],
)
def test_a_trial_that_cannot_be_is_refused(arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        trial_replay(AGGREGATION, **arguments)


@pytest.fixture(scope="module")
def replay():
    return trial_replay(AGGREGATION, robots=2, duration_s=1.0)


@pytest.mark.parametrize(
    ("suffix", "head"), [(".html", b"<!"), (".gif", b"GIF8"), (".MP4", b"ftyp")]
)
def test_the_suffix_says_what_is_written(replay, suffix, head, tmp_path):
    if suffix == ".MP4":
        pytest.importorskip("av")
    path = write_trial(replay, tmp_path / f"a{suffix}")
    assert head in path.read_bytes()[:12]


def test_a_trial_is_not_written_over_a_file_unless_forced(replay, tmp_path):
    path = tmp_path / "a.html"
    path.write_text("mine")
    with pytest.raises(
        ConfigurationError,
        match=r"`out` must be a file that does not exist; got .*a.html. Choose another",
    ):
        write_trial(replay, path)
    assert path.read_text() == "mine"
    write_trial(replay, path, force=True)
    assert path.read_text(encoding="utf-8") != "mine"


def test_an_unknown_suffix_is_refused(replay, tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"`out` must end with one of .html, .gif, .mp4; got .*a.txt"
    ):
        write_trial(replay, tmp_path / "a.txt")


def test_a_folder_that_is_missing_is_refused(replay, tmp_path):
    with pytest.raises(
        ConfigurationError,
        match=r"can be written; got .* \(there is no folder .*no\)\. Choose another",
    ):
        write_trial(replay, tmp_path / "no" / "a.html")


def test_a_name_that_no_file_can_have_is_refused(replay, tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"can be written; got .*\.html \(File name too long\)"
    ):
        write_trial(replay, tmp_path / f"{'a' * 300}.html")


def test_a_file_that_cannot_be_written_is_refused(replay, tmp_path, monkeypatch):
    def full(page, path):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(turing_learning.report, "write_page", full)
    with pytest.raises(
        ConfigurationError, match=r"can be written; got .*a\.html \(No space left on device\)"
    ):
        write_trial(replay, tmp_path / "a.html")
