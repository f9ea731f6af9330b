import math
import re

import cv2
import numpy as np
import pytest
from robot_scenes import LABELS, angle_between, scattered

from turing_learning.robots import (
    ArucoMarkers,
    EmulatedCamera,
    RoundMarkers,
    Track,
    Tracker,
    TriangleMarkers,
    compare_labels,
)


def follow_all(tracker, images):
    tracker.start()
    return [tracker.follow(image) for image in images]


@pytest.fixture(scope="module")
def images(camera, poses):
    return [camera.render(pose) for pose in poses]


def test_positions_and_headings_are_found_to_the_required_accuracy(camera, tracker):
    rng = np.random.default_rng(11)
    places, turns = [], []
    for _ in range(24):
        truth = scattered(rng, 10)
        tracker.start()
        sighting = tracker.follow(camera.render(truth))
        assert sighting.present.all()
        assert sighting.faults == ()
        order = np.argsort(
            np.hypot(*(truth[:, None, :2] - sighting.poses[None, :, :2]).transpose(2, 0, 1)), axis=1
        )[:, 0]
        places.extend(np.hypot(*(truth - sighting.poses[order])[:, :2].T))
        turns.extend(np.degrees(angle_between(truth[:, 2], sighting.poses[order, 2])))
    assert np.median(places) <= 0.2
    assert np.percentile(places, 95) <= 0.5
    assert np.median(turns) <= 1.5
    assert np.percentile(turns, 95) <= 4
    assert np.max(turns) < 90


def test_individuals_keep_their_numbers_while_they_move(tracker, images, poses):
    track = tracker.track(images)
    assert track.complete
    assert track.faults == ()
    assert np.abs(track.poses[..., :2] - poses[..., :2]).max() < 0.5


def test_a_track_gives_the_signed_speeds_of_the_robots(tracker, images, poses):
    speeds = tracker.track(images).speeds()
    turns = np.diff(poses[..., 2], axis=0).T / 0.1
    steps = -np.hypot(*np.diff(poses[..., :2], axis=0).transpose(2, 0, 1)).T / 0.1
    assert speeds.shape == (10, 11, 2)
    assert np.abs(speeds[..., 0] - steps).mean() < 0.5
    assert np.abs(speeds[..., 1] - turns).mean() < 0.2


def test_fifty_one_images_make_fifty_samples(tracker, camera, poses):
    still = (camera.render(poses[0]) for _ in range(51))
    assert tracker.track(still).speeds().shape == (10, 50, 2)


def test_the_tip_of_the_triangle_points_to_the_back(tracker, camera, poses):
    truth = poses[0].copy()
    truth[8] = [100.0, 100.0, 0.0]
    image = camera.render(truth).astype(int)
    tracker.start()
    assert angle_between(tracker.follow(image.astype(np.uint8)).poses[8, 2], 0.0) < 0.1
    orange = np.argwhere((image[..., 2] - image[..., 0]) > 100)
    middle = 0.5 * (orange.min(axis=0) + orange.max(axis=0))
    assert (
        orange.mean(axis=0)[0] > middle[0]
    )  # rows run along x: most paper is ahead, the thin tip behind


def test_a_covered_marker_is_a_gap_and_the_robot_is_recognized_after_it(tracker, camera, poses):
    images = [
        camera.render(pose, covered={3} if 4 <= k < 7 else ()) for k, pose in enumerate(poses)
    ]
    track = tracker.track(images)
    assert np.argwhere(~track.present).tolist() == [[4, 3], [5, 3], [6, 3]]
    assert [(fault.frame, fault.kind) for fault in track.faults] == [(4, "marker missing")]
    assert "individual 3 (blue) is out of sight, last seen at" in track.faults[0].text
    assert np.abs(track.poses[7:, 3, :2] - poses[7:, 3, :2]).max() < 0.5


@pytest.mark.parametrize("side", [-1, 1])
def test_a_marker_of_which_half_is_covered_is_a_gap_and_no_guess(
    true_camera, camera, tracker, poses, side
):
    truth = poses[0].copy()
    truth[8] = [100.0, 100.0, 0.0]
    image = camera.render(truth)
    corners = [
        (x, 100.0 + y * side, 6.0)
        for x, y in ((96.0, 0.0), (96.0, 4.0), (104.0, 4.0), (104.0, 0.0))
    ]
    cv2.fillPoly(
        image, [np.rint(true_camera.project(np.array(corners))).astype(np.int32)], (60, 60, 60)
    )
    assert "orange" not in tracker.detect(image).labels


def test_a_gap_repeats_the_last_pose_and_is_no_sample(tracker, camera, poses):
    track = tracker.track(
        [camera.render(pose, covered={9} if k == 5 else ()) for k, pose in enumerate(poses)]
    )
    assert (track.poses[5, 9] == track.poses[4, 9]).all()
    with pytest.raises(
        ValueError, match=r"got no sight of individual 9 \(purple\) at frame 5\. Repeat the trial"
    ):
        track.speeds()


