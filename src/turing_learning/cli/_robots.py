"""The commands of a laboratory with robots, and the one that emulates a laboratory."""

import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from cyclopts import App

import turing_learning as tl
from turing_learning.errors import RefusedError, refuse, refusing_as, require

from ._options import Integer, Real, Settings, settings_of
from ._stopping import REFUSED, Interrupted, handling, stopping
from ._tables import named_numbers, plain_console, print_result

LABORATORY_FILE = Path("lab.toml")

robots = App(
    name="robots",
    help="Infer the behavior of real robots: check a laboratory, run it, track videos.",
    sort_key=20,
)


@robots.command(sort_key=0)
def check(
    *,
    config: Path = LABORATORY_FILE,
    emulated: bool = False,
    picture: Path | None = None,
    trust: bool = False,
) -> int | None:
    """Look at links, batteries, camera, calibration and markers; nothing moves.

    Example: turing-learning robots check --config lab.toml

    :param config: The laboratory's file, see `turing-learning docs robots/laboratory`; lab.toml by default.
    :param emulated: Rehearse with emulated robots, as fast as the computer can.
    :param picture: File for an image from the camera with the markers that were found (.png or .jpg).
    :param trust: Execute the functions, module:function, that the file names. Read them first.
    """
    if picture is not None:
        fits = (
            picture.suffix.lower() in (".png", ".jpg", ".jpeg")
            and picture.absolute().parent.is_dir()
        )
        require(fits, "picture", "be a .png or .jpg file in a folder that exists", str(picture))
    with _opened(tl.robots.load_laboratory(config), emulated, trust, config) as (
        laboratory,
        equipment,
    ):
        if _inspected(laboratory, equipment, picture):
            return None
        return REFUSED


@robots.command(sort_key=1)
def run(
    *,
    config: Path | None = None,
    trials: str | None = None,
    generations: str | None = None,
    seed: str | None = None,
    out: Path | None = None,
    force: bool = False,
    resume: Path | None = None,
    trust: bool = False,
    emulated: bool = False,
    settings: Settings = None,
) -> int | None:
    """Infer the behavior of the robots in a laboratory; the operator is asked for help where it is needed.

    Ctrl-C stops after the present batch or generation, a second one halts the robots at once; --resume executes no
    trial again.

    Examples:

      turing-learning robots run --config lab.toml --out runs/first
      turing-learning robots run --config lab.toml --emulated --trials 40
      turing-learning robots run --resume runs/first

    :param config: The laboratory's file, see `turing-learning docs robots/laboratory`; lab.toml by default.
    :param trials: Budget in trials; 300 by default, see `turing-learning docs few-trials`.
    :param generations: Number of generations instead, of 10 trials each, as in the paper.
    :param seed: Seed of all random numbers.
    :param out: Folder of the run; a new one under runs/ by default.
    :param force: Replace a run that is in the folder already.
    :param resume: Resume this run instead.
    :param trust: Execute the functions, module:function, that the file or the run's laboratory.json names, and trust
        one that you have edited. Read them first.
    :param emulated: Rehearse with emulated robots, as fast as the computer can.
    :param settings: Any setting, for example models.parents=20. Repeatable.
    """
    lengths = {"run.generations": generations, "run.trials": trials}
    overrides, labels = settings_of(settings, {**lengths, "run.seed": seed})
    if resume is not None:
        unfitting = {
            "a file": config is not None,
            "settings": overrides,
            "a folder": out is not None,
            "--force": force,
        }
        if got := [name for name, value in unfitting.items() if value]:
            rule = "be given without a file, settings or a folder, which the run has, and without --force"
            edited = tl.runs.RunFolder(resume).laboratory_path
            remedy = f"Its laboratory may be edited in {edited}; then add --trust."
            refuse("resume", rule, " and ".join(got), remedy)
        return resume_run(resume, emulated=emulated, trust=trust)
    file = config or LABORATORY_FILE
    loaded = tl.robots.load_laboratory(file, overrides, labels)
    path = out or tl.runs.new_run_path(
        loaded.configuration.scenario.name, loaded.configuration.run.seed
    )
    with _opened(loaded, emulated, trust, file) as (laboratory, equipment):
        begin = partial(
            tl.runs.start_laboratory, laboratory, path, equipment=equipment, force=force
        )
        return _execute(laboratory, equipment, path, begin)


