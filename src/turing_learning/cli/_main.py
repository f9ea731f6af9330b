"""The entry point: run a command, and turn what a user can cause into one line and an exit code."""

import atexit
import errno
import gc
import logging
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import turing_learning as tl
from turing_learning.errors import MissingExtraError, RefusedError

from ._stopping import DONE, FAILED, INTERRUPTED, REFUSED, Interrupted, OptionWords

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
_NOT_USABLE = (
    errno.EACCES,
    errno.EPERM,
    errno.EROFS,
    errno.ENOENT,
    errno.ENOTDIR,
    errno.EISDIR,
    errno.EEXIST,
    errno.ELOOP,
    errno.ENAMETOOLONG,
)
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")

# New objects after which cycles are looked for. With 700, as usual, that takes a twentieth of a
# command's time: nearly all objects are those of modules, which stay.
OBJECTS = 20_000

# Brackets in an argument that may be too many for a parser.
DEEPEST = 300

# Columns in which rich can lay out a table.
FEWEST_COLUMNS = 10


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit.

    Parameters
    ----------
    arguments
        Without the program's name; None takes those of the process.

    Raises
    ------
    SystemExit
        Always, with the exit code.
    """
    _open_closed_streams()
    gc.set_threshold(OBJECTS, *gc.get_threshold()[1:])
    # The system frees all memory at once when the process ends.
    atexit.register(gc.freeze)
    for name in ("turing_learning.kernels", "turing_learning.runs"):
        stages = logging.getLogger(name)
        if not stages.handlers:
            stages.addHandler(_Said())
            stages.setLevel(logging.INFO)
    sys.exit(_run(sys.argv[1:] if arguments is None else list(arguments)))


def _open_closed_streams() -> None:
    """Let a stream that is closed be empty, or forget what is written.

    Otherwise the next file that is opened would get its number, and with it what libraries print.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115 - as long as the process


class _Said(logging.Handler):
    """Write what is compiled, or examined, to standard error at once, also where that is a file or a pipe."""

    def emit(self, record: logging.LogRecord) -> None:
        sys.stderr.write(f"{record.getMessage()}\n")
        sys.stderr.flush()


def _run(arguments: list[str]) -> int:
    from cyclopts import CycloptsError

    columns = os.environ.get("COLUMNS", "")
    if not (columns.isdecimal() and len(columns) < 5 and int(columns) >= FEWEST_COLUMNS):
        # as programs of the shell do
        os.environ.pop("COLUMNS", None)

    from ._app import app

    try:
        if not arguments:
            app.help_print([])
            return REFUSED
        outcome = app(arguments)
        sys.stdout.flush()
    except Interrupted as stop:
        return _say(str(stop), INTERRUPTED)
    except KeyboardInterrupt:
        return _say("interrupted", INTERRUPTED)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - nobody reads on
        return FAILED
    except MemoryError as error:
        return _say(
            f"error: this machine has not enough memory ({error}); choose smaller sizes", FAILED
        )
    except RecursionError:
        if max(map(len, arguments)) < DEEPEST:
            raise
        return _say("error: an argument must not be nested so deeply", REFUSED)
    except CycloptsError as error:
        error.verbose = False
        return _say(f"error: {' '.join(str(error).split())}", REFUSED)
    except MissingExtraError as error:
        return _say(f"error: {error}", REFUSED)
    except RefusedError as error:
        program = any(argument.startswith("--simulate-command") for argument in arguments)
        words = OptionWords(arguments[0], program=program)
        return _say(f"error: {error.text(words)}", REFUSED)
    except (
        tl.runs.RunStorageError,
        tl.systems.CustomSystemError,
        tl.studies.ExecutorError,
        tl.robots.LaboratoryError,
    ) as error:
        return _say(f"error: {error}", FAILED)
    except OSError as error:
        return _say(f"error: {_of_files(error)}", FAILED)
    return outcome if isinstance(outcome, int) else DONE


def _say(text: str, code: int) -> int:
    # One line, whatever is in a path.
    line = _CONTROL.sub(lambda control: ascii(control[0])[1:-1], text)
    sys.stderr.write(line + "\n")
    return code


def _of_files(error: OSError) -> str:
    """Return what to say of a file that cannot be used; other errors are bugs, and are raised again."""
    try:
        Path.cwd()
    except OSError:
        return "the folder in which the command runs is gone. Change to another folder, then give the command again."
    # files have names
    if error.errno in _NO_ROOM and error.filename is None:
        trouble = f"what the command prints could not be written ({error.strerror})"
        return f"{trouble}. Print elsewhere. What is stored can be shown, and a run that was not done be resumed."
    if error.errno in _NO_ROOM:
        return f"no room is left for {error.filename} ({error.strerror}). Make room, then give the same command again."
    if error.errno in _NOT_USABLE and error.filename is not None:
        return f"{error.filename} cannot be used ({error.strerror}). Check that it is there, and that it may be read and written."
    raise error
