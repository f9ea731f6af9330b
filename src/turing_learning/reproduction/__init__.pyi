from ._experiment import Stopped as Stopped
from ._page import refuse_page_path as refuse_page_path
from ._page import write_page as write_page
from ._reproduce import Standing as Standing
from ._reproduce import default_folder as default_folder
from ._reproduce import reproduce as reproduce
from ._reproduce import standings as standings
