"""Recorded motion: who was where at which frame, and what the classifiers get to see of it.

==========================  =====================================================================================
`load_trajectories`         Open a tracker's file; `FORMATS` names the formats. `load_file` takes `Options`.
`Trajectories`              The recording: positions in cm with y upwards, who is present, frame rate; `check()`,
                            `bridged()`, `thinned()`, `speeds()`, `signals()`, `windows()`, `to_xarray()`.
`from_xarray`               A dataset in the conventions of the `movement` package, as `Trajectories`.
`Problems`                  What `check()` finds: missing values, jumps, repeated and empty frames, odd headings, direction of y.
`compute_signals`           Positions to signals, for recordings and for simulators alike; `SIGNALS` names them, `DIRECTED` those
                            that depend on headings. `filled`, `smooth` and `wrap` are steps on the way.
`LONGEST_REST_S`            Rest at exactly one point beyond which positions stand for missing ones.
`pooled_windows`            Samples of several recordings; `join_windows` joins those that are cut.
`Signals`, `Windows`        Signals with the steps at which they exist; samples for learning and for testing.
==========================  =====================================================================================
"""

from ._load import FORMATS, from_xarray, load_file, load_trajectories
from ._recording import Options, Problems
from ._signals import DIRECTED, SIGNALS, Signals, compute_signals, filled, smooth, wrap
from ._trajectories import Trajectories, pooled_windows
from ._unlikely import LONGEST_REST_S
from ._windows import Windows, join_windows

__all__ = [
    "DIRECTED", "FORMATS", "LONGEST_REST_S", "SIGNALS", "Options", "Problems", "Signals", "Trajectories", "Windows",
    "compute_signals", "filled", "from_xarray", "join_windows", "load_file", "load_trajectories",
    "pooled_windows", "smooth", "wrap",
]  # fmt: skip
