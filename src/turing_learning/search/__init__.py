"""Search the controller with which a swarm gathers best, on a grid: how the paper's agents got theirs.

`search_controller`
    The search, resumable; `SearchSettings` says how large it is, `SearchResult` holds the best, best first;
    an observer is called with a `SearchProgress`.
`grid_controllers`, `mirrored`
    All controllers on a grid, one of each mirror pair.
`gathering_costs`
    How badly controllers gather: their dispersion over a trial, weighted by time.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
