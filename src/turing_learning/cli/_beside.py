"""The commands beside runs: reproduce, sample, warm-up, docs."""

import gzip
import shlex
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import turing_learning as tl
from turing_learning.errors import choice, refuse

from ._options import Integer
from ._stopping import Interrupted, stopping
from ._tables import plain_console, print_table

if TYPE_CHECKING:
    from rich.console import Console

FISH = "--fps 30 --pixels-per-cm 20 --thin 3 --bridge 5 --model burst-and-coast"
SWARM = "--fps 10 --pixels-per-cm 1 --y-axis up --model robots"
"""Options of `infer` for the two samples."""

SWARM_S = 40.0
"""Duration of the sample of a swarm (s). Robots still gather then; from 120 s the estimate was off, likely because
replicas start apart."""

PAGES = ("*.md", "examples/*.md", "robots/*.md")
"""Of the documentation, which the wheel has, too."""


def reproduce(
    experiment: str | None = None,
    /,
    *,
    fast: bool = False,
    as_printed: bool = False,
    out: Path | None = None,
    workers: Integer | None = None,
    page: Path | None = None,
    force: bool = False,
) -> None:
    """Repeat the experiments of the paper, and compare them with what it prints.

    Ctrl-C stops; the same command resumes.

    Examples:

      turing-learning reproduce
      turing-learning reproduce 4.5 --fast
      turing-learning reproduce all --workers 8

    :param experiment: Section of the paper, or all; without it, the experiments are listed.
    :param fast: A small form, in seconds, which shows that it works.
    :param as_printed: With the paper's algorithm as it is, in the paper's world.
    :param out: Folder of the experiments; experiments/ by default.
    :param workers: Number of worker processes; one for each processor by default.
    :param page: Write the page of all claims (Markdown) to this file as well, and that of each experiment.
    :param force: Let --page replace a file that is no such page.
    """
    from turing_learning.store import os_errors_as

    if page is not None:
        tl.reproduction.refuse_page_path(page, force=force, name="page")
    elif force:
        remedy = "Add --page, or leave --force out."
        refuse("force", "be given with a page, which it may replace", "it alone", remedy)
    if as_printed and page is not None:
        remedy = "The page of all experiments has these verdicts, too."
        refuse("page", "be left out with --as-printed", str(page), remedy)
    console = plain_console()
    if experiment is None:
        rows = []
        for standing in tl.reproduction.standings(out, fast=fast, as_printed=as_printed):
            listed = standing.experiment
            rows.append((listed.id, listed.title, listed.cost, standing.state))
        print_table(console, ("experiment", "title", "cost", "state"), rows)
    else:
        _print_outcomes(console, _repeated(experiment, fast, as_printed, out, workers))
    if page is not None:
        folder = out or tl.reproduction.default_folder(fast=fast)
        trouble = f"`page` must be a file that can be written; got {page}"
        with os_errors_as(tl.runs.RunFolderError, trouble, "Choose another place."):
            print(tl.reproduction.write_page(folder, page, force=force))


def _repeated(
    experiment: str, fast: bool, as_printed: bool, out: Path | None, workers: int | None
) -> "tuple[tl.reproduction.Standing, ...]":
    ahead = "the same command resumes"
    try:
        with stopping(ahead) as should_stop:
            return tl.reproduction.reproduce(
                experiment,
                fast=fast,
                as_printed=as_printed,
                out=out,
                workers=workers,
                should_stop=should_stop,
                say=print,
            )
    except tl.reproduction.Stopped as error:
        raise Interrupted(f"stopped at {error}; {ahead}") from error


def _print_outcomes(console: "Console", standings: "tuple[tl.reproduction.Standing, ...]") -> None:
    """Print what came out beside what the paper prints, remarks, and the state of each experiment."""
    from rich.text import Text

    results = [standing.results for standing in standings if standing.results is not None]
    for result in results:
        for verdict in result.verdicts:
            word = Text(f"{verdict.word:8}", style="green" if verdict.agrees else "bold red")
            claim = " ".join(filter(None, (verdict.claim, verdict.variant)))
            outcome = f"printed {verdict.printed}; came out {verdict.outcome}"
            console.print(word + f"{claim}: {outcome}")
    for result in results:
        for remark in result.remarks:
            console.print(f"* {remark}")
    for standing in standings:
        console.print(f"{standing.experiment.id}: {standing.state}")


