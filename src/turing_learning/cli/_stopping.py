"""How a command ends: what stops it and how it says so, in the command line's words for arguments, settings and calls."""

import shlex
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import FrameType

from turing_learning.errors import Call, Setting, Words

DONE = 0
FAILED = 1
REFUSED = 2
INTERRUPTED = 130
"""Exit codes."""

_SIGNALS = [signal.SIGINT, signal.SIGTERM]
# Windows has none
if hasattr(signal, "SIGHUP"):
    _SIGNALS.append(signal.SIGHUP)

# Options that stand in messages with their dashes, though Python has the same names.
_ALIKE = (
    "fps",
    "y_axis",
    "format",
    "keypoint",
    "trajectories",
    "signals",
    "tank",
    "min_confidence",
    "hold_out_individuals",
    "hold_out_recordings",
    "heading",
    "resample",
    "project",
    "range",
)
_OPTIONS = {name: f"--{name.replace('_', '-')}" for name in _ALIKE} | {
    "pixels_per_cm": "--pixels-per-cm", "length_s": "--window", "steps": "--window", "max_gap": "--bridge",
    "smooth_frames": "--smooth", "names": "--signals", "tank_cm": "--tank", "tanks": "--tank", "columns": "--column",
    "longest_rest_s": "--longest-rest", "longest_gap_s": "--split-gaps", "every": "--thin",
}  # fmt: skip
"""Arguments of Python whose options have other names, or stand in messages with their dashes."""

_PROGRAM = {"genuine": "--series", "simulate": "--simulate-command"}
"""The same of a program and its tables."""

_RECORDED = {"genuine": "--trajectories", "simulate": "--model"}
"""What a recording and a family of models stand for; `detect` has a --genuine of its own."""


class Interrupted(Exception):
    """A run was stopped and can be resumed."""


class StopRequest:
    """Whether somebody has asked the run to stop; call it to know.

    `at_once` says that all is stored, so that the first signal ends it. With `announce`, of a run
    with robots, the first signal says what it returns, and later ones than the second are only
    answered, because the robots are being halted.
    """

    def __init__(self, announce: Callable[[], str] | None = None) -> None:
        self.at_once = False
        self._asked = self._halting = False
        self._announce = announce

    def __call__(self) -> bool:
        return self._asked

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal; the second one raises KeyboardInterrupt."""
        if self._halting and self._announce is not None:
            _say("the robots are being halted")
            return
        if self._asked or self.at_once:
            self._halting = True
            raise KeyboardInterrupt
        self._asked = True
        if self._announce is not None:
            _say(self._announce())


def _say(text: str) -> None:
    # a signal may come while something else is being written
    with suppress(RuntimeError, OSError):
        sys.stderr.write(f"\n{text}\n")
        sys.stderr.flush()


@contextmanager
def handling(
    numbers: Iterable[int], handler: Callable[[int, FrameType | None], object]
) -> Iterator[None]:
    """Handle signals inside the block, also where a shell has started the command in the background, deaf to Ctrl-C."""
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


@contextmanager
def stopping(
    ahead: str | Callable[[], str], announce: Callable[[], str] | None = None
) -> Iterator[StopRequest]:
    """Let signals ask for a stop inside the block; one that was ended at once says how to resume. See `StopRequest`."""
    request = StopRequest(announce)
    try:
        with handling(_SIGNALS, request.receive):
            yield request
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}" if isinstance(ahead, str) else ahead()) from error


class OptionWords(Words):
    """The names of options and commands, for the command that was given."""

    def __init__(self, command: str = "", *, program: bool = False) -> None:
        of_source = _PROGRAM if program else _RECORDED
        self._options = _OPTIONS if command == "detect" else _OPTIONS | of_source

    def name(self, name: str) -> str:
        """Return the option of an argument; a name that is no argument of a function stays as it is."""
        if name.startswith("--"):
            return name
        return self._options.get(name, name)

    def setting(self, setting: Setting) -> str:
        """Return ``--name value``; ``--set key=value`` for a key of the configuration; only ``--name`` for a switch."""
        value = setting.value
        if "." in setting.name:
            return f"--set {setting.name}={'...' if value is None else value}"
        option = self._options.get(setting.name, f"--{setting.name.replace('_', '-')}")
        if value is None or value is True:
            return option
        if not isinstance(value, Mapping):
            return f"{option} {shlex.quote(str(value))}"
        pairs = [shlex.quote(f"{name}={content}") for name, content in value.items()]
        return " ".join(f"{option} {pair}" for pair in pairs)

    def call(self, call: Call) -> str:
        """Return the command in backticks; a custom system is given from Python, and a recording by its options."""
        command = f"`{shlex.join(filter(None, ('turing-learning', call.verb, call.path)))}`"
        if call.more:
            command += " and the options that the run began with"
        return command
