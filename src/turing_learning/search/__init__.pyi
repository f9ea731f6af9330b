from ._search import SearchProgress as SearchProgress
from ._search import SearchResult as SearchResult
from ._search import SearchSettings as SearchSettings
from ._search import gathering_costs as gathering_costs
from ._search import grid_controllers as grid_controllers
from ._search import mirrored as mirrored
from ._search import search_controller as search_controller
