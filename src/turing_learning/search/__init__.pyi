from ._grid import gathering_costs as gathering_costs
from ._grid import grid_controllers as grid_controllers
from ._grid import mirrored as mirrored
from ._search import SearchProgress as SearchProgress
from ._search import SearchResult as SearchResult
from ._search import SearchSettings as SearchSettings
from ._search import search_controller as search_controller
