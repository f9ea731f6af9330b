"""The command that says how a file is read, before anything is learned from it."""

from pathlib import Path

from turing_learning.errors import refuse

from ._options import Tracks
from ._tables import plain_console

ASSUMED = {"fps": 1.0, "scale": "unknown", "y_axis": "up", "words": "NOT STATED: say it"}
"""What stands for what neither the file nor the options state, and what is said then."""


def look(
    file: list[Path],
    /,
    *,
    tracks: Tracks = Tracks(),  # noqa: B008 - frozen
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Say how a tracker's file is read and what looks odd, and draw tracks and distributions: look before you infer.

    Give the same options to `infer`. What neither file nor options state is marked.

    Examples:

      turing-learning look fish.csv
      turing-learning look fish.csv --fps 25 --pixels-per-cm 12.3 --column id=track --out fish.html

    :param file: A file of a tracker, or several.
    :param out: Page (.html) to write; FILE-look.html in this folder by default.
    :param force: Replace a file that exists and is no such page.
    """
    from turing_learning.report import is_page
    from turing_learning.targets import refuse_target

    if out is not None and len(file) > 1:
        refuse("--out", "be left out for several files", str(out), "Each has a page of its own.")
    console = plain_console()
    for number, path in enumerate(file):
        page = out or Path(f"{path.stem}-look.html")
        replaced = force or (page.is_file() and is_page(page))
        refuse_target(page, name="out", suffixes=(".html",), force=replaced)
        overview = tracks.read(path, "FILE", ASSUMED).look()
        if number:
            console.print()
        console.print(str(overview), soft_wrap=True)
        console.print(f"page: {overview.save(page)}", soft_wrap=True)
