"""The command that says which of several models is hardest to tell from recorded motion."""

import json
import shlex
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

import turing_learning as tl
from turing_learning.errors import refuse, require

from ._command import Callers
from ._open import opened
from ._options import (
    Integer,
    Sampling,
    Settings,
    named,
    print_problems,
    settings_of,
    tell_learning,
    words_of,
)
from ._stopping import Interrupted, stopping
from ._tables import plain_console, print_files, print_table

EXAMPLE = "For example: turing-learning compare fish.csv --model couzin --model burst-and-coast"


def compare(
    *motion: Path,
    model: Annotated[list[str] | None, Parameter(negative="")] = None,
    config: Path | None = None,
    preset: str = "default",
    generations: str | None = None,
    trials: str | None = None,
    tolerance: str | None = None,
    seed: Integer | None = None,
    threads: Integer | None = None,
    settings: Settings = None,
    quick: bool = False,
    sampling: Sampling = Sampling(),  # noqa: B008 - frozen
    callers: Callers = Callers(),  # noqa: B008 - frozen
    out: Path | None = None,
    force: bool = False,
    as_json: Annotated[bool, Parameter("--json")] = False,
) -> None:
    """Infer several models of recorded motion, and say which one is hardest to tell from it, and what gives each away.

    Each is examined on what none has learned from, by the panel of `test`. Ctrl-C stops the present run; the same command
    goes on, and so does `turing-learning resume`. See `turing-learning docs examination`.

    Examples:

      turing-learning compare fish.csv --fps 25 --pixels-per-cm 12.3 --model couzin --model burst-and-coast --out runs/families
      turing-learning compare monday.csv tuesday.csv --model couzin --model my_module:simulate --trials 1000
      turing-learning compare runs/couzin runs/coast --json

    :param motion: Recordings; or run folders, two or more, that are finished.
    :param model: Family of models, or module:name of a family or simulator of your own; two or more.
    :param config: TOML file with any setting of the runs.
    :param preset: As in `infer`.
    :param generations: Number of generations of each run instead of a budget in trials.
    :param trials: Budget of each run in simulated trials; 3000 unless settings or the preset ask for generations.
    :param tolerance: As in `infer`.
    :param seed: Seed of the runs and of the examination; 1 by default.
    :param threads: Number of threads; all by default. The result does not depend on it.
    :param settings: Any setting of the runs, for example models.parents=20. Repeatable.
    :param quick: Leave the boosted trees out of the panel.
    :param out: Folder of the comparison, which goes on if it is there; a new one under runs/ by default. Of finished runs:
        a page (.html).
    :param force: Replace what is there.
    :param as_json: Print JSON.
    """
    if not motion:
        refuse("RECORDING", "be one recording or several, or runs", "none", EXAMPLE)
    # A recording may be a folder, too; only one of a run has a manifest.
    if all(tl.runs.RunFolder(path).is_run() for path in motion):
        rule = "be left out for finished runs"
        options: dict[str, Any] = {"model": model, "generations": generations, "trials": trials}
        options |= {"tolerance": tolerance, "config": config, "set": settings}
        sampling.refuse_beside(rule, **options, **callers.given)
        return _finished(motion, 1 if seed is None else seed, quick, out, force, as_json)
    models = model or []
    require(len(models) > 1, "--model", "be given twice or more often", len(models), EXAMPLE)
    length = {"run.generations": generations, "run.trials": trials, "run.tolerance": tolerance}
    overrides, _ = settings_of(settings, length)
    recorded = tl.families.RecordedSystem({**sampling.given, "trajectories": list(motion)})
    content = {
        **recorded.entry,
        "models": models,
        "quick": quick,
        "seed": seed,
        "preset": preset,
        "config": None if config is None else str(config.absolute()),
        "settings": overrides,
    }
    path = out or tl.comparison.new_comparison_path()
    return _conduct(content, path, threads, callers, force=force, as_json=as_json)


def resume_comparison(path: Path, threads: int | None, callers: Callers) -> None:
    content = tl.comparison.remembered_comparison(path)
    _conduct(content, path, threads, callers)


