"""Several models of one system: infer each, then examine each on what none has learned from."""

import json
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import digest_of, unused
from turing_learning.errors import integer, require
from turing_learning.examination import PANEL, Examiner, test_held_out
from turing_learning.figures import Picture
from turing_learning.models import Parameter
from turing_learning.purposes import FIRST_SAMPLES
from turing_learning.report import write_page
from turing_learning.runs import Result, RunFolder, infer, resume, save_figures
from turing_learning.store import FolderKind, RunFolderError, Store, check_folder, storage, writable
from turing_learning.systems import Arguments, CustomSystemError, Range, describe, read_parameters
from turing_learning.trajectories import Windows

from ._result import Compared, Comparison
from ._samples import require_windows, samples_of
from .present import comparison_page, pictures

KIND = FolderKind("comparison", "comparison.json", identity=("models", "settings", "systems"))
RUNS = "runs"
"""Folder of the runs in that of a comparison, and of new comparisons."""
PERMUTATIONS = 99
"""Exchanges of labels behind a p-value."""
ASKED = 2
"""Models that each simulator is asked for before any run begins."""

Announce = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Subject:
    """A model that is to be compared: what it imitates, and what simulates it.

    Parameters
    ----------
    windows
        Genuine motion, for learning and held out.
    simulate
        As `infer` takes it.
    parameters
        Name -> range, as `infer` takes them; None takes those that the simulator has as its attribute `parameters`.
    provenance
        What its run remembers of where the motion is from.
    """

    windows: Windows
    simulate: Any
    parameters: Mapping[str, Range] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def ranges(self, name: str) -> Mapping[str, Range]:
        """Return the parameters."""
        if self.parameters is not None:
            return self.parameters
        return suggested_ranges(self.simulate, "models", name)


def suggested_ranges(simulate: Any, argument: str, model: str) -> dict[str, Parameter]:
    """Return the parameters that a simulator has as its attribute; reject one without ranges."""
    suggested = getattr(simulate, "parameters", None)
    rule = "say its parameters and their ranges by an attribute `parameters`"
    # Simulators of one model at a time, and programs, have a tuple of names.
    got = "none" if suggested is None else "names without ranges"
    remedy = "For example: simulate.parameters = {'speed': (0, 20)}. "
    remedy += "In Python, comparison.Subject(windows, simulate, parameters={'speed': (0, 20)})."
    require(isinstance(suggested, Mapping), argument, rule, got, remedy, place=model)
    return read_parameters(suggested)


def compare(
    models: Mapping[str, Subject] | Mapping[str, Any], *, genuine: Windows | None = None, out: str | Path | None = None,
    force: bool = False, seed: int | None = None, title: str = "", command: str = "",
    examiners: Sequence[Examiner] = PANEL, permutations: int = PERMUTATIONS, remembered: Mapping[str, Any] | None = None,
    announce: Announce | None = None, **options: Any,
) -> Comparison:  # fmt: skip
    """Infer several models of one system, and say which is hardest to tell from it.

    Each model is inferred from the windows for learning, and examined on those that are held out, by the panel of
    `test`. Nothing that a run has learned from is used to examine it.

    Parameters
    ----------
    models
        Name -> simulator, as `infer` takes it, whose attribute `parameters` has ranges, as families of models have it; or
        name -> `Subject`, where more is to be said.
    genuine
        Windows of recorded motion, for all simulators.
    out
        Folder of the comparison. What is complete there is not done again; runs that were stopped go on. None keeps all in
        memory.
    force
        Whether another comparison in the folder may be replaced.
    seed
        Of all runs, and of the examination; 1 by default.
    title, command
        What stands above the page, and by which command it was made.
    examiners, permutations
        As in `test`.
    remembered
        What the folder remembers beside: JSON.
    announce
        Called with a word on what comes next.
    **options
        For each run, as in `infer`: generations, trials, tolerance, settings, preset, config, threads, observer, should_stop,
        workers, executor.

    Returns
    -------
    Comparison
        The one that is hardest to tell first. If `should_stop` has stopped a run, none is examined, and `unfinished` names
        those that can go on.

    Raises
    ------
    RunFolderError
        If the folder is refused, for example because it holds a comparison of other models, settings or recordings.
    ValueError
        If a value is refused.

    Examples
    --------
    >>> import turing_learning as tl
    >>> fish = tl.load_trajectories("fish.txt", fps=25, pixels_per_cm=12.3)  # doctest: +SKIP
    >>> windows = fish.windows(length_s=4.0)  # doctest: +SKIP
    >>> models = {}
    >>> for name, family in tl.families.FAMILIES.items():  # doctest: +SKIP
    ...     models[name] = tl.families.as_recorded(family, fish, windows)
    >>> found = tl.compare(models, genuine=windows, out="runs/families")  # doctest: +SKIP
    """
    seed = 1 if seed is None else integer("seed", seed)
    subjects = _subjects(models, genuine)
    say = announce or (lambda text: None)
    names = {name: _word(name) for name in subjects}
    rule = "have names of different letters and digits"
    require(len(set(names.values())) == len(names), "models", rule, ", ".join(names))
    head: dict[str, Any] = {}
    if out is not None:
        head = {
            "models": list(subjects),
            "settings": {"seed": seed} | _plain(options),
            "systems": {name: _identity(name, subject) for name, subject in subjects.items()},
            "remembered": remembered or {},
        }
        head = json.loads(json.dumps(head, default=_as_json))
        _free_or_own(Path(out), head, force=force)
    for name, subject in subjects.items():
        begun = out is not None and RunFolder(Path(out) / RUNS / names[name]).is_run()
        if force or not begun:
            _refuse_failing(name, subject, seed, options)
    results: dict[str, Result] = {}
    with ExitStack() as stack:
        folder = None
        if out is not None:
            folder = stack.enter_context(_begun(Path(out), head, force=force))
        for number, (name, subject) in enumerate(subjects.items(), start=1):
            say(f"{name}, {number} of {len(subjects)}")
            path = None if folder is None else folder.path / RUNS / names[name]
            results[name] = _result(names[name], name, subject, path, seed, options)
            if not results[name].complete:
                waiting = list(subjects)[number:]
                path = None if folder is None else folder.path
                return Comparison((), (*waiting, name), path)
        say("the panel examines each on what is held out")
        comparison = examine_runs(
            results, subjects, examiners=examiners, permutations=permutations, seed=seed,
            path=None if folder is None else folder.path,
        )  # fmt: skip
        if folder is not None:
            with storage(folder.path, "give the same command again.", name="out"):
                _write(folder, comparison, title, command)
    return comparison


