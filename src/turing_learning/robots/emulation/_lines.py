"""A robot's end of a line: in virtual time in this process, on a TCP port, a real robot's too, or on a pseudo-terminal."""

import logging
import os
import select
import selectors
import socket
import tempfile
import threading
import time
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, suppress
from functools import partial
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from turing_learning.errors import refuse, require
from turing_learning.robots._clock import Clock, RealClock, VirtualClock
from turing_learning.robots._link import ALIVE, ALIVE_S, Link, open_link

from ._emulated_robot import ALONE_S, FULL_SPEED, GREETING, STILL, Body, EmulatedRobot

_PAUSE_S = 0.05  # between the pieces of a spoiled answer
_POLL_S, _WRITING_S = 0.02, 1.0
# a client that has said nothing that makes sense for so long gives way to the next one
IDLE_S = 5.0
_WATCHING_S = 0.2
_STOPPING_TRIES = 20  # at the end, where a body takes no command
_LOGGER = logging.getLogger(__name__)
Spoil = Callable[[bytes], Iterable[bytes]]
"""Turns the bytes that a robot sends into the pieces that arrive: where tests put noise."""


def whole(data: bytes) -> Iterable[bytes]:
    """Return data in one piece."""
    return [data]


class Line(AbstractContextManager["Line"]):
    """The robot's end of a line; it is reached at `port`. A context manager."""

    port: str
    spoil: Spoil

    def __init__(self, robot: EmulatedRobot) -> None:
        self.robot = robot
        self.spoil = whole

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def link(self) -> Link:
        """Return an open link to the robot; raise LinkError if there is none."""

    @abstractmethod
    def drop(self) -> None:
        """Lose the link."""

    @abstractmethod
    def restore(self) -> None:
        """Make it possible to connect again."""

    @abstractmethod
    def _send(self, data: bytes) -> None:
        """Send to the PC, piece by piece; without a link the bytes are lost."""

    def signal(self, kind: str) -> None:
        """Send a signal; without a link it is lost."""
        self._send(self.robot.signal(kind))

    def close(self) -> None:
        self.drop()


