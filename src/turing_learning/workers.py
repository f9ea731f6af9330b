"""One executor of processes: calls of one function in processes of their own, which may hang, die or print without harm.

Simulators of custom systems, runs of studies and pieces of experiments are executed here. A worker
is a fresh interpreter, not a fork: it has no threads or locks of its parent. What it prints goes to
standard error. It ignores Ctrl-C: the parent decides. When the parent dies, a worker ends at once
or, if it is patient, as soon as its call has looked at `asked_to_stop`.
"""

import multiprocessing.process
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing import spawn
from multiprocessing.reduction import ForkingPickler
from typing import Any, BinaryIO, cast

ONE_THREAD = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
"""Environment variables by which libraries of linear algebra learn their number of threads."""

# What a worker executes, what it prints when it begins, and the message that asks it to end its
# call.
_PROGRAM = "from turing_learning.workers import serve; serve()"
_HELLO = b"a worker of turing-learning\n"
_STOP = b""

# What `multiprocessing` needs to import the calling script.
_SCRIPT = ("sys_argv", "init_main_from_name", "init_main_from_path")

# In a worker: whether it was asked to end its call, and whether it imports the calling script.
_stopping = threading.Event()
_loading = False


class WorkerDied(Exception):
    """The process of a call died, or was killed."""


class NotImportable(Exception):
    """A worker could not load the function that it was to call."""


class _DiedError(Exception):
    """The process of a slot has died."""


def asked_to_stop() -> bool:
    """Return, in a worker, whether its call should end soon: somebody asked for it, or the parent is gone."""
    return _stopping.is_set()


def packed(function: Callable[..., Any]) -> bytes:
    """Return a function as it is sent to workers; raises what pickle raises."""
    return bytes(ForkingPickler.dumps(function))


class Workers:
    """Processes that call one function; they are started when they are needed, and kept.

    The function is one of a module, a `functools.partial` of one, or what `packed` made of it. A
    call that takes longer than `timeout_s` is given up, its process killed, and a TimeoutError
    raised. `attempts` processes may die of a call before it is given up with `WorkerDied`. One
    process makes a call with the arguments `warm_up` before the others begin, so that kernels are
    compiled once; what it raises is left to the calls that follow. With `script` the calling script
    is imported, so that its functions can be called; it then needs a guard of ``__main__``. A
    `patient` worker whose parent is gone ends its call, see `asked_to_stop`; others end at once.
    With `one_thread` the libraries of linear algebra have one thread in each process.
    """

    def __init__(
        self,
        function: Callable[..., Any] | bytes,
        count: int,
        *,
        timeout_s: float | None = None,
        attempts: int = 1,
        warm_up: tuple[Any, ...] | None = None,
        script: bool = True,
        patient: bool = False,
        one_thread: bool = False,
    ) -> None:
        if _loading:
            remedy = 'A script that is run with workers keeps its calls under `if __name__ == "__main__":`'
            raise RuntimeError(
                f"workers must not be started while a worker imports the script. {remedy}"
            )
        content = function if isinstance(function, bytes) else packed(function)
        preparation = {}
        if script:
            preparation = spawn.get_preparation_data("worker")
            preparation = {key: preparation[key] for key in _SCRIPT if key in preparation}
        setting = {"patient": patient, "path": sys.path, "script": preparation}
        environment = dict(os.environ)
        if one_thread:
            environment = dict.fromkeys(ONE_THREAD, "1") | environment
        first_messages = (pickle.dumps(setting), content)
        self._slots = [_Slot(first_messages, environment, timeout_s) for _ in range(count)]
        self._attempts = attempts
        self._warm_up = warm_up
        self._warm = threading.Event()
        self._calls: queue.SimpleQueue[tuple[tuple[Any, ...], Future[Any]] | None] = (
            queue.SimpleQueue()
        )
        self._threads: list[threading.Thread] = []
        self._finish = weakref.finalize(self, _abandon, self._slots, self._calls)

    def submit(self, *arguments: Any) -> "Future[Any]":
        """Call the function as soon as a process is free.

        The future raises what the function raises, `WorkerDied`, or TimeoutError.
        """
        if not self._threads:
            for k, slot in enumerate(self._slots):
                thread = threading.Thread(
                    target=_serve_slot,
                    args=(slot, self._calls, self._attempts, self._warm, self._warm_up, k == 0),
                    name="turing-learning-worker",
                    daemon=True,
                )
                self._threads.append(thread)
                thread.start()
        future: Future[Any] = Future()
        self._calls.put((arguments, future))
        return future

    def in_order(self, calls: Iterable[tuple[Any, ...]]) -> "Iterator[Future[Any]]":
        """Submit calls; yield the futures, which are done, in the order of the calls.

        Leaving the loop cancels the calls that have not begun.
        """
        futures = [self.submit(*arguments) for arguments in calls]
        try:
            for future in futures:
                with suppress(Exception):  # it was cancelled
                    future.exception()
                yield future
        finally:
            for future in futures:
                future.cancel()

    def stop(self) -> None:
        """Ask all workers to end their calls soon, see `asked_to_stop`."""
        for slot in self._slots:
            slot.stop()

    def close(self) -> None:
        """End the workers; wait for those that execute a call."""
        for _ in self._threads:
            self._calls.put(None)
        for thread in self._threads:
            thread.join()
        self._threads = []

    def kill(self) -> None:
        """End the workers at once; calls that wait or are executed raise `WorkerDied`."""
        for slot in self._slots:
            slot.kill()