def examine_runs(
    results: Mapping[str, Result], subjects: Mapping[str, Subject], *, examiners: Sequence[Examiner] = PANEL,
    permutations: int = PERMUTATIONS, seed: int = 1, path: Path | None = None,
) -> Comparison:  # fmt: skip
    """Compare finished runs by what none of them has learned from.

    Parameters
    ----------
    results
        Name -> result of a run.
    subjects
        Name -> what it imitates, with the windows that were held out from that run.
    examiners, permutations, seed
        As in `compare`.
    path
        The folder of the comparison, if there is one.
    """
    require(len(results) >= 2, "models", "be two or more", len(results))
    models = []
    for number, (name, result) in enumerate(results.items()):
        windows = subjects[name].windows
        rng = np.random.default_rng((seed, 7, number))
        samples = _samples(subjects[name].simulate, result.simulated_model, windows, rng)
        # all are compared with the same genuine motion, whose control is needed once
        test = test_held_out(
            windows,
            samples,
            control=number == 0,
            examiners=examiners,
            permutations=permutations,
            seed=seed,
        )
        models.append(
            Compared(
                name=name,
                test=test,
                estimate=result.estimate,
                interval_of_estimate=result.interval,
                said=result.judgment.verdict,
                path=result.path,
            )
        )
    models.sort(key=lambda model: (model.accuracy, model.test.examined.auc))
    return Comparison(tuple(models), path=path)


def _subjects(models: Mapping[str, Any], genuine: Windows | None) -> dict[str, Subject]:
    """Return what is compared, by name."""
    require(len(models) >= 2, "models", "be two or more", len(models))
    subjects = {}
    for name, model in models.items():
        if isinstance(model, Subject):
            subjects[name] = model
        else:
            subjects[name] = Subject(require_windows(genuine, name), model)
    return subjects


def _refuse_failing(name: str, subject: Subject, seed: int, options: Mapping[str, Any]) -> None:
    """Reject a simulator whose samples its run would refuse, before the runs of others have taken their time."""
    calls = {key: options.get(key) for key in ("workers", "timeout_s", "executor")}
    vectorized = getattr(subject.simulate, "vectorized", True)
    system, genuine = describe(subject.windows, subject.ranges(name), {"vectorized": vectorized})
    rng = np.random.default_rng((FIRST_SAMPLES, seed))
    models = system.to_units(rng.uniform(-1, 1, (ASKED, len(system.parameters))))
    with system.open(Arguments(genuine, subject.simulate, **calls)) as source:
        # as in the first generation, which no failure may pass
        source.generation = 0
        try:
            source.simulate(models, rng)
        except CustomSystemError as error:
            raise CustomSystemError(f"{name}: {error}") from error


def _word(name: str) -> str:
    """Return a name as one of a folder."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", name).strip("-.") or "model"


def _plain(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return those options of runs that decide what comes out."""
    decisive = ("generations", "trials", "tolerance", "settings", "preset", "config")
    settings = {}
    for name in decisive:
        value = options.get(name)
        if value:
            settings[name] = str(value) if isinstance(value, Path) else value
    return settings


