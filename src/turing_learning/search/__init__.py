"""Search the controller with which a swarm gathers best, on a grid: how the paper's agents got theirs.

`search_controller`
    The search, resumable; `SearchSettings` says how large it is, `SearchResult` holds the best, best first;
    an observer is told of `SearchProgress`.
`grid_controllers`, `mirrored`
    All controllers on a grid, one of each mirror pair.
`gathering_costs`
    How badly controllers gather: their dispersion over a trial, weighted by time.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._cost import gathering_costs
    from ._grid import grid_controllers, mirrored
    from ._search import SearchProgress, SearchResult, search_controller
    from ._settings import SearchSettings

__all__ = [
    "SearchProgress",
    "SearchResult",
    "SearchSettings",
    "gathering_costs",
    "grid_controllers",
    "mirrored",
    "search_controller",
]

_HOMES = {
    "SearchProgress": "_search",
    "SearchResult": "_search",
    "SearchSettings": "_settings",
    "gathering_costs": "_cost",
    "grid_controllers": "_grid",
    "mirrored": "_grid",
    "search_controller": "_search",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that the room is cheap to import."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