class VirtualLine(Line):
    """A line in virtual time, whose bytes take the time `latency_s`, from shortest to longest."""

    def __init__(
        self, robot: EmulatedRobot, name: str, clock: VirtualClock, latency_s: tuple[float, float],
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        super().__init__(robot)
        self.port = name
        self.clock = clock
        self._latency_s = latency_s
        self._rng = rng
        self._there = True
        self._near = _NearEnd(self, connected=False)
        self._last = {"in": 0.0, "out": 0.0}

    def link(self, alive_s: float = ALIVE_S) -> Link:
        """Return an open link, whose PC says every `alive_s`, in virtual time, that it is there; never if that is 0."""
        connect = partial(self._connect, alive_s)
        return Link(self.port, clock=self.clock, connect=connect).open()

    def drop(self) -> None:
        self._there = self._near.there = False

    def restore(self) -> None:
        self._there = True

    def receive(self, data: bytes) -> None:
        """Take what the PC sends."""
        self._later("in", 0.0, lambda: self._send(self.robot.receive(data) if self._there else b""))

    def _send(self, data: bytes) -> None:
        if self._near.there and data:
            for number, piece in enumerate(self.spoil(data)):
                self._later("out", number * _PAUSE_S, partial(self._near.arrived.extend, piece))

    def _connect(self, alive_s: float) -> "_NearEnd":
        if not self._there:
            raise OSError("no connection")
        self._near.there = False
        self._near = _NearEnd(self)
        if alive_s:
            self._say_alive(self._near, alive_s)
        return self._near

    def _say_alive(self, near_end: "_NearEnd", alive_s: float) -> None:
        if near_end.there and not near_end.closed:
            self.receive(ALIVE)
            again = partial(self._say_alive, near_end, alive_s)
            self.clock.call_at(self.clock.now() + alive_s, again)

    def _later(self, direction: str, pause_s: float, action: Callable[[], None]) -> None:
        """Do something when the bytes have arrived; they do not overtake each other."""
        due = self.clock.now() + pause_s + self._rng.uniform(*self._latency_s)
        self._last[direction] = due = max(due, self._last[direction])
        self.clock.call_at(due, action)


class _NearEnd:
    """The PC's end of a virtual line, a `Device`."""

    def __init__(self, line: VirtualLine, connected: bool = True) -> None:
        self._line = line
        self.there = connected
        self.closed = False
        self.arrived = bytearray()

    @property
    def in_waiting(self) -> int:
        if not self.there:
            raise OSError("connection lost")
        return len(self.arrived)

    def read(self, size: int) -> bytes:
        if not self.in_waiting:
            clock = self._line.clock
            clock.sleep_until(clock.now() + _POLL_S, ready=lambda: len(self.arrived) > 0)
        data = bytes(self.arrived[: min(size, self.in_waiting)])
        del self.arrived[:size]
        return data

    def write(self, data: bytes) -> None:
        if self.in_waiting >= 0:
            self._line.receive(bytes(data))

    def close(self) -> None:
        """Leave the line as it is, and say no more."""
        self.closed = True


class _Server(Line):
    """A line in real time, served in a thread until closed."""

    _open: Callable[[], None]  # makes the port
    _shut: Callable[[], None]  # takes the port away
    _read: Callable[[], bytes]  # what has arrived, nothing after a short while
    _write: Callable[[bytes], None]  # sends, if anybody listens

    def __init__(self, robot: EmulatedRobot) -> None:
        super().__init__(robot)
        self._lock = threading.Lock()
        self._done = threading.Event()
        self._thread: threading.Thread | None = None
        self.restore()

    def link(self) -> Link:
        return open_link(self.port)

    def drop(self) -> None:
        thread = self._thread
        self._thread = None
        if thread is not None:
            self._done.set()
            thread.join()
            with self._lock:
                self._shut()

    def restore(self) -> None:
        if self._thread is None:
            self._done.clear()
            self._open()
            self._thread = threading.Thread(target=self._serve, daemon=True)
            self._thread.start()

    def _send(self, data: bytes) -> None:
        with self._lock:
            for number, piece in enumerate(self.spoil(data)):
                time.sleep(_PAUSE_S if number else 0.0)
                if self._thread is not None:
                    self._write(piece)

    def _serve(self) -> None:
        while not self._done.is_set():
            if (data := self._read()) and (answer := self.robot.receive(data)):
                self._send(answer)


class TcpServer(_Server):
    """Serve a robot on a TCP port (0: any free one); raise OSError if it is taken.

    One client at a time; one that has said nothing that makes sense for a while gives way to the next. With
    `peers`, addresses or networks such as "10.0.0.0/24", anybody else is hung up on.
    """

    def __init__(
        self,
        robot: EmulatedRobot,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        peers: Sequence[str] = (),
    ) -> None:
        self._address = (host, port)
        self._heard_s = 0.0
        self._peers = list(map(ip_network, peers))
        self._understood = 0
        self._client: socket.socket | None = None
        super().__init__(robot)

    def _open(self) -> None:
        self._listening = socket.create_server(self._address)
        self._listening.settimeout(_POLL_S)
        self._address = self._listening.getsockname()[:2]
        self.port = f"socket://{self._address[0]}:{self._address[1]}"

    def _shut(self) -> None:
        self._hang_up()
        self._listening.close()

    def _hang_up(self) -> None:
        client = self._client
        self._client = None
        if client is not None:
            client.close()

    def _read(self) -> bytes:
        client = self._client
        understood = self.robot.understood
        if understood != self._understood:
            self._understood = understood
            self._heard_s = time.monotonic()
        idle = client is None or time.monotonic() - self._heard_s > IDLE_S
        try:
            sockets = [self._listening] if idle else []
            ready, _, _ = select.select([*sockets, *filter(None, [client])], [], [], _POLL_S)
            if self._listening in ready:
                self._take(*self._listening.accept())
            if client is None or client not in ready or client is not self._client:
                return b""
            data = client.recv(4096)
        except (OSError, ValueError):
            # Also of a socket that a failed answer has closed meanwhile
            data = b""
        if not data:
            self._hang_up()
        return data

    def _take(self, client: socket.socket, address: tuple[str, int]) -> None:
        if self._peers and not any(ip_address(address[0]) in network for network in self._peers):
            _LOGGER.warning("%s was hung up on: it is none of the peers.", address[0])
            client.close()
            return
        self._hang_up()
        client.settimeout(_WRITING_S)
        self._client = client
        self._heard_s = time.monotonic()

    def _write(self, data: bytes) -> None:
        try:
            if client := self._client:
                client.sendall(data)
        except OSError:
            self._hang_up()


class TerminalServer(_Server):
    """Serve a robot on a pseudo-terminal, whose name stays the same when the link comes back; raise OSError without them."""

    def __init__(self, robot: EmulatedRobot) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="emulated-robot-")
        self.port = str(Path(self._folder.name) / "serial")
        super().__init__(robot)

    def _open(self) -> None:
        import tty  # not on every system

        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        Path(self.port).symlink_to(os.ttyname(self._slave))
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._master, selectors.EVENT_READ)
        self._write(GREETING)

    def _shut(self) -> None:
        Path(self.port).unlink(missing_ok=True)
        self._selector.close()
        for descriptor in (self._master, self._slave):
            os.close(descriptor)

    def close(self) -> None:
        super().close()
        self._folder.cleanup()

    def _read(self) -> bytes:
        with suppress(OSError):
            if self._selector.select(_POLL_S):
                return os.read(self._master, 4096)
            return b""
        return b""

    def _write(self, data: bytes) -> None:
        # Nobody reads, and the line is full: a serial line loses bytes then, too
        with suppress(OSError):
            os.write(self._master, data)


