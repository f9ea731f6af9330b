import time

import cv2
import numpy as np
import pytest

from turing_learning.robots import CameraError, Capture, LiveCapture
from turing_learning.robots.program._equipment import PunctualImages


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "trial.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    for level in (20, 120, 220):
        writer.write(np.full((48, 64, 3), level, np.uint8))
    writer.release()
    return path


def test_a_recorded_video_gives_its_images_in_order(video):
    with Capture(video) as capture:
        levels = [float(image.mean()) for image in capture]
    assert levels == pytest.approx([20, 120, 220], abs=3)


def test_images_are_taken_one_by_one_until_there_are_none(video):
    with Capture(video) as capture:
        assert [capture.take().shape for _ in range(3)] == [(48, 64, 3)] * 3
        with pytest.raises(
            CameraError,
            match=r"`source` must give images; got none more from '.*trial\.avi'\. Check that",
        ):
            capture.take()


def test_a_video_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(
        FileNotFoundError,
        match=r"must be a camera's number, a video file or a URL; got '.*none\.avi'",
    ):
        Capture(tmp_path / "none.avi")


def test_a_file_that_is_no_video_is_refused(tmp_path):
    path = tmp_path / "notes.avi"
    path.write_text("no video")
    with pytest.raises(
        CameraError,
        match=r"must be a camera or a video that opens; got '.*notes\.avi'\. Check that it plays",
    ):
        Capture(path)


def test_a_camera_that_is_not_there_is_refused():
    with pytest.raises(
        CameraError, match=r"got camera 97\. Check its cable, and that no other program uses it"
    ):
        Capture(97)


class Device:
    """A camera with a driver's buffer of images, in a time of its own: it is a clock, too.

    Its time passes while the program sleeps by it or waits for an image, so that no test depends on how busy the machine is.
    """

    def __init__(self, interval_s=0.05, decoding_s=0.0, buffered=0, lost=(), images=200):
        self.interval_s, self.decoding_s, self.buffered, self.lost = (
            interval_s,
            decoding_s,
            buffered,
            lost,
        )
        self.left, self.number, self.settings, self.camera = images, -1, {}, None
        self.time_s = self.awake_s = 0.0

    def now(self):
        return self.time_s

    def sleep(self, seconds):
        self.awake_s = self.time_s + seconds
        while self.time_s < self.awake_s:
            time.sleep(0.0005)

    def passes(self):
        """Whether time passes: the program sleeps, or wants an image and has none."""
        waits = not self.camera._images and self.camera._wanted_until >= self.time_s
        return self.time_s < self.awake_s or waits

    def isOpened(self):
        return True

    def grab(self):
        while self.camera is None or not self.passes():
            if self.camera is not None and self.camera._done:
                return False
            time.sleep(0.0005)
        self.left -= 1
        if self.left < 0:
            return False
        if self.buffered:
            self.buffered -= 1
            return True
        self.number = max(self.number + 1, int(self.time_s / self.interval_s) - 8)  # 8 are buffered
        while self.number in self.lost:
            self.number += 1
        self.time_s = max(self.time_s, self.number * self.interval_s)
        return True

    def retrieve(self):
        self.time_s += self.decoding_s
        return True, np.full((2, 2, 3), 255 if self.buffered else self.number % 250, np.uint8)

    def set(self, name, value):
        self.settings[name] = value

    def get(self, name):
        return self.settings[name]

    def release(self):
        self.released = True


@pytest.fixture
def live(monkeypatch):
    opened = []

    def live(device, settings=None):
        monkeypatch.setattr(cv2, "VideoCapture", lambda source: device)
        device.camera = LiveCapture(0, settings, clock=device)
        opened.append(device.camera)
        return device.camera

    yield live
    for camera in opened:
        camera.close()


def seen(camera, clock, count=16, busy=()):
    images, busy = PunctualImages(camera, clock, clock.now() + 0.2, count, 0.05), iter(busy)
    numbers = []
    for image in images:
        numbers.append(int(image[0, 0, 0]))
        clock.sleep(next(busy, 0.0))
    return numbers, images.fault


def test_images_that_take_long_to_decode_are_used_and_old_ones_are_not(live):
    device = Device(decoding_s=0.03, buffered=20)
    numbers, fault = seen(live(device), device)
    assert np.diff(numbers).tolist() == [1] * 15
    assert fault == ""


def test_a_program_that_is_busy_meanwhile_misses_no_image(live):
    device = Device()
    numbers, fault = seen(live(device), device, busy=[0.4])
    assert np.diff(numbers).tolist() == [1] * 15
    assert fault == ""


def test_an_image_that_was_lost_shows_in_the_time_stamps(live):
    device = Device(lost=range(8, 10))
    assert (
        "must give an image every 0.05 s; got one left out before image"
        in seen(live(device), device)[1]
    )


def test_a_camera_that_gives_no_more_images_fails_once_all_are_taken(live):
    camera = live(Device(images=3))
    assert len([camera.take() for _ in range(3)]) == 3
    with pytest.raises(CameraError, match="`source` must give images; got none more from camera 0"):
        camera.take()


def test_images_that_nobody_takes_are_not_kept(live):
    device = Device()
    camera = live(device)
    camera.take()
    device.sleep(5.0)
    begun = device.now()
    camera.take()
    assert camera.taken_s >= begun


def test_a_camera_is_asked_for_settings_and_says_what_it_grants(live):
    device = Device()
    asked = {
        "width": 1280,
        "height": 960,
        "fps": 10.0,
        "fourcc": "MJPG",
        "exposure": 156.0,
        "white_balance": None,
    }
    camera = live(device, asked)
    assert camera.granted == "fourcc MJPG, width 1280, height 960, fps 10, exposure 156"
    assert next(iter(device.settings)) == cv2.CAP_PROP_FOURCC
    assert device.settings[cv2.CAP_PROP_AUTO_EXPOSURE] == 1
    assert cv2.CAP_PROP_WB_TEMPERATURE not in device.settings
