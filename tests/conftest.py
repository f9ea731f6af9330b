"""What all tests share."""

import os
from collections import Counter
from pathlib import Path
from zlib import crc32

# Threads of BLAS wait for each other in loops: two processes of the suite with two threads each take several times the time.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
from blank_figures import blanks
from filelock import FileLock
from hypothesis import settings
from matplotlib.figure import Figure

# A machine that is busy is no failure; times are measured in benchmarks/.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

HERE = Path(__file__).parent
CHILDREN = str(HERE / "children")
"""Python's path for the processes that tests start."""

FAST_ROOMS = (
    "analysis", "classifiers", "coevolution", "config", "evolution", "families", "few_trials", "models", "trajectories",
)  # fmt: skip
"""Rooms under tests/unit whose tests need no simulated robots and no processes, but for `SLOW_FILES`."""

SLOW_FILES = {
    "test_circles.py",  # starts processes
    "test_executor.py",  # starts processes
    "test_family.py",  # compiles the sensors of robots
    "test_batches.py",  # complete runs
    "test_matching.py",  # statistics over many seeds
    "test_reader_fuzz.py",  # hundreds of random files
    "test_several_recordings.py",  # complete runs
}

DRAWN = {"browser", "figures", "report"}
"""Folders of tests that look at pictures, or are there to draw them."""

DRAWN_FILES = {
    "test_detect_recording_command.py",
    "test_gallery.py",
    "test_look_command.py",
    "test_morphology.py",
    "test_own_simulator.py",
    "test_response_maps.py",
    "test_zebrafish_example.py",
}
"""Files in other folders that do."""


def pytest_xdist_auto_num_workers(config):
    """Let the suite use all processors (None: as many as there are), and a room or a file this process alone."""
    asked = [
        Path(config.invocation_params.dir, each.partition("::")[0]).resolve()
        for each in config.args
    ]
    return None if any(HERE.is_relative_to(path) for path in asked) else 0


def pytest_configure(config):
    """Refuse two files of tests of one name, of which Python can import only one: a room alone would not show it."""
    names = Counter(path.name for path in HERE.rglob("test_*.py"))
    if twice := sorted(name for name, count in names.items() if count > 1):
        raise pytest.UsageError(
            f"files of tests must have different names in all rooms; got twice: {', '.join(twice)}"
        )


def _is_fast(path):
    folder = path.parent
    if path.name in SLOW_FILES:
        return False
    return folder == HERE / "unit" or (folder.parent == HERE / "unit" and folder.name in FAST_ROOMS)


def pytest_ignore_collect(collection_path, config):
    """Import only the files of the fast tests where nothing else is asked for: importing all others takes longer than they do."""
    if (
        config.option.markexpr == "fast"
        and collection_path.is_file()
        and not _is_fast(collection_path)
    ):
        return True
    return None


def pytest_collection_modifyitems(items):
    """Mark the tests that a contributor runs after each change; see CONTRIBUTING.md."""
    for item in items:
        if _is_fast(item.path):
            item.add_marker("fast")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Let no figure be drawn that nobody looks at: neither by a test, nor by its fixtures and the processes that it starts."""
    if item.path.parent.name in DRAWN or item.path.name in DRAWN_FILES:
        return (yield)
    children = os.pathsep.join(filter(None, (CHILDREN, os.environ.get("PYTHONPATH"))))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", children)
        for method, blank in blanks(Figure).items():
            patch.setattr(Figure, method, blank)
        return (yield)


@pytest.fixture(autouse=True)
def same_random_numbers(request, monkeypatch):
    """Seed `RNG`, where a file has it, anew for each test: what one draws does not depend on which ran before in its process."""
    if hasattr(request.module, "RNG"):
        monkeypatch.setattr(
            request.module, "RNG", np.random.default_rng(crc32(request.node.name.encode()))
        )


@pytest.fixture(scope="module")
def few_kernels():
    """Let examiners see a tenth of their random kernels, whose features take most of the time of a short check."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("turing_learning.examination._convolution.FEATURES", 100)
        yield


@pytest.fixture(scope="module")
def few_moves():
    """Let draws of the right model move seldom: half of the time of a run of few trials, where nobody looks at the draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("turing_learning.few_trials._loop.REPEATS", 1)
        patch.setattr("turing_learning.few_trials._draws.MOVES_PER_POWER", 2)
        patch.setattr("turing_learning.few_trials._draws.LAST_MOVES", 10)
        yield


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Return a function that fills a folder by a name, once for all processes of the suite; it is not to be changed."""
    here = tmp_path_factory.getbasetemp()
    common = here.parent if "PYTEST_XDIST_WORKER" in os.environ else here

    def filled(name, fill):
        folder = common / f"once-{name}"
        with FileLock(common / f"once-{name}.lock"):
            if not (folder / "filled").exists():
                folder.mkdir(exist_ok=True)
                fill(folder)
                (folder / "filled").touch()
        return folder

    return filled
