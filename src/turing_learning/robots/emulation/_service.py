"""An emulated laboratory that goes on by itself in real time, at addresses that any program can open."""

import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from turing_learning._files import whole
from turing_learning.swarm import Scenario

from ._arena import EmulatedLaboratory
from ._conditions import LABORATORY, Conditions
from ._emulated_robot import EmulatedRobot
from ._firmware import LOOP
from ._line import Line
from ._robot_server import serve_tcp, serve_terminal
from ._stream import CameraStream

_POLL_S = 0.005
_SERVERS = {"terminal": serve_terminal, "tcp": serve_tcp}
LABORATORY_FILE, CALIBRATION_FILE = "lab.toml", "camera.json"


class ArenaService:
    """Serve a laboratory until closed. A context manager.

    Parameters
    ----------
    scenario, conditions, seed
        As of `EmulatedLaboratory`; bytes are as late as the lines are.
    lines
        "terminal" for pseudo-terminals, "tcp" for ports.
    speed
        Seconds of the laboratory in one second.

    Attributes
    ----------
    laboratory
        What is served; touch it under its `lock`.
    camera_url
        Where the images are.

    Raises
    ------
    ValueError
        If there are no such lines, or the speed is not above 0.
    """

    def __init__(
        self,
        scenario: Scenario = LABORATORY,
        *,
        conditions: Conditions | None = None,
        seed: int = 0,
        lines: str = "terminal",
        speed: float = 1.0,
    ) -> None:
        if lines not in _SERVERS:
            raise ValueError(f"`lines` must be one of {', '.join(_SERVERS)}; got {lines!r}.")
        if not 0 < speed < float("inf"):
            raise ValueError(f"`speed` must be a finite number above 0; got {speed}.")
        serve = _SERVERS[lines]

        def make_line(robot: EmulatedRobot, _: str) -> Line:
            return serve(robot)

        self._speed, self._done = float(speed), threading.Event()
        self.laboratory = EmulatedLaboratory(scenario, conditions=conditions, seed=seed, make_line=make_line)
        self.laboratory.camera.take()  # renders the first image, which takes longest, before anybody waits for it
        self._stream = CameraStream(self._next_image)
        self.camera_url = self._stream.url
        self._thread = threading.Thread(target=self._go_on, daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def addresses(self) -> dict[str, str]:
        """Robot's name -> what to give to `open_link`."""
        return {name: self.laboratory.line(name).port for name in self.laboratory.names}

    def close(self) -> None:
        """End everything."""
        self._done.set()
        self._thread.join()
        self._stream.close()
        self.laboratory.close()

    def describe(self) -> str:
        """Return the laboratory's file for the PC program, beside whose folder the calibration lies.

        A laboratory that is faster than real time is described as what it looks like to a PC: one of faster robots.
        """
        laboratory, speed = self.laboratory, self._speed
        scenario = laboratory.scenario
        camera = {"source": self.camera_url, "fps": speed / self._interval_s, "calibration": CALIBRATION_FILE}
        timing = {"wait_s": LOOP["R1"] / speed, "disperse_s": LOOP["R2"] / speed, "execute_s": LOOP["R5"] / speed}
        sections = [_section("camera", camera), _section("timing", timing)]
        for name, label in zip(laboratory.names, laboratory.labels, strict=True):
            replica = laboratory.number(name) >= scenario.agents
            role = {"name": name, "role": "replica" if replica else "agent", "marker": label}
            sections.append(_section("[robots]", role | ({"address": self.addresses[name]} if replica else {})))
        width, height = laboratory.arena_cm
        sections += [
            _section("scenario.arena", {"width_cm": width, "height_cm": height}),
            _section("scenario.robot", {"maximum_speed_cm_s": scenario.robot.maximum_speed_cm_s * speed}),
            _section("scenario.trial", {"duration_s": scenario.trial.duration_s / speed}),
        ]
        return "\n".join(sections)

    def write(self, folder: Path, *, force: bool = False) -> Path:
        """Write the laboratory's file and its camera's calibration into a folder; return the file's path.

        Raises
        ------
        FileExistsError
            If one is there already, unless `force` is given.
        OSError
            If they cannot be written.
        """
        path, calibration = folder / LABORATORY_FILE, folder / CALIBRATION_FILE
        for each in (path, calibration):
            if each.exists() and not force:
                raise FileExistsError(
                    f"`out` must not hold a laboratory already; got {each}. Take another folder, or force=True."
                )
        folder.mkdir(parents=True, exist_ok=True)
        with whole(path) as described, whole(calibration) as calibrated:
            described.write_text(self.describe(), encoding="utf-8")
            self.laboratory.calibration.save(calibrated)
        return path

    @property
    def _interval_s(self) -> float:
        return self.laboratory.scenario.trial.control_interval_s

    def _go_on(self) -> None:
        laboratory = self.laboratory
        ahead = laboratory.clock.now() - self._speed * time.monotonic()
        while not self._done.is_set():
            with laboratory.lock:
                laboratory.clock.sleep_until(ahead + self._speed * time.monotonic())
            time.sleep(_POLL_S)

    def _next_image(self, last: int) -> tuple[int, np.ndarray | None]:
        laboratory = self.laboratory
        with laboratory.lock:
            number = int((laboratory.clock.now() - laboratory.conditions.camera_lag_s) / self._interval_s)
            if number == last or laboratory.camera.unplugged:
                return last, None
            return number, laboratory.camera.snapshot()


def _section(name: str, content: Mapping[str, object]) -> str:
    lines = [
        f"{key} = {value!r}" if isinstance(value, float) else f'{key} = "{value}"' for key, value in content.items()
    ]
    return "\n".join([f"[{name}]", *lines, ""])