def resume_run(
    path: Path,
    *,
    emulated: bool = False,
    trust: bool = False,
    trials: int | None = None,
    tolerance: float | None = None,
) -> int | None:
    """Resume a run in a laboratory, or give it more trials; a rehearsal is resumed with emulated robots."""
    if trust:
        tl.runs.trust_laboratory(path)
    stored = tl.runs.stored_laboratory(path)
    real = not stored.setup.emulated
    if emulated and real:
        rule = "be left out for a run with real robots"
        remedy = "Rehearse in another folder."
        refuse("--emulated", rule, "it", remedy, place=str(path))
    file = tl.runs.RunFolder(path).laboratory_path
    with _opened(stored, emulated, trust, file) as (laboratory, equipment):
        ahead = partial(
            tl.runs.resume_laboratory, path, equipment=equipment, trials=trials, tolerance=tolerance
        )
        needed = trials is not None or tl.runs.awaits_robots(path)
        addresses = file if real else None
        return _execute(laboratory, equipment, path, ahead, needed=needed, stored=addresses)


@robots.command(sort_key=2)
def track(
    video: Path, /, *, config: Path = LABORATORY_FILE, out: Path | None = None, force: bool = False
) -> None:
    """Track all robots in a video, write a table that --trajectories reads, and list what went wrong.

    Example: turing-learning robots track trial.avi --config lab.toml --out trial.csv

    :param video: A video from the laboratory's camera.
    :param config: The laboratory's file, see `turing-learning docs robots/laboratory`; lab.toml by default.
    :param out: The table; the video's name with .csv by default.
    :param force: Replace a file that exists.
    """
    from turing_learning.robots.program import laboratory_tracker
    from turing_learning.robots.tracking import refuse_taken, write_table
    from turing_learning.store import os_errors_as

    laboratory = tl.robots.load_laboratory(config)
    tl.robots.require_libraries()
    path = out or video.with_suffix(".csv")
    tracker = laboratory_tracker(laboratory.setup, laboratory.configuration.swarm.robot)
    try:
        with refusing_as(RefusedError):
            refuse_taken(path, name="out", force=force)
            with tl.robots.Capture(video) as capture:
                capture.require_rate(laboratory.setup.camera.fps)
                observed = tracker.track(capture)
    except OSError as error:
        raise RefusedError(str(error)) from error
    trouble = f"`out` must be a file that can be written; got {path}"
    with os_errors_as(RefusedError, trouble, "Choose another, or make room."):
        write_table(observed, path, force=force)
    for fault in observed.faults:
        print(f"image {fault.frame}: {fault.kind}: {fault.text}")
    share_seen = observed.present.mean()
    print(
        f"{len(observed.poses)} images, {len(observed.labels)} robots, seen in {100 * share_seen:.2f} %: {path}"
    )


