"""How far a run is: as data, and in one line on terminals and in notebooks."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from turing_learning.analysis import name_failure
from turing_learning.coevolution import Generation

from ._loops import TrialBatch

PICTURE_INTERVAL_S = 0.2  # between two pictures
WAITING = "getting ready; the first run of an installation compiles for some seconds"


@dataclass(frozen=True)
class Progress:
    """The state of a run after a generation.

    Attributes
    ----------
    generation
        Both populations of a generation, scored; None for a run of trials.
    completed, total
        Numbers of generations.
    parameter_names
        Names of the parameters in which models are stated: the agents', where they are known.
    truth
        The agents' parameters, None where there is no truth.
    seconds_per_generation
        Mean over the last generations (s).
    recent : (up to 50, P)
        Typical models of the last generations; None if not recorded.
    described
        Gives models (..., P) in the parameters of `parameter_names`; None if these are their
        numbers.
    trials
        Spent so far, and the budget, of a run of trials; None for other runs.
    batch
        Of a run of trials: what was tried in a batch, and what is known after it.
    last
        Whether no generation or batch follows. The estimate of a run of trials is examined then.
    """

    generation: Generation | None
    completed: int
    total: int
    parameter_names: tuple[str, ...]
    truth: tuple[float, ...] | None
    seconds_per_generation: float
    recent: np.ndarray | None = None
    described: Callable[[np.ndarray], np.ndarray] | None = None
    trials: tuple[int, int] | None = None
    batch: TrialBatch | None = None
    last: bool = False

    @property
    def scored(self) -> Generation | TrialBatch:
        """Models and classifiers with their fitness.

        Of the generation, or of the batch of trials.
        """
        scored = self.generation if self.batch is None else self.batch
        assert scored is not None
        return scored

    @property
    def estimate(self) -> np.ndarray:
        """What is inferred so far (P,).

        The typical model of the generation, or the estimate after the batch.
        """
        scored = self.scored
        if isinstance(scored, Generation):
            return scored.typical_model
        return scored.estimate

    @property
    def selection(self) -> str:
        """Whether selection was "active" in the generation, see `Generation`.

        Nothing is selected in batches.
        """
        if self.generation is None:
            return "active"
        return self.generation.selection

    @property
    def place(self) -> str:
        """How far the run is: "generation 100/1000", or "trial 150/300" of a run of trials."""
        done, total = self.trials or (self.completed, self.total)
        return f"{'trial' if self.trials else 'generation'} {done}/{total}"

    def shown(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the parameters of `parameter_names`."""
        if self.described is None:
            return models
        return self.described(models)

    @property
    def outlook(self) -> str | None:
        """How the models of the last generations compare with the truth, see `analysis.name_failure`; None without a truth."""
        if self.truth is None or self.recent is None:
            return None
        return name_failure(np.median(self.shown(self.recent), axis=0), np.asarray(self.truth))

    @property
    def seconds_left(self) -> float:
        """Time until the last generation at the present rate (s)."""
        return (self.total - self.completed) * self.seconds_per_generation


Observer = Callable[[Progress], None]


@contextmanager
def watched(
    observer: Observer | None, should_stop: Any, progress: bool | None
) -> Iterator[Observer | None]:
    """Return an observer that also shows a bar, on standard error or in the cell of a notebook.

    If `progress` is None, a bar is shown where somebody looks and has given neither an observer nor
    `should_stop`.
    """
    shell = None
    if "IPython" in sys.modules:
        shell = sys.modules["IPython"].get_ipython()
    notebook = getattr(shell, "kernel", None) is not None
    visible = notebook or (sys.stderr is not None and sys.stderr.isatty())
    if not (
        progress or (progress is None and visible and observer is None and should_stop is None)
    ):
        yield observer
        return
    following = 0.0
    with nullcontext(_cell()) if notebook else _terminal() as show:

        def observe(state: Progress) -> None:
            nonlocal following
            if observer is not None:
                observer(state)
            if (now := time.monotonic()) >= following or state.completed == state.total:
                following = now + PICTURE_INTERVAL_S
                remaining = "done"
                if state.completed < state.total:
                    remaining = f"{state.seconds_left:.0f} s left"
                show(state.completed, state.total, f"{state.place}, {remaining}")

        yield observe


@contextmanager
def _terminal() -> Iterator[Callable[[int, int, str], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (BarColumn(), TextColumn("{task.description}"))
    with Bar(*columns, console=Console(stderr=True), auto_refresh=False, transient=True) as bar:
        task = bar.add_task(WAITING, total=None)
        bar.refresh()

        def show(done: int, total: int, text: str) -> None:
            # A bar stays once there was something to show
            bar.live.transient = False
            bar.update(task, completed=done, total=total, description=text, refresh=True)

        yield show


def _cell() -> Callable[[int, int, str], None]:
    """Show one line of a cell's output, which is replaced.

    Without the widgets that bars of rich need.
    """
    handle: Any = import_module("IPython.display").display(
        {"text/plain": WAITING}, raw=True, display_id=True
    )

    def show(done: int, total: int, text: str) -> None:
        handle.update({"text/plain": f"[{'#' * (30 * done // total):.<30}] {text}"}, raw=True)

    return show
