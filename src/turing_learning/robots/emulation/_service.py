"""An emulated laboratory that runs by itself in real time, at addresses that any program can open."""

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import whole
from turing_learning.config import toml_table
from turing_learning.errors import choice, number
from turing_learning.robots.tracking._camera import cv2, refuse_taken
from turing_learning.swarm import Scenario

from ._arena import LABORATORY, Conditions
from ._emulated_robot import LOOP
from ._laboratory import EmulatedLaboratory
from ._lines import TcpServer, TerminalServer

_POLL_S = 0.005
_SERVERS = {"terminal": TerminalServer, "tcp": TcpServer}
LABORATORY_FILE, CALIBRATION_FILE = "lab.toml", "camera.json"
HOST, STREAM = "127.0.0.1", "/camera.mjpg"
QUALITY = 92
_FRAME_POLL_S = 0.002


class ArenaService(AbstractContextManager["ArenaService"]):
    """Serve a `laboratory`, to be used under its `lock`, and images at `camera_url`, until closed. A context manager.

    Parameters
    ----------
    scenario, conditions, seed
        As of `EmulatedLaboratory`; the latency is that of the lines.
    lines, speed
        "terminal" for pseudo-terminals, "tcp" for TCP ports; seconds of the laboratory in one second.
    """

    def __init__(
        self, scenario: Scenario = LABORATORY, *, conditions: Conditions | None = None, seed: int = 0,
        lines: str = "terminal", speed: float = 1.0,
    ) -> None:  # fmt: skip
        serve = _SERVERS[choice("lines", lines, _SERVERS)]
        self._speed = number("speed", speed, above=0)
        self._done = threading.Event()
        self.laboratory = EmulatedLaboratory(
            scenario, conditions=conditions, seed=seed, make_line=lambda robot, _: serve(robot)
        )
        # Renders the first image, which takes longest, before anybody waits for it
        self.laboratory.camera.take()
        self._stream = CameraStream(self._next_image)
        self.camera_url = self._stream.url
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def addresses(self) -> dict[str, str]:
        """Robot's name -> its address for `open_link`."""
        return {name: self.laboratory.robot(name).line.port for name in self.laboratory.names}

    def close(self) -> None:
        """End everything."""
        self._done.set()
        self._thread.join()
        self._stream.close()
        self.laboratory.close()

    def describe(self) -> str:
        """Return the laboratory's file for the PC program; one that is faster than real time has faster robots, as is seen."""
        laboratory = self.laboratory
        speed = self._speed
        scenario = self.laboratory.scenario
        camera = {
            "source": self.camera_url,
            "fps": speed / laboratory.interval_s,
            "calibration": CALIBRATION_FILE,
        }
        timing = {
            "wait_s": LOOP["R1"] / speed,
            "disperse_s": LOOP["R2"] / speed,
            "execute_s": LOOP["R5"] / speed,
        }
        sections: list[tuple[str, dict[str, Any]]] = [("camera", camera), ("timing", timing)]
        for name, label in zip(laboratory.names, laboratory.labels, strict=True):
            robot = {"name": name, "role": "agent", "marker": label}
            if laboratory.number(name) >= scenario.agents:
                robot |= {"role": "replica", "address": self.addresses[name]}
            sections.append(("[robots]", robot))
        sections.append(
            (
                "scenario.arena",
                dict(zip(("width_cm", "height_cm"), laboratory.arena_cm, strict=True)),
            )
        )
        sections.append(
            ("scenario.robot", {"maximum_speed_cm_s": scenario.robot.maximum_speed_cm_s * speed})
        )
        sections.append(("scenario.trial", {"duration_s": scenario.trial.duration_s / speed}))
        lines: list[str] = []
        for name, content in sections:
            lines += toml_table(name, content)
        return "\n".join(lines)

    def write(self, folder: Path, *, force: bool = False) -> Path:
        """Write the laboratory's file and its camera's calibration into a folder; return the file's path, or
        raise FileExistsError if one exists already, unless `force` is given.
        """
        path = folder / LABORATORY_FILE
        calibration = folder / CALIBRATION_FILE
        for file in (path, calibration):
            refuse_taken(file, name="out", force=force)
        folder.mkdir(parents=True, exist_ok=True)
        with whole(path) as described, whole(calibration) as calibrated:
            described.write_text(self.describe(), encoding="utf-8")
            self.laboratory.calibration.save(calibrated)
        return path

    def _run(self) -> None:
        laboratory = self.laboratory
        ahead = laboratory.clock.now() - self._speed * time.monotonic()
        while not self._done.is_set():
            with laboratory.lock:
                laboratory.clock.sleep_until(ahead + self._speed * time.monotonic())
            time.sleep(_POLL_S)

    def _next_image(self, last_number: int) -> tuple[int, np.ndarray | None]:
        laboratory = self.laboratory
        with laboratory.lock:
            number = int(
                (laboratory.clock.now() - laboratory.conditions.camera_lag_s)
                / laboratory.interval_s
            )
            if number == last_number or laboratory.camera.unplugged:
                return last_number, None
            return number, laboratory.camera.snapshot(laboratory.camera.due_s(number))


class CameraStream(ThreadingHTTPServer):
    """Serve images as JPEG over HTTP at `url`, in threads, until closed: any program for network cameras can open it.

    `frames` takes the number of the last image, and gives number and image (H, W, 3) of the next, or None if
    there is no newer one.
    """

    daemon_threads = True

    def __init__(self, frames: Callable[[int], tuple[int, np.ndarray | None]]) -> None:
        super().__init__((HOST, 0), _Handler)
        self.frames = frames
        self.closed = threading.Event()
        self.url = f"http://{HOST}:{self.server_port}{STREAM}"
        threading.Thread(
            target=self.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True
        ).start()

    def close(self) -> None:
        self.closed.set()
        self.shutdown()
        self.server_close()


class _Handler(BaseHTTPRequestHandler):
    server: CameraStream
    # Of a request that is not complete, and of a viewer that takes nothing
    timeout = 10.0

    def do_GET(self) -> None:
        """Send images until the viewer leaves."""
        if self.path != STREAM:
            self.send_error(404, f"the camera is at {STREAM}")
            return
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=image")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        number = -1
        while not self.server.closed.is_set():
            number, image = self.server.frames(number)
            if image is None:
                time.sleep(_FRAME_POLL_S)
                continue
            jpeg = encode(image)
            head = f"--image\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            try:
                self.wfile.write(head.encode("ascii") + jpeg + b"\r\n")
            except OSError:
                return

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def encode(image: np.ndarray) -> bytes:
    """Return an image (H, W, 3) as JPEG with full color resolution, which distinguishes the markers."""
    full = [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    return bytes(
        cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY, *full])[1].tobytes()
    )
