"""Reports: a run, a study or a single trial as a page or film that anybody can open. Nothing is computed here.

`replay_page`
    A page with nothing but a `Replay`: one or more `Swarm`, side by side, with `ShownItems`.
`write_gif`, `write_mp4`
    A `Replay` as film.
`Game`, `game_page`
    Pairs of motion, one of which is real, and the page that asks people which.
`write_page`
    Write a page so that it appears complete or not at all.
`short_number`, `shown`, `counted`
    A number in a few characters, with significant digits where it is small; a number in a table, or
    a dash where there is none; a number of things, in words.
`Tabular`, `Judged`
    A result with a short `repr` and a table in notebooks; one that ends in a verdict.

`report_page`
    The page of a run, a study or a detection: a `Report` has what it shows, with a `Listing` for
    each table;
    `describe_selection` says what happened in a selection, `is_page` whether a file is such a page.

The module `tabular` has tables of parameters, for terminals and data frames.
"""

from ._game import Game, game_page
from ._page import (
    Listing,
    Report,
    describe_selection,
    is_page,
    replay_page,
    report_page,
    write_page,
)
from ._replay import Replay, ShownItems, Swarm, write_gif, write_mp4
from .tabular import Judged, Tabular, counted, short_number, shown

__all__ = [
    "Game", "Judged", "Listing", "Replay", "Report", "ShownItems", "Swarm", "Tabular", "counted", "describe_selection",
    "game_page", "is_page", "replay_page", "report_page", "short_number", "shown", "write_gif", "write_mp4", "write_page",
]  # fmt: skip
