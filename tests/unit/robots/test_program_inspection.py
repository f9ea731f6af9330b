"""What is told before anything moves."""

import dataclasses

import numpy as np
import pytest
from program_laboratory import CALIBRATION, FILE, HOMES, ScriptedLaboratory, new_tracker

from turing_learning.robots import (
    Calibration,
    CameraError,
    Equipment,
    LinkError,
    Tracker,
    TriangleMarkers,
    inspect,
    load_laboratory,
)


@pytest.fixture(scope="module")
def tracker():
    return new_tracker()


@pytest.fixture
def look(tracker, tmp_path):
    path = tmp_path / "lab.toml"
    path.write_text(FILE)
    laboratory = load_laboratory(path)

    def look(lab=None, equipment=None, tracker=tracker):
        lab = lab or ScriptedLaboratory(noise=2.0)
        found = inspect(laboratory.setup, laboratory.configuration.scenario, equipment or lab.equipment(), tracker)
        return {finding.what: finding for finding in found}

    return look


def test_a_laboratory_in_order_is_fine(look):
    found = look()
    assert list(found) == ["replica r1", "replica r2", "camera", "calibration", "markers"]
    assert all(finding.fine for finding in found.values())
    assert found["camera"].text == "448 x 384 pixels, 10.0 images per second"
    assert found["markers"].text == "all 4 in sight"


def test_a_port_that_does_not_exist_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    doors = lab.equipment()

    def open_link(address):
        if address == "r-purple":
            raise LinkError("`port` must be a serial device; got 'r-purple'.")
        return doors.open_link(address)

    found = look(lab, dataclasses.replace(doors, open_link=open_link))
    assert not found["replica r2"].fine
    assert "got 'r-purple'" in found["replica r2"].text
    assert found["replica r1"].fine


def test_a_low_battery_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    lab.bodies[0].battery = False
    assert look(lab)["replica r1"].text == "the battery of r1 must be charged; got a low one. Change it."


def test_a_camera_that_does_not_open_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)

    def nothing():
        raise CameraError("`source` must be a camera or a video that opens; got camera 3.")

    found = look(lab, Equipment(lab.clock, lab.open_link, nothing, lab))
    assert found["camera"].text == "`source` must be a camera or a video that opens; got camera 3."
    assert "markers" not in found


def test_a_camera_that_gives_no_images_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    lab.dead_camera = True
    assert "got none more" in look(lab)["camera"].text


def test_a_frozen_camera_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    lab.take()
    lab.frozen = True
    assert "got the same one again and again" in look(lab)["camera"].text


def test_another_rate_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    take = lab.take

    def slow():
        lab.clock.sleep(0.15)
        return take()

    lab.take = slow
    assert "images at 5.00 per second" in look(lab)["camera"].text


def test_images_of_another_size_than_the_calibrations_are_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    lab.take = lambda: np.zeros((240, 320, 3), np.uint8)
    assert "must give images (384, 448, 3), as its calibration says; got (240, 320, 3)" in look(lab)["camera"].text


def test_a_calibration_that_places_robots_outside_the_arena_is_told(look):
    moved = Calibration(CALIBRATION.lens, CALIBRATION.rotation, CALIBRATION.translation + np.array([0.0, 25.0, 0.0]))
    tracker = Tracker(TriangleMarkers(), moved, ("blue", "blue", "orange", "purple"))
    found = look(tracker=tracker)
    assert "must place robots inside the arena of 60 x 68 cm" in found["calibration"].text


def test_two_robots_with_the_same_marker_are_told(look, monkeypatch):
    from program_laboratory import ARENA, LABELS

    from turing_learning.robots import EmulatedCamera, Optics

    lab = ScriptedLaboratory(noise=2.0)
    labels = (*LABELS[:3], "orange")
    lab._render = EmulatedCamera(
        CALIBRATION, TriangleMarkers(), labels, arena_cm=ARENA, wall_cm=5.0, optics=Optics(noise=2.0)
    )
    text = look(lab)["markers"].text
    assert "2 orange markers in sight, 1 expected; 0 purple markers in sight, 1 expected" in text
    assert len(HOMES) == 4


def test_a_marker_that_is_out_of_sight_is_told(look):
    lab = ScriptedLaboratory(noise=2.0)
    lab.covered = (0,)
    assert "1 blue markers in sight, 2 expected" in look(lab)["markers"].text
