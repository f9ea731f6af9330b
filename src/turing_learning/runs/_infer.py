"""The doors: infer, start, resume; and how far a run is, in one line, on terminals and in
notebooks."""

import logging
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from inspect import signature
from pathlib import Path
from typing import Any, Unpack

from turing_learning._files import unused
from turing_learning.config import Configuration, ConfigurationError, require_visible_objects
from turing_learning.config.parts import part_named
from turing_learning.config.settings import refuse_unknown, resolved, single_settings
from turing_learning.errors import brief, check, refusing_as
from turing_learning.families import Network, RecordedSystem
from turing_learning.few_trials import FEWEST_BATCHES
from turing_learning.interaction import describe_stimulated
from turing_learning.report import counted
from turing_learning.store import RunFolderError, check_folder
from turing_learning.swarm import Scenario
from turing_learning.systems import (
    NO_PRIOR,
    Arguments,
    CustomOptions,
    CustomSystem,
    Range,
    Simulator,
    Source,
    describe,
    importable_name,
    imported,
    observed,
)
from turing_learning.trajectories import Windows

from ._folder import NETWORK, RECORDING, RunFolder, resume_command
from ._progress import Observer, watched
from ._result import Result
from ._run import Run, conduct, refuse_given_source
from ._summary import give_parts

RUNS = Path("runs")
BUSY = 0.75
"""Share of their time that workers spend with calls of a batch, below which a batch of another size is proposed."""
_LOGGER = logging.getLogger("turing_learning")


