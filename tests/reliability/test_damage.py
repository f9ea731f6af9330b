"""Damaged files of runs and studies: no wrong number in silence, no traceback. All cases, by hand: damage.py."""

import random

import pytest
from damage import DAMAGES, OF, SILENT, case, files_of, prepare, stable

SEED, CASES = 5, 60
FOLDERS = {
    "swarm": ("show", "load_run", "resume"),
    "trials": ("show", "load_run"),
    "study": ("show",),
}


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    """Return a function that damages one file and calls one door."""
    with pytest.MonkeyPatch.context() as patch:
        place = tmp_path_factory.mktemp("damaged")
        patch.chdir(place)
        patch.setenv("COLUMNS", "200")
        references = prepare(place, FOLDERS)
        yield place, references


def test_no_damage_gives_wrong_numbers_in_silence_or_a_traceback(damaged):
    place, references = damaged
    cases = [
        (folder, name, how, door)
        for folder, doors in FOLDERS.items()
        for name in files_of(place, folder)
        for how in DAMAGES
        for door in doors
    ]
    assert set(FOLDERS) < set(OF)
    found = {
        stable(each): case(place, references, *each)
        for each in random.Random(SEED).sample(cases, CASES)
    }
    assert {each: kind for each, kind in found.items() if kind not in SILENT} == {}
    assert set(found.values()) == set(
        SILENT
    )  # each outcome has occurred: the damage does something
