"""The overhead camera as a stream of JPEG images over HTTP, which any program that reads network cameras can open."""

import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

from turing_learning.robots.tracking._opencv import vision

STREAM = "/camera.mjpg"
QUALITY = 92
_BOUNDARY = "image"
_POLL_S = 0.002
Frames = Callable[[int], tuple[int, np.ndarray | None]]
"""Number of the last image -> number and image (H, W, 3) of the next; none as long as there is no newer one."""


class CameraStream:
    """Serve images, in threads, until closed.

    Parameters
    ----------
    frames
        Gives the images.
    host, port
        Where; port 0 takes any free one.

    Attributes
    ----------
    url
        What to give to `Capture`.

    Raises
    ------
    OSError
        If the port is taken.
    """

    def __init__(self, frames: Frames, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self._closed = threading.Event()

        class Handler(_Handler):
            pass

        Handler.frames, Handler.closed = staticmethod(frames), self._closed
        self._server = ThreadingHTTPServer((host, port), Handler)
        self._server.daemon_threads = True
        self.url = f"http://{host}:{self._server.server_address[1]}{STREAM}"
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the service."""
        self._closed.set()
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    """One viewer."""

    frames: Frames
    closed: threading.Event

    def do_GET(self) -> None:
        """Send images until the viewer leaves."""
        if self.path != STREAM:
            self.send_error(404, f"the camera is at {STREAM}")
            return
        self.send_response(200)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        number = -1
        while not self.closed.is_set():
            number, image = self.frames(number)
            if image is None:
                time.sleep(_POLL_S)
                continue
            try:
                self.wfile.write(_part(encode(image)))
            except OSError:
                return

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def _part(jpeg: bytes) -> bytes:
    head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
    return head.encode("ascii") + jpeg + b"\r\n"


def encode(image: np.ndarray) -> bytes:
    """Return an image (H, W, 3) as JPEG with its full color: markers are told apart by it."""
    cv2 = vision()
    settings = [
        cv2.IMWRITE_JPEG_QUALITY,
        QUALITY,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]
    return bytes(cv2.imencode(".jpg", image, settings)[1].tobytes())
