"""Three trackers, one video: the readers give the same positions where the trackers agree. See docs/trajectories.md."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import termites

from turing_learning.trajectories import load_trajectories

PAIRS = [("tracktor", "toxtrac"), ("idtracker", "tracktor"), ("idtracker", "toxtrac")]
matched = cache(termites.match)


def test_tracktor_and_toxtrac_see_the_same_positions():
    distance = matched("tracktor", "toxtrac").distance
    assert np.median(distance) < 1.5
    assert np.mean(distance < 5) > 0.96


@pytest.mark.parametrize("other", ["tracktor", "toxtrac"])
def test_idtracker_sees_a_point_of_the_body_some_pixels_further_back(other):
    ahead, left = termites.along_motion(matched("idtracker", other), other).T
    assert -9 < np.median(ahead) < -6
    assert abs(np.median(left)) < 1
    assert np.mean(np.hypot(ahead - np.median(ahead), left - np.median(left)) < 8) > 0.9


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_no_tracker_exchanges_identities_that_another_keeps(one, other):
    matches = matched(one, other)
    partners = {
        (int(a), int(b))
        for a, b in zip(matches.one[close(matches)], matches.other[close(matches)], strict=True)
    }
    assert len(partners) == 8


def close(matches):
    return matches.distance < 12


def test_the_files_have_the_sizes_that_their_description_states():
    found = {
        name: (termites.load(name).present.shape, int((~termites.load(name).present).sum()))
        for name in termites.FILES
    }
    assert found == {
        "idtracker": ((2800, 8), 74),
        "tracktor": ((2799, 8), 0),
        "toxtrac": ((2760, 8), 520),
    }


def test_the_zebrafish_recording_has_two_jumps_and_is_missing_a_twelfth():
    path = termites.DATA / "zebrafish_video_idtracked.txt"
    recording = load_trajectories(path, fps=25, pixels_per_cm="unknown")
    assert recording.present.shape == (14999, 5)
    assert 1 - recording.present.mean() == pytest.approx(0.086, abs=5e-4)
    assert [
        (jump.individual, jump.frame, int(jump.distance)) for jump in recording.problems.jumps
    ] == [("1", 9754, 236), ("2", 14150, 319)]


def test_the_disagreements_are_those_that_the_documentation_lists():
    listed = Path(__file__).parents[2] / "docs" / "results" / "termites.txt"
    assert listed.read_text(encoding="utf-8") == f"{termites.listing()}\n"
