"""The command that repeats the experiments of the paper."""

from pathlib import Path

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

    Parameters
    ----------
    experiment
        Section of the paper, or all; without it, the experiments are listed.
    fast
        A small form, in seconds, which shows that it works.
    out
        Folder of the experiments; experiments/ by default.
    workers
        Number of worker processes; one for each processor by default.
    page
        Write the page of all claims (Markdown) to this file as well, and that of each experiment.
    force
        Let --page replace a file that is no such page.
    """
    from rich.text import Text

    from turing_learning.reproduction import Stopped, default_folder, refuse_page_path, standings, write_page
    from turing_learning.reproduction import reproduce as conduct
    from turing_learning.results import RunFolderError
    from turing_learning.store import told

    from ._tables import plain_console, print_table

    if page is not None:
        refuse_page_path(page, force=force, name="page")
    elif force:
        remedy = "Add --page, or leave --force out."
        refuse("force", "be given with a page, which it may replace", "it alone", remedy)
    console = plain_console()
    if experiment is None:
        known = [(each.experiment, each.state) for each in standings(out, fast=fast)]
        rows = [(one.id, one.title, one.cost, state) for one, state in known]
        print_table(console, ("experiment", "title", "cost", "state"), rows)
    else:
        ahead = "the same command resumes"
        try:
            with stopping(ahead) as should_stop:
                done = conduct(experiment, fast=fast, out=out, workers=workers, should_stop=should_stop, say=print)
        except Stopped as error:
            raise Interrupted(f"stopped at {error}; {ahead}") from error
        for verdict in (verdict for one in done if one.results is not None for verdict in one.results.verdicts):
            word = Text(f"{verdict.word:8}", style="green" if verdict.agrees else "bold red")
            what = " ".join(filter(None, (verdict.claim, verdict.variant)))
            console.print(word + f"{what}: printed {verdict.printed}; came out {verdict.outcome}")
        for remark in (text for one in done if one.results is not None for text in one.results.remarks):
            console.print(f"* {remark}")
        for one in done:
            console.print(f"{one.experiment.id}: {one.state}")
    if page is not None:
        with told(RunFolderError, f"`page` must be a file that can be written; got {page}", "Choose another place."):
            print(write_page(out or default_folder(fast=fast), page, force=force))
