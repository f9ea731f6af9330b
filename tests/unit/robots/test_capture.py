import cv2
import numpy as np
import pytest

from turing_learning.robots import CameraError, Capture


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
            CameraError, match=r"`source` must give images; got none more from '.*trial\.avi'\. Check that"
        ):
            capture.take()


def test_a_video_that_does_not_exist_is_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"must be a camera's number, a video file or a URL; got '.*none\.avi'"):
        Capture(tmp_path / "none.avi")


def test_a_file_that_is_no_video_is_refused(tmp_path):
    path = tmp_path / "notes.avi"
    path.write_text("no video")
    with pytest.raises(
        CameraError, match=r"must be a camera or a video that opens; got '.*notes\.avi'\. Check that it plays"
    ):
        Capture(path)


def test_a_camera_that_is_not_there_is_refused():
    with pytest.raises(CameraError, match=r"got camera 97\. Check its cable, and that no other program uses it"):
        Capture(97)
