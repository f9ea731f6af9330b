"""Lines to emulated robots: TCP ports and pseudo-terminals."""

import os
import selectors
import socket
import tempfile
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Self

from turing_learning.robots.links._link import Link, open_link

from ._emulated_robot import EmulatedRobot


def _whole(data: bytes) -> Iterable[bytes]:
    return [data]


class RobotServer(ABC):
    """A line to an emulated robot; see `serve_tcp` and `serve_terminal`.

    Parameters
    ----------
    robot
        The robot.
    spoil
        Turns each answer into the pieces that are sent, one after the other with `PAUSE_S` between: where tests put noise.

    Attributes
    ----------
    port
        What to give to `open_link`.
    """

    PAUSE_S = 0.05
    port: str

    def __init__(self, robot: EmulatedRobot, spoil: Callable[[bytes], Iterable[bytes]] = _whole) -> None:
        self.robot, self.spoil = robot, spoil
        self._lock = threading.Lock()
        self._done = threading.Event()
        self._thread: threading.Thread | None = None
        self.restore()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def restore(self) -> None:
        """Open the line again after `drop`; nothing happens if it is open."""
        if self._thread is not None:
            return
        self._done.clear()
        self._open()
        thread = self._thread = threading.Thread(target=self._serve, daemon=True)
        thread.start()

    def drop(self) -> None:
        """Lose the link; nothing happens without one."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._done.set()
            thread.join()
            with self._lock:
                self._shut()

    def close(self) -> None:
        """End the service."""
        self.drop()

    def link(self) -> Link:
        """Return an open link to the robot, in real time; raises LinkError if there is none."""
        return open_link(self.port)

    def signal(self, kind: str) -> None:
        """Send a signal; without a link it is lost."""
        self._send(self.robot.signal(kind))

    def _send(self, data: bytes) -> None:
        with self._lock:
            for number, piece in enumerate(self.spoil(data)):
                if number:
                    time.sleep(self.PAUSE_S)
                if self._thread is not None:
                    self._write(piece)

    def _serve(self) -> None:
        while not self._done.is_set():
            data = self._read()
            answer = self.robot.receive(data) if data else b""
            if answer:
                self._send(answer)

    @abstractmethod
    def _open(self) -> None:
        """Make the port."""

    @abstractmethod
    def _shut(self) -> None:
        """Take the port away."""

    @abstractmethod
    def _read(self) -> bytes:
        """Return what has come, nothing after a short while."""

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """Send, if anybody listens."""


class _TcpServer(RobotServer):
    """One client at a time; each is greeted."""

    def __init__(
        self, robot: EmulatedRobot, spoil: Callable[[bytes], Iterable[bytes]], address: tuple[str, int]
    ) -> None:
        self._address = address
        self._client: socket.socket | None = None
        super().__init__(robot, spoil)

    def _open(self) -> None:
        self._listening = socket.create_server(self._address)
        self._listening.settimeout(0.05)
        self._address = self._listening.getsockname()[:2]
        self.port = f"socket://{self._address[0]}:{self._address[1]}"

    def _shut(self) -> None:
        self._hang_up()
        self._listening.close()

    def _hang_up(self) -> None:
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _read(self) -> bytes:
        try:
            if self._client is None:
                client, _ = self._listening.accept()
                client.settimeout(0.02)
                self._client = client
                self._send(self.robot.greeting)
            data = self._client.recv(4096) if self._client is not None else b""
        except TimeoutError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def _write(self, data: bytes) -> None:
        client = self._client
        if client is not None:
            try:
                client.sendall(data)
            except OSError:
                self._hang_up()


class _TerminalServer(RobotServer):
    """A pseudo-terminal whose name stays the same when the link comes back."""

    def __init__(self, robot: EmulatedRobot, spoil: Callable[[bytes], Iterable[bytes]]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="emulated-robot-")
        self.port = str(Path(self._folder.name) / "serial")
        super().__init__(robot, spoil)

    def _open(self) -> None:
        import tty  # not on every system

        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        Path(self.port).symlink_to(os.ttyname(self._slave))
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._master, selectors.EVENT_READ)
        self._write(self.robot.greeting)

    def _shut(self) -> None:
        Path(self.port).unlink(missing_ok=True)
        self._selector.close()
        for end in (self._master, self._slave):
            os.close(end)

    def close(self) -> None:
        super().close()
        self._folder.cleanup()

    def _read(self) -> bytes:
        if not self._selector.select(0.02):
            return b""
        try:
            return os.read(self._master, 4096)
        except OSError:
            return b""

    def _write(self, data: bytes) -> None:
        try:
            os.write(self._master, data)
        except OSError:
            return  # nobody reads, and the line is full: what a serial line loses


def serve_tcp(
    robot: EmulatedRobot,
    *,
    host: str = "127.0.0.1",
    port: int = 0,
    spoil: Callable[[bytes], Iterable[bytes]] = _whole,
) -> RobotServer:
    """Serve a robot on a TCP port (0: any free one), in a thread, until closed. A context manager.

    Raises
    ------
    OSError
        If the port is taken.
    """
    return _TcpServer(robot, spoil, (host, port))


def serve_terminal(robot: EmulatedRobot, *, spoil: Callable[[bytes], Iterable[bytes]] = _whole) -> RobotServer:
    """Serve a robot on a pseudo-terminal, in a thread, until closed. A context manager.

    Raises
    ------
    OSError
        If the system has no pseudo-terminals.
    """
    return _TerminalServer(robot, spoil)
