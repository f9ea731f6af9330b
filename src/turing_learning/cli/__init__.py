"""The command line: parse, call, print.

`main` is the entry point of ``turing-learning``. Commands live in `_app` and `_study`, the live views in `_live` and
`_study_view`, tables in `_tables`, what Ctrl-C does in `_signals`, and what is said to callers from Python in the words of
options in `_wording`. Exit codes: 0 done; 2 refused before anything ran; 130 interrupted, can be resumed; 1 anything else.
"""

from ._main import main

__all__ = ["main"]
