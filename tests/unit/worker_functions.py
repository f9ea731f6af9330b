"""Functions that worker processes can import."""

import os
import sys
import threading
import time
from pathlib import Path

from turing_learning.workers import asked_to_stop


def double(value):
    sys.stdout.write("noise")
    sys.stdout.flush()
    sys.stderr.write("noise")
    os.write(1, b"noise")
    return 2 * value


def process(seconds=0.0):
    time.sleep(seconds)
    return os.getpid()


def sleep_if(value):
    if value:
        time.sleep(600)
    return value


def die_if(value, status=9):
    if value:
        os._exit(status)
    return value


def die_once(path):
    if not Path(path).exists():
        Path(path).touch()
        os._exit(9)
    return path


class Special(Exception):
    def __init__(self, one, two):
        super().__init__(f"{one} {two}")


def fail(kind):
    if kind == "special":
        raise Special(1, 2)
    if kind == "result":
        return threading.Lock()
    raise ValueError(f"no {kind}")


def until_asked(path=None):
    if path is not None:
        Path(path).write_text(str(os.getpid()))
    begun = time.monotonic()
    while not asked_to_stop():
        if time.monotonic() > begun + 60:
            raise TimeoutError
        time.sleep(0.01)
    return "asked"


def log_and_sleep(path):
    Path(path).write_text(str(os.getpid()))
    time.sleep(600)


def settings():
    return {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS")}


def log(path, value, seconds=0.0):
    time.sleep(seconds)
    with Path(path).open("a") as file:
        file.write(f"{value}\n")


class NotLoaded:
    def __call__(self):
        return None

    def __reduce__(self):
        return _raise, ()


def _raise():
    raise ImportError("no such model")