def infer(
    scenario: str | Scenario | None = None,
    *,
    genuine: Any = None,
    simulate: Simulator | str | None = None,
    parameters: Mapping[str, Range] | None = None,
    generations: int | None = None,
    trials: int | None = None,
    models: Any = None,
    classifier: Any = None,
    tolerance: float | None = None,
    seed: int | None = None,
    preset: str = "default",
    config: str | Path | Configuration | None = None,
    settings: Mapping[str, Any] | None = None,
    threads: int | None = None,
    out: str | Path | None = None,
    force: bool = False,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    progress: bool | None = None,
    **options: Unpack[CustomOptions],
) -> Result:
    """Infer the behavior of a swarm, or of any system that was observed, by Turing Learning.

    Parameters
    ----------
    scenario
        Name of a preset scenario, or a scenario; by default that of the configuration, without one
        "aggregation". Left out for a custom system, which is given by `genuine`, `simulate` and
        `parameters` together.
    genuine
        Samples (K, T, D) of a custom system, or K arrays (T, D), or windows of recorded motion, or
        a function rng -> (K, T, D) that observes it, or a scenario or the name of one, whose agents
        are observed anew in every generation.
    simulate
        Simulates models of it: a function (parameters (M, P), rng) -> samples (M, T, D), or (M, C,
        T, D) with C samples of each model; or its name, "module:function". The columns are in the
        order of `parameters`; all randomness comes from `rng`.
    parameters
        Name -> (low, high), the range of the first models and the space of the search, where None
        leaves a side open; or name -> `Parameter`, with a unit or on a logarithmic scale.
    generations
        Number of generations, >= 1, instead of a budget in trials.
    trials
        Budget in trials, >= 20: every sample is kept and judged again, and the next trials are
        spent where they tell most (decision 0028). A trial is one execution of the simulator,
        whatever the number of replicas in it. 3000 where neither the length of the run nor a
        setting of its populations is given (decision 0035).
    models
        Optimizer of the models: "evolution-strategy" by default, "cma", "module:function", a
        function that makes an `evolution.Optimizer`, or such an optimizer; see
        docs/your-own-parts.md.
    classifier
        What judges: a `coevolution.Classifier`, a function that makes one, or "module:function"; by
        default an Elman network.
    tolerance
        The run stops before its trials are spent once it has settled and `interval` leaves, of each
        parameter that can be identified, at most this share of its range to either side. None, or
        0: never.
    seed
        Seed of all random numbers, >= 0. The same seed gives the same result for any number of
        threads.
    preset
        "default"; "paper" keeps to the text of the paper, "authors" to the group's public code.
    config
        A TOML file, or a resolved configuration. The other arguments come before it.
    settings
        Dotted key -> value, any setting of a configuration, for example ``{"models.parents": 20}``.
        What is an argument, too, must not have another value here.
    threads
        Number of threads; None takes the configuration's, which is all by default.
    out
        A new or empty folder for the run; None keeps it in memory.
    force
        Whether a run that is in the folder already may be replaced.
    observer
        Called with a `Progress` after every generation.
    should_stop
        Called after every generation; if it returns True, the run stops there and can be resumed.
    progress
        Whether to show a progress bar. None shows one on a terminal and in a notebook, unless `observer` or
        `should_stop` is given.
    **options
        More about a custom system: name, title, signals, length, held_out, samples_per_generation,
        vectorized, batches, workers, timeout_s, executor; see docs/own-system.md. With `stimulus` it is one
        whose classifiers choose stimuli, and `genuine` and `simulate` make one step; see
        docs/interaction.md.

    Returns
    -------
    Result
        What was inferred, with the whole history.

    Raises
    ------
    RunStorageError
        If the folder cannot be written any more; the run can be resumed.
    CustomSystemError
        If the simulator of one's own raises or returns the wrong shape in the first generation, or
        fails for more than half of the models of a later one; a run in a folder has kept what was
        inferred before, and can be resumed.

    Examples
    --------
    >>> import turing_learning as tl
    >>> result = tl.infer("aggregation", seed=1)  # doctest: +SKIP
    >>> result.estimate  # doctest: +SKIP
    {'vl0': -0.70, 'vr0': -1.00, 'vl1': 1.01, 'vr1': -0.99}
    """
    given = brief(options.get("prior"))
    check("prior" not in options, "prior", "be left out", given, NO_PRIOR)
    refuse_unknown(
        options, {*CustomOptions.__annotations__, *signature(infer).parameters} - {"options"}
    )
    overrides = single_settings(
        settings,
        generations=generations,
        trials=trials,
        tolerance=tolerance,
        seed=seed,
        threads=threads,
    )
    for key, argument, component in (
        ("models.optimizer", "models", models),
        ("classifiers.network", "classifier", classifier),
    ):
        if component is not None:
            got = f"{brief(component)} beside {key} in `settings`"
            check(key not in overrides, argument, "be given once", got)
            overrides[key] = part_named(component)
    resolve = partial(resolved, preset=preset, config=config, overrides=overrides)
    if not is_custom(scenario, genuine, simulate, parameters):
        configuration = resolve(scenario)
        with refusing_as(ConfigurationError):
            configuration.system.accept(Arguments(more=options))
        require_visible_objects(configuration)
        with watched(observer, should_stop, progress) as observer:
            return conduct(Run.begin(configuration, out, force=force), observer, should_stop)
    provenance = options.pop("provenance", None) or {}
    entries: dict[str, Any] = dict(provenance)
    # What has a name is imported again where the run is resumed.
    for name, value in (("genuine", genuine), ("simulate", simulate)):
        described = value
        if callable(value):
            described = importable_name(value)
        if isinstance(described, str):
            entries[name] = described
    with refusing_as(ConfigurationError):
        if isinstance(simulate, str):
            simulate = imported(simulate)
        if isinstance(genuine, str) and ":" in genuine:
            genuine = imported(genuine, "genuine")
        arguments = Arguments(
            genuine,
            simulate,
            options.get("workers"),
            options.get("timeout_s"),
            executor=options.get("executor"),
        )
        data = genuine
        # One model at a time, as it says itself
        if not getattr(simulate, "vectorized", True):
            options.setdefault("vectorized", False)
        columns = getattr(simulate, "columns", ())
        if columns:
            options.setdefault("signals", columns)
        if "stimulus" in options:
            system: CustomSystem = describe_stimulated(genuine, simulate, parameters or {}, options)
        else:
            system, data = describe(genuine, parameters or {}, options, columns)
            windows = observed(genuine)
            if out is not None and not provenance and isinstance(windows, Windows):
                recorded = RecordedSystem.begun_in_python(windows, simulate)
                if recorded is not None:
                    entries[RECORDING] = recorded.entry
    configuration = resolve(system)
    with refusing_as(ConfigurationError):
        opened = configuration.system.open(replace(arguments, genuine=data))
    with opened as source, watched(observer, should_stop, progress) as observer:
        files = None
        if isinstance(simulate, Network):
            files = {NETWORK: simulate.to_bytes()}
        run = Run.begin(
            configuration,
            out,
            force=force,
            source=source,
            entries=entries,
            arguments=arguments,
            files=files,
        )
        say_idle_workers(configuration, source)
        return conduct(run, observer, should_stop)


