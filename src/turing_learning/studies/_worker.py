"""A worker process: reads tasks as lines of JSON, executes them, answers with lines of JSON.

It is a program of its own, ``python -m turing_learning.studies._worker``, and not a child made by `multiprocessing`, so
that a study can be called from a script or notebook without a guard, and nothing is pickled.
"""

import json
import os
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import TextIO

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
WARM_UP = "warm up"
READY = "ready"


def serve(requests: TextIO, answers: TextIO, should_stop: Callable[[], bool]) -> None:
    """Answer requests until there are no more, or the one who asked is gone."""
    for line in requests:
        answer = _answer(json.loads(line), should_stop)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _answer(request: Mapping[str, object], should_stop: Callable[[], bool]) -> dict[str, object]:
    from ._execute import Task, execute

    if WARM_UP in request:
        _warm_up(str(request["study"]), request[WARM_UP])
        return {WARM_UP: READY}
    return asdict(execute(Task(**request), should_stop))  # type: ignore[arg-type]


def _warm_up(study: str, numbers: object) -> None:
    """Run one generation of some runs, so that all kernels are compiled and kept; what fails here fails again later."""
    import contextlib
    from pathlib import Path

    from turing_learning.runs import infer

    from ._folder import StudyFolder

    assert isinstance(numbers, list)
    for number in numbers:
        with contextlib.suppress(Exception):
            infer(config=StudyFolder(Path(study)).plan().configuration(number), generations=1)


def _orphaned(parent: int) -> bool:
    return os.name == "posix" and os.getppid() != parent


def main() -> None:
    """Serve the process that has started this one; its end is noticed after the present generation."""
    parent = os.getppid()
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study decides what Ctrl-C does
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what anything prints goes where messages go
    serve(sys.stdin, answers, lambda: _orphaned(parent))


if __name__ == "__main__":
    main()