def _identity(name: str, subject: Subject) -> dict[str, Any]:
    """Return what a run depends on beside its settings: ranges, simulator, and the motion itself."""
    windows = subject.windows
    motion = windows.learning.tobytes() + windows.held_out.tobytes()
    return {
        "parameters": read_parameters(subject.ranges(name)),
        "simulator": subject.simulate,
        # Not by its path: a recording that has moved is the same one.
        "windows": digest_of(motion),
    }


def _as_json(value: Any) -> Any:
    """Return what describes a value in JSON, the same in every process."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if is_dataclass(value):
        content = {"type": type(value).__qualname__}
        for attribute in fields(value):
            if attribute.repr:
                content[attribute.name] = getattr(value, attribute.name)
        return content
    if hasattr(value, "__qualname__"):
        return f"{value.__module__}:{value.__qualname__}"
    # An object lies at another address in each process.
    return re.sub(r" at 0x[0-9a-fA-F]+", "", str(value))


def _free_or_own(path: Path, head: dict[str, Any], *, force: bool) -> tuple[Store, bool]:
    """Return the folder of a comparison, and whether it holds this one; reject a folder of anything else."""
    folder = Store(path, KIND)
    rule = "be a new or empty folder, or hold this comparison"
    if folder.exists():
        stored = folder.head()
        same = all(stored.get(name) == head[name] for name in KIND.identity)
        remedy = "Choose another folder, or replace it with force=True."
        got = f"{path}, a comparison of other models, settings, ranges, simulators or recordings"
        check_folder(same or force, "out", rule, got, remedy)
        return folder, same
    # runs that belong to no comparison are nobody's to take over, or to remove
    foreign = [
        name for name in folder.foreign_names() if name != RUNS or any((path / RUNS).iterdir())
    ]
    got = f"{path}, which holds {foreign[:1]}"
    check_folder(not foreign, "out", rule, got, "Choose another folder.")
    return folder, False


@contextmanager
def _begun(path: Path, head: dict[str, Any], *, force: bool) -> Iterator[Store]:
    """Make the folder of a comparison, or take the one that is there, and hold it."""
    folder, same = _free_or_own(path, head, force=force)
    with writable("out", path):
        path.mkdir(parents=True, exist_ok=True)
    with folder.locked():
        if not same:
            if folder.exists():
                folder.clear((RUNS, "figures", "report.html", "comparison.csv", "result.json"))
            with writable("out", path):
                folder.create(head)
        yield folder


def _result(
    word: str, name: str, subject: Subject, path: Path | None, seed: int, options: Mapping[str, Any]
) -> Result:
    """Return the result of a run: begun, resumed, or finished before."""
    if path is not None and RunFolder(path).is_run():
        going_on = ("threads", "observer", "should_stop", "workers", "executor", "timeout_s")
        # All else is what the run began with, and in its folder.
        conducting = {key: value for key, value in options.items() if key in going_on}
        return resume(path, genuine=subject.windows, simulate=subject.simulate, **conducting)
    return infer(
        genuine=subject.windows,
        simulate=subject.simulate,
        parameters=subject.ranges(name),
        name=word,
        title=name,
        seed=seed,
        out=path,
        provenance=subject.provenance,
        **options,
    )


def _samples(
    simulate: Any, model: np.ndarray, windows: Windows, rng: np.random.Generator
) -> np.ndarray:
    """Return as many samples of a model as windows are held out, those that are not finite left out."""
    if not getattr(simulate, "vectorized", True):
        single = simulate

        def simulate(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
            return np.stack([single(model, rng) for model in parameters])

    def finite(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        samples = np.asarray(simulate(parameters, rng), dtype=float)
        if samples.ndim == 3:
            samples = samples[:, None]
        return np.asarray(samples[np.isfinite(samples).all(axis=(1, 2, 3))])

    return samples_of(finite, model, len(windows.held_out), rng)


def _write(folder: Store, comparison: Comparison, title: str, command: str) -> None:
    """Write table, figures and page."""
    drawn: list[Picture] = pictures(comparison)
    folder.write("result.json", comparison.to_json())
    folder.write("comparison.csv", comparison.to_dataframe().reset_index())
    save_figures(drawn, folder.path / "figures")
    page = comparison_page(comparison, title or "Which model is hardest to tell?", command)
    write_page(page, folder.path / "report.html")


def is_comparison(path: str | Path) -> bool:
    """Return whether a folder holds a comparison."""
    return Store(path, KIND).exists()


def remembered_comparison(path: str | Path) -> dict[str, Any]:
    """Return what the folder of a comparison remembers beside its models.

    Raises
    ------
    RunFolderError
        If it is no such folder, or has been changed.
    """
    content = Store(path, KIND).head()["remembered"]
    if not content:
        raise RunFolderError(
            f"`run` must be a comparison that a command began; got {path}. "
            "In Python call turing_learning.compare again, with the same models and `out`."
        )
    return dict(content)


def new_comparison_path(parent: Path = Path(RUNS)) -> Path:
    """Return a folder for a comparison that does not exist, named after the time."""
    return unused(parent / f"comparison-{time.strftime('%Y%m%d-%H%M%S')}")
