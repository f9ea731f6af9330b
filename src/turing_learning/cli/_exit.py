"""How a command ends."""

DONE, FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""


class Interrupted(Exception):
    """A run was stopped and can be resumed."""
