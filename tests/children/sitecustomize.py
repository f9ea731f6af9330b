"""Python imports this first in the processes that tests start; see `pytest_runtest_protocol` in tests/conftest.py."""

import sys
from importlib.machinery import PathFinder

from blank_figures import blanks


class BlankFigures(PathFinder):
    """Changes Matplotlib when it is imported: many processes of the suite never do."""

    @classmethod
    def find_spec(cls, name, path=None, target=None):
        """Return how to import Matplotlib's figures."""
        if name != "matplotlib.figure":
            return None
        spec = super().find_spec(name, path, target)
        execute = spec.loader.exec_module

        def exec_module(module):
            execute(module)
            for method, blank in blanks(module.Figure).items():
                setattr(module.Figure, method, blank)

        spec.loader.exec_module = exec_module
        return spec


sys.meta_path.insert(0, BlankFigures)
