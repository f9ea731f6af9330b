"""A robot that speaks JSON over TCP, and poses that come as datagrams, as of motion capture; see docs/robots/any-robot.md."""

import json
import math
import socket
import time
from collections import deque

import numpy as np

from turing_learning.robots import Fault, LaboratorySetup, Model, Signal, Status, Track

MOST_SIGNALS = 1000  # that wait; a robot signals twice in a loop
LONGEST_LINE = 10_000  # bytes; a robot that sends more without an end of line is broken
ANSWER_S = 10.0  # so long an answer may take
SILENCE_S = 5.0  # so long poses may fail to come


class JsonRobot:
    """A `Replica`: one JSON object a line. What is asked has "do", answers have "did", signals come unasked.

    Whatever is wrong with the robot or its line is an OSError: then the program opens the connection anew.
    """

    reconnections = 0

    def __init__(self, address: str) -> None:
        host, port = address.split(":")
        self._socket = socket.create_connection((host, int(port)), timeout=2.0)
        self._arrived = b""
        self._signals: deque[Signal] = deque(maxlen=MOST_SIGNALS)

    def _receive(self, deadline: float) -> dict:
        """Return the next message; raise TimeoutError if there is none at the deadline, however much comes."""
        while b"\n" not in self._arrived:
            if len(self._arrived) > LONGEST_LINE:
                raise ConnectionError(f"the robot sends a line of more than {LONGEST_LINE} bytes")
            self._socket.settimeout(max(deadline - time.monotonic(), 0.001))
            data = self._socket.recv(4096)
            if not data:
                raise ConnectionError("the robot has closed the connection")
            self._arrived += data
        line, _, self._arrived = self._arrived.partition(b"\n")
        try:
            message = dict(**json.loads(line))  # a list or a number is no message
            if "signal" in message:
                trial, sequence = int(message["trial"]), int(message["sequence"])
                self._signals.append(
                    Signal(str(message["signal"]), trial, sequence, time.monotonic())
                )
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
            raise ConnectionError(f"the robot sends what makes no sense: {line[:80]!r}") from error
        if time.monotonic() > deadline + 1.0:
            raise TimeoutError("the robot never stops sending")
        return message

    def _ask(self, what: str, **more: object) -> dict:
        self._socket.settimeout(2.0)
        self._socket.sendall(json.dumps({"do": what, **more}).encode() + b"\n")
        deadline = time.monotonic() + ANSWER_S
        answer: dict = {}
        while answer.get("did") != what:
            answer = self._receive(deadline)
        return answer

    def version(self) -> str:
        return str(self._ask("version").get("text"))

    def status(self) -> Status:
        answer = self._ask("status")
        try:
            waiting, executing = int(answer["waiting"]), int(answer["executing"])
            return Status(
                str(answer["state"]),
                float(answer["in_state_s"]),
                waiting,
                executing,
                bool(answer["battery_ok"]),
            )
        except (ValueError, TypeError, KeyError, OverflowError) as error:
            raise ConnectionError(f"the robot's status makes no sense: {answer}") from error

    def start(self) -> None:
        self._ask("start")

    def halt(self) -> None:
        self._ask("halt")

    def send_model(self, model: Model) -> None:
        self._ask("model", sequence=model.sequence, parameters=model.parameters)

    def wait_for(self, kind: str, timeout_s: float) -> Signal:
        deadline = time.monotonic() + timeout_s
        while True:
            while self._signals:
                signal = self._signals.popleft()
                if signal.kind == kind:
                    return signal
            self._receive(deadline)

    def drop_signals(self) -> None:
        deadline = time.monotonic()
        try:
            while True:
                self._receive(deadline)
        except TimeoutError:
            self._signals.clear()

    def close(self) -> None:
        self._socket.close()


class UdpPoses:
    """A `PoseSource`: datagrams {"time": s, "poses": {name: [x cm, y cm, heading rad]}}, more often than `camera.fps`.

    It listens at `host`, this computer by default: for motion capture on another one, write
    ``def poses(setup): return UdpPoses(setup, host="10.0.0.1", sender="10.0.0.7")`` into a module, and name that
    function in the laboratory's file. Datagrams that make no sense, or come from elsewhere, are left out.
    """

    def __init__(
        self, setup: LaboratorySetup, port: int = 5005, host: str = "127.0.0.1", sender: str = ""
    ) -> None:
        self._names = [robot.name for robot in (*setup.agents, *setup.replicas)]
        self._labels, self._interval_s = setup.labels, 1 / setup.camera.fps
        self._sender = sender
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((host, port))

    def _next(self, deadline: float) -> tuple[float, dict[str, list[float]]]:
        """Return time and poses of the next datagram that makes sense; raise TimeoutError if none comes until the deadline."""
        while True:
            self._socket.settimeout(max(deadline - time.monotonic(), 0.001))
            try:
                data, (host, _) = self._socket.recvfrom(65536)
            except TimeoutError as error:
                raise TimeoutError("no poses come from the tracker") from error
            if time.monotonic() > deadline + 1.0:
                raise TimeoutError("no poses that make sense come from the tracker")
            if self._sender and host != self._sender:
                continue
            try:
                content = json.loads(data)
                time_s = float(content["time"])
                poses = {
                    name: [float(value) for value in pose]
                    for name, pose in content["poses"].items()
                }
                if not math.isfinite(time_s):
                    continue
            except (ValueError, TypeError, KeyError, AttributeError, RecursionError, OverflowError):
                continue
            known = {
                name: pose
                for name, pose in poses.items()
                if len(pose) == 3 and np.isfinite(pose).all()
            }
            return time_s, known

    def track(self, begin_s: float, images: int) -> Track:
        shape = (images, len(self._names))
        poses, present = np.zeros((*shape, 3)), np.zeros(shape, bool)
        faults = []
        deadline = max(begin_s, time.monotonic()) + SILENCE_S
        first_s, seen = self._next(deadline)
        while time.monotonic() < begin_s:  # and drop what came before
            first_s, seen = self._next(deadline)
        deadline += images * self._interval_s
        seen_s = first_s
        for image in range(images):
            due_s = first_s + image * self._interval_s
            while seen_s < due_s - 0.1 * self._interval_s:
                seen_s, seen = self._next(deadline)
            if seen_s > due_s + 0.5 * self._interval_s:
                faults.append(Fault(image, "irregular images", f"no poses at {due_s:.2f} s"))
            for who, name in enumerate(self._names):
                present[image, who] = name in seen
                poses[image, who] = seen.get(name, poses[image - 1, who])
        return Track(poses, present, self._labels, self._interval_s, tuple(faults))

    def close(self) -> None:
        self._socket.close()