def _abandon(slots: "list[_Slot]", calls: Any) -> None:
    for slot in slots:
        slot.kill()
        calls.put(None)


def _serve_slot(
    slot: "_Slot",
    calls: Any,
    attempts: int,
    warm: threading.Event,
    warm_up: tuple[Any, ...] | None,
    warms_up: bool,
) -> None:
    """Execute calls in one slot, by one process after the other.

    The body of a thread of the parent.
    """
    try:
        if warms_up:
            with suppress(Exception):  # the calls will say why
                if warm_up is not None:
                    slot.call(warm_up)
            warm.set()
        warm.wait()
        while (item := calls.get()) is not None:
            arguments, future = item
            if future.set_running_or_notify_cancel():
                _execute(slot, arguments, future, attempts)
    finally:
        warm.set()
        slot.end()


def _execute(
    slot: "_Slot", arguments: tuple[Any, ...], future: "Future[Any]", attempts: int
) -> None:
    """Give a future its result or error; several processes may die of the call."""
    for attempt in range(attempts):
        try:
            result = slot.call(arguments)
        except _DiedError as death:
            if attempt == attempts - 1:
                workers = f"{attempts} workers" if attempts > 1 else "the worker"
                future.set_exception(WorkerDied(f"{workers} died while executing it ({death})"))
        except BaseException as error:
            future.set_exception(error)
            return
        else:
            future.set_result(result)
            return