def arena(
    *,
    out: Path = Path("lab"),
    lines: str = "terminal",
    speed: Real = 1.0,
    agents: Integer = 8,
    replicas: Integer = 2,
    seed: Integer = 0,
    force: bool = False,
) -> None:
    """Run an emulated laboratory: robots on serial lines and a camera, for `robots run` or a program of your own.

    Type `help` while it runs for what may be done to the robots; `remote` lets them begin. Ctrl-C ends it. See
    `turing-learning docs robots/arena`.

    Example:

      turing-learning arena --out lab

    and in another terminal

      turing-learning robots run --config lab/lab.toml

    :param out: Folder for lab.toml and camera.json; lab by default.
    :param lines: Robots' lines: terminal (pseudo-terminals) or tcp.
    :param speed: Seconds of the laboratory in one second; 1 by default.
    :param agents: Number of agents; 8 by default.
    :param replicas: Number of replicas, at most 4; 2 by default.
    :param seed: Seed of everything; 0 by default.
    :param force: Replace files in the folder.
    """
    from turing_learning.robots.emulation import obey, usage
    from turing_learning.store import os_errors_as

    tl.robots.require_libraries(emulated=True)
    require(seed >= 0, "seed", "be 0 or more", str(seed), place="--seed")
    print("preparing the laboratory", flush=True)
    with refusing_as(RefusedError):
        scenario = replace(tl.robots.LABORATORY, agents=agents, replicas=replicas)
        service = tl.robots.ArenaService(scenario, seed=seed, lines=lines, speed=speed)
    trouble = f"`out` must be a folder that can be written; got {out}"
    with (
        service,
        suppress(KeyboardInterrupt),
        handling((signal.SIGINT, signal.SIGTERM), signal.default_int_handler),
    ):
        with os_errors_as(RefusedError, trouble, "Choose another, or make room."):
            path = service.write(out, force=force)
        for name, address in (
            *service.addresses.items(),
            ("camera", service.camera_url),
            ("laboratory", str(path)),
        ):
            print(f"{name:12} {address}")
        print(
            "type `remote` to let the robots begin, `help` for everything else; Ctrl-C ends",
            flush=True,
        )
        for line in sys.stdin:
            if line.strip() == "help":
                for command, meaning in usage(service.laboratory):
                    print(f"{command:32} {meaning}", flush=True)
            elif line.strip():
                try:
                    obey(service.laboratory, line)
                except ValueError as error:
                    print(error, flush=True)
        # until a signal comes, as nothing more can be typed
        threading.Event().wait()
    print("\nthe laboratory is closed")


@contextmanager
def _opened(
    laboratory: "tl.robots.Laboratory", emulated: bool, trust: bool, file: Path
) -> "Iterator[tuple[tl.robots.Laboratory, tl.robots.Equipment]]":
    """Lend the laboratory and its doors; for a rehearsal as it can be emulated, and say what is made up.

    Refuse functions that its `file` names before anything is imported, unless they are trusted.
    """
    setup = laboratory.setup
    rehearsed = emulated or setup.emulated
    if not rehearsed:
        for name, function in _named_functions(setup).items():
            remedy = f"Read {function.partition(':')[0]}; then add --trust. Packages may register a name instead."
            rule = "be trusted before it is executed"
            require(trust, name, rule, repr(function), remedy, place=str(file))
    tl.robots.require_libraries(setup, emulated=rehearsed)
    if not rehearsed:
        yield laboratory, tl.robots.real_equipment(laboratory)
        return
    with tl.robots.as_emulated(laboratory) as rehearsal:
        asked = setup.camera.calibration
        if rehearsal.setup.camera.calibration != asked:
            print(
                f"rehearsal with a calibration of its own, as there is none yet: {asked or 'none given'}",
                file=sys.stderr,
            )
        yield rehearsal, tl.robots.rehearse(rehearsal)


def _named_functions(setup: "tl.robots.LaboratorySetup") -> dict[str, str]:
    """Return the functions, module:function, that a laboratory names; names without a colon are those of installed packages."""
    named = {"open_replica": setup.open_replica, "tracker": setup.tracker}
    return {name: function for name, function in named.items() if function and ":" in function}


