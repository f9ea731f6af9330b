"""The command that makes a Turing test for people."""

from pathlib import Path

import turing_learning as tl
from turing_learning.errors import RefusedError, refuse, refusing_as

from ._open import opened, system_of
from ._options import Against, Integer, Real, Recording


def game(
    run: Path,
    /,
    *more: Path,
    against: Against = Against(),  # noqa: B008 - frozen
    pairs: Integer = 6,
    length: Real | None = None,
    seed: Integer = 0,
    title: str = "Which one is real?",
    recording: Recording = Recording(),  # noqa: B008 - frozen
    out: Path | None = None,
    force: bool = False,
) -> None:
    """Write a page on which people say which of two replays is real: a Turing test for them.

    Of a run: what it has not learned from, beside its estimate. Or of two sets of recordings. The page works offline, by
    mouse, touch or keyboard. It saves the answers as CSV, which `turing_learning.examination.pool_answers` pools.

    Examples:

      turing-learning game runs/fish
      turing-learning game fish.csv --against simulated.csv --fps 25 --pixels-per-cm 20 --out game.html

    :param run: A run folder; with --against a recording of the real thing.
    :param more: Further recordings.
    :param pairs: Number of pairs; 6 by default.
    :param length: Duration of a replay (s); by default 8, less where recordings have gaps, 60 of robots, ten times as fast.
    :param seed: Seed of all that is drawn, also of the sides; 0 by default.
    :param title: Heading of the page.
    :param out: Page (.html) to write; RUN-game.html in this folder by default.
    :param force: Replace a file that exists.
    """
    from turing_learning.report import is_page
    from turing_learning.targets import refuse_target

    page = out or Path(f"{run.absolute().stem}-game.html")
    # A page that an earlier game has written here may be replaced; a file that somebody names may not.
    refuse_target(
        page, name="out", suffixes=(".html",), force=force, replaceable=lambda path: not out and is_page(path)
    )  # fmt: skip
    if against.against is None:
        remedy = "Give the simulated recordings with --against."
        if more or not tl.runs.RunFolder(run).is_run():
            refuse("RUN", "be a run folder", str(run), remedy)
        against.refuse_beside("be left out for a run", remedy)
        system = system_of(run, recording, "comparison.game_of_run(load_run({run}), genuine=...)")
        made = tl.comparison.game_of_run(
            opened(run),
            **system,
            longest_rest_s=recording.longest_rest,
            pairs=pairs,
            length_s=length,
            seed=seed,
            title=title,
        )
    else:
        real = [recording.read(path, "RUN") for path in (run, *more)]
        simulated = against.read(recording)
        options = {} if length is None else {"length_s": length}
        with refusing_as(RefusedError):
            made = tl.examination.game(
                real,
                simulated,
                pairs=pairs,
                smooth_frames=recording.smooth or 1,
                seed=seed,
                title=title,
                **options,
            )
    print(tl.report.write_page(tl.report.game_page(made), page))
