"""Recorded motion: who was where at which frame, and what the classifiers get to see of it.

==========================  =====================================================================================
`load_trajectories`         Open a tracker's file; `FORMATS` names the formats. `load_file` takes `Options`.
`Trajectories`              The recording: positions in cm with y upwards, who is present, frame rate; `check()`,
                            `bridged()`, `thinned()`, `speeds()`, `signals()`, `windows()`, `to_xarray()`.
`from_xarray`               A dataset in the conventions of the `movement` package, as `Trajectories`.
`Look`, `Reading`           What `look()` returns: how a file was read, what is odd about it, pictures, a page.
`Problems`                  What `check()` finds: missing values, jumps, repeated and empty frames, odd headings, direction of y.
`compute_signals`           Positions to signals, for recordings and for simulators alike; `SIGNALS` names them, `DIRECTED` those
                            that depend on headings. `filled`, `smooth` and `wrap` are steps on the way.
`nearest_others`            Where everybody's nearest other individual is.
`next_true`                 When something is true next, such as that an individual is there.
`response_maps`             How individuals respond to the nearest other and to walls: `ResponseMaps`, drawn by `response_figure`.
`LONGEST_REST_S`            Rest at exactly one point beyond which positions stand for missing ones.
`pooled_windows`            Samples of several recordings; `join_windows` joins those that are cut.
`origin_of`                 A digest of the recordings that windows were cut from, and how.
`Signals`, `Windows`        Signals with the steps at which they exist; samples for learning and for testing.
==========================  =====================================================================================

Names are listed in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
