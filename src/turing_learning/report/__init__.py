"""Reports: a run, a study or a single trial as a page or film that anybody can open. Nothing is computed here.

`replay_page`
    A page with nothing but a `Replay`: one or more `Swarm`, side by side.
`write_gif`, `write_mp4`
    A `Replay` as film.
`write_page`
    Write a page so that it appears complete or not at all.
`short_number`, `shown`, `counted`
    A number in a few characters, with significant digits where it is small; a number in a table, or a dash
    where there is none; a number of things, in words.
`Tabular`
    A result with a short `repr` and a table in notebooks.

The pages of runs, studies and detections are in `_page`: a `Report` has what they show.
"""

from ._page import replay_page, write_page
from ._replay import Replay, Swarm, write_gif, write_mp4
from ._tabular import Tabular, counted, short_number, shown

__all__ = [
    "Replay", "Swarm", "Tabular", "counted", "replay_page", "short_number", "shown", "write_gif",
    "write_mp4", "write_page",
]  # fmt: skip
