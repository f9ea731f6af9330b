"""The experiments of the paper, repeated, and held against what it prints.

`reproduce` conducts experiments until they are complete or `Stopped`; `standings` returns the
`Standing` of each, and `default_folder` where they are. `write_page` writes the page of all claims,
and `refuse_page_path` rejects paths where it may not.

Names are listed in ``__init__.pyi`` and imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
