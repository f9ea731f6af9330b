"""Wrong poses, and robots that are exchanged, are noticed within ten trials; right laboratories are left alone."""

import pytest
from wrong_tracks import WRONG, found_at


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.__name__)
def test_what_is_wrong_is_found_within_ten_trials_and_named(wrong):
    for seed in range(4):
        number, fault = found_at(seed, wrong)
        assert number, seed
        assert WRONG[wrong] in fault


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"lag": 3},
        {"spread": 0.1},
        {"noise_cm": 0.1, "noise_rad": 0.03},
        {"agents": 1, "replicas": 1},
        {"controller": (-0.7, -1.0, 1.0, -1.0)},
        {"controller": (0.5, 0.5, 0.5, 0.5)},
        {"controller": (0.0, 0.0, 0.0, 0.0)},
    ],
    ids=str,
)
def test_nothing_is_found_in_right_laboratories(options):
    assert [found_at(seed, count=12, **options) for seed in range(100, 103)] == [(0, "")] * 3
