"""What the tests of commands and runs share."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.cli import main
from turing_learning.config import load_configuration
from turing_learning.trajectories import _trajectories, compute_signals

SMALL = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.generations": 7,
    "run.checkpoint_every": 3,
    "run.threads": 1,
}


@pytest.fixture
def on_another_processor(monkeypatch):
    """Return what lets every signal that is computed from then on end in another digit."""

    def computed(*arguments, **options):
        signals = compute_signals(*arguments, **options)
        return replace(signals, values=np.nextafter(signals.values, np.inf))

    return lambda: monkeypatch.setattr(_trajectories, "compute_signals", computed)


@pytest.fixture
def call(capsys, tmp_path, monkeypatch):
    """Call the command line in an empty folder; return exit code, output and errors."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return ended.value.code, printed.out, printed.err

    return call


@pytest.fixture(scope="session")
def done():
    """Call the command line, which must succeed: for fixtures of what several tests look at."""

    def done(*arguments):
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        assert ended.value.code == 0

    return done


@pytest.fixture
def wide(monkeypatch):
    """Let tables have room."""
    monkeypatch.setenv("COLUMNS", "200")


@pytest.fixture(scope="session")
def small():
    """A configuration whose generations take about a millisecond."""

    def configure(**changes):
        return load_configuration(
            overrides=SMALL | {f"run.{name}": value for name, value in changes.items()}
        )

    return configure


@pytest.fixture
def stop_after():
    """Return a should_stop that stops a run after some generations."""

    def make(generations):
        asked = iter([False] * (generations - 1))
        return lambda: next(asked, True)

    return make