def test_a_marker_covered_for_too_long_is_lost(true_camera, camera, poses):
    tracker = Tracker(TriangleMarkers(), true_camera, LABELS, maximum_gap=2)
    track = tracker.track(
        [camera.render(pose, covered={0} if 2 <= k < 6 else ()) for k, pose in enumerate(poses)]
    )
    assert (2, "marker missing") in [(fault.frame, fault.kind) for fault in track.faults]
    assert (4, "lost") in [(fault.frame, fault.kind) for fault in track.faults]
    assert not track.present[2:, 0].any()


def test_a_robot_that_is_carried_away_is_named(tracker, camera, poses):
    moved = poses.copy()
    moved[6:, 8, :2] = [100.0, 112.0]
    moved[:, 8, 2] = 0.0
    moved[:6, 8, :2] = [30.0, 30.0]
    fault = tracker.track([camera.render(pose) for pose in moved]).faults[0]
    assert (fault.frame, fault.kind) == (6, "carried away")
    assert "individual 8 (orange) cannot have moved 107." in fault.text


@pytest.mark.parametrize("degrees", [90, 180])
def test_a_robot_that_is_turned_by_hand_is_named(tracker, camera, poses, degrees):
    turned = poses.copy()
    turned[6:, 8, 2] += math.radians(degrees)
    fault = tracker.track([camera.render(pose) for pose in turned]).faults[0]
    assert (fault.frame, fault.kind) == (6, "carried away")
    text = r"individual 8 \(orange\) cannot have moved .* cm and turned -?\d+ degrees like this: it was carried, or turned by"
    assert re.match(text, fault.text)


def test_faster_robots_may_go_farther_and_turn_more(true_camera, camera, poses):
    fast = Tracker(
        TriangleMarkers(), true_camera, LABELS, maximum_speed_cm_s=60.0, maximum_turn_rad_s=30.0
    )
    assert fast.track([camera.render(pose) for pose in poses[::4]]).faults == ()


def test_a_frozen_camera_is_noticed_at_the_first_repeated_image(tracker, images):
    track = tracker.track([*images[:5], images[4], images[4], *images[5:8]])
    assert [(fault.frame, fault.kind) for fault in track.faults] == [(5, "frozen camera")]
    assert np.flatnonzero(~track.present.all(axis=1)).tolist() == [5, 6]


def test_a_marker_that_is_missing_from_the_start_is_named(tracker, camera, poses):
    (sighting,) = follow_all(tracker, [camera.render(poses[0], covered={9})])
    assert (
        "0 purple markers in the first image, 1 expected: individual 9 (purple) is missing"
        in sighting.faults[0].text
    )


def test_two_robots_with_the_same_marker_are_named(true_camera, tracker, poses):
    wrong = EmulatedCamera(true_camera, TriangleMarkers(), ("blue",) * 8 + ("orange", "orange"))
    (sighting,) = follow_all(tracker, [wrong.render(poses[0])])
    assert {fault.kind for fault in sighting.faults} == {"marker missing", "surplus marker"}
    assert compare_labels(LABELS, tracker.detect(wrong.render(poses[0])).labels) == [
        "2 orange markers in sight, 1 expected",
        "0 purple markers in sight, 1 expected",
    ]


def test_forty_round_markers_are_followed_by_position(true_camera):
    truth = scattered(np.random.default_rng(5), 40)
    truth = truth[np.lexsort((truth[:, 1], truth[:, 0]))]
    labels = ("green",) * 40
    camera = EmulatedCamera(true_camera, RoundMarkers(), labels)
    track = Tracker(RoundMarkers(), true_camera, labels).track(
        [camera.render(truth + np.array([0.0, 0.3 * k, 0.0])) for k in range(3)]
    )
    assert track.complete
    distance = np.hypot(
        *(track.poses[2, :, None, :2] - (truth + np.array([0.0, 0.6, 0.0]))[None, :, :2]).transpose(
            2, 0, 1
        )
    )
    assert distance.min(axis=1).max() < 0.2
    assert len(set(distance.argmin(axis=1))) == 40


def test_robots_that_touch_each_other_and_the_walls_are_told_apart(camera, tracker):
    rows = [
        (4.0 + 7.0 * k + 3.5 * (row % 2), 4.0 + 6.1 * row) for row in range(3) for k in range(4)
    ]
    truth = np.array([(x, y, 0.7 * k) for k, (x, y) in enumerate(rows[:10])])
    seen = tracker.detect(camera.render(truth))
    distance = np.hypot(*(truth[:, None, :2] - seen.positions[None]).transpose(2, 0, 1))
    nearest = distance.argmin(axis=1)
    assert sorted(nearest) == list(range(10))
    assert distance.min(axis=1).max() < 0.2
    assert angle_between(truth[:, 2], seen.headings[nearest]).max() < math.radians(5)
    assert tuple(seen.labels[k] for k in nearest) == LABELS