def sample(what: str, /, *, out: Path | None = None, force: bool = False) -> None:
    """Bring a recording to try, and say what to do with it: fish or swarm.

    `fish`: five zebrafish for a minute, as idTracker wrote them. `swarm`: eleven robots that gather, simulated.

    Examples:

      turing-learning sample fish
      turing-learning sample swarm --out mine.csv

    :param what: fish or swarm.
    :param out: File to write; fish.txt or swarm.csv by default.
    :param force: Replace a file that exists.
    """
    from turing_learning._files import write_atomically
    from turing_learning.targets import refuse_target

    choice("sample", what, ("fish", "swarm"))
    if what == "fish":
        path = out or Path("fish.txt")
        options = FISH
        remarks = (
            "Five zebrafish, an excerpt of an example of Tracktor (Sridhar, Roche and Gingins 2019; MIT licence).",
            "Frame rate and scale are not stated: 30 frames/s and 20 pixels/cm are assumptions.",
        )
    else:
        path = out or Path("swarm.csv")
        options = SWARM
        remarks = (
            "Eleven robots of the scenario aggregation, simulated: vl0 = -0.7, vr0 = -1, vl1 = 1, vr1 = -1.",
            "They gather for 40 s, driving backwards, as `infer` will remark.",
        )
    refuse_target(path, name="out", suffixes=(path.suffix,), force=force)
    if what == "fish":
        packed = files(__package__).joinpath("samples/zebrafish.txt.gz").read_bytes()
        write_atomically(path, gzip.decompress(packed))
    else:
        write_atomically(path, _swarm_table().encode())
    for remark in remarks:
        print(remark)
    print(f"Now: turing-learning infer --trajectories {shlex.quote(str(path))} {options}")


def _swarm_table() -> str:
    """Return a simulated swarm as a table with a heading (CSV)."""
    import numpy as np

    scenario = tl.swarm.AGGREGATION
    start = tl.swarm.initial_poses(scenario, 1, np.random.default_rng(1))
    controllers = np.broadcast_to(scenario.controller, (*start.shape[:2], 4))
    steps = round(SWARM_S / scenario.trial.control_interval_s)
    trial = tl.swarm.simulate(scenario, controllers, start, control_steps=steps, seed=1)
    lines = ["frame,id,x,y,heading"]
    for frame, poses in enumerate(trial.poses[0]):
        for robot, (x, y, heading) in enumerate(poses):
            lines.append(f"{frame},{robot},{x:.3f},{y:.3f},{heading:.4f}")
    return "\n".join([*lines, ""])


def warm_up() -> None:
    """Compile everything now, once on this machine, so that no later run waits for it. Takes a minute or two."""
    short: dict[str, Any] = {"scenario.trial.duration_s": 1.0}
    few = short | {"models.population": 8, "classifiers.population": 8, "run.generations": 1}
    compiled = {
        "a swarm": few,
        "a field of view": few | {"scenario.representation": "morphology"},
        "networks": few | {"models.hidden": 3},
        "a crowd": few | {"scenario.agents": 50},
        "a budget in trials": short | {"run.trials": 20},
    }
    with TemporaryDirectory() as folder:
        for name, settings in compiled.items():
            print(name, flush=True)
            tl.infer("aggregation", settings=settings, out=Path(folder) / name, progress=False)
    print("ready")


def docs(page: str | None = None, /) -> None:
    """Print a page of the documentation, or the list of pages.

    Examples:

      turing-learning docs
      turing-learning docs scenarios

    :param page: Name of a page, as scenarios or docs/scenarios.md.
    """
    from rich.markdown import Markdown

    pages = _pages()
    if page is None:
        for name, path in pages.items():
            print(f"{name:28} {_title(path)}")
        return
    name = page.removeprefix("docs/").removesuffix(".md")
    text = pages[choice("page", name, pages)].read_text("utf-8")
    console = plain_console()
    if console.is_terminal:
        console.print(Markdown(text))
    else:
        print(text, end="")


def _pages() -> dict[str, Path]:
    """Return name -> path of the pages of the documentation."""
    folder = Path(str(files("turing_learning") / "_docs"))
    # beside the code in a repository
    if not folder.is_dir():
        folder = Path(__file__).parents[3] / "docs"
    pages = {}
    for pattern in PAGES:
        for path in sorted(folder.glob(pattern)):
            pages[str(path.relative_to(folder).with_suffix(""))] = path
    if not pages:
        got = f"nothing in {folder}"
        refuse("docs", "be installed with the package", got, "Install the package again.")
    return pages


def _title(page: Path) -> str:
    for line in page.read_text("utf-8").splitlines():
        if line.startswith("# "):
            return line[2:]
    return ""
