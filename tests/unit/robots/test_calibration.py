import json
import re
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest
from robot_scenes import LABELS, angle_between, render_prints, scattered

from turing_learning.robots import (
    Board,
    Calibration,
    EmulatedCamera,
    Lens,
    Tracker,
    TriangleMarkers,
    calibrate_lens,
    place_camera,
)

BOARD = Board(square_cm=6.0)
LANDMARKS = {
    k + 1: place for k, place in enumerate(product((12.0, 100.0, 188.0), (12.0, 112.5, 213.0)))
}


@pytest.fixture(scope="module")
def views(camera):
    """A board of 48 x 36 cm, tilted, in all parts of the image."""
    rng = np.random.default_rng(1)
    texture = BOARD.image()
    centers = [
        (45, 40),
        (45, 112),
        (45, 185),
        (100, 40),
        (100, 185),
        (155, 40),
        (155, 112),
        (155, 185),
    ]
    views = []
    for x, y in centers:
        turn, _ = cv2.Rodrigues(rng.uniform(-0.5, 0.5, 3))
        right, down = turn @ [0.0, 48.0, 0.0], turn @ [36.0, 0.0, 0.0]
        corner = np.array([x, y, 60.0]) - 0.5 * (right + down)
        views.append(
            render_prints(camera, [texture], np.array([[corner, corner + right, corner + down]]))
        )
    return views


@pytest.fixture(scope="module")
def lens(views):
    return calibrate_lens(views, BOARD)


@pytest.fixture(scope="module")
def floor(camera):
    return floor_with(camera, LANDMARKS)


def floor_with(camera, landmarks):
    sides = 15.0 * np.array([(-0.5, 0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, -0.5, 0.0)])
    corners = np.array([np.array([*place, 0.0]) + sides for place in landmarks.values()])
    return render_prints(camera, landmark_prints(landmarks), corners)


def landmark_prints(identities):
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    prints = [dictionary.generateImageMarker(identity, 180) for identity in identities]
    return np.array([np.pad(print_, 30, constant_values=255) for print_ in prints])


@pytest.fixture(scope="module")
def found(lens, floor):
    return place_camera(lens, floor, LANDMARKS)


def test_the_page_runs_as_it_stands(camera, views, tmp_path, monkeypatch):
    page = (Path(__file__).parents[3] / "docs" / "robots" / "tracking.md").read_text(
        encoding="utf-8"
    )
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    printed = {
        int(k): (float(x), float(y)) for k, x, y in re.findall(r"(\d): \((\d+), (\d+)\)", block)
    }
    start, step = scattered(np.random.default_rng(2), 10), np.linspace(0, 5, 51)[:, None]
    turned = start[:, 2] + 0.3 * step  # on the spot
    trial = np.stack([*np.broadcast_arrays(start[:, 0], start[:, 1], turned)], axis=-1)
    names = {
        "images_of_the_board": views,
        "image_of_the_floor": floor_with(camera, printed),
        "images_of_a_trial": [camera.render(poses) for poses in trial],
    }
    monkeypatch.chdir(tmp_path)
    exec(block, names)  # noqa: S102 - our own page
    speeds = names["track"].speeds()
    assert (len(printed), len(names["track"].faults), speeds.shape) == (4, 0, (10, 50, 2))
    np.testing.assert_allclose(np.median(speeds, axis=1), np.tile([0.0, 0.3], (10, 1)), atol=0.1)


def test_a_lens_is_found_from_views_of_a_board(lens, true_camera):
    assert lens.error_px < 0.3
    assert lens.camera_matrix[0, 0] == pytest.approx(true_camera.lens.camera_matrix[0, 0], rel=0.02)
    assert lens.distortion[0] == pytest.approx(true_camera.lens.distortion[0], abs=0.03)


