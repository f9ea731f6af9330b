"""What is told before anything moves."""

import numpy as np
import pytest
from program_laboratory import CALIBRATION, FILE, HOMES, ScriptedLaboratory, new_tracker

from turing_learning.robots import (
    Calibration,
    CameraError,
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

    def look(lab=None, tracker=tracker):
        lab = lab or ScriptedLaboratory(noise=2.0)
        found = inspect(laboratory.setup, laboratory.configuration.scenario, lab.equipment(tracker))
        return {finding.what: finding for finding in found}

    return look


def test_a_laboratory_in_order_is_fine(look):
    found = look()
    assert list(found) == ["replica r1", "replica r2", "camera", "calibration", "markers"]
    assert all(finding.fine for finding in found.values())
    assert found["camera"].text == "448 x 384 pixels, 10.0 images per second"
    assert found["markers"].text == "all 4 in sight, the smallest 42 pixels wide"


def closed(lab):
    def open_link(address):
        if address == "r-purple":
            raise LinkError("`port` must be a serial device; got 'r-purple'.")
        return ScriptedLaboratory.open_link(lab, address)

    lab.open_link = open_link


def no_camera(lab):
    def open_camera():
        raise CameraError("`source` must be a camera or a video that opens; got camera 3.")

    lab.open_camera = open_camera


def slow(lab):
    take = lab.take
    lab.take = lambda: lab.clock.sleep(0.15) or take()


def frozen(lab):
    lab.take()
    lab.frozen = True


@pytest.mark.parametrize(
    ("change", "what", "text"),
    [
        (closed, "replica r2", "`port` must be a serial device; got 'r-purple'."),
        (lambda lab: setattr(lab.bodies[0], "battery", False), "replica r1", "the battery of r1 must be charged; got a low one."),
        (no_camera, "camera", "`source` must be a camera or a video that opens; got camera 3."),
        (lambda lab: setattr(lab, "dead_camera", True), "camera", "got none more"),
        (frozen, "camera", "got the same one again and again"),
        (slow, "camera", "images at 5.00 per second"),
        (lambda lab: setattr(lab, "take", lambda: np.zeros((240, 320, 3), np.uint8)), "camera",
         "must give images (384, 448, 3), as its calibration says; got (240, 320, 3)"),
        (lambda lab: setattr(lab, "covered", (0,)), "markers", "1 blue markers in sight, 2 expected"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_and_the_rest_is_looked_at(look, change, what, text):
    lab = ScriptedLaboratory(noise=2.0)
    change(lab)
    found = look(lab)
    assert text in found.pop(what).text
    assert all(finding.fine for finding in found.values())
    assert ("markers" in found) == (what not in ("camera", "markers"))


def test_a_calibration_that_places_robots_outside_the_arena_is_told(look):
    moved = Calibration(
        CALIBRATION.lens, CALIBRATION.rotation, CALIBRATION.translation + np.array([0.0, 25.0, 0.0])
    )
    tracker = Tracker(TriangleMarkers(), moved, ("blue", "blue", "orange", "purple"))
    found = look(tracker=tracker)
    assert "must place robots inside the arena of 60 x 68 cm" in found["calibration"].text


def test_two_robots_with_the_same_marker_are_told(look, monkeypatch):
    from program_laboratory import ARENA, LABELS

    from turing_learning.robots import EmulatedCamera, Optics

    lab = ScriptedLaboratory(noise=2.0)
    labels = (*LABELS[:3], "orange")
    lab._render = EmulatedCamera(
        CALIBRATION,
        TriangleMarkers(),
        labels,
        arena_cm=ARENA,
        wall_cm=5.0,
        optics=Optics(noise=2.0),
    )
    text = look(lab)["markers"].text
    assert "2 orange markers in sight, 1 expected; 0 purple markers in sight, 1 expected" in text
    assert len(HOMES) == 4