class _Pace:
    """How long the present batch or generation still takes: by its own trials so far, before by the loop of the robots."""

    def __init__(self, laboratory: "tl.robots.Laboratory") -> None:
        self._setup = laboratory.setup
        self._configuration = laboratory.configuration
        self._stage = ""
        self._done = 0
        self._began_s = time.monotonic()

    def note(self, event: "tl.robots.Event") -> None:
        if event.stage != self._stage:
            self._stage = event.stage
            self._done = 0
            self._began_s = time.monotonic()
        if event.trial is not None and not event.trial.faults:
            self._done += 1

    def announce(self) -> str:
        """Return what the first Ctrl-C is answered."""
        name = "batch" if self._configuration.run.trials else "generation"
        minutes = max(self._remaining_s() / 60, 0.0)
        length = "less than a minute"
        if minutes >= 1:
            length = f"about {minutes:.0f} min"
        return f"stopping after this {name} ({length}); Ctrl-C again halts the robots now"

    def _remaining_s(self) -> float:
        trial_s = self._setup.timing.loop_s
        if self._done:
            trial_s = (time.monotonic() - self._began_s) / self._done
        return (self._trials() - self._done) * trial_s

    def _trials(self) -> int:
        """Return the number of trials of the present batch or generation."""
        configuration, (_, _, number) = self._configuration, self._stage.rpartition("-")
        if configuration.run.trials and number.isdecimal():
            return configuration.trials_in_step(int(number) + 1)
        models = configuration.models.parents + configuration.models.offspring
        return models // len(self._setup.replicas)


def _inspected(
    laboratory: "tl.robots.Laboratory",
    equipment: "tl.robots.Equipment",
    picture: Path | None = None,
) -> bool:
    """Print what a look at the laboratory shows; return whether a run can begin."""
    fine = True
    for finding in tl.robots.inspect(
        laboratory.setup, laboratory.configuration.swarm, equipment, picture
    ):
        print(f"{'good' if finding.fine else 'BAD '}  {finding.what}: {finding.text}", flush=True)
        fine &= finding.fine
    return fine


def _execute(
    laboratory: "tl.robots.Laboratory",
    equipment: "tl.robots.Equipment",
    path: Path,
    run: "partial[tl.Result]",
    *,
    needed: bool = True,
    stored: Path | None = None,
) -> int | None:
    """Look at the laboratory, if its robots are needed, run, and print the result, or how to resume.

    Addresses of real robots of a run that is resumed are in the file `stored`.
    """
    if needed and not _inspected(laboratory, equipment):
        if stored is not None:
            text = f"The addresses of replicas and camera are those in {stored}. Edit them there, and resume with --trust."
            print(text, file=sys.stderr)
        return REFUSED
    trusted = " --trust" if _named_functions(laboratory.setup) else ""
    ahead = f"resume with: {tl.runs.resume_command(path)}{trusted}"
    of_trials = laboratory.configuration.run.trials > 0
    repeats = 0 if of_trials else laboratory.setup.evaluation.repeats
    console = plain_console()
    line = partial(console.print, soft_wrap=True)

    def progressed(progress: "tl.runs.Progress") -> None:
        model = progress.estimate if of_trials else progress.scored.best_model
        models = named_numbers(zip(progress.parameter_names, model, strict=True))
        pace = (
            f"{progress.seconds_per_generation:.0f} s each {'batch' if of_trials else 'generation'}"
        )
        line(f"{progress.place}  {pace}  {models}")

    pace = _Pace(laboratory)

    def happened(event: "tl.robots.Event") -> None:
        pace.note(event)
        stage, _, number = event.stage.rpartition("-")
        if event.kind in ("disturbed", "batteries"):
            line(
                f"{event.stage}, attempt {event.attempt}, {event.state}: {event.fault or event.asked}"
            )
        elif event.kind in ("halted", "moving") and not laboratory.setup.emulated:
            line(f"{event.fault}. {event.asked}".strip())
        elif event.kind == "complete" and stage == "post-evaluation":
            line(f"last models observed again, {number}/{repeats}")

    with stopping(ahead, pace.announce) as should_stop:
        result = run(observer=progressed, should_stop=should_stop, on_event=happened)
    if not result.complete:
        raise Interrupted(f"stopped after {result.length}; {ahead}")
    again = print_result(console, result, path)
    if repeats and not (again and again.complete):
        raise Interrupted(f"stopped before the last models had been observed again; {ahead}")
    return None