def test_the_camera_is_found_from_landmarks_on_the_floor(found, true_camera):
    np.testing.assert_allclose(found.position_cm, true_camera.position_cm, atol=5.0)
    places = np.array(
        [(x, y, 6.0) for x, y in product(np.linspace(10, 190, 7), np.linspace(10, 215, 7))]
    )
    errors = np.hypot(*(found.locate(true_camera.project(places), 6.0) - places[:, :2]).T)
    assert np.median(errors) < 0.1
    assert errors.max() < 0.3


def test_robots_are_tracked_as_accurately_with_what_was_calibrated(camera, found):
    tracker = Tracker(TriangleMarkers(), found, LABELS)
    rng, places, turns = np.random.default_rng(8), [], []
    for _ in range(6):
        truth = scattered(rng, 10)
        seen = tracker.detect(camera.render(truth))
        nearest = np.hypot(*(truth[:, None, :2] - seen.positions[None]).transpose(2, 0, 1))
        assert len(seen.labels) == 10
        places.extend(nearest.min(axis=1))
        turns.extend(np.degrees(angle_between(seen.headings[nearest.argmin(axis=1)], truth[:, 2])))
    assert np.median(places) <= 0.2
    assert np.percentile(places, 95) <= 0.5
    assert np.median(turns) <= 1.5
    assert np.percentile(turns, 95) <= 4


def test_pixels_and_places_are_inverse_at_any_height(true_camera):
    places = np.array([(3.0, 5.0, 6.0), (190.0, 220.0, 6.0), (100.0, 20.0, 6.0)])
    np.testing.assert_allclose(
        true_camera.locate(true_camera.project(places), 6.0), places[:, :2], atol=1e-6
    )


def test_a_calibration_survives_its_file_to_the_last_bit(found, tmp_path):
    path = tmp_path / "camera.json"
    found.save(path)
    loaded = Calibration.load(path)
    assert loaded.lens.image_size == found.lens.image_size
    assert (loaded.rotation == found.rotation).all()
    assert (loaded.translation == found.translation).all()
    assert (loaded.lens.camera_matrix == found.lens.camera_matrix).all()
    assert (loaded.lens.distortion == found.lens.distortion).all()


def test_a_calibration_replaces_a_file_only_if_it_is_told_to(found, tmp_path):
    path = tmp_path / "camera.json"
    path.write_text("mine")
    with pytest.raises(
        FileExistsError,
        match=r"`path` must be a new file; got .*camera\.json. Choose another, or force=True.",
    ):
        found.save(path)
    assert path.read_text() == "mine"
    found.save(path, force=True)
    assert (Calibration.load(path).rotation == found.rotation).all()


def broken(calibration, path, **changes):
    calibration.save(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    return path


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"camera_matrix": [[1, 0], [0, 1]]},
            r"`camera_matrix` must be of shape \(3, 3\); got \(2, 2\) \[.*camera\.json\]",
        ),
        (
            {"distortion": [0, 0, "a", 0, 0]},
            r"`distortion` must be an array of numbers; got .*camera\.json\]",
        ),
        (
            {"translation": None},
            r"`translation` must be an array of numbers; got None \[.*camera\.json\]",
        ),
        (
            {"rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]]},
            r"`rotation` must be a rotation; got \[\[2\.0, 0\.0, 0\.0\]",
        ),
        (
            {"image_size": [0, 960]},
            r"`image_size` must be an integer of at least 1; got 0 \[.*camera\.json\]",
        ),
        (
            {"version": 2},
            r"must be a turing-learning camera calibration of version 1; got something else",
        ),
    ],
)
def test_a_file_that_is_no_calibration_is_refused(true_camera, tmp_path, changes, message):
    path = broken(true_camera, tmp_path / "camera.json", **changes)
    with pytest.raises(ValueError, match=message):
        Calibration.load(path)


def test_a_file_that_is_not_json_is_refused(tmp_path):
    path = tmp_path / "camera.json"
    path.write_text("{")
    with pytest.raises(
        ValueError, match=r"`calibration` must be a JSON file; got .* \[.*camera\.json\]"
    ):
        Calibration.load(path)


