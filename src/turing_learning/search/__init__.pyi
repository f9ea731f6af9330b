from ._search import SearchResult as SearchResult
from ._search import SearchSettings as SearchSettings
from ._search import mirrored as mirrored
from ._search import search_controller as search_controller
