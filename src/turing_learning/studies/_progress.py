"""What an observer is told while the runs of a study go on."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from turing_learning.runs import stored_generations

from ._folder import StudyFolder
from ._plan import Plan
from ._table import StudyRun, read_run

LOOK_EVERY_S = 1.0  # between two looks at the checkpoints


@dataclass(frozen=True)
class StudyProgress:
    """How far a study is.

    Attributes
    ----------
    total, done, failed, running
        Numbers of runs.
    maes
        MAE of the estimate of every run that is done.
    finished
        The runs that have ended since the last call.
    generations, generations_total
        Generations of all runs, completed up to the last checkpoints and asked for.
    seconds
        Time since the study was begun or gone on with (s).
    seconds_left
        Time until the end at the mean rate (s); None until the rate is known.
    """

    total: int
    done: int
    failed: int
    running: int
    maes: tuple[float, ...]
    finished: tuple[StudyRun, ...]
    generations: int
    generations_total: int
    seconds: float
    seconds_left: float | None


StudyObserver = Callable[[StudyProgress], None]


class ProgressCounter:
    """Counts.

    Parameters
    ----------
    folder
        The study.
    plan
        What runs.
    ended
        The runs that had ended before.
    """

    def __init__(self, folder: StudyFolder, plan: Plan, ended: Iterable[StudyRun]) -> None:
        self._folder, self._plan = folder, plan
        self._runs = {run.number: run for run in ended}
        self._asked = {number: _generations(plan, number) for number in plan.numbers}
        self._new: list[StudyRun] = []
        self._begun = time.monotonic()
        self._next_look = 0.0
        self._partial: dict[int, int] = {}
        self._look()
        self._before = self._generations()

    def end(self, number: int) -> None:
        """Take note that a run has ended, one way or the other."""
        run = read_run(self._folder, self._plan, number)
        self._runs[number] = run
        self._partial.pop(number, None)
        self._new.append(run)

    def progress(self, running: int) -> StudyProgress:
        """Return how far the study is."""
        if time.monotonic() >= self._next_look:
            self._look()
        finished, self._new = tuple(self._new), []
        done = [run for run in self._runs.values() if run.complete]
        seconds = time.monotonic() - self._begun
        return StudyProgress(
            total=len(self._plan),
            done=len(done),
            failed=sum(bool(run.reason) for run in self._runs.values()),
            running=running,
            maes=tuple(run.estimate_mae for run in done if run.estimate_mae is not None),
            finished=finished,
            generations=self._generations(),
            generations_total=sum(self._asked.values()),
            seconds=seconds,
            seconds_left=self._seconds_left(seconds),
        )

    def _look(self) -> None:
        self._next_look = time.monotonic() + LOOK_EVERY_S
        going = [number for number in self._plan.numbers if number not in self._runs]
        self._partial = {n: stored_generations(self._folder.run_path(n) / "checkpoints") for n in going}

    def _generations(self) -> int:
        return sum(self._partial.values()) + sum(self._asked[number] for number in self._runs)

    def _seconds_left(self, seconds: float) -> float | None:
        made = self._generations() - self._before
        left = sum(self._asked.values()) - self._generations()
        return None if made <= 0 else max(0.0, left * seconds / made)


def _generations(plan: Plan, number: int) -> int:
    return int(plan.settings[number - 1].get("run.generations", plan.base.run.generations))
