"""Images that come late are images; images that were left out, or come too fast, are not those of a trial."""

import numpy as np
import pytest

from turing_learning.robots import LABORATORY, CameraError, Track
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.program._equipment import PunctualImages, drop_old_images
from turing_learning.robots.program._source import passes
from turing_learning.robots.tracking._tracker import impossible


class Camera:
    """Gives image k at 0.1 k s plus its delay; numbers in `lost` are never given."""

    def __init__(self, clock, delays=None, lost=(), interval_s=0.1, kept=0):
        self.clock, self.delays, self.lost, self.interval_s = (
            clock,
            delays or {},
            set(lost),
            interval_s,
        )
        self.number, self.kept, self.given = -1, kept, []

    def take(self):
        if self.kept:
            self.kept -= 1
            return np.full((2, 2, 3), 255, np.uint8)
        self.number += 1
        while self.number in self.lost:
            self.number += 1
        self.clock.sleep(
            self.number * self.interval_s + self.delays.get(self.number, 0.0) - self.clock.now()
        )
        self.given.append(self.number)
        return np.full((2, 2, 3), self.number, np.uint8)

    def close(self):
        pass


def numbers(**options):
    clock = VirtualClock()
    camera = Camera(clock, **options)
    images = PunctualImages(camera, clock, 0.2, 20, 0.1)
    found = [int(image[0, 0, 0]) for image in images]
    if images.fault:
        raise CameraError(images.fault)
    return found


def test_images_come_one_after_the_other():
    assert np.diff(numbers()).tolist() == [1] * 19


def test_old_images_are_left_alone():
    assert 255 not in numbers(kept=5)


def test_images_that_come_late_are_used():
    assert len(numbers(delays={1: 0.09, 5: 0.09, 9: 0.25, 10: 0.15, 15: 0.08})) == 20


def test_a_last_image_that_comes_late_is_used():
    last = numbers()[-1]
    assert numbers(delays={last: 0.09})[-1] == last


@pytest.mark.parametrize("lost", [5, 12, 19])
def test_an_image_that_was_left_out_is_noticed(lost):
    with pytest.raises(
        CameraError, match=r"must give an image every 0\.1 s; got one left out before image \d+"
    ):
        numbers(lost=[lost])


def test_an_image_left_out_is_noticed_although_others_come_late():
    with pytest.raises(CameraError, match="left out"):
        numbers(lost=[8], delays={3: 0.08, 6: 0.07, 14: 0.09})


@pytest.mark.parametrize(("interval_s", "fault"), [(0.09, "them faster"), (0.12, "left out")])
def test_another_rate_is_noticed(interval_s, fault):
    with pytest.raises(CameraError, match=fault):
        numbers(interval_s=interval_s)


def test_a_camera_without_pauses_is_refused():
    with pytest.raises(CameraError, match="got 200 without a pause"):
        drop_old_images(Camera(VirtualClock(), kept=1000), VirtualClock(), 0.1)


class Stamped(Camera):
    """Says when it took its image, as a camera in a thread does."""

    @property
    def taken_s(self):
        return self.clock.now()


def stamped(**options):
    clock = VirtualClock()
    images = PunctualImages(Stamped(clock, **options), clock, 0.2, 20, 0.1)
    return [None if image is None else int(image[0, 0, 0]) for image in images], images.fault


@pytest.mark.parametrize("lost", [[5], [8, 10], [12, 19]])
def test_an_image_that_is_lost_alone_is_known_by_the_time_stamps(lost):
    found, fault = stamped(lost=lost)
    assert fault == ""
    assert [number for number in range(found[0], found[0] + 20) if number not in found] == lost
    assert [found[number - found[0]] for number in lost] == [None] * len(lost)


@pytest.mark.parametrize(
    "options",
    [
        {"lost": [8, 9]},
        {"lost": [4, 7, 10]},
        {"delays": {8: 0.08, 9: 0.08, 10: 0.02}},
        {"interval_s": 0.12},
    ],
)
def test_more_than_single_images_are_not_bridged(options):
    assert "must give an image every 0.1 s" in stamped(**options)[1]


def test_late_images_are_not_taken_for_lost():
    found, fault = stamped(delays={1: 0.09, 5: 0.09, 9: 0.25, 10: 0.15, 15: 0.08})
    assert (np.diff(found).tolist(), fault) == ([1] * 19, "")


@pytest.mark.parametrize(
    ("images", "robots", "passing"),
    [
        ([19], [0, 1, 2], True),
        ([0], [0, 1, 2], True),
        ([7, 8], [0, 1, 2], True),
        ([7, 8], [1], True),
        # a camera that has gone dark, and a marker that nobody has seen again
        ([18, 19], [0, 1, 2], False),
        ([0, 1], [0, 1, 2], False),
        ([19], [1], False),
        ([0], [1], False),
    ],
)
def test_nobody_is_asked_about_an_image_that_was_lost_at_an_end_of_a_trial(images, robots, passing):
    present = np.ones((20, 3), bool)
    present[np.ix_(images, robots)] = False
    poses = np.zeros((20, 3, 3))
    poses[..., 0] = [20.0, 60.0, 100.0]
    track = Track(poses, present, ("a", "b", "c"), 0.1)
    faults = impossible(track, LABORATORY.robot)
    assert faults
    assert passes(Track(poses, present, track.labels, 0.1, faults), ()) is passing