def say_idle_workers(configuration: Configuration, source: Source) -> None:
    """Say how workers have less to wait for, where the calls of a batch of trials keep few of them busy."""
    workers = source.callers
    system = configuration.system
    trials = configuration.run.trials
    if not trials or workers is None or not isinstance(system, CustomSystem):
        return
    batch = configuration.trials_in_step(2)
    calls = batch
    name = "run.batch"
    if system.vectorized:
        calls = min(batch, system.batches)
        name = "batches"
    rounds = -(-calls // workers)
    busy = calls / (rounds * workers)
    if busy >= BUSY:
        return
    most = trials // FEWEST_BATCHES if name == "run.batch" else batch
    sizes = []
    for size in ((rounds - 1) * workers, rounds * workers):
        if 2 <= size <= most:
            sizes.append(size)
    text = f"{workers} workers make the {counted(calls, 'call')} of a batch in {counted(rounds, 'round')}, "
    text += f"busy for {busy:.0%} of the time"
    if not sizes:
        _LOGGER.warning("%s; more are of use in a run of more trials.", text)
        return
    size = min(sizes, key=lambda size: abs(math.log(size / calls)))
    how = f"batches={size}"
    if name == "run.batch":
        how = f'settings={{"run.batch": {size}}}, or --set run.batch={size},'
    _LOGGER.warning("%s; %s keeps them busy. The result depends on it.", text, how)


def is_custom(scenario: object, genuine: object, simulate: object, parameters: object) -> bool:
    """Return whether a custom system is given.

    Reject one that is given in part, or beside a scenario.
    """
    functions = {"genuine": genuine, "simulate": simulate, "parameters": parameters}
    if all(function is None for function in functions.values()):
        return False
    remedy = "It is given by `genuine`, `simulate` and `parameters` together."
    for name, function in functions.items():
        check(function is not None, name, "be given for a custom system", "nothing", remedy)
    check(scenario is None, "scenario", "be left out for a custom system", brief(scenario))
    return True


def start(
    configuration: Configuration,
    out: str | Path,
    *,
    force: bool = False,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    source: Source | None = None,
    files: Mapping[str, bytes] | None = None,
) -> Result:
    """Run a configuration from generation 0 in a folder of its own; see `infer` and `Run.begin`."""
    run = Run.begin(configuration, out, source=source, force=force, files=files)
    return conduct(run, observer, should_stop)


def resume(
    path: str | Path,
    *,
    genuine: Any = None,
    simulate: Simulator | None = None,
    workers: int | None = None,
    timeout_s: float | None = None,
    executor: Any = None,
    threads: int | None = None,
    models: Any = None,
    classifier: Any = None,
    trials: int | None = None,
    tolerance: float | None = None,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    progress: bool | None = None,
) -> Result:
    """Go on with a run that was stopped or killed; the result is that of a run that never was.

    Parameters
    ----------
    path
        The run folder. One that is finished is left as it is, whether its system is given or not;
        another one is refused.
    genuine, simulate
        Of a custom system: the samples that the run began with, and the simulator. Functions of a
        module are imported by their names unless they are given; samples are not in the folder.
    models, classifier
        The objects that the run began with, where no other process can import them.
    trials, tolerance
        For a finished run of trials that shall have more of them, see `Run.open`.
    workers, timeout_s, executor, threads, observer, should_stop, progress
        As in `infer`.

    Raises
    ------
    RunFolderError
        If the folder is not a run, has been changed, or is in use; if a custom system lacks its
        samples or simulator, or the samples are others.
    RunStorageError
        If the folder cannot be written; the run can be resumed.
    """
    folder = RunFolder(path)
    give_parts(folder, models, classifier)
    given = Arguments(genuine, simulate, workers, timeout_s, executor=executor)
    with refusing_as(RunFolderError):
        arguments = folder.configuration().system.accept(given)

    def reopen(configuration: Configuration) -> Source:
        rule = "be one that the computer can resume alone"
        remedy = f"Resume it with `{resume_command(folder.path)}`."
        got = f"{folder.path}, which takes place in a laboratory"
        check_folder(not folder.laboratory_path.exists(), "run", rule, got, remedy)
        refuse_given_source(folder)
        return configuration.system.open(folder.remembered(arguments))

    run = Run.open(path, reopen, threads=threads, trials=trials, tolerance=tolerance)
    with run, watched(observer, should_stop, False if run.complete else progress) as observer:
        result = conduct(run, observer, should_stop)
    assert result.record is not None, "it is in a folder"
    # A check needs what was given, as after `infer`
    return replace(result, record=replace(result.record, arguments=given))


def new_run_path(name: str, seed: int, parent: Path = RUNS) -> Path:
    """Return a folder for a run that does not exist, named after scenario, time and seed.

    Parameters
    ----------
    name, seed
        Of the scenario, and of the run.
    parent
        The folder of all runs.
    """
    return unused(parent / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}-seed{seed}")
