"""Search the controller with which a swarm gathers best, on a grid: how the paper's agents got theirs.

`search_controller`
    The search, resumable; `SearchSettings` says how large it is, `SearchResult` holds the best, best first.
`mirrored`
    Controllers with left and right exchanged.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
