"""The commands beside runs: reproduce, sample, warm-up, docs."""

import gzip
import shlex
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import turing_learning as tl
from turing_learning.errors import choice, refuse

from ._options import Integer
from ._stopping import Interrupted, stopping
from ._tables import plain_console, print_table

FISH = (
    "--fps",
    "30",
    "--scale",
    "20",
    "--every",
    "3",
    "--bridge",
    "5",
    "--model",
    "burst-and-coast",
)
SWARM = ("--fps", "10", "--scale", "1", "--y-axis", "up", "--model", "robots")
SWARM_S = (
    40.0  # they still gather; from 120 s the estimate was off, likely because replicas start apart
)
PARTS = ("*.md", "examples/*.md", "robots/*.md")  # of the documentation, which the wheel has, too


def reproduce(
    experiment: str | None = None,
    /,
    *,
    fast: bool = False,
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
    :param out: Folder of the experiments; experiments/ by default.
    :param workers: Number of worker processes; one for each processor by default.
    :param page: Write the page of all claims (Markdown) to this file as well, and that of each experiment.
    :param force: Let --page replace a file that is no such page.
    """
    from rich.text import Text

    from turing_learning.store import os_errors_as

    if page is not None:
        tl.reproduction.refuse_page_path(page, force=force, name="page")
    elif force:
        remedy = "Add --page, or leave --force out."
        refuse("force", "be given with a page, which it may replace", "it alone", remedy)
    console = plain_console()
    if experiment is None:
        known = [
            (each.experiment, each.state) for each in tl.reproduction.standings(out, fast=fast)
        ]
        rows = [(one.id, one.title, one.cost, state) for one, state in known]
        print_table(console, ("experiment", "title", "cost", "state"), rows)
    else:
        ahead = "the same command resumes"
        try:
            with stopping(ahead) as should_stop:
                done = tl.reproduction.reproduce(
                    experiment,
                    fast=fast,
                    out=out,
                    workers=workers,
                    should_stop=should_stop,
                    say=print,
                )
        except tl.reproduction.Stopped as error:
            raise Interrupted(f"stopped at {error}; {ahead}") from error
        results = [one.results for one in done if one.results is not None]
        for verdict in (verdict for each in results for verdict in each.verdicts):
            word = Text(f"{verdict.word:8}", style="green" if verdict.agrees else "bold red")
            what = " ".join(filter(None, (verdict.claim, verdict.variant)))
            console.print(word + f"{what}: printed {verdict.printed}; came out {verdict.outcome}")
        for remark in (text for each in results for text in each.remarks):
            console.print(f"* {remark}")
        for one in done:
            console.print(f"{one.experiment.id}: {one.state}")
    if page is not None:
        what = f"`page` must be a file that can be written; got {page}"
        with os_errors_as(tl.results.RunFolderError, what, "Choose another place."):
            print(
                tl.reproduction.write_page(
                    out or tl.reproduction.default_folder(fast=fast), page, force=force
                )
            )


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
    import numpy as np

    from turing_learning._files import write_atomically
    from turing_learning.targets import refuse_target

    choice("sample", what, ("fish", "swarm"))
    path = out or Path("fish.txt" if what == "fish" else "swarm.csv")
    refuse_target(path, name="out", suffixes=(path.suffix,), force=force)
    if what == "fish":
        packed = files(__package__).joinpath("samples/zebrafish.txt.gz").read_bytes()
        write_atomically(path, gzip.decompress(packed))
        print(
            "Five zebrafish, an excerpt of an example of Tracktor (Sridhar, Roche and Gingins 2019; MIT licence)."
        )
        print("Frame rate and scale are not stated: 30 frames/s and 20 pixels/cm are assumptions.")
    else:
        scenario = tl.swarm.AGGREGATION
        poses = tl.swarm.initial_poses(scenario, 1, np.random.default_rng(1))
        controllers = np.broadcast_to(scenario.controller, (*poses.shape[:2], 4))
        steps = round(SWARM_S / scenario.trial.control_interval_s)
        moved = tl.swarm.simulate(scenario, controllers, poses, control_steps=steps, seed=1).poses[
            0
        ]
        robots = (
            (t, who, *pose) for t, poses in enumerate(moved) for who, pose in enumerate(poses)
        )
        rows = (f"{t},{who},{x:.3f},{y:.3f},{angle:.4f}" for t, who, x, y, angle in robots)
        write_atomically(path, "\n".join(("frame,id,x,y,heading", *rows, "")).encode())
        print(
            "Eleven robots of the scenario aggregation, simulated: vl0 = -0.7, vr0 = -1, vl1 = 1, vr1 = -1."
        )
        print("They gather for 40 s, driving backwards, as `infer` will remark.")
    options = shlex.join(FISH if what == "fish" else SWARM)
    print(f"Now: turing-learning infer --trajectories {shlex.quote(str(path))} {options}")


def warm_up() -> None:
    """Compile everything now, once on this machine, so that no later run waits for it. Takes a minute or two."""
    short: dict[str, Any] = {"scenario.trial.duration_s": 1.0}
    few = short | {"models.population": 8, "classifiers.population": 8, "run.generations": 1}
    kinds = {
        "a swarm": few,
        "a field of view": few | {"scenario.representation": "morphology"},
        "networks": few | {"models.hidden": 3},
        "a crowd": few | {"scenario.agents": 50},
        "a budget in trials": short | {"run.trials": 20},
    }
    with TemporaryDirectory() as folder:
        for name, settings in kinds.items():
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

    top = Path(str(files("turing_learning") / "_docs"))
    top = (
        top if top.is_dir() else Path(__file__).parents[3] / "docs"
    )  # beside the code in a repository
    pages = {
        str(path.relative_to(top).with_suffix("")): path
        for part in PARTS
        for path in sorted(top.glob(part))
    }
    if not pages:
        refuse(
            "docs",
            "be installed with the package",
            f"nothing in {top}",
            "Install the package again.",
        )
    if page is None:
        for name, path in pages.items():
            title = next(
                (
                    line[2:]
                    for line in path.read_text("utf-8").splitlines()
                    if line.startswith("# ")
                ),
                "",
            )
            print(f"{name:28} {title}")
        return
    name = page.removeprefix("docs/").removesuffix(".md")
    text = pages[choice("page", name, pages)].read_text("utf-8")
    console = plain_console()
    console.print(Markdown(text)) if console.is_terminal else print(text, end="")