def test_colored_things_that_are_no_markers_are_not_taken_for_robots(camera, tracker, poses):
    image = camera.render(poses[0])
    cv2.rectangle(image, (5, 5), (60, 140), (200, 80, 20), -1)
    cv2.circle(image, (1200, 900), 3, (30, 120, 235), -1)
    assert sorted(tracker.detect(image).labels) == sorted(LABELS)


def test_a_marker_of_a_color_that_nobody_wears_is_named(true_camera, tracker, poses):
    other = EmulatedCamera(true_camera, TriangleMarkers(), ("blue",) * 8 + ("orange", "green"))
    assert compare_labels(LABELS, tracker.detect(other.render(poses[0])).labels) == [
        "1 green markers in sight, 0 expected",
        "0 purple markers in sight, 1 expected",
    ]


def test_positions_alone_make_no_samples(true_camera):
    track = Track(np.zeros((2, 1, 3)), np.ones((2, 1), bool), ("green",), 0.1, has_headings=False)
    with pytest.raises(
        ValueError,
        match="`markers` must show headings for speeds to be signed; got positions alone",
    ):
        track.speeds()


def test_aruco_markers_show_who_and_where(true_camera):
    labels = tuple(str(k) for k in range(10))
    markers = ArucoMarkers()
    camera = EmulatedCamera(true_camera, markers, labels)
    tracker = Tracker(markers, true_camera, labels)
    truth = scattered(np.random.default_rng(6), 10)
    sighting = tracker.follow(camera.render(truth))
    assert sighting.present.all()
    assert np.abs(sighting.poses[:, :2] - truth[:, :2]).max() < 0.3
    assert angle_between(sighting.poses[:, 2], truth[:, 2]).max() < math.radians(8)


def test_an_image_of_another_size_is_refused(tracker):
    with pytest.raises(
        ValueError,
        match=r"`image` must be an image \(960, 1280, 3\) of uint8; got \(480, 640, 3\) of",
    ):
        tracker.follow(np.zeros((480, 640, 3), np.uint8))


def test_a_camera_that_gives_no_images_is_refused(tracker):
    with pytest.raises(
        ValueError, match=r"`images` must be 2 or more; got 0\. Check that the camera gives frames"
    ):
        tracker.track([])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"interval_s": 0.0}, r"`interval_s` must be a finite number above 0; got 0\.0"),
        ({"maximum_gap": -1}, r"`maximum_gap` must be an integer of at least 0; got -1"),
    ],
)
def test_settings_that_make_no_sense_are_refused(true_camera, changes, message):
    with pytest.raises(ValueError, match=message):
        Tracker(TriangleMarkers(), true_camera, LABELS, **changes)


def test_a_color_that_is_not_known_is_refused(true_camera):
    with pytest.raises(
        ValueError, match=r"`label` must be one of blue, orange, purple, green, red; got 'pink'"
    ):
        Tracker(TriangleMarkers(), true_camera, ["pink"])


def test_an_identity_outside_the_dictionary_is_refused():
    with pytest.raises(
        ValueError, match=r"`label` must be an identity of the dictionary 4X4_50, 0 to 49; got '50'"
    ):
        ArucoMarkers().check_label("50")


def test_a_triangle_whose_tip_cannot_be_told_is_refused():
    with pytest.raises(
        ValueError, match=r"at least 1\.1 times as long as wide; got 4\.5 cm by 6\.0 cm"
    ):
        TriangleMarkers(half_width_cm=3.0)


def test_where_an_image_was_lost_alone_everybody_is_put_in_the_middle():
    poses = np.zeros((5, 2, 3))
    poses[:, 0, 0], poses[:, 1, 2] = (
        [0, 1, 1, 3, 4],
        [3.0, 3.1, 3.1, 3.3 - 2 * np.pi, 3.4 - 2 * np.pi],
    )
    present = np.array([True, True, False, True, True])[:, None].repeat(2, axis=1)
    track = Track(poses, present, ("a", "b"), 0.1)
    assert track.lost.tolist() == [False, False, True, False, False]
    assert track.complete
    np.testing.assert_allclose(track.speeds()[0, :, 0], 10.0)
    np.testing.assert_allclose(track.speeds()[1, :, 1], 1.0)
    assert np.abs(track.bridged().poses[:, 1, 2]).max() <= np.pi
    for gap in ([2, 3], [0], [4]):
        present[:] = True
        present[gap] = False
        assert not Track(poses, present, ("a", "b"), 0.1).complete