class RobotBody(Body, Protocol):
    """The hardware of a real robot on whose computer Python runs."""

    def set_speed(self, left: int, right: int) -> None:
        """Turn the wheels (steps per second, -1000 to 1000)."""

    def sight(self) -> int:
        """Return the reading I of the line-of-sight sensor: 1 if a robot is ahead."""


class _SteadyBody(RobotBody):
    """A body whose devices may fail for a moment (OSError): the readings before stand in, and the next cycle tries again.

    It is `stopped` where its readings are older than the watchdog's time: nothing then says what it may run into.
    """

    def __init__(self, body: RobotBody, clock: Clock) -> None:
        self._body = body
        self._clock = clock
        self._last: dict[str, Any] = {"sight": 0, "proximity": (0,) * 8, "battery_ok": True}
        self._read_s = dict.fromkeys(("sight", "proximity"), clock.now())
        self._commanding = threading.Lock()

    def _reading(self, name: str) -> Any:
        try:
            self._last[name] = getattr(self._body, name)()
            self._read_s[name] = self._clock.now()
        except OSError as error:
            _LOGGER.warning("The robot's %s cannot be read: %s", name, error)
        return self._last[name]

    def sight(self) -> int:
        return int(self._reading("sight"))

    def proximity(self) -> Sequence[int]:
        return tuple(self._reading("proximity"))

    def battery_ok(self) -> bool:
        return bool(self._reading("battery_ok"))

    def set_speed(self, left: int, right: int) -> None:
        """Turn the wheels, if the body takes the command."""
        with self._commanding:
            try:
                self._body.set_speed(left, right)
            except OSError as error:
                _LOGGER.warning("The wheels cannot be commanded: %s", error)

    @property
    def stopped(self) -> bool:
        oldest_s = min(self._read_s["sight"], self._read_s["proximity"])
        return self._clock.now() - oldest_s > ALONE_S

    def stop(self) -> None:
        """Let it stand, also where the first commands fail."""
        for _ in range(_STOPPING_TRIES):
            with suppress(OSError), self._commanding:
                self._body.set_speed(0, 0)
                return
            time.sleep(_PAUSE_S)


def live(
    body: RobotBody, *, controller: tuple[float, ...] | None = None, host: str = "127.0.0.1", port: int = 5000,
    peers: Sequence[str] = (), clock: Clock | None = None, interval_s: float = 0.1,
    ended: Callable[[], bool] = lambda: False,
) -> None:  # fmt: skip
    """Be a replica on a robot's own computer, or with a `controller` an agent, at a TCP port: docs/robots/firmware.md.

    Speaks the protocol, and goes through the loop, dispersing and avoiding walls, until `ended` returns true.
    Then, and after an error, it stands. The PC must have an address of it, and starts it. A body that raises
    OSError is asked again in the next cycle. The robot stands where its PC, or all readings, or its own control
    cycle are out for 2 s.

    Parameters
    ----------
    body, controller
        The hardware; the wheel speeds of an agent for each sensor state, fractions of the maximum.
    host, port
        Where it listens. Only programs on the robot's computer reach "127.0.0.1"; "0.0.0.0" is every network.
    peers
        Addresses or networks that may connect, such as the PC's "10.0.0.1". Required for other hosts than
        loopback: who connects moves the robot.
    clock, interval_s
        The computer's clock by default; seconds of a control cycle.
    ended
        Whether to end.
    """
    remedy = "Give the PC's address, as peers=('10.0.0.1',)."
    # Who connects moves the robot
    try:
        local = ip_address(socket.gethostbyname(host)).is_loopback
    except OSError as error:
        refuse("host", "be an address or a name of IPv4", repr(host), f"({error})")
    for peer in peers:
        try:
            ip_network(peer)
        except ValueError:
            refuse("peers", "be addresses or networks", repr(peer), remedy)
    rule = f"name who may move the robot at host {host!r}"
    require(local or peers, "peers", rule, "nobody", remedy)
    clock = clock or RealClock()
    steady = _SteadyBody(body, clock)
    robot = EmulatedRobot(
        steady, clock=clock.now, controller=controller, tell=lambda signal: line.signal(signal)
    )
    stepped_s = clock.now()
    over = threading.Event()

    def watch() -> None:
        """Let the robot stand where its control cycle hangs, in a camera that gives no image for example."""
        while not over.wait(_WATCHING_S):
            if clock.now() - stepped_s > ALONE_S:
                steady.set_speed(0, 0)

    watchdog = threading.Thread(target=watch, daemon=True)
    try:
        with TcpServer(robot, host=host, port=port, peers=peers) as line:
            watchdog.start()
            due = clock.now()
            while not ended():
                sight = steady.sight()
                proximity = steady.proximity()
                left, right = robot.step(clock.now(), sight, proximity)
                if steady.stopped:
                    left, right = STILL
                stepped_s = clock.now()
                steady.set_speed(round(FULL_SPEED * left), round(FULL_SPEED * right))
                due = max(due + interval_s + robot.take_pause(interval_s), clock.now())
                clock.sleep(due - clock.now())
    finally:
        over.set()
        steady.stop()
