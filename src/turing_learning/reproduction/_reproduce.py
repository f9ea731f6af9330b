"""The doors: conduct experiments, and see how they stand."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from turing_learning._files import in_home
from turing_learning.config import ConfigurationError
from turing_learning.store import storage, writable

from ._experiment import Experiment
from ._folder import ExperimentFolder, Results
from ._page import write_readme
from ._registry import ALL, EXPERIMENTS, experiments_named
from ._work import Say, Work

EXPERIMENTS_FOLDER = Path("experiments")
FAST_FOLDER = Path("runs/reproduction-fast")


@dataclass(frozen=True)
class Standing:
    """How an experiment stands in a folder.

    Attributes
    ----------
    experiment
        Which.
    results
        What it has left; None until it is finished.
    pieces
        Pieces of work that have been begun.
    """

    experiment: Experiment
    results: Results | None
    pieces: int

    @property
    def state(self) -> str:
        """Say it in few words."""
        if self.results is None:
            return f"begun, {self.pieces} pieces of work" if self.pieces else "not run yet"
        form = "" if self.results.form == "full" else f", {self.results.form} form"
        if not self.experiment.claims:
            return f"finished{form}"
        verdicts = [self.results.verdict(claim) for claim in self.experiment.claims]
        agree = sum(verdict is not None and verdict.agrees for verdict in verdicts)
        return f"{agree} of {len(verdicts)} claims agree{form}"


def default_folder(*, fast: bool = False) -> Path:
    """Return where experiments go: "experiments", as in the repository; their fast forms under "runs"."""
    return FAST_FOLDER if fast else EXPERIMENTS_FOLDER


def standings(out: str | Path | None = None, *, fast: bool = False) -> tuple[Standing, ...]:
    """Return how all experiments stand.

    Parameters
    ----------
    out
        The folder that holds a folder for each experiment; see `default_folder`.
    fast
        Which default folder.

    Raises
    ------
    RunFolderError
        If something there cannot be read.
    """
    return tuple(_standing(experiment, _path(out, fast)) for experiment in EXPERIMENTS.values())


def _standing(experiment: Experiment, out: Path) -> Standing:
    folder = ExperimentFolder(out / experiment.id)
    return Standing(experiment, folder.results(), folder.pieces())


def reproduce(
    experiment: str = ALL,
    *,
    fast: bool = False,
    out: str | Path | None = None,
    workers: int | None = None,
    should_stop: Callable[[], bool] | None = None,
    say: Say | None = None,
) -> tuple[Standing, ...]:
    """Conduct an experiment, or all, and leave tables, figures, results and a page in a folder for each.

    What has been done before is not done again: a call that was stopped or killed is gone on with.

    Parameters
    ----------
    experiment
        Id of an experiment, the section of the paper, or "all": those whose packages are installed.
    fast
        Whether to conduct the fast form, which takes about 10 s and proves nothing.
    out
        The folder that holds a folder for each experiment; see `default_folder`.
    workers
        Number of worker processes for studies of many runs; one for each processor by default.
    should_stop
        Asked again and again; once it returns True, the present piece of work is given up.
    say
        Told when a piece of work has been done.

    Returns
    -------
    tuple of Standing

    Raises
    ------
    ConfigurationError
        If there is no such experiment, packages that it needs are not installed, or `workers` is no number of processes.
    RunFolderError
        If the folder cannot be written, or holds another form or other sizes of the experiment.
    RunStorageError
        If the results cannot be written; the call can be repeated.
    Stopped
        If a stop was asked for; the call can be repeated.
    """
    from turing_learning.studies import Hands

    Hands(workers)  # refuses a wrong number before anything is done
    chosen = _possible(experiments_named(experiment), experiment, say)
    path = _path(out, fast)
    folders = [ExperimentFolder(path / one.id) for one in chosen]
    with writable("out", path):
        stores = [folder.begin(one, fast=fast) for one, folder in zip(chosen, folders, strict=True)]
    with storage(path, "give the same command again: it goes on."):
        for one, folder, store in zip(chosen, folders, stores, strict=True):
            sizes = one.sizes(fast=fast)
            with store.locked():
                work = Work(store, sizes, fast=fast, workers=workers, should_stop=should_stop, say=say)
                folder.write(one.conduct(work), fast=fast, seconds=work.seconds, commits=work.commits)
                write_readme(one, folder)
    return tuple(_standing(one, path) for one in chosen)


def _possible(chosen: tuple[Experiment, ...], name: str, say: Say | None) -> tuple[Experiment, ...]:
    """Return the experiments whose packages are installed; one that was asked for by name is refused without them."""
    for one in chosen:
        if not one.missing:
            continue
        need = f"{', '.join(one.missing)}. Run: pip install 'turing-learning[{one.extra}]'"
        if name != ALL:
            raise ConfigurationError(
                f"`experiment` must be one whose packages are installed; got {one.id}, which needs {need}"
            )
        if say is not None:
            say(f"{one.id}: left out, it needs {need}")
    return tuple(one for one in chosen if not one.missing)


def _path(out: str | Path | None, fast: bool) -> Path:
    return default_folder(fast=fast) if out is None else in_home(out)