class _Slot:
    """A place for one worker process after the other."""

    def __init__(
        self,
        first_messages: tuple[bytes, bytes],
        environment: dict[str, str],
        timeout_s: float | None,
    ) -> None:
        self._first_messages = first_messages
        self._environment = environment
        self._timeout_s = timeout_s
        self._process: subprocess.Popen[bytes] | None = None
        self._sending = threading.Lock()
        self._killed = False
        self._stopped = False
        self._ready = False

    def call(self, arguments: tuple[Any, ...]) -> Any:
        """Return what the function returns, or raise what it raises.

        _DiedError if the process dies.
        """
        content = pickle.dumps(arguments)
        status = ""
        # The process may have died between two calls
        for _ in range(2):
            if self._process is None or self._process.poll() is not None:
                self._start()
            process = self._process
            if process is None:
                raise _DiedError("killed on demand")
            answer, sent, late = self._exchange(process, content)
            if answer is None or late:
                self.end()
            if answer is not None:
                succeeded, result = pickle.loads(answer)  # noqa: S301 - from a process of our own
                if not succeeded:
                    raise result
                return result
            if late:
                raise TimeoutError(f"it took longer than {self._timeout_s:g} s")
            status = "killed on demand"
            if not self._killed:
                status = f"exit status {process.returncode}"
            if sent:
                break
        raise _DiedError(status)

    def _exchange(
        self, process: "subprocess.Popen[bytes]", content: bytes
    ) -> tuple[bytes | None, bool, bool]:
        """Return the answer to a call, None without one; whether the call was sent.

        Whether time ran out.
        """
        late = threading.Event()
        timer = threading.Timer(self._timeout_s or threading.TIMEOUT_MAX, _expire, (process, late))
        timer.daemon = True
        answer = None
        sent = False
        try:
            if self._timeout_s is not None:
                timer.start()
            self._send(content)
            sent = True
            answer = _received(cast(BinaryIO, process.stdout))
        except OSError:
            pass
        finally:
            if timer.is_alive():
                timer.cancel()
                timer.join()
        return answer, sent, late.is_set()

    def _start(self) -> None:
        self.end()
        if self._killed:
            return
        path = os.pathsep.join(filter(None, sys.path))
        process = subprocess.Popen(
            [sys.executable, "-u", "-c", _PROGRAM],  # -u: what it prints comes at once
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=self._environment | {"PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C is for the parent
        )
        self._process = process
        # Meanwhile, by another thread
        if self._killed:
            process.kill()
        output = cast(BinaryIO, process.stdout)
        for line in output:
            if line.endswith(_HELLO):
                break
            # What prints when Python starts, such as a sitecustomize.
            sys.stderr.write(line.decode(errors="replace"))
        answer = None
        with suppress(OSError):
            for message in self._first_messages:
                self._send(message)
            self._ready = True
            if self._stopped:
                self._send(_STOP)
        # A script that cannot be imported says so before it has read all that is sent
        with suppress(OSError):
            answer = _received(output)
        if answer is None:
            self.end()
            if self._killed:
                return
            if process.returncode < 0:
                raise _DiedError(f"exit status {process.returncode}")
            status = f"with exit status {process.returncode}"
            raise NotImportable(f"its process ended before the first call, {status}")
        loaded, reason = pickle.loads(answer)  # noqa: S301 - from a process of our own
        if not loaded:
            self.end()
            raise NotImportable(reason)

    def _send(self, content: bytes) -> None:
        with self._sending:
            process = self._process
            if process is None:
                raise BrokenPipeError
            pipe = cast(BinaryIO, process.stdin)
            pickle.dump(content, pipe)
            pipe.flush()

    def stop(self) -> None:
        """Ask the worker to end its call soon, and every one that follows it."""
        self._stopped = True
        if self._ready:
            with suppress(OSError, ValueError):
                self._send(_STOP)

    def end(self) -> None:
        """Let the worker end, and wait for it."""
        process = self._process
        self._process = None
        self._ready = False
        if process is None:
            return
        for pipe in (process.stdin, process.stdout):
            # What was written last can no longer be sent
            with suppress(OSError):
                cast(BinaryIO, pipe).close()
        process.wait()

    def kill(self) -> None:
        """End the worker at once, and start no other."""
        self._killed = True
        process = self._process
        if process is not None:
            process.kill()


def _expire(process: "subprocess.Popen[bytes]", late: threading.Event) -> None:
    late.set()
    process.kill()


def serve() -> None:
    """Answer calls until the parent closes the connection; the program of a worker."""
    global _loading
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests = sys.stdin.buffer
    answers = os.fdopen(os.dup(1), "wb")
    # What anything prints goes where messages go
    os.dup2(2, 1)
    answers.write(_HELLO)
    answers.flush()
    setting = pickle.loads(_received(requests) or b"")  # noqa: S301 - from the process that started this one
    process = multiprocessing.process.current_process()
    try:
        sys.path[:] = setting["path"]
        _loading = True
        process._inheriting = True  # type: ignore[attr-defined] # a script without a guard cannot start pools, either
        spawn.prepare(setting["script"])
        function = pickle.loads(_received(requests) or b"")  # noqa: S301
    except BaseException as error:
        _answer(answers, False, f"{type(error).__name__}: {error}")
        return
    _loading = False
    del process._inheriting  # type: ignore[attr-defined]
    _answer(answers, True, None)
    calls: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(requests, calls, setting["patient"]), daemon=True).start()
    while (content := calls.get()) is not None:
        try:
            result = function(*pickle.loads(content))  # noqa: S301
            succeeded = True
        except Exception as error:
            result = error
            succeeded = False
        try:
            _answer(answers, succeeded, result)
        except OSError:
            return


def _read(requests: BinaryIO, calls: Any, patient: bool) -> None:
    """Take what the parent sends while the main thread executes a call."""
    while (content := _received(requests)) is not None:
        if content == _STOP:
            _stopping.set()
        else:
            calls.put(content)
    _stopping.set()
    if not patient:
        os._exit(0)
    calls.put(None)


def _answer(answers: BinaryIO, succeeded: bool, result: Any) -> None:
    try:
        content = pickle.dumps((succeeded, result))
        if not succeeded:
            pickle.loads(content)  # noqa: S301 - an exception with arguments of its own may not come back
    except Exception as error:
        reason = result if isinstance(result, BaseException) else error
        content = pickle.dumps((False, RuntimeError(f"{type(reason).__name__}: {reason}")))
    pickle.dump(content, answers)
    answers.flush()


def _received(stream: BinaryIO) -> bytes | None:
    """Return what was sent at once, None at the end of the stream."""
    try:
        return cast(bytes, pickle.load(stream))  # noqa: S301 - from a process of our own
    except (EOFError, pickle.UnpicklingError, OSError, ValueError):
        # It ended in between, or was closed meanwhile
        return None
