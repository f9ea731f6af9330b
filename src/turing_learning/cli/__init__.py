"""The command line: parse, call, print.

`main` is the entry point of ``turing-learning``. `_app` lists the commands; those of runs and studies, of robots and of
detection have a module each; `_beside` has the others. The docstring of a command is its help, with a line for each
option. `_options` has what they share, `_live` the live views, `_tables` the tables, `_stopping` what Ctrl-C does,
and the names of options in messages. Exit codes: 0 done; 2 rejected before anything ran; 130 interrupted, can be
resumed; 1 anything else.
"""

from ._main import main

__all__ = ["main"]