def test_too_few_views_of_the_board_are_refused(views):
    with pytest.raises(
        ValueError,
        match=r"in 5 or more views; got 3 such views of 3\. Check that the printed board",
    ):
        calibrate_lens(views[:3], BOARD)


def test_views_of_no_board_are_refused(camera):
    empty = [render_prints(camera, [], np.empty((0, 3, 3)))] * 5
    with pytest.raises(ValueError, match="got 0 such views of 5"):
        calibrate_lens(empty, BOARD)


def test_views_of_several_sizes_are_refused(views):
    with pytest.raises(
        ValueError, match=r"`images` must have one size; got \[\(480, 640, 3\), \(960, 1280, 3\)\]"
    ):
        calibrate_lens([views[0], np.zeros((480, 640, 3), np.uint8)], BOARD)


def test_landmarks_that_are_not_in_sight_are_refused(lens, camera):
    empty = render_prints(camera, [], np.empty((0, 3, 3)))
    with pytest.raises(
        ValueError, match=r"`image` must show 4 or more of the landmarks \[1, 2, .* got \[\]"
    ):
        place_camera(lens, empty, LANDMARKS)


def test_landmarks_whose_places_were_exchanged_are_refused(lens, floor):
    exchanged = LANDMARKS | {1: LANDMARKS[9], 9: LANDMARKS[1]}
    with pytest.raises(
        ValueError,
        match=r"`landmarks` must fit the calibration to 1\.0 pixels .* got \d+\.\d\d\. Measure",
    ):
        place_camera(lens, floor, exchanged)


def test_landmarks_on_one_line_are_refused(lens, floor):
    line = {identity: (100.0, 20.0 * identity) for identity in LANDMARKS}
    with pytest.raises(
        ValueError,
        match=r"`landmarks` must not lie on one line; got those in sight at \[\[100\.0, 20\.0\]",
    ):
        place_camera(lens, floor, line)


def test_a_board_that_bends_is_refused(views, monkeypatch):
    find = Board.find

    def bent(board, image):
        points, pixels = find(board, image)
        return points, pixels + 4 * np.sin(2 * points[:, 1::-1])

    monkeypatch.setattr(Board, "find", bent)
    with pytest.raises(
        ValueError, match=r"`images` must fit the calibration to 1\.0 pixels .* Hold the board flat"
    ):
        calibrate_lens(views, BOARD)


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ({"columns": 2}, "`board` must have 3 x 3 to 100 squares; got 2 columns and 6 rows"),
        ({"square_cm": 0.0}, r"`board\.square_cm` must be a finite number above 0; got 0\.0"),
    ],
)
def test_a_board_that_cannot_be_printed_is_refused(sizes, message):
    with pytest.raises(ValueError, match=message):
        Board(**sizes)


def test_without_opencv_the_extra_is_named(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "cv2", None)
    lens = Lens((10, 10), np.eye(3), np.zeros(5))
    with pytest.raises(
        ImportError,
        match=r"OpenCV must be installed; got no such module\. Run: pip install 'turing-learning\[vision\]'",
    ):
        lens.rays(np.zeros((1, 2)))


def test_a_camera_with_noise_beyond_measure_is_refused(true_camera):
    from turing_learning.robots import Optics

    for settings, message in (
        (
            {"blur_px": 0},
            r"`optics\.blur_px` must be a finite number above 0 and of at most 5; got 0",
        ),
        (
            {"noise": -1},
            r"`optics\.noise` must be a finite number of at least 0 and of at most 30; got -1",
        ),
        (
            {"shade": 1},
            r"`optics\.shade` must be a finite number of at least 0 and of at most 0\.6; got 1",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            EmulatedCamera(true_camera, TriangleMarkers(), LABELS, optics=Optics(**settings))


def test_poses_of_another_number_of_robots_are_refused(camera):
    with pytest.raises(
        ValueError, match=r"`poses` must be of shape \(A, 3\) = \(10, 3\); got \(3, 3\)"
    ):
        camera.render(np.zeros((3, 3)))
