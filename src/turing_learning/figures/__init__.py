"""Figures: arrays in, pictures out. Nothing is computed here beyond the medians and quartiles that a figure shows.

`box_figure`
    Parameters that many runs have inferred, as boxes.
`timeline_figure`
    Which individuals behave abnormally, and when.
`swarm_frame`
    One moment of a swarm, drawn on given axes.
`save_figure`
    A figure as PNG and SVG files.
`Picture`
    A figure with its name and words, for files and pages.

Figures are `matplotlib.figure.Figure` objects without pyplot and without global state; matplotlib
is imported when the first one is made. The figures that only the package itself draws are in the
modules `one_run`, `recordings`,
`many_runs` and `swarms`, their look is in `style`; their callers give arrays of the right shape.
"""

from ._picture import Picture, save_figure
from .many_runs import box_figure
from .one_run import timeline_figure
from .swarms import swarm_frame

__all__ = ["Picture", "box_figure", "save_figure", "swarm_frame", "timeline_figure"]
