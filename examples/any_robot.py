"""A robot that speaks JSON over TCP, and poses that come as datagrams, as of motion capture; see docs/robots/any-robot.md."""

import json
import socket
import time

import numpy as np

from turing_learning.robots import Fault, LaboratorySetup, Model, Signal, Status, Track


class JsonRobot:
    """A `Replica`: one JSON object a line. What is asked has "do", answers have "did", signals come unasked."""

    reconnections = 0  # a link that is lost raises OSError, and is opened anew by the program

    def __init__(self, address: str) -> None:
        host, port = address.split(":")
        self._socket, self._rest = socket.create_connection((host, int(port)), timeout=2.0), b""
        self._signals: list[Signal] = []

    def _receive(self, deadline: float) -> dict:
        while b"\n" not in self._rest:
            self._socket.settimeout(max(deadline - time.monotonic(), 0.001))
            more = self._socket.recv(4096)  # raises TimeoutError at the deadline
            if not more:
                raise ConnectionError("the robot has closed the connection")
            self._rest += more
        line, _, self._rest = self._rest.partition(b"\n")
        message = json.loads(line)
        if "signal" in message:
            self._signals.append(Signal(message["signal"], message["trial"], message["sequence"], time.monotonic()))
        return message

    def _ask(self, what: str, **more: object) -> dict:
        self._socket.sendall(json.dumps({"do": what, **more}).encode() + b"\n")
        deadline, answer = time.monotonic() + 10.0, {}
        while answer.get("did") != what:
            answer = self._receive(deadline)
        return answer

    def version(self) -> str:
        return str(self._ask("version")["text"])

    def status(self) -> Status:
        told = self._ask("status")
        return Status(told["state"], told["in_state_s"], told["waiting"], told["executing"], told["battery_ok"])

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
                if (signal := self._signals.pop(0)).kind == kind:
                    return signal
            self._receive(deadline)

    def drop_signals(self) -> None:
        try:
            while True:
                self._receive(time.monotonic())
        except TimeoutError:
            self._signals.clear()

    def close(self) -> None:
        self._socket.close()


class UdpPoses:
    """A `PoseSource`: datagrams {"time": s, "poses": {name: [x cm, y cm, heading rad]}}, more often than `camera.fps`."""

    def __init__(self, setup: LaboratorySetup, port: int = 5005) -> None:
        self._names = [robot.name for robot in (*setup.agents, *setup.replicas)]
        self._labels, self._interval_s = setup.labels, 1 / setup.camera.fps
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("", port))
        self._socket.settimeout(5.0)

    def track(self, begin_s: float, images: int) -> Track:
        poses, faults = np.zeros((images, len(self._names), 3)), []
        present = np.zeros(poses.shape[:2], bool)
        frame = json.loads(self._socket.recv(65536))
        while time.monotonic() < begin_s:  # and drop what came before
            frame = json.loads(self._socket.recv(65536))
        first_s = frame["time"]
        for k in range(images):
            due_s = first_s + k * self._interval_s
            while frame["time"] < due_s - 0.1 * self._interval_s:
                frame = json.loads(self._socket.recv(65536))
            if frame["time"] > due_s + 0.5 * self._interval_s:
                faults.append(Fault(k, "irregular images", f"no poses at {due_s:.2f} s"))
            for who, name in enumerate(self._names):
                present[k, who] = name in frame["poses"]
                poses[k, who] = frame["poses"].get(name, poses[k - 1, who])
        return Track(poses, present, self._labels, self._interval_s, tuple(faults))

    def close(self) -> None:
        self._socket.close()
