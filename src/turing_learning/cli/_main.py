"""The entry point: run a command, and turn what a user can cause into one line and an exit code."""

import errno
import os
import sys
from collections.abc import Sequence

from turing_learning.errors import RefusedError

from ._exit import DONE, FAILED, INTERRUPTED, REFUSED, Interrupted
from ._wording import on_the_command_line
from ._words import OPTIONS

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
_NO_WAY = (
    *(errno.EACCES, errno.EPERM, errno.EROFS),
    *(errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ELOOP, errno.ENAMETOOLONG),
)


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
    sys.exit(_run(sys.argv[1:] if arguments is None else list(arguments)))


def _run(arguments: list[str]) -> int:
    from ._app import app

    try:
        outcome = app(arguments, prog_name="turing-learning", standalone_mode=False)
    except Interrupted as stop:
        return _say(str(stop), INTERRUPTED)
    except KeyboardInterrupt:
        return _say("interrupted", INTERRUPTED)
    except BrokenPipeError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - nobody reads on
        return FAILED
    except MemoryError as error:
        return _say(f"error: this machine has not enough memory ({error}); choose smaller sizes", FAILED)
    except Exception as error:
        code, message = _code(error), on_the_command_line(_message(error))
        return _say(f"error: {message}", code) if message else code  # without a message help has been printed
    return outcome if isinstance(outcome, int) else DONE


def _say(text: str, code: int) -> int:
    sys.stderr.write(f"{text}\n")
    return code


def _code(error: Exception) -> int:
    """Return the exit code of an error that a user can cause; others are bugs, and are raised again."""
    from turing_learning.config import ConfigurationError
    from turing_learning.robots import LaboratoryError
    from turing_learning.runs import RunFolderError, RunStorageError
    from turing_learning.sources import OwnSystemError
    from turing_learning.studies import ExecutorError

    if isinstance(error, RunStorageError | OwnSystemError | ExecutorError | LaboratoryError):
        return FAILED
    if isinstance(error, ConfigurationError | RunFolderError) or _is_usage_error(error):
        return REFUSED
    if isinstance(error, OSError) and _told(error):
        return FAILED
    raise error


def _is_usage_error(error: Exception) -> bool:
    # typer has its own copy of click in newer versions, so that the class has several homes
    return any(kind.__name__ in ("UsageError", "ClickException", "TyperException") for kind in type(error).__mro__)


def _told(error: OSError) -> str:
    """Return what is said of a file where no door has said it already; nothing of what no user can cause."""
    if error.errno in _NO_ROOM:
        return (
            f"no room is left for {error.filename or 'what is written'} ({error.strerror}). Make room, then give the same "
            "command again."
        )
    if error.errno in _NO_WAY and error.filename is not None:
        return f"{error.filename} cannot be used ({error.strerror}). Check that it is there, and that it may be read and written."
    return ""


def _message(error: Exception) -> str:
    if isinstance(error, OSError) and (said := _told(error)):
        return said
    if isinstance(error, RefusedError):
        return error.text(OPTIONS)
    text = error.format_message() if hasattr(error, "format_message") else str(error)
    return " ".join(text.split()) if _is_usage_error(error) else text
