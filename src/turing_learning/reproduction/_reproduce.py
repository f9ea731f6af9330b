"""The doors: conduct experiments, and see how they stand."""

from dataclasses import dataclass
from pathlib import Path

from turing_learning._files import in_home
from turing_learning.config import ConfigurationError
from turing_learning.errors import require
from turing_learning.store import storage, writable

from ._experiment import Experiment, Findings, Say, Stop, Work
from ._page import AS_PRINTED, ExperimentFolder, Results, write_readme
from .experiments import EXPERIMENTS, EXPERIMENTS_AS_PRINTED

ALL = "all"


@dataclass(frozen=True)
class Standing:
    """How an experiment stands in a folder."""

    experiment: Experiment
    results: Results | None  #: what it has left; None until it is finished
    pieces: int  #: of work that have been begun

    @classmethod
    def of(cls, experiment: Experiment, path: Path) -> "Standing":
        """Return how an experiment stands in a folder of experiments."""
        folder = ExperimentFolder(path / experiment.id)
        return cls(experiment, folder.results(), folder.pieces())

    @property
    def state(self) -> str:
        """Say it in few words."""
        if self.results is None:
            if self.pieces:
                return f"begun, {self.pieces} pieces of work"
            return "not run yet"
        form = ""
        if self.results.form != "full":
            form = f", {self.results.form} form"
        if not self.experiment.claims:
            return f"finished{form}"
        verdicts = list(map(self.results.verdict, self.experiment.claims))
        agree = sum(verdict is not None and verdict.agrees for verdict in verdicts)
        return f"{agree} of {len(verdicts)} claims agree{form}"


def default_folder(*, fast: bool = False, as_printed: bool = False) -> Path:
    """Return where experiments go: "experiments", as in the repository; their fast forms under "runs"."""
    folder = Path("runs/reproduction-fast" if fast else "experiments")
    if as_printed:
        return folder / AS_PRINTED
    return folder


def standings(
    out: str | Path | None = None, *, fast: bool = False, as_printed: bool = False
) -> tuple[Standing, ...]:
    """Return how all experiments stand.

    `out` is the folder that holds a folder for each experiment; by default that of
    `default_folder`. The other arguments are those of `reproduce`.
    """
    path = default_folder(fast=fast, as_printed=as_printed) if out is None else in_home(out)
    experiments = EXPERIMENTS_AS_PRINTED if as_printed else EXPERIMENTS
    return tuple(Standing.of(experiment, path) for experiment in experiments.values())


def reproduce(
    experiment: str = ALL, *, fast: bool = False, as_printed: bool = False, out: str | Path | None = None,
    workers: int | None = None, should_stop: Stop | None = None, say: Say | None = None,
) -> tuple[Standing, ...]:  # fmt: skip
    """Conduct an experiment, or all, and leave tables, figures, results and a page in a folder for each.

    What has been done before is not done again: a call that was stopped or killed is resumed by the
    same call.

    Parameters
    ----------
    experiment
        Id of an experiment, the section of the paper, or "all": those whose packages are installed.
    fast
        Whether to conduct the fast form, which takes about 10 s and proves nothing.
    as_printed
        Whether runs have the paper's algorithm as it is, in the world in which the paper's numbers
        come out: preset and world `paper`. Otherwise they have the default preset in the default
        world, and the preset `paper` stands beside it.
    out
        The folder that holds a folder for each experiment; see `default_folder`.
    workers
        Number of worker processes for studies of many runs; one for each processor by default.
    should_stop
        Asked again and again; once it returns True, the present piece of work is given up.
    say
        Gets a line when a piece of work has been done.

    Raises
    ------
    ConfigurationError
        If there is no such experiment, packages that it needs are not installed, or `workers` is no
        number of processes.
    RunFolderError
        If the folder cannot be written, or holds another form or other sizes of the experiment.
    RunStorageError
        If the results cannot be written; the call can be repeated.
    Stopped
        If a stop was asked for; the call can be repeated.
    """
    from turing_learning.studies import ExecutorChoice

    # Rejects a wrong number before anything is done.
    ExecutorChoice(workers)
    chosen = possible_experiments(experiment, say, as_printed=as_printed)
    path = default_folder(fast=fast, as_printed=as_printed) if out is None else in_home(out)
    # Folders that cannot be used are rejected before the first experiment, which may take hours.
    begun = []
    with writable("out", path):
        for section in chosen:
            folder = ExperimentFolder(path / section.id)
            begun.append((section, folder, folder.begin(section, fast=fast)))
    with storage(path, "give the same command again: it resumes."):
        for section, folder, store in begun:
            with store.locked():
                sizes = section.fast if fast else section.full
                work = Work(
                    store, sizes, fast=fast, workers=workers, should_stop=should_stop, say=say
                )
                findings = Findings(section.id)
                section.conduct(work, findings)
                folder.write(findings, fast=fast, seconds=work.seconds)
                write_readme(section, folder)
    return tuple(Standing.of(section, path) for section in chosen)


def possible_experiments(
    name: str, say: Say | None = None, *, as_printed: bool = False
) -> list[Experiment]:
    """Return the experiment of that name; of all, those that are possible, and `say` which are left out."""
    experiments = EXPERIMENTS_AS_PRINTED if as_printed else EXPERIMENTS
    names = [*experiments, ALL]
    rule = f"be one of {', '.join(names)}"
    if as_printed:
        rule += " with `as_printed`"
    require(name in names, "experiment", rule, repr(name), error=ConfigurationError)
    if name == ALL:
        chosen = list(experiments.values())
    else:
        chosen = [experiments[name]]
    possible = []
    for experiment in chosen:
        if not experiment.missing:
            possible.append(experiment)
            continue
        packages = ", ".join(experiment.missing)
        remedy = f"Run: pip install 'turing-learning[{experiment.extra}]'"
        got = f"{experiment.id}, which needs {packages}"
        rule = "be one whose packages are installed"
        require(name == ALL, "experiment", rule, got, remedy, error=ConfigurationError)
        if say is not None:
            say(f"{experiment.id}: left out, it needs {packages}. {remedy}")
    return possible
