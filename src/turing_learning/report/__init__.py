"""Reports: a run, or a single trial, as a page or film that anybody can open. Nothing is computed here.

`report_page`
    A whole run as one HTML file without outside parts, from a `RunReport`: its `RunTable` of `ParameterRow`, its
    `Picture` figures, configuration, manifest, and replay.
`study_page`
    A study of many runs as one HTML file, from a `StudyReport` of `Listing` tables and `Picture` figures.
`replay_page`
    A page with nothing but a `Replay`: one or more `Swarm`, side by side.
`write_gif`, `write_mp4`
    A `Replay` as film.
`write_page`
    Write a page so that it appears whole or not at all.
`is_page`
    Whether a file is such a page.
`describe_selection`
    In words, in which generations selection stopped.
`describe_unknown`
    In words, of which parameters an interval is not known, and why.
`short_number`, `shown`, `counted`
    A number in a few characters, with significant digits where it is small; a number in a table, or a dash where there is none;
    a number of things, in words.
"""

from ._film import write_gif, write_mp4
from ._listing import Listing
from ._numbers import counted, describe_unknown, short_number, shown
from ._page import is_page, replay_page, report_page, write_page
from ._replay import Replay, Swarm
from ._run import ParameterRow, RunReport, RunTable, describe_selection
from ._study import StudyReport, study_page

__all__ = [
    "Listing",
    "ParameterRow",
    "Replay",
    "RunReport",
    "RunTable",
    "StudyReport",
    "Swarm",
    "counted",
    "describe_selection",
    "describe_unknown",
    "is_page",
    "replay_page",
    "report_page",
    "short_number",
    "shown",
    "study_page",
    "write_gif",
    "write_mp4",
    "write_page",
]