def _conduct(
    content: Mapping[str, Any], path: Path, threads: int | None, callers: Callers, *,
    force: bool = False, as_json: bool = False,
) -> None:  # fmt: skip
    """Infer and examine the models of a comparison, by what its folder remembers."""
    from ._live import watching

    options = tl.families.RecordedSystem.remembered(content).options
    # With --json, standard output is for the JSON alone.
    console = plain_console(stderr=as_json)

    def tell(done: int, steps: int) -> None:
        if not as_json:
            tell_learning(done, steps)

    recordings = []
    for file in options["trajectories"]:
        recording = tl.families.read_recording(file, "RECORDING", options)
        recordings.append(recording)
        if not as_json:
            print_problems(file.name, recording)
    seed = 1 if content["seed"] is None else content["seed"]
    subjects = tl.comparison.recorded_subjects(
        recordings, options, content["models"], path, tell, seed=seed
    )
    ahead = f"go on with: {tl.runs.resume_command(path)}"
    with ExitStack() as stack:
        should_stop = stack.enter_context(stopping(ahead))
        view = stack.enter_context(watching(console))
        executor_options = stack.enter_context(callers.options())
        comparison = tl.compare(
            subjects,
            out=path,
            force=force,
            seed=content["seed"],
            title=f"Models of {named(options['trajectories'])}",
            command=_command(content, options["trajectories"]),
            examiners=_panel(quick=content["quick"]),
            remembered=content,
            announce=console.print,
            preset=content["preset"],
            config=content["config"],
            settings=content["settings"],
            threads=threads,
            observer=view,
            should_stop=should_stop,
            **executor_options,
        )
    if comparison.unfinished:
        raise Interrupted(f"stopped before {', '.join(comparison.unfinished)}; {ahead}")
    _print(comparison, as_json)
    if not as_json:
        print_files(console, report=path / "report.html")
        console.print(f"comparison: {path}", soft_wrap=True)


def _finished(
    paths: tuple[Path, ...], seed: int, quick: bool, out: Path | None, force: bool, as_json: bool
) -> None:
    from turing_learning.comparison.present import comparison_page
    from turing_learning.targets import refuse_target

    if out is not None:
        refuse_target(out, name="out", suffixes=(".html",), force=force)
    # Runs of two studies may have the same name.
    names = [path.absolute().name for path in paths]
    if len(set(names)) < len(names):
        names = list(map(str, paths))
    results = {name: opened(path) for name, path in zip(names, paths, strict=True)}
    subjects = tl.comparison.run_subjects(results)
    comparison = tl.comparison.examine_runs(
        results, subjects, examiners=_panel(quick=quick), seed=seed
    )
    _print(comparison, as_json)
    if out is not None:
        words = ["turing-learning", "compare", *map(str, paths), "--seed", str(seed)]
        if quick:
            words.append("--quick")
        page = comparison_page(comparison, "Which run is hardest to tell?", shlex.join(words))
        tl.report.write_page(page, out)
        print(out, file=sys.stderr if as_json else sys.stdout)


def _print(comparison: "tl.comparison.Comparison", as_json: bool) -> None:
    if as_json:
        print(json.dumps(comparison.to_json(), indent=2, allow_nan=False))
    else:
        plain_console().print(comparison)


def show_comparison(path: Path) -> None:
    """Print the ranking that a finished comparison has stored, what its runs say, and where they are."""
    stored = path / "result.json"
    remedy = f"Go on with it: {tl.runs.resume_command(path)}"
    require(stored.is_file(), "run", "be a comparison that is finished", str(path), remedy)
    content = json.loads(stored.read_text(encoding="utf-8"))
    headings = ["model", "accuracy (95 %)", "more than the first", "p", "verdict", "its run says"]
    console = plain_console()
    print_table(console, headings, tl.comparison.ranking(content))
    console.print(" ".join(content["sentences"]))
    print_files(console, report=path / "report.html", runs=path / "runs")


def _panel(*, quick: bool) -> "tuple[tl.examination.Examiner, ...]":
    if quick:
        return tl.examination.QUICK
    return tl.examination.PANEL


def _command(content: Mapping[str, Any], paths: "list[Path]") -> str:
    """Return the command that begins such a comparison, without paths of this machine."""
    words = ["turing-learning", "compare", *(path.name for path in paths)]
    for model in content["models"]:
        words += ["--model", model]
    # recordings stand first, without an option
    options = {name: value for name, value in content["options"].items() if name != "trajectories"}
    words += words_of(options)
    for name in ("preset", "config"):
        if content[name] is not None and content[name] != "default":
            words += [f"--{name}", Path(content[name]).name]
    if content["quick"]:
        words.append("--quick")
    for name, value in content["settings"].items():
        words += ["--set", f"{name}={value}"]
    if content["seed"] is not None:
        words += ["--seed", str(content["seed"])]
    return shlex.join(words)
