"""The command that repeats the experiments of the paper."""

from pathlib import Path

import turing_learning as tl
from turing_learning.errors import refuse

from ._options import Integer
from ._stopping import Interrupted, stopping


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

    from turing_learning.store import told

    from ._tables import plain_console, print_table

    if page is not None:
        tl.reproduction.refuse_page_path(page, force=force, name="page")
    elif force:
        remedy = "Add --page, or leave --force out."
        refuse("force", "be given with a page, which it may replace", "it alone", remedy)
    console = plain_console()
    if experiment is None:
        known = [(each.experiment, each.state) for each in tl.reproduction.standings(out, fast=fast)]
        rows = [(one.id, one.title, one.cost, state) for one, state in known]
        print_table(console, ("experiment", "title", "cost", "state"), rows)
    else:
        ahead = "the same command resumes"
        try:
            with stopping(ahead) as should_stop:
                done = tl.reproduction.reproduce(
                    experiment, fast=fast, out=out, workers=workers, should_stop=should_stop, say=print
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
        with told(tl.results.RunFolderError, what, "Choose another place."):
            print(tl.reproduction.write_page(out or tl.reproduction.default_folder(fast=fast), page, force=force))
